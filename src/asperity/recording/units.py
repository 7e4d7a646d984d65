"""Units as written in files, and names under which files state rate, unit or step.

A table on purpose: to a general unit library, "g" is a gram.
"""

import re
from collections.abc import Iterable

STANDARD_GRAVITY = 9.80665  # m/s^2, exact: 3rd General Conference on Weights and Measures (1901)

_ACCELERATIONS = {
    "m/s^2": 1.0,
    "mm/s^2": 1e-3,
    "cm/s^2": 1e-2,
    "um/s^2": 1e-6,
    "km/s^2": 1e3,
    "in/s^2": 0.0254,
    "ft/s^2": 0.3048,
    "gal": 1e-2,
    "g": STANDARD_GRAVITY,
    "gn": STANDARD_GRAVITY,
    "g0": STANDARD_GRAVITY,
    "g_n": STANDARD_GRAVITY,
    "grms": STANDARD_GRAVITY,
    "mg": 1e-3 * STANDARD_GRAVITY,
    "ug": 1e-6 * STANDARD_GRAVITY,
    "kg": None,  # a mass
}
_VELOCITIES = {
    "m/s": 1.0,
    "cm/s": 1e-2,
    "mm/s": 1e-3,
    "um/s": 1e-6,
    "in/s": 0.0254,
    "ft/s": 0.3048,
    "ips": 0.0254,
}
_VOLTAGES = {
    "v": 1.0,
    "volt": 1.0,
    "volts": 1.0,
    "mv": 1e-3,
    "millivolt": 1e-3,
    "millivolts": 1e-3,
    "uv": 1e-6,
}
_TIMES = {
    "s": 1.0,
    "sec": 1.0,
    "second": 1.0,
    "seconds": 1.0,
    "secs": 1.0,
    "ms": 1e-3,
    "msec": 1e-3,
    "milliseconds": 1e-3,
    "us": 1e-6,
    "usec": 1e-6,
    "ns": 1e-9,
    "min": 60.0,
    "minutes": 60.0,
    "h": 3600.0,
}
_OTHERS = {
    "pa",
    "n",
    "kn",
    "mm",
    "um",
    "°c",
    "degc",
    "rpm",
    "hz",
    "db",
    "a",
    "q",
    "nm",
    "bar",
    "kpa",
    "mpa",
    "lbs",
    "gf",
    "%",
}

_PER_SECOND_SQUARED = re.compile(
    r"^([kcmu]?m|in|ft)(?:\s*[*·.]?\s*s(?:ec)?\^?-2|/s(?:ec)?\^?2|/s/s|/\(s\^?2\)|/sec/sec)$"
)
_PER_SECOND = re.compile(
    r"^([cmu]?m|in|ft)(?:ch)?\s*(?:[*·.]?\s*s(?:ec)?\^?-1|/\s*s(?:ec)?)(?:[\s_-]*rms)?$"
)

RATE_NAMES = {
    "fs",
    "fs_hz",
    "sr",
    "sr_hz",
    "rate_hz",
    "sample_rate",
    "sample_rate_hz",
    "sampling_rate",
    "sampling_rate_hz",
    "samplerate",
    "samplingrate",
    "sampling_frequency",
    "sampling_frequency_hz",
    "sample_frequency",
    "samplingfrequency",
    "samplefrequency",
    "abtastrate",
    "abtastfrequenz",
    "messrate",
    "abtastrate_hz",
    "abtastfrequenz_hz",
}
STEP_NAMES = {
    "dt",
    "dt_s",
    "wf_increment",
    "sample_interval",
    "sampling_interval",
    "delta_t",
    "sample_period",
    "delta_x",
    "abtastintervall",
    "abtastzeit",
}
UNIT_NAMES = {"unit", "units", "unit_string", "engineering_units", "y_unit", "y_units", "unitname"}
START_NAMES = {
    "started",
    "start",
    "start_time",
    "wf_start_time",
    "started_at",
    "start_datetime",
    "recorded",
    "date",
}


def acceleration_scale(unit: str) -> float | None:
    """Return metres per second squared in one `unit`; None for other units."""
    return _ACCELERATIONS.get(_plain(unit))


def velocity_scale(unit: str) -> float | None:
    """Return metres per second in one `unit`; None for other units."""
    return _VELOCITIES.get(_PER_SECOND.sub(r"\1/s", _plain(unit)))


def voltage_scale(unit: str) -> float | None:
    """Return volts in one `unit`; None for other units."""
    return _VOLTAGES.get(_plain(unit))


def time_scale(unit: str) -> float | None:
    """Return seconds in one `unit`; None for other units."""
    return _TIMES.get(_plain(unit))


def known_unit(text: str) -> bool:
    """Return whether the text is a unit, as opposed to the end of a name."""
    return bool(text) and (
        velocity_scale(text) is not None
        or any(_plain(text) in units for units in (_ACCELERATIONS, _VOLTAGES, _TIMES, _OTHERS))
    )


def _plain(unit: str) -> str:
    """Return one spelling for m/s², m/s2, m/s**2, m·s⁻², m s-2, (m/s^2), G."""
    text = unit.strip().strip("()[]{}").strip().lower()
    text = (
        text.replace("²", "^2")
        .replace("**", "^")
        .replace("µ", "u")
        .replace("μ", "u")
        .replace("⁻^2", "-2")
        .replace("⁻¹", "-1")
    )
    return _PER_SECOND_SQUARED.sub(r"\1/s^2", text)


def name_and_unit(label: str) -> tuple[str, str | None]:
    """Return name and unit of a column's label (acc [g], Time (ms), acc_g); None for no unit."""
    label = label.strip().strip('"').strip()
    bracketed = re.fullmatch(r"(.*?)\s*[\[(]\s*([^\])]*)\s*[\])]", label)
    if bracketed and known_unit(bracketed[2]):
        return bracketed[1].strip() or label, bracketed[2].strip()
    name, separator, ending = label.rpartition("_")
    if separator and name and known_unit(ending):
        return name, ending
    return label, None


def stated(attributes: Iterable[tuple[str, object]], names: set[str]) -> list[tuple[str, object]]:
    """Return the attributes whose name is one of `names`, ignoring case and blanks."""
    return [
        (key, value)
        for key, value in attributes
        if re.sub(r"[\s-]+", "_", str(key).strip().lower()) in names
    ]
