"""Emulator of a contact: Gaussian processes fitted to a stored Sobol study of solved contacts.

Several surfaces per point separate the mean over patches, which a recording measures, from the
scatter between patches, which it averages. The emulator's error is found by cross-validation.
"""

import hashlib
import json
import math
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, field
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pandas

from asperity.case import MOST_POINTS
from asperity.core.arrays import Field
from asperity.core.coverage import NORMAL_FACTOR, PERCENT
from asperity.core.documents import JsonObject
from asperity.core.errors import AsperityError, BadInput, UnreadableFile
from asperity.core.files import make_folder, user_cache
from asperity.core.storage import read_json, write_json
from asperity.inference.feature_map import EmulatorFeatures, emulator_features
from asperity.inference.gaussian_process import GaussianProcess, fit_process, require_learning
from asperity.inference.outputs import CLR, OUTPUTS, Output
from asperity.inference.settings import Setting
from asperity.study import (
    ParameterRange,
    StudyPlan,
    StudyProgress,
    StudyResult,
    overrides_at,
    plan_points,
    run_study,
)

FOLDS = 5  # of the cross-validation
LAYOUT = 2  # increases when the stored content or its meaning changes
MAX_MISSING = 0.2  # fraction of points with failed contacts
FITTED = "emulator.json"
REFIT = "delete it to fit it again"
FURTHER, SHARES = "further", "shares.json"
FINER, FINER_POINTS = "finer", 24  # points also solved on twice the cells


@dataclass(frozen=True)
class EmulatorQuality:
    """Cross-validation error of an emulated output, in its own unit.

    `error` is the rms difference of held-out means from the emulator; `coverage` the fraction
    within the stated interval; `scatter` the deviation of one surface from its point's mean;
    `scatter_of_mean` that of a point's mean, the `error` of a perfect emulator.
    """

    error: float
    coverage: float
    scatter: float
    scatter_of_mean: float


@dataclass(frozen=True)
class EmulatorGridError:
    """Change of an output on twice the cells, on its scale: mean and rms over points.

    Both grids use the same surfaces. Further refinement is assumed to change the output by at most
    as much again.
    """

    shift: float = 0.0
    rms: float = 0.0

    def correction(self, z: Field) -> Field:
        """Return the grid correction at a standard normal number, the same for all contacts."""
        return np.asarray(self.shift + np.copysign(self.rms, self.shift) * z)


@dataclass(frozen=True)
class Emulator:
    """Emulated means over patches of a contact's outputs within its ranges, with deviations."""

    ranges: tuple[ParameterRange, ...]
    features: EmulatorFeatures
    processes: Mapping[str, GaussianProcess]
    quality: Mapping[str, EmulatorQuality]
    points: int
    surfaces: int
    failed: int
    folder: Path
    seconds: float  # computing time of its contacts
    cells: tuple[int, int] = (0, 0)
    grid: Mapping[str, EmulatorGridError] = field(default_factory=dict)
    further: int = 0  # number of points added in the region of posteriors

    def __call__(self, shares: Field, keys: Iterable[str]) -> dict[str, tuple[Field, Field]]:
        """Predict mean and standard deviation of outputs on their scales at shares (n, d)."""
        x = self.features(shares)
        return {key: self.processes[key](x) for key in keys}

    def values(self, shares: Field, key: str) -> Field:
        """Predict the mean of one output in its own unit."""
        return OUTPUTS[key].back(self.means(shares, [key])[key])

    def means(self, shares: Field, keys: Iterable[str]) -> dict[str, Field]:
        """Predict only the means of outputs on their scales."""
        x = self.features(shares)
        return {key: self.processes[key].mean(x) for key in keys}

    def scalars(self) -> JsonObject:
        """Return the JSON output of the emulator."""
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
        """Return a summary of the emulator's size and accuracy."""
        clr = self.quality[CLR]
        grid = self.grid.get(CLR, EmulatorGridError())
        refined = OUTPUTS[CLR].back(np.array([0.0, grid.shift]))
        finer = (
            f" On twice the cells CLR 50 % becomes {100 * refined[1]:.0f} %; this is corrected."
            if self.grid
            else ""
        )
        added = f" ({self.further} of them added at posteriors)" if self.further else ""
        return (
            f"Emulator of {self.points} contacts{added}, {self.surfaces} surfaces each: "
            f"cross-validation error of CLR {100 * clr.error:.1f} points (rms; scatter of one "
            f"surface {100 * clr.scatter:.1f}), coverage of the {PERCENT} interval "
            f"{100 * clr.coverage:.0f} %. Its grid has {self.cells[0]} x {self.cells[1]} cells."
            f"{finer}"
        )


