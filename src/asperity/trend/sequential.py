"""Tests of one series for a knee, growth or a step, against all smooth explanations.

Each test is the likelihood ratio of two families of courses, both with autocorrelated scatter
(first order, correlation up to 0.9). `alarm` decides what follows from it; docs/theory/alarms.md
has the equations and the measured false-alarm rates.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field, Mask

BASELINE_POINTS = 8  # the fewest points that any test needs
CORRELATIONS = np.array(
    [-0.3, 0.0, 0.3, 0.5, 0.7, 0.8, 0.9]
)  # between the scatter of neighbouring points
LONGEST_CYCLE = 1.5  # of the length of the series
SHORTEST_CYCLE = 3.0  # mean spacings
CURVE_LENGTHS, PERIODS = 20, 30  # grid points
RAMP_LENGTHS = (0, 1, 2, 3)  # recordings between the two levels of a step
MOST_POINTS = 120  # the latest ones: earlier ones belong to another baseline
MIN_POINTS_BEFORE, MIN_POINTS_AFTER = 3, 2  # points on either side of a bend
MOST_SLOPE_RATIO = 0.5  # of a knee: slope after it over slope before it
FITTED_PARAMETERS = 5  # level, slope, change of slope, its location, correlation
CALIBRATION = 0.12  # false alarms a recording times exp(log ratio): docs/theory/alarms.md
TINY = 1e-12


class ConditionRows(NamedTuple):
    """Condition rows (conditions, points) that every course may contain, within narrow priors.

    `pull` is the scatter of the series over the standard deviation of each coefficient's zero-mean
    prior.
    """

    rows: Field
    pull: Field


class ChangeTest(NamedTuple):
    """Result of a test: ln likelihood ratio, location of the change on x, and its size."""

    log_ratio: float
    x: float
    change: float


NO_CHANGE = ChangeTest(-np.inf, np.nan, np.nan)


def threshold(false_alarm_rate: float) -> float:
    """Return the ln likelihood ratio exceeded without wear at this rate per recording."""
    return float(np.log(CALIBRATION / false_alarm_rate))


def knee_test(
    x: Field, y: Field, *, smallest_change: float, conditions: ConditionRows | None = None
) -> ChangeTest:
    """Test for a rise by `smallest_change` that continues at half its slope or less.

    The alternatives are a line, saturating curves, steps, short ramps and cycles.

    Parameters
    ----------
    x, y : shape (points,), x rising
    smallest_change : dead band, in units of y
    conditions : rows that every course may contain
    """
    return _course_test(x, y, smallest_change, conditions, rises_first=True)


def growth_test(
    x: Field, y: Field, *, smallest_change: float, conditions: ConditionRows | None = None
) -> ChangeTest:
    """Test for a constant level that then grows by `smallest_change`.

    The alternatives are a constant, saturating curves, steps, short ramps and cycles; parameters as
    in
    `knee_test`.
    """
    return _course_test(x, y, smallest_change, conditions, rises_first=False)


def step_test(
    x: Field, y: Field, *, smallest_change: float, conditions: ConditionRows | None = None
) -> ChangeTest:
    """Test for a lasting step of `smallest_change` either way within a few recordings.

    The alternatives are a line, saturating curves, cycles and a line with one break; parameters as
    in
    `knee_test`.
    """
    t, y, scale = _scaled_points(x, y)
    if t.size < BASELINE_POINTS:
        return NO_CHANGE
    whiteners = _whiteners(t.size, conditions)
    steps = _steps(t.size)
    levels = steps @ y / steps.sum(axis=1) - (1.0 - steps) @ y / np.maximum(
        (1.0 - steps).sum(axis=1), TINY
    )
    settled = steps.sum(axis=1) >= MIN_POINTS_BEFORE
    allowed = settled & (np.abs(levels) >= smallest_change)
    if not allowed.any():
        return NO_CHANGE
    hinges = np.maximum(t - _break_positions(t)[:, None], 0.0)
    likelihoods = _log_likelihoods(y, steps[allowed], whiteners=whiteners)
    against = _best_log_likelihood(
        y,
        np.concatenate([t[None], _saturating_curves(t)]),
        _sinusoids(t),
        hinges,
        whiteners=whiteners,
    )
    best = int(np.argmax(np.max(likelihoods, axis=0)))
    ratio = _corrected_ratio(float(np.max(likelihoods)) - against, t.size)
    return ChangeTest(
        ratio, scale.x_at(t[np.argmax(steps[allowed][best] > 0.0)]), float(levels[allowed][best])
    )


def _course_test(
    x: Field,
    y: Field,
    smallest_change: float,
    conditions: ConditionRows | None,
    *,
    rises_first: bool,
) -> ChangeTest:
    t, y, scale = _scaled_points(x, y)
    if t.size < BASELINE_POINTS:
        return NO_CHANGE
    whiteners = _whiteners(t.size, conditions)
    breaks = _break_positions(t)
    hinges = np.maximum(t - breaks[:, None], 0.0)
    if rises_first:
        change, allowed = _knee_candidates(t, y, breaks, hinges, smallest_change)
    else:
        change, allowed = _growth_candidates(y, hinges, smallest_change)
    if not allowed.any():
        return NO_CHANGE
    smooth = np.concatenate([_saturating_curves(t), _steps(t.size)])
    if rises_first:
        smooth = np.concatenate([t[None], smooth])
    against = _best_log_likelihood(y, smooth, _sinusoids(t), whiteners=whiteners)
    likelihoods = _log_likelihoods(
        y, hinges[allowed], companion=t if rises_first else None, whiteners=whiteners
    )
    best = int(np.argmax(np.max(likelihoods, axis=0)))
    ratio = _corrected_ratio(float(np.max(likelihoods)) - against, t.size)
    return ChangeTest(ratio, scale.x_at(breaks[allowed][best]), float(change[allowed][best]))


def _corrected_ratio(log_ratio: float, points: int) -> float:
    """Reduce the ratio for the fitted parameters: few points flatter the course fitted to them."""
    return log_ratio * (points - FITTED_PARAMETERS) / points


class _Scale(NamedTuple):
    """Start and mean spacing of x."""

    start: float
    spacing: float

    def x_at(self, t: float) -> float:
        return float(self.start + self.spacing * t)


def _scaled_points(x: Field, y: Field) -> tuple[Field, Field, _Scale]:
    """Return the latest points, x counted from the first in units of the mean spacing."""
    x, y = x[-MOST_POINTS:], y[-MOST_POINTS:]
    scale = (
        _Scale(float(x[0]), float(x[-1] - x[0]) / (x.size - 1)) if x.size > 1 else _Scale(0.0, 1.0)
    )
    return np.asarray((x - scale.start) / scale.spacing), np.asarray(y), scale


def _break_positions(t: Field) -> Field:
    """Return possible breaks: the points and the midpoints between them, except near both ends."""
    inner = t[MIN_POINTS_BEFORE - 1 : -MIN_POINTS_AFTER]
    return np.sort(np.concatenate([inner[1:], 0.5 * (inner[1:] + inner[:-1])]))


def _knee_candidates(
    t: Field, y: Field, breaks: Field, hinges: Field, smallest_change: float
) -> tuple[Field, Mask]:
    """Return each broken stick's rise at its break (least squares), and which of them are knees."""
    centred, line, bend = (rows - rows.mean(axis=-1, keepdims=True) for rows in (y, t, hinges))
    xx = line @ line
    xh = bend @ line
    hh = np.sum(bend**2, axis=1)
    determinant = np.maximum(xx * hh - xh**2, TINY)
    before = (hh * (line @ centred) - xh * (bend @ centred)) / determinant
    turn = (xx * (bend @ centred) - xh * (line @ centred)) / determinant
    rise = before * breaks
    return rise, (before > 0.0) & (before + turn < MOST_SLOPE_RATIO * before) & (
        rise >= smallest_change
    )


