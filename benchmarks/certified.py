"""Compare solvers with the benchmark's certified values: error and time by family of cases."""

from collections.abc import Iterator
from statistics import median

from asperity.benchmark import BenchmarkResult, run_benchmark, solver_named

SOLVERS = ("asperity", "tamaas", "contactmechanics")
CELLS = (64, 128, 256)


def lines(*, fast: bool) -> Iterator[str]:
    results = [
        run_benchmark(solver_named(name), cells=CELLS[:2] if fast else CELLS) for name in SOLVERS
    ]
    yield "## The benchmark's certified values"
    yield ""
    yield (
        "Errors relative to the certified value; CPU time per case, excluding imports and"
        " compilation."
    )
    yield ""
    yield (
        "| solver | cases | cells | values | median error [%] | largest [%] | of | median time [s]"
        " | largest [s] |"
    )
    yield "|---|---|---|---|---|---|---|---|---|"
    for result in results:
        yield from _rows(result)
    for case, reason in results[0].left_out:
        yield f"{case}: {reason}"


def _rows(result: BenchmarkResult) -> Iterator[str]:
    for family in dict.fromkeys(row.case.partition("-")[0] for row in result.rows):
        for cells in dict.fromkeys(row.cells for row in result.rows):
            rows = [
                row
                for row in result.rows
                if row.case.startswith(f"{family}-") and row.cells == cells
            ]
            if not rows:
                continue
            worst = max(rows, key=lambda row: abs(row.error))
            seconds = list({row.case: row.seconds for row in rows}.values())
            middle = 100 * median(abs(row.error) for row in rows)
            yield (
                f"| {result.solver} | {family} | {cells} | {len(rows)} | {middle:.2g} |"
                f" {100 * abs(worst.error):.2g} | {worst.case} {worst.quantity} |"
                f" {median(seconds):.2g} | {max(seconds):.2g} |"
            )
