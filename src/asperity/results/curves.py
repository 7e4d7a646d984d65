"""Friction curves of a case: over speed (Stribeck) and over the slide-to-roll ratio (traction).

Each point is a solved contact. Nothing is printed or drawn here.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Literal

import numpy as np

from asperity.case import Case
from asperity.core.errors import AsperityError, BadInput, require_positive
from asperity.core.quantities import quantity
from asperity.ehl import Iteration
from asperity.results.run import Run
from asperity.results.solve import solve_case
from asperity.solution import HOT, heats_inlet

SolverProgress = Callable[[Iteration], None]
FrictionCurveKind = Literal["stribeck", "traction"]
RoughnessMotion = Literal["running", "standing"]

SPEED_RANGE = (0.01, 10.0)  # over the case's entrainment speed
SPEEDS = 13
SLIP_RANGE = (1e-3, 0.5)
SLIPS = 14
MAX_SLIP = 1000.0
GROUPS = ("load", "film", "friction", "heat")  # of the catalogue, of a point
POINT_KEYS = {  # number of a point: its key in the catalogue
    "friction_coefficient": "friction_coefficient",
    "asperity_part": "friction_asperity_part",
    "oil_part": "friction_oil_part",
    "h_mean_m": "h_mean_m",
    "flash_temperature_max_k": "flash_temperature_max_k",
    "film_temperature_max_k": "film_temperature_max_k",
    "friction_power_w": "friction_power_w",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class FrictionPoint:
    """Point of a friction curve, SI.

    `friction_coefficient` = `asperity_part` + `oil_part`; `lambda_ratio` is None for a smooth or
    dry contact; temperatures are rises [K], `flash_temperature_max_k` that of the hotter surface.
    `roughness` is "running" for means over time of moving roughness. Points that did not converge
    must not be used.
    """

    entrainment_speed_m_s: float
    slide_to_roll: float
    friction_coefficient: float
    friction_coefficient_low: float | None
    friction_coefficient_high: float | None
    asperity_part: float
    oil_part: float
    clr: float
    clr_low: float | None
    clr_high: float | None
    h_mean_m: float
    lambda_ratio: float | None
    flash_temperature_max_k: float
    film_temperature_max_k: float
    friction_power_w: float
    roughness: RoughnessMotion
    converged: bool

    @property
    def friction_text(self) -> str:
        """Friction coefficient with its interval."""
        return quantity("friction_coefficient").text_in(asdict(self))


@dataclass(frozen=True, slots=True, kw_only=True)
class FrictionCurve:
    """Friction over speed ("stribeck") or slide-to-roll ratio ("traction"), in ascending order."""

    kind: FrictionCurveKind
    points: tuple[FrictionPoint, ...]
    boundary_friction: float
    sq: float  # composite roughness [m]
    feedback: bool  # True if the viscosity is that at the film temperature

    def scalars(self) -> dict[str, object]:
        """Return the curve for `--json`."""
        return {
            "kind": self.kind,
            "sq_m": self.sq,
            "boundary_friction": self.boundary_friction,
            "thermal_feedback": self.feedback,
            "points": [asdict(point) for point in self.points],
        }

    def verdict(self) -> str:
        """Return one sentence on the range of friction."""
        first = self.points[0]
        last = self.points[-1]
        if self.kind == "stribeck":
            sentence = (
                f"The friction coefficient changes from {first.friction_text} at "
                f"{first.entrainment_speed_m_s:.3g} m/s to {last.friction_text} at "
                f"{last.entrainment_speed_m_s:.3g} m/s"
            )
        else:
            highest = max(self.points, key=lambda point: point.friction_coefficient)
            sentence = (
                f"The largest friction coefficient is {highest.friction_text}, at a "
                f"slide-to-roll ratio of {100 * highest.slide_to_roll:.3g} %"
            )
        sentence += f" (Sq {1e6 * self.sq:.3g} um, boundary friction {self.boundary_friction:g})."
        not_converged = sum(not point.converged for point in self.points)
        return (
            f"NOT CONVERGED at {not_converged} of {len(self.points)} points: {sentence}"
            if not_converged
            else sentence
        )

    def hint(self) -> str | None:
        """Return a warning if the film is hot without thermal feedback; None otherwise."""
        hottest = max(point.film_temperature_max_k for point in self.points)
        if self.feedback or hottest < HOT:
            return None
        return (
            f"the film warms by up to {hottest:.0f} K, but the viscosity is that of the cold oil; "
            "set thermal.feedback=true"
        )


def stribeck_curve(
    case: Case, *, speeds: Sequence[float] | None = None, progress: SolverProgress | None = None
) -> FrictionCurve:
    """Compute friction over entrainment speed at the case's slide-to-roll ratio.

    Parameters
    ----------
    speeds : entrainment speeds [m/s]; default 13 from a hundredth of the case's to ten times it
    progress : called after every solver iteration, or time step of running roughness

    Raises
    ------
    BadInput
        for a case without sliding, or a speed that is not positive.
    """
    if case.conditions.sliding_speed == 0.0:
        raise BadInput(
            f"{case.source}: contact.slip is 0, so that nothing slides; set it, for instance to 0.1"
            if case.conditions.entrainment_speed
            else f"{case.source}: contact.entrainment_speed is 0; give the contact a speed"
        )
    if speeds is None:
        low, high = (share * case.conditions.entrainment_speed for share in SPEED_RANGE)
        speeds = [float(speed) for speed in np.geomspace(low, high, SPEEDS)]
    for speed in speeds:
        require_positive("entrainment speed", speed, "m/s")
    points = [{"contact.entrainment_speed": f"{speed!r} m/s"} for speed in sorted(speeds)]
    return _curve(case, "stribeck", points, progress)


def traction_curve(
    case: Case, *, slips: Sequence[float] | None = None, progress: SolverProgress | None = None
) -> FrictionCurve:
    """Compute friction over the slide-to-roll ratio (u1 - u2)/u at the case's entrainment speed.

    Above a ratio of 2 the surfaces move in opposite directions.

    Parameters
    ----------
    slips : slide-to-roll ratios, not negative; default 0 and 14 from 0.001 to 0.5
    progress : called after every solver iteration, or time step of running roughness

    Raises
    ------
    BadInput
        for a ratio that is negative or above 1000.
    """
    if slips is None:
        slips = [0.0, *(float(slip) for slip in np.geomspace(*SLIP_RANGE, SLIPS))]
    for slip in slips:
        if not 0.0 <= slip <= MAX_SLIP:
            raise BadInput(f"slide-to-roll ratio must be between 0 and {MAX_SLIP:g}, got {slip:g}")
    points = [{"contact.slip": slip} for slip in sorted(slips)]
    return _curve(case, "traction", points, progress)


def _curve(
    case: Case,
    kind: FrictionCurveKind,
    points: Sequence[Mapping[str, object]],
    progress: SolverProgress | None,
) -> FrictionCurve:
    """Solve the case with the overrides of each point."""
    if not points:
        raise BadInput("a curve needs at least one point, got none")
    case = case.among_many.with_written({"vibration": "none", "solver.surfaces": 1})
    cases = [case.with_written(point) for point in points]
    if any(heats_inlet(at.conditions, at.lubricant, at.thermal) for at in cases):
        # at every point, so that the curve has no step
        cases = [at.with_written({"thermal.inlet_heating": True}) for at in cases]
    runs = (solve_case(at, strict=False, groups=GROUPS, progress=progress) for at in cases)
    return FrictionCurve(
        kind=kind,
        points=tuple(map(_point, runs)),
        boundary_friction=case.boundary_friction,
        sq=case.surface().sq,
        feedback=case.thermal.feedback,
    )


def _point(run: Run) -> FrictionPoint:
    """Return a point of a curve: means over time if the roughness runs."""
    numbers, conditions, clr = run.numbers(GROUPS), run.solution.conditions, run.error.clr
    values = {name: numbers[key] for name, key in POINT_KEYS.items()}
    if missing := [name for name, value in values.items() if value is None]:
        raise AsperityError(
            f"{missing[0]} at {conditions.entrainment_speed:.4g} m/s could not be computed; leave "
            'that point out, or set contact.roughness = "standing"'
        )
    interval = run.friction_interval
    assert interval is not None  # with friction
    return FrictionPoint(
        entrainment_speed_m_s=conditions.entrainment_speed,
        slide_to_roll=conditions.slide_to_roll,
        friction_coefficient_low=interval.low,
        friction_coefficient_high=interval.high,
        clr=run.state.clr,
        clr_low=clr.low,
        clr_high=clr.high,
        lambda_ratio=run.state.lambda_ratio,
        roughness="standing" if run.running is None else "running",
        converged=run.converged,
        **{name: float(value) for name, value in values.items() if value is not None},
    )
