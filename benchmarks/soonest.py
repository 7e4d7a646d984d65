"""How soon an alarm can be raised at all: what the knees of `alarms` are told from, and the power
that this allows.

Of all tests with a chance a of speaking without a cause, the likelihood ratio finds most (Neyman
and Pearson); for Gaussian scatter of known size it finds a course with chance Phi(d - z), z the
deviation that chance exceeds with a, and d the distance [deviations of the scatter, made
independent] from the nearest course without a knee. Where size and memory of the scatter are not
known, a course without a knee may stand nearer in another scatter (by Kullback and Leibler); the
likelihood ratio of both, drawn, bounds every test that keeps its rate there, too. A test that must
learn the place of the knee as well finds less. `python -m benchmarks.soonest`.
"""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from asperity.trend import FALSE_ALARM_RATE
from asperity.trend.alarm import CONTACT_SHARE
from asperity.trend.sequential import LONGEST_CYCLE, SHORTEST_CYCLE
from benchmarks.alarms import AFTER, RECORDINGS, RISE_HZ

BEGINS = range(12, 25)  # of the knees of `alarms`
BEHIND = range(1, 16)
LENGTHS, PERIODS = np.geomspace(0.03, 5.0, 60), 60
EVER = 0.02  # the most that is asked of a row without wear
WARMER_K = 17.5  # by the end of the season
MEMORIES = np.linspace(0.0, 0.7, 8)  # in which the rate is to be kept
DRAWS = 20_000


def independent(rows: np.ndarray, memory: float) -> np.ndarray:
    """Rows with scatter of size 1 that remembers, as rows with scatter of size 1 that does not."""
    fresh = rows.copy()
    fresh[..., 1:] -= memory * rows[..., :-1]
    fresh[..., 1:] /= np.sqrt(1.0 - memory**2)
    return fresh


def courses(x: np.ndarray) -> Iterator[np.ndarray]:
    """All that the alarm stands against, but for steps: line, exponentials, hyperbolas, a row each;
    cycles, two.
    """
    yield x[None]
    for length in x[-1] * LENGTHS:
        yield np.exp(-x / length)[None]
        yield 1.0 / (1.0 + x / length)[None]
    for period in np.geomspace(SHORTEST_CYCLE, LONGEST_CYCLE * x[-1], PERIODS):
        yield np.array([np.sin(2.0 * np.pi * x / period), np.cos(2.0 * np.pi * x / period)])


def in_season(x: np.ndarray) -> Iterator[np.ndarray]:
    """The same, each beside any amount of what an oil does that grows warmer; its law and
    temperature are known.
    """
    thin = 1.0 / (35.0 + WARMER_K * x / RECORDINGS + 95.0)
    yield from (np.vstack([rows, thin]) for rows in courses(x))


Courses = Callable[[np.ndarray], Iterator[np.ndarray]]
ROWS: tuple[tuple[str, float, float, Courses], ...] = (
    ("5 Hz", 5.0, 0.0, courses),
    ("15 Hz", 15.0, 0.0, courses),
    ("15 Hz, remembers 0.7", 15.0, 0.7, courses),
    ("30 Hz", 30.0, 0.0, courses),
    ("15 Hz, a warming season, given", 15.0, 0.0, in_season),
)


def knee(begins: int, behind: int) -> np.ndarray:
    """The course of `alarms` [Hz], up to so many recordings behind its knee."""
    x, pace = np.arange(begins + behind + 1.0), RISE_HZ / begins
    return np.where(x < begins, pace * x, RISE_HZ + AFTER * pace * (x - begins))


def beside(course: np.ndarray, memory: float, others: Courses) -> np.ndarray:
    """What the nearest of other courses leaves of one, made independent."""
    y, ones = independent(course, memory), np.ones(course.size)
    left = []
    for rows in others(np.arange(float(course.size))):
        columns = independent(np.vstack([ones, rows]), memory).T
        left.append(y - columns @ np.linalg.lstsq(columns, y, rcond=None)[0])
    return min(left, key=lambda one: float(one @ one))


def distance(begins: int, behind: int, scatter_hz: float, memory: float, others: Courses) -> float:
    """Of a knee from the nearest of other courses, so many recordings behind it, in deviations."""
    return float(np.linalg.norm(beside(knee(begins, behind), memory, others)) / scatter_hz)


