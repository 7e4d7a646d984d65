"""A contact that changes in time: one unknown drifts, and each possible contact follows what is heard of it.

A particle is a contact that does not change but for the one unknown; along its course a Kalman
filter goes, over a table of the emulator. So all that a course can do is integrated, and particles
are drawn from the unknowns alone.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.inference.forward import Forward, Law
from asperity.inference.likelihood import (
    EMULATED_HEIGHT_STD,
    EXPONENT_STD,
    GAIN_STD,
    SIZES,
    WEIGHTS,
    law_correlations,
)
from asperity.inference.observations import LogMeasurement, point_similarity
from asperity.inference.outputs import CLR
from asperity.inference.priors import si
from asperity.inference.settings import OPERATING, TEMPERATURE
from asperity.inference.visits import CHANNELS, SeriesMeasurement, VisitSeries

KNOTS = 17  # of the table along the range of what drifts
DRIFT_STD = 0.3  # of the first drift, in shares of the range over the series
RESTLESS, RESTLESS_SPREAD = (
    0.1,
    1.0,
)  # how much a drift changes over the series; median, deviation of its logarithm
SCATTER, SCATTER_SPREAD = 1e-3, 1.0  # of CRF from visit to visit beyond its own deviation, relative
MEMORIES = (
    0.0,
    0.4,
    0.65,
    0.85,
)  # correlation of the scatter of CRF from one visit to the next, evenly spaced ones
ALIKE = (0.7, 0.1, 0.1, 0.1)  # how probable each is: as where stages are read off a series
EXTRA = (
    6  # unknowns of a course: the law's error in each channel, restlessness, scatter and its memory
)
PASSES = 2  # of an update: the table is no straight line
SHARE, SPEED, LEVER, GAIN, SLOW, FIRST = range(
    6
)  # places in the state: the rest are errors of channels at places
PROBES, STEPS = (
    256,
    (0.02, 0.02, 2.0),
)  # contacts, and steps (load, speed, K), by which sounds are moved


class CourseLikelihood(NamedTuple):
    """ln p of all that was heard, of contacts that stay as they are and that change; shape (n,)."""

    steady: Field
    moving: Field


class FilteredCourse(NamedTuple):
    """Contacts at the last visit: share of the range, its drift over the series, the error of CRF at the usual place.

    `mean` (n, 3), `covariance` (n, 3, 3), `path` (n, visits) the share at each visit as it was
    known then, `log`.
    """

    log: Field
    mean: Field
    covariance: Field
    path: Field


class CourseParameters(NamedTuple):
    """What a course adds to a contact's unknowns: shape (n,) each; `sizes` are the law's errors, relative to CRF."""

    sizes: Mapping[str, Field]
    restless: Field
    scatter: Field
    memory: Field

    @classmethod
    def of(cls, z: Field) -> "CourseParameters":
        """From standard normal numbers (n, EXTRA)."""
        own = np.array(SIZES)[np.minimum((len(SIZES) * ndtr(z[:, :3])).astype(int), len(SIZES) - 1)]
        return cls(
            dict(zip(CHANNELS, own.T, strict=True)),
            RESTLESS * np.exp(RESTLESS_SPREAD * z[:, 3]),
            SCATTER * np.exp(SCATTER_SPREAD * z[:, 4]),
            np.array(MEMORIES)[np.searchsorted(np.cumsum(ALIKE)[:-1], ndtr(z[:, 5]))],
        )


@dataclass(frozen=True)
class Course:
    """What a series shows of a contact of which one unknown drifts.

    Parameters
    ----------
    forward : with the operating points of the series
    series : what was heard, and when
    law : of the spring
    drifting : key of the unknown that changes
    drift : mean and standard deviation of the first drift, in shares of the unknown's range over the series
    """

    forward: Forward
    series: VisitSeries
    law: Law
    drifting: str
    drift: tuple[float, float] = (0.0, DRIFT_STD)

    def __post_init__(self) -> None:
        known = [unknown.key for unknown in self.forward.setting.contact]
        if self.drifting not in known:
            raise BadInput(f"what drifts must be among {', '.join(known)}, got {self.drifting!r}")

    @property
    def column(self) -> int:
        """Which unknown drifts."""
        return [unknown.key for unknown in self.forward.setting.unknowns].index(self.drifting)

    @property
    def dims(self) -> int:
        """Unknowns of a contact and of its course."""
        return self.forward.dims + EXTRA

    @property
    def sounds(self) -> tuple[SeriesMeasurement, ...]:
        """All that was heard as it would have been at its place: moved there as contacts of the prior move in the mean.

        By how much these differ is in `leanings`: whoever moves one recording too far moves all of
        them too far.
        """
        return self._brought[0]

    @property
    def leanings(self) -> Mapping[tuple[str, int], Field]:
        """By how much contacts differ in how a channel goes with load (0), speed (1) or temperature (2), (places,)."""
        return self._brought[1]

    @cached_property
    def _brought(self) -> tuple[tuple[SeriesMeasurement, ...], Mapping[tuple[str, int], Field]]:
        asides = np.array([sound.aside for sound in self.series.sounds])
        z = np.random.default_rng(0).standard_normal((PROBES, self.forward.dims))
        here, moved = self.forward.shown(z, self.law, deviations=False), {}
        for axis in np.flatnonzero(np.any(asides != 0.0, axis=0)):
            forward, steps = _aside(self.forward, int(axis))
            there = forward.shown(z, self.law, deviations=False)
            moved[int(axis)] = {
                key: (getattr(there, key) - getattr(here, key)) / steps for key in CHANNELS
            }
        sounds = []
        for sound in self.series.sounds:
            by = sum(
                sound.aside[axis] * float(np.mean(slope[sound.channel][:, sound.place]))
                for axis, slope in moved.items()
            )
            sounds.append(
                sound._replace(heard=LogMeasurement(sound.heard.value - by, sound.heard.std))
            )
        leanings = {
            (key, axis): slope[key].std(axis=0) for axis, slope in moved.items() for key in CHANNELS
        }
        return tuple(sounds), leanings

    def __call__(self, z: Field) -> CourseLikelihood:
        """How probable what was heard makes contacts, shape (n, dims), without a course and with any."""
        table = ChannelTable.of(self, z)
        return CourseLikelihood(*(self._walk(table, moving=moving).log for moving in (False, True)))

    def walk(self, z: Field, *, moving: bool) -> FilteredCourse:
        """Where contacts are at the end."""
        return self._walk(ChannelTable.of(self, z), moving=moving)

    def _walk(self, table: "ChannelTable", *, moving: bool) -> FilteredCourse:
        places = len(self.forward.points)
        state = _State.begin(
            table,
            point_similarity(self.forward.points),
            self.drift if moving else (0.0, 0.0),
            self.leanings,
        )
        restless = table.extra.restless if moving else np.zeros(len(table.share))
        path = np.empty((len(table.share), len(self.series.x)))
        before = 0.0
        for sound in self.sounds:
            if sound.at > before:
                state.wait(sound.at - before, restless, table.extra, len(self.series.x) - 1)
                before = sound.at
            state.hear(sound, table, places)
            path[:, sound.visit] = state.mean[:, SHARE]
        kept = [SHARE, SPEED, FIRST + self.series.usual]
        return FilteredCourse(
            state.log, state.mean[:, kept], state.covariance[:, kept][:, :, kept], path
        )


class ChannelTable(NamedTuple):
    """What contacts would show along the range of what drifts: each channel (n, places, knots)."""

    channels: Mapping[str, Field]
    errors: Mapping[str, Field]  # covariance of the emulator's, (n, places, places)
    lever: Field  # of the law's exponent, (n, places), 0 in the mean
    share: Field  # where each begins, (n,)
    extra: CourseParameters

    @classmethod
    def of(cls, course: Course, z: Field) -> "ChannelTable":
        """By the emulator's means, along the range; its deviations where each contact begins."""
        forward, column = course.forward, course.column
        contacts, unknown = z[:, : forward.dims], forward.setting.unknowns[column]
        here = forward.shown(contacts, course.law)
        along = along_range(contacts, column, unknown.at_share(np.linspace(0.0, 1.0, KNOTS)))
        shown = forward.shown(along, course.law, deviations=False)
        tables = {key: _by_knots(getattr(shown, key)) for key in CHANNELS}
        alike = forward.correlations(contacts, course.law)
        heights = np.nan_to_num(here.crfa_std)
        errors = {
            key: std[:, :, None] * std[:, None, :] * alike[key]
            for key, std in (
                ("crf", here.crf_std),
                ("damping", here.damping_std),
                ("crfa", heights),
            )
        }
        own = np.arange(heights.shape[1])
        errors["crfa"][:, own, own] += np.where(
            np.isnan(here.crfa_std), 0.0, EMULATED_HEIGHT_STD**2
        )
        return cls(
            tables,
            errors,
            here.lever - here.lever.mean(axis=1, keepdims=True),
            unknown.share(contacts[:, column]),
            CourseParameters.of(z[:, forward.dims :]),
        )

    def at(self, channel: str, place: int, share: Field) -> tuple[Field, Field]:
        """Value and slope at shares of the range; level beyond its ends."""
        return between_knots(self.channels[channel][:, place], share)