# Building and storing
# ----------------------------------------------------------------------


def emulators_folder() -> Path:
    """Return the default folder of emulators, in the user's cache."""
    return user_cache() / "emulators"


def build_emulator(
    setting: Setting,
    *,
    folder: str | Path | None = None,
    executor: Executor | None = None,
    workers: int | None = None,
    progress: Callable[[StudyProgress], None] | None = None,
) -> Emulator:
    """Load the emulator of a setting, or resume or start its computation.

    Parameters
    ----------
    setting : from `inference_setting`
    folder : to store it in; by default in the user's cache, by case, ranges and version
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
    identity = _identity(plan)
    home = emulators_folder() / identity[:16] if folder is None else Path(folder)
    _require_identity(home, identity)
    make_folder(home)
    run = partial(run_study, executor=executor, workers=workers, progress=progress)
    result = run(plan, out=home)
    shares, table, failed = _with_further(setting, sobol, result, home, run)
    means = _Means.from_table(table, setting.surfaces)
    _require_points(table, len(means.points), len(shares))
    features = emulator_features(setting)
    finer = _finer(setting, sobol, home, run)
    processes, quality = _fitted_gps(means, features(shares[means.points]), home / FITTED, identity)
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
        setting.case.among_many.solved_cells,
        _grid_errors(result.table, finer),
        int(np.sum(means.points >= len(sobol))),
    )


def _identity(plan: StudyPlan) -> str:
    """Return the digest of all on which an emulator depends."""
    content = [plan.design, [case.id for case in plan.cases], version("asperity"), LAYOUT]
    return hashlib.sha256(json.dumps(content).encode()).hexdigest()


def _require_identity(home: Path, identity: str) -> None:
    """Raise BadInput for a folder with another emulator, or a new one without scikit-learn."""
    fitted = home / FITTED
    if not fitted.exists():
        require_learning()
    elif read_json(fitted, REFIT).get("identity") != identity:
        raise BadInput(
            f"{home} holds the emulator of another case, range or version; choose another folder"
        )


def _require_points(table: pandas.DataFrame, solved: int, planned: int) -> None:
    """Raise AsperityError if too many points have failed."""
    if solved < (1.0 - MAX_MISSING) * planned:
        reasons = table["reason"][table["status"] == "failed"]
        first = reasons.iloc[0] if len(reasons) else "they are missing"
        raise AsperityError(
            f"{planned - solved} of {planned} points of the emulator failed "
            f"({first}); narrow the ranges in [infer]"
        )


def extend_emulator(
    setting: Setting,
    emulator: Emulator,
    shares: Field,
    *,
    executor: Executor | None = None,
    workers: int | None = None,
    progress: Callable[[StudyProgress], None] | None = None,
) -> Emulator:
    """Add points at shares (n, ranges) to an emulator and its folder.

    If interrupted, the next `build_emulator` resumes. The options are those of `build_emulator`.

    Raises
    ------
    BadInput
        for too many points, or an emulator that is not on disk.
    """
    if not (emulator.folder / FITTED).exists():
        raise BadInput(f"{emulator.folder} holds no emulator; only a stored one can be extended")
    if emulator.points + len(shares) > MOST_POINTS:
        raise BadInput(
            f"an emulator has at most {MOST_POINTS} points, got {emulator.points} and "
            f"{len(shares)}; add fewer"
        )
    last = max(
        (int(path.name) for path in (emulator.folder / FURTHER).glob("[0-9][0-9][0-9]")), default=-1
    )
    folder = emulator.folder / FURTHER / f"{last + 1:03d}"
    make_folder(folder)
    write_json(folder / SHARES, {"shares": np.asarray(shares, dtype=float).tolist()})
    return build_emulator(
        setting, folder=emulator.folder, executor=executor, workers=workers, progress=progress
    )


def _plan(setting: Setting, shares: Field) -> StudyPlan:
    points = [overrides_at(setting.case, setting.ranges, point) for point in shares]
    return plan_points(setting.case, points, seeds=setting.surfaces, kind="still")


def _further(home: Path) -> list[Path]:
    """Return the folders of the added points, in order."""
    return sorted(path.parent for path in (home / FURTHER).glob(f"*/{SHARES}"))


def _with_further(
    setting: Setting,
    sobol: Field,
    result: StudyResult,
    home: Path,
    run: partial[StudyResult],
) -> tuple[Field, pandas.DataFrame, int]:
    """Return shares and rows of all points, added ones last, and the number of failed contacts."""
    shares = [sobol]
    tables = [result.table]
    failed = result.failed
    for folder in _further(home):
        added = np.array(read_json(folder / SHARES, f"delete {folder}")["shares"], dtype=float)
        solved = run(_plan(setting, added), out=folder / "study")
        tables.append(solved.table.assign(point=solved.table["point"] + sum(map(len, shares))))
        shares.append(added)
        failed += solved.failed
    return np.concatenate(shares), pandas.concat(tables, ignore_index=True), failed


def _finer(
    setting: Setting, sobol: Field, home: Path, run: partial[StudyResult]
) -> pandas.DataFrame:
    """Solve the first points on twice the cells along each axis, with the same surfaces."""
    case = setting.case.among_many
    doubled = [2 * count if count > 1 else 1 for count in case.grid.cells]
    fourfold = {"solver.running_cells": 4 * math.prod(case.solved_cells)}
    refined = case.with_written({"grid.cells": doubled, **fourfold})
    points = [overrides_at(refined, setting.ranges, shares) for shares in sobol[:FINER_POINTS]]
    plan = plan_points(refined, points, seeds=setting.surfaces, kind="still")
    return run(plan, out=home / FINER).table


def _grid_errors(coarse: pandas.DataFrame, fine: pandas.DataFrame) -> dict[str, EmulatorGridError]:
    """Return the changes on twice the cells, from surfaces solved on both grids."""
    keys = list(OUTPUTS)
    means = []
    for table in (coarse, fine):
        done = table[table["status"] == "done"].dropna(subset=keys)
        means.append(done.set_index(["point", "realisation"])[keys])
    common = means[0].index.intersection(means[1].index)
    if common.empty:
        return {}
    old, new = (table.loc[common].groupby("point").mean() for table in means)
    errors = {}
    for key, output in OUTPUTS.items():
        change = output.forward(new[key].to_numpy()) - output.forward(old[key].to_numpy())
        errors[key] = EmulatorGridError(float(np.mean(change)), float(np.sqrt(np.mean(change**2))))
    return errors


def _fitted_gps(
    means: "_Means", x: Field, fitted: Path, identity: str
) -> tuple[dict[str, GaussianProcess], dict[str, EmulatorQuality]]:
    """Load the Gaussian process of each output and its quality, or else fit and store them."""
    processes, quality = {}, {}
    stored = read_json(fitted, REFIT) if fitted.exists() else None
    if stored is not None and stored.get("points", len(x)) != len(x):
        stored = None  # points have been added since
    for output in OUTPUTS.values():
        y, noise = means.scaled(output)
        if stored is None:
            processes[output.key] = fit_process(x, y, noise)
            quality[output.key] = _held_out(means, output, processes[output.key])
        else:
            processes[output.key], quality[output.key] = _load(stored, output.key, x, y, noise)
    if stored is None:
        outputs = {
            key: {**processes[key].settings(), "quality": vars(quality[key])} for key in OUTPUTS
        }
        write_json(
            fitted,
            {"identity": identity, "layout": LAYOUT, "points": len(x), "outputs": outputs},
        )
    return processes, quality


def sobol_shares(setting: Setting) -> Field:
    """Return the Sobol points of a setting's emulator as shares, (points, ranges)."""
    from scipy.stats import qmc

    count = len(setting.ranges)
    points = qmc.Sobol(count, rng=setting.seed).random(1 << (setting.points - 1).bit_length())
    return np.asarray(points[: setting.points])


