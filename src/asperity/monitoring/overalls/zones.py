"""Zones of ISO 20816-3 of the velocities in a table of overall values."""

import re

import numpy as np

from asperity.core.arrays import Field
from asperity.monitoring.overalls.columns import words_of
from asperity.monitoring.overalls.table import OverallValues
from asperity.rating import severity_zone
from asperity.recording import velocity_scale

LETTERS = "ABCD"
_PEAK = re.compile(r"\b(?:0-?p\w*|pp|p-?p|pk|pk-?pk|p2p|peak|peaks|crest|max|spitze)\b")
_VELOCITY = re.compile(r"\b(?:vel|velocity|schwinggeschwindigkeit|severity)\b")


def velocity_zones(overalls: OverallValues) -> tuple[dict[str, Field], list[str]]:
    """Return the zone after each row as a number, nan if unknown, and notes on those without.

    The zones A to D are 0 to 3. Without a stated class of the machine there are none.
    """
    if overalls.machine_class is None:
        return {}, []
    zones: dict[str, Field] = {}
    notes = []
    for name, values in overalls.values.items():
        unit = overalls.units[name]
        scale = _scale(unit)
        if scale is not None and not _PEAK.search(words_of(f"{name} {unit}")):
            zones[name] = _zone_numbers(scale * values, overalls.machine_class)
        elif scale is not None:
            notes.append(
                f"{name} has no zone of ISO 20816-3, because it is a peak value; add the rms."
            )
        elif _VELOCITY.search(words_of(name)):
            reason = f"its unit {unit} is none of a velocity" if unit else "it states no unit"
            notes.append(
                f"{name} has no zone of ISO 20816-3, because {reason}; write {name} [mm/s]."
            )
    if not zones and not notes:
        notes.append("No column is an rms velocity, so that there is no zone of ISO 20816-3.")
    return zones, notes


def lasting_zone(zones: dict[str, Field], number: int, first: int) -> tuple[str, str]:
    """Return the better of the last two zones of the worst velocity, and the reason in words."""
    if number <= first:
        return "", ""
    lasting = {
        name: min(of_rows[number - 1], of_rows[number])
        for name, of_rows in zones.items()
        if np.isfinite(of_rows[number - 1]) and np.isfinite(of_rows[number])
    }
    if not lasting:
        return "", ""
    name = max(lasting, key=lambda name: lasting[name])
    letter = LETTERS[int(lasting[name])]
    return letter, f"{name} is in zone {letter} of ISO 20816-3"


def _scale(unit: str) -> float | None:
    """Return metres per second in a unit of velocity, such as mm/s rms; None for others."""
    bare = re.sub(r"(?i)[\s_-]*\b(?:rms|eff|pk-?pk|p-?p|0-?p(?:k|eak)?|pk|peak)\b\.?", "", unit)
    return velocity_scale(bare.strip())


def _zone_numbers(velocities: Field, machine_class: str) -> Field:
    """Return the zones of rms velocities [m/s], computed once for each distinct value."""
    distinct, places = np.unique(velocities, return_inverse=True)
    zones = [
        LETTERS.index(severity_zone(value, machine_class)) if np.isfinite(value) else np.nan
        for value in distinct.tolist()
    ]
    return np.array(zones, dtype=float)[places]
