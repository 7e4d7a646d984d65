"""When a limit is crossed: the courses of all possible contacts, let run on."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.special import logsumexp

from asperity.case import read_amount
from asperity.core.arrays import Field
from asperity.core.errors import AsperityError, BadInput
from asperity.core.quantities import quantity
from asperity.inference.drifting_contact import (
    Course,
    CourseParameters,
    FilteredCourse,
    between_knots,
    tabulated,
)
from asperity.inference.emulator import Emulator
from asperity.inference.forward import LAWS, LEAST_SHARE, Forward, Law
from asperity.inference.observations import Observation
from asperity.inference.outputs import CLR, OUTPUTS
from asperity.inference.posterior import joined, taken
from asperity.inference.priors import si
from asperity.inference.sampling import RULED_OUT, Pool, WeightedSamples, importance
from asperity.inference.settings import Setting
from asperity.inference.visits import VisitSeries, visit_series
from asperity.monitoring import Bands

ENOUGH, COURSES = 400.0, 1500  # effective draws of each model; courses that are let run on
FEWEST, ROUGH = (
    20.0,
    60.0,
)  # draws that any model is worth, at least; fewer than the second are told
LONGEST = 120  # rounds of drawing, where the usual number leaves fewer
HORIZON, STEPS = 2.0, 80  # how far, over the span of the series; in so many steps
# of a change over none, from which on it is told: by chance once in a hundred series that are as
# modelled
ODDS = 100.0
ENDS = (0.05, 0.5, 0.95)
WORSE_ABOVE = (CLR, "sq_m")  # what may fall as far as it likes: running in is no alarm


class Limit(NamedTuple):
    """A value [SI] of the load share or of what drifts, that is not to be crossed."""

    key: str
    value: float


class Interval(NamedTuple):
    """Ends of 90 % and the median, SI."""

    low: float
    median: float
    high: float

    @classmethod
    def of(cls, values: Field) -> "Interval":
        """Of equally probable values; nan where there are none."""
        ends = np.quantile(values, ENDS, method="higher") if len(values) else [math.nan] * 3
        return cls(*(float(end) for end in ends))


@dataclass(frozen=True)
class Forecast:
    """When a limit is crossed, as far as a series of recordings tells.

    Parameters
    ----------
    limit, drifting : what is asked, and which unknown changes
    series : what was heard, and when
    rising : whether the limit is reached from below
    log_odds : ln evidence of a change over none
    already, within : probability that the limit is crossed by the last visit, and that it will be within `horizon`
    time : after the last visit, in the series' unit, of those courses that cross it within the horizon: where it is
        crossed at all
    by : time by which the limit is crossed with a probability of 5, 50 and 95 %, of all courses that had not crossed it
        by the last visit; infinite where they do not so within the horizon
    horizon : how far ahead was looked
    clr, value : load share and what drifts, at the last visit
    bands : the limit's quantity at each visit and ahead
    effective : how many independent courses it rests on
    x_name : what x is
    """

    limit: Limit
    drifting: str
    series: VisitSeries
    rising: bool
    log_odds: float
    already: float
    within: float
    time: Interval
    by: Interval
    horizon: float
    clr: Interval
    value: Interval
    effective: float
    bands: Bands = field(repr=False)
    x_name: str = ""

    @property
    def told(self) -> bool:
        """Whether the contact changes: a hundred to one."""
        return self.log_odds >= math.log(ODDS)

    @property
    def alarm(self) -> bool:
        """Whether it changes, and is past the limit or more likely than not to cross it within the horizon.

        Load share and Sq are past a limit above it: one that falls is an alarm as long as it has
        not fallen below.
        """
        if not self.told:
            return False
        if self.limit.key in WORSE_ABOVE and not self.rising:
            return self.already < 0.5
        return self.already + self.within >= 0.5

    def sentence(self) -> str:
        """In words."""
        entry, x = quantity(self.limit.key), self.series.x
        what = f"{entry.short} {entry.text(self.limit.value)}"
        if not self.told:
            return (
                f"No change of the contact is told over {len(x)} visits (odds {np.exp(min(self.log_odds, 50.0)):.2g} "
                f"to 1): nothing is said of when {what} is crossed."
            )
        way = "rises above" if self.rising else "falls below"
        if self.already >= 0.5:
            side = "above" if self.rising else "below"
            return f"{entry.short} is {side} {entry.text(self.limit.value)} (probability {self.already:.2f})."
        unit = f" in {self.x_name}" if self.x_name else ""
        said = (
            f"{entry.short} {way} {entry.text(self.limit.value)} within {self.horizon:.3g} after the last recording"
            f"{unit} with a probability of {self.already + self.within:.2f}"
        )
        if self.within < 0.05:
            return said + "."
        said += f", if so after {self.time.low:.3g} to {self.time.high:.3g} (90 %; {self.time.median:.3g})"
        rough = (
            f"; roughly, as it rests on {self.effective:.0f} courses"
            if self.effective < ROUGH
            else ""
        )
        return f"{said}{rough}."

    def scalars(self) -> dict[str, Any]:
        """As JSON has it; times in the series' own unit, after its last recording."""
        return {
            "limit": {"key": self.limit.key, "value": self.limit.value, "rising": self.rising},
            "drifting": self.drifting,
            "changes": self.told,
            "log_odds": self.log_odds,
            "alarm": self.alarm,
            "already": self.already,
            "within": self.within,
            "horizon": self.horizon,
            "effective": self.effective,
            "time": _finite(self.time),
            "by": _finite(self.by),
            "clr": self.clr._asdict(),
            "value": self.value._asdict(),
            "x": list(self.series.x),
            "sentence": self.sentence(),
        }


