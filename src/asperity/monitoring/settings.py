"""Settings of `track_recordings` and `watch_folder`; the command line builds them in one place."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Protocol

from asperity.core.documents import JsonObject
from asperity.recording import ReadOptions
from asperity.resonance import SeriesMethod
from asperity.trend import ALARM_STATES, FALSE_ALARM_RATE, AlarmState, Detector, StageSource

# settings of reading, and those that leave a judgement as it is; all others are part of it
_OTHER_THAN_JUDGEMENT = frozenset(
    ("rate_hz", "unit", "channel", "scale", "band_hz", "acknowledge", "workers")
)


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackSettings:
    """Settings for reading and judging a series of recordings."""

    rate_hz: float | None = None  # sampling rate [Hz]; None: as the file states
    unit: str | None = None  # unit of the values, such as "g"; None: as the file states
    channel: str | None = None  # name or number; "a,b": two sensors of one machine
    scale: float | None = None  # value of a stored 1 in `unit`; None: as the file states
    band_hz: tuple[float, float] | None = None  # search band of CRF [Hz]; None: from the case
    shaft_hz: Sequence[float] | None = None  # shafts' speeds [Hz], harmonics removed; None: search
    method: SeriesMethod | None = None  # None: "joint" from 6 recordings on, otherwise "modes"
    detector: Detector = "bayesian"  # change-point detector of the stages
    stages_from: StageSource = "crf"  # indicator that decides stage and alarm
    false_alarm_rate: float = FALSE_ALARM_RATE  # false alarms per recording; 0.001: 1 in 1000
    acknowledge: str | None = None  # recording up to which alarms are acknowledged; "last": all
    workers: int = 1  # processes that read recordings in parallel

    @property
    def read_options(self) -> ReadOptions:
        """Options of `read_recording`."""
        return ReadOptions(
            rate_hz=self.rate_hz, unit=self.unit, channel=self.channel, scale=self.scale
        )

    def judgement(self) -> dict[str, object]:
        """Return the settings on which a judgement depends, beyond those of reading."""
        names = (field.name for field in fields(self) if field.name not in _OTHER_THAN_JUDGEMENT)
        return {name: getattr(self, name) for name in names}


class Notifier(Protocol):
    """A recipient of notifications: a command, a web address or an MQTT topic."""

    @property
    def name(self) -> str:
        """Name of the recipient, without passwords."""

    def send(self, notification: JsonObject) -> None:
        """Deliver a notification; raise an Exception with the reason on failure."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WatchSettings:
    """Settings that only watching a folder needs: store, sensor, notifications and timing."""

    store: str | Path | None = None  # SQLite file, may be shared; None: asperity.db in `out`
    machine: str | None = None  # name in the store; None: name of the parent folder
    point: str | None = None  # measuring point; None: name of the folder
    sensor: str | None = None  # None: as table, sidecar or channel states
    notifiers: Sequence[Notifier] = ()  # recipients, notified of changes of state; see `notifiers`
    notify_states: Sequence[AlarmState] = ALARM_STATES  # notify on entering or leaving these
    reuse_judgement: bool = False  # start with the stored judgement if nothing has changed
    once: bool = False  # process the present recordings and stop
    poll_interval_s: float = 5.0  # interval between checks of the folder [s]
    settle_time_s: float = 2.0  # time for which a file must be unchanged before it is read [s]
    overdue_after_s: float | None = None  # time without recordings until "blind" [s]; None: 5 usual
    keep_s: float | None = None  # age from which recordings are thinned out [s]; None: never
    on_check: Callable[[], None] | None = None  # called after each check of the folder
