"""Sets of measurements beside which asperity is shown.

A set is a file: its case, the conditions and measured value of every point, what was given, what
had to be assumed, and what was fitted.
"""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Never, TypeAlias, cast

import numpy as np

from asperity.benchmark.tribometer import read_tribometer
from asperity.case import Case, load_case
from asperity.core.arrays import Field
from asperity.core.errors import BadInput

_IN_PACKAGE = Path(__file__).with_name("experiments")  # of an installed wheel
_IN_REPOSITORY = Path(__file__).parents[3] / "benchmark" / "experiments"
UNITS = {"nm": 1e-9, "Hz": 1.0, "1": 1.0}  # of measured values, in SI
PROFILES = range(1, 6)  # numbers of the profiles of a dimple

Profile: TypeAlias = tuple[Field, Field]  # x and film [m]


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
class MeasuredSet:
    """A set of measurements: its name, title, source and rig, in words."""

    name: str
    title: str
    source: str
    rig: str

    def description(self) -> dict[str, object]:
        """Return what `--json` states of the set."""
        return {
            "experiment": self.name,
            "title": self.title,
            "source": self.source,
            "rig": self.rig,
        }


@dataclass(frozen=True, kw_only=True)
class ComputedSet(MeasuredSet):
    """A set that asperity computes from a case.

    `given` and `assumed` are inputs of the computation, `missed` states where computation and
    measurement differ, all in words.
    """

    given: str
    assumed: str
    missed: str
    case: Case

    def description(self) -> dict[str, object]:
        """Return what `--json` states of the set."""
        inputs = {"given": self.given, "assumed": self.assumed, "missed": self.missed}
        return MeasuredSet.description(self) | inputs


@dataclass(frozen=True, kw_only=True)
class Experiment(ComputedSet):
    """A set of measured values.

    Parameters
    ----------
    fits_viscosity : the oil's viscosity is fitted, so that the mean ratio is 1
    key : key of the measured quantity in the catalogue
    swept : name and unit of the value that varies from point to point
    mean, scatter, isothermal_scatter : of computed over measured, the last without inlet shear
        heating, as documented; the tests hold the solver to them
    """

    fits_viscosity: bool
    key: str
    swept: str
    mean: float
    scatter: float
    isothermal_scatter: float
    points: tuple[MeasuredPoint, ...]


@dataclass(frozen=True, kw_only=True)
class NotComputed(MeasuredSet):
    """A set that asperity cannot compute, and the reason."""

    reason: str
    key: str
    swept: str
    points: tuple[MeasuredPoint, ...]


@dataclass(frozen=True, kw_only=True)
class DimpleRun:
    """A dimple in body 1, and the films measured and simulated while it runs through the contact.

    Parameters
    ----------
    name, slip : name and slide-to-roll ratio of the run
    depth, radius : of the dimple [m]
    cells : of the computation, along x and y
    ends : where the dimple starts and where the computation stops, in Hertz half-widths
    measured, simulated : profiles (x, film) [m] on the axis, one per moment
    """

    name: str
    slip: float
    depth: float
    radius: float
    cells: tuple[int, int]
    ends: tuple[float, float]
    measured: tuple[Profile, ...]
    simulated: tuple[Profile, ...]


@dataclass(frozen=True, kw_only=True)
class DimpleExperiment(ComputedSet):
    """Runs of a dimple through a contact."""

    runs: tuple[DimpleRun, ...]


AnyExperiment = Experiment | DimpleExperiment | NotComputed


def load_experiments(folder: Path | None = None) -> tuple[AnyExperiment, ...]:
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


def _read(path: Path) -> AnyExperiment:
    try:
        content = tomllib.loads(path.read_text("utf-8"))
        if "runs" in content:
            case, runs = load_case(content.pop("case")), content.pop("runs")
            return DimpleExperiment(
                name=path.stem,
                case=case,
                runs=tuple(_dimple_run(path.parent, run) for run in runs),
                **content,
            )
        columns = content.pop("columns")
        export = content.pop("export", None)
        rows = content.pop("points") if export is None else _exported(path, export)
        if not rows:
            raise ValueError("points is empty")
        content |= {
            "name": path.stem,
            "key": content.pop("quantity"),
            "swept": columns[0],
            "points": tuple(_point(columns, row) for row in rows),
        }
        if "not_computed" in content:
            return NotComputed(reason=content.pop("not_computed"), **content)
        return Experiment(case=load_case(content.pop("case")), **content)
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


def _dimple_run(folder: Path, run: dict[str, object]) -> DimpleRun:
    """Return a run; the names of its files begin with `profiles`."""
    profiles = run.pop("profiles")
    return DimpleRun(
        measured=tuple(_profile(folder / f"{profiles}_exp_{n}.csv") for n in PROFILES),
        simulated=tuple(_profile(folder / f"{profiles}_sim_{n}_h.csv") for n in PROFILES),
        **cast(dict[str, Never], run),
    )


def _profile(path: Path) -> Profile:
    """Return x and film [m] from a table in µm and nm."""
    try:
        x, film = np.loadtxt(path, delimiter=",", skiprows=1).T
    except OSError:
        raise ValueError(f"{path} is missing") from None
    order = np.argsort(x)
    return x[order] * 1e-6, film[order] * 1e-9