def _growth_candidates(y: Field, hinges: Field, smallest_change: float) -> tuple[Field, Mask]:
    """Return each hinge's growth at the end (least squares), and which exceed the dead band."""
    centred, bend = (rows - rows.mean(axis=-1, keepdims=True) for rows in (y, hinges))
    grown = (bend @ centred) / np.sum(bend**2, axis=1) * hinges[:, -1]
    return grown, grown >= smallest_change


def _saturating_curves(t: Field) -> Field:
    """Return exponentials and hyperbolas of all lengths, (curves, points)."""
    lengths = t[-1] * np.geomspace(0.03, 5.0, CURVE_LENGTHS)[:, None]
    return np.concatenate([np.exp(-t / lengths), 1.0 / (1.0 + t / lengths)])


@lru_cache(maxsize=2)  # a long series has the same number of points each time
def _steps(points: int) -> Field:
    """Return steps and ramps over a few recordings from 0 to 1, (steps, points)."""
    number = np.arange(points)
    ramps = [
        np.clip((number - np.arange(1, points - width)[:, None] + 1.0) / (width + 1.0), 0.0, 1.0)
        for width in RAMP_LENGTHS
    ]
    return np.concatenate(ramps)


def _sinusoids(t: Field) -> tuple[Field, Field]:
    """Return sines and cosines of periods from a few points to 1.5 times the series."""
    phase = 2.0 * np.pi * t / np.geomspace(SHORTEST_CYCLE, LONGEST_CYCLE * t[-1], PERIODS)[:, None]
    return np.sin(phase), np.cos(phase)


