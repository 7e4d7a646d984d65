"""Tapered roller bearing under radial and axial load: load zone, rib force and contacts.

Rings are rigid and parallel. Cup, cone and rollers are cones with a common apex on the bearing's
axis, so that the raceways roll without sliding. The line stiffness is that of ISO 16281.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from asperity.contact.conditions import ElasticPair
from asperity.core.arrays import Field
from asperity.core.errors import BadInput, require_positive
from asperity.machine.element import MachineContact
from asperity.machine.roller import (
    EXPONENT,
    SLICES,
    STIFFNESS,
    RollerBearing,
    RollerProfile,
    SlicedRoller,
    roller_contacts,
    steel_notes,
)
from asperity.machine.rolling import (
    STEEL_DENSITY,
    RollingKinematics,
    centrifugal_notes,
    load_zone_notes,
)
from asperity.machine.stiffness import RingBalance

CUP_ANGLES = 1.0, 45.0  # [deg]
APEX_TOLERANCE = math.radians(0.1)  # of a stated cone angle, rounded by catalogues


@dataclass(frozen=True, kw_only=True)
class TaperedRollerBearing(RollerBearing):
    """Tapered roller bearing with a rotating cone (inner ring) and a rib at its large end.

    The axis of a roller is inclined by β = (α_o + α_i)/2 to that of the bearing, its taper half
    angle is ν = (α_o - α_i)/2. Cone, cup and rollers have a common apex if tan ν = (D/d_m) sin β,
    from which the angle α_i of the cone follows.

    Parameters
    ----------
    rollers : number of rollers
    roller_diameter : mean diameter D of a roller, across its axis at its middle [m]
    roller_length : effective length, without end radii and undercuts [m]
    pitch_diameter : diameter d_m of the circle of the rollers' middles [m]
    cup_angle : contact angle α_o of the cup (outer ring) [rad], half of the cup's included angle
    radial_load : [N]
    axial_load : thrust that presses the cone into the cup [N]; None: that which loads half of the
        rollers, induced by the radial load in a pair of bearings without preload
    speed : speed of the cone [rad/s]
    cone_angle : contact angle of the cone [rad], a check on the apex; None: from the apex
    rib_angle : angle of the force of the rib to the bearing's axis [rad]; None: along the roller
    profile, slices : as in `CylindricalRollerBearing`

    Raises
    ------
    BadInput
        The rollers do not fit or carry no load, the cones have no common apex, or the thrust does
        not hold the bearing together.

    Examples
    --------
    >>> import math
    >>> from asperity.machine import TaperedRollerBearing
    >>> bearing = TaperedRollerBearing(
    ...     rollers=17,
    ...     roller_diameter=7.4e-3,
    ...     roller_length=11e-3,
    ...     pitch_diameter=46e-3,
    ...     cup_angle=math.radians(14.0),
    ...     radial_load=4000.0,
    ...     speed=157.0,
    ... )
    >>> f"{bearing.thrust:.0f} N, largest rib force {bearing.rib_forces.max():.1f} N"
    '1255 N, largest rib force 66.7 N'
    """

    rollers: int
    roller_diameter: float
    roller_length: float
    pitch_diameter: float
    cup_angle: float
    speed: float
    radial_load: float = 0.0
    axial_load: float | None = None
    cone_angle: float | None = None
    rib_angle: float | None = None
    profile: RollerProfile = "straight"
    slices: int = SLICES

    def __post_init__(self) -> None:
        low, high = CUP_ANGLES
        degrees = math.degrees(self.cup_angle)
        if not low <= degrees <= high:
            raise BadInput(
                f"cup_angle must lie between {low:g} and {high:g} deg, got {degrees:g} deg; below, "
                "use the kind cylindrical-roller-bearing"
            )
        require_positive("roller_diameter", self.roller_diameter, "m")
        require_positive("pitch_diameter", self.pitch_diameter, "m")
        _ = self._roller  # checks length, profile and slices
        _ = self.kinematics  # checks the number of rollers, diameters and speed
        self._require_cones()
        self._require_loads()

    def _require_cones(self) -> None:
        """Raise BadInput for angles without a common apex, or rollers that reach it."""
        inner, outer = self.contact_angles
        if self.cone_angle is not None and abs(self.cone_angle - inner) > APEX_TOLERANCE:
            raise BadInput(
                f"cone_angle of {math.degrees(self.cone_angle):g} deg does not meet cup and "
                f"rollers in one apex, which pure rolling requires at {math.degrees(inner):.2f} "
                "deg; leave cone_angle out, or correct it or roller_diameter"
            )
        if self.rib_angle is not None and not inner <= self.rib_angle <= outer:
            raise BadInput(
                f"rib_angle must lie between the angles of cone and cup, {math.degrees(inner):.2f} "
                f"and {math.degrees(outer):.2f} deg, got {math.degrees(self.rib_angle):g} deg; "
                "leave it out for a force along the roller"
            )
        if self.roller_length >= 2.0 * self.apex_distance:
            raise BadInput(
                f"roller_length must be less than {2e3 * self.apex_distance:.3g} mm, where the "
                f"rollers reach the apex of their cone, got {1e3 * self.roller_length:g} mm; "
                "shorten them, or raise pitch_diameter"
            )

    def _require_loads(self) -> None:
        """Raise BadInput for loads that load no roller or separate the rings."""
        for name, load in (("radial_load", self.radial_load), ("axial_load", self.thrust)):
            if not 0.0 <= load < math.inf:
                raise BadInput(f"{name} must not be negative, got {load:g} N; give its magnitude")
        if self.thrust == 0.0 == self.radial_load:
            raise BadInput(
                "radial_load and axial_load are both 0 N, no roller is loaded; give one of them"
            )
        least = self.radial_load * math.tan(self.cup_angle)
        if self.thrust <= least * (1.0 + 1e-9):
            raise BadInput(
                f"a tapered roller bearing comes apart under an axial_load of {self.thrust:g} N "
                f"with {self.radial_load:g} N radial load; give more than {least:.4g} N, or leave "
                f"axial_load out for {self.induced_thrust:.4g} N, which load half of the rollers"
            )

    @cached_property
    def taper_half_angle(self) -> float:
        """Half angle ν of the roller's cone [rad]: tan ν = (D/d_m) sin(α_o - ν)."""
        ratio = self.roller_diameter / self.pitch_diameter

        def excess(half_angle: float) -> float:
            return math.tan(half_angle) - ratio * math.sin(self.cup_angle - half_angle)

        return float(
            scipy.optimize.brentq(
                excess,
                0.0,
                self.cup_angle,
                xtol=1e-15,
                rtol=1e-14,
            )
        )

    @property
    def roller_axis_angle(self) -> float:
        """Angle β of the rollers' axes to the bearing's [rad]."""
        return self.cup_angle - self.taper_half_angle

    @property
    def contact_angles(self) -> tuple[float, float]:
        """Contact angles of cone and cup [rad]: β - ν and β + ν."""
        return self.cup_angle - 2.0 * self.taper_half_angle, self.cup_angle

    @property
    def apex_distance(self) -> float:
        """Distance of the middle of a contact line from the apex [m]: D/(2 sin ν)."""
        return self.roller_diameter / (2.0 * math.sin(self.taper_half_angle))

    @cached_property
    def kinematics(self) -> RollingKinematics:
        """Speeds and frequencies at mid-roller, with γ = D cos β/d_m.

        The cage turns at ω_i r_i/(r_i + r_o), where r are the radii of both raceways there: the
        epicyclic ratio sin α_i/(sin α_i + sin α_o) of cones with a common apex.
        """
        return RollingKinematics(
            count=self.rollers,
            diameter=self.roller_diameter,
            pitch_diameter=self.pitch_diameter,
            speed=self.speed,
            contact_angle=self.roller_axis_angle,
        )

    @property
    def radii(self) -> tuple[float, float]:
        """Effective radii along rolling at cone and cup, mid-roller [m].

        1/R = 1/R1 + 1/R2 of cones, each of radius r/cos(half angle) normal to the contact line:
        (D/2) cos ν (1 ∓ γ).
        """
        inner, outer = self.kinematics.radii
        taper = math.cos(self.taper_half_angle)
        return inner * taper, outer * taper

    @property
    def induced_thrust(self) -> float:
        """Thrust that loads half of many straight rollers [N]: F_r tan α_o J_a(1/2)/J_r(1/2).

        Sjövall's integrals of line contacts, ∫ cosⁿ ψ dψ over ∫ cosⁿ⁺¹ ψ dψ with n = 10/9, give
        1.258 F_r tan α_o. Source: T. A. Harris, Rolling Bearing Analysis; catalogues have F_r/(2 Y)
        with Y = 0.4 cot α_o of ISO 281, 1.25 F_r tan α_o.
        """
        return half_zone_ratio(EXPONENT) * self.radial_load * math.tan(self.cup_angle)

    @property
    def thrust(self) -> float:
        """Axial load, stated or induced [N]."""
        return self.induced_thrust if self.axial_load is None else self.axial_load

    @cached_property
    def _row(self) -> "_RollerRow":
        """The rollers between cone and cup."""
        return _RollerRow(self._roller, self.angles, self.cup_angle)

    @cached_property
    def shifts(self) -> tuple[float, float]:
        """Radial and axial displacement of the cone at equilibrium [m]."""
        load = max(self.radial_load, self.thrust)
        scale = STIFFNESS * (1e3 * self.roller_length) ** (8.0 / 9.0)
        approach = 1e-3 * (load / scale) ** (1.0 / EXPONENT)
        start = np.array([0.0, 2.0 * approach / math.sin(self.cup_angle), 0.0])
        balance = RingBalance(
            rows=(self._row,),
            radial_load=self.radial_load,
            axial_load=self.thrust,
            approach=approach,
        )
        radial, axial, _ = balance.shifts(start, 0.0)
        return float(radial), float(axial)

    @cached_property
    def slice_loads(self) -> tuple[Field, Field]:
        """Loads of all slices at cone and cup [N], each of shape (rollers, slices)."""
        outer = self._roller.loads(self._row.approaches(np.array([*self.shifts, 0.0])))
        inner_angle, outer_angle = self.contact_angles
        rib = self._rib_angle
        return outer * math.cos(outer_angle - rib) / math.cos(inner_angle - rib), outer

    @property
    def loads(self) -> Field:
        """Loads of the rollers at the cup [N]."""
        return np.asarray(self.slice_loads[1].sum(axis=1))

    @property
    def rib_forces(self) -> Field:
        """Forces of the rib on the rollers [N]: Q_o sin(α_o - α_i)/cos(α_rib - α_i).

        They balance the forces of cup and cone. Along the roller's axis this is 2 Q sin ν.
        """
        inner, outer = self.contact_angles
        return self.loads * math.sin(outer - inner) / math.cos(self._rib_angle - inner)

    @property
    def _rib_angle(self) -> float:
        return self.roller_axis_angle if self.rib_angle is None else self.rib_angle

    def contacts(self, pair: ElasticPair) -> tuple[MachineContact, ...]:  # noqa: ARG002 (ISO's stiffness of steel)
        """Return the contacts of each loaded roller with cone (inner ring) and cup (outer ring)."""
        return roller_contacts(
            self.angles, self.slice_loads, self.radii, self.kinematics, self.roller_length
        )

    def notes(self, pair: ElasticPair) -> tuple[str, ...]:
        """Return the limits of the model, the angles, the thrust and the rib force."""
        inner, outer = map(math.degrees, self.contact_angles)
        notes = [
            "Rings are rigid and parallel; misalignment and the stress at roller ends are not "
            "covered.",
            f"Contact angles are {outer:.2f} deg at the cup and {inner:.2f} deg at the cone, which "
            "meet in one apex with the rollers.",
            f"The rib carries {self.rib_forces.max():.3g} N of the most loaded roller; its sliding "
            "contact is not covered.",
        ]
        if self.axial_load is None:
            notes.append(
                f"No axial_load is stated: {self.thrust:.4g} N, induced by the radial load, load "
                "half of the rollers (Sjövall's integrals)."
            )
        loaded = int(np.count_nonzero(self.loads))
        if loaded < self.rollers // 2:
            notes.append(
                f"The thrust loads {loaded} of {self.rollers} rollers; tapered roller bearings are "
                "usually adjusted so that at least half of the rollers are loaded."
            )
        mass = STEEL_DENSITY * math.pi / 4.0 * self.roller_diameter**2 * self.roller_length
        centrifugal = centrifugal_notes(self.kinematics.centrifugal_load(mass), self.contacts(pair))
        zone = load_zone_notes(self.loads.tolist(), "roller") if self.radial_load > 0.0 else ()
        return (*notes, *steel_notes(pair), *zone, *centrifugal)

    def title(self) -> str:
        """Return a short description with the number of loaded rollers."""
        loaded = int(np.count_nonzero(self.loads))
        return f"Tapered roller bearing, {loaded} of {self.rollers} rollers loaded"