def _aside(forward: Forward, axis: int) -> tuple[Forward, Field]:
    """The same a step aside in load (0), speed (1) or temperature (2), towards the middle of its range; the steps."""
    entry = next(
        one for one in forward.setting.operating if one.key == (*OPERATING, TEMPERATURE)[axis]
    )
    low, high = (si(end, entry.unit) for end in (entry.low, entry.high))
    name = ("load_n", "entrainment_m_s", "temperature_k")[axis]
    steps, points = np.empty(len(forward.points)), []
    for place, point in enumerate(forward.points):
        value = getattr(point, name)
        steps[place] = STEPS[axis] if value < 0.5 * (low + high) else -STEPS[axis]
        moved = value + steps[place] if axis == 2 else value * math.exp(steps[place])
        points.append(replace(point, **{name: moved}))
    return replace(forward, points=tuple(points)), steps


def along_range(z: Field, column: int, knots: Field) -> Field:
    """Contacts with one unknown at each of the knots, behind one another: (knots n, dims)."""
    along = np.tile(z, (len(knots), 1))
    along[:, column] = np.repeat(knots, len(z))
    return along


def _by_knots(values: Field) -> Field:
    """From (knots n, places) to (n, places, knots)."""
    return np.ascontiguousarray(np.moveaxis(values.reshape(KNOTS, -1, values.shape[1]), 0, -1))