def power(distances: np.ndarray, behind: np.ndarray, chance: float | None) -> np.ndarray:
    """With what chance a knee can be found by so many recordings behind it.

    `chance` of ever speaking without a cause; None: at most the alarm's rate for CRF in each
    recording since the knee.
    """
    wrong = (
        CONTACT_SHARE * FALSE_ALARM_RATE * behind
        if chance is None
        else np.full(behind.shape, chance)
    )
    return np.asarray(norm.cdf(distances - norm.isf(wrong)))


class Nearest(NamedTuple):
    """A course without a knee, in scatter of its own: what it leaves of the knee, made independent
    by its memory.

    `size` is of its scatter over the knee's. `apart` is the least information (Kullback and
    Leibler) by which a series with the knee speaks against it, `left` over the scatter of the
    knee.
    """

    apart: float
    left: np.ndarray
    memory: float
    size: float


def nearest(begins: int, behind: int, scatter_hz: float, memory: float, others: Courses) -> Nearest:
    """Of all courses without a knee, in scatter of any size and of MEMORIES, the one least told
    from a knee.
    """
    course = knee(begins, behind) / scatter_hz
    many = course.size
    own, found = np.linalg.inv(independent(np.eye(many), memory)), []
    for other in MEMORIES:
        left = beside(course, other, others)
        size = np.sqrt((np.sum(independent(own, other) ** 2) + left @ left) / many)
        volume = 0.5 * (many - 1) * (np.log(1.0 - other**2) - np.log(1.0 - memory**2))
        found.append(Nearest(float(many * np.log(size) + volume), left, float(other), float(size)))
    return min(found, key=lambda one: one.apart)


def power_unknown(near: Nearest, memory: float, chance: float) -> float:
    """With what chance the likelihood ratio of a knee over the nearest course finds the knee,
    drawn.
    """
    rng, many = np.random.default_rng(3), near.left.size
    across = independent(np.linalg.inv(independent(np.eye(many), memory)), near.memory)
    fresh = rng.standard_normal((DRAWS, many))

    def ratios(rows: np.ndarray) -> np.ndarray:
        """Of series about the nearest course, made independent by its memory."""
        knees = np.linalg.solve(across.T, (rows - near.left).T)
        return np.asarray(
            0.5 * (np.sum((rows / near.size) ** 2, axis=1) - np.sum(knees**2, axis=0))
        )

    limit = np.quantile(ratios(near.size * fresh), 1.0 - chance)
    return float(np.mean(ratios(near.left + fresh @ across) > limit))


def row(scatter_hz: float, memory: float, others: Courses) -> str:
    """Recordings behind the knee until half of the knees can be found, until 90 %, and the share by
    the end.
    """
    left = np.array([RECORDINGS - 1 - begins for begins in BEGINS])
    known = (scatter_hz, memory, others)
    after = np.array([[distance(begins, many, *known) for many in BEHIND] for begins in BEGINS])
    ends = np.array(
        [distance(begins, many, *known) for begins, many in zip(BEGINS, left, strict=True)]
    )
    cells = [
        _told(power(after, np.array(BEHIND), chance), power(ends, left, chance))
        for chance in (None, EVER)
    ]
    rate = CONTACT_SHARE * FALSE_ALARM_RATE

    def unknown(begins: int, many: int) -> float:
        return power_unknown(nearest(begins, many, *known), memory, rate * many)

    found = np.array([[unknown(begins, many) for many in BEHIND] for begins in BEGINS])
    by_end = np.array([unknown(begins, many) for begins, many in zip(BEGINS, left, strict=True)])
    return " | ".join([cells[0], _told(found, by_end), cells[1]])


def _told(found: np.ndarray, ends: np.ndarray) -> str:
    """Of chances, (begins, recordings behind), and by the end."""
    mean = np.append(found.mean(axis=0), 1.0)
    half, most = (f"{1 + int(np.argmax(mean >= share))}" for share in (0.5, 0.9))
    return (
        f"{half}, {most if mean[:-1].max() >= 0.9 else f'over {len(BEHIND)}'},"
        f" {100.0 * ends.mean():.1f} %"
    )


def lines(*, fast: bool = False) -> Iterator[str]:  # noqa: ARG001  (as all parts are asked)
    """Markdown, a line at a time; `fast` is the same."""
    yield (
        "## How soon a knee can be found at all: half of them, 90 %, and the share by the end of 40"
        " recordings\n"
    )
    ever = f"with {100.0 * EVER:g} % ever without a cause"
    yield (
        f"| CRF scatters by | at the default rate | the same, size and memory not known | {ever} |"
    )
    yield "|---|---|---|---|"
    for name, *of in ROWS:
        yield f"| {name} | {row(*of)} |"


if __name__ == "__main__":
    for line in lines():
        print(line, flush=True)
