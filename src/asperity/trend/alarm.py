"""An alarm that judges once a recording, stays until it is acknowledged, and says how often it speaks without a cause.

What is watched comes in as `Watched` series; what a recording's state is without any change, as
`Sight`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Literal, NamedTuple, get_args

import numpy as np

from asperity.core.arrays import Field, Mask
from asperity.core.errors import BadInput
from asperity.trend.regressors import BASELINE, NOTHING_EXPLAINED, Condition, Explained, explained
from asperity.trend.sequential import FEWEST, Beside, Found, growth, knee, step, threshold

AlarmState = Literal["none", "alert", "alarm", "blind", "cannot-tell"]
ALARM_STATES: tuple[AlarmState, ...] = get_args(AlarmState)
FALSE_ALARMS = 1e-3  # a recording
ALERTS = 10.0  # false alerts for a false alarm
LATELY = 3  # recordings whose median is where an indicator, or a condition, has come to
AROUND, FEWEST_AROUND = (
    12,
    3,
)  # places on either side of a jump, by which another indicator is seen to move with it
MOVED, HEARD = 3.0, 0.1  # deviations of the difference, and 0.9 dB
# of the least change: what conditions explain is said from there on, and may be off by this share
SPOKEN = 0.4
NO_KNEE = 5.0  # odds of something else before anything is heard, in place of a knee
CONTACT_SHARE = (
    0.8  # of the false alarms allowed, among the contact's indicators; the levels have the rest
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Watched:
    """A series that may raise the alarm.

    Parameters
    ----------
    name : of the indicator, for sentences
    values : shape (recordings,), nan where there is none
    least : the change from which on it is worth acting, in units of `values`
    contact : whether it is the contact's, whose severe stage is a rise that flattens; otherwise a level, which grows
    in_words : a change of it, in words
    loud : whether gain changes it
    jumps : whether a jump upwards alarms, unless all that is loud on its sensor moves with it: then that may have been
        moved
    conditions : what it may follow without any wear; of the same recordings
    relative : whether `values` are ratios, of which conditions change the logarithm
    sensor : which of several heard it
    """

    name: str
    values: Field
    least: float
    contact: bool
    in_words: Callable[[float], str]
    loud: bool = False
    jumps: bool = False
    sensor: str = ""
    conditions: tuple[Condition, ...] = ()
    relative: bool = False

    def without_conditions(
        self, first: int = 0, last: int | None = None
    ) -> tuple[Field, Explained]:
        """The values from one recording up to another as they would be at the baseline's conditions."""
        part = slice(first, last)
        values = self.values[part]
        if not self.conditions:
            return values, NOTHING_EXPLAINED
        met = [replace(one, values=one.values[part]) for one in self.conditions]
        told = explained(np.log(values) if self.relative else values, met, least=self.least)
        return np.asarray(
            values * np.exp(-told.effect) if self.relative else values - told.effect
        ), told


def knee_weight(x: Field, watched: Sequence[Watched]) -> float:
    """The weight of a knee against all that is none (steps, cycles, bends, scatter that remembers), 0 to 1.

    By the indicator that shows it best; 1 where there are too few places to tell. The odds before
    are measured so that probabilities come true as often as they say (docs/theory/alarms.md).
    """
    ratios = [
        looked.change.log_ratio
        for one in watched
        if (looked := _looked_at(one, x, 0, x.size - 1)).places >= FEWEST
    ]
    return 1.0 / (1.0 + NO_KNEE * float(np.exp(-max(ratios)))) if ratios else 1.0


class Sight(NamedTuple):
    """Whether a recording lets one see: state "none", "blind" or "cannot-tell", and why."""

    state: AlarmState = "none"
    reason: str = ""


class Said(NamedTuple):
    """States that recordings had when they came, by their number; what stands, and who raised it, where an alarm does.

    The last recording's is judged in any case.
    """

    states: Mapping[int, AlarmState] = MappingProxyType({})
    reason: str = ""
    raised_by: str = ""


NOTHING_SAID = Said()


@dataclass(frozen=True, slots=True, kw_only=True)
class Alarm:
    """Where an alarm stands at the end of a series.

    `states` are those after each recording; `since` is the index of the recording with which the
    present state began, None for "none". `raised_by` names the indicator behind an alert or alarm.
    `reason` is a sentence without an end. `explained` says which changes load, speed or
    temperature explain, and is empty where they explain none.
    """

    state: AlarmState
    states: tuple[AlarmState, ...]
    since: int | None
    false_alarm_rate: float
    reason: str
    raised_by: str = ""
    explained: str = ""

    @property
    def verdict(self) -> str:
        """The state with its reason, one sentence."""
        said = {"none": "No alarm", "cannot-tell": "Cannot tell"}.get(
            self.state, self.state.capitalize()
        )
        return f"{said}: {self.reason}."

    def alerted(self, reason: str, raised_by: str) -> "Alarm":
        """The same with an alert at its end, where nothing graver stands there."""
        if self.state not in ("none", "cannot-tell"):
            return self
        states: tuple[AlarmState, ...] = (*self.states[:-1], "alert")
        return replace(
            self,
            state="alert",
            states=states,
            since=len(states) - 1,
            reason=reason,
            raised_by=raised_by,
        )

    def raised_from(self, number: int, reason: str, raised_by: str) -> "Alarm":
        """An alarm from a recording on."""
        alarms: list[AlarmState] = ["alarm"] * (len(self.states) - number)
        states = (*self.states[:number], *alarms)
        return replace(
            self, state="alarm", states=states, since=number, reason=reason, raised_by=raised_by
        )