def _finite(interval: Interval) -> dict[str, float | None]:
    return {key: end if math.isfinite(end) else None for key, end in interval._asdict().items()}


def read_limit(text: str, setting: Setting) -> Limit:
    """A limit as it is written: "clr=0.5", or an unknown's bare name and amount, "sq=2 um".

    Raises
    ------
    BadInput
        for a name that is neither, no amount, or one that cannot be reached.
    """
    name, _, amount = (part.strip() for part in text.partition("="))
    known = {unknown.range.key.rpartition(".")[2]: unknown.key for unknown in setting.contact}
    if name not in (CLR, *known):
        raise BadInput(
            f"--forecast takes a limit such as clr=0.5, of clr, {' or '.join(known)}, got {text!r}"
        )
    if name != CLR:
        limit = Limit(
            known[name], read_amount(f"--forecast {name}", quantity(known[name]).unit, amount)
        )
    else:
        try:
            limit = Limit(CLR, float(amount))
        except ValueError:
            raise BadInput(
                f"--forecast clr takes a share of the load such as clr=0.5, got {text!r}"
            ) from None
    require_limit(setting, limit)
    return limit


class _Model(NamedTuple):
    course: Course
    moving: bool
    sampled: WeightedSamples


def forecast_observations(
    setting: Setting,
    emulator: Emulator,
    observations: Sequence[Observation],
    *,
    limit: Limit | tuple[str, float] = (CLR, 0.5),
    drifting: str | None = None,
    drift: tuple[float, float] | None = None,
    laws: Sequence[Law] = LAWS,
    seed: int = 0,
    x_name: str = "",
) -> Forecast:
    """When the load share, or what drifts, crosses a limit, with its interval.

    Parameters
    ----------
    setting, emulator : what is not known, and what answers
    observations : resonances, each with its x
    limit : key and value [SI], the key "clr" or that of what drifts
    drifting : key of the unknown that changes, all others stay as they are; by default the limit's, of CLR that of Sq
    drift : mean and standard deviation of the first drift, in shares of the range of what drifts over the series, as a
        wear model may foretell it; by default none, and up to half the range either way
    laws : of the spring
    seed : of all that is drawn
    x_name : what x is, for words and figures

    Raises
    ------
    BadInput
        for a limit that is neither or out of its range, recordings without x, or fewer than four visits.
    AsperityError
        where no course was found.
    """
    limit = Limit(*limit)
    drifting = drifting or ("sq_m" if limit.key == CLR else limit.key)
    require_limit(setting, limit, drifting)
    series = visit_series(observations)
    forward = Forward(setting, emulator, series.places)
    models, best = [], -np.inf
    for law in laws:
        course = Course(forward, series, law, drifting, *([drift] if drift else []))
        pool = Pool(course, joined, taken, course.dims, seed)
        for moving in (True, False):
            sampled = importance(
                pool, _target(moving=moving), enough=ENOUGH, best=best, least=ROUGH, longest=LONGEST
            )
            best = max(best, sampled.log_evidence)
            models.append(_Model(course, moving, sampled))
    for model in models:
        if model.sampled.effective < FEWEST and model.sampled.log_evidence > best - RULED_OUT:
            raise AsperityError(
                f"too few courses of the contact were found that fit these recordings: they are worth "
                f"{model.sampled.effective:.0f}, and {FEWEST:.0f} are needed; leave recordings out, or --forecast"
            )
    return replace(_forecast(models, limit, seed), x_name=x_name)


