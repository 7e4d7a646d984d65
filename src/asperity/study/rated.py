"""A machine rated as standards have it, beside its solved contacts; and Dang Van's measure below a solved one.

A rating takes the machine, the oil and, where its standard says so, a roughness number. Nothing solved goes into it, so
that roughness counts once in the rating and once in the solved contact, and in neither twice. Dang Van's measure is the
other way round: of a solved contact's stresses, with no roughness number.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from asperity import rating
from asperity.arrays import Field
from asperity.case import Case, MachineCase, SheetSection
from asperity.ehl import SubsurfaceStress, stress_below
from asperity.errors import BadInput
from asperity.lubricant import ESTIMATORS, OilSheet
from asperity.machine import BallBearing, CylindricalRollerBearing, SpurGear
from asperity.results import Run
from asperity.study.rating_facts import FACTS

MILLION = 1e6


@dataclass(frozen=True)
class Rating:
    """A rating: its key among the quantities, and its values by contact; "" is the whole machine.

    `reason` says why it has none.
    """

    key: str
    values: Mapping[str, float | None]
    reason: str = ""

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
        value: dict[str, Any] = {"value": self.alone} if set(self.values) <= {""} else {"values": dict(self.values)}
        facts = {"standard": self.standard, "formula": self.formula, "validity": self.validity}
        return {"key": self.key, **value, **facts, "reason": self.reason}


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


# Bearings ------------------------------------------------------------------------------------------------------------


def _of_bearing(case: MachineCase, bearing: CylindricalRollerBearing | BallBearing, stated: Case) -> tuple[Rating, ...]:
    oil, given = stated.lubricant, case.rating
    assert oil is not None
    thin = rating.reference_viscosity(bearing.speed, bearing.pitch_diameter)
    kappa = oil.viscosity.eta0 / oil.density.rho0 / thin
    found = [_whole("reference_viscosity_m2_s", thin), _whole("viscosity_ratio", kappa)]
    if given.dynamic_load_rating is None:
        no = "[rating] has no dynamic_load_rating"
        return (*found, *(_whole(key, None, no) for key in ("reference_life", "life_factor", "modified_life_s")))
    capacity = float(given.dynamic_load_rating)
    element: rating.RollingElement = "ball" if isinstance(bearing, BallBearing) else "roller"
    life = _reference_life(case, bearing, capacity)
    power = 3.0 if element == "ball" else 10.0 / 3.0
    equivalent = capacity / (life / MILLION) ** (1.0 / power)
    found += [_whole("reference_life", life), _whole("equivalent_load_n", equivalent)]
    missing = [name for name in ("fatigue_load_limit", "contamination") if getattr(given, name) is None]
    if missing:
        no = f"[rating] has no {' and no '.join(missing)}"
        return (*found, _whole("life_factor", None, no), _whole("modified_life_s", None, no))
    assert given.fatigue_load_limit is not None
    assert given.contamination is not None
    share = float(given.contamination) * float(given.fatigue_load_limit) / equivalent
    factor = rating.life_factor(element, kappa, share)
    thick = "the viscosity ratio lies below 0.1, where ISO 281 rates nothing"
    hours = None if factor is None else factor * life * math.tau / bearing.speed
    return (*found, _whole("life_factor", factor, thick), _whole("modified_life_s", hours, thick))


def _reference_life(case: MachineCase, bearing: CylindricalRollerBearing | BallBearing, capacity: float) -> float:
    """[revolutions]."""
    if isinstance(bearing, BallBearing):
        ratio = bearing.ball_diameter * math.cos(bearing.contact_angle) / bearing.pitch_diameter
        raceway = rating.BallRaceway(ratio, bearing.osculation, bearing.contact_angle)
        return rating.ball_life(bearing.loads(case.pair)[0], capacity, raceway)
    straight = bearing.profile == "straight"
    return rating.roller_life(bearing.slice_loads, capacity, bearing.kinematics.ratio, straight=straight)


# Gears ---------------------------------------------------------------------------------------------------------------


GEAR_KEYS = ("mesh_friction", "rated_bulk_k", "rated_flash_k", "rated_film")


def _of_gears(case: MachineCase, gears: SpurGear, stated: Case) -> tuple[Rating, ...]:
    section, given = stated.contents.lubricant, case.rating
    if not isinstance(section, SheetSection):
        return tuple(_whole(key, None, "the oil is stated by laws, without its data sheet") for key in GEAR_KEYS)
    if "C" not in gears.path:
        return tuple(_whole(key, None, "the teeth do not meet at the pitch point") for key in GEAR_KEYS)
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
        gears.normal_force / gears.face_width, pitch.radius, sum(pitch.surface_speeds), rough, oil.viscosity(supply),
        oil.factor,
    )  # fmt: skip
    bulk = _bulk(case, gears, friction, supply)
    solids = stated.thermal.solids
    mesh = rating.Mesh(rough, case.pair.effective_modulus, (solids[0].effusivity, solids[1].effusivity))
    films = {}
    for contact in case.contacts:
        hertz = contact.hertz(case.pair)
        assert contact.line_load is not None
        assert not isinstance(contact.radius, tuple)
        point = rating.MeshPoint(
            contact.radius, hertz.p_max, contact.line_load, hertz.half_widths[0], contact.surface_speeds
        )
        films[contact.name] = rating.specific_film(point, mesh, oil, friction, bulk)
    rises = {name: rise for name, (_, rise) in films.items()}
    film = {name: value for name, (value, _) in films.items()}
    return (
        _whole("mesh_friction", friction),
        _whole("rated_bulk_k", bulk),
        Rating("rated_flash_k", rises),
        Rating("rated_film", film),
        *_limits(case, film, bulk + max(rises.values()), oil, supply),
    )


def _limits(
    case: MachineCase, film: Mapping[str, float], hottest: float, oil: rating.GearOil, supply: float
) -> tuple[Rating, ...]:
    """Safety against micropitting and the margin to scuffing, where their limits are given."""
    given = case.rating
    missing = "[rating] has no permissible_film: it is of a test of the oil"
    safety = _whole("micropitting_safety", None, missing)
    if given.permissible_film is not None:
        safety = _whole("micropitting_safety", min(film.values()) / float(given.permissible_film))
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
    lost = gears.torque * gears.speed * friction * rating.loss_factor(parts, gears.contact_ratio, gears.teeth)
    return rating.bulk_temperature(supply, lost, gears.centres, gears.face_width, spray=given.oil_supply == "spray")


def _gear_oil(sheet: OilSheet) -> rating.GearOil:
    """Beyond 150 °C too, where a flash of microseconds takes it."""
    return rating.GearOil(
        lambda kelvin: sheet.walther(kelvin) * sheet.density(kelvin), partial(ESTIMATORS["iso"], sheet), sheet.base
    )


# Fatigue -------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class DangVan:
    """Dang Van's measure below a solved contact, over depth [Pa].

    `depths` [m]; `solved` of the rough contact, `smooth` of Hertz' under the same coefficient of friction; `core_depth`
    below which the cells have no say; `slope` a; `limit` τ₋₁ [Pa].
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
    inside = 1.0 - (grid.x[:, None] / a) ** 2 - (0.0 if line else (grid.y / b) ** 2) + np.zeros(grid.cells)
    pressure = conditions.hertz.p_max * np.sqrt(np.maximum(inside, 0.0))
    friction = 0.0 if run.friction is None else run.friction.coefficient
    smooth = stress_below(
        pressure, friction * pressure, grid, stress.depths, poisson_ratio=stress.poisson_ratio, body=stress.body
    )
    rough, ideal = (_over_depth(one, slope) for one in (stress, smooth))
    return DangVan(stress.depths, rough, ideal, stress.core_depth, slope, limits[0])


def _over_depth(stress: SubsurfaceStress, slope: float) -> Field:
    """The largest measure of all lines along rolling at each depth."""
    found = []
    for depth in stress.depths:
        levels = stress.tractions.stresses(float(depth), stress.poisson_ratio, keep=False)
        passing = np.concatenate([np.swapaxes(levels, 1, 2), np.zeros((6, levels.shape[2], 1))], axis=2)
        found.append(rating.dang_van(passing, slope))
    return np.array(found)