def sequential_alarm(
    x: Field,
    watched: Sequence[Watched],
    sights: Sequence[Sight],
    *,
    false_alarm_rate: float = FALSE_ALARMS,
    confirmed: Callable[[int], bool] = lambda _: True,
    excused: Callable[[int, str], str] = lambda _number, _name: "",
    acknowledged: int = 0,
    unit: str = "",
    said: Said = NOTHING_SAID,
) -> Alarm:
    """One decision a recording, each from what had been recorded by then.

    Parameters
    ----------
    x : shape (recordings,), rising; recordings at one x are repeats of one test and are averaged
    watched : what may raise the alarm; the rate is shared out among them
    sights : one a recording
    false_alarm_rate : alarms without wear, a recording
    confirmed : whether the stage detector finds the severe stage in the recordings up to this one; asked before an
        alarm by the contact
    excused : what else than wear explains a change up to a recording by the indicator of a name, in words, or nothing;
        asked before an alarm or alert
    acknowledged : how many recordings somebody has looked at; what comes behind them is judged by itself
    unit : of x
    said : what earlier judgements have said, which stays as it was said

    Raises
    ------
    BadInput
        for a rate that is none.
    """
    if not 0.0 < false_alarm_rate < 0.1:
        raise BadInput(
            f"the rate of false alarms must lie between 0 and 0.1 a recording, got {false_alarm_rate:g}; 0.001 is one "
            "in 1000 recordings"
        )
    states: list[AlarmState] = ["none"] * acknowledged
    reason, raised_by = said.reason, said.raised_by
    for number in range(acknowledged, len(sights)):
        before = said.states.get(number) if number < len(sights) - 1 else None
        if before is not None:
            states.append(before)
            continue
        if states and states[-1] == "alarm" and number > acknowledged:
            states.append("alarm")
            continue
        found = [_looked_at(one, x, acknowledged, number) for one in watched]
        state, reason, raised_by = _decided(
            watched, found, sights[number], false_alarm_rate, unit, number, confirmed
        )
        if state in ("alert", "alarm") and (shape := excused(number, raised_by)):
            state, reason, raised_by = "none", shape, ""
        states.append(state)
    state = states[-1] if len(states) > acknowledged else "none"
    if len(states) == acknowledged:
        reason = f"all {acknowledged} recordings are acknowledged, and none has come since"
    since = len(states)
    while state != "none" and since > acknowledged and states[since - 1] == state:
        since -= 1
    return Alarm(
        state=state,
        states=tuple(states),
        since=None if state == "none" else since,
        false_alarm_rate=false_alarm_rate,
        reason=reason,
        raised_by=raised_by,
        explained="; ".join(filter(None, (_by_conditions(one, acknowledged) for one in watched))),
    )


class _Looked(NamedTuple):
    """What an indicator shows up to a recording; `places` where it is known, `x` and `values` there."""

    change: Found
    step: Found
    places: int
    x: Field
    values: Field


def _looked_at(one: Watched, x: Field, first: int, last: int) -> _Looked:
    values, told = one.without_conditions(first, last + 1)
    at, (level, *rows) = _places(x[first : last + 1], values, told.rows)
    beside = Beside(np.array(rows), told.scatter / told.widths) if rows else None
    test = knee if one.contact else growth
    change, stepped = (judge(at, level, least=one.least, beside=beside) for judge in (test, step))
    return _Looked(change, stepped, at.size, at, level)


def _moves_at(looked: _Looked, at: float) -> bool:
    """Whether a logarithm of a level moves where an indicator has jumped, by more than its scatter."""
    before, behind = looked.values[looked.x < at][-AROUND:], looked.values[looked.x >= at][:AROUND]
    if min(before.size, behind.size) < FEWEST_AROUND:
        return False
    scatter = np.hypot(
        before.std(ddof=1) / np.sqrt(before.size), behind.std(ddof=1) / np.sqrt(behind.size)
    )
    return bool(abs(behind.mean() - before.mean()) > max(MOVED * scatter, HEARD))


