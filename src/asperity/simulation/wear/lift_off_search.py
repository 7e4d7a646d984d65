"""Search for the lift-off speed: where a load share over speed falls through 1 %.

The probit of the load share is nearly linear in the logarithm of the speed, so that two speeds with
more and less than 1 % determine the crossing by interpolation; nothing is extrapolated.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri

from asperity.core.displayed import Brief
from asperity.core.errors import AsperityError
from asperity.core.quantities import quantity

LIFT_OFF_CLR = 0.01  # load share of the asperities that defines lift-off


class SpeedShare(NamedTuple):
    """Mean load share of the asperities at a speed, and the half-width of its interval."""

    clr: float
    half_width: float

    @property
    def touches(self) -> bool:
        """True if the asperities carry at least the share that defines lift-off."""
        return self.clr >= LIFT_OFF_CLR


LoadShares = Callable[[float], SpeedShare]  # of entrainment speed [m/s]


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchSettings:
    """Numerical settings of the search; lengths are logarithms of speed ratios."""

    bracket: float = math.log(1.15)  # width at which the search ends
    first_step: float = math.log(4.0)  # while the slope is not known
    max_step: float = math.log(5.0)  # the slope changes along a longer one
    margin: float = math.log(1.3)  # beyond the estimated crossing, to have it between two speeds
    slope: float = -1.0  # d probit(CLR)/d ln(speed), until two speeds show it
    min_slope: float = 0.3  # absolute; a flatter secant is scatter
    min_share: float = 1e-6  # a smaller load share counts as this one: its probit is finite
    max_solves: int = 14
    max_failures: int = 5  # speeds at which the contact may remain unsolved


@dataclass(frozen=True, kw_only=True, repr=False)
class LiftOff(Brief):
    """Lift-off speed [m/s] with its interval; None with a `reason` if it is not determined.

    `below` and `above` are the widths of the interval in ln(speed), by the finite time and the
    remaining bracket. `shares` are the load shares by speed.
    """

    speed: float | None = None
    below: float = math.nan
    above: float = math.nan
    shares: Mapping[float, SpeedShare] = field(default_factory=dict)
    reason: str = ""

    @property
    def low(self) -> float | None:
        """Lower end of the interval [m/s]."""
        return None if self.speed is None else self.speed * math.exp(-self.below)

    @property
    def high(self) -> float | None:
        """Upper end of the interval [m/s]."""
        return None if self.speed is None else self.speed * math.exp(self.above)

    @property
    def text(self) -> str:
        """Speed with its interval."""
        entry = quantity("lift_off_speed_m_s")
        if self.speed is None or self.low is None or self.high is None:
            return "not determined"
        return f"{entry.text(self.speed)} ({entry.number(self.low)} to {entry.text(self.high)})"

    def verdict(self) -> str:
        """Return one sentence with the speed, or the reason why there is none."""
        reason = f": {self.reason}" if self.reason else ""
        return f"The lift-off speed is {self.text}{reason}."


def find_lift_off(
    load_share: LoadShares,
    start: float,
    limits: tuple[float, float],
    settings: SearchSettings | None = None,
) -> LiftOff:
    """Return the speed at which a load share falls through `LIFT_OFF_CLR`.

    If there are several, it is one near `start`.

    Parameters
    ----------
    load_share : of entrainment speed [m/s]; an AsperityError marks a speed as not solved
    start : first speed [m/s]
    limits : lowest and highest speed of the search [m/s]
    settings : numerical settings
    """
    settings = settings or SearchSettings()
    low, high = map(math.log, limits)
    search = _Search(load_share, (low, high), settings)
    following: float | None = min(max(math.log(start), low), high)
    while following is not None and search.solves < settings.max_solves:
        search.solve(following)
        following = search.following()
    return search.result()


@dataclass
class _Search:
    """Speeds solved so far, by ln(speed), and those that could not be solved."""

    load_share: LoadShares
    limits: tuple[float, float]
    settings: SearchSettings
    shares: dict[float, SpeedShare] = field(default_factory=dict)
    failures: dict[float, str] = field(default_factory=dict)

    @property
    def solves(self) -> int:
        """Speeds tried."""
        return len(self.shares) + len(self.failures)

    def solve(self, position: float) -> None:
        """Solve the contact at a speed."""
        try:
            self.shares[position] = self.load_share(math.exp(position))
        except AsperityError as error:
            self.failures[position] = str(error).rstrip(".")

    def probit(self, position: float) -> float:
        """Return the probit of a load share relative to that of lift-off."""
        lowest = self.settings.min_share
        share = min(max(self.shares[position].clr, lowest), 1.0 - lowest)
        return float(ndtri(share) - ndtri(LIFT_OFF_CLR))

    def bracket(self) -> tuple[float | None, float | None]:
        """Return the highest speed at which asperities touch, and the lowest at which none do."""
        touching = max((x for x, share in self.shares.items() if share.touches), default=None)
        separated = min((x for x, share in self.shares.items() if not share.touches), default=None)
        return touching, separated

    def following(self) -> float | None:
        """Return the next speed to solve; None at the end of the search."""
        if len(self.failures) > self.settings.max_failures:
            return None
        touching, separated = self.bracket()
        if touching is None and separated is None:
            return self._after_failed_start()
        if touching is not None and separated is not None:
            candidate = self._inside(touching, separated)
        else:
            candidate = self._outside(touching, separated)
        return (
            None
            if candidate is None
            else self._clear_of_failures(
                candidate,
                touching,
                separated,
            )
        )

    def _after_failed_start(self) -> float:
        """Return a speed lower and higher than the first one in turn."""
        step = self.settings.first_step * (-1.0) ** len(self.failures)
        position = next(iter(self.failures)) + step * ((len(self.failures) + 1) // 2)
        return min(max(position, self.limits[0]), self.limits[1])

    def _inside(self, touching: float, separated: float) -> float | None:
        """Return a speed near the crossing, towards the farther end; None if both are close."""
        width, tolerance = separated - touching, self.settings.bracket
        if width <= tolerance * (1.0 + 1e-9):
            return None
        if self.shares[separated].clr <= self.settings.min_share:  # its value is no help
            step = self.probit(touching) / self._slope_at(touching)
            return touching + min(max(step, 0.25 * width) + 0.25 * tolerance, 0.5 * width)
        crossing = self._crossing(touching, separated)
        farther = 1.0 if separated - crossing > crossing - touching else -1.0
        target = crossing + 0.45 * farther * tolerance
        return min(max(target, touching + 0.1 * width), separated - 0.1 * width)

    def _outside(self, touching: float | None, separated: float | None) -> float | None:
        """Return a speed beyond the estimated crossing; None at the limits of the search."""
        settings, (low, high) = self.settings, self.limits
        end = touching if touching is not None else separated
        assert end is not None
        upward = touching is not None
        if end == (high if upward else low):
            return None
        if not upward and self.shares[end].clr <= settings.min_share:
            step = settings.first_step
        else:
            step = abs(self.probit(end)) / self._slope_at(end) + settings.margin
        step = min(step, settings.max_step)
        return min(end + step, high) if upward else max(end - step, low)

    def _slope_at(self, end: float) -> float:
        """Return the absolute slope of the probit between `end` and the nearest solved speed."""
        others = [
            x
            for x, share in self.shares.items()
            if x != end and share.clr > self.settings.min_share
        ]
        slope = self.settings.slope
        if others:
            other = min(others, key=lambda x: abs(x - end))
            slope = (self.probit(other) - self.probit(end)) / (other - end)
        return -slope if slope <= -self.settings.min_slope else abs(self.settings.slope)

    def _clear_of_failures(
        self, candidate: float, touching: float | None, separated: float | None
    ) -> float | None:
        """Return the candidate, or a speed between it and a solved one if others near it failed."""
        solved = touching if touching is not None else separated
        assert solved is not None
        for failed in sorted(self.failures, key=lambda x: abs(x - solved)):
            beyond = (candidate - failed) * (failed - solved) >= 0.0
            if beyond or abs(candidate - failed) < 0.5 * self.settings.bracket:
                candidate = 0.5 * (solved + failed)
        too_close = abs(candidate - solved) < 0.25 * self.settings.bracket
        return None if too_close else candidate

    def _crossing(self, touching: float, separated: float) -> float:
        """Return where the probit crosses that of lift-off, linear between two speeds."""
        first, last = self.probit(touching), self.probit(separated)
        return touching + (separated - touching) * first / (first - last)

    def result(self) -> LiftOff:
        """Return the crossing with its interval, or the reason why there is none."""
        shares = {math.exp(x): share for x, share in sorted(self.shares.items())}
        touching, separated = self.bracket()
        if touching is None or separated is None:
            return LiftOff(shares=shares, reason=self._reason(touching))
        crossing = self._crossing(touching, separated)
        time = self._time_width(touching, separated, crossing)
        return LiftOff(
            speed=math.exp(crossing),
            below=min(math.hypot(time, crossing - touching), crossing - self.limits[0]),
            above=min(math.hypot(time, separated - crossing), self.limits[1] - crossing),
            shares=shares,
        )

    def _time_width(self, touching: float, separated: float, crossing: float) -> float:
        """Return the half-width in ln(speed) by that of the load shares: it, over the slope."""
        ends = [self.shares[x] for x in (touching, separated)]
        relative = [share.half_width / max(share.clr, self.settings.min_share) for share in ends]
        if ends[1].half_width == 0.0:  # no contact at all: nothing about the scatter
            relative[1] = relative[0]
        half_width = float(
            np.interp(
                crossing,
                [touching, separated],
                relative,
            )
        )
        density = math.exp(-0.5 * float(ndtri(LIFT_OFF_CLR)) ** 2) / math.sqrt(2.0 * math.pi)
        slope = (self.probit(touching) - self.probit(separated)) / (separated - touching)
        return half_width * LIFT_OFF_CLR / density / slope

    def _reason(self, touching: float | None) -> str:
        """Return why no speed was found on one side of the crossing."""
        failed = [
            f"at {math.exp(x):.3g} m/s: {reason}" for x, reason in list(self.failures.items())[:1]
        ]
        if not self.shares:
            return f"no speed was solved; {failed[0]}"
        share = f"{100.0 * LIFT_OFF_CLR:g} % of the load"
        speeds = [math.exp(x) for x in self.shares]
        side = (
            f"less than {share} at the lowest speed solved, {min(speeds):.3g} m/s"
            if touching is None
            else f"at least {share} at the highest speed solved, {max(speeds):.3g} m/s"
        )
        return "; ".join([f"the asperities carry {side}", *failed])


def refined(settings: SearchSettings, found: LiftOff) -> SearchSettings:
    """Return the settings of a search that starts at a crossing found on fewer cells."""
    settings = replace(
        settings,
        first_step=math.log(1.5),
        margin=0.5 * settings.bracket,
    )
    speeds = sorted(found.shares, key=lambda speed: abs(math.log(speed / (found.speed or 1.0))))
    closest = [speed for speed in speeds if found.shares[speed].clr > settings.min_share][:2]
    if len(closest) < 2:
        return settings
    first, second = (float(ndtri(found.shares[speed].clr)) for speed in closest)
    slope = (second - first) / math.log(closest[1] / closest[0])
    return replace(settings, slope=min(slope, -settings.min_slope))
