"""Operating conditions of recordings, and the response of indicators to them without wear.

`asperity.trend` fits how much load, speed and oil temperature explain. This module bounds the
exponents: from the case's contact, solved, or for any contact.
"""

import json
import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from hashlib import sha256
from importlib.metadata import version
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from asperity import coupling, ehl
from asperity import solution as postprocessing
from asperity.case import Case
from asperity.core.arrays import Field
from asperity.core.errors import AsperityError, BadInput
from asperity.core.files import make_folder, user_cache, write_text
from asperity.lubricant import OilSheet
from asperity.monitoring.files import RecordingPlace
from asperity.monitoring.reading import Reading
from asperity.recording import OPERATING_KEYS
from asperity.trend import Condition

ZERO_CELSIUS = 273.15
TEMPERATURE = ("temperature_degc",)
# VG 100; viscosities of oils over temperature differ mainly by a factor
USUAL_OIL = OilSheet(viscosity_40=1e-4, viscosity_100=1.11e-5)
COLDEST, HOTTEST = -20.0, 150.0  # range of the table of viscosities [degC]
MIN_VARIATION = 0.05  # relative variation of a condition from which the contact is solved
MIN_STATED = 0.5  # share of recordings that must state a condition for it to be used
STEP = 1.3  # factor on load and speed, up and down, for the contact's response
EXPONENT_UNCERTAINTY = 0.5  # relative, up or down: the roughness differs from the case and changes
MIN_HALF_RANGE = 0.05  # least half-width of the range of an exponent


@dataclass(frozen=True, slots=True, kw_only=True)
class OperatingPoint:
    """Operating conditions of a recording; None if not stated.

    `load_n` of the contact [N], `speed_hz` of the shaft, `entrainment_m_s`, `temperature_degc` of
    the oil.
    """

    load_n: float | None = None
    entrainment_m_s: float | None = None
    temperature_degc: float | None = None
    speed_hz: float | None = None


def operating_point(reading: Reading, place: RecordingPlace | None) -> OperatingPoint:
    """Return the conditions from the table, or else from a sidecar or channel."""
    values: dict[str, float | None] = {}
    for key in OPERATING_KEYS:
        fact = reading.facts.get(key)
        value = None if place is None else getattr(place, key)
        values[key] = float(fact[0]) if value is None and fact is not None else value
    return OperatingPoint(**values)


class ResponseExponents(NamedTuple):
    """Least and greatest exponents of an indicator on load, speed and viscosity."""

    load: tuple[float, float]
    speed: tuple[float, float]
    viscosity: tuple[float, float]


# CRF ∝ (CLR F)^(1/6): CLR rises at most in proportion to the load, and falls with film
CRF = ResponseExponents(load=(0.0, 1.0 / 3.0), speed=(-1.0 / 3.0, 0.0), viscosity=(-1.0 / 3.0, 0.0))
DAMPING = ResponseExponents(load=(-1.0, 1.0), speed=(-1.0, 1.0), viscosity=(-1.0, 1.0))
# a fault often warms the oil: temperature may explain little of a level, and nothing of pulses
LEVEL = ResponseExponents(load=(-1.0, 2.0), speed=(-1.0, 4.0), viscosity=(-0.3, 0.3))
PULSES = ResponseExponents(load=(-1.0, 2.0), speed=(-1.0, 4.0), viscosity=(0.0, 0.0))


class Response(NamedTuple):
    """Exponents of CRF on operating conditions, and the oil of the viscosity.

    `note` states their source, empty if the conditions do not vary.
    """

    crf: ResponseExponents
    oil: OilSheet
    note: str = ""


ANY_CONTACT = Response(CRF, USUAL_OIL)


def conditions_of(
    points: Sequence[OperatingPoint], exponents: ResponseExponents, oil: OilSheet
) -> tuple[Condition, ...]:
    """Return the conditions that an indicator may respond to: those that most recordings state."""
    conditions: list[Condition] = []
    for name, unit, limits, read in (
        ("load", "N", exponents.load, attrgetter("load_n")),
        ("speed", "m/s", exponents.speed, attrgetter("entrainment_m_s")),
        ("speed", "Hz", exponents.speed, attrgetter("speed_hz")),
    ):
        if name in {condition.name for condition in conditions}:
            continue
        series = _series_if_stated(points, read)
        if series is not None and (series[np.isfinite(series)] > 0.0).all():
            conditions.append(
                Condition(
                    name=name,
                    values=np.log(series),
                    low=limits[0],
                    high=limits[1],
                    shown=series,
                    unit=unit,
                )
            )
    series = _series_if_stated(points, attrgetter("temperature_degc"))
    if series is not None and exponents.viscosity != (0.0, 0.0):
        degrees, logarithms = _viscosities(oil)
        values = np.interp(series, degrees, logarithms)
        low, high = exponents.viscosity
        conditions.append(
            Condition(
                name="oil temperature", values=values, low=low, high=high, shown=series, unit="degC"
            )
        )
    return tuple(conditions)


