"""Forecast of the crossing of a limit by extrapolating the drift of posterior draws."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp

from asperity.case import read_amount
from asperity.core.arrays import Field
from asperity.core.coverage import PERCENT, QUANTILES
from asperity.core.documents import JsonObject
from asperity.core.errors import AsperityError, BadInput
from asperity.core.quantities import quantity
from asperity.inference.drifting_contact import (
    CourseLikelihood,
    DriftModel,
    FilteredState,
    tabulated,
)
from asperity.inference.emulator import Emulator
from asperity.inference.forward import LAWS, MIN_SHARE, ForwardModel, Law
from asperity.inference.kalman_filter import DriftParameters, between_knots
from asperity.inference.observations import Observation
from asperity.inference.outputs import CLR, OUTPUTS
from asperity.inference.posterior import join_rows, select_rows
from asperity.inference.priors import si
from asperity.inference.sampling import RULED_OUT, Pool, WeightedSamples, importance
from asperity.inference.settings import Setting
from asperity.inference.visits import VisitSeries, visit_series
from asperity.monitoring import Bands

ENOUGH, COURSES = 400.0, 1500  # effective sample size per model; courses to extrapolate
FEWEST, ROUGH = 20.0, 60.0  # minimum effective sample size; below the second the result is rough
LONGEST = 120  # maximum number of rounds if the effective sample size is below ROUGH
HORIZON, STEPS = 2.0, 80  # of the forecast, in spans of the series; number of time steps
ODDS = 100.0  # of a change over none from which on it counts as detected: 1 % false alarms
WORSE_ABOVE = (CLR, "sq_m")  # a decrease of these is running-in and raises no alarm


class Limit(NamedTuple):
    """A limit [SI] of the load share or of the drifting quantity."""

    key: str
    value: float


class Interval(NamedTuple):
    """Interval and median, SI."""

    low: float
    median: float
    high: float

    @classmethod
    def from_values(cls, values: Field) -> "Interval":
        """Return the interval of equally probable values; nan without values."""
        levels = np.quantile(values, QUANTILES, method="higher") if len(values) else [math.nan] * 3
        return cls(*(float(end) for end in levels))


@dataclass(frozen=True)
class Forecast:
    """Forecast of the time at which a limit is crossed.

    Parameters
    ----------
    limit, drifting : the limit, and the key of the drifting unknown
    series : measurements and their times
    rising : True if the limit is reached from below
    log_odds : ln evidence ratio of a change over none
    already, within : probability that the limit is crossed by the last visit, and afterwards within
        `horizon`
    time : from the last visit to the crossing, in the series' unit, over courses that cross within
        the horizon
    by : time by which the limit is crossed with a probability of 5, 50 and 95 %, over courses that
        had not crossed it by the last visit; infinite beyond the horizon
    horizon : length of the forecast
    clr, value : load share and drifting quantity at the last visit
    bands : the limit's quantity at each visit and in the forecast
    effective : effective sample size
    x_name : label of x
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
    def change_detected(self) -> bool:
        """True if the odds of a change exceed 100 to 1."""
        return self.log_odds >= math.log(ODDS)

    @property
    def alarm(self) -> bool:
        """True if a change is detected and the limit is, or probably will be, crossed.

        For load share and Sq, being above the limit is critical: a decreasing one is an alarm until
        it is below.
        """
        if not self.change_detected:
            return False
        if self.limit.key in WORSE_ABOVE and not self.rising:
            return self.already < 0.5
        return self.already + self.within >= 0.5

    def sentence(self) -> str:
        """Return the forecast as a sentence."""
        entry, x = quantity(self.limit.key), self.series.x
        limit = f"{entry.short} {entry.text(self.limit.value)}"
        if not self.change_detected:
            odds = np.exp(min(self.log_odds, 50.0))
            return (
                f"No change of the contact is detected over {len(x)} visits "
                f"(odds {odds:.2g} to 1); no forecast of when {limit} is crossed."
            )
        verb = "rises above" if self.rising else "falls below"
        if self.already >= 0.5:
            side = "above" if self.rising else "below"
            value = entry.text(self.limit.value)
            return f"{entry.short} is {side} {value} (probability {self.already:.2f})."
        unit = f" in {self.x_name}" if self.x_name else ""
        sentence = (
            f"{entry.short} {verb} {entry.text(self.limit.value)} within {self.horizon:.3g} after "
            f"the last recording{unit} with a probability of {self.already + self.within:.2f}"
        )
        if self.within < 0.05:
            return sentence + "."
        time = self.time
        sentence += (
            f", if so after {time.low:.3g} to {time.high:.3g} ({PERCENT}; median {time.median:.3g})"
        )
        rough = (
            f"; approximate, effective sample size {self.effective:.0f}"
            if self.effective < ROUGH
            else ""
        )
        return f"{sentence}{rough}."

    def scalars(self) -> JsonObject:
        """Return the JSON output; times in the series' unit, from the last recording."""
        return {
            "limit": {"key": self.limit.key, "value": self.limit.value, "rising": self.rising},
            "drifting": self.drifting,
            "changes": self.change_detected,
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
    """Parse a limit: "clr=0.5", or an unknown's short name and amount, "sq=2 um".

    Raises
    ------
    BadInput
        for an unknown name, a malformed amount, or a limit that cannot be reached.
    """
    name, _, amount = (part.strip() for part in text.partition("="))
    keys = {unknown.range.key.rpartition(".")[2]: unknown.key for unknown in setting.contact}
    if name not in (CLR, *keys):
        raise BadInput(
            f"`limit` takes a limit such as clr=0.5, of clr, {' or '.join(keys)}, got {text!r}"
        )
    if name != CLR:
        limit = Limit(keys[name], read_amount(f"`limit` {name}", quantity(keys[name]).unit, amount))
    else:
        try:
            limit = Limit(CLR, float(amount))
        except ValueError:
            raise BadInput(
                f"`limit` clr takes a share of the load such as clr=0.5, got {text!r}"
            ) from None
    require_limit(setting, limit)
    return limit


class _Model(NamedTuple):
    course: DriftModel
    changing: bool
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
) -> Forecast:
    """Forecast when the load share, or the drifting quantity, crosses a limit.

    Parameters
    ----------
    setting, emulator : unknowns and their priors; emulated contact quantities
    observations : resonances, each with its x
    limit : key and value [SI], the key "clr" or that of the drifting quantity
    drifting : key of the unknown that changes; by default that of the limit, or Sq for CLR
    drift : prior mean and standard deviation of the initial drift, in shares of the range over the
        series, for example from a wear model; by default 0 and DRIFT_STD
    laws : of the spring
    seed : random seed

    Raises
    ------
    BadInput
        for a limit of another quantity or out of range, recordings without x, or fewer than four
        visits.
    AsperityError
        if no course fits the recordings.
    """
    limit = Limit(*limit)
    drifting = drifting or ("sq_m" if limit.key == CLR else limit.key)
    require_limit(setting, limit, drifting)
    series = visit_series(observations)
    forward = ForwardModel(setting, emulator, series.points)
    models, best = [], -np.inf
    for law in laws:
        course = DriftModel(forward, series, law, drifting, *([drift] if drift else []))
        pool = Pool(course, join_rows, select_rows, course.dims, seed)  # shared by both models
        for changing in (True, False):
            target = _target(changing=changing)
            sampled = importance(
                pool, target, enough=ENOUGH, best=best, least=ROUGH, longest=LONGEST
            )
            best = max(best, sampled.log_evidence)
            models.append(_Model(course, changing, sampled))
    for model in models:
        if model.sampled.effective < FEWEST and model.sampled.log_evidence > best - RULED_OUT:
            raise AsperityError(
                "too few courses of the contact fit these recordings: effective sample size "
                f"{model.sampled.effective:.0f}, required {FEWEST:.0f}; "
                "leave recordings out, or `limit`"
            )
    return _forecast(models, limit, seed)


