"""Auxiliary channels of a recording: load, speed, temperature and tacho; fault frequencies.

`asperity.recording` defines which channels a sidecar may name.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.core.signals import averaged_spectrum
from asperity.monitoring.files import RecordingPlace
from asperity.monitoring.target import Target
from asperity.recording import OPERATING_KEYS, OpenRecording, raw_channel, time_scale
from asperity.vibration import (
    HARMONICS,
    Envelope,
    Turning,
    are_times,
    attributed_power,
    resample_to_constant_speed,
    separable_harmonics,
    tolerance_hz,
    turning_by_pulses,
    turning_by_speed,
    turning_by_times,
)

MAX_SAMPLES = 1 << 21  # for order tracking, which holds them in memory
MIN_WIDTH = 1.5  # spectral lines on either side of a frequency: the main lobe of a Hann window
MIN_LINES = 4  # spectral lines below a frequency for its line to be resolved
UNITS: dict[str, dict[str, float]] = {  # factors from the unit of a channel to that of a key
    "load_n": {"N": 1.0, "kN": 1e3, "mN": 1e-3, "MN": 1e6},
    "entrainment_m_s": {"m/s": 1.0, "mm/s": 1e-3},
    "speed_hz": {
        "Hz": 1.0,
        "1/s": 1.0,
        "rps": 1.0,
        "rpm": 1.0 / 60.0,
        "1/min": 1.0 / 60.0,
        "min-1": 1.0 / 60.0,
    },
    "temperature_degc": {"degC": 1.0, "°C": 1.0, "C": 1.0},
}
DEFAULT_BANDS = {
    "10 to 1000 Hz": (10.0, 1000.0),
    "1 to 5 kHz": (1000.0, 5000.0),
    "above 5 kHz": (5000.0, np.inf),
}
SPEED_TOLERANCE = 0.1  # relative difference of stated speed and tacho, above which it is remarked
CLOCK_TOLERANCE = 1e-6  # relative difference of equal sampling rates
USABLE_BANDWIDTH = 0.4  # of the sampling rate; the anti-alias filter cuts above it


@dataclass(frozen=True, slots=True, kw_only=True)
class AuxiliaryData:
    """Auxiliary data of a recording.

    `facts` as in `Reading`; `turning` is the shaft's angle, None without a channel for it;
    `remarks` are sentences on data that could not be used.
    """

    facts: dict[str, tuple[str, str]]
    turning: Turning | None
    remarks: tuple[str, ...]


def read_auxiliary(opened: OpenRecording, place: RecordingPlace | None) -> AuxiliaryData:
    """Read the channels that a sidecar names for load, speed, temperature and tacho."""
    conditions = _condition_channels(opened)
    tacho = _tacho(opened)
    table_facts = {
        key: (f"{value:.10g}", "table")
        for key in OPERATING_KEYS
        if (value := getattr(place, key, None)) is not None
    }
    return AuxiliaryData(
        facts=conditions.facts | tacho.facts | table_facts,
        turning=conditions.turning if tacho.turning is None else tacho.turning,
        remarks=conditions.remarks + tacho.remarks,
    )


def _condition_channels(opened: OpenRecording) -> AuxiliaryData:
    """Read the channels for load, speed and temperature."""
    facts: dict[str, tuple[str, str]] = {}
    remarks: list[str] = []
    turning = None
    fact = opened.facts.get("condition_channels")
    for key, name in ({} if fact is None else fact.value).items():
        try:
            values = _channel_in(opened.path, key, name)
            if not np.isfinite(values).any():
                raise BadInput(f"{opened.path}: channel {name} contains no number; leave it out")
            facts[key] = (f"{np.nanmean(values):.10g}", f"file (channel {name})")
            if key == "speed_hz" and values.size == opened.samples:
                turning = turning_by_speed(values[:MAX_SAMPLES], opened.rate_hz)
        except BadInput as refusal:
            remarks.append(str(refusal))
    return AuxiliaryData(facts=facts, turning=turning, remarks=tuple(remarks))


def _tacho(opened: OpenRecording) -> AuxiliaryData:
    """Read the tacho."""
    if "tacho" not in opened.facts:
        return AuxiliaryData(facts={}, turning=None, remarks=())
    name = opened.facts["tacho"].value
    per_turn = opened.facts["pulses_per_turn"].value if "pulses_per_turn" in opened.facts else 1.0
    try:
        turning = _turning(opened, name, per_turn)
    except BadInput as refusal:
        return AuxiliaryData(facts={}, turning=None, remarks=(str(refusal),))
    speed = (f"{turning.speed_hz:.10g}", f"file (tacho, channel {name})")
    remarks = (*turning.remarks, *_contradiction(opened, turning))
    return AuxiliaryData(facts={"speed_hz": speed}, turning=turning, remarks=remarks)


def _turning(opened: OpenRecording, name: str, per_turn: float) -> Turning:
    """Return the shaft's angle from a tacho signal, or from a channel of the times of pulses."""
    values = _values(opened.path, name, MAX_SAMPLES)
    samples = min(opened.samples or MAX_SAMPLES, MAX_SAMPLES)
    if are_times(values) and 2 * np.isfinite(values).sum() < samples:
        to_seconds = time_scale(raw_channel(opened.path, name).unit or "") or 1.0
        return turning_by_times(to_seconds * values, samples, opened.rate_hz, per_turn)
    _require_same_clock(opened, name)
    return turning_by_pulses(values, opened.rate_hz, per_turn)


