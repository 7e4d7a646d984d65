"""What a recording's file tells beside its vibration: load, speed and temperature in other channels, a tacho.

And what the machine's rates are at the speed that is found. What a sidecar may name is said by
`asperity.recording`.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.core.signals import averaged_spectrum
from asperity.monitoring.files import Place
from asperity.monitoring.target import Target
from asperity.recording import OPERATING_KEYS, OpenRecording, raw_channel
from asperity.vibration import (
    Envelope,
    Turning,
    resample_to_constant_speed,
    turning_by_pulses,
    turning_by_speed,
)

MOST = 1 << 21  # samples of which orders are followed: they are in memory at once
HARMONICS = 3
NEAR = 0.015  # of a rate, either way: rolling elements slip
FEWEST_LINES = 4  # of the spectrum below a rate, for its line to be told from the others
UNITS: dict[str, dict[str, float]] = {  # of channels, as factors to the unit of a key
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
OWN_BANDS = {
    "10 to 1000 Hz": (10.0, 1000.0),
    "1 to 5 kHz": (1000.0, 5000.0),
    "above 5 kHz": (5000.0, np.inf),
}
SAME = 1e-6  # of a rate, within which two are one
USABLE = 0.4  # of the sampling rate: above, the anti-alias filter has cut


@dataclass(frozen=True, slots=True, kw_only=True)
class Beside:
    """What a file tells beside its vibration.

    `facts` as `Reading` has them; `turning` the shaft's angle, None where no channel tells it;
    `remarks` say in a sentence each what of it could not be used.
    """

    facts: dict[str, tuple[str, str]]
    turning: Turning | None
    remarks: tuple[str, ...]


def beside(opened: OpenRecording, place: Place | None) -> Beside:
    """Read the channels that a sidecar names for load, speed, temperature and tacho."""
    facts: dict[str, tuple[str, str]] = {}
    remarks: list[str] = []
    turning = None
    named = (
        {**opened.facts["condition_channels"].value} if "condition_channels" in opened.facts else {}
    )
    for key, name in named.items():
        try:
            values = _channel_in(opened.path, key, name)
            if not np.isfinite(values).any():
                raise BadInput(f"{opened.path}: channel {name} has no number; leave it out")
            facts[key] = (f"{np.nanmean(values):.10g}", f"file (channel {name})")
            if key == "speed_hz" and values.size == opened.samples:
                turning = turning_by_speed(values[:MOST], opened.rate_hz)
        except BadInput as refusal:
            remarks.append(str(refusal))
    if "tacho" in opened.facts:
        name = opened.facts["tacho"].value
        per_turn = (
            opened.facts["pulses_per_turn"].value if "pulses_per_turn" in opened.facts else 1.0
        )
        try:
            _require_beside(opened, name)
            pulses = _values(opened.path, name, MOST)
            turning = turning_by_pulses(pulses, opened.rate_hz, per_turn)
            facts["speed_hz"] = (f"{turning.speed_hz:.10g}", f"file (tacho, channel {name})")
        except BadInput as refusal:
            remarks.append(str(refusal))
    stated = {
        key: (f"{value:.10g}", "table")
        for key in OPERATING_KEYS
        if (value := getattr(place, key, None)) is not None
    }
    return Beside(facts=facts | stated, turning=turning, remarks=tuple(remarks))


def rates(opened: OpenRecording, told: Beside, target: Target) -> dict[str, float]:
    """The rates of faults and meshes at the speed of a recording, by name [Hz]."""
    said = opened.facts.get("speed_hz")
    speed = (
        float(told.facts["speed_hz"][0])
        if "speed_hz" in told.facts
        else None
        if said is None
        else float(said.value)
    )
    per_turn = dict(target.rates_per_turn)
    if "faults_per_turn" in opened.facts:
        per_turn |= opened.facts["faults_per_turn"].value
    if told.turning is not None:
        speed = told.turning.speed_hz  # what the vibration is steadied to
    speed = speed or target.shaft_hz
    found = {} if speed is None else {name: times * speed for name, times in per_turn.items()}
    return found | (opened.facts["faults_hz"].value if "faults_hz" in opened.facts else {})


def steady(opened: OpenRecording, told: Beside) -> tuple[Field, float] | None:
    """The vibration as if the shaft had turned evenly, and its rate; None where no channel tells the angle."""
    if told.turning is None:
        return None
    held, many = [], 0
    for block in opened.blocks():
        held.append(block)
        many += block.size
        if many >= MOST:
            break
    values = np.concatenate(held)[: told.turning.turns.size]
    if not np.isfinite(values).all():
        raise BadInput("samples are missing, so that the shaft's orders are not followed")
    return resample_to_constant_speed(values, told.turning, opened.rate_hz)


def heard_at(
    rates_hz: Mapping[str, float], values: Field, rate_hz: float, unit: str, segment: int
) -> tuple[dict[str, float], dict[str, float]]:
    """Depths of the envelope and rms of the lines at rates, of a vibration that is in memory."""
    envelope = Envelope(rate_hz)
    for _ in envelope.watch([values]):
        pass
    spectrum = averaged_spectrum([values], rate_hz, unit, segment=segment)
    return envelope.depths(rates_hz), lines(spectrum.frequency_hz, spectrum.density, rates_hz)


def lines(frequency_hz: Field, density: Field, rates_hz: Mapping[str, float]) -> dict[str, float]:
    """Rms at each rate and its next two harmonics; nan where lines are too far apart, or too few, to tell."""
    spacing = float(frequency_hz[1])
    found = {}
    for name, rate in rates_hz.items():
        total = 0.0
        for number in range(1, HARMONICS + 1):
            reach = max(NEAR * number * rate, 1.5 * spacing)
            total += float(density[np.abs(frequency_hz - number * rate) <= reach].sum())
        told = rate >= FEWEST_LINES * spacing and rate < frequency_hz[-1]
        found[name] = float(np.sqrt(total * spacing)) if told else float("nan")
    return found


def bands(opened: OpenRecording, frequency_hz: Field, density: Field) -> dict[str, float]:
    """Rms in bands: those that a sidecar states, else three; only those that the sampling reaches."""
    stated = opened.facts["bands_hz"].value if "bands_hz" in opened.facts else OWN_BANDS
    spacing, highest = float(frequency_hz[1]), USABLE * opened.rate_hz
    found = {}
    for name, (low, high) in stated.items():
        high = min(high, highest) if high == np.inf else high
        if low < high <= highest:
            inside = (frequency_hz >= low) & (frequency_hz < high)
            found[name] = float(np.sqrt(density[inside].sum() * spacing))
    return found


def _channel_in(path: Path, key: str, name: str) -> Field:
    """The values of a channel in the unit of a condition's key."""
    channel = raw_channel(path, name)
    return _values(path, name, None) * (
        _factor(channel.unit.strip(), key, path, name) if channel.unit else 1.0
    )