def _load(
    stored: Mapping[str, Any], key: str, x: Field, y: Field, noise: Field
) -> tuple[GaussianProcess, EmulatorQuality]:
    try:
        entry = stored["outputs"][key]
        lengths = np.asarray(entry["lengths"], dtype=float)
        process = GaussianProcess(
            x, y, noise, lengths, float(entry["level"]), float(entry["rough"])
        )
        return process, EmulatorQuality(**entry["quality"])
    except (KeyError, TypeError, ValueError):
        raise UnreadableFile(f"{FITTED} has no valid entry for {key}; {REFIT}") from None


@dataclass(frozen=True)
class _Means:
    """Means and variances over surfaces at the points where all surfaces were solved."""

    points: Field
    mean: pandas.DataFrame
    variance: pandas.DataFrame  # of one surface, smoothed over the points
    surfaces: int

    @classmethod
    def from_table(cls, table: pandas.DataFrame, surfaces: int) -> "_Means":
        """Compute the means from the rows of a study."""
        keys = list(OUTPUTS)
        done = table[table["status"] == "done"].dropna(subset=keys)
        groups = done.groupby("point")[keys]
        complete = groups.size() == surfaces
        mean = groups.mean()[complete]
        spread = groups.var(ddof=1)[complete] if surfaces > 1 else mean * 0.0
        smoothed = {
            key: _smoothed(OUTPUTS[key], mean[key].to_numpy(), spread[key].to_numpy())
            for key in keys
        }
        return cls(
            mean.index.to_numpy(), mean, pandas.DataFrame(smoothed, index=mean.index), surfaces
        )

    def scaled(self, output: Output) -> tuple[Field, Field]:
        """Return means and their variances on an output's scale."""
        mean = self.mean[output.key].to_numpy()
        variance = self.variance[output.key].to_numpy() / self.surfaces
        return output.forward(mean), variance * output.slope(mean) ** 2


