"""The contact resonance from several sensors: its line has one frequency on all of them.

Each sensor's series is separated alone, then each recording's line is fitted to all sensors
together. The common part of the sensors' errors is measured: an interval narrows only by the
independent part.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import islice

from asperity.core.arrays import Mask
from asperity.core.errors import BadInput
from asperity.core.signals import Spectrum
from asperity.resonance.sensor_agreement import (
    Agreement,
    MasksBySensor,
    SensorLines,
    SpectraBySensor,
    recordings_with_vibration,
)
from asperity.resonance.sensor_change import first_moved_recording
from asperity.resonance.sensor_judgement import JointJudgement
from asperity.resonance.series import (
    FEWEST_RECORDINGS,
    Shared,
    has_no_vibration,
    separate_series,
    separate_with_shared,
)


def resonances_of_sensors(
    spectra: SpectraBySensor, *, band_hz: tuple[float, float], kept: MasksBySensor | None = None
) -> SensorLines:
    """Find the contact resonance that the sensors of one machine have in common, in each recording.

    A line belongs to the contact if two sensors detect it at one frequency. A sensor that agreed
    with others in half of its recordings suffices in another one. A line that only one sensor ever
    detects may be a structural mode, and lines that differ give no result.

    Parameters
    ----------
    spectra : by sensor, one per recording (None where missing), all on the same lines
    band_hz : search band [Hz]
    kept : masks (lines,) of the lines to use, as `spectra`; all by default

    Raises
    ------
    BadInput
        as `series_resonances`, or where no sensor has 6 recordings.
    """
    return learn_sensors(spectra, band_hz=band_hz, kept=kept)[0]


def learn_sensors(
    spectra: SpectraBySensor, *, band_hz: tuple[float, float], kept: MasksBySensor | None = None
) -> tuple[SensorLines, "SharedBySensors"]:
    """Return the lines of `resonances_of_sensors`, and the shared spectra for judging further ones.

    Where a sensor was moved, the recordings from there on are treated as a series of their own.
    """
    names = _sensors_with_enough_recordings(spectra, band_hz)
    if not names:
        raise BadInput(
            f"no sensor has {FEWEST_RECORDINGS} recordings, which the joint separation needs; "
            "record more"
        )
    by_sensor = {}
    for name in names:
        used, masks = _usable(spectra, kept, name, band_hz)
        by_sensor[name] = separate_series(used, band_hz=band_hz, kept=masks)
    rows = recordings_with_vibration(spectra, band_hz)
    moves = {
        name: first_moved_recording(series.blocks, series.fit.joint)
        for name, series in by_sensor.items()
    }
    moved = [(rows[name][first], name) for name, first in moves.items() if first is not None]
    if moved:
        return _learn_in_parts(spectra, band_hz, kept, min(moved))
    lines, agreement = JointJudgement(by_sensor, spectra, band_hz).judge()
    shared = {name: series.shared for name, series in by_sensor.items()}
    return lines, SharedBySensors(by_sensor=shared, agreement=agreement, band_hz=band_hz)


def _learn_in_parts(
    spectra: SpectraBySensor,
    band_hz: tuple[float, float],
    kept: MasksBySensor | None,
    move: tuple[int, str],
) -> tuple[SensorLines, "SharedBySensors"]:
    """Judge the recordings before and after a move separately; return the last part's spectra."""
    first, _ = move
    (before, _), (after, shared) = (
        learn_sensors(
            {name: series[part] for name, series in spectra.items()},
            band_hz=band_hz,
            kept=None if kept is None else {name: series[part] for name, series in kept.items()},
        )
        for part in (slice(first), slice(first, None))
    )
    lines = SensorLines(
        resonances=before.resonances + after.resonances,
        detected_on=before.detected_on + after.detected_on,
        alone={name: series + after.alone[name] for name, series in before.alone.items()},
        common=after.common,
        moved=(*before.moved, move, *((first + number, name) for number, name in after.moved)),
    )
    return lines, shared


@dataclass(frozen=True, eq=False, kw_only=True)
class SharedBySensors:
    """Spectra that the recordings of each sensor share, and the agreement of the sensors."""

    by_sensor: Mapping[str, Shared]
    agreement: Agreement
    band_hz: tuple[float, float]

    def fits(self, spectra: SpectraBySensor, band_hz: tuple[float, float]) -> bool:
        """Return whether spectra are of these sensors and on their lines."""
        names = _sensors_with_enough_recordings(spectra, self.band_hz)
        if band_hz != self.band_hz or set(names) != {*self.by_sensor}:
            return False
        first = {
            name: next(spectrum for spectrum in spectra[name] if spectrum is not None)
            for name in self.by_sensor
        }
        return all(shared.fits(first[name]) for name, shared in self.by_sensor.items())

    def lines(self, spectra: SpectraBySensor, kept: MasksBySensor | None = None) -> SensorLines:
        """Find the contact resonance in further recordings, as `resonances_of_sensors` does.

        Its height is that on the first sensor of the original series, in any order of `spectra`.

        Raises
        ------
        BadInput
            for spectra on other lines, or without vibration.
        """
        spectra = {
            name: spectra[name]
            for name in dict.fromkeys((*self.by_sensor, *spectra))
            if name in spectra
        }
        available = [
            name
            for name, rows in recordings_with_vibration(spectra, self.band_hz).items()
            if rows and name in self.by_sensor
        ]
        by_sensor = {
            name: separate_with_shared(
                self.by_sensor[name], *_usable(spectra, kept, name, self.band_hz)
            )
            for name in available
        }
        return JointJudgement(by_sensor, spectra, self.band_hz).judge(self.agreement)[0]


def _sensors_with_enough_recordings(
    spectra: SpectraBySensor, band_hz: tuple[float, float]
) -> list[str]:
    """Return the sensors that have enough recordings to be separated."""
    usable = {
        name: (
            spectrum
            for spectrum in series
            if spectrum is not None and not has_no_vibration(spectrum, band_hz)
        )
        for name, series in spectra.items()
    }
    return [
        name
        for name, recordings in usable.items()
        if len([*islice(recordings, FEWEST_RECORDINGS)]) == FEWEST_RECORDINGS
    ]


def _usable(
    spectra: SpectraBySensor, kept: MasksBySensor | None, name: str, band_hz: tuple[float, float]
) -> tuple[list[Spectrum], list[Mask] | None]:
    """Return a sensor's spectra with vibration, and their masks."""
    rows = recordings_with_vibration(spectra, band_hz)[name]
    used = [spectrum for number in rows if (spectrum := spectra[name][number]) is not None]
    if kept is None:
        return used, None
    return used, [mask for number in rows if (mask := kept[name][number]) is not None]
