"""Ratings of gears: mesh friction, temperatures, specific film, micropitting, scuffing."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

from asperity import rating
from asperity.case import Case, MachineCase, SheetSection
from asperity.core.errors import BadInput
from asperity.lubricant import ESTIMATORS, OilSheet, Solid
from asperity.machine import MachineContact, SpurGear
from asperity.machines.rating_facts import Rating, machine_rating, missing_ratings, rated_case

PITCH_LINE_SPEEDS = 2.0, 80.0  # m/s, scope of the standards for gears
WORKING_ANGLES = 15.0, 25.0  # deg, of the normal working pressure angle, their scope
HELIX_ANGLE = 30.0  # deg, up to which the standards are validated
WARMER = 3.0  # K of the teeth above the oil from which on a note is given
# micropitting test C-GF/8.3/90 (FVA 54): gears, oil, roughness, and pinion torques by load stage
TEST_GEARS = {
    "kind": "spur-gear",
    "module": "4.5 mm",
    "teeth": [16, 24],
    "profile_shift": [0.1817, 0.1715],
    "centre_distance": "91.5 mm",
    "tip_diameters": ["82.46 mm", "118.36 mm"],
    "face_width": "14 mm",
    "speed": "2170 r/min",
}
TEST_TEMPERATURE, TEST_ROUGHNESS = "90 degC", "0.5 um"
MICROPITTING_TORQUES = {5: 70.0, 6: 98.9, 7: 132.5, 8: 171.6, 9: 215.6, 10: 265.1}  # [N m]
TEST_TO_PERMISSIBLE = 1.4  # λ_GFP over the test's λ_GF
SLOW_HEAT = 1.0  # Peclet number u a/2κ below which Blok's flash is more than 6 % too high

GEAR_KEYS = ("mesh_friction", "rated_bulk_k", "rated_flash_k", "rated_film")


def gear_ratings(case: MachineCase, gears: SpurGear, stated: Case) -> tuple[Rating, ...]:
    """Return the ratings of a gear pair."""
    section, inputs = stated.contents.lubricant, case.rating
    if not isinstance(section, SheetSection):
        return missing_ratings(GEAR_KEYS, "the oil is given by laws, not by a data sheet")
    if "C" not in gears.path:
        return missing_ratings(GEAR_KEYS, "the teeth do not meet at the pitch point")
    try:
        oil = _gear_oil(section.sheet)
    except BadInput as refusal:
        return missing_ratings(GEAR_KEYS, str(refusal))
    roughness = _mean_ra(stated) if inputs.roughness_ra is None else float(inputs.roughness_ra)
    if roughness == 0.0:
        return missing_ratings(GEAR_KEYS, "the flanks are smooth")
    ratings = _mesh_ratings(
        case, gears, stated.thermal.solids, (oil, float(section.temperature)), roughness
    )
    gear_scope = _outside_scope(gears)
    return tuple(
        replace(entry, beyond="; ".join(filter(None, (gear_scope, entry.beyond))))
        for entry in ratings
    )


def _mesh_ratings(
    case: MachineCase,
    gears: SpurGear,
    solids: tuple[Solid, Solid],
    oil_supply: tuple[rating.GearOil, float],
    roughness: float,
) -> tuple[Rating, ...]:
    """Return friction, temperatures and film of the mesh, with an oil at its supply temperature."""
    oil, supply = oil_supply
    friction = _mesh_friction(gears, oil, supply, roughness)
    bulk = _bulk(case, gears, friction, supply)
    mesh = rating.Mesh(
        roughness, case.pair.effective_modulus, (solids[0].effusivity, solids[1].effusivity)
    )
    points = {contact.name: _mesh_point(case, gears, contact) for contact in case.contacts}
    films = {
        name: rating.specific_film(point, mesh, oil, friction, bulk)
        for name, point in points.items()
    }
    rises = {name: rise for name, (_, rise) in films.items()}
    film = {name: value for name, (value, _) in films.items()}
    too_hot = "the flash heats the oil above 510 degC, the limit of the estimate of α"
    return (
        machine_rating("mesh_friction", friction),
        machine_rating("rated_bulk_k", bulk),
        Rating("rated_flash_k", rises, beyond=_heat_scope(points.values(), solids[0])),
        Rating("rated_film", film, too_hot if None in film.values() else ""),
        *_limits(case, film, bulk + max(rises.values()), oil, supply),
    )


def _mesh_friction(gears: SpurGear, oil: rating.GearOil, supply: float, roughness: float) -> float:
    pitch = gears.contact("C", gears.path["C"])
    assert not isinstance(pitch.radius, tuple)
    load_factor = rating.helical_load_factor(gears.contact_ratio + gears.overlap_ratio)
    return rating.mesh_friction(
        load_factor * gears.normal_force / gears.face_width,
        pitch.radius,
        sum(pitch.surface_speeds),
        roughness,
        oil.viscosity(supply),
        oil.factor,
    )


def _heat_scope(points: Iterable[rating.MeshPoint], solid: Solid) -> str:
    """Return the smallest Peclet number if Blok's flash temperature does not hold there, or ""."""
    peclet = min(
        min(point.speeds) * point.half_width / (2.0 * solid.diffusivity) for point in points
    )
    return "" if peclet >= SLOW_HEAT else f"a Peclet number of {peclet:.2g} (1 or more)"


