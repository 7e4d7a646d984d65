"""Do the intervals hold what they say? Load shares on 128 and 256 cells against 512, a hundred of
the wide sample.

A contact counts where it converged on both grids and the interval is determined. The calibration
of `asperity.ehl.strategies.grid_continuation.grid_error`: its factors were chosen on forty of
these contacts.
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
# difference from which on an interval is compared with it: below, the solver's tolerance is what
# differs
SHOWN = 1e-3


@dataclass(frozen=True)
class Held:
    """A load share on one grid, its interval, and the finest grid's."""

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
        """Half the interval over the difference."""
        assert self.low is not None
        assert self.high is not None
        return 0.5 * (self.high - self.low) / abs(self.true - self.clr)


def solved(
    number: int, model: ContactModel, cells: int
) -> tuple[float, float | None, float | None] | None:
    """Load share and interval of one contact on one grid; None where it did not converge."""
    conditions, surface = prepared(contacts()[number], cells, shown=COARSE[0])
    solution = solve_contact(conditions, OIL, surface, options=Options(model=model), strict=False)
    error = contact_state(solution).error
    if not solution.convergence.converged or error is None:
        return None
    return error.clr.value, error.clr.low, error.clr.high


def held(count: int) -> Iterator[Held]:
    """Every `600/count`-th contact."""
    for contact in contacts()[:: 600 // count]:
        for model in MODELS:
            finest = solved(contact.number, model, FINE)
            for cells in COARSE if finest is not None else ():
                found = solved(contact.number, model, cells)
                if found is not None and finest is not None:
                    yield Held(contact.number, model, cells, *found, finest[0])


def lines(*, fast: bool, artefact: Path = Path("build/intervals.csv")) -> Iterator[str]:
    """The table as Markdown; every contact goes into `artefact`."""
    results = list(held(10 if fast else 100))
    artefact.parent.mkdir(exist_ok=True)
    with artefact.open("w", newline="") as file:
        names = list(Held.__dataclass_fields__)
        writer = csv.writer(file)
        writer.writerow(names)
        writer.writerows([getattr(one, name) for name in names] for one in results)
    yield "## Intervals of the load share against a finer grid"
    yield ""
    yield from table(results)


def table(results: list[Held]) -> Iterator[str]:
    """How often the interval holds the finest grid, and how wide it is beside the difference."""
    yield (
        f"| model | cells | contacts | determined | {FINE} inside | half-width over difference,"
        " median |"
    )
    yield "|---|---|---|---|---|---|"
    for model in MODELS:
        for cells in COARSE:
            all_of = [one for one in results if (one.model, one.cells) == (model, cells)]
            known = [one for one in all_of if one.low is not None]
            wide = [one.ratio for one in known if abs(one.true - one.clr) > SHOWN]
            inside = 100.0 * np.mean([one.inside for one in known]) if known else np.nan
            ratio = np.median(wide) if wide else np.nan
            yield (
                f"| {model} | {cells} | {len(all_of)} | {len(known)} | {inside:.0f} % |"
                f" {ratio:.1f} |"
            )