@dataclass(frozen=True, eq=False)
class _RollerRow:
    """Row of rollers between parallel rings: δ = δ_r cos ψ cos α + δ_a sin α."""

    roller: SlicedRoller
    positions: Field
    contact_angle: float

    @property
    def directions(self) -> Field:
        """Approach of each roller per shift, shape (3, rollers); no tilt."""
        across = np.cos(self.positions) * math.cos(self.contact_angle)
        along = np.full_like(across, math.sin(self.contact_angle))
        return np.stack([across, along, np.zeros_like(across)])

    def approaches(self, shifts: Field) -> Field:
        """Return the approaches of cone and cup at the rollers [m]."""
        return np.asarray(shifts @ self.directions)

    def energy(self, shifts: Field) -> float:
        """Return the elastic energy [J]."""
        return self.roller.energy(self.approaches(shifts))

    def forces(self, shifts: Field) -> Field:
        """Return radial and axial force [N], and 0."""
        loads = self.roller.loads(self.approaches(shifts)).sum(axis=1)
        return np.asarray(self.directions @ loads)

    def tangent(self, shifts: Field) -> Field:
        """Return d(force)/d(shift), shape (3, 3) [N/m]."""
        slopes = self.roller.slopes(self.approaches(shifts))
        return np.asarray((self.directions * slopes) @ self.directions.T)


def half_zone_ratio(exponent: float) -> float:
    """Return J_a(1/2)/J_r(1/2): thrust over F_r tan α that loads half of the elements.

    The integrals over half of the circle are W(n) = (√π/2) Γ((n + 1)/2)/Γ(n/2 + 1).
    """

    def integral(power: float) -> float:
        return math.gamma((power + 1.0) / 2.0) / math.gamma(power / 2.0 + 1.0)

    return integral(exponent) / integral(exponent + 1.0)