def _factor(unit: str, key: str, path: Path, name: str) -> float:
    """What a unit is of that of a key: as it is written, or in another case where that leaves no doubt."""
    factors = UNITS[key]
    alike = [unit] if unit in factors else [one for one in factors if one.lower() == unit.lower()]
    if len(alike) != 1:
        raise BadInput(
            f"{path.name}: channel {name} is in {unit}, and {key} takes {', '.join(factors)}"
        )
    return factors[alike[0]]


def _require_beside(opened: OpenRecording, name: str) -> None:
    """BadInput for a tacho whose samples are not those of the vibration."""
    tacho = raw_channel(opened.path, name)
    for what, its, vibrations in (
        ("Hz", tacho.rate_hz, opened.channel.rate_hz),
        ("samples", tacho.samples, opened.samples),
    ):
        if its is not None and vibrations is not None and abs(its - vibrations) > SAME * vibrations:
            raise BadInput(
                f"the tacho in channel {name} has {its:.10g} {what} and the vibration {vibrations:.10g}; record both "
                "with the same clock, or state speed_hz"
            )


def _values(path: Path, name: str, most: int | None) -> Field:
    held: list[Any] = []
    for block in raw_channel(path, name).blocks(1 << 18):
        held.append(np.asarray(block, dtype=float))
        if most is not None and sum(part.size for part in held) >= most:
            break
    return np.concatenate(held)[:most]
