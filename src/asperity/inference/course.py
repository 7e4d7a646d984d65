"""A contact that changes in time: one unknown drifts, and each possible contact follows what is heard of it.

A particle is a contact that does not change but for the one unknown; along its course a Kalman filter goes, over a
table of the emulator. So all that a course can do is integrated, and particles are drawn from the unknowns alone.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from asperity.arrays import Field
from asperity.errors import BadInput
from asperity.inference.forward import Forward, Law
from asperity.inference.likelihood import EMULATED_HEIGHT_STD, EXPONENT_STD, GAIN_STD, OF_DAMPING, OF_HEIGHT, SIZES
from asperity.inference.outputs import CLR
from asperity.inference.visits import CHANNELS, Series, Sound

KNOTS = 17  # of the table along the range of what drifts
DRIFT_STD = 0.3  # of the first drift, in shares of the range over the series
RESTLESS, RESTLESS_SPREAD = 0.1, 1.0  # how much a drift changes over the series; median, deviation of its logarithm
SCATTER, SCATTER_SPREAD = 1e-3, 1.0  # of CRF from visit to visit beyond its own deviation, relative
EXTRA = 3  # unknowns of a course: the law's error, restlessness, scatter
PASSES = 2  # of an update: the table is no straight line
WEIGHTS = {"crf": 1.0, "damping": OF_DAMPING, "crfa": OF_HEIGHT}  # of the law's error and of scatter
SHARE, SPEED, LEVER, GAIN, FIRST = 0, 1, 2, 3, 4  # places in the state: the rest are errors of channels at places


class Followed(NamedTuple):
    """ln p of all that was heard, of contacts that stay as they are and that change; shape (n,)."""

    steady: Field
    moving: Field


class Walked(NamedTuple):
    """Contacts at the last visit: share of the range, its drift over the series, the error of CRF at the usual place.

    `mean` (n, 3), `covariance` (n, 3, 3), `path` (n, visits) the share at each visit as it was known then, `log`.
    """

    log: Field
    mean: Field
    covariance: Field
    path: Field


class Extra(NamedTuple):
    """What a course adds to a contact's unknowns: shape (n,) each."""

    size: Field
    restless: Field
    scatter: Field

    @classmethod
    def of(cls, z: Field) -> "Extra":
        """From standard normal numbers (n, 3)."""
        place = np.minimum((len(SIZES) * ndtr(z[:, 0])).astype(int), len(SIZES) - 1)
        return cls(
            np.array(SIZES)[place],
            RESTLESS * np.exp(RESTLESS_SPREAD * z[:, 1]),
            SCATTER * np.exp(SCATTER_SPREAD * z[:, 2]),
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
    series: Series
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

    def __call__(self, z: Field) -> Followed:
        """How probable what was heard makes contacts, shape (n, dims), without a course and with any."""
        table = Table.of(self, z)
        return Followed(*(self._walk(table, moving=moving).log for moving in (False, True)))

    def walk(self, z: Field, *, moving: bool) -> Walked:
        """Where contacts are at the end."""
        return self._walk(Table.of(self, z), moving=moving)

    def _walk(self, table: "Table", *, moving: bool) -> Walked:
        places = len(self.forward.points)
        state = _State.begin(table, places, self.drift if moving else (0.0, 0.0))
        restless = table.extra.restless if moving else np.zeros(len(table.share))
        path = np.empty((len(table.share), len(self.series.x)))
        before = 0.0
        for sound in self.series.sounds:
            if sound.at > before:
                state.wait(sound.at - before, restless)
                before = sound.at
            state.hear(sound, table, places)
            path[:, sound.visit] = state.mean[:, SHARE]
        kept = [SHARE, SPEED, FIRST + self.series.usual]
        return Walked(state.log, state.mean[:, kept], state.covariance[:, kept][:, :, kept], path)


class Table(NamedTuple):
    """What contacts would show along the range of what drifts: each channel (n, places, knots)."""

    channels: Mapping[str, Field]
    deviations: Mapping[str, Field]  # of the emulator, (n, places)
    lever: Field  # of the law's exponent, (n, places), 0 in the mean
    share: Field  # where each begins, (n,)
    extra: Extra

    @classmethod
    def of(cls, course: Course, z: Field) -> "Table":
        """By the emulator's means, along the range; its deviations where each contact begins."""
        forward, column = course.forward, course.column
        contacts, unknown = z[:, : forward.dims], forward.setting.unknowns[column]
        here = forward.shown(contacts, course.law)
        along = along_range(contacts, column, unknown.at_share(np.linspace(0.0, 1.0, KNOTS)))
        shown = forward.shown(along, course.law, deviations=False)
        tables = {key: _by_knots(getattr(shown, key)) for key in CHANNELS}
        heights = np.where(np.isnan(here.crfa_std), 0.0, np.hypot(here.crfa_std, EMULATED_HEIGHT_STD))
        return cls(
            tables,
            {"crf": here.crf_std, "damping": here.damping_std, "crfa": heights},
            here.lever - here.lever.mean(axis=1, keepdims=True),
            unknown.share(contacts[:, column]),
            Extra.of(z[:, forward.dims :]),
        )

    def at(self, channel: str, place: int, share: Field) -> tuple[Field, Field]:
        """Value and slope at shares of the range; level beyond its ends."""
        return between_knots(self.channels[channel][:, place], share)


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

    @classmethod
    def begin(cls, table: Table, places: int, drift: tuple[float, float]) -> "_State":
        """Before anything is heard: the share is the contact's, all else open."""
        count = len(table.share)
        mean = np.zeros((count, FIRST + len(CHANNELS) * places))
        mean[:, SHARE], mean[:, SPEED] = table.share, drift[0]
        variance = np.zeros_like(mean)
        variance[:, SPEED], variance[:, LEVER], variance[:, GAIN] = drift[1] ** 2, EXPONENT_STD**2, GAIN_STD**2
        for number, channel in enumerate(CHANNELS):
            own = slice(FIRST + number * places, FIRST + (number + 1) * places)
            error = (WEIGHTS[channel] * table.extra.size[:, None]) ** 2
            variance[:, own] = error + table.deviations[channel] ** 2
        covariance = np.zeros((*mean.shape, mean.shape[1]))
        diagonal = np.arange(mean.shape[1])
        covariance[:, diagonal, diagonal] = variance
        return cls(mean, covariance, np.zeros(count))

    def wait(self, time: float, restless: Field) -> None:
        """Let the share drift on, and its drift wander (an integrated Wiener process)."""
        self.mean[:, SHARE] += time * self.mean[:, SPEED]
        self.covariance[:, SHARE] += time * self.covariance[:, SPEED]
        self.covariance[:, :, SHARE] += time * self.covariance[:, :, SPEED]
        self.covariance[:, SHARE, SHARE] += restless**2 * time**3 / 3.0
        for row, column in ((SHARE, SPEED), (SPEED, SHARE)):
            self.covariance[:, row, column] += restless**2 * time**2 / 2.0
        self.covariance[:, SPEED, SPEED] += restless**2 * time

    def hear(self, sound: Sound, table: Table, places: int) -> None:
        """One logarithm heard: what it makes of the state."""
        channel, place = sound.channel, sound.place
        error = FIRST + CHANNELS.index(channel) * places + place
        noise = sound.heard.std**2 + (WEIGHTS[channel] * table.extra.scatter) ** 2
        share = self.mean[:, SHARE]
        for turn in range(PASSES):
            value, slope = table.at(channel, place, share)
            said = value + slope * (self.mean[:, SHARE] - share) + self.mean[:, error]
            with_share, spread = slope[:, None] * self.covariance[:, SHARE], self.covariance[:, error].copy()
            if channel == "crf":
                spread += table.lever[:, place, None] * self.covariance[:, LEVER]
                said = said + table.lever[:, place] * self.mean[:, LEVER]
            elif channel == "crfa":
                spread += self.covariance[:, GAIN]
                said = said + self.mean[:, GAIN]
            across = with_share + spread
            total = slope * across[:, SHARE] + across[:, error] + noise
            if channel == "crf":
                total += table.lever[:, place] * across[:, LEVER]
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


def tabulated(forward: Forward, z: Field, column: int, place: int) -> tuple[Field, Field]:
    """The load share's scale along the range of what drifts, (n, knots), and the emulator's deviation, (n,)."""
    at = Forward(forward.setting, forward.emulator, forward.points[place : place + 1])
    contacts = z[:, : forward.dims]
    knots = forward.setting.unknowns[column].at_share(np.linspace(0.0, 1.0, KNOTS))
    mean, _ = at.emulated(along_range(contacts, column, knots), [CLR], deviations=False)[CLR]
    _, std = at.emulated(contacts, [CLR])[CLR]
    return _by_knots(mean)[:, 0], std[:, 0]
