"""The contact emulated: a Sobol study of solved contacts on disk, and Gaussian processes through its means.

Several surfaces a point tell the mean over patches, which a recording shows, from the scatter of
patches, which it averages away. How far the emulator is off is found on points that its processes
did not see.
"""

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pandas

from asperity.case import MOST_POINTS
from asperity.core.arrays import Field
from asperity.core.errors import AsperityError, BadInput, UnreadableFile
from asperity.core.files import make_folder, user_cache
from asperity.core.storage import read_json, write_json
from asperity.inference.gaussian_process import GaussianProcess, fit_process, require_learning
from asperity.inference.outputs import CLR, OUTPUTS, Output
from asperity.inference.settings import LOAD, SPEED, TEMPERATURE, Setting
from asperity.study import (
    ParameterRange,
    StudyPlan,
    StudyProgress,
    StudyResult,
    overrides_at,
    plan_points,
    run_study,
)

FOLDS = 5  # of the points: each is held out of the processes that foretell it
LAYOUT = 1  # counts up when what an emulator keeps or means changes
MOST_MISSING = 0.2  # share of the points whose contacts failed
FITTED = "emulator.json"
FURTHER, SHARES = "further", "shares.json"
FINER, FINER_POINTS = "finer", 24  # points solved on twice the cells too
NORMAL_90 = 1.6448536269514722
FILM_EXPONENTS = {
    "viscosity": 0.7,
    "alpha": 0.54,
    "load": -0.13,
    "sq": -1.0,
}  # ln Λ: Dowson and Higginson's film


@dataclass(frozen=True)
class EmulatorQuality:
    """How far an emulator is off, found on points held out, in the output's own unit.

    `error` is the rms of held-out means against emulated ones; `coverage` the share of them within
    the stated 90 %; `scatter` that of one surface about its point's mean; `scatter_of_mean` that
    of a point's mean. Both are in every error: a perfect emulator has `error` equal to
    `scatter_of_mean`.
    """

    error: float
    coverage: float
    scatter: float
    scatter_of_mean: float


@dataclass(frozen=True)
class EmulatorGridError:
    """What twice the cells change of an output, on its scale: in the mean, and by rms over points.

    Both are of the same surfaces on both grids. Finer grids still are taken to change it as much
    again, or nothing.
    """

    shift: float = 0.0
    rms: float = 0.0

    def at(self, z: Field) -> Field:
        """The correction at a standard normal number, the same for all contacts."""
        return np.asarray(self.shift + np.copysign(self.rms, self.shift) * z)


@dataclass(frozen=True)
class Emulator:
    """Means over patches of what a contact shows, anywhere in its ranges, each with a standard deviation."""

    ranges: tuple[ParameterRange, ...]
    features: "EmulatorFeatures"
    processes: Mapping[str, GaussianProcess]
    quality: Mapping[str, EmulatorQuality]
    points: int
    surfaces: int
    failed: int
    folder: Path
    seconds: float  # spent on its contacts
    cells: tuple[int, int] = (0, 0)
    grid: Mapping[str, EmulatorGridError] = field(default_factory=dict)
    further: int = 0  # of the points, those where posteriors were

    def __call__(self, shares: Field, wanted: Iterable[str]) -> dict[str, tuple[Field, Field]]:
        """Mean and standard deviation of the wanted outputs, on their scales, at shares (n, d) of the ranges."""
        x = self.features(shares)
        return {key: self.processes[key](x) for key in wanted}

    def values(self, shares: Field, key: str) -> Field:
        """The mean of one output in its own unit."""
        return OUTPUTS[key].back(self.means(shares, [key])[key])

    def means(self, shares: Field, wanted: Iterable[str]) -> dict[str, Field]:
        """The means alone, on the outputs' scales: what is asked along a course."""
        x = self.features(shares)
        return {key: self.processes[key].mean(x) for key in wanted}

    def scalars(self) -> dict[str, Any]:
        """What is told of an emulator beside what it was used for."""
        return {
            "folder": str(self.folder),
            "points": self.points,
            "further": self.further,
            "surfaces": self.surfaces,
            "failed": self.failed,
            "ranges": [str(entry) for entry in self.ranges],
            "cells": list(self.cells),
            "grid": {key: vars(error) for key, error in self.grid.items()},
            "quality": {key: vars(quality) for key, quality in self.quality.items()},
        }

    def sentence(self) -> str:
        """How good it is, in words."""
        clr, grid = self.quality[CLR], self.grid.get(CLR, EmulatorGridError())
        moved = OUTPUTS[CLR].back(np.array([0.0, grid.shift]))
        finer = (
            f" On twice the cells CLR 50 % is {100 * moved[1]:.0f} %, which is corrected for."
            if self.grid
            else ""
        )
        where = f" ({self.further} of them where posteriors were)" if self.further else ""
        return (
            f"Emulator of {self.points} contacts{where}, {self.surfaces} surfaces each: CLR of points held out is off "
            f"by {100 * clr.error:.1f} points (rms; one surface scatters by {100 * clr.scatter:.1f}), and the stated "
            f"90 % hold {100 * clr.coverage:.0f} %. Its grid has {self.cells[0]} x {self.cells[1]} cells.{finer}"
        )


