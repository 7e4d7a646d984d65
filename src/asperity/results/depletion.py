"""Film of a contact that passes its track again and again, as with grease or little oil."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from asperity.case import Case, InletSection
from asperity.core.displayed import Brief
from asperity.core.documents import JsonObject
from asperity.core.errors import BadInput
from asperity.ehl import ContactSolution, solve_contact
from asperity.solution import Pass, Reflow, deplete_track

SETTLED = 0.01  # change of the film from one pass to the next, below which it has settled


@dataclass(frozen=True, kw_only=True)
class PassRow:
    """One pass: layer ahead and films in the middle of the contact [m]."""

    number: int
    layer: float
    h_central: float
    h_min: float


@dataclass(frozen=True, kw_only=True, repr=False)
class TrackDepletion(Brief):
    """Films of the smooth contact over its passes, beside those of the flooded one [m]."""

    case: Case
    interval: float | None
    passes: tuple[PassRow, ...]
    flooded: tuple[float, float]

    @property
    def share(self) -> float:
        """Central film after the last pass over the flooded one."""
        return self.passes[-1].h_central / self.flooded[0]

    @property
    def settled(self) -> bool:
        """True if the last pass changed the film by less than 1 %."""
        if len(self.passes) < 2:
            return False
        last, before = self.passes[-1].h_central, self.passes[-2].h_central
        return abs(last / before - 1.0) < SETTLED

    def verdict(self) -> str:
        """Return one sentence: film after the passes, over the flooded one."""
        last = self.passes[-1]
        course = "it has settled" if self.settled else "it still changes"
        return (
            f"After {last.number} passes the smooth contact has a central film of "
            f"{1e6 * last.h_central:.3g} um, {100.0 * self.share:.0f} % of the flooded one; "
            f"{course}."
        )

    def scalars(self) -> JsonObject:
        """Return the values of `asperity deplete --json`."""
        return {
            "verdict": self.verdict(),
            "interval_s": self.interval,
            "settled": self.settled,
            "share": self.share,
            "h_central_flooded_m": self.flooded[0],
            "h_min_flooded_m": self.flooded[1],
            "passes": [
                {
                    "pass": row.number,
                    "layer_m": row.layer,
                    "h_central_m": row.h_central,
                    "h_min_m": row.h_min,
                }
                for row in self.passes
            ],
        }


def deplete_case(
    case: Case,
    *,
    passes: int | None = None,
    interval: float | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> TrackDepletion:
    """Solve repeated passes of a case's smooth contact over its track.

    Parameters
    ----------
    case : with [inlet]; its oil is the base oil of a grease
    passes : number of passes; default: the case's
    interval : time between two passes [s]; default: the case's. Without one, the layer behind a
        pass enters the next as it is
    progress : called with the passes done and in total

    Raises
    ------
    BadInput
        without an oil or [inlet], or for oil that is added in no time.
    NotConverged
        if a pass does not converge.
    """
    inlet = case.contents.inlet
    if case.lubricant is None or inlet is None:
        raise BadInput(f"{case.source}: depletion needs [lubricant] and [inlet]; add them")
    count = inlet.passes if passes is None else passes
    if count < 1:
        raise BadInput(f"passes must be 1 or more, got {count}; 20 are usual")
    interval = inlet.interval if interval is None else interval
    reflow = _reflow(inlet, interval, case.source)
    smooth = case.with_written({"surface": "flat", "model": "conserving"})
    rows = list[PassRow]()
    options = replace(smooth.options, inlet_layer=None)
    flooded = solve_contact(smooth.conditions, smooth.lubricant, smooth.surface(), options=options)
    for entry in _passes(smooth, count, reflow):
        central, least = _films(entry.solution)
        layer = float(entry.layer.thickness_at(np.array(0.0)))
        rows.append(PassRow(number=entry.number, layer=layer, h_central=central, h_min=least))
        if progress is not None:
            progress(entry.number, count)
    return TrackDepletion(
        case=case,
        interval=interval,
        passes=tuple(rows),
        flooded=_films(flooded),
    )


def _passes(smooth: Case, count: int, reflow: Reflow | None) -> Iterator[Pass]:
    """Yield the passes of a smooth contact over its track."""
    assert smooth.lubricant is not None
    return deplete_track(
        smooth.conditions,
        smooth.lubricant,
        smooth.surface(),
        options=smooth.options,
        passes=count,
        reflow=reflow,
    )


def _reflow(inlet: InletSection, interval: float | None, source: str) -> Reflow | None:
    """Return the replenishment of the track between two passes; None without a time for it."""
    if interval is None:
        if inlet.bleed:
            raise BadInput(
                f"{source}: inlet.bleed needs the time between two passes; add inlet.interval"
            )
        return None
    return Reflow(
        time=float(interval),
        surface_tension=float(inlet.surface_tension),
        supply=float(inlet.bleed),
    )


def _films(solution: ContactSolution) -> tuple[float, float]:
    """Return the film in the centre and the minimum film [m]."""
    centre = int(np.argmin(np.abs(solution.grid.x))), solution.grid.cells[1] // 2
    return float(solution.gap[centre]), float(solution.gap.min())
