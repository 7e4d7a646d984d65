"""What recordings were made at, and how an indicator may follow it without any wear: load, speed, oil temperature.

How much a condition explains of a series is learned by `asperity.wear`; which way and how far it
can, is said here: by the case's contact, solved, or by what any contact can do.
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
from asperity.monitoring.files import Place
from asperity.monitoring.reading import Reading
from asperity.recording import OPERATING_KEYS
from asperity.trend import Condition

ZERO_CELSIUS = 273.15
TEMPERATURE = ("temperature_degc",)
USUAL_OIL = OilSheet(
    viscosity_40=1e-4, viscosity_100=1.11e-5
)  # VG 100; over temperature oils differ by little but a factor
COLDEST, HOTTEST = -20.0, 150.0  # degC, of the table of viscosities
WORTH_SOLVING = 0.05  # of a condition: how it must differ for the case's contact to be solved
MOSTLY = 0.5  # of the recordings, for which a condition must be known to be used
STEP = 1.3  # of load and speed, either way, by which the contact's answer is found
DOUBT = 0.5  # of that answer, either way: roughness is not the case's, and changes
LEAST_SPAN = 0.05  # of a coefficient, below which it is not known


@dataclass(frozen=True, slots=True, kw_only=True)
class Operating:
    """What a recording was made at; None for what nobody states.

    `load_n` of the contact [N], `speed_hz` of the shaft, `entrainment_m_s`, `temperature_degc` of
    the oil.
    """

    load_n: float | None = None
    entrainment_m_s: float | None = None
    temperature_degc: float | None = None
    speed_hz: float | None = None


def operating_of(reading: Reading, place: Place | None) -> Operating:
    """As the table says, or else a sidecar, or a channel of the recording."""
    said: dict[str, float | None] = {}
    for key in OPERATING_KEYS:
        beside = reading.facts.get(key)
        stated = None if place is None else getattr(place, key)
        said[key] = float(beside[0]) if stated is None and beside is not None else stated
    return Operating(**said)


class Follows(NamedTuple):
    """By which powers an indicator may follow load, speed and viscosity: the least and the most of each."""

    load: tuple[float, float]
    speed: tuple[float, float]
    viscosity: tuple[float, float]


# CRF goes with (CLR F)^(1/6): a load share may rise with the load, as fast at most, and falls as
# the film grows
CRF = Follows(load=(0.0, 1.0 / 3.0), speed=(-1.0 / 3.0, 0.0), viscosity=(-1.0 / 3.0, 0.0))
DAMPING = Follows(load=(-1.0, 1.0), speed=(-1.0, 1.0), viscosity=(-1.0, 1.0))
# warm oil is often what a fault does, so that it explains little of a level, and nothing of what no
# oil makes
LEVEL = Follows(load=(-1.0, 2.0), speed=(-1.0, 4.0), viscosity=(-0.3, 0.3))
PULSES = Follows(load=(-1.0, 2.0), speed=(-1.0, 4.0), viscosity=(0.0, 0.0))


class Response(NamedTuple):
    """How CRF follows what a recording was made at, and which oil's viscosity goes with the temperature.

    `said` is a sentence on whose word that is, empty where it has not mattered.
    """

    crf: Follows
    oil: OilSheet
    said: str = ""


ANY_CONTACT = Response(CRF, USUAL_OIL)


def conditions_of(
    met: Sequence[Operating], follows: Follows, oil: OilSheet
) -> tuple[Condition, ...]:
    """What an indicator of recordings may follow: conditions that most of them state."""
    found: list[Condition] = []
    for name, unit, powers, read in (
        ("load", "N", follows.load, attrgetter("load_n")),
        ("speed", "m/s", follows.speed, attrgetter("entrainment_m_s")),
        ("speed", "Hz", follows.speed, attrgetter("speed_hz")),
    ):
        if name in {one.name for one in found}:
            continue
        shown = _known(met, read)
        if shown is not None and (shown[np.isfinite(shown)] > 0.0).all():
            found.append(
                Condition(
                    name=name,
                    values=np.log(shown),
                    low=powers[0],
                    high=powers[1],
                    shown=shown,
                    unit=unit,
                )
            )
    shown = _known(met, attrgetter("temperature_degc"))
    if shown is not None and follows.viscosity != (0.0, 0.0):
        degrees, logarithms = _viscosities(oil)
        values = np.interp(shown, degrees, logarithms)
        low, high = follows.viscosity
        found.append(
            Condition(
                name="oil temperature", values=values, low=low, high=high, shown=shown, unit="degC"
            )
        )
    return tuple(found)


def _known(met: Sequence[Operating], read: Callable[[Operating], float | None]) -> Field | None:
    """A condition of all recordings, nan where it is not stated; None where most do not state it."""
    values = np.array([math.nan if (value := read(one)) is None else value for one in met])
    return values if values.size and np.isfinite(values).mean() > MOSTLY else None


def unstated(met: Sequence[Operating]) -> list[str]:
    """A sentence on each condition that some recordings state and some do not."""
    notes = []
    known_by = (
        ("load", ("load_n",)),
        ("speed", ("entrainment_m_s", "speed_hz")),
        ("oil temperature", TEMPERATURE),
    )
    for words, keys in known_by:
        missing = min(sum(getattr(one, key) is None for one in met) for key in keys)
        if 0 < missing < len(met):
            used = any(_known(met, attrgetter(key)) is not None for key in keys)
            done = (
                "these are left out of trend and alarm" if used else "it is not taken into account"
            )
            notes.append(
                f"The {words} is not stated for {missing} of {len(met)} recordings; {done}."
            )
    return notes


@lru_cache(maxsize=8)
def _viscosities(sheet: OilSheet) -> tuple[Field, Field]:
    """Logarithm of an oil's viscosity over temperature [degC]."""
    known = []
    for degree in np.linspace(COLDEST, HOTTEST, 35):
        with suppress(BadInput):  # beyond where the data sheet tells it
            known.append((degree, math.log(sheet.viscosity(degree + ZERO_CELSIUS))))
    degrees, logarithms = np.array(known).T
    return degrees, logarithms