@dataclass(frozen=True)
class EmulatorFeatures:
    """Shares of the ranges with one of them, that of the speed, replaced by an estimated film ratio.

    Film and contact hang on the product of viscosity and speed, by powers that are known nearly;
    what they are not is left to the process, which has the other shares.
    """

    ranges: tuple[ParameterRange, ...]
    oil: tuple[Field, Field, Field] | None = (
        None  # shares of a temperature's range; ln viscosity; ln alpha there
    )

    def __call__(self, shares: Field) -> Field:
        """Points for the processes, shape (n, d)."""
        place = {entry.key: number for number, entry in enumerate(self.ranges)}

        def log(key: str) -> Field:
            if key not in place:
                return np.zeros(len(shares))
            entry, share = self.ranges[place[key]], shares[:, place[key]]
            ratio = np.log(entry.high / entry.low)
            return np.asarray(share * ratio if entry.log else np.log1p(share * np.expm1(ratio)))

        viscous = log("lubricant.viscosity.eta0") + log(SPEED)
        alpha = log("lubricant.viscosity.alpha")
        if self.oil is not None:
            at, viscosity, piezo = self.oil
            viscous = viscous + np.interp(shares[:, place[TEMPERATURE]], at, viscosity)
            alpha = alpha + np.interp(shares[:, place[TEMPERATURE]], at, piezo)
        powers = FILM_EXPONENTS
        ratio = powers["viscosity"] * viscous + powers["alpha"] * alpha + powers["load"] * log(LOAD)
        ratio += powers["sq"] * log("surface.sq")
        x = shares.copy()
        x[:, place[SPEED]] = ratio / 4.0
        return x


def emulator_features(setting: Setting) -> EmulatorFeatures:
    """How a setting's shares become points; of an oil by its data sheet, with viscosity over temperature."""
    ranges = setting.ranges
    entry = next((entry for entry in ranges if entry.key == TEMPERATURE), None)
    if entry is None:
        return EmulatorFeatures(ranges)
    at, logs = np.linspace(0.0, 1.0, 9), []
    for share in at:
        oil = setting.case.with_overrides(overrides_at(setting.case, [entry], [share])).lubricant
        assert oil is not None
        zero = np.zeros(1)
        viscosity = float(oil.viscosity(zero)[0])
        logs.append((np.log(viscosity), np.log(float(oil.viscosity.log_slope(zero)[0]))))
    viscosity, alpha = np.array(logs).T
    return EmulatorFeatures(ranges, (at, viscosity - viscosity.mean(), alpha - alpha.mean()))


# Built and kept
# ----------------------------------------------------------------------


def emulators_folder() -> Path:
    """Where emulators are kept that were given no folder: the user's cache."""
    return user_cache() / "emulators"


def build_emulator(
    setting: Setting,
    *,
    folder: str | Path | None = None,
    executor: Executor | None = None,
    workers: int | None = None,
    progress: Callable[[StudyProgress], None] | None = None,
) -> Emulator:
    """The emulator of a setting: loaded where its folder has it, completed where it was interrupted, else computed.

    Parameters
    ----------
    setting : from `inference_setting`
    folder : where it is kept; by default one in the user's cache, by case, ranges and version
    executor, workers, progress : see `asperity.study.run_study`

    Raises
    ------
    BadInput
        without scikit-learn; for a folder that holds another emulator or cannot be written to.
    AsperityError
        if too many of its contacts fail.
    """
    sobol = sobol_shares(setting)
    plan = _plan(setting, sobol)
    identity = hashlib.sha256(
        json.dumps(
            [plan.design, [case.id for case in plan.cases], version("asperity"), LAYOUT]
        ).encode()
    ).hexdigest()
    home = emulators_folder() / identity[:16] if folder is None else Path(folder)
    fitted = home / FITTED
    if not fitted.exists():
        require_learning()
    elif read_json(fitted, "delete it, and it is fitted again").get("identity") != identity:
        raise BadInput(
            f"{home} holds the emulator of another case, range or version; choose another folder"
        )
    make_folder(home)
    how: dict[str, Any] = {"executor": executor, "workers": workers, "progress": progress}
    result = run_study(plan, out=home, **how)
    shares, table, failed = _with_further(setting, sobol, result, home, **how)
    means = _Means.of(table, setting.surfaces)
    if len(means.points) < (1.0 - MOST_MISSING) * len(shares):
        reasons = table["reason"][table["status"] == "failed"]
        first = reasons.iloc[0] if len(reasons) else "they are missing"
        raise AsperityError(
            f"{len(shares) - len(means.points)} of {len(shares)} points of the emulator failed ({first}); narrow the "
            "ranges in [infer]"
        )
    features = emulator_features(setting)
    finer = _finer(setting, sobol, home=home, **how)
    processes, quality = _processes(means, features(shares[means.points]), fitted, identity)
    return Emulator(
        setting.ranges,
        features,
        processes,
        quality,
        len(means.points),
        setting.surfaces,
        failed,
        home,
        float(table["seconds"].sum()),
        setting.case.grid.cells,
        _grid_errors(result.table, finer),
        int(np.sum(means.points >= len(sobol))),
    )


