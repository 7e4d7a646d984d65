"""Lift-off speed of the rough surfaces of a case, before and after wear.

The running contact is solved at few entrainment speeds, the slide-to-roll ratio kept.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

from threadpoolctl import threadpool_limits

from asperity.case import Case
from asperity.core.displayed import Brief
from asperity.core.documents import JsonObject
from asperity.core.errors import NotConverged
from asperity.ehl import least_film
from asperity.simulation.wear.lift_off_search import (
    LiftOff,
    LoadShares,
    SearchSettings,
    SpeedShare,
    find_lift_off,
    refined,
)
from asperity.solution import inlet_viscosity_factor
from asperity.surface import MovingSurfaces
from asperity.transient import run_track, settled_from, time_means

SPEED_RANGE = (1e-3, 1e2)  # limits of the search over the case's entrainment speed
PASSAGES = 12  # of the Hertz zone by the oil, over which a load share is averaged
MAX_FAILED = 0.02  # share of the time steps that may miss the tolerance
START_FILM_RATIO = 2.0  # at the first speed: that of lift-off is 1 to 5
MAX_SHARE_OF_CELLS = 0.5  # of the grid's, for a search on fewer cells to save time
FILM_EXPONENT = 0.68  # of the film formulas over speed

Progress = Callable[[float, SpeedShare], None]  # with the speed [m/s] and its load share


class SpeedRatio(NamedTuple):
    """Lift-off speed after wear over that before, with its interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, kw_only=True, repr=False)
class LiftOffChange(Brief):
    """Lift-off speeds before and after wear, of the same tracks on the same grid."""

    before: LiftOff
    after: LiftOff

    @property
    def ratio(self) -> SpeedRatio | None:
        """Speed after wear over that before; None if either is not determined.

        The interval is that of independent speeds, although both are of the same tracks.
        """
        first, last = self.before, self.after
        if first.speed is None or last.speed is None:
            return None
        ratio = last.speed / first.speed
        return SpeedRatio(
            ratio,
            ratio * math.exp(-math.hypot(last.below, first.above)),
            ratio * math.exp(math.hypot(last.above, first.below)),
        )

    def scalars(self) -> JsonObject:
        """Return the values of `asperity wear --lift-off --json`."""
        ends = (self.before, self.after)
        return {
            "lift_off_speed_m_s": [end.speed for end in ends],
            "lift_off_speed_low_m_s": [end.low for end in ends],
            "lift_off_speed_high_m_s": [end.high for end in ends],
            "lift_off_ratio": None if self.ratio is None else self.ratio.value,
            "lift_off_ratio_low": None if self.ratio is None else self.ratio.low,
            "lift_off_ratio_high": None if self.ratio is None else self.ratio.high,
            "lift_off_reasons": [end.reason or None for end in ends],
        }

    def verdict(self) -> str:
        """Return one sentence: both speeds and the change, or why one is not determined."""
        ratio = self.ratio
        if ratio is None:
            end, when = (
                (self.after, "after") if self.before.speed is not None else (self.before, "before")
            )
            known = f" (before: {self.before.text})" if when == "after" else ""
            return f"The lift-off speed {when} wear is not determined{known}: {end.reason}."
        low, value, high = (
            f"{100.0 * (end - 1.0):+.0f}" for end in (ratio.low, ratio.value, ratio.high)
        )
        return (
            f"The lift-off speed changes from {self.before.text} to {self.after.text}, "
            f"by {value} % ({low} to {high} %)."
        )


def lift_off_change(
    case: Case,
    before: MovingSurfaces,
    after: MovingSurfaces,
    progress: Progress | None = None,
) -> LiftOffChange:
    """Return the lift-off speeds of a case's surfaces before and after wear.

    Parameters and errors are those of `lift_off_speed`.
    """
    first, last = (
        lift_off_speed(
            case,
            surfaces,
            progress,
        )
        for surfaces in (before, after)
    )
    return LiftOffChange(before=first, after=last)


def lift_off_speed(
    case: Case, surfaces: MovingSurfaces, progress: Progress | None = None
) -> LiftOff:
    """Return the entrainment speed at which the running surfaces of a case lift off.

    The contact is solved on the grid of the surfaces: worn summits are as sharp as its cells, and
    fewer cells would blunt them. A search on the cells of `case.among_many` yields the first speed.

    Parameters
    ----------
    case : its slide-to-roll ratio, load and oil are kept
    surfaces : tracks of both bodies
    progress : called after every solved speed, with its load share
    """
    if reason := _refusal(case, surfaces):
        return LiftOff(reason=reason)
    speed = case.conditions.entrainment_speed
    limits = (SPEED_RANGE[0] * speed, SPEED_RANGE[1] * speed)
    start, settings = _first_speed(case, surfaces), SearchSettings()
    fewer = case.among_many.running_cells()
    with threadpool_limits(1):
        if math.prod(fewer) <= MAX_SHARE_OF_CELLS * math.prod(surfaces.grid.cells):
            shares = _running_shares(case, surfaces.on_cells(fewer), progress)
            first = find_lift_off(shares, start, limits, settings)
            if first.speed is not None:
                start, settings = first.speed, refined(settings, first)
        shares = _running_shares(case, surfaces, progress)
        return find_lift_off(shares, start, limits, settings)


def _refusal(case: Case, surfaces: MovingSurfaces) -> str:
    """Return why a case has no lift-off speed; empty if it may have one."""
    if case.lubricant is None:
        return "the contact is dry; a lift-off speed needs a lubricant"
    if not case.is_running or not any(surfaces.rough):
        return "no roughness runs through the contact; a lift-off speed needs running roughness"
    return ""


def _first_speed(case: Case, surfaces: MovingSurfaces) -> float:
    """Return the speed at which the film formula gives `START_FILM_RATIO` [m/s]."""
    assert case.lubricant is not None
    ratio = least_film(case.conditions, case.lubricant) / surfaces.composite_at(0.0).sq
    return case.conditions.entrainment_speed * float(
        (START_FILM_RATIO / ratio) ** (1.0 / FILM_EXPONENT)
    )


def _running_shares(case: Case, surfaces: MovingSurfaces, progress: Progress | None) -> LoadShares:
    """Return the function of speed that solves the running contact."""
    conditions, oil = case.conditions, case.lubricant
    assert oil is not None
    # at every speed where it matters at any, so that the curve has no step
    heated = case.thermal.inlet_heating is not False
    thermal = replace(case.thermal, inlet_heating=heated)

    def load_share(speed: float) -> SpeedShare:
        first, second = (
            velocity * speed / conditions.entrainment_speed
            for velocity in conditions.surface_speeds
        )
        at_speed = replace(conditions, surface_speeds=(first, second))
        moving = replace(surfaces, speeds=(first, second))
        series = run_track(
            at_speed,
            oil,
            moving,
            lambda snapshot: {"clr": snapshot.state.clr},
            passages=lambda: PASSAGES,
            options=case.options,
            viscosity_factor=inlet_viscosity_factor(
                at_speed,
                oil,
                moving.grid,
                thermal,
            ),
        )
        steps = len(series.values) - 1
        if series.failed > MAX_FAILED * steps:
            raise NotConverged(None, f"{series.failed} of {steps} time steps did not converge")
        cut = settled_from(series, "clr") or max(1, series.length // 2)
        mean = time_means([series], [cut], series)["clr"]
        share = SpeedShare(mean.value, min(mean.time, 1.0))  # the range of a share
        if progress is not None:
            progress(speed, share)
        return share

    return load_share
