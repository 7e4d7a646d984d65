"""Ratings of a machine by standards, and the Dang Van criterion below a solved contact.

A rating uses the machine, the oil and, if its standard requires it, a roughness number, but no
solved quantity, so that roughness is not counted twice. The Dang Van criterion uses the stresses
of a solved contact and no roughness number.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from asperity import rating
from asperity.case import Case, MachineCase, SheetSection
from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.lubricant import ESTIMATORS, OilSheet, Solid
from asperity.machine import BallBearing, CylindricalRollerBearing, MachineContact, SpurGear
from asperity.machines.rating_facts import FACTS
from asperity.results import Run
from asperity.solution import SubsurfaceStress, stress_below

MILLION = 1e6
PITCH_LINE_SPEEDS = 2.0, 80.0  # m/s, scope of the standards for gears
WORKING_ANGLES = 15.0, 25.0  # deg, of the working pressure angle, their scope
WARMER = 3.0  # K of the teeth above the oil from which on a note is given
SLOW_HEAT = 1.0  # Peclet number u a/2κ below which Blok's flash is more than 6 % too high


@dataclass(frozen=True)
class Rating:
    """A rating: its quantity key, and its values by contact; "" is the whole machine.

    `reason` states why values are missing, `beyond` what lies outside the scope of the standard.
    """

    key: str
    values: Mapping[str, float | None]
    reason: str = ""
    beyond: str = ""

    @property
    def standard(self) -> str:
        """Standard that defines the rating."""
        return FACTS[self.key].standard

    @property
    def formula(self) -> str:
        """Formula of the rating."""
        return FACTS[self.key].formula

    @property
    def validity(self) -> str:
        """Scope of the rating, and simplifications made here."""
        return FACTS[self.key].validity

    @property
    def machine_value(self) -> float | None:
        """Value of the whole machine; None if it is by contact or missing."""
        return self.values.get("")

    def to_dict(self) -> dict[str, object]:
        """Return the JSON output of the rating."""
        value: dict[str, object] = (
            {"value": self.machine_value}
            if set(self.values) <= {""}
            else {"values": dict(self.values)}
        )
        facts = {"standard": self.standard, "formula": self.formula, "validity": self.validity}
        return {"key": self.key, **value, **facts, "reason": self.reason, "beyond": self.beyond}


def machine_ratings(case: MachineCase) -> tuple[Rating, ...]:
    """Return the ratings of a bearing or gear pair; none for other machines or without oil."""
    moving = [contact for contact in case.contacts if not contact.stands_still]
    if not case.complete or not moving:
        return ()
    stated = case.case(moving[0])
    if stated.lubricant is None:
        return ()
    if isinstance(case.machine, SpurGear):
        return _gear_ratings(case, case.machine, stated)
    if isinstance(case.machine, CylindricalRollerBearing | BallBearing):
        return _bearing_ratings(case, case.machine, stated)
    return ()


def _missing(keys: Sequence[str], reason: str) -> tuple[Rating, ...]:
    return tuple(_machine_rating(key, None, reason) for key in keys)


def _machine_rating(key: str, value: float | None, reason: str = "") -> Rating:
    return Rating(key, {"": value}, reason if value is None else "")


# Bearings
# ----------------------------------------------------------------------


def _bearing_ratings(
    case: MachineCase, bearing: CylindricalRollerBearing | BallBearing, stated: Case
) -> tuple[Rating, ...]:
    oil, capacity = stated.lubricant, case.rating.dynamic_load_rating
    assert oil is not None
    reference = rating.reference_viscosity(bearing.speed, bearing.pitch_diameter)
    kappa = oil.viscosity.eta0 / oil.density.rho0 / reference
    if capacity is None:
        keys = "reference_life", "life_factor", "modified_life_s"
        lives = _missing(keys, "[rating] has no dynamic_load_rating")
    else:
        lives = _bearing_lives(case, bearing, float(capacity), kappa)
    return (
        _machine_rating("reference_viscosity_m2_s", reference),
        _machine_rating("viscosity_ratio", kappa),
        *lives,
    )


def _bearing_lives(
    case: MachineCase,
    bearing: CylindricalRollerBearing | BallBearing,
    capacity: float,
    kappa: float,
) -> tuple[Rating, ...]:
    """Return reference life, equivalent load and modified life of a bearing."""
    inputs = case.rating
    element: rating.RollingElement = "ball" if isinstance(bearing, BallBearing) else "roller"
    life = _reference_life(case, bearing, capacity)
    power = 3.0 if element == "ball" else 10.0 / 3.0
    equivalent = capacity / (life / MILLION) ** (1.0 / power)
    lives = (
        _machine_rating("reference_life", life),
        _machine_rating("equivalent_load_n", equivalent),
    )
    missing = [
        name for name in ("fatigue_load_limit", "contamination") if getattr(inputs, name) is None
    ]
    if missing:
        reason = f"[rating] has no {' and no '.join(missing)}"
        return (*lives, *_missing(("life_factor", "modified_life_s"), reason))
    assert inputs.fatigue_load_limit is not None
    assert inputs.contamination is not None
    # a_ISO depends on stress: slices and clearance may lengthen the life, but they do not reduce a
    # roller's stress below that of the load
    share = (
        float(inputs.contamination)
        * float(inputs.fatigue_load_limit)
        / max(equivalent, bearing.radial_load)
    )
    factor = rating.life_factor(element, kappa, share)
    reason = "the viscosity ratio is below 0.1, outside ISO 281"
    seconds = None if factor is None else factor * life * math.tau / bearing.speed
    return (
        *lives,
        _machine_rating("life_factor", factor, reason),
        _machine_rating("modified_life_s", seconds, reason),
    )


def _reference_life(
    case: MachineCase, bearing: CylindricalRollerBearing | BallBearing, capacity: float
) -> float:
    """Return the reference life [revolutions]."""
    if isinstance(bearing, BallBearing):
        ratio = bearing.ball_diameter * math.cos(bearing.contact_angle) / bearing.pitch_diameter
        raceway = rating.BallRaceway(ratio, bearing.osculation, bearing.contact_angle)
        return rating.ball_life(bearing.loads(case.pair)[0], capacity, raceway)
    straight = bearing.profile == "straight"
    return rating.roller_life(
        bearing.slice_loads, capacity, bearing.kinematics.ratio, straight=straight
    )


# Gears
# ----------------------------------------------------------------------


GEAR_KEYS = ("mesh_friction", "rated_bulk_k", "rated_flash_k", "rated_film")


def _gear_ratings(case: MachineCase, gears: SpurGear, stated: Case) -> tuple[Rating, ...]:
    section, inputs = stated.contents.lubricant, case.rating
    if not isinstance(section, SheetSection):
        return _missing(GEAR_KEYS, "the oil is given by laws, not by a data sheet")
    if "C" not in gears.path:
        return _missing(GEAR_KEYS, "the teeth do not meet at the pitch point")
    try:
        oil = _gear_oil(section.sheet)
    except BadInput as refusal:
        return _missing(GEAR_KEYS, str(refusal))
    roughness = _mean_ra(stated) if inputs.roughness_ra is None else float(inputs.roughness_ra)
    if roughness == 0.0:
        return _missing(GEAR_KEYS, "the flanks are smooth")
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
    points = {contact.name: _mesh_point(case, contact) for contact in case.contacts}
    films = {
        name: rating.specific_film(point, mesh, oil, friction, bulk)
        for name, point in points.items()
    }
    rises = {name: rise for name, (_, rise) in films.items()}
    film = {name: value for name, (value, _) in films.items()}
    too_hot = "the flash heats the oil above 510 degC, the limit of the estimate of α"
    return (
        _machine_rating("mesh_friction", friction),
        _machine_rating("rated_bulk_k", bulk),
        Rating("rated_flash_k", rises, beyond=_heat_scope(points.values(), solids[0])),
        Rating("rated_film", film, too_hot if None in film.values() else ""),
        *_limits(case, film, bulk + max(rises.values()), oil, supply),
    )


def _mesh_friction(gears: SpurGear, oil: rating.GearOil, supply: float, roughness: float) -> float:
    pitch = gears.contact("C", gears.path["C"])
    assert not isinstance(pitch.radius, tuple)
    return rating.mesh_friction(
        gears.normal_force / gears.face_width,
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


def _mesh_point(case: MachineCase, contact: MachineContact) -> rating.MeshPoint:
    hertz = contact.hertz(case.pair)
    assert contact.line_load is not None
    assert not isinstance(contact.radius, tuple)
    return rating.MeshPoint(
        contact.radius, hertz.p_max, contact.line_load, hertz.half_widths[0], contact.surface_speeds
    )


def _outside_scope(gears: SpurGear) -> str:
    """Return the properties of the gears outside the scope of the standards, or ""."""
    working, outside = math.degrees(gears.working_angle), []
    pitch_line = gears.speed * gears.base_radii[0] / math.cos(gears.working_angle)
    low, high = PITCH_LINE_SPEEDS
    if not low <= pitch_line <= high:
        outside.append(f"a pitch-line speed of {pitch_line:.3g} m/s ({low:g} to {high:g})")
    low, high = WORKING_ANGLES
    if not low <= working <= high:
        outside.append(f"a working pressure angle of {working:.3g} deg ({low:g} to {high:g})")
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
    missing = "[rating] has no permissible_film, from a test of the oil"
    safety = _machine_rating("micropitting_safety", None, missing)
    films = [value for value in film.values() if value is not None]
    if inputs.permissible_film is not None and len(films) < len(film):
        safety = _machine_rating(
            "micropitting_safety", None, "the specific film is not known along the whole path"
        )
    elif inputs.permissible_film is not None:
        safety = _machine_rating("micropitting_safety", min(films) / float(inputs.permissible_film))
    missing = "[rating] has no scuffing_stage, from an FZG test of the oil"
    margin = (
        _machine_rating("scuffing_limit_k", None, missing),
        _machine_rating("scuffing_margin_k", None, missing),
    )
    if inputs.scuffing_stage is not None:
        factor = oil.factor * (1e3 * oil.viscosity(supply)) ** -0.05
        limit = rating.scuffing_temperature(float(inputs.scuffing_stage), factor) + 273.15
        margin = (
            _machine_rating("scuffing_limit_k", limit),
            _machine_rating("scuffing_margin_k", limit - hottest),
        )
    return safety, *margin


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
        * rating.loss_factor(parts, gears.contact_ratio, gears.teeth)
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


# Fatigue
# ----------------------------------------------------------------------


@dataclass(frozen=True)
class DangVan:
    """Dang Van stress below a solved contact over depth [Pa].

    `depths` [m]; `solved` of the rough contact, `smooth` of the Hertz contact with the same
    friction coefficient; `core_depth`, below which the cell size has no effect; `slope` a; `limit`
    τ₋₁ [Pa].
    """

    depths: Field
    solved: Field
    smooth: Field
    core_depth: float
    slope: float
    limit: float

    def ratings(self) -> tuple[Rating, ...]:
        """Return the largest stress in the core, above it and if smooth, and the safety."""
        core = self.depths >= self.core_depth
        return (
            _machine_rating("dang_van_pa", float(self.solved[core].max())),
            _machine_rating("dang_van_shallow_pa", float(self.solved[~core].max())),
            _machine_rating("dang_van_smooth_pa", float(self.smooth.max())),
            _machine_rating("dang_van_safety", self.limit / float(self.solved[core].max())),
        )


def dang_van_below(run: Run, limits: tuple[float, float]) -> DangVan:
    """Compute the Dang Van stress of material that passes below a solved contact.

    Parameters
    ----------
    run : the solved contact
    limits : fatigue limits of the material in reversed torsion and reversed bending [Pa]

    Raises
    ------
    BadInput
        for limits that no metal has.
    """
    slope = rating.dang_van_slope(*limits)
    stress, solution = run.stress, run.solution
    grid, conditions = solution.grid, solution.conditions
    (a, b), line = conditions.hertz.half_widths, conditions.geometry == "line"
    inside = (
        1.0
        - (grid.x[:, None] / a) ** 2
        - (0.0 if line else (grid.y / b) ** 2)
        + np.zeros(grid.cells)
    )
    pressure = conditions.hertz.p_max * np.sqrt(np.maximum(inside, 0.0))
    friction = 0.0 if run.friction is None else run.friction.coefficient
    smooth = stress_below(
        pressure,
        friction * pressure,
        grid,
        stress.depths,
        poisson_ratio=stress.poisson_ratio,
        body=stress.body,
    )
    rough, ideal = (_over_depth(field, slope) for field in (stress, smooth))
    return DangVan(stress.depths, rough, ideal, stress.core_depth, slope, limits[0])


def _over_depth(stress: SubsurfaceStress, slope: float) -> Field:
    """Return the largest Dang Van stress over all lines along rolling at each depth."""
    largest = []
    for depth in stress.depths:
        levels = stress.tractions.stresses(float(depth), stress.poisson_ratio, cache=False)
        paths = np.concatenate(
            [np.swapaxes(levels, 1, 2), np.zeros((6, levels.shape[2], 1))], axis=2
        )
        largest.append(rating.dang_van(paths, slope))
    return np.array(largest)