def extend_emulator(setting: Setting, emulator: Emulator, shares: Field, **how: Any) -> Emulator:
    """The emulator with further points, at shares (n, ranges); kept beside the others, so that it stays extended.

    Stopped, the next call that builds it goes on. `how` is as `build_emulator` takes it.

    Raises
    ------
    BadInput
        for more points than an emulator may have, or one that is not on disk.
    """
    if not (emulator.folder / FITTED).exists():
        raise BadInput(
            f"{emulator.folder} holds no emulator; only one that is kept can be extended"
        )
    if emulator.points + len(shares) > MOST_POINTS:
        raise BadInput(
            f"an emulator has {MOST_POINTS} points at most, got {emulator.points} and {len(shares)}; extend it by less"
        )
    last = max(
        (int(path.name) for path in (emulator.folder / FURTHER).glob("[0-9][0-9][0-9]")), default=-1
    )
    place = emulator.folder / FURTHER / f"{last + 1:03d}"
    make_folder(place)
    write_json(place / SHARES, {"shares": np.asarray(shares, dtype=float).tolist()})
    return build_emulator(setting, folder=emulator.folder, **how)


def _plan(setting: Setting, shares: Field) -> StudyPlan:
    points = [overrides_at(setting.case, setting.ranges, one) for one in shares]
    return plan_points(setting.case, points, seeds=setting.surfaces, kind="still")


def _further(home: Path) -> list[Path]:
    """Folders of the points that it was extended by, in order."""
    return sorted(path.parent for path in (home / FURTHER).glob(f"*/{SHARES}"))


def _with_further(
    setting: Setting, sobol: Field, result: StudyResult, home: Path, **how: Any
) -> tuple[Field, pandas.DataFrame, int]:
    """Shares and rows of all points, the further ones behind the first, and how many contacts failed."""
    shares, tables, failed = [sobol], [result.table], result.failed
    for folder in _further(home):
        own = np.array(read_json(folder / SHARES, f"delete {folder}")["shares"], dtype=float)
        more = run_study(_plan(setting, own), out=folder / "study", **how)
        tables.append(more.table.assign(point=more.table["point"] + sum(map(len, shares))))
        shares.append(own)
        failed += more.failed
    return np.concatenate(shares), pandas.concat(tables, ignore_index=True), failed


def _finer(setting: Setting, sobol: Field, *, home: Path, **how: Any) -> pandas.DataFrame:
    """The first points on twice the cells along each axis, the same surfaces."""
    twice = setting.case.with_overrides(
        {"grid.cells": [2 * count if count > 1 else 1 for count in setting.case.grid.cells]}
    )
    points = [overrides_at(twice, setting.ranges, shares) for shares in sobol[:FINER_POINTS]]
    return run_study(
        plan_points(twice, points, seeds=setting.surfaces, kind="still"), out=home / FINER, **how
    ).table


def _grid_errors(coarse: pandas.DataFrame, fine: pandas.DataFrame) -> dict[str, EmulatorGridError]:
    """What twice the cells change, from points of which all surfaces were solved on both grids."""
    keys = list(OUTPUTS)
    means = []
    for table in (coarse, fine):
        done = table[table["status"] == "done"].dropna(subset=keys)
        means.append(done.set_index(["point", "realisation"])[keys])
    both = means[0].index.intersection(means[1].index)
    if both.empty:
        return {}
    old, new = (table.loc[both].groupby("point").mean() for table in means)
    errors = {}
    for key, output in OUTPUTS.items():
        change = output.forward(new[key].to_numpy()) - output.forward(old[key].to_numpy())
        errors[key] = EmulatorGridError(float(np.mean(change)), float(np.sqrt(np.mean(change**2))))
    return errors


