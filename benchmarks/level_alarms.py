"""Level rule on healthy and failing courses, beside CUSUM, EWMA and a doubled level.

Courses are logarithmic levels. Healthy ones have 2000 recordings. Failing ones last 20 h and are
sampled every 10 s, 1 min and 10 min. `python -m benchmarks.level_alarms` runs this part alone;
`--fast` uses a tenth of the series, `--whole` judges two of each healthy kind by the whole alarm.
"""

import argparse
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from asperity.monitoring.alarm import LEVEL_LEAST
from asperity.trend import LevelMonitor, MonitoredSeries, RecordingStatus, sequential_alarm

Levels = np.ndarray
Course = Callable[[np.random.Generator, int], Levels]
SERIES, RECORDINGS = 50, 2000
LIFE_S, SAMPLING_S = 72_000.0, (10.0, 60.0, 600.0)
LATEST_S = 300.0  # before the end, for an alarm in time
SCATTER = 0.12
DAY = 144.0  # recordings
LEARNED = 30  # recordings from which the other rules learn mean and scatter


def scatter(size: float, memory: float = 0.0) -> Course:
    """Return Gaussian scatter with first-order autocorrelation."""

    def course(rng: np.random.Generator, count: int) -> Levels:
        steps = rng.normal(0.0, size * np.sqrt(1.0 - memory**2), count)
        levels = np.empty(count)
        levels[0] = rng.normal(0.0, size)
        for number in range(1, count):
            levels[number] = memory * levels[number - 1] + steps[number]
        return levels

    return course


def heavy_tails(size: float) -> Course:
    """Return scatter with Student's distribution of three degrees of freedom."""
    return lambda rng, count: size * rng.standard_t(3, count)


def cycle(period: float, ratio: float) -> Course:
    """Return a cycle with a ratio of maximum to minimum, from any phase."""
    return lambda rng, count: (
        0.5
        * np.log(ratio)
        * np.sin(2.0 * np.pi * (np.arange(count) / period + rng.uniform(0.0, 1.0)))
    )


def outliers(share: float, factor: float = 20.0) -> Course:
    """Return single recordings up to a factor too high."""
    return lambda rng, count: (
        (rng.random(count) < share) * rng.uniform(0.5, 1.0, count) * np.log(factor)
    )


def loads(factors: Iterable[float], mean_length: float) -> Course:
    """Return constant levels for random durations, as under unstated loads."""
    chosen = np.log([*factors])

    def course(rng: np.random.Generator, count: int) -> Levels:
        lengths = rng.exponential(mean_length, count).astype(int) + 1
        return np.repeat(rng.choice(chosen, count), lengths)[:count]

    return course


def decay(factor: float, length: float) -> Course:
    """Return an exponential from a factor to 1."""
    return lambda _, count: np.log(factor) * np.exp(-np.arange(count) / length)


def step(factor: float) -> Course:
    """Return a step that stays, anywhere."""
    return lambda rng, count: (
        (np.arange(count) >= rng.integers(20, count - 20)).astype(float) * np.log(factor)
    )


def short_bursts(share: float, factor: float) -> Course:
    """Return bursts of two recordings."""

    def course(rng: np.random.Generator, count: int) -> Levels:
        first = rng.random(count) < share
        return np.log(factor) * (first | np.roll(first, 1))

    return course


def total(*courses: Course) -> Course:
    """Return the sum of courses and the usual scatter."""
    return lambda rng, count: (
        sum(course(rng, count) for course in courses) + SCATTER * rng.standard_normal(count)
    )


