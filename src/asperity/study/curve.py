"""Wear curve (the paper's Figs 7 and 8): load sharing, contact resonance and stages over Sq."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas
import scipy
from numpy.typing import ArrayLike, NDArray

from asperity.case import Case
from asperity.core.arrays import Field, usual_float_errors
from asperity.core.coverage import COVERAGE
from asperity.core.displayed import Brief
from asperity.core.errors import BadInput, require_positive
from asperity.core.quantities import catalogue
from asperity.study.evaluate import BOTH_PRESETS, DONE
from asperity.study.execute import StudyProgress, run_study
from asperity.study.plan import plan_points
from asperity.study.result import StudyResult
from asperity.trend import StageErrors, Stages, split_stages

SQ_KEY = "surface.sq"


@dataclass(frozen=True, repr=False)
class WearCurve(Brief):
    """Load sharing and contact resonance over roughness.

    Parameters
    ----------
    sq : shape (levels,), nominal roughness [m], ascending
    table : one row per case, as in `StudyResult.table`; failed cases are left out of every mean
    """

    sq: Field
    table: pandas.DataFrame

    @property
    def left_out(self) -> int:
        """Cases that failed or did not converge."""
        return int((self.table["status"] != DONE).sum())

    def values(self, quantity: str, level: int) -> Field:
        """Return every seed's finite value of a column at a level, shape (seeds,).

        Raises
        ------
        BadInput
            for a column that the table does not have.
        """
        if quantity not in self.table:
            raise BadInput(
                f"the study has no column {quantity!r}; it has {', '.join(self.table.columns)}"
            )
        values = self.table[quantity].iloc[self._rows[level]].to_numpy(dtype=float)
        return np.asarray(values[np.isfinite(values)])

    def by_case(self, quantity: str) -> tuple[Field, Field]:
        """Return Sq [m] and value of every valid case, each of shape (cases,)."""
        rows = self.table[self.table["status"] == DONE].dropna(subset=quantity)
        return rows[SQ_KEY].to_numpy(dtype=float), rows[quantity].to_numpy(dtype=float)

    def mean(self, quantity: str) -> Field:
        """Return the mean over seeds, shape (levels,); nan where no seed has a value."""
        return np.array(
            [values.mean() if values.size else np.nan for values in self._by_level(quantity)]
        )

    def std(self, quantity: str) -> Field:
        """Return the standard deviation over seeds (single surfaces), shape (levels,)."""
        return np.array(
            [
                values.std(ddof=1) if values.size > 1 else np.nan
                for values in self._by_level(quantity)
            ]
        )

    def interval(self, quantity: str, level: float = COVERAGE) -> Field:
        """Return Student's interval of the mean, shape (levels, 2); nan for fewer than 2 seeds.

        It is clipped to the quantity's physical range, which leaves its coverage unchanged.
        """
        return interval_in_range(quantity, self.mean(quantity), self._half_width(quantity, level))

    def interpolate(
        self, sq: float, quantity: str, level: float = COVERAGE
    ) -> tuple[float, float, float]:
        """Interpolate mean and interval linearly at a roughness [m]; nan outside the levels."""
        mean = self.mean(quantity)
        half_width = self._half_width(quantity, level)
        if not self.sq[0] * (1 - 1e-9) <= sq <= self.sq[-1] * (1 + 1e-9):
            return np.nan, np.nan, np.nan
        weights = np.ones(1)
        if self.sq.size > 1:
            right = int(np.clip(np.searchsorted(self.sq, sq), 1, self.sq.size - 1))
            share = float(
                np.clip((sq - self.sq[right - 1]) / (self.sq[right] - self.sq[right - 1]), 0.0, 1.0)
            )
            weights = np.zeros(self.sq.size)
            weights[right - 1 : right + 1] = 1.0 - share, share
        used = weights > 0.0
        middle = float(weights[used] @ mean[used])
        # the surfaces of neighbouring levels are independent
        error = float(np.sqrt(np.sum((weights[used] * half_width[used]) ** 2)))
        return middle, *_single_interval(quantity, middle, error)

    @cached_property
    def stages(self) -> dict[str, Stages]:
        """Stages over Sq [um] from CRF and CRFA of each preset; empty without vibration."""
        rows = self.table[self.table["status"] == DONE]
        stages = {}
        for preset in BOTH_PRESETS:
            if f"crf_{preset}_hz" in rows:
                keys = (SQ_KEY, f"crf_{preset}_hz", f"crfa_{preset}", f"crf_std_{preset}_hz")
                sq, crf_hz, crfa, std = (rows[key].to_numpy(dtype=float) for key in keys)
                stages[preset] = split_stages(
                    1e6 * sq, crf_hz, crfa, errors=StageErrors(crf_hz=np.nan_to_num(std)), unit="um"
                )
        return stages

    def summary(self) -> pandas.DataFrame:
        """Return mean, deviation and interval of the paper's quantities, one row per level."""
        columns: dict[str, Field] = {"sq_um": 1e6 * self.sq}
        for name in self.quantities:
            low, high = self.interval(name).T
            columns |= {
                name: self.mean(name),
                f"{name}_std": self.std(name),
                f"{name}_low": low,
                f"{name}_high": high,
            }
        return pandas.DataFrame(columns)

    @property
    def quantities(self) -> tuple[str, ...]:
        """Columns shown in the paper's Figs 7 and 8, and dynamic stiffness and damping if any."""
        resonances = [
            key for preset in BOTH_PRESETS for key in (f"crf_{preset}_hz", f"crfa_{preset}")
        ]
        contact = ("contact_damping_ratio", "contact_damping_ratio_virgin", "contact_stiffness_n_m")
        static = ("car", "car_domain", "clr", "friction_coefficient", "h_mean_m")
        return tuple(name for name in (*static, *resonances, *contact) if name in self.table)

    def verdict(self) -> str:
        """Return one sentence on load sharing, resonance and the onset of severe wear."""
        sq = 1e6 * self.sq
        clr = 100.0 * self.mean("clr")
        sentence = (
            f"Between Sq {sq[0]:.3g} and {sq[-1]:.3g} um the asperities' share of the load goes "
            f"from {clr[0]:.0f} to {clr[-1]:.0f} %"
        )
        if "crf_sound_hz" in self.table:
            crf = self.mean("crf_sound_hz")
            sentence += f", the contact resonance from {crf[0]:.0f} to {crf[-1]:.0f} Hz. "
            sentence += self.stages["sound"].verdict
        sentence = f"{sentence.rstrip('.')}."
        return (
            f"{self.left_out} CASES FAILED and are left out: {sentence}"
            if self.left_out
            else sentence
        )

    def _half_width(self, quantity: str, level: float) -> Field:
        """Return half the width of Student's interval of the mean, shape (levels,)."""
        counts = np.array([values.size for values in self._by_level(quantity)])
        return student_half_width(self.std(quantity), counts, level)

    @cached_property
    def _rows(self) -> list[NDArray[np.intp]]:
        """Positions of each level's valid cases in the table."""
        valid, sq = (self.table["status"] == DONE).to_numpy(), self.table[SQ_KEY].to_numpy()
        return [np.flatnonzero(valid & (sq == level)) for level in self.sq]

    def _by_level(self, quantity: str) -> list[Field]:
        return [self.values(quantity, level) for level in range(self.sq.size)]