def _contradiction(opened: OpenRecording, turning: Turning) -> tuple[str, ...]:
    """Return a remark if the sidecar states another speed than the tacho."""
    fact = opened.facts.get("speed_hz")
    if fact is None or abs(turning.speed_hz / float(fact.value) - 1.0) <= SPEED_TOLERANCE:
        return ()
    return (
        f"the tacho gives {turning.speed_hz:.4g} Hz, the {fact.source} {float(fact.value):.4g} Hz; "
        "the tacho is used, check its pulses_per_turn",
    )


def fault_rates(
    opened: OpenRecording, auxiliary: AuxiliaryData, target: Target
) -> dict[str, float]:
    """Return the frequencies [Hz] of faults and meshes at the speed of a recording, by name."""
    fact = opened.facts.get("speed_hz")
    speed = (
        float(auxiliary.facts["speed_hz"][0])
        if "speed_hz" in auxiliary.facts
        else None
        if fact is None
        else float(fact.value)
    )
    per_turn = dict(target.rates_per_turn)
    if "faults_per_turn" in opened.facts:
        per_turn |= opened.facts["faults_per_turn"].value
    if auxiliary.turning is not None:
        speed = auxiliary.turning.speed_hz  # speed to which the vibration is resampled
    speed = speed or target.shaft_hz
    rates_hz = {} if speed is None else {name: times * speed for name, times in per_turn.items()}
    return rates_hz | (opened.facts["faults_hz"].value if "faults_hz" in opened.facts else {})


def order_tracked(opened: OpenRecording, auxiliary: AuxiliaryData) -> tuple[Field, float] | None:
    """Return the vibration at constant speed and its sampling rate; None without an angle."""
    if auxiliary.turning is None:
        return None
    blocks, count = [], 0
    for block in opened.blocks():
        blocks.append(block)
        count += block.size
        if count >= MAX_SAMPLES:
            break
    turning = auxiliary.turning
    values = np.concatenate(blocks)[: turning.turns.size]
    turning = turning._replace(turns=turning.turns[: values.size])
    if not np.isfinite(values).all():
        raise BadInput("samples are missing, so that order tracking is not possible")
    return resample_to_constant_speed(values, turning, opened.rate_hz)


