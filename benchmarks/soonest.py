"""How soon an alarm can be raised at all: what the knees of `alarms` are told from, and the power that this allows.

Derived, not drawn. Of all tests with a chance a of speaking without a cause, the likelihood ratio finds most
(Neyman and Pearson); for Gaussian scatter of known size it finds a course with chance Phi(d - z), z the deviation that
chance exceeds with a, and d the distance [deviations of the scatter, made independent] from the nearest course without
a knee. A test that must learn scatter, memory and the place of the knee finds less. `python -m benchmarks.soonest`.
"""

from collections.abc import Callable, Iterator

import numpy as np
from scipy.stats import norm

from asperity.wear import FALSE_ALARMS
from asperity.wear.alarm import CONTACT_SHARE
from asperity.wear.sequential import LONGEST_CYCLE, SHORTEST_CYCLE
from benchmarks.alarms import AFTER, RECORDINGS, RISE_HZ

BEGINS = range(12, 25)  # of the knees of `alarms`
BEHIND = range(1, 16)
LENGTHS, PERIODS = np.geomspace(0.03, 5.0, 60), 60
EVER = 0.02  # the most that is asked of a row without wear
WARMER_K = 17.5  # by the end of the season


def independent(rows: np.ndarray, memory: float) -> np.ndarray:
    """Rows with scatter of size 1 that remembers, as rows with scatter of size 1 that does not."""
    fresh = rows.copy()
    fresh[..., 1:] -= memory * rows[..., :-1]
    fresh[..., 1:] /= np.sqrt(1.0 - memory**2)
    return fresh


def courses(x: np.ndarray) -> Iterator[np.ndarray]:
    """All that the alarm stands against, but for steps: line, exponentials, hyperbolas, a row each; cycles, two."""
    yield x[None]
    for length in x[-1] * LENGTHS:
        yield np.exp(-x / length)[None]
        yield 1.0 / (1.0 + x / length)[None]
    for period in np.geomspace(SHORTEST_CYCLE, LONGEST_CYCLE * x[-1], PERIODS):
        yield np.array([np.sin(2.0 * np.pi * x / period), np.cos(2.0 * np.pi * x / period)])


def in_season(x: np.ndarray) -> Iterator[np.ndarray]:
    """The same, each beside any amount of what an oil does that grows warmer; its law and temperature are known."""
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


def distance(begins: int, behind: int, scatter_hz: float, memory: float, others: Courses) -> float:
    """Of a knee from the nearest of other courses, so many recordings behind it, in deviations."""
    x, pace = np.arange(begins + behind + 1.0), RISE_HZ / begins
    knee = np.where(x < begins, pace * x, RISE_HZ + AFTER * pace * (x - begins))
    y, nearest = independent(knee, memory), np.inf
    for rows in others(x):
        columns = independent(np.vstack([np.ones_like(x), rows]), memory).T
        left = y - columns @ np.linalg.lstsq(columns, y, rcond=None)[0]
        nearest = min(nearest, float(left @ left))
    return float(np.sqrt(nearest) / scatter_hz)


def power(distances: np.ndarray, behind: np.ndarray, chance: float | None) -> np.ndarray:
    """With what chance a knee can be found by so many recordings behind it.

    `chance` of ever speaking without a cause; None: at most the alarm's rate for CRF in each recording since the knee.
    """
    wrong = CONTACT_SHARE * FALSE_ALARMS * behind if chance is None else np.full(behind.shape, chance)
    return np.asarray(norm.cdf(distances - norm.isf(wrong)))


def row(scatter_hz: float, memory: float, others: Courses) -> str:
    """Recordings behind the knee until half of the knees can be found, until 90 %, and the share by the end."""
    after = np.array([[distance(begins, many, scatter_hz, memory, others) for many in BEHIND] for begins in BEGINS])
    left = np.array([RECORDINGS - 1 - begins for begins in BEGINS])
    ends = np.array(
        [distance(begins, many, scatter_hz, memory, others) for begins, many in zip(BEGINS, left, strict=True)]
    )
    cells = []
    for chance in (None, EVER):
        found = power(after, np.array(BEHIND), chance).mean(axis=0)
        half, most = (1 + int(np.argmax(found >= share)) for share in (0.5, 0.9))
        cells.append(f"{half}, {most}, {100.0 * power(ends, left, chance).mean():.1f} %")
    return " | ".join(cells)


def lines(*, fast: bool = False) -> Iterator[str]:  # noqa: ARG001  (as all parts are asked)
    """Markdown, a line at a time; `fast` is the same."""
    yield "## How soon a knee can be found at all: half of them, 90 %, and the share by the end of 40 recordings\n"
    yield f"| CRF scatters by | at the default rate | with {100.0 * EVER:g} % ever without a cause |"
    yield "|---|---|---|"
    for name, *of in ROWS:
        yield f"| {name} | {row(*of)} |"


if __name__ == "__main__":
    for line in lines():
        print(line, flush=True)
