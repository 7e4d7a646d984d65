"""asperity against experiment: measured films, resonances and profiles beside computed ones."""

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import cast

import numpy as np
import pandas

from asperity.benchmark.dimples import DimpleProfile, compute_dimples
from asperity.benchmark.measurements import (
    DimpleExperiment,
    Experiment,
    NotComputed,
    load_experiments,
)
from asperity.case import Case
from asperity.core import files
from asperity.core.errors import AsperityError, BadInput
from asperity.core.quantities import quantity
from asperity.results import solve_case

MAX_FITS = 6  # rounds; two or three suffice
FIT_TOLERANCE = 1e-3  # of the mean ratio
FIT_POWER = 0.67  # of viscosity in film formulas, for the first round
VISCOSITY = "lubricant.viscosity_40"


@dataclass(frozen=True)
class ComparedPoint:
    """Measured and computed value [SI], and the limits of the computed one.

    The limits contain the discretisation error and the interval of an estimated pressure-viscosity
    coefficient; None where the viscosity was fitted, and for dry contacts. `isothermal` is the
    value computed without inlet shear heating.
    """

    experiment: str
    quantity: str
    swept: float
    measured: float
    deviation: float | None
    computed: float
    low: float | None
    high: float | None
    isothermal: float

    @property
    def ratio(self) -> float:
        """Computed over measured."""
        return self.computed / self.measured

    @property
    def isothermal_ratio(self) -> float:
        """Isothermal over measured."""
        return self.isothermal / self.measured


@dataclass(frozen=True)
class Comparison:
    """Points of a set, and the kinematic viscosity at 40 °C [m²/s] that was fitted, if any."""

    experiment: Experiment
    points: tuple[ComparedPoint, ...]
    fitted_viscosity: float | None

    @property
    def mean(self) -> float:
        """Mean of computed over measured."""
        return float(np.mean([point.ratio for point in self.points]))

    @property
    def scatter(self) -> float:
        """Standard deviation of computed over measured about its mean; 0 for a single point."""
        return float(np.std([point.ratio / self.mean for point in self.points]))

    @property
    def isothermal_mean(self) -> float:
        """Mean of isothermal over measured."""
        return float(np.mean([point.isothermal_ratio for point in self.points]))

    @property
    def isothermal_scatter(self) -> float:
        """Standard deviation of isothermal over measured about its mean."""
        ratios = [point.isothermal_ratio / self.isothermal_mean for point in self.points]
        return float(np.std(ratios))

    @property
    def mean_interval(self) -> tuple[float, float] | None:
        """Interval of `mean` from the limits of the computed values; None without limits.

        Those of all points move together, because they have one pressure-viscosity coefficient.
        """
        ends = [
            (point.low / point.measured, point.high / point.measured)
            for point in self.points
            if point.low is not None and point.high is not None
        ]
        if len(ends) < len(self.points):
            return None
        low, high = np.mean(ends, axis=0)
        return float(low), float(high)


@dataclass(frozen=True)
class ExperimentResult:
    """Comparison with every set; `profiles` are those of dimples."""

    comparisons: tuple[Comparison, ...]
    profiles: tuple[DimpleProfile, ...] = ()
    not_computed: tuple[NotComputed, ...] = ()

    def verdict(self) -> str:
        """Return the deviations where nothing is fitted, and what is not computed."""
        parts = [
            *([self._of_values()] if self.comparisons else []),
            *([self._of_profiles()] if self.profiles else []),
            *(
                f"Not computed: {entry.title} ({len(entry.points)} values; {entry.reason})."
                for entry in self.not_computed
            ),
        ]
        return " ".join(parts)

    def _of_values(self) -> str:
        ratios = [
            point.ratio
            for comparison in self.comparisons
            if comparison.mean_interval is not None
            for point in comparison.points
        ]
        without_fit = (
            f"computed over measured films without a fit {np.mean(ratios):.2f} in the mean "
            f"({min(ratios):.2f} to {max(ratios):.2f}); "
            if ratios
            else ""
        )
        points = sum(len(comparison.points) for comparison in self.comparisons)
        worst = max(self.comparisons, key=lambda comparison: comparison.scatter)
        return (
            f"{points} measured values in {len(self.comparisons)} sets: {without_fit}largest "
            f"scatter of a set {100.0 * worst.scatter:.1f} % ({worst.experiment.title})."
        )

    def _of_profiles(self) -> str:
        simulated = max(profile.from_simulated for profile in self.profiles)
        measured = max(profile.from_measured for profile in self.profiles)
        return (
            f"Films over a dimple within {100.0 * simulated:.1f} % of a published simulation and "
            f"{100.0 * measured:.0f} % of {len(self.profiles)} measured profiles."
        )

    def rows(self) -> list[dict[str, object]]:
        """Return a row per point."""
        return [
            asdict(point) | {"ratio": point.ratio, "isothermal_ratio": point.isothermal_ratio}
            for comparison in self.comparisons
            for point in comparison.points
        ]

    def scalars(self) -> dict[str, object]:
        """Return the result for `--json`."""
        sets = [
            comparison.experiment.description()
            | {
                "fitted_viscosity": comparison.fitted_viscosity,
                "points": len(comparison.points),
                "mean_ratio": comparison.mean,
                "scatter": comparison.scatter,
                "isothermal_mean_ratio": comparison.isothermal_mean,
                "isothermal_scatter": comparison.isothermal_scatter,
                "mean_interval": comparison.mean_interval,
            }
            for comparison in self.comparisons
        ]
        not_computed = [
            entry.description()
            | {"reason": entry.reason, "measured": [point.value for point in entry.points]}
            for entry in self.not_computed
        ]
        dimples = {profile.experiment.name: profile.experiment for profile in self.profiles}
        return {
            "verdict": self.verdict(),
            "sets": sets,
            "rows": self.rows(),
            "profile_sets": [entry.description() for entry in dimples.values()],
            "profiles": [profile.row() for profile in self.profiles],
            "not_computed": not_computed,
        }

    def save(self, path: Path) -> Path:
        """Write the rows as CSV."""
        files.write_csv(path, pandas.DataFrame(self.rows()))
        return path


