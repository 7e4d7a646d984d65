"""Level rule: a lasting rise above the baseline, judged recording by recording.

The rule does not depend on the shape of the course. It has a fast part (consecutive recordings
above a factor) and a slow part (share of the latest recordings above it). Both require more
recordings where such values occurred before by chance. docs/theory/alarms.md has the measured error
rates.
"""

import math
from collections import Counter
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from statistics import median
from typing import Literal, NamedTuple, cast

import scipy

from asperity.core.documents import JsonObject

LevelState = Literal["none", "alert", "alarm"]
ALERT_FACTOR, ALARM_FACTOR, EXTREME_FACTOR = 2.0, 4.0, 10.0  # over the baseline
FEWEST_VALUES = 8  # before the rule can judge
BASELINE_SHARE, MAX_BASELINE = 3, 200  # the baseline is the first third, at most 200 values
RATE = 3e-6  # false alarms per recording of a level, if exceedances are independent
PRIOR_EXCEEDANCES, PRIOR_VALUES = 0.5, 40.0  # of the chance of an exceedance, before any is known
LATEST, PRESENT = 30, 3  # recordings of the slow part, and of the present level
ALERT_DEVIATIONS = 4.0  # of the scatter, that an alert exceeds too, up to the factor of an alarm
BELOW_ONE_DEVIATION = 0.32  # share of the lower half of a normal distribution
BIN = 0.05  # of the logarithmic level, in the distribution of all values
HYSTERESIS = 0.8  # of the threshold of an alert, below which it ends


class _Threshold(NamedTuple):
    """Factor over the baseline, fewest consecutive recordings above it, and the state."""

    factor: float
    fewest: int
    state: LevelState


THRESHOLDS = (
    _Threshold(EXTREME_FACTOR, 2, "alarm"),
    _Threshold(ALARM_FACTOR, 3, "alarm"),
    _Threshold(ALERT_FACTOR, 3, "alert"),
)


LOWEST_HEIGHT = math.log(ALERT_FACTOR)  # of a threshold over the reference


class LevelFinding(NamedTuple):
    """State of a level after a recording, and the evidence in words."""

    state: LevelState
    evidence: str = ""


NO_FINDING = LevelFinding("none")


