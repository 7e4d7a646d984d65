"""How probable what was heard is, by a law, with or without a term for what the law itself gets wrong.

Without the term, a frequency is off by its measurement and the emulator, whose error all operating points of a contact
have in common in part. With it, each operating point has an error of the law; how large it is is not known, and three
sizes are as probable. The law's exponent of the load is off too, by the same at all points. CRFA has a gain that nobody
knows, for all recordings in common.
"""

from collections.abc import Sequence

import numpy as np

from asperity.arrays import Field
from asperity.inference.forward import Shown
from asperity.inference.observations import Heard, Point

SIZES = (0.005, 0.02, 0.08)  # of the law's error, relative to CRF: 3, 12 and 60 % of a load share
OF_DAMPING, OF_HEIGHT = 5.0, 10.0  # the same error in ln ζ and ln CRFA
EXPONENT_STD = 0.03  # of the power of the load that CRF goes with: as far as 1/5 is from 1/6
COMMON = 0.25  # share of the emulator's variance that all operating points of a contact have in common
GAIN_STD = 30.0  # of ln CRFA: an accelerometer and what excites it are free, and the height of one point says nothing
EMULATED_HEIGHT_STD = 0.05  # of ln CRFA beyond what CAR's deviation makes: its process's own shape


def log_likelihood(shown: Shown, points: Sequence[Point], *, discrepancy: bool) -> Field:
    """Logarithm of p(heard | unknowns), shape (n,); `shown` has a column for each of the points."""
    if not discrepancy:
        return _at_size(shown, points, 0.0)
    levels = log_at_sizes(shown, points)
    return np.asarray(np.logaddexp.reduce(levels, axis=0) - np.log(len(SIZES)))


def log_at_sizes(shown: Shown, points: Sequence[Point]) -> Field:
    """The same for each of `SIZES` of the law's error, shape (sizes, n)."""
    return np.stack([_at_size(shown, points, size) for size in SIZES])


def _at_size(shown: Shown, points: Sequence[Point], size: float) -> Field:
    off = EXPONENT_STD if size > 0.0 else 0.0
    lever = off * (shown.lever - shown.lever.mean(axis=1, keepdims=True))
    total = _gaussian([point.crf for point in points], shown.crf, shown.crf_std, size, lever)
    none = np.zeros_like(lever)
    total = total + _gaussian(
        [point.damping for point in points], shown.damping, shown.damping_std, OF_DAMPING * size, none
    )
    if np.isnan(shown.crfa).any():
        return total
    height_std = np.hypot(shown.crfa_std, EMULATED_HEIGHT_STD)
    gain = np.full(shown.crfa.shape, GAIN_STD)
    return total + _gaussian([point.crfa for point in points], shown.crfa, height_std, OF_HEIGHT * size, gain)


def _gaussian(heard: Sequence[Heard], shown: Field, std: Field, size: float, common: Field) -> Field:
    """Logarithm of a normal density of residuals: independent ones of three sources, and two in common.

    One in common is by `common`, the other the emulator's `std` by its share COMMON. Covariance D + U Uᵀ, by Woodbury.
    """
    here = np.array([not np.isnan(one.value) for one in heard])
    if not here.any():
        return np.zeros(len(shown))
    value = np.array([one.value for one in heard])[here]
    measured = np.array([one.std for one in heard])[here]
    variance = measured**2 + (1.0 - COMMON) * std[:, here] ** 2 + size**2
    rest, first, second = value - shown[:, here], common[:, here], np.sqrt(COMMON) * std[:, here]
    over = first / variance, second / variance
    one, other = 1.0 + np.sum(over[0] * first, axis=1), 1.0 + np.sum(over[1] * second, axis=1)
    both = np.sum(over[0] * second, axis=1)
    along, across = np.sum(over[0] * rest, axis=1), np.sum(over[1] * rest, axis=1)
    inner = one * other - both**2
    taken = (other * along**2 - 2.0 * both * along * across + one * across**2) / inner
    square = np.sum(rest**2 / variance, axis=1) - taken
    logs = np.sum(np.log(2.0 * np.pi * variance), axis=1) + np.log(inner)
    return np.asarray(-0.5 * (square + logs))