def _mesh_point(case: MachineCase, gears: SpurGear, contact: MachineContact) -> rating.MeshPoint:
    line_load = gears.rated_line_load(contact.position)
    assert contact.length is not None
    assert not isinstance(contact.radius, tuple)
    hertz = replace(contact, load=line_load * contact.length).hertz(case.pair)
    return rating.MeshPoint(
        contact.radius, hertz.p_max, line_load, hertz.half_widths[0], contact.surface_speeds
    )


def _outside_scope(gears: SpurGear) -> str:
    """Return the properties of the gears outside the scope of the standards, or ""."""
    helix, outside = gears.base_helix_angle, []
    working = math.degrees(math.asin(math.sin(gears.working_angle) * math.cos(helix)))
    pitch_line = gears.speed * gears.base_radii[0] / math.cos(gears.working_angle)
    low, high = PITCH_LINE_SPEEDS
    if not low <= pitch_line <= high:
        outside.append(f"a pitch-line speed of {pitch_line:.3g} m/s ({low:g} to {high:g})")
    low, high = WORKING_ANGLES
    if not low <= working <= high:
        outside.append(f"a working pressure angle of {working:.3g} deg ({low:g} to {high:g})")
    reference = math.degrees(math.asin(math.sin(helix) / math.cos(gears.pressure_angle)))
    if reference > HELIX_ANGLE:
        outside.append(f"a helix angle of {reference:.3g} deg ({HELIX_ANGLE:g} at most)")
    return ", ".join(outside)


def _limits(
    case: MachineCase,
    film: Mapping[str, float | None],
    hottest: float,
    oil: rating.GearOil,
    supply: float,
) -> tuple[Rating, ...]:
    """Return the safety against micropitting and the margin to scuffing, if limits are given."""
    inputs = case.rating
    permissible, *derived = _permissible_film(case)
    missing = "[rating] has no permissible_film and no micropitting_stage, from a test of the oil"
    safety = machine_rating("micropitting_safety", None, missing)
    films = [value for value in film.values() if value is not None]
    if permissible is not None and len(films) < len(film):
        safety = machine_rating(
            "micropitting_safety", None, "the specific film is not known along the whole path"
        )
    elif permissible is not None:
        safety = machine_rating("micropitting_safety", min(films) / permissible)
    missing = "[rating] has no scuffing_stage, from an FZG test of the oil"
    margin = (
        machine_rating("scuffing_limit_k", None, missing),
        machine_rating("scuffing_margin_k", None, missing),
    )
    if inputs.scuffing_stage is not None:
        factor = oil.factor * (1e3 * oil.viscosity(supply)) ** -0.05
        limit = rating.scuffing_temperature(float(inputs.scuffing_stage), factor) + 273.15
        margin = (
            machine_rating("scuffing_limit_k", limit),
            machine_rating("scuffing_margin_k", limit - hottest),
        )
    return *derived, safety, *margin


