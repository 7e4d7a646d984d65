"""A machine rated as standards have it, beside its solved contacts; and Dang Van's measure below a solved one.

A rating takes the machine, the oil and, where its standard says so, a roughness number. Nothing
solved goes into it, so that roughness counts once in the rating and once in the solved contact,
and in neither twice. Dang Van's measure is the other way round: of a solved contact's stresses,
with no roughness number.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from asperity import rating
from asperity.case import Case, MachineCase, SheetSection
from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.lubricant import ESTIMATORS, OilSheet
from asperity.machine import BallBearing, CylindricalRollerBearing, MachineContact, SpurGear
from asperity.machines.rating_facts import FACTS
from asperity.results import Run
from asperity.solution import SubsurfaceStress, stress_below

MILLION = 1e6
PITCH_LINE = 2.0, 80.0  # m/s that the gears' ratings are for, by their standards' scopes
WORKING = 15.0, 25.0  # deg, of the working pressure angle
WARMER = 3.0  # K of the teeth above the oil that are said
SLOW_HEAT = 1.0  # Peclet number u a/2κ below which Blok's flash is more than 6 % too high


@dataclass(frozen=True)
class Rating:
    """A rating: its key among the quantities, and its values by contact; "" is the whole machine.

    `reason` says why it has none, `beyond` what of the machine lies outside what the standard is
    for.
    """

    key: str
    values: Mapping[str, float | None]
    reason: str = ""
    beyond: str = ""

    @property
    def standard(self) -> str:
        """Where it is from."""
        return FACTS[self.key].standard

    @property
    def formula(self) -> str:
        """What is computed."""
        return FACTS[self.key].formula

    @property
    def validity(self) -> str:
        """What it is made for, and what is left out here."""
        return FACTS[self.key].validity

    @property
    def alone(self) -> float | None:
        """The one value of the whole machine; None where it is by contact, or is missing."""
        return self.values.get("")

    def to_dict(self) -> dict[str, Any]:
        """As `machine --json` prints it."""
        value: dict[str, Any] = (
            {"value": self.alone} if set(self.values) <= {""} else {"values": dict(self.values)}
        )
        facts = {"standard": self.standard, "formula": self.formula, "validity": self.validity}
        return {"key": self.key, **value, **facts, "reason": self.reason, "beyond": self.beyond}


def machine_ratings(case: MachineCase) -> tuple[Rating, ...]:
    """The ratings of a bearing or a pair of gears; none of other machines, or without an oil and a roughness."""
    drawn = [contact for contact in case.contacts if not contact.stands_still]
    if not case.complete or not drawn:
        return ()
    stated = case.case(drawn[0])
    if stated.lubricant is None:
        return ()
    if isinstance(case.machine, SpurGear):
        return _of_gears(case, case.machine, stated)
    if isinstance(case.machine, CylindricalRollerBearing | BallBearing):
        return _of_bearing(case, case.machine, stated)
    return ()


def _whole(key: str, value: float | None, reason: str = "") -> Rating:
    return Rating(key, {"": value}, reason if value is None else "")


# Bearings
# ----------------------------------------------------------------------


def _of_bearing(
    case: MachineCase, bearing: CylindricalRollerBearing | BallBearing, stated: Case
) -> tuple[Rating, ...]:
    oil, given = stated.lubricant, case.rating
    assert oil is not None
    thin = rating.reference_viscosity(bearing.speed, bearing.pitch_diameter)
    kappa = oil.viscosity.eta0 / oil.density.rho0 / thin
    found = [_whole("reference_viscosity_m2_s", thin), _whole("viscosity_ratio", kappa)]
    if given.dynamic_load_rating is None:
        no = "[rating] has no dynamic_load_rating"
        return (
            *found,
            *(
                _whole(key, None, no)
                for key in ("reference_life", "life_factor", "modified_life_s")
            ),
        )
    capacity = float(given.dynamic_load_rating)
    element: rating.RollingElement = "ball" if isinstance(bearing, BallBearing) else "roller"
    life = _reference_life(case, bearing, capacity)
    power = 3.0 if element == "ball" else 10.0 / 3.0
    equivalent = capacity / (life / MILLION) ** (1.0 / power)
    found += [_whole("reference_life", life), _whole("equivalent_load_n", equivalent)]
    missing = [
        name for name in ("fatigue_load_limit", "contamination") if getattr(given, name) is None
    ]
    if missing:
        no = f"[rating] has no {' and no '.join(missing)}"
        return (*found, _whole("life_factor", None, no), _whole("modified_life_s", None, no))
    assert given.fatigue_load_limit is not None
    assert given.contamination is not None
    # a_ISO is of stresses: slices and clearance lengthen a life, but no roller's stress falls below
    # that of the load
    share = (
        float(given.contamination)
        * float(given.fatigue_load_limit)
        / max(equivalent, bearing.radial_load)
    )
    factor = rating.life_factor(element, kappa, share)
    thick = "the viscosity ratio lies below 0.1, where ISO 281 rates nothing"
    hours = None if factor is None else factor * life * math.tau / bearing.speed
    return (*found, _whole("life_factor", factor, thick), _whole("modified_life_s", hours, thick))


def _reference_life(
    case: MachineCase, bearing: CylindricalRollerBearing | BallBearing, capacity: float
) -> float:
    """[revolutions]."""
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


def _of_gears(case: MachineCase, gears: SpurGear, stated: Case) -> tuple[Rating, ...]:
    section, given = stated.contents.lubricant, case.rating
    if not isinstance(section, SheetSection):
        return tuple(
            _whole(key, None, "the oil is stated by laws, without its data sheet")
            for key in GEAR_KEYS
        )
    if "C" not in gears.path:
        return tuple(
            _whole(key, None, "the teeth do not meet at the pitch point") for key in GEAR_KEYS
        )
    supply = float(section.temperature)
    try:
        oil = _gear_oil(section.sheet)
    except BadInput as refusal:
        return tuple(_whole(key, None, str(refusal)) for key in GEAR_KEYS)
    rough = _mean_ra(stated) if given.roughness_ra is None else float(given.roughness_ra)
    if rough == 0.0:
        return tuple(_whole(key, None, "the flanks are smooth") for key in GEAR_KEYS)
    pitch = gears.contact("C", gears.path["C"])
    assert not isinstance(pitch.radius, tuple)
    friction = rating.mesh_friction(
        gears.normal_force / gears.face_width,
        pitch.radius,
        sum(pitch.surface_speeds),
        rough,
        oil.viscosity(supply),
        oil.factor,
    )
    bulk = _bulk(case, gears, friction, supply)
    solids = stated.thermal.solids
    mesh = rating.Mesh(
        rough, case.pair.effective_modulus, (solids[0].effusivity, solids[1].effusivity)
    )
    points = {contact.name: _mesh_point(case, contact) for contact in case.contacts}
    films = {
        name: rating.specific_film(point, mesh, oil, friction, bulk)
        for name, point in points.items()
    }
    rises = {name: rise for name, (_, rise) in films.items()}
    film = {name: value for name, (value, _) in films.items()}
    gone = (
        ""
        if None not in film.values()
        else "the flash takes the oil beyond 510 degC, where the estimate of α ends"
    )
    slow = min(
        (
            min(point.speeds) * point.half_width / (2.0 * solids[0].diffusivity)
            for point in points.values()
        ),
    )
    teeth, fast = (
        _beyond(gears),
        "" if slow >= SLOW_HEAT else f"a Peclet number of {slow:.2g}, for 1 and more",
    )
    both = "; ".join(filter(None, (teeth, fast)))
    found = (
        _whole("mesh_friction", friction),
        _whole("rated_bulk_k", bulk),
        Rating("rated_flash_k", rises, beyond=both),
        Rating("rated_film", film, gone),
        *_limits(case, film, bulk + max(rises.values()), oil, supply),
    )
    return tuple(replace(each, beyond=each.beyond or teeth) for each in found)


def _mesh_point(case: MachineCase, contact: MachineContact) -> rating.MeshPoint:
    hertz = contact.hertz(case.pair)
    assert contact.line_load is not None
    assert not isinstance(contact.radius, tuple)
    return rating.MeshPoint(
        contact.radius, hertz.p_max, contact.line_load, hertz.half_widths[0], contact.surface_speeds
    )


def _beyond(gears: SpurGear) -> str:
    """What of the gears lies outside what the standards' ratings are for; nothing where all is within."""
    working, found = math.degrees(gears.working_angle), []
    pitch_line = gears.speed * gears.base_radii[0] / math.cos(gears.working_angle)
    if not PITCH_LINE[0] <= pitch_line <= PITCH_LINE[1]:
        found.append(
            f"a pitch-line speed of {pitch_line:.3g} m/s, for {PITCH_LINE[0]:g} to {PITCH_LINE[1]:g}"
        )
    if not WORKING[0] <= working <= WORKING[1]:
        found.append(
            f"a working pressure angle of {working:.3g} deg, for {WORKING[0]:g} to {WORKING[1]:g}"
        )
    return ", ".join(found)


