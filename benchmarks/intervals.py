"""Coverage of load-share intervals: 128 and 256 cells against 512, a hundred contacts of the wide
sample.

A contact counts if it converged on both grids and its interval is determined. This calibrates
`asperity.ehl.grid_error.grid_error`, whose factors were chosen on forty of these
contacts.
"""

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from asperity.ehl import ContactModel, Options, solve_contact
from asperity.solution import contact_state
from benchmarks.robustness import OIL, contacts, prepared

MODELS: tuple[ContactModel, ...] = ("mixed",)
COARSE, FINE = (128, 256), 512
# smallest difference with which an interval is compared; smaller ones are dominated by the
# solver's tolerance
SHOWN = 1e-3


@dataclass(frozen=True)
class Comparison:
    """A load share on one grid, its interval, and the load share on the finest grid."""

    number: int
    model: ContactModel
    cells: int
    clr: float
    low: float | None
    high: float | None
    true: float

    @property
    def inside(self) -> bool:
        return self.low is not None and self.high is not None and self.low <= self.true <= self.high

    @property
    def ratio(self) -> float:
        """Half-width of the interval over the difference."""
        assert self.low is not None
        assert self.high is not None
        return 0.5 * (self.high - self.low) / abs(self.true - self.clr)


def solved(
    number: int, model: ContactModel, cells: int
) -> tuple[float, float | None, float | None] | None:
    """Return load share and interval of one contact on one grid, or None without convergence."""
    conditions, surface = prepared(contacts()[number], cells, shown=COARSE[0])
    solution = solve_contact(conditions, OIL, surface, options=Options(model=model), strict=False)
    error = contact_state(solution).error
    if not solution.convergence.converged or error is None:
        return None
    return error.clr.value, error.clr.low, error.clr.high


def comparisons(count: int) -> Iterator[Comparison]:
    """Yield every `600/count`-th contact."""
    for contact in contacts()[:: 600 // count]:
        for model in MODELS:
            finest = solved(contact.number, model, FINE)
            for cells in COARSE if finest is not None else ():
                found = solved(contact.number, model, cells)
                if found is not None and finest is not None:
                    yield Comparison(contact.number, model, cells, *found, finest[0])


def lines(*, fast: bool, artefact: Path = Path("build/intervals.csv")) -> Iterator[str]:
    """Yield the table as Markdown; every contact goes into `artefact`."""
    results = list(comparisons(10 if fast else 100))
    artefact.parent.mkdir(exist_ok=True)
    with artefact.open("w", newline="") as file:
        names = list(Comparison.__dataclass_fields__)
        writer = csv.writer(file)
        writer.writerow(names)
        writer.writerows([getattr(result, name) for name in names] for result in results)
    yield "## Intervals of the load share against a finer grid"
    yield ""
    yield from table(results)


def table(results: list[Comparison]) -> Iterator[str]:
    """Yield the coverage of the finest grid and the interval's width relative to the difference."""
    yield (
        f"| model | cells | contacts | determined | {FINE} inside | half-width over difference,"
        " median |"
    )
    yield "|---|---|---|---|---|---|"
    for model in MODELS:
        for cells in COARSE:
            all_of = [
                result for result in results if (result.model, result.cells) == (model, cells)
            ]
            known = [result for result in all_of if result.low is not None]
            wide = [result.ratio for result in known if abs(result.true - result.clr) > SHOWN]
            inside = 100.0 * np.mean([result.inside for result in known]) if known else np.nan
            ratio = np.median(wide) if wide else np.nan
            yield (
                f"| {model} | {cells} | {len(all_of)} | {len(known)} | {inside:.0f} % |"
                f" {ratio:.1f} |"
            )