HEALTHY: dict[str, Course] = {
    **{f"scatter {size:g}": scatter(size) for size in (0.03, 0.12, 0.25, 0.5)},
    **{
        f"scatter {size:g}, autocorrelation {memory:g}": scatter(size, memory)
        for memory in (0.7, 0.95)
        for size in (0.12, 0.3)
    },
    "slow wander 0.25": total(scatter(0.25, 0.995)),
    **{f"heavy tails {size:g}": heavy_tails(size) for size in (0.12, 0.3)},
    **{
        f"cycle of {period:g} recordings, x{ratio:g}": total(cycle(period, ratio))
        for period in (24.0, DAY, 1440.0)
        for ratio in (1.5, 2.5)
    },
    "cycle of 144 recordings, x3.5": total(cycle(DAY, 3.5)),
    "season x1.8": total(cycle(RECORDINGS, 1.8)),
    **{f"outliers x20, {100.0 * share:g} %": total(outliers(share)) for share in (0.01, 0.05, 0.1)},
    "loads x1, 1.5, 2": total(loads((1.0, 1.5, 2.0), 50.0)),
    "loads x1, 2, 3": total(loads((1.0, 2.0, 3.0), 20.0)),
    "two speeds x3": total(loads((1.0, 3.0), 5.0)),
    "random load 0.4": total(scatter(0.4)),
    "run-in x5": total(decay(5.0, 150.0)),
    "short run-in x3": total(decay(3.0, 10.0)),
    "warm-up x2": total(decay(0.5, 30.0)),
    "step x0.5": total(step(0.5)),
    "step x1.7": total(step(1.7)),
    "drift to x1.8": total(lambda _, count: np.log(1.8) * np.arange(count) / count),
    "bursts of two, x8": total(short_bursts(0.003, 8.0)),
}


def growing(shape: Callable[[Levels], Levels]) -> Course:
    """Return growth from half to seven tenths of the life on; `shape` of 0 to 1."""

    def course(rng: np.random.Generator, count: int) -> Levels:
        life = np.arange(count) / (count - 1.0)
        onset = rng.uniform(0.5, 0.7)
        return shape(np.maximum(0.0, life - onset) / (1.0 - onset))

    return course


def jump(
    rng: np.random.Generator, count: int, *, factor: float, left: tuple[float, float]
) -> Levels:
    """Return a jump with a share of the life left."""
    life = np.arange(count) / (count - 1.0)
    return np.log(factor) * (life >= 1.0 - rng.uniform(*left)).astype(float)


def bursts(rng: np.random.Generator, count: int) -> Levels:
    """Return bursts that become more frequent."""
    share = growing(lambda grown: np.where(grown > 0.0, 0.1 + 0.5 * grown, 0.0))(rng, count)
    return (rng.random(count) < share) * np.log(8.0)


def over_life(course: Callable[[Levels], Levels]) -> Course:
    """Return a course over the life from 0 to 1."""
    return lambda _, count: course(np.arange(count) / (count - 1.0))


def hours(period: float) -> Course:
    """Return a cycle of some hours, x2."""
    return lambda rng, count: cycle(count * period * 3600.0 / LIFE_S, 2.0)(rng, count)


EXPONENTIAL = growing(lambda grown: grown * np.log(15.0))
FAILING: dict[str, Course] = {
    "slow exponential": total(growing(lambda grown: grown * np.log(20.0))),
    "staircase": total(growing(lambda grown: np.log(1.35) * np.floor(10.0 * grown))),
    "bathtub": total(
        over_life(lambda life: np.log(3.0) * np.exp(-life / 0.1)),
        growing(lambda grown: grown**2 * np.log(30.0)),
    ),
    "jump x4.4": total(partial(jump, factor=4.4, left=(0.3, 0.5))),
    "jump x20 near the end": total(partial(jump, factor=20.0, left=(0.05, 0.1))),
    "bursts x8": total(bursts),
    "settles first": total(over_life(lambda life: np.log(5.0) * np.exp(-life / 0.05)), EXPONENTIAL),
    "with daily cycle x2": total(hours(6.0), EXPONENTIAL),
    "with loads x1, 1.5, 2": total(loads((1.0, 1.5, 2.0), 30.0), EXPONENTIAL),
    "with outliers x20, 5 %": total(outliers(0.05), EXPONENTIAL),
}


# Rules: number of the first recording that is reported, or None
# ---------------------------------------------------------------------------------


def level_rule(levels: Levels, state: str) -> int | None:
    """Return when the level rule first reports a state, or a more severe one."""
    monitor = LevelMonitor()
    reported = {"alert": ("alert", "alarm"), "alarm": ("alarm",)}[state]
    for number, level in enumerate(levels):
        if monitor.update(float(level)).state in reported:
            return number
    return None


def cusum(levels: Levels) -> int | None:
    """Return when a one-sided CUSUM (reference 0.5, limit 5 standard deviations) reports."""
    mean, size = _learned(levels)
    height = 0.0
    for number, level in enumerate(levels[LEARNED:], LEARNED):
        height = max(0.0, height + (level - mean) / size - 0.5)
        if height > 5.0:
            return number
    return None