def require_limit(
    setting: Setting, limit: Limit, drifting: str | None = None, *, worn: bool = False
) -> None:
    """BadInput for a limit of something else than what drifts, or that it cannot reach within the emulator's range."""
    if limit.key not in (CLR, drifting or limit.key):
        raise BadInput(f"a limit must be of {CLR} or {drifting}, which changes, got {limit.key!r}")
    if worn and limit.key not in (CLR, "sq_m"):
        raise BadInput(
            f"--worn says how Sq drifts, and the limit is of {limit.key}; leave --worn out"
        )
    if limit.key == CLR and not 0.0 < limit.value < 1.0:
        raise BadInput(f"a limit of CLR must lie between 0 and 1, got {limit.value:g}")
    unknown = next((one for one in setting.contact if one.key == limit.key), None)
    if unknown is None:
        return
    low, high = (si(end, unknown.range.unit) for end in (unknown.range.low, unknown.range.high))
    if not low < limit.value < high:
        entry = quantity(limit.key)
        raise BadInput(
            f"a limit of {entry.short} must lie within what [infer] allows, {entry.text(low)} to {entry.text(high)}, "
            f"got {entry.text(limit.value)}"
        )


def _target(*, moving: bool) -> Callable[[Any], Field]:
    return lambda followed: followed.moving if moving else followed.steady


def _forecast(models: list[_Model], limit: Limit, seed: int) -> Forecast:
    rng = np.random.default_rng([seed, 8])
    logs = np.array([model.sampled.log_evidence for model in models])
    changing = np.array([model.moving for model in models])
    odds = float(logsumexp(logs[changing]) - logsumexp(logs[~changing]))
    counts = np.round(COURSES * np.exp(logs - logsumexp(logs))).astype(int)
    parts = [
        _let_run(model, int(count), limit, rng)
        for model, count in zip(models, counts, strict=True)
        if count >= 1
    ]
    past, ahead, clr, value = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    series = models[0].course.series
    rising = bool(np.mean(ahead[:, -1] >= past[:, 0]) >= 0.5)
    reached = ahead >= limit.value if rising else ahead <= limit.value
    first = np.argmax(reached, axis=1)
    already, will = reached[:, 0], reached.any(axis=1) & ~reached[:, 0]
    rows = np.flatnonzero(will)
    before, after = ahead[rows, first[rows] - 1], ahead[rows, first[rows]]
    step = HORIZON * series.span / STEPS
    times = step * (first[rows] - 1 + (limit.value - before) / (after - before))
    x_ahead = series.x[-1] + step * np.arange(1, STEPS + 1)
    whole = np.hstack([past, ahead[:, 1:]])
    return Forecast(
        limit=limit,
        drifting=models[0].course.drifting,
        series=series,
        rising=rising,
        log_odds=odds,
        already=float(np.mean(already)),
        within=float(np.mean(will)),
        time=Interval.of(times),
        by=Interval.of(np.concatenate([times, np.full(int(np.sum(~already & ~will)), np.inf)])),
        horizon=HORIZON * series.span,
        clr=Interval.of(clr),
        value=Interval.of(value),
        effective=float(
            1.0
            / np.sum((np.exp(logs - logsumexp(logs))) ** 2 / [m.sampled.effective for m in models])
        ),
        bands=Bands(
            *limit,
            np.concatenate([series.x, x_ahead]),
            series.x[-1],
            np.quantile(whole, ENDS, axis=0),
        ),
    )