def _places(x: Field, values: Field, rows: Field) -> tuple[Field, list[Field]]:
    """Values and rows with repeats at one x averaged, and what is not known left out."""
    known = (
        np.isfinite(values) & np.isfinite(rows).all(axis=0) if len(rows) else np.isfinite(values)
    )
    if not known.any():
        return x[:0], [values[:0], *rows[:, :0]]
    at, index = np.unique(x[known], return_inverse=True)
    many = np.bincount(index)
    return at, [np.bincount(index, one[known]) / many for one in (values, *rows)]


def _by_conditions(one: Watched, first: int) -> str:
    """That conditions explain how an indicator has changed, in words; nothing where they do not."""
    _, told = one.without_conditions(first)
    values = np.log(one.values[first:]) if one.relative else one.values[first:]
    known = np.isfinite(values) & np.isfinite(told.rows).all(axis=0)
    if not told.names or known.sum() < FEWEST:
        return ""
    change, effect = (
        float(np.median(part[known][-LATELY:]) - np.median(part[known][:BASELINE]))
        for part in (values, told.effect)
    )
    if abs(effect) < SPOKEN * one.least or abs(change - effect) > SPOKEN * max(
        abs(change), one.least
    ):
        return ""
    words = " and ".join(
        _went(met, first, known) for met in one.conditions if met.name in told.names
    )
    by = np.expm1 if one.relative else float
    return f"{one.name} {one.in_words(float(by(change)))}, and {words} explains it ({one.in_words(float(by(effect)))})"


def _went(met: Condition, first: int, known: Mask) -> str:
    """From where to where a condition went."""
    shown = met.shown[first:][known]
    before, now = (float(np.median(part)) for part in (shown[:BASELINE], shown[-LATELY:]))
    return f"{met.name} from {before:.4g} to {now:.4g} {met.unit}"


def _shares(watched: Sequence[Watched], rate: float) -> list[float]:
    """The rate of false alarms that each indicator has."""
    many = sum(one.contact for one in watched)
    kinds = {True: (CONTACT_SHARE, many), False: (1.0 - CONTACT_SHARE, len(watched) - many)}
    alone = many in (0, len(watched))
    return [
        rate * (1.0 if alone else kinds[one.contact][0]) / kinds[one.contact][1] for one in watched
    ]


def _decided(
    watched: Sequence[Watched],
    found: Sequence[_Looked],
    sight: Sight,
    rate: float,
    unit: str,
    number: int,
    confirmed: Callable[[int], bool],
) -> tuple[AlarmState, str, str]:
    """State, reason, and who raised it."""
    shares = _shares(watched, rate)
    leaning = ("", "")
    beside = list(zip(found, watched, strict=True))
    for one, looked, share in zip(watched, found, shares, strict=True):
        where = f"{looked.change.at:.4g} {unit}".rstrip()
        if looked.change.log_ratio < threshold(ALERTS * share):
            continue
        way = f"{one.name} {one.in_words(looked.change.change)}"
        course = (
            f"{way} until {where} and has flattened since"
            if one.contact
            else f"{way} since {where}"
        )
        if looked.change.log_ratio >= threshold(share) and (not one.contact or confirmed(number)):
            return "alarm", course, one.name
        leaning = (course, one.name)
    for one, looked, share in zip(watched, found, shares, strict=True):
        upwards = (
            one.jumps and looked.step.change > 0.0 and looked.step.log_ratio >= threshold(share)
        )
        loud = (
            [other for other, heard in beside if heard.loud and heard.sensor == one.sensor]
            if upwards
            else []
        )
        if upwards and not (loud and all(_moves_at(other, looked.step.at) for other in loud)):
            return "alarm", _jumped(one, looked, unit), one.name
    if sight.state == "blind":
        return "blind", sight.reason, ""
    stepped = [
        _jumped(one, looked, unit)
        for one, looked, share in zip(watched, found, shares, strict=True)
        if looked.step.log_ratio >= threshold(share)
    ]
    if stepped:
        causes = "load, gain, a moved sensor or damage: what it was these recordings do not say"
        return (
            "cannot-tell",
            f"{stepped[0]}, and holds since ({causes}; acknowledge it once it is known)",
            "",
        )
    if leaning[0]:
        return (
            "alert",
            f"{leaning[0]}, not yet beyond what chance does once in {1.0 / rate:.0f} recordings",
            leaning[1],
        )
    if sight.state != "none":
        return sight.state, sight.reason, ""
    places = min((looked.places for looked in found), default=0)
    if places < FEWEST:
        return (
            "cannot-tell",
            f"the baseline is being learned, {places} of {FEWEST} places so far",
            "",
        )
    return "none", f"nothing beyond what chance does once in {1.0 / rate:.0f} recordings", ""


def _jumped(one: Watched, looked: _Looked, unit: str) -> str:
    return f"{one.name} {one.in_words(looked.step.change)} at once, at {looked.step.at:.4g} {unit}".rstrip()
