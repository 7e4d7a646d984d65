"""Run of a solver over the benchmark: one row per quantity and number of cells, and a summary."""

import csv
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from io import StringIO
from pathlib import Path

import numpy as np

from asperity.benchmark.cases import BenchmarkCase, load_benchmark
from asperity.benchmark.solver import Solver
from asperity.core import files
from asperity.core.errors import AsperityError, BadInput

CELLS = (64, 128)
SHORT_S, REPEATS = (
    1.0,
    3,
)  # shorter solves are timed repeatedly, since other load disturbs them most


@dataclass(frozen=True)
class BenchmarkRow:
    """Quantity of a case as computed by a solver with a number of cells.

    `error` is relative to the certified value; `over_uncertainty` is the error over its
    uncertainty, None if the solver is one of the two methods behind the value; `seconds` is the
    CPU time for the whole case without loading and compilation, the smallest of three if it
    is under a second.
    """

    case: str
    quantity: str
    unit: str
    cells: int
    found: float
    certified: float
    uncertainty: float
    error: float
    over_uncertainty: float | None
    seconds: float


@dataclass(frozen=True)
class BenchmarkResult:
    """Rows of a solver, and the cases it did not solve, with the reason."""

    solver: str
    rows: tuple[BenchmarkRow, ...]
    left_out: tuple[tuple[str, str], ...]

    def verdict(self) -> str:
        """Return one sentence: number of values and their errors at the finest resolution."""
        if not self.rows:
            return f"{self.solver} solved none of the benchmark's cases."
        finest = max(row.cells for row in self.rows)
        errors = [abs(row.error) for row in self.rows if row.cells == finest]
        cases = len({row.case for row in self.rows})
        return (
            f"{self.solver} on {finest} cells: {len(errors)} certified values of {cases} cases, "
            f"median error {100.0 * float(np.median(errors)):.2g} %, largest "
            f"{100.0 * max(errors):.2g} %; {len(self.left_out)} cases not solved."
        )

    def scalars(self) -> dict[str, object]:
        """Return the result for `--json`."""
        omitted = [{"case": case, "reason": reason} for case, reason in self.left_out]
        return {
            "verdict": self.verdict(),
            "solver": self.solver,
            "rows": [asdict(row) for row in self.rows],
            "left_out": omitted,
        }

    def save(self, path: Path) -> Path:
        """Write the rows as CSV."""
        text = StringIO()
        writer = csv.DictWriter(text, list(BenchmarkRow.__annotations__), lineterminator="\n")
        writer.writeheader()
        writer.writerows(asdict(row) for row in self.rows)
        files.write_text(path, text.getvalue())
        return path


def run_benchmark(
    solver: Solver,
    *,
    folder: Path | None = None,
    cells: Sequence[int] = CELLS,
    progress: Callable[[str], None] | None = None,
) -> BenchmarkResult:
    """Solve every case of a kind that the solver supports, with each number of cells along x.

    Raises
    ------
    BadInput
        for fewer than 8 cells, or a folder without cases.
    """
    if min(cells, default=0) < 8:
        raise BadInput(f"--cells must be at least 8, got {min(cells, default=0)}; use 64 and 128")
    rows: list[BenchmarkRow] = []
    left_out: list[tuple[str, str]] = []
    warm: set[tuple[str, object]] = set()
    for case in load_benchmark(folder):
        if progress is not None:
            progress(case.name)
        if case.kind not in solver.kinds:
            left_out.append((case.name, f"{solver.name} does not support kind {case.kind}"))
            continue
        values: list[BenchmarkRow] = []
        reason = f"{solver.name} returns none of its quantities"
        for count in sorted(cells):
            try:
                if (variant := (case.kind, case.given.get("geometry"))) not in warm:
                    solver.solve(case.given, count)  # load and compile before timing
                    warm.add(variant)
                values += _solved(solver, case, count)
            except AsperityError as error:  # for instance too few cells; more may suffice
                reason = str(error)
        rows += values
        if not values:
            left_out.append((case.name, reason))
    return BenchmarkResult(solver.name, tuple(rows), tuple(left_out))


def _solved(solver: Solver, case: BenchmarkCase, cells: int) -> Iterator[BenchmarkRow]:
    values, seconds = _timed(solver, case, cells)
    while len(seconds) < REPEATS and min(seconds) < SHORT_S:
        seconds += _timed(solver, case, cells)[1]
    for entry in case.certified:
        if entry.quantity in values:
            deviation = float(values[entry.quantity]) - entry.value
            yield BenchmarkRow(
                case.name,
                entry.quantity,
                entry.unit,
                cells,
                float(values[entry.quantity]),
                entry.value,
                entry.uncertainty,
                deviation / abs(entry.value),
                None
                if any(method.lower().startswith(solver.name) for method in entry.ways)
                else deviation / entry.uncertainty,
                min(seconds),
            )


def _timed(
    solver: Solver, case: BenchmarkCase, cells: int
) -> tuple[Mapping[str, float], list[float]]:
    start = time.process_time()
    values = solver.solve(case.given, cells)
    return values, [time.process_time() - start]