def student_half_width(std: ArrayLike, counts: ArrayLike, level: float = COVERAGE) -> Field:
    """Return half the width of Student's interval of a mean over `counts` values."""
    quantile = scipy.special.stdtrit(np.maximum(np.asarray(counts) - 1, 1), 0.5 + level / 2.0)
    return np.asarray(quantile * std / np.sqrt(np.maximum(counts, 1)))


def interval_in_range(key: str, means: Field, half_widths: Field) -> Field:
    """Return means ± half-widths within the physical range of a quantity, shape (means, 2)."""
    ends = means[:, None] + np.outer(half_widths, (-1.0, 1.0))
    entry = catalogue().get(key)
    if entry is None:  # by preset or of another table: not a share
        return np.asarray(ends)
    for row, mean in zip(ends, means, strict=True):
        if np.isfinite(row).all():
            row[:] = entry.within_range(float(mean), *map(float, row))
    return np.asarray(ends)


def _single_interval(key: str, mean: float, half_width: float) -> tuple[float, float]:
    low, high = interval_in_range(key, np.array([mean]), np.array([half_width]))[0]
    return float(low), float(high)


@usual_float_errors
def wear_curve(
    case: Case,
    *,
    sq_values: Sequence[float],
    seeds: int | Sequence[int],
    executor: Executor | None = None,
    workers: int | None = None,
    progress: Callable[[StudyProgress], None] | None = None,
) -> WearCurve:
    """Solve a case at several roughnesses, several surfaces each, and find the resonance of each.

    Parameters
    ----------
    case : the contact; its surface is generated anew for each Sq and seed
    sq_values : shape (levels,) [m]
    seeds : number of surfaces per level, or their seeds
    executor, workers, progress : see `run_study`

    Raises
    ------
    BadInput
        for a roughness that is not positive, or a case without an Sq to vary.
    """
    for sq in sq_values:
        require_positive("Sq", sq, "m")
    plan = plan_points(case, sq_points(sorted(set(sq_values))), seeds=seeds)
    return curve_from_study(run_study(plan, executor=executor, workers=workers, progress=progress))


def sq_points(levels: Sequence[float]) -> list[dict[str, str]]:
    """Return the points of a study at these roughnesses [m]."""
    return [{SQ_KEY: f"{1e6 * sq:.9g} um"} for sq in levels]


def curve_from_study(result: StudyResult) -> WearCurve:
    """Return the wear curve of a study that varies only Sq.

    Raises
    ------
    BadInput
        if the study varies anything else or has no finished case.
    """
    if not is_wear_study(result):
        swept = ", ".join(result.plan.axes) or "none"
        raise BadInput(f"a wear curve needs a study that varies {SQ_KEY} alone, got {swept}")
    if not (result.table["status"] == DONE).any():
        raise BadInput("a wear curve needs finished cases, got none; run the study first")
    return WearCurve(np.sort(result.table[SQ_KEY].unique().astype(float)), result.table)


def is_wear_study(result: StudyResult) -> bool:
    """Return True if a study varies only Sq and seeds."""
    swept = [key for key in result.plan.axes if key not in ("surface.seed", "vibration.seed")]
    return swept == [SQ_KEY] and result.plan.kind != "vibrate"