def _whitened(correlation: float, rows: Field) -> Field:
    """Return rows (..., points) with their first-order autocorrelation removed."""
    white = rows.copy()
    white[..., 1:] -= correlation * rows[..., :-1]
    white[..., 0] *= np.sqrt(1.0 - correlation**2)
    return white


class _Whitener(NamedTuple):
    """Whitening and projection: independent rows without a constant and the conditions.

    `removed` holds the orthonormal rows projected out. The columns after the points carry the
    priors of the conditions' coefficients.
    """

    removed: Field
    correlation: float

    def __call__(self, rows: Field) -> Field:
        white = _whitened(self.correlation, rows)
        more = self.removed.shape[1] - white.shape[-1]
        if more:
            white = np.concatenate([white, np.zeros((*white.shape[:-1], more))], axis=-1)
        return np.asarray(white - (white @ self.removed.T) @ self.removed)


@lru_cache(maxsize=2)
def _plain_whiteners(points: int) -> list[_Whitener]:
    constants = [_whitened(correlation, np.ones(points)) for correlation in CORRELATIONS]
    return [
        _Whitener((row / np.sqrt(row @ row))[None], float(correlation))
        for row, correlation in zip(constants, CORRELATIONS, strict=True)
    ]


def _whiteners(points: int, conditions: ConditionRows | None) -> list[_Whitener]:
    if conditions is None or not len(conditions.rows):
        return _plain_whiteners(points)
    rows = np.concatenate([np.ones((1, points)), conditions.rows[:, -points:]])
    prior = np.concatenate([np.zeros((1, len(conditions.pull))), np.diag(conditions.pull)])
    results = []
    for correlation in CORRELATIONS:
        innovation = np.sqrt(1.0 - correlation**2)  # uncorrelated part of the scatter
        total = np.concatenate([_whitened(correlation, rows), innovation * prior], axis=1)
        results.append(_Whitener(np.linalg.qr(total.T)[0].T, float(correlation)))
    return results


def _log_likelihood(correlation: float, residual: Field, total: float, points: int) -> Field:
    """Return the profile ln likelihood of Gaussian scatter with the squared residual `residual`."""
    return np.asarray(
        0.5 * np.log(1.0 - correlation**2)
        - 0.5 * points * np.log(np.maximum(residual, TINY * max(total, TINY)))
    )


def _log_likelihoods(
    y: Field, rows: Field, companion: Field | None = None, whiteners: list[_Whitener] | None = None
) -> Field:
    """Return ln likelihoods of a constant with each row (and a companion), (correlations, rows)."""
    results = []
    for white in whiteners or _plain_whiteners(y.size):
        z, bend = white(y), white(rows)
        total = float(z @ z)
        if companion is None:
            residual = total - _explained_by_row(bend, z)
        else:
            residual = total - _explained_by_pair(
                np.broadcast_to(white(companion), bend.shape), bend, z
            )
        results.append(_log_likelihood(white.correlation, residual, total, y.size))
    return np.array(results)


def _best_log_likelihood(
    y: Field,
    rows: Field,
    sinusoids: tuple[Field, Field],
    hinges: Field | None = None,
    *,
    whiteners: list[_Whitener],
) -> float:
    """Return the best ln likelihood of a constant with a row, a cycle, or a line and a hinge."""
    best = []
    for white in whiteners:
        z = white(y)
        removed = [
            _explained_by_row(white(rows), z).max(),
            _explained_by_pair(white(sinusoids[0]), white(sinusoids[1]), z).max(),
        ]
        if hinges is not None:
            bend = white(hinges)
            removed.append(
                _explained_by_pair(np.broadcast_to(white(rows[0]), bend.shape), bend, z).max()
            )
        total = float(z @ z)
        best.append(
            float(
                _log_likelihood(white.correlation, np.asarray(total - max(removed)), total, y.size)
            )
        )
    return max(best)


def _explained_by_row(rows: Field, z: Field) -> Field:
    """Return the sum of squares of z that each row explains."""
    squares = np.sum(rows**2, axis=-1)
    return np.where(squares > TINY, (rows @ z) ** 2 / np.maximum(squares, TINY), 0.0)


def _explained_by_pair(first: Field, second: Field, z: Field) -> Field:
    """Return the sum of squares of z that each pair of rows explains."""
    aa = np.sum(first**2, axis=-1)
    bb = np.sum(second**2, axis=-1)
    ab = np.sum(first * second, axis=-1)
    p, q = first @ z, second @ z
    determinant = aa * bb - ab**2
    explained = (bb * p**2 - 2.0 * ab * p * q + aa * q**2) / np.maximum(determinant, TINY)
    return np.where(determinant > 1e-9 * aa * bb, explained, 0.0)