def compare_experiments(
    *, folder: Path | None = None, progress: Callable[[str], None] | None = None
) -> ExperimentResult:
    """Compute every point of every set.

    Raises
    ------
    BadInput
        see `load_experiments`.
    NotConverged
        if a contact does not converge.
    """
    comparisons: list[Comparison] = []
    profiles: list[DimpleProfile] = []
    not_computed: list[NotComputed] = []
    for experiment in load_experiments(folder):
        if progress is not None:
            progress(experiment.title)
        if isinstance(experiment, NotComputed):
            not_computed.append(experiment)
        elif isinstance(experiment, DimpleExperiment):
            profiles += compute_dimples(experiment)
        else:
            comparisons.append(compare_with(experiment))
    return ExperimentResult(tuple(comparisons), tuple(profiles), tuple(not_computed))


def compare_with(experiment: Experiment) -> Comparison:
    """Compute every point of a set, with a fitted viscosity if the set requires it."""
    if not experiment.fits_viscosity:
        points = _compute(experiment, experiment.case)
        return Comparison(experiment, _without_heat(experiment, experiment.case, points), None)
    sheet = experiment.case.oil_sheet
    viscosity = None if sheet is None else sheet.viscosity_40
    if viscosity is None:
        raise BadInput(f"{experiment.name} needs {VISCOSITY}, which is to be fitted")
    power, before = FIT_POWER, None  # secant method for ln(mean ratio) over ln(viscosity)
    for _ in range(MAX_FITS):
        case = experiment.case.with_overrides({VISCOSITY: viscosity})
        comparison = Comparison(experiment, _compute(experiment, case), viscosity)
        if abs(comparison.mean - 1.0) < FIT_TOLERANCE:
            points = _without_heat(experiment, case, comparison.points)
            return replace(comparison, points=points)
        here = math.log(viscosity), math.log(comparison.mean)
        if before is not None:
            power = (here[1] - before[1]) / (here[0] - before[0])
        before = here
        viscosity *= comparison.mean ** (-1.0 / power)
    raise AsperityError(
        f"{experiment.name}: the fit of the viscosity did not converge in {MAX_FITS} rounds; state "
        f"{VISCOSITY} closer to {1e6 * viscosity:.3g} mm^2/s"
    )


def _compute(experiment: Experiment, case: Case) -> tuple[ComparedPoint, ...]:
    low_key, high_key = quantity(experiment.key).ends
    with_limits = not experiment.fits_viscosity and case.lubricant is not None
    points = []
    for point in experiment.points:
        at_point = case.with_overrides(point.conditions)
        numbers = solve_case(at_point).scalars()
        value = cast(float, numbers[experiment.key])
        points.append(
            ComparedPoint(
                experiment=experiment.name,
                quantity=experiment.key,
                swept=point.swept,
                measured=point.value,
                deviation=point.deviation,
                computed=value,
                low=cast(float | None, numbers[low_key]) if with_limits else None,
                high=cast(float | None, numbers[high_key]) if with_limits else None,
                isothermal=value,
            )
        )
    return tuple(points)


def _without_heat(
    experiment: Experiment, case: Case, points: tuple[ComparedPoint, ...]
) -> tuple[ComparedPoint, ...]:
    """Return the points with their values without inlet shear heating."""
    if case.lubricant is None:
        return points
    cold = case.with_overrides({"thermal.inlet_heating": False})
    return tuple(
        replace(
            compared,
            isothermal=cast(
                float,
                solve_case(cold.with_overrides(point.conditions)).scalars()[experiment.key],
            ),
        )
        for compared, point in zip(points, experiment.points, strict=True)
    )