@dataclass(slots=True)
class LevelMonitor:
    """Memory of one level; empty at first.

    Levels are natural logarithms. With `keeps_baseline` the baseline is complete. `early` are the
    first values while the baseline is incomplete, `pending` those of a present alert, `bins` the
    distribution of all values. `latest` are the last values, each with the number of thresholds
    that it passed. `before` counts older values, and `exceeded` how many of them passed each
    threshold.
    """

    count: int = 0
    baseline: float = math.nan
    keeps_baseline: bool = False
    early: list[float] = field(default_factory=list)
    pending: list[float] = field(default_factory=list)
    bins: Counter[int] = field(default_factory=Counter)
    latest: list[tuple[float, int]] = field(default_factory=list)
    before: int = 0
    exceeded: list[int] = field(default_factory=lambda: [0] * len(THRESHOLDS))
    finding: LevelFinding = NO_FINDING

    def update(self, level: float) -> LevelFinding:
        """Add the level of a recording (nan: not measured) and return the finding."""
        if not math.isfinite(level):
            return self.finding
        self._add_to_baseline(level)
        rise = level - self.reference
        passed = 0
        if rise >= LOWEST_HEIGHT:
            passed = sum(rise >= self._height(limit) for limit in THRESHOLDS)
        self.latest.append((level, passed if self.complete else 0))
        if len(self.latest) > LATEST:
            _, oldest = self.latest.pop(0)
            self.before += 1
            for number in range(len(THRESHOLDS) - oldest, len(THRESHOLDS)):
                self.exceeded[number] += 1
        if self.complete and self.finding.state != "alarm":
            self.finding = self._judged()
        return self.finding

    def withhold(self) -> None:
        """End the finding and forget the exceedances behind it: something else explains them."""
        self.finding = NO_FINDING
        self.latest = [(level, 0) for level, _ in self.latest]

    @property
    def complete(self) -> bool:
        """True if there are enough values to judge."""
        return self.count >= FEWEST_VALUES

    @property
    def reference(self) -> float:
        """Baseline, or the median of all values where the level has settled below it."""
        return min(self.baseline, self._quantile(0.5))

    @property
    def present(self) -> float:
        """Median of the present levels; nan before the first."""
        latest = self.latest[-PRESENT:]
        return median(level for level, _ in latest) if latest else math.nan

    @property
    def rise(self) -> float:
        """Present level less the reference; nan before the first."""
        return self.present - self.reference

    def to_json(self) -> JsonObject:
        """Return the memory for `from_json`."""
        return asdict(self) | {"bins": {str(number): n for number, n in self.bins.items()}}

    @classmethod
    def from_json(cls, stored: JsonObject) -> "LevelMonitor":
        """Return the monitor of a stored memory."""
        bins = cast("dict[str, int]", stored["bins"])
        latest = cast("list[tuple[float, int]]", stored["latest"])
        state, evidence = cast("tuple[LevelState, str]", stored["finding"])
        return cls(
            count=cast("int", stored["count"]),
            baseline=cast("float", stored["baseline"]),
            keeps_baseline=cast("bool", stored["keeps_baseline"]),
            early=[*cast("list[float]", stored["early"])],
            pending=[*cast("list[float]", stored["pending"])],
            bins=Counter({int(number): count for number, count in bins.items()}),
            latest=[(level, passed) for level, passed in latest],
            before=cast("int", stored["before"]),
            exceeded=[*cast("list[int]", stored["exceeded"])],
            finding=LevelFinding(state, evidence),
        )

    def _add_to_baseline(self, level: float) -> None:
        """Add a value to the distribution, and to the baseline until it is complete.

        Values of an alert count when it has ended by itself, those of an alarm never.
        """
        self.count += 1
        self.bins[round(level / BIN)] += 1
        if self.keeps_baseline:
            return
        if self.count > BASELINE_SHARE * MAX_BASELINE:
            self.early, self.pending = [], []
            return
        if self.finding.state != "none":
            self.pending.append(level)
            return
        self.early, self.pending = (self.early + self.pending)[:MAX_BASELINE], []
        if len(self.early) < MAX_BASELINE:
            self.early.append(level)
        self.baseline = median(self.early[: max(self.count // BASELINE_SHARE, FEWEST_VALUES)])

    def _quantile(self, share: float) -> float:
        required, total = share * self.count, 0
        for number in sorted(self.bins):
            total += self.bins[number]
            if total >= required:
                return BIN * number
        return math.nan

    def _height(self, limit: _Threshold) -> float:
        """Return a threshold over the reference; that of an alert also exceeds the scatter.

        The scatter is that of the values below the reference, which growth does not reach.
        """
        height = math.log(limit.factor)
        if limit.state == "alarm":
            return height
        reference = self.reference
        below = sum(count for number, count in self.bins.items() if BIN * number <= reference)
        scatter = reference - self._quantile(BELOW_ONE_DEVIATION * below / self.count)
        return min(max(height, ALERT_DEVIATIONS * scatter), math.log(ALARM_FACTOR))

    def _judged(self) -> LevelFinding:
        if self.finding.state == "none" and not any(passed for _, passed in self.latest):
            return NO_FINDING
        for number, limit in enumerate(THRESHOLDS):
            evidence = self._evidence(number, limit)
            if evidence:
                return LevelFinding(limit.state, evidence)
        lasting = median(level for level, _ in self.latest[-FEWEST_VALUES:])
        end = self.reference + self._height(THRESHOLDS[-1]) + math.log(HYSTERESIS)
        return self.finding if lasting >= end else NO_FINDING

    def _evidence(self, number: int, limit: _Threshold) -> str:
        """Return in words that values pass a threshold more often than by chance, or ""."""
        above = [passed >= len(THRESHOLDS) - number for _, passed in self.latest]
        run = [*above[::-1], False].index(False)
        if run >= max(limit.fewest, self._longest_run(number, above[: len(above) - run])):
            return f"in {run} successive recordings"
        chance = (self.exceeded[number] + PRIOR_EXCEEDANCES) / (self.before + PRIOR_VALUES)
        if len(above) == LATEST and sum(above) > _most_by_chance(round(chance, 3)):
            return f"in {sum(above)} of the last {LATEST} recordings"
        return ""

    def _longest_run(self, number: int, earlier: list[bool]) -> int:
        """Return the length of a run of exceedances that chance does not reach."""
        exceeded = self.exceeded[number] + sum(earlier) + PRIOR_EXCEEDANCES
        chance = exceeded / (self.before + len(earlier) + PRIOR_VALUES)
        return math.ceil(math.log(RATE) / math.log(chance))


@lru_cache(maxsize=1024)
def _most_by_chance(chance: float) -> int:
    """Return the most exceedances among the latest recordings that chance reaches."""
    return int(scipy.stats.binom.isf(RATE / LATEST, LATEST, max(chance, 1e-3)))