def ewma(levels: Levels) -> int | None:
    """Return when an EWMA (weight 0.2, limit 3 of its standard deviations) reports."""
    mean, size = _learned(levels)
    average = 0.0
    for number, level in enumerate(levels[LEARNED:], LEARNED):
        average += 0.2 * ((level - mean) / size - average)
        if average > 3.0 * np.sqrt(0.2 / 1.8):
            return number
    return None


def doubled(levels: Levels) -> int | None:
    """Return when the level is above twice its first mean in three successive recordings."""
    mean, _ = _learned(levels)
    above = levels > mean + np.log(2.0)
    runs = above[:-2] & above[1:-1] & above[2:]
    runs[:LEARNED] = False
    return int(np.argmax(runs)) + 2 if runs.any() else None


def _learned(levels: Levels) -> tuple[float, float]:
    first = levels[:LEARNED]
    return float(np.mean(first)), float(np.std(first, ddof=1))


RULES: dict[str, Callable[[Levels], int | None]] = {
    "alert": partial(level_rule, state="alert"),
    "alarm": partial(level_rule, state="alarm"),
    "CUSUM": cusum,
    "EWMA": ewma,
    "doubled": doubled,
}


class Reported(NamedTuple):
    """Share of failing courses reported early enough, and the median delay [recordings]."""

    share: float
    delay: float


def failing(
    course: Course, rule: Callable[[Levels], int | None], every_s: float, series: int
) -> Reported:
    """Return how a rule reports a failing course."""
    count = round(LIFE_S / every_s)
    found = [rule(course(np.random.default_rng([2, seed]), count)) for seed in range(series)]
    last = count - 1 - max(1, round(LATEST_S / every_s))
    early = [number for number in found if number is not None and count // 2 <= number <= last]
    delay = float(np.median(early)) - count / 2.0 if early else np.nan
    return Reported(len(early) / series, delay)


def lines(*, fast: bool = False) -> Iterator[str]:
    """Yield Markdown lines; `fast` uses a tenth of the series."""
    series = SERIES // 10 if fast else SERIES
    yield f"## Levels: {series} series per row, share reported by each rule\n"
    yield f"| healthy course | {' | '.join(RULES)} |"
    yield "|---" * (1 + len(RULES)) + "|"
    for kind, course in HEALTHY.items():
        drawn = [course(np.random.default_rng([1, seed]), RECORDINGS) for seed in range(series)]
        shares = [
            100.0 * sum(rule(levels) is not None for levels in drawn) / series
            for rule in RULES.values()
        ]
        yield f"| {kind} | {' | '.join(f'{share:.0f} %' for share in shares)} |"
    yield ""
    yield f"| failing course | every | {' | '.join(RULES)} |"
    yield "|---" * (2 + len(RULES)) + "|"
    for kind, course in FAILING.items():
        for every_s in SAMPLING_S:
            reported = [failing(course, rule, every_s, series) for rule in RULES.values()]
            cells = [f"{100.0 * share:.0f} % ({delay:.0f})" for share, delay in reported]
            yield f"| {kind} | {every_s:g} s | {' | '.join(cells)} |"


def whole_alarm(levels: Levels) -> list[str]:
    """Return the states of the whole alarm, with its tests of growth and steps."""
    series = MonitoredSeries(
        name="level",
        values=levels,
        smallest_change=LEVEL_LEAST,
        contact=False,
        describe="by {:.2f}".format,
    )
    number = np.arange(float(levels.size))
    return [*sequential_alarm(number, [series], [RecordingStatus()] * levels.size).states]


def whole_lines() -> Iterator[str]:
    """Yield how many of two healthy series of each kind the whole alarm reports."""
    for kind, course in HEALTHY.items():
        states = [
            whole_alarm(course(np.random.default_rng([1, seed]), RECORDINGS)) for seed in range(2)
        ]
        counts = [f"{name} {sum(name in of for of in states)}" for name in ("alert", "alarm")]
        yield f"{kind}: {', '.join(counts)} of 2"


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.level_alarms")
    arguments.add_argument("--fast", action="store_true", help="use a tenth of the series")
    arguments.add_argument("--whole", action="store_true", help="judge by the whole alarm")
    options = arguments.parse_args()
    for line in whole_lines() if options.whole else lines(fast=options.fast):
        print(line, flush=True)