def require_limit(
    setting: Setting, limit: Limit, drifting: str | None = None, *, worn: bool = False
) -> None:
    """Raise BadInput for a limit of a constant quantity, or out of the emulator's range."""
    if limit.key not in (CLR, drifting or limit.key):
        raise BadInput(
            f"a limit must be of {CLR} or {drifting}, the drifting quantity, got {limit.key!r}"
        )
    if worn and limit.key not in (CLR, "sq_m"):
        raise BadInput(
            f"`worn` is a prior for the drift of Sq, but the limit is of {limit.key}; "
            "leave `worn` out"
        )
    if limit.key == CLR and not 0.0 < limit.value < 1.0:
        raise BadInput(f"a limit of CLR must lie between 0 and 1, got {limit.value:g}")
    unknown = next((entry for entry in setting.contact if entry.key == limit.key), None)
    if unknown is None:
        return
    low, high = (si(end, unknown.range.unit) for end in (unknown.range.low, unknown.range.high))
    if not low < limit.value < high:
        entry = quantity(limit.key)
        raise BadInput(
            f"a limit of {entry.short} must lie within the range in [infer], {entry.text(low)} to "
            f"{entry.text(high)}, got {entry.text(limit.value)}"
        )


def _target(*, changing: bool) -> Callable[[CourseLikelihood], Field]:
    return lambda likelihood: likelihood.changing if changing else likelihood.steady