def between_knots(table: Field, share: Field) -> tuple[Field, Field]:
    """Values and slopes of tables (n, knots) over 0 to 1 at shares (n,) or (n, m)."""
    last = table.shape[1] - 1
    at = np.clip(share, 0.0, 1.0) * last
    place = np.minimum(at.astype(int), last - 1)
    rows = np.arange(len(table)).reshape(-1, *[1] * (share.ndim - 1))
    low, high = table[rows, place], table[rows, place + 1]
    inside = (share >= 0.0) & (share <= 1.0)
    return low + (at - place) * (high - low), np.where(inside, last * (high - low), 0.0)


@dataclass
class _State:
    """Means and covariances of all contacts' states, and ln p of what was heard so far."""

    mean: Field
    covariance: Field
    log: Field
    leanings: Mapping[
        tuple[str, int], Field
    ]  # of each, the last states say how far a contact has it

    @classmethod
    def begin(
        cls,
        table: ChannelTable,
        near: Field,
        drift: tuple[float, float],
        leanings: Mapping[tuple[str, int], Field],
    ) -> "_State":
        """Before anything is heard: the share is the contact's, all else open."""
        count, places = len(table.share), len(near)
        before = FIRST + len(CHANNELS) * places
        mean = np.zeros((count, before + len(leanings)))
        mean[:, SHARE], mean[:, SPEED] = table.share, drift[0]
        variance = np.zeros_like(mean)
        variance[:, SPEED], variance[:, LEVER], variance[:, GAIN] = (
            drift[1] ** 2,
            EXPONENT_STD**2,
            GAIN_STD**2,
        )
        variance[:, SLOW] = table.extra.scatter**2 * (table.extra.memory > 0.0)
        variance[:, before:] = 1.0
        covariance = np.zeros((*mean.shape, mean.shape[1]))
        diagonal = np.arange(mean.shape[1])
        covariance[:, diagonal, diagonal] = variance
        for number, channel in enumerate(CHANNELS):
            own = slice(FIRST + number * places, FIRST + (number + 1) * places)
            size = WEIGHTS[channel] * table.extra.sizes[channel]
            correlations = law_correlations(table.lever, near)
            covariance[:, own, own] += (
                table.errors[channel] + size[:, None, None] ** 2 * correlations
            )
        return cls(mean, covariance, np.zeros(count), leanings)

    def wait(self, time: float, restless: Field, extra: CourseParameters, visits: int) -> None:
        """Let the share drift on, its drift wander (an integrated Wiener process), and slow scatter be forgotten."""
        left = extra.memory ** (time * visits)
        self.mean[:, SLOW] *= left
        self.covariance[:, SLOW] *= left[:, None]
        self.covariance[:, :, SLOW] *= left[:, None]
        self.covariance[:, SLOW, SLOW] += extra.scatter**2 * (extra.memory > 0.0) * (1.0 - left**2)
        self.mean[:, SHARE] += time * self.mean[:, SPEED]
        self.covariance[:, SHARE] += time * self.covariance[:, SPEED]
        self.covariance[:, :, SHARE] += time * self.covariance[:, :, SPEED]
        self.covariance[:, SHARE, SHARE] += restless**2 * time**3 / 3.0
        for row, column in ((SHARE, SPEED), (SPEED, SHARE)):
            self.covariance[:, row, column] += restless**2 * time**2 / 2.0
        self.covariance[:, SPEED, SPEED] += restless**2 * time

    def hear(self, sound: SeriesMeasurement, table: ChannelTable, places: int) -> None:
        """One logarithm heard: what it makes of the state."""
        channel, place = sound.channel, sound.place
        error = FIRST + CHANNELS.index(channel) * places + place
        noise = sound.heard.std**2 + (WEIGHTS[channel] * table.extra.scatter) ** 2
        if channel == "crf":
            noise = np.where(
                table.extra.memory > 0.0, sound.heard.std**2, noise
            )  # its scatter is in the state
        leans, lean = self._lean(sound)
        share = self.mean[:, SHARE]
        for turn in range(PASSES):
            value, slope = table.at(channel, place, share)
            said = (
                value
                + slope * (self.mean[:, SHARE] - share)
                + self.mean[:, error]
                + self.mean[:, leans] @ lean
            )
            with_share = slope[:, None] * self.covariance[:, SHARE]
            spread = self.covariance[:, error] + self.covariance[:, :, leans] @ lean
            if channel == "crf":
                spread += (
                    table.lever[:, place, None] * self.covariance[:, LEVER]
                    + self.covariance[:, SLOW]
                )
                said = said + table.lever[:, place] * self.mean[:, LEVER] + self.mean[:, SLOW]
            elif channel == "crfa":
                spread += self.covariance[:, GAIN]
                said = said + self.mean[:, GAIN]
            across = with_share + spread
            total = slope * across[:, SHARE] + across[:, error] + across[:, leans] @ lean + noise
            if channel == "crf":
                total += table.lever[:, place] * across[:, LEVER] + across[:, SLOW]
            elif channel == "crfa":
                total += across[:, GAIN]
            rest = sound.heard.value - said
            if turn == 0:
                log = -0.5 * (rest**2 / total + np.log(2.0 * np.pi * total))
            share = self.mean[:, SHARE] + across[:, SHARE] / total * rest
        self.log += log
        gain = across / total[:, None]
        self.mean += gain * rest[:, None]
        self.covariance -= gain[:, :, None] * across[:, None, :]

    def _lean(self, sound: SeriesMeasurement) -> tuple[list[int], Field]:
        """The states of how a contact goes with what a sound was heard aside in, and what they do to it."""
        first = self.mean.shape[1] - len(self.leanings)
        heard = [
            (first + number, sound.aside[axis] * spread[sound.place])
            for number, ((channel, axis), spread) in enumerate(self.leanings.items())
            if channel == sound.channel and sound.aside[axis]
        ]
        return [state for state, _ in heard], np.array([by for _, by in heard])


def tabulated(forward: Forward, z: Field, column: int, place: int) -> tuple[Field, Field]:
    """The load share's scale along the range of what drifts, (n, knots), and the emulator's deviation, (n,)."""
    at = Forward(forward.setting, forward.emulator, forward.points[place : place + 1])
    contacts = z[:, : forward.dims]
    knots = forward.setting.unknowns[column].at_share(np.linspace(0.0, 1.0, KNOTS))
    mean, _ = at.emulated(along_range(contacts, column, knots), [CLR], deviations=False)[CLR]
    _, std = at.emulated(contacts, [CLR])[CLR]
    return _by_knots(mean)[:, 0], std[:, 0]