def _limits(
    case: MachineCase,
    film: Mapping[str, float | None],
    hottest: float,
    oil: rating.GearOil,
    supply: float,
) -> tuple[Rating, ...]:
    """Safety against micropitting and the margin to scuffing, where their limits are given."""
    given = case.rating
    missing = "[rating] has no permissible_film: it is of a test of the oil"
    safety = _whole("micropitting_safety", None, missing)
    known = [value for value in film.values() if value is not None]
    if given.permissible_film is not None and len(known) < len(film):
        safety = _whole(
            "micropitting_safety", None, "the specific film is not known all along the path"
        )
    elif given.permissible_film is not None:
        safety = _whole("micropitting_safety", min(known) / float(given.permissible_film))
    missing = "[rating] has no scuffing_stage: it is of an FZG test of the oil"
    margin = (_whole("scuffing_limit_k", None, missing), _whole("scuffing_margin_k", None, missing))
    if given.scuffing_stage is not None:
        factor = oil.factor * (1e3 * oil.viscosity(supply)) ** -0.05
        limit = rating.scuffing_temperature(float(given.scuffing_stage), factor) + 273.15
        margin = (_whole("scuffing_limit_k", limit), _whole("scuffing_margin_k", limit - hottest))
    return safety, *margin


def _mean_ra(stated: Case) -> float:
    """Of both flanks, taken as Gaussian [m]: of their own Sq, or of two equal ones with the composite Sq."""
    bodies = stated.composite()
    if bodies is None:
        return stated.surface().sq / math.sqrt(math.pi)
    return math.sqrt(2.0 / math.pi) * (bodies.first.sq + bodies.second.sq) / 2.0