class _Crossing(NamedTuple):
    """Crossing of a limit by equally probable courses, and the times of those that cross it ahead.

    `already` and `within` are the probabilities that it is crossed by the last visit and ahead.
    """

    rising: bool
    already: float
    within: float
    times: Field
    by: Field  # times of all that had not crossed it by the last visit, infinite if they never do

    @classmethod
    def from_courses(cls, past: Field, ahead: Field, limit: float, step: float) -> "_Crossing":
        """Return the crossing by courses (n, visits) and their continuation (n, steps + 1)."""
        rising = bool(np.mean(ahead[:, -1] >= past[:, 0]) >= 0.5)
        crossed = ahead >= limit if rising else ahead <= limit
        first = np.argmax(crossed, axis=1)
        already, will = crossed[:, 0], crossed.any(axis=1) & ~crossed[:, 0]
        rows = np.flatnonzero(will)
        before, after = ahead[rows, first[rows] - 1], ahead[rows, first[rows]]
        times = step * (first[rows] - 1 + (limit - before) / (after - before))
        never = np.full(int(np.sum(~already & ~will)), np.inf)
        return cls(
            rising,
            float(np.mean(already)),
            float(np.mean(will)),
            times,
            np.concatenate([times, never]),
        )


def _forecast(models: list[_Model], limit: Limit, seed: int) -> Forecast:
    rng = np.random.default_rng([seed, 8])
    logs = np.array([model.sampled.log_evidence for model in models])
    changing = np.array([model.changing for model in models])
    weights = np.exp(logs - logsumexp(logs))
    past, ahead, clr, value = _draw_courses(models, weights, limit, rng)
    series = models[0].course.series
    step = HORIZON * series.span / STEPS
    crossing = _Crossing.from_courses(past, ahead, limit.value, step)
    return Forecast(
        limit=limit,
        drifting=models[0].course.drifting,
        series=series,
        rising=crossing.rising,
        log_odds=float(logsumexp(logs[changing]) - logsumexp(logs[~changing])),
        already=crossing.already,
        within=crossing.within,
        time=Interval.from_values(crossing.times),
        by=Interval.from_values(crossing.by),
        horizon=HORIZON * series.span,
        clr=Interval.from_values(clr),
        value=Interval.from_values(value),
        effective=float(1.0 / np.sum(weights**2 / [m.sampled.effective for m in models])),
        bands=_bands(limit, series, np.hstack([past, ahead[:, 1:]]), step),
    )


