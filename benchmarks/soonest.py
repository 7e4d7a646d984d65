"""Upper bound on the power of alarms, for the knees of `alarms`.

Of all tests with false-alarm probability a, the likelihood ratio has the largest power (Neyman and
Pearson). For Gaussian scatter of known size it detects a course with probability Phi(d - z). Here z
is the quantile that scatter exceeds with probability a, and d is the distance from the nearest
course without a knee, in standard deviations of the whitened scatter. If size and memory of the
scatter are unknown, a course without a knee may be nearer in another scatter (Kullback and
Leibler). The sampled likelihood ratio of the two then bounds every test that keeps its false-alarm
rate there, too. A test that must also estimate the position of the knee detects less.
`python -m benchmarks.soonest` runs this part alone.
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from asperity.trend import FALSE_ALARM_RATE
from asperity.trend.decision import CONTACT_SHARE
from asperity.trend.sequential import LONGEST_CYCLE, SHORTEST_CYCLE
from benchmarks.alarms import AFTER, RECORDINGS, RISE_HZ

BEGINS = range(12, 25)  # of the knees of `alarms`
BEHIND = range(1, 16)
LENGTHS, PERIODS = np.geomspace(0.03, 5.0, 60), 60
EVER = 0.02  # largest false-alarm probability allowed for a whole row without wear
WARMER_K = 17.5  # temperature rise by the end of the season
MEMORIES = np.linspace(0.0, 0.7, 8)  # for which the false-alarm rate must hold
DRAWS = 20_000


def independent(rows: np.ndarray, memory: float) -> np.ndarray:
    """Whiten rows whose scatter of size 1 is autocorrelated."""
    fresh = rows.copy()
    fresh[..., 1:] -= memory * rows[..., :-1]
    fresh[..., 1:] /= np.sqrt(1.0 - memory**2)
    return fresh


def courses(x: np.ndarray) -> Iterator[np.ndarray]:
    """Yield the alternatives to wear except steps: line, exponentials, hyperbolas, cycles.

    A cycle has two rows, the others one.
    """
    yield x[None]
    for length in x[-1] * LENGTHS:
        yield np.exp(-x / length)[None]
        yield 1.0 / (1.0 + x / length)[None]
    for period in np.geomspace(SHORTEST_CYCLE, LONGEST_CYCLE * x[-1], PERIODS):
        yield np.array([np.sin(2.0 * np.pi * x / period), np.cos(2.0 * np.pi * x / period)])


def in_season(x: np.ndarray) -> Iterator[np.ndarray]:
    """Yield the same courses, each with the effect of warming oil of known law and temperature."""
    thin = 1.0 / (35.0 + WARMER_K * x / RECORDINGS + 95.0)
    yield from (np.vstack([rows, thin]) for rows in courses(x))


Courses = Callable[[np.ndarray], Iterator[np.ndarray]]
ROWS: tuple[tuple[str, float, float, Courses], ...] = (
    ("5 Hz", 5.0, 0.0, courses),
    ("15 Hz", 15.0, 0.0, courses),
    ("15 Hz, autocorrelation 0.7", 15.0, 0.7, courses),
    ("30 Hz", 30.0, 0.0, courses),
    ("15 Hz, known warming over the season", 15.0, 0.0, in_season),
)


def knee(begins: int, behind: int) -> np.ndarray:
    """Return the course of `alarms` [Hz] up to `behind` recordings after its knee."""
    x, pace = np.arange(begins + behind + 1.0), RISE_HZ / begins
    return np.where(x < begins, pace * x, RISE_HZ + AFTER * pace * (x - begins))


def nearest_residual(course: np.ndarray, memory: float, others: Courses) -> np.ndarray:
    """Return the smallest whitened residual of a course among fits of the other courses."""
    y, constant = independent(course, memory), np.ones(course.size)
    residuals = []
    for rows in others(np.arange(float(course.size))):
        columns = independent(np.vstack([constant, rows]), memory).T
        residuals.append(y - columns @ np.linalg.lstsq(columns, y, rcond=None)[0])
    return min(residuals, key=lambda residual: float(residual @ residual))


def distance(begins: int, behind: int, scatter_hz: float, memory: float, others: Courses) -> float:
    """Return a knee's distance from the nearest other course, in standard deviations.

    The course ends `behind` recordings after the knee.
    """
    return float(
        np.linalg.norm(nearest_residual(knee(begins, behind), memory, others)) / scatter_hz
    )


def power(distances: np.ndarray, behind: np.ndarray, chance: float | None) -> np.ndarray:
    """Return the probability of detecting a knee within `behind` recordings after it.

    `chance` is the false-alarm probability of the whole series; None: at most the alarm's rate for
    CRF in each recording since the knee.
    """
    wrong = (
        CONTACT_SHARE * FALSE_ALARM_RATE * behind
        if chance is None
        else np.full(behind.shape, chance)
    )
    return np.asarray(norm.cdf(distances - norm.isf(wrong)))


class Nearest(NamedTuple):
    """A course without a knee and its scatter.

    `left` is the residual of the knee over the knee's scatter, whitened with this course's
    `memory`; `size` is the course's scatter over the knee's; `apart` is the least information
    (Kullback and Leibler) of a series with the knee against this course.
    """

    apart: float
    left: np.ndarray
    memory: float
    size: float


def nearest(begins: int, behind: int, scatter_hz: float, memory: float, others: Courses) -> Nearest:
    """Return the course without a knee that is hardest to distinguish from a knee.

    The scatter may have any size and one of MEMORIES.
    """
    course = knee(begins, behind) / scatter_hz
    many = course.size
    own, found = np.linalg.inv(independent(np.eye(many), memory)), []
    for other in MEMORIES:
        left = nearest_residual(course, other, others)
        size = np.sqrt((np.sum(independent(own, other) ** 2) + left @ left) / many)
        volume = 0.5 * (many - 1) * (np.log(1.0 - other**2) - np.log(1.0 - memory**2))
        found.append(Nearest(float(many * np.log(size) + volume), left, float(other), float(size)))
    return min(found, key=lambda course: course.apart)


def power_unknown(alternative: Nearest, memory: float, chance: float) -> float:
    """Estimate the power of the likelihood ratio of a knee over the nearest course by sampling."""
    rng, many = np.random.default_rng(3), alternative.left.size
    across = independent(np.linalg.inv(independent(np.eye(many), memory)), alternative.memory)
    fresh = rng.standard_normal((DRAWS, many))

    def ratios(rows: np.ndarray) -> np.ndarray:
        """Return log ratios of series about the nearest course, whitened with its memory."""
        knees = np.linalg.solve(across.T, (rows - alternative.left).T)
        return np.asarray(
            0.5 * (np.sum((rows / alternative.size) ** 2, axis=1) - np.sum(knees**2, axis=0))
        )

    limit = np.quantile(ratios(alternative.size * fresh), 1.0 - chance)
    return float(np.mean(ratios(alternative.left + fresh @ across) > limit))


def row(scatter_hz: float, memory: float, others: Courses) -> str:
    """Return the recordings until 50 % and 90 % of knees are detectable, and the final share."""
    left = np.array([RECORDINGS - 1 - begins for begins in BEGINS])
    known = (scatter_hz, memory, others)
    after = np.array([[distance(begins, many, *known) for many in BEHIND] for begins in BEGINS])
    ends = np.array(
        [distance(begins, many, *known) for begins, many in zip(BEGINS, left, strict=True)]
    )
    cells = [
        _cell(power(after, np.array(BEHIND), chance), power(ends, left, chance))
        for chance in (None, EVER)
    ]
    rate = CONTACT_SHARE * FALSE_ALARM_RATE

    def unknown(begins: int, many: int) -> float:
        return power_unknown(nearest(begins, many, *known), memory, rate * many)

    found = np.array([[unknown(begins, many) for many in BEHIND] for begins in BEGINS])
    by_end = np.array([unknown(begins, many) for begins, many in zip(BEGINS, left, strict=True)])
    return " | ".join([cells[0], _cell(found, by_end), cells[1]])


def _cell(found: np.ndarray, ends: np.ndarray) -> str:
    """Format probabilities by (start of the knee, recordings after it) and by the end."""
    mean = np.append(found.mean(axis=0), 1.0)
    half, most = (f"{1 + int(np.argmax(mean >= share))}" for share in (0.5, 0.9))
    return (
        f"{half}, {most if mean[:-1].max() >= 0.9 else f'over {len(BEHIND)}'},"
        f" {100.0 * ends.mean():.1f} %"
    )


def lines(*, fast: bool = False) -> Iterator[str]:  # noqa: ARG001  (common signature)
    """Yield the table as Markdown; `fast` has no effect."""
    yield (
        "## Lower bound on recordings until 50 % and 90 % of the knees are detected, and share"
        " detected after 40\n"
    )
    ever = f"false-alarm probability {100.0 * EVER:g} % per series"
    yield (f"| CRF scatter | default false-alarm rate | default rate, scatter unknown | {ever} |")
    yield "|---|---|---|---|"
    for name, *parameters in ROWS:
        yield f"| {name} | {row(*parameters)} |"


if __name__ == "__main__":
    for line in lines():
        print(line, flush=True)