def envelope_and_lines(
    rates_hz: Mapping[str, float], values: Field, rate_hz: float, unit: str, segment: int
) -> tuple[dict[str, float], dict[str, float]]:
    """Return envelope depths and line rms at fault frequencies, of a vibration in memory."""
    envelope = Envelope(rate_hz)
    for _ in envelope.watch([values]):
        pass
    spectrum = averaged_spectrum([values], rate_hz, unit, segment=segment)
    return envelope.depths(rates_hz), lines(spectrum.frequency_hz, spectrum.density, rates_hz)


def lines(frequency_hz: Field, density: Field, rates_hz: Mapping[str, float]) -> dict[str, float]:
    """Return the rms at each frequency and its next two harmonics; nan if they are not resolved.

    A harmonic shared by several fault frequencies counts for the one whose own lines are present.
    """
    spacing = float(frequency_hz[1])
    resolution = MIN_WIDTH * spacing
    separable = separable_harmonics(rates_hz, resolution)
    levels = {}
    for name, rate in rates_hz.items():
        powers = []
        for centre in (number * rate for number in range(1, HARMONICS + 1)):
            within = np.abs(frequency_hz - centre) <= tolerance_hz(centre, resolution)
            powers.append(float(density[within].sum() * spacing))
        resolved = rate >= MIN_LINES * spacing and rate < frequency_hz[-1]
        power = attributed_power(powers, separable[name])
        levels[name] = float(np.sqrt(power)) if resolved else float("nan")
    return levels


def bands(opened: OpenRecording, frequency_hz: Field, density: Field) -> dict[str, float]:
    """Return the rms in the bands of the sidecar, or three default bands, within the sampling."""
    limits = opened.facts["bands_hz"].value if "bands_hz" in opened.facts else DEFAULT_BANDS
    spacing = float(frequency_hz[1])
    highest = USABLE_BANDWIDTH * opened.rate_hz
    levels = {}
    for name, (low, high) in limits.items():
        high = min(high, highest) if high == np.inf else high
        if low < high <= highest:
            inside = (frequency_hz >= low) & (frequency_hz < high)
            levels[name] = float(np.sqrt(density[inside].sum() * spacing))
    return levels


def _channel_in(path: Path, key: str, name: str) -> Field:
    """Return the values of a channel in the unit of a condition's key."""
    channel = raw_channel(path, name)
    return _values(path, name, None) * (
        _factor(channel.unit.strip(), key, path, name) if channel.unit else 1.0
    )


def _factor(unit: str, key: str, path: Path, name: str) -> float:
    """Return the factor of a unit to that of a key; upper or lower case only if unambiguous."""
    factors = UNITS[key]
    matches = (
        [unit] if unit in factors else [label for label in factors if label.lower() == unit.lower()]
    )
    if len(matches) != 1:
        raise BadInput(
            f"{path.name}: channel {name} is in {unit}, but {key} needs {', '.join(factors)}"
        )
    return factors[matches[0]]


def _require_same_clock(opened: OpenRecording, name: str) -> None:
    """Raise BadInput unless tacho and vibration have equal sampling rate and length."""
    tacho = raw_channel(opened.path, name)
    for quantity, value, expected in (
        ("Hz", tacho.rate_hz, opened.channel.rate_hz),
        ("samples", tacho.samples, opened.samples),
    ):
        if (
            value is not None
            and expected is not None
            and abs(value - expected) > CLOCK_TOLERANCE * expected
        ):
            raise BadInput(
                f"the tacho in channel {name} has {value:.10g} {quantity} and the vibration "
                f"{expected:.10g}; record both with the same clock, or state speed_hz"
            )


def _values(path: Path, name: str, max_samples: int | None) -> Field:
    blocks: list[Field] = []
    for block in raw_channel(path, name).blocks(1 << 18):
        blocks.append(np.asarray(block, dtype=float))
        if max_samples is not None and sum(part.size for part in blocks) >= max_samples:
            break
    return np.concatenate(blocks)[:max_samples]