def response_of(case: Case | None, met: Sequence[Operating]) -> Response:
    """How CRF may follow what recordings were made at: as the case's contact does, solved, else as any contact may."""
    if case is None:
        return ANY_CONTACT
    changed = any(
        shown is not None
        and np.nanmax(shown) - np.nanmin(shown) > WORTH_SOLVING * np.nanmax(np.abs(shown))
        for shown in (_known(met, attrgetter(key)) for key in OPERATING_KEYS)
    )
    oil = case.oil_sheet or USUAL_OIL
    if not changed:
        return Response(CRF, oil)
    try:
        follows = contact_follows(case)
    except AsperityError as refusal:
        reason = str(refusal).rstrip(".")
        return Response(
            CRF,
            oil,
            f"How CRF follows load and speed is any contact's, as the case's is not solved: {reason}.",
        )
    (low, high), (thin, thick) = follows.load, follows.speed
    return Response(
        follows,
        oil,
        f"By the contact of {case.source}, solved, CRF follows the load by its power of {low:.2g} to {high:.2g}, speed "
        f"and viscosity by {thin:.2g} to {thick:.2g}.",
    )


def contact_follows(case: Case) -> Follows:
    """By which powers CRF follows load, speed and viscosity: of the case's contact, solved at others about its own.

    Speed and viscosity count alike, by their product. What was found is kept in the user's cache.

    Raises
    ------
    AsperityError
        where a contact could not be solved, or has no resonance.
    """
    mark = sha256(f"{version('asperity')}\n{case.text}".encode()).hexdigest()[:32]
    kept = user_cache() / "follows" / f"{mark}.json"
    with suppress(OSError, ValueError, TypeError):
        return _about(*json.loads(kept.read_text()))
    stated = case.conditions
    powers = []
    for key, value, unit in (
        ("contact.load", stated.load, "N"),
        ("contact.entrainment_speed", stated.entrainment_speed, "m/s"),
    ):
        ends = [
            _resonance(case.with_overrides({key: f"{value * by:.10g} {unit}"}))
            for by in (1.0 / STEP, STEP)
        ]
        powers.append(math.log(ends[1] / ends[0]) / (2.0 * math.log(STEP)))
    with suppress(AsperityError):
        make_folder(kept.parent)
        write_text(kept, json.dumps(powers))
    return _about(*powers)


def _about(load: float, film: float) -> Follows:
    """The contact's powers, with the doubt about them."""
    spans = [max(DOUBT * abs(power), LEAST_SPAN) for power in (load, film)]
    loaded, filmed = (
        (power - span, power + span) for power, span in zip((load, film), spans, strict=True)
    )
    return Follows(load=loaded, speed=filmed, viscosity=filmed)


def _resonance(case: Case) -> float:
    assert case.vibration is not None  # asked by the target
    solution = ehl.solve_contact(
        case.conditions, case.lubricant, case.surface(), options=case.options
    )
    state = postprocessing.contact_state(solution)
    return coupling.oscillator(
        state, case.conditions, case.vibration, solution=solution
    ).natural_frequency_hz
