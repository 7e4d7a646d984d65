"""Whether one series has bent, grown or stepped, judged after each recording; and that nothing else explains it.

Each question is a likelihood ratio of two families of courses, both with scatter that remembers
the recording before (first order, up to 0.9). What a step means, and when to warn, is left to
`alarm`; docs/theory/alarms.md has the equations and how often each speaks without a cause.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field, Mask

FEWEST = 8  # places from which a course can be judged at all: the baseline
MEMORY = np.array(
    [-0.3, 0.0, 0.3, 0.5, 0.7, 0.8, 0.9]
)  # correlation of neighbouring recordings' scatter
LONGEST_CYCLE = (
    1.5  # of the length of the series: of a longer one not even a whole turn has been heard
)
SHORTEST_CYCLE = 3.0  # spacings
BENDS, CYCLES = 20, 30  # grid points of saturating lengths and of periods
RAMPS = (0, 1, 2, 3)  # recordings between the two levels of a step
MOST_PLACES = 120  # the latest: what was before is the past of another baseline
FEWEST_BEFORE, FEWEST_AFTER = 3, 2  # places on either side of a bend
FLAT = 0.5  # slope after a knee over that before, at most
FITTED = (
    5  # numbers that a course takes from the places: level, slope, turn, where it turns, memory
)
CALIBRATION = 0.12  # false alarms a recording times exp(log ratio): docs/theory/alarms.md
TINY = 1e-12


class Beside(NamedTuple):
    """What conditions may still explain of a series: their rows, (conditions, places), and how little of each.

    `pull` is the series' scatter over the deviation of each coefficient, which a prior holds near
    0.
    """

    rows: Field
    pull: Field


class Found(NamedTuple):
    """What speaks for a change: ln of the likelihood ratio, the place of it, by how much the series changed there."""

    log_ratio: float
    at: float
    change: float


NOTHING = Found(-np.inf, np.nan, np.nan)


def threshold(false_alarm_rate: float) -> float:
    """The ln likelihood ratio that no wear reaches more often than this, per recording."""
    return float(np.log(CALIBRATION / false_alarm_rate))


def knee(x: Field, y: Field, *, least: float, beside: Beside | None = None) -> Found:
    """A rise by `least` or more that goes on at half its pace or less, against all that bends without a knee.

    Against it stand a line, saturating curves, steps and short ramps, and cycles.

    Parameters
    ----------
    x, y : shape (places,), x rising; y in units in which `least` is worth acting on
    beside : what conditions may explain of it, of every course alike
    """
    return _judged(x, y, least, beside, rises_first=True)


def growth(x: Field, y: Field, *, least: float, beside: Beside | None = None) -> Found:
    """A level that held and then grows, by `least` or more: against holding, saturating, stepping and cycling."""
    return _judged(x, y, least, beside, rises_first=False)


def step(x: Field, y: Field, *, least: float, beside: Beside | None = None) -> Found:
    """A jump by `least` or more either way, within a few recordings, which holds: against all that goes smoothly."""
    along, y, scale = _latest(x, y)
    if along.size < FEWEST:
        return NOTHING
    whites = _whites_beside(along.size, beside)
    jumps = _jumps(along.size)
    levels = jumps @ y / jumps.sum(axis=1) - (1.0 - jumps) @ y / np.maximum(
        (1.0 - jumps).sum(axis=1), TINY
    )
    settled = jumps.sum(axis=1) >= FEWEST_BEFORE
    allowed = settled & (np.abs(levels) >= least)
    if not allowed.any():
        return NOTHING
    hinges = np.maximum(along - _breaks(along)[:, None], 0.0)
    gains = _gains(y, jumps[allowed], whites=whites)
    smooth = _profiled(
        y, np.concatenate([along[None], _saturating(along)]), _cycles(along), hinges, whites=whites
    )
    best = int(np.argmax(np.max(gains, axis=0)))
    ratio = _counted(float(np.max(gains)) - smooth, along.size)
    return Found(
        ratio,
        scale.back(along[np.argmax(jumps[allowed][best] > 0.0)]),
        float(levels[allowed][best]),
    )


def _judged(x: Field, y: Field, least: float, beside: Beside | None, *, rises_first: bool) -> Found:
    along, y, scale = _latest(x, y)
    if along.size < FEWEST:
        return NOTHING
    whites = _whites_beside(along.size, beside)
    places = _breaks(along)
    hinges = np.maximum(along - places[:, None], 0.0)
    if rises_first:
        change, allowed = _knees(along, y, places, hinges, least)
    else:
        change, allowed = _growths(y, hinges, least)
    if not allowed.any():
        return NOTHING
    smooth = np.concatenate([_saturating(along), _jumps(along.size)])
    if rises_first:
        smooth = np.concatenate([along[None], smooth])
    against = _profiled(y, smooth, _cycles(along), whites=whites)
    gains = _gains(y, hinges[allowed], beside=along if rises_first else None, whites=whites)
    best = int(np.argmax(np.max(gains, axis=0)))
    ratio = _counted(float(np.max(gains)) - against, along.size)
    return Found(ratio, scale.back(places[allowed][best]), float(change[allowed][best]))


def _counted(log_ratio: float, places: int) -> float:
    """The ratio by as many places as are left when the course is fitted: few places flatter what is fitted to them."""
    return log_ratio * (places - FITTED) / places


class _Scale(NamedTuple):
    """Where x begins and its mean spacing."""

    start: float
    spacing: float

    def back(self, along: float) -> float:
        return float(self.start + self.spacing * along)


def _latest(x: Field, y: Field) -> tuple[Field, Field, _Scale]:
    """The latest places; x from their first, in units of their mean spacing."""
    x, y = x[-MOST_PLACES:], y[-MOST_PLACES:]
    scale = (
        _Scale(float(x[0]), float(x[-1] - x[0]) / (x.size - 1)) if x.size > 1 else _Scale(0.0, 1.0)
    )
    return np.asarray((x - scale.start) / scale.spacing), np.asarray(y), scale


def _breaks(along: Field) -> Field:
    """Where a course may break: at the places and midway between them, but for the first and the last few."""
    inner = along[FEWEST_BEFORE - 1 : -FEWEST_AFTER]
    return np.sort(np.concatenate([inner[1:], 0.5 * (inner[1:] + inner[:-1])]))


def _knees(
    along: Field, y: Field, places: Field, hinges: Field, least: float
) -> tuple[Field, Mask]:
    """How far each broken stick has risen at its break, and which of them are knees; by least squares."""
    one, line, bent = (rows - rows.mean(axis=-1, keepdims=True) for rows in (y, along, hinges))
    xx, xh, hh = line @ line, bent @ line, np.sum(bent**2, axis=1)
    determinant = np.maximum(xx * hh - xh**2, TINY)
    before = (hh * (line @ one) - xh * (bent @ one)) / determinant
    turn = (xx * (bent @ one) - xh * (line @ one)) / determinant
    rise = before * places
    return rise, (before > 0.0) & (before + turn < FLAT * before) & (rise >= least)


def _growths(y: Field, hinges: Field, least: float) -> tuple[Field, Mask]:
    """How far each hinge has grown at the end, and which have grown enough."""
    one, bent = (rows - rows.mean(axis=-1, keepdims=True) for rows in (y, hinges))
    grown = (bent @ one) / np.sum(bent**2, axis=1) * hinges[:, -1]
    return grown, grown >= least


def _saturating(along: Field) -> Field:
    """Exponentials and hyperbolas of all lengths, (curves, places)."""
    lengths = along[-1] * np.geomspace(0.03, 5.0, BENDS)[:, None]
    return np.concatenate([np.exp(-along / lengths), 1.0 / (1.0 + along / lengths)])


@lru_cache(maxsize=2)  # a long series is judged by as many places each time
def _jumps(places: int) -> Field:
    """From one level to another, at once or over a few recordings, (steps, places)."""
    number = np.arange(places)
    ramps = [
        np.clip((number - np.arange(1, places - width)[:, None] + 1.0) / (width + 1.0), 0.0, 1.0)
        for width in RAMPS
    ]
    return np.concatenate(ramps)


def _cycles(along: Field) -> tuple[Field, Field]:
    """Sines and cosines of periods from a few recordings to what has been heard."""
    phase = (
        2.0
        * np.pi
        * along
        / np.geomspace(SHORTEST_CYCLE, LONGEST_CYCLE * along[-1], CYCLES)[:, None]
    )
    return np.sin(phase), np.cos(phase)


def _whitened(memory: float, rows: Field) -> Field:
    """Rows whose scatter remembers the place before, made independent, (..., places)."""
    white = rows.copy()
    white[..., 1:] -= memory * rows[..., :-1]
    white[..., 0] *= np.sqrt(1.0 - memory**2)
    return white


class _White(NamedTuple):
    """Independent rows beside a constant and conditions: `taken`, orthonormal, are taken out of each.

    Behind the places stands what the prior of each condition's coefficient adds.
    """

    taken: Field
    memory: float

    def __call__(self, rows: Field) -> Field:
        white = _whitened(self.memory, rows)
        more = self.taken.shape[1] - white.shape[-1]
        if more:
            white = np.concatenate([white, np.zeros((*white.shape[:-1], more))], axis=-1)
        return np.asarray(white - (white @ self.taken.T) @ self.taken)


@lru_cache(maxsize=2)
def _whites(places: int) -> list[_White]:
    ones = [_whitened(memory, np.ones(places)) for memory in MEMORY]
    return [
        _White((one / np.sqrt(one @ one))[None], float(memory))
        for one, memory in zip(ones, MEMORY, strict=True)
    ]


def _whites_beside(places: int, beside: Beside | None) -> list[_White]:
    if beside is None or not len(beside.rows):
        return _whites(places)
    rows = np.concatenate([np.ones((1, places)), beside.rows[:, -places:]])
    prior = np.concatenate([np.zeros((1, len(beside.pull))), np.diag(beside.pull)])
    found = []
    for memory in MEMORY:
        steady = np.sqrt(1.0 - memory**2)  # what is fresh of the scatter
        whole = np.concatenate([_whitened(memory, rows), steady * prior], axis=1)
        found.append(_White(np.linalg.qr(whole.T)[0].T, float(memory)))
    return found


def _log_likelihood(memory: float, left: Field, whole: float, places: int) -> Field:
    """Of Gaussian scatter about a course that leaves the squares `left`, its size the likeliest."""
    return np.asarray(
        0.5 * np.log(1.0 - memory**2)
        - 0.5 * places * np.log(np.maximum(left, TINY * max(whole, TINY)))
    )


def _gains(
    y: Field, rows: Field, beside: Field | None = None, whites: list[_White] | None = None
) -> Field:
    """Log likelihood of a constant and each row (and one beside), (memories, rows)."""
    found = []
    for white in whites or _whites(y.size):
        z, bent = white(y), white(rows)
        whole = float(z @ z)
        if beside is None:
            left = whole - _one(bent, z)
        else:
            left = whole - _two(np.broadcast_to(white(beside), bent.shape), bent, z)
        found.append(_log_likelihood(white.memory, left, whole, y.size))
    return np.array(found)


def _profiled(
    y: Field,
    rows: Field,
    cycles: tuple[Field, Field],
    hinges: Field | None = None,
    *,
    whites: list[_White],
) -> float:
    """The greatest log likelihood of a constant with any row, any cycle, or a line and any hinge."""
    best = []
    for white in whites:
        z = white(y)
        taken = [_one(white(rows), z).max(), _two(white(cycles[0]), white(cycles[1]), z).max()]
        if hinges is not None:
            bent = white(hinges)
            taken.append(_two(np.broadcast_to(white(rows[0]), bent.shape), bent, z).max())
        whole = float(z @ z)
        best.append(
            float(_log_likelihood(white.memory, np.asarray(whole - max(taken)), whole, y.size))
        )
    return max(best)


def _one(rows: Field, z: Field) -> Field:
    """Squares that each row takes off z."""
    own = np.sum(rows**2, axis=-1)
    return np.where(own > TINY, (rows @ z) ** 2 / np.maximum(own, TINY), 0.0)


def _two(first: Field, second: Field, z: Field) -> Field:
    """Squares that each pair of rows takes off z together."""
    aa, bb, ab = (
        np.sum(first**2, axis=-1),
        np.sum(second**2, axis=-1),
        np.sum(first * second, axis=-1),
    )
    p, q = first @ z, second @ z
    determinant = aa * bb - ab**2
    together = (bb * p**2 - 2.0 * ab * p * q + aa * q**2) / np.maximum(determinant, TINY)
    return np.where(determinant > 1e-9 * aa * bb, together, 0.0)