def _let_run(
    model: _Model, count: int, limit: Limit, rng: np.random.Generator
) -> tuple[Field, Field, Field, Field]:
    """The limit's quantity at the visits and ahead, (count, times); load share and what drifts, at the last visit."""
    course, weights = model.course, model.sampled.weights
    places = (rng.random() + np.arange(count)) / count
    z = model.sampled.z[np.minimum(np.searchsorted(np.cumsum(weights), places), len(weights) - 1)]
    extra, walked = (
        CourseParameters.of(z[:, course.forward.dims :]),
        course.walk(z, moving=model.moving),
    )
    share, speed, error = _drawn(walked, rng)
    ahead = _run_on(share, speed, extra.restless if model.moving else np.zeros(count), rng)
    unknown = course.forward.setting.unknowns[course.column]
    if not model.moving:
        ahead = np.repeat(share[:, None], STEPS + 1, axis=1)
    scale, std = tabulated(course.forward, z, course.column, course.series.usual)
    off = _offset(course, scale, std, share, error, extra.sizes["crf"], rng)[:, None]

    def shown(key: str, shares: Field) -> Field:
        if key == CLR:
            return OUTPUTS[CLR].back(between_knots(scale, shares)[0] + off)
        return unknown.value(unknown.at_share(shares))

    now = share[:, None]
    return (
        shown(limit.key, walked.path),
        shown(limit.key, ahead),
        shown(CLR, now)[:, 0],
        shown(course.drifting, now)[:, 0],
    )


def _drawn(walked: FilteredCourse, rng: np.random.Generator) -> Field:
    """Share, drift and error of each contact at the last visit, (3, n)."""
    values, axes = np.linalg.eigh(walked.covariance)
    drawn = np.sqrt(np.maximum(values, 0.0)) * rng.standard_normal(values.shape)
    return np.asarray((walked.mean + np.einsum("nij,nj->ni", axes, drawn)).T)


def _run_on(share: Field, speed: Field, restless: Field, rng: np.random.Generator) -> Field:
    """Shares from the last visit on, (n, steps + 1): an integrated Wiener process, exactly."""
    time = HORIZON / STEPS
    path = [share]
    for _ in range(STEPS):
        one, other = rng.standard_normal((2, len(share)))
        share = share + time * speed + restless * time**1.5 * (0.5 * one + other / np.sqrt(12.0))
        speed = speed + restless * np.sqrt(time) * one
        path.append(share)
    return np.stack(path, axis=1)


def _offset(
    course: Course,
    scale: Field,
    std: Field,
    share: Field,
    error: Field,
    size: Field,
    rng: np.random.Generator,
) -> Field:
    """By how much the emulator is off in the load share: its part of the error that CRF showed, and what is left."""
    lever = np.zeros(len(share))
    if course.law == "hertz-point":
        clr = np.maximum(OUTPUTS[CLR].back(between_knots(scale, share)[0]), LEAST_SHARE)
        lever = 1.0 / (6.0 * clr * OUTPUTS[CLR].slope(clr))  # d ln CRF / d scale
    heard = (std * lever) ** 2 + size**2
    left = np.sqrt(np.maximum(std**2 * (1.0 - (std * lever) ** 2 / heard), 0.0))
    return np.asarray(std**2 * lever / heard * error + left * rng.standard_normal(len(share)))