def _smoothed(output: Output, mean: Field, variance: Field) -> Field:
    """Return the variance of one surface, smoothed over the mean since each point has few surfaces.

    Linear interpolation of ln variance between bins of a tenth of the points, on the output's
    scale.
    """
    scaled = output.forward(mean)
    spread = variance * output.slope(mean) ** 2
    order = np.argsort(scaled)
    bins = np.array_split(order, min(10, max(1, len(order) // 8)))
    centres = np.array([scaled[part].mean() for part in bins])
    levels = np.array([spread[part].mean() for part in bins]) + 1e-12
    return np.asarray(np.exp(np.interp(scaled, centres, np.log(levels))) / output.slope(mean) ** 2)


def _held_out(means: _Means, output: Output, full_fit: GaussianProcess) -> EmulatorQuality:
    """Cross-validate a process: predict each point from a fit to the other folds."""
    y, noise = means.scaled(output)
    fold = np.arange(y.size) % FOLDS
    predicted = np.empty(y.size)
    std = np.empty(y.size)
    for number in range(FOLDS):
        out = fold == number
        process = fit_process(full_fit.x[~out], y[~out], noise[~out], start=full_fit)
        predicted[out], std[out] = process(full_fit.x[out])
    mean = means.mean[output.key].to_numpy()
    variance = means.variance[output.key].to_numpy()
    inside = np.abs(y - predicted) <= NORMAL_FACTOR * np.sqrt(std**2 + noise)
    return EmulatorQuality(
        error=float(np.sqrt(np.mean((output.back(predicted) - mean) ** 2))),
        coverage=float(np.mean(inside)),
        scatter=float(np.sqrt(np.mean(variance))),
        scatter_of_mean=float(np.sqrt(np.mean(variance / means.surfaces))),
    )