def _series_if_stated(
    points: Sequence[OperatingPoint], read: Callable[[OperatingPoint], float | None]
) -> Field | None:
    """Return a condition of all recordings, nan if not stated; None if most do not state it."""
    values = np.array([math.nan if (value := read(point)) is None else value for point in points])
    return values if values.size and np.isfinite(values).mean() > MIN_STATED else None


def unstated(points: Sequence[OperatingPoint]) -> list[str]:
    """Return a sentence on each condition that only some recordings state."""
    notes = []
    conditions = (
        ("load", ("load_n",)),
        ("speed", ("entrainment_m_s", "speed_hz")),
        ("oil temperature", TEMPERATURE),
    )
    for name, keys in conditions:
        missing = min(sum(getattr(point, key) is None for point in points) for key in keys)
        if 0 < missing < len(points):
            used = any(_series_if_stated(points, attrgetter(key)) is not None for key in keys)
            consequence = "these are excluded from trend and alarm" if used else "it is not used"
            notes.append(
                f"The {name} is not stated for {missing} of {len(points)} recordings; "
                f"{consequence}."
            )
    return notes


@lru_cache(maxsize=8)
def _viscosities(sheet: OilSheet) -> tuple[Field, Field]:
    """Return the logarithm of an oil's viscosity over temperature [degC]."""
    points = []
    for degree in np.linspace(COLDEST, HOTTEST, 35):
        with suppress(BadInput):  # outside the range of the data sheet
            points.append((degree, math.log(sheet.viscosity(degree + ZERO_CELSIUS))))
    degrees, logarithms = np.array(points).T
    return degrees, logarithms


def operating_response(case: Case | None, points: Sequence[OperatingPoint]) -> Response:
    """Return the response of CRF to conditions, of the case's contact or of any contact."""
    if case is None:
        return ANY_CONTACT
    changed = any(
        series is not None
        and np.nanmax(series) - np.nanmin(series) > MIN_VARIATION * np.nanmax(np.abs(series))
        for series in (_series_if_stated(points, attrgetter(key)) for key in OPERATING_KEYS)
    )
    oil = case.oil_sheet or USUAL_OIL
    if not changed:
        return Response(CRF, oil)
    try:
        exponents = contact_exponents(case)
    except AsperityError as refusal:
        reason = str(refusal).rstrip(".")
        return Response(
            CRF,
            oil,
            (
                "The response of CRF to load and speed is that of any contact, because the case's "
                f"contact could not be solved: {reason}."
            ),
        )
    load, speed = exponents.load, exponents.speed
    return Response(
        exponents,
        oil,
        f"The contact of {case.source} gives CRF an exponent of {load[0]:.2g} to {load[1]:.2g} on "
        f"load and of {speed[0]:.2g} to {speed[1]:.2g} on speed and viscosity.",
    )


def contact_exponents(case: Case) -> ResponseExponents:
    """Compute the exponents of CRF by solving the case's contact at other loads and speeds.

    Speed and viscosity act by their product. Results are kept in the user's cache.

    Raises
    ------
    AsperityError
        if a contact cannot be solved, or has no resonance.
    """
    digest = sha256(f"{version('asperity')}\n{case.text}".encode()).hexdigest()[:32]
    cached = user_cache() / "follows" / f"{digest}.json"
    with suppress(OSError, ValueError, TypeError):
        return _with_uncertainty(*json.loads(cached.read_text()))
    conditions = case.conditions
    exponents = []
    for key, value, unit in (
        ("contact.load", conditions.load, "N"),
        ("contact.entrainment_speed", conditions.entrainment_speed, "m/s"),
    ):
        frequencies = [
            _resonance(case.with_written({key: f"{value * by:.10g} {unit}"}))
            for by in (1.0 / STEP, STEP)
        ]
        exponents.append(math.log(frequencies[1] / frequencies[0]) / (2.0 * math.log(STEP)))
    with suppress(AsperityError):
        make_folder(cached.parent)
        write_text(cached, json.dumps(exponents))
    return _with_uncertainty(*exponents)


def _with_uncertainty(load: float, film: float) -> ResponseExponents:
    """Return the ranges of the contact's exponents."""
    of_load, of_film = (
        (exponent - half_range, exponent + half_range)
        for exponent in (load, film)
        for half_range in [max(EXPONENT_UNCERTAINTY * abs(exponent), MIN_HALF_RANGE)]
    )
    return ResponseExponents(load=of_load, speed=of_film, viscosity=of_film)


def _resonance(case: Case) -> float:
    assert case.vibration is not None  # required by the target
    solution = ehl.solve_contact(
        case.conditions, case.lubricant, case.surface(), options=case.options
    )
    state = postprocessing.contact_state(solution)
    return coupling.oscillator(
        state, case.conditions, case.vibration, solution=solution
    ).natural_frequency_hz
