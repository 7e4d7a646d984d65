"""Ratings of rolling bearings: viscosity ratio, life, friction torque."""

import math
from collections.abc import Iterator

from asperity import rating
from asperity.case import Case, MachineCase
from asperity.machine import LOAD_PER_LIMIT, BallBearing, CylindricalRollerBearing
from asperity.machines.rating_facts import Rating, machine_rating, missing_ratings, rated_case

MILLION = 1e6


def bearing_ratings(
    case: MachineCase, bearing: CylindricalRollerBearing | BallBearing, stated: Case
) -> tuple[Rating, ...]:
    """Return the ratings of a bearing."""
    oil, capacity = stated.lubricant, case.rating.dynamic_load_rating
    assert oil is not None
    reference = rating.reference_viscosity(bearing.speed, bearing.pitch_diameter)
    kappa = oil.viscosity.eta0 / oil.density.rho0 / reference
    if capacity is None:
        keys = "reference_life", *_modified_keys(case)
        lives = missing_ratings(keys, "[rating] has no dynamic_load_rating")
    else:
        lives = _bearing_lives(case, bearing, float(capacity), kappa)
    return (
        machine_rating("reference_viscosity_m2_s", reference),
        machine_rating("viscosity_ratio", kappa),
        *lives,
        _friction_torque(case, bearing, oil.viscosity.eta0 / oil.density.rho0),
    )


def _friction_torque(
    case: MachineCase, bearing: CylindricalRollerBearing | BallBearing, viscosity: float
) -> Rating:
    """Return the friction torque, of balls if the static load rating is known."""
    static = None
    if isinstance(bearing, BallBearing):
        limit = case.rating.fatigue_load_limit
        if limit is None:
            reason = "[rating] has no fatigue_load_limit, from which C0 follows"
            return machine_rating("rated_friction_torque_n_m", None, reason)
        static = LOAD_PER_LIMIT["ball-bearing"] * float(limit)
    load = max(bearing.radial_load, getattr(bearing, "axial_load", 0.0))
    torque = rating.palmgren_torque(bearing.pitch_diameter, bearing.speed, viscosity, load, static)
    return machine_rating("rated_friction_torque_n_m", torque)


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
        machine_rating("reference_life", life),
        machine_rating("equivalent_load_n", equivalent),
    )
    missing = [
        name for name in ("fatigue_load_limit", "contamination") if getattr(inputs, name) is None
    ]
    if missing:
        reason = f"[rating] has no {' and no '.join(missing)}"
        return (*lives, *missing_ratings(_modified_keys(case), reason))
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
    survival = rating.reliability_factor(inputs.reliability)
    seconds = None if factor is None else survival * factor * life * math.tau / bearing.speed
    return (
        *lives,
        machine_rating("life_factor", factor, reason),
        machine_rating("reliability_factor", survival),
        machine_rating("modified_life_s", seconds, reason),
        *_spectrum_life(case),
    )


def _modified_keys(case: MachineCase) -> tuple[str, ...]:
    keys = "life_factor", "reliability_factor", "modified_life_s"
    return (*keys, "spectrum_life_s") if case.rating.spectrum else keys


def _spectrum_life(case: MachineCase) -> Iterator[Rating]:
    """Yield the life under a load spectrum, if one is stated."""
    bearing = case.machine
    assert isinstance(bearing, CylindricalRollerBearing | BallBearing)
    loads = [name for name in ("radial_load", "axial_load") if hasattr(bearing, name)]
    damage, reason = 0.0, ""
    for entry in case.rating.spectrum or ():
        factors = {**dict.fromkeys(loads, entry.load), "speed": entry.speed}
        values = {
            f"machine.{key}": factor * getattr(bearing, key) for key, factor in factors.items()
        }
        changed = case.with_overrides({**values, "rating.spectrum": "none"})
        stated = rated_case(changed)
        assert stated is not None  # like the case
        assert isinstance(changed.machine, CylindricalRollerBearing | BallBearing)
        ratings = bearing_ratings(changed, changed.machine, stated)
        life = next(found for found in ratings if found.key == "modified_life_s")
        reason = reason or life.reason
        damage += math.inf if life.machine_value is None else entry.share / life.machine_value
    if case.rating.spectrum:
        yield machine_rating("spectrum_life_s", None if reason else 1.0 / damage, reason)


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