def _permissible_film(case: MachineCase) -> tuple[float | None, *tuple[Rating, ...]]:
    """Return the permissible specific film: stated, or from the failure stage of a test."""
    inputs = case.rating
    if inputs.micropitting_stage is None:
        permissible = inputs.permissible_film
        return (None if permissible is None else float(permissible),)
    torque = MICROPITTING_TORQUES[int(inputs.micropitting_stage)]
    test = case.with_written(
        {
            "machine": {**TEST_GEARS, "torque": f"{torque} N m"},
            "lubricant.temperature": TEST_TEMPERATURE,
            "rating": {"roughness_ra": TEST_ROUGHNESS},
        }
    )
    stated = rated_case(test)
    assert stated is not None  # like the case
    assert isinstance(test.machine, SpurGear)
    ratings = gear_ratings(test, test.machine, stated)
    rated = next(entry for entry in ratings if entry.key == "rated_film")
    films = [value for value in rated.values.values() if value is not None]
    limit = TEST_TO_PERMISSIBLE * min(films)
    return limit, machine_rating("permissible_film", limit)


def _mean_ra(stated: Case) -> float:
    """Return the mean Ra [m] of Gaussian flanks, from each Sq or half the composite variance."""
    bodies = stated.composite()
    if bodies is None:
        return stated.surface().sq / math.sqrt(math.pi)
    return math.sqrt(2.0 / math.pi) * (bodies.first.sq + bodies.second.sq) / 2.0


def _bulk(case: MachineCase, gears: SpurGear, friction: float, supply: float) -> float:
    """Return the bulk temperature of the teeth [K]: as given, or from their losses."""
    inputs = case.rating
    if inputs.bulk_temperature is not None:
        return float(inputs.bulk_temperature)
    path, pitch = gears.path, gears.base_pitch
    parts = (path["E"] - path["C"]) / pitch, (path["C"] - path["A"]) / pitch
    loss = (
        gears.torque
        * gears.speed
        * friction
        * rating.loss_factor(parts, gears.contact_ratio, gears.teeth, gears.base_helix_angle)
    )
    return rating.bulk_temperature(
        supply, loss, gears.centres, gears.face_width, spray=inputs.oil_supply == "spray"
    )


def _gear_oil(sheet: OilSheet) -> rating.GearOil:
    """Return the oil of a gear rating, valid above 150 °C for the duration of a flash.

    The standard's α uses the oil at 38 °C and no viscosity of the hot oil.
    """
    return rating.GearOil(
        lambda kelvin: sheet.walther(kelvin) * sheet.density(kelvin),
        partial(ESTIMATORS["iso"].law, sheet),
        sheet.base,
    )


def warmer_teeth(case: MachineCase, ratings: Sequence[Rating]) -> Iterator[str]:
    """Note that gear contacts are solved at supply temperature although the teeth are warmer."""
    bulk = next((entry.machine_value for entry in ratings if entry.key == "rated_bulk_k"), None)
    moving = [contact for contact in case.contacts if not contact.stands_still]
    section = case.case(moving[0]).contents.lubricant if bulk is not None else None
    if (
        bulk is None
        or not isinstance(section, SheetSection)
        or bulk - float(section.temperature) < WARMER
    ):
        return
    supply, sheet = float(section.temperature), section.sheet
    share = sheet.walther(bulk) * sheet.density(bulk) / sheet.viscosity(supply)
    yield (
        f"The contacts are solved at the oil's supply temperature of {supply - 273.15:.3g} degC; "
        f"at the teeth's rated bulk temperature of {bulk - 273.15:.3g} degC it has {share:.2f} of "
        "that viscosity, and films are thinner. To solve at that temperature, set it as "
        "lubricant.temperature and rating.bulk_temperature."
    )