def _processes(
    means: "_Means", x: Field, fitted: Path, identity: str
) -> tuple[dict[str, GaussianProcess], dict[str, EmulatorQuality]]:
    """A process for each output and how good it is: as they were kept, or fitted now, and kept."""
    processes, quality = {}, {}
    known = read_json(fitted, "delete it, and it is fitted again") if fitted.exists() else None
    if known is not None and known.get("points", len(x)) != len(x):
        known = None  # extended since
    for output in OUTPUTS.values():
        y, noise = means.scaled(output)
        if known is None:
            processes[output.key] = fit_process(x, y, noise)
            quality[output.key] = _held_out(means, output, processes[output.key])
        else:
            processes[output.key], quality[output.key] = _as_kept(known, output.key, x, y, noise)
    if known is None:
        kept = {
            key: {**processes[key].settings(), "quality": vars(quality[key])} for key in OUTPUTS
        }
        write_json(
            fitted, {"identity": identity, "layout": LAYOUT, "points": len(x), "outputs": kept}
        )
    return processes, quality


def sobol_shares(setting: Setting) -> Field:
    """Shares of the ranges of all points of a setting's emulator, (points, ranges)."""
    from scipy.stats import qmc

    count = len(setting.ranges)
    points = qmc.Sobol(count, rng=setting.seed).random(1 << (setting.points - 1).bit_length())
    return np.asarray(points[: setting.points])


def _as_kept(
    known: Mapping[str, Any], key: str, x: Field, y: Field, noise: Field
) -> tuple[GaussianProcess, EmulatorQuality]:
    try:
        entry = known["outputs"][key]
        lengths = np.asarray(entry["lengths"], dtype=float)
        process = GaussianProcess(
            x, y, noise, lengths, float(entry["level"]), float(entry["rough"])
        )
        return process, EmulatorQuality(**entry["quality"])
    except (KeyError, TypeError, ValueError):
        raise UnreadableFile(
            f"{FITTED} says nothing of {key}; delete it, and it is fitted again"
        ) from None


@dataclass(frozen=True)
class _Means:
    """Means over surfaces at the points where all of them were solved, and how single ones scatter about them."""

    points: Field
    mean: pandas.DataFrame
    variance: pandas.DataFrame  # of one surface, smoothed over the points
    surfaces: int

    @classmethod
    def of(cls, table: pandas.DataFrame, surfaces: int) -> "_Means":
        """From the rows of a study."""
        keys = list(OUTPUTS)
        done = table[table["status"] == "done"].dropna(subset=keys)
        groups = done.groupby("point")[keys]
        whole = groups.size() == surfaces
        mean = groups.mean()[whole]
        spread = groups.var(ddof=1)[whole] if surfaces > 1 else mean * 0.0
        smoothed = {
            key: _smoothed(OUTPUTS[key], mean[key].to_numpy(), spread[key].to_numpy())
            for key in keys
        }
        return cls(
            mean.index.to_numpy(), mean, pandas.DataFrame(smoothed, index=mean.index), surfaces
        )

    def scaled(self, output: Output) -> tuple[Field, Field]:
        """Means on an output's scale, and their variance there."""
        mean = self.mean[output.key].to_numpy()
        variance = self.variance[output.key].to_numpy() / self.surfaces
        return output.forward(mean), variance * output.slope(mean) ** 2


def _smoothed(output: Output, mean: Field, variance: Field) -> Field:
    """Variance of one surface, as a smooth function of the mean: two or three surfaces a point tell it badly each.

    On the output's scale: bins of a tenth of the points, and lines between.
    """
    scaled, spread = output.forward(mean), variance * output.slope(mean) ** 2
    order = np.argsort(scaled)
    bins = np.array_split(order, min(10, max(1, len(order) // 8)))
    centres = np.array([scaled[part].mean() for part in bins])
    levels = np.array([spread[part].mean() for part in bins]) + 1e-12
    return np.asarray(np.exp(np.interp(scaled, centres, np.log(levels))) / output.slope(mean) ** 2)


def _held_out(means: _Means, output: Output, whole: GaussianProcess) -> EmulatorQuality:
    """Each point foretold by a process fitted to the others."""
    y, noise = means.scaled(output)
    fold = np.arange(y.size) % FOLDS
    predictive_mixture, std = np.empty(y.size), np.empty(y.size)
    for number in range(FOLDS):
        out = fold == number
        process = fit_process(whole.x[~out], y[~out], noise[~out], start=whole)
        predictive_mixture[out], std[out] = process(whole.x[out])
    mean = means.mean[output.key].to_numpy()
    variance = means.variance[output.key].to_numpy()
    within = np.abs(y - predictive_mixture) <= NORMAL_90 * np.sqrt(std**2 + noise)
    return EmulatorQuality(
        error=float(np.sqrt(np.mean((output.back(predictive_mixture) - mean) ** 2))),
        coverage=float(np.mean(within)),
        scatter=float(np.sqrt(np.mean(variance))),
        scatter_of_mean=float(np.sqrt(np.mean(variance / means.surfaces))),
    )
