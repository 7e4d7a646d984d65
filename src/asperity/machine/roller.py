"""Cylindrical roller bearing under radial load: load zone and sliced rollers (ISO 16281).

`SlicedRoller` and `roller_contacts` serve all roller bearings. Rings are rigid and parallel. The
stiffness of ISO 16281 holds for steel and both contacts of a roller in series. Ribs, misalignment
and edge stress of roller ends are not modelled.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Literal, get_args

import numpy as np
import scipy

from asperity.contact.conditions import ElasticPair
from asperity.core.arrays import Field
from asperity.core.errors import BadInput, require_choice, require_positive
from asperity.machine.element import MachineContact
from asperity.machine.rolling import (
    STEEL_DENSITY,
    RollingKinematics,
    centrifugal_notes,
    double_until,
    load_zone_notes,
)

RollerProfile = Literal["straight", "iso"]
SLICES = 30  # minimum number of ISO 16281
EXPONENT = 10.0 / 9.0  # load of a line contact as a power of its deflection
STIFFNESS = 35948.0  # N/mm^(10/9) at an effective length of 1 mm, scales with L^(8/9) (ISO 16281)
STEEL = 226.4e9, 0.05  # E' of the stiffness [Pa], and relative tolerance
MAX_CLEARANCE = 0.05  # over the roller's diameter


@dataclass(frozen=True, kw_only=True)
class SlicedRoller:
    """Roller between two steel raceways, by slices (ISO 16281).

    Parameters
    ----------
    diameter, length : of the roller [m]; the length without end radii and undercuts
    profile : "straight", or "iso" for the logarithmic profile of ISO 16281
    slices : number of slices
    """

    diameter: float
    length: float
    profile: RollerProfile = "straight"
    slices: int = SLICES

    def __post_init__(self) -> None:
        require_positive("roller_length", self.length, "m")
        require_choice("profile", self.profile, get_args(RollerProfile))
        if self.slices < SLICES:
            raise BadInput(
                f"slices must be at least {SLICES}, as required by ISO 16281, got {self.slices}; "
                "use more slices"
            )

    @cached_property
    def centres(self) -> Field:
        """Centres of the slices along the roller, from its middle [m]."""
        return self.length * ((np.arange(self.slices) + 0.5) / self.slices - 0.5)

    @cached_property
    def drop(self) -> Field:
        """Profile drop of one contact at the centres of the slices [m]."""
        if self.profile == "straight":
            return np.zeros(self.slices)
        return iso_profile(self.centres, self.length, self.diameter)

    def loads(self, approach: Field) -> Field:
        """Return the loads of the slices [N] for approaches of the raceways [m].

        Shape (rollers, slices); c_L δ^(10/9)/n_s with the deflection δ of both contacts.
        """
        elastic = 1e3 * self._deflections(approach)  # mm
        stiffness = STIFFNESS * (1e3 * self.length) ** (8.0 / 9.0) / self.slices
        return np.asarray(stiffness * elastic**EXPONENT)

    def slopes(self, approach: Field) -> Field:
        """Return d(load)/d(approach) of the rollers [N/m], shape (rollers,)."""
        elastic, loads = self._deflections(approach), self.loads(approach)
        slopes = np.divide(loads, elastic, out=np.zeros_like(loads), where=elastic > 0.0)
        return np.asarray(EXPONENT * slopes.sum(axis=1))

    def energy(self, approach: Field) -> float:
        """Return the elastic energy of all rollers [J]."""
        return float(np.sum(self.loads(approach) * self._deflections(approach)) / (EXPONENT + 1.0))

    def _deflections(self, approach: Field) -> Field:
        return np.asarray(np.maximum(approach[:, None] - 2.0 * self.drop, 0.0))


class RollerBearing(ABC):
    """Bearing with equally spaced rollers, solved by slices."""

    place: ClassVar[str] = "cycle_angle"

    rollers: int
    roller_diameter: float
    roller_length: float
    profile: RollerProfile
    slices: int

    @property
    @abstractmethod
    def kinematics(self) -> RollingKinematics:
        """Speeds and frequencies."""

    @property
    def angles(self) -> Field:
        """Positions of the rollers, from the direction of the radial load [rad]."""
        return 2.0 * np.pi * np.arange(self.rollers) / self.rollers

    @property
    def frequencies(self) -> dict[str, float]:
        """Frequencies of shaft, rings, roller and cage [Hz]."""
        return self.kinematics.frequencies

    @cached_property
    def _roller(self) -> SlicedRoller:
        """A roller by slices."""
        return SlicedRoller(
            diameter=self.roller_diameter,
            length=self.roller_length,
            profile=self.profile,
            slices=self.slices,
        )


@dataclass(frozen=True, kw_only=True)
class CylindricalRollerBearing(RollerBearing):
    """Cylindrical roller bearing with a rotating inner ring.

    Parameters
    ----------
    rollers : number of rollers
    roller_diameter : [m]
    roller_length : effective length, without end radii and undercuts [m]
    pitch_diameter : [m]
    radial_load : [N]
    speed : speed of the inner ring [rad/s]
    clearance : diametral clearance [m]; negative: preload
    profile : "straight", or "iso" for the logarithmic profile of ISO 16281
    slices : number of slices of a roller

    Raises
    ------
    BadInput
        The rollers do not fit, or none carries load.

    Examples
    --------
    >>> from asperity.contact.conditions import ElasticPair
    >>> from asperity.machine import CylindricalRollerBearing
    >>> steel = ElasticPair(youngs_moduli=(206e9, 206e9), poisson_ratios=(0.3, 0.3))
    >>> bearing = CylindricalRollerBearing(
    ...     rollers=14,
    ...     roller_diameter=9e-3,
    ...     roller_length=10e-3,
    ...     pitch_diameter=45e-3,
    ...     radial_load=4000.0,
    ...     speed=157.0,
    ... )
    >>> f"{max(contact.load for contact in bearing.contacts(steel)):.0f} N"
    '1167 N'
    """

    type_name: ClassVar[str] = "Cylindrical roller bearing"

    rollers: int
    roller_diameter: float
    roller_length: float
    pitch_diameter: float
    radial_load: float
    speed: float
    clearance: float = 0.0
    profile: RollerProfile = "straight"
    slices: int = SLICES

    def __post_init__(self) -> None:
        _ = self._roller  # checks length, profile and slices
        _ = self.kinematics  # checks the number of rollers, diameters and speed
        require_load(self.radial_load, self.clearance, self.roller_diameter, "roller")

    @cached_property
    def kinematics(self) -> RollingKinematics:
        """Speeds and frequencies of the bearing."""
        return RollingKinematics(
            count=self.rollers,
            diameter=self.roller_diameter,
            pitch_diameter=self.pitch_diameter,
            speed=self.speed,
        )

    @cached_property
    def shift(self) -> float:
        """Displacement of the inner ring along the load, at equilibrium [m]."""

        def excess(shift: float) -> float:
            return (
                float(np.cos(self.angles) @ self._slice_loads(shift).sum(axis=1)) - self.radial_load
            )

        if excess(0.0) >= 0.0:
            return 0.0
        upper = double_until(1e-6 + abs(self.clearance), lambda shift: excess(shift) > 0.0)
        return float(scipy.optimize.brentq(excess, 0.0, upper, xtol=1e-18, rtol=1e-14))

    @cached_property
    def slice_loads(self) -> Field:
        """Loads of all slices [N], shape (rollers, slices)."""
        return self._slice_loads(self.shift)

    def stiffness_matrix(self, pair: ElasticPair) -> Field:  # noqa: ARG002 (ISO's stiffness of steel)
        """Return d(force)/d(shift) of the inner ring along the load [N/m], shape (1, 1)."""
        slopes = self._roller.slopes(self._approaches(self.shift))
        return np.array([[float(np.cos(self.angles) ** 2 @ slopes)]])

    @property
    def loads(self) -> Field:
        """Loads of the rollers [N]."""
        loads: Field = self.slice_loads.sum(axis=1)
        return loads

    def contacts(self, pair: ElasticPair) -> tuple[MachineContact, ...]:
        """Return both contacts of each loaded roller."""
        return self.contacts_at(self.angles, pair)

    def contacts_at(self, positions: Field, pair: ElasticPair) -> tuple[MachineContact, ...]:  # noqa: ARG002 (ISO's stiffness of steel)
        """Return both contacts of loaded rollers at some positions from the load [rad]."""
        approaches = self.shift * np.cos(positions) - self.clearance / 2.0
        slice_loads = self._roller.loads(approaches)
        return roller_contacts(
            positions,
            (slice_loads, slice_loads),
            self.kinematics.radii,
            self.kinematics,
            self.roller_length,
        )

    @property
    def cage_speed(self) -> float:
        """Speed of the cage [rad/s]."""
        return self.kinematics.cage_speed

    def notes(self, pair: ElasticPair) -> tuple[str, ...]:
        """Return the limits of the model."""
        mass = STEEL_DENSITY * math.pi / 4.0 * self.roller_diameter**2 * self.roller_length
        centrifugal = centrifugal_notes(self.kinematics.centrifugal_load(mass), self.contacts(pair))
        return (
            "Rings are rigid and parallel; ribs, misalignment and the stress at roller ends are "
            "not covered.",
            *steel_notes(pair),
            *load_zone_notes(self.loads.tolist(), "roller"),
            *centrifugal,
        )

    def title(self) -> str:
        """Return a short description with the number of loaded rollers."""
        loaded = int(np.sum(self.loads > 0.0))
        return f"{self.type_name}, {loaded} of {self.rollers} rollers loaded"

    def _approaches(self, shift: float) -> Field:
        return np.asarray(shift * np.cos(self.angles) - self.clearance / 2.0)

    def _slice_loads(self, shift: float) -> Field:
        return self._roller.loads(self._approaches(shift))


def roller_contacts(
    positions: Field,
    slice_loads: tuple[Field, Field],
    radii: tuple[float, float],
    kinematics: RollingKinematics,
    length: float,
) -> tuple[MachineContact, ...]:
    """Return both contacts of each loaded roller, solved for its most loaded slice.

    Parameters
    ----------
    positions : of the rollers, from the direction of the load [rad]
    slice_loads : at the inner and the outer ring [N], each of shape (rollers, slices)
    radii : effective radii at the inner and the outer ring [m]
    kinematics : of the bearing
    length : of the rollers [m]
    """
    contacts = []
    per_length = slice_loads[0].shape[1] / length
    rings = "inner ring", "outer ring"
    for number, position in enumerate(positions):
        for ring, radius, loads, passages in zip(
            rings, radii, slice_loads, kinematics.overrolling_hz, strict=True
        ):
            slices = loads[number]
            if slices.sum() > 0.0:
                contact = MachineContact(
                    name=f"roller {number}, {ring}",
                    bodies=(ring, "roller"),
                    position=float(position),
                    load=float(slices.sum()),
                    geometry="line",
                    radius=radius,
                    length=length,
                    surface_speeds=(kinematics.surface_speed, kinematics.surface_speed),
                    overrolling_hz=passages,
                    max_line_load=float(slices.max()) * per_length,
                )
                contacts.append(contact)
    return tuple(contacts)


def steel_notes(pair: ElasticPair) -> tuple[str, ...]:
    """Return a note that the stiffness is that of steel, for other materials."""
    if abs(pair.effective_modulus / STEEL[0] - 1.0) <= STEEL[1]:
        return ()
    return (
        "The load zone is that of steel rollers and rings (ISO 16281), regardless of [material].",
    )


def iso_profile(along: Field, length: float, diameter: float) -> Field:
    """Return the profile drop of ISO 16281 [m], `along` the axis from the middle; infinite at ends.

    0.35e-3 D ln(1/(1 - (2x/L)²)); rollers longer than 2.5 D have a straight middle and the factor
    0.5e-3.
    """
    profiled = 2.5 * diameter
    if length <= profiled:
        return np.asarray(-0.35e-3 * diameter * np.log(1.0 - (2.0 * along / length) ** 2))
    ratio = np.maximum(2.0 * np.abs(along) - (length - profiled), 0.0) / profiled
    return np.asarray(-0.5e-3 * diameter * np.log(1.0 - ratio**2))


def require_load(load: float, clearance: float, diameter: float, element: str) -> None:
    """Raise BadInput if no rolling element carries load, or the clearance is implausible."""
    if not 0.0 <= load < math.inf:
        raise BadInput(f"the load must not be negative, got {load:g} N; correct its sign")
    if load == 0.0 and clearance >= 0.0:
        raise BadInput(
            f"a clearance of {1e6 * clearance:g} um without a load unloads every {element}; give a "
            "load, or a negative clearance for preload"
        )
    if abs(clearance) > MAX_CLEARANCE * diameter:
        raise BadInput(
            f"clearance must be at most {1e6 * MAX_CLEARANCE * diameter:.0f} um, a twentieth of "
            f"the {element}'s diameter, got {1e6 * clearance:g} um; lower it"
        )