def _bulk(case: MachineCase, gears: SpurGear, friction: float, supply: float) -> float:
    """Of the teeth [K]: as given, or by their losses."""
    given = case.rating
    if given.bulk_temperature is not None:
        return float(given.bulk_temperature)
    path, pitch = gears.path, gears.base_pitch
    parts = (path["E"] - path["C"]) / pitch, (path["C"] - path["A"]) / pitch
    lost = (
        gears.torque
        * gears.speed
        * friction
        * rating.loss_factor(parts, gears.contact_ratio, gears.teeth)
    )
    return rating.bulk_temperature(
        supply, lost, gears.centres, gears.face_width, spray=given.oil_supply == "spray"
    )


def _gear_oil(sheet: OilSheet) -> rating.GearOil:
    """Beyond 150 °C too, where a flash of microseconds takes it: the standard's α is one of the oil at 38 °C.

    No viscosity of the hot oil enters, so that none is too thin for it.
    """
    return rating.GearOil(
        lambda kelvin: sheet.walther(kelvin) * sheet.density(kelvin),
        partial(ESTIMATORS["iso"].law, sheet),
        sheet.base,
    )


def warmer_teeth(case: MachineCase, ratings: Sequence[Rating]) -> Iterator[str]:
    """That gears' contacts are solved with the oil as it is supplied, where their teeth are rated to be warmer."""
    bulk = next((each.alone for each in ratings if each.key == "rated_bulk_k"), None)
    drawn = [contact for contact in case.contacts if not contact.stands_still]
    section = case.case(drawn[0]).contents.lubricant if bulk is not None else None
    if (
        bulk is None
        or not isinstance(section, SheetSection)
        or bulk - float(section.temperature) < WARMER
    ):
        return
    supply, sheet = float(section.temperature), section.sheet
    share = sheet.walther(bulk) * sheet.density(bulk) / sheet.viscosity(supply)
    yield (
        f"The contacts are solved with oil of {supply - 273.15:.3g} degC, as it is supplied; at the teeth's rated bulk "
        f"temperature of {bulk - 273.15:.3g} degC it has {share:.2f} of that viscosity, and films are thinner. State "
        "that as lubricant.temperature and as rating.bulk_temperature to solve them so."
    )


# Fatigue
# ----------------------------------------------------------------------


@dataclass(frozen=True)
class DangVan:
    """Dang Van's measure below a solved contact, over depth [Pa].

    `depths` [m]; `solved` of the rough contact, `smooth` of Hertz' under the same coefficient of
    friction; `core_depth` below which the cells have no say; `slope` a; `limit` τ₋₁ [Pa].
    """

    depths: Field
    solved: Field
    smooth: Field
    core_depth: float
    slope: float
    limit: float

    def ratings(self) -> tuple[Rating, ...]:
        """Largest from the core down and above it, and the same of the smooth contact."""
        core = self.depths >= self.core_depth
        return (
            _whole("dang_van_pa", float(self.solved[core].max())),
            _whole("dang_van_shallow_pa", float(self.solved[~core].max())),
            _whole("dang_van_smooth_pa", float(self.smooth.max())),
            _whole("dang_van_safety", self.limit / float(self.solved[core].max())),
        )


def dang_van_below(run: Run, limits: tuple[float, float]) -> DangVan:
    """Of material that passes below a solved contact at rest, from no stress to none.

    Parameters
    ----------
    run : the solved contact
    limits : of the material in reversed torsion and reversed bending [Pa]

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
    rough, ideal = (_over_depth(one, slope) for one in (stress, smooth))
    return DangVan(stress.depths, rough, ideal, stress.core_depth, slope, limits[0])


def _over_depth(stress: SubsurfaceStress, slope: float) -> Field:
    """The largest measure of all lines along rolling at each depth."""
    found = []
    for depth in stress.depths:
        levels = stress.tractions.stresses(float(depth), stress.poisson_ratio, keep=False)
        passing = np.concatenate(
            [np.swapaxes(levels, 1, 2), np.zeros((6, levels.shape[2], 1))], axis=2
        )
        found.append(rating.dang_van(passing, slope))
    return np.array(found)