def _bands(limit: Limit, series: VisitSeries, courses: Field, step: float) -> Bands:
    """Return the interval of courses (n, visits + steps)."""
    x = np.concatenate([series.x, series.x[-1] + step * np.arange(1, STEPS + 1)])
    return Bands(*limit, x, series.x[-1], np.quantile(courses, QUANTILES, axis=0))


class _Courses(NamedTuple):
    """The limit's quantity at visits and ahead, and CLR and drifting value at the last visit."""

    past: Field
    ahead: Field
    clr: Field
    value: Field


def _draw_courses(
    models: list[_Model], weights: Field, limit: Limit, rng: np.random.Generator
) -> _Courses:
    """Draw equally probable courses of all models and extrapolate them."""
    counts = np.round(COURSES * weights).astype(int)
    parts = [
        _extrapolate(model, int(count), limit, rng)
        for model, count in zip(models, counts, strict=True)
        if count >= 1
    ]
    return _Courses(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))


def _extrapolate(model: _Model, count: int, limit: Limit, rng: np.random.Generator) -> _Courses:
    """Draw courses of one model and extrapolate them."""
    course, z = model.course, model.sampled.resample(count, rng)
    parameters = DriftParameters.from_normal(z[:, course.forward.dims :])
    filtered = course.filter_series(z, changing=model.changing)
    share, drift, error = _draw_state(filtered, rng)
    ahead = _integrate(share, drift, parameters.diffusion * model.changing, rng)
    if not model.changing:
        ahead = np.repeat(share[:, None], STEPS + 1, axis=1)
    scale, std = tabulated(course.forward, z, course.column, course.series.main_point)
    error_clr = _emulator_error(course, scale, std, share, error, parameters.sizes["crf"], rng)

    def values(key: str, shares: Field) -> Field:
        if key == CLR:
            return OUTPUTS[CLR].back(between_knots(scale, shares)[0] + error_clr[:, None])
        return course.unknown.value(course.unknown.at_share(shares))

    past, latest = filtered.path, share[:, None]
    clr, value = (values(key, latest)[:, 0] for key in (CLR, course.drifting))
    return _Courses(values(limit.key, past), values(limit.key, ahead), clr, value)


def _draw_state(filtered: FilteredState, rng: np.random.Generator) -> Field:
    """Draw share, drift and error of each contact at the last visit, (3, n)."""
    values, axes = np.linalg.eigh(filtered.covariance)
    drawn = np.sqrt(np.maximum(values, 0.0)) * rng.standard_normal(values.shape)
    return np.asarray((filtered.mean + np.einsum("nij,nj->ni", axes, drawn)).T)


def _integrate(share: Field, drift: Field, diffusion: Field, rng: np.random.Generator) -> Field:
    """Simulate shares from the last visit, (n, steps + 1): an exact integrated Wiener process."""
    time = HORIZON / STEPS
    path = [share]
    for _ in range(STEPS):
        first, second = rng.standard_normal((2, len(share)))
        share = (
            share + time * drift + diffusion * time**1.5 * (0.5 * first + second / np.sqrt(12.0))
        )
        drift = drift + diffusion * np.sqrt(time) * first
        path.append(share)
    return np.stack(path, axis=1)


def _emulator_error(
    course: DriftModel,
    scale: Field,
    std: Field,
    share: Field,
    error: Field,
    size: Field,
    rng: np.random.Generator,
) -> Field:
    """Draw the emulator's error of CLR on its scale, conditional on the error of CRF."""
    slope = np.zeros(len(share))  # d ln CRF / d scale
    if course.law == "hertz-point":
        clr = np.maximum(OUTPUTS[CLR].back(between_knots(scale, share)[0]), MIN_SHARE)
        slope = 1.0 / (6.0 * clr * OUTPUTS[CLR].slope(clr))
    total = (std * slope) ** 2 + size**2
    residual = np.sqrt(np.maximum(std**2 * (1.0 - (std * slope) ** 2 / total), 0.0))
    return np.asarray(std**2 * slope / total * error + residual * rng.standard_normal(len(share)))
