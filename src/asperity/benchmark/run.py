"""A solver run over the benchmark: a row a quantity and number of cells, and what they come to."""

import csv
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from asperity.benchmark.cases import BenchmarkCase, load_benchmark
from asperity.benchmark.solver import Solver
from asperity.core import files
from asperity.core.errors import AsperityError, BadInput

CELLS = (64, 128)
SHORT, TIMES = (
    1.0,
    3,
)  # s: so often a shorter solve is timed, as what else runs moves a short time most


@dataclass(frozen=True)
class BenchmarkRow:
    """One quantity of one case as a solver found it on a number of cells.

    `error` is relative to the certified value; `over_uncertainty` the same in units of its
    uncertainty, None where the solver itself is one of the value's two ways; `seconds` of a
    processor for the whole case, without what is loaded or compiled once, the least of three where
    it is under a second.
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
    """What a solver found: its rows, and cases that it could not or would not solve, with the reason."""

    solver: str
    rows: tuple[BenchmarkRow, ...]
    left_out: tuple[tuple[str, str], ...]

    def verdict(self) -> str:
        """The result in a sentence: of the finest cells, how many values, and how near."""
        if not self.rows:
            return f"{self.solver} solved none of the benchmark's cases."
        finest = max(row.cells for row in self.rows)
        errors = [abs(row.error) for row in self.rows if row.cells == finest]
        cases = len({row.case for row in self.rows})
        return (
            f"{self.solver} on {finest} cells: {len(errors)} certified values of {cases} cases, median error "
            f"{100.0 * float(np.median(errors)):.2g} %, largest {100.0 * max(errors):.2g} %; "
            f"{len(self.left_out)} cases left out."
        )

    def scalars(self) -> dict[str, Any]:
        """As `--json` gives it."""
        left = [{"case": case, "reason": reason} for case, reason in self.left_out]
        return {
            "verdict": self.verdict(),
            "solver": self.solver,
            "rows": [asdict(row) for row in self.rows],
            "left_out": left,
        }

    def save(self, path: Path) -> Path:
        """Write the rows as csv."""
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
    """Solve every case that the solver takes, on each number of cells along x.

    Raises
    ------
    BadInput
        for fewer than 8 cells, and for a folder without cases.
    """
    if min(cells, default=0) < 8:
        raise BadInput(f"--cells must be at least 8, got {min(cells, default=0)}; take 64 and 128")
    rows: list[BenchmarkRow] = []
    left_out: list[tuple[str, str]] = []
    warm: set[tuple[str, Any]] = set()
    for case in load_benchmark(folder):
        if progress is not None:
            progress(case.name)
        if case.kind not in solver.kinds:
            left_out.append((case.name, f"{solver.name} takes no case of kind {case.kind}"))
            continue
        found: list[BenchmarkRow] = []
        reason = f"{solver.name} gives none of its quantities"
        for count in sorted(cells):
            try:
                if (what := (case.kind, case.given.get("geometry"))) not in warm:
                    solver.solve(
                        case.given, count
                    )  # so that no clock counts what is loaded and compiled once
                    warm.add(what)
                found += _solved(solver, case, count)
            except AsperityError as error:  # of cells that are too few, say; more may do
                reason = str(error)
        rows += found
        if not found:
            left_out.append((case.name, reason))
    return BenchmarkResult(solver.name, tuple(rows), tuple(left_out))


def _solved(solver: Solver, case: BenchmarkCase, cells: int) -> Iterator[BenchmarkRow]:
    found, seconds = _timed(solver, case, cells)
    while len(seconds) < TIMES and min(seconds) < SHORT:
        seconds += _timed(solver, case, cells)[1]
    for entry in case.certified:
        if entry.quantity in found:
            off = float(found[entry.quantity]) - entry.value
            yield BenchmarkRow(
                case.name,
                entry.quantity,
                entry.unit,
                cells,
                float(found[entry.quantity]),
                entry.value,
                entry.uncertainty,
                off / abs(entry.value),
                None
                if any(way.lower().startswith(solver.name) for way in entry.ways)
                else off / entry.uncertainty,
                min(seconds),
            )


def _timed(
    solver: Solver, case: BenchmarkCase, cells: int
) -> tuple[Mapping[str, float], list[float]]:
    began = time.process_time()
    found = solver.solve(case.given, cells)
    return found, [time.process_time() - began]
