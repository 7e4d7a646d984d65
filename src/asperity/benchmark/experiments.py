"""asperity against experiment: measured films and resonances beside computed ones.

A set of measurements is a file: its case, the conditions and measured value of every point, what
was given, what had to be assumed, and what was fitted.
"""

import math
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import cast

import numpy as np
import pandas

from asperity.benchmark.tribometer import read_tribometer
from asperity.case import Case, load_case
from asperity.core import files
from asperity.core.errors import AsperityError, BadInput
from asperity.core.quantities import quantity
from asperity.results import solve_case

_IN_PACKAGE = Path(__file__).with_name("experiments")  # of an installed wheel
_IN_REPOSITORY = Path(__file__).parents[3] / "benchmark" / "experiments"
UNITS = {"nm": 1e-9, "Hz": 1.0}  # of measured values, in SI
MAX_FITS = 6  # rounds; two or three suffice
FIT_TOLERANCE = 1e-3  # of the mean ratio
FIT_POWER = 0.67  # of viscosity in film formulas, for the first round
VISCOSITY, ALPHA = "lubricant.viscosity_40", "lubricant.alpha"


@dataclass(frozen=True, kw_only=True)
class MeasuredPoint:
    """Measured value [SI] with the case's values at it, and the deviation of repeats, if known.

    `swept` is the value that varies from point to point, in the unit of the file's first column.
    """

    conditions: Mapping[str, str]
    swept: float
    value: float
    deviation: float | None = None


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """A set of measurements.

    Parameters
    ----------
    given, assumed : inputs of the computation, in words
    fits_viscosity : the oil's viscosity is fitted, so that the mean ratio is 1
    missed : where computation and measurement differ, in words; may be empty
    key : key of the measured quantity in the catalogue
    swept : name and unit of the value that varies from point to point
    mean, scatter, isothermal_scatter : of computed over measured, the last without inlet shear
        heating, as documented; the tests hold the solver to them
    """

    name: str
    title: str
    source: str
    rig: str
    given: str
    assumed: str
    fits_viscosity: bool
    missed: str
    key: str
    swept: str
    mean: float
    scatter: float
    isothermal_scatter: float
    case: Case
    points: tuple[MeasuredPoint, ...]


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
        """90 % interval of `mean` from the limits of the computed values; None without limits.

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
    """Comparison with every set."""

    comparisons: tuple[Comparison, ...]

    def verdict(self) -> str:
        """Return one sentence: points, sets, and deviations of films where nothing is fitted."""
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
            {
                "experiment": comparison.experiment.name,
                "title": comparison.experiment.title,
                "source": comparison.experiment.source,
                "rig": comparison.experiment.rig,
                "given": comparison.experiment.given,
                "assumed": comparison.experiment.assumed,
                "fitted_viscosity": comparison.fitted_viscosity,
                "points": len(comparison.points),
                "mean_ratio": comparison.mean,
                "scatter": comparison.scatter,
                "isothermal_mean_ratio": comparison.isothermal_mean,
                "isothermal_scatter": comparison.isothermal_scatter,
                "mean_interval": comparison.mean_interval,
                "missed": comparison.experiment.missed,
            }
            for comparison in self.comparisons
        ]
        return {"verdict": self.verdict(), "sets": sets, "rows": self.rows()}

    def save(self, path: Path) -> Path:
        """Write the rows as CSV."""
        files.write_csv(path, pandas.DataFrame(self.rows()))
        return path


def load_experiments(folder: Path | None = None) -> tuple[Experiment, ...]:
    """Load the sets of a folder, by default those packaged with asperity.

    Raises
    ------
    BadInput
        for a folder without sets, or an invalid file.
    """
    source = folder or (_IN_PACKAGE if _IN_PACKAGE.is_dir() else _IN_REPOSITORY)
    paths = sorted(source.glob("*.toml"))
    if not paths:
        raise BadInput(f"{source} contains no measurements (*.toml); choose another folder")
    return tuple(_read(path) for path in paths)


def _read(path: Path) -> Experiment:
    try:
        content = tomllib.loads(path.read_text("utf-8"))
        case = load_case(content.pop("case"))
        columns = content.pop("columns")
        export = content.pop("export", None)
        rows = content.pop("points") if export is None else _exported(path, export)
        if not rows:
            raise ValueError("points is empty")
        return Experiment(
            name=path.stem,
            case=case,
            key=content.pop("quantity"),
            swept=columns[0],
            points=tuple(_point(columns, row) for row in rows),
            **content,
        )
    except (
        tomllib.TOMLDecodeError,
        UnicodeDecodeError,
        LookupError,
        TypeError,
        ValueError,
    ) as error:
        raise BadInput(
            f"{path} is not a set of measurements: {error!r}; compare it with those of asperity"
        ) from None


def _exported(path: Path, export: Mapping[str, object]) -> list[list[float]]:
    """Return the rows of a tribometer's export beside a set, without incomplete ones.

    `export` states its `file`, the `columns` in the order of the set's, and perhaps the `steps`.
    """
    test = read_tribometer(path.parent / str(export["file"]))
    columns, steps = cast(list[str], export["columns"]), export.get("steps")
    tables = [
        step.table for step in test.steps if steps is None or step.number in cast(list[int], steps)
    ]
    rows: list[list[float]] = []
    for table in tables:
        if set(columns) <= set(table.columns):
            rows += table[columns].dropna().to_numpy(float).tolist()
    return rows


def _point(columns: list[str], row: list[float]) -> MeasuredPoint:
    """Return a point from a row under columns such as `contact.load [N]` and `measured [nm]`."""
    conditions: dict[str, str] = {}
    measured: dict[str, float] = {}
    for column, number in zip(columns, row, strict=True):
        name, _, unit = column.rstrip("]").partition(" [")
        if name in ("measured", "deviation"):
            measured[name] = number * UNITS[unit]
        else:
            conditions[name] = f"{number:.9g} {unit}"
    return MeasuredPoint(
        conditions=conditions,
        swept=float(row[0]),
        value=measured["measured"],
        deviation=measured.get("deviation"),
    )


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
    comparisons = []
    for experiment in load_experiments(folder):
        if progress is not None:
            progress(experiment.title)
        comparisons.append(compare_with(experiment))
    return ExperimentResult(tuple(comparisons))


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
    spread = None if experiment.fits_viscosity else _alpha_effect(experiment, case)
    points = []
    for point in experiment.points:
        at_point = case.with_overrides(point.conditions)
        numbers = solve_case(at_point).scalars()
        value = cast(float, numbers[experiment.key])
        error = cast(float, numbers.get(quantity(experiment.key).deviation) or 0.0)
        low, high = None, None
        if spread is not None:
            low = value - math.hypot(error, spread[0] * value)
            high = value + math.hypot(error, spread[1] * value)
        points.append(
            ComparedPoint(
                experiment=experiment.name,
                quantity=experiment.key,
                swept=point.swept,
                measured=point.value,
                deviation=point.deviation,
                computed=value,
                low=low,
                high=high,
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


def _alpha_effect(experiment: Experiment, case: Case) -> tuple[float, float] | None:
    """Return the relative effect of the ends of alpha's interval at the middle point.

    None for a dry contact, whose interval would be that of the assumed modulus.
    """
    middle = case.with_overrides(experiment.points[len(experiment.points) // 2].conditions)
    if middle.lubricant is None:
        return None
    alpha, error = (
        float(middle.lubricant.viscosity.log_slope(np.zeros(1))[0]),
        middle.lubricant.alpha_error,
    )
    low, value, high = (
        cast(float, solve_case(one_case).scalars()[experiment.key])
        for one_case in (
            middle.with_overrides({ALPHA: (1.0 - error) * alpha}),
            middle,
            middle.with_overrides({ALPHA: (1.0 + error) * alpha}),
        )
    )
    return 1.0 - low / value, high / value - 1.0
