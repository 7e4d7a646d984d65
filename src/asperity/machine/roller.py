"""A cylindrical roller bearing under radial load: load zone with clearance, rollers in slices (ISO 16281).

Rings are rigid and parallel. ISO's stiffness is that of steel on steel, of both contacts of a
roller together. Ribs, misalignment and the edge stress of roller ends are not covered.
"""

import math
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
    grown,
    load_zone_notes,
)

RollerProfile = Literal["straight", "iso"]
SLICES = 30  # the fewest that ISO 16281 takes
EXPONENT = 10.0 / 9.0  # of a line contact's load over its deflection
STIFFNESS = (
    35948.0  # N/mm^(10/9) at an effective length of 1 mm; grows with its power 8/9 (ISO 16281)
)
STEEL = 226.4e9, 0.05  # E' that the stiffness is for [Pa], and how far another may be off
WIDEST_PLAY = 0.05  # of the roller's diameter


@dataclass(frozen=True, kw_only=True)
class CylindricalRollerBearing:
    """A cylindrical roller bearing, its inner ring turning.

    Parameters
    ----------
    rollers : how many
    roller_diameter : [m]
    roller_length : effective, less end radii and undercuts [m]
    pitch_diameter : [m]
    radial_load : [N]
    speed : of the inner ring [rad/s]
    clearance : diametral [m]; negative: preload
    profile : "straight", or "iso", ISO 16281's logarithmic drop of a cylindrical roller's ends
    slices : of a roller

    Raises
    ------
    BadInput
        for rollers that do not fit, or none of which carries.
    """

    place: ClassVar[str] = "cycle_angle"

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
        require_positive("roller_length", self.roller_length, "m")
        require_choice("profile", self.profile, get_args(RollerProfile))
        _ = self.kinematics
        require_carried(self.radial_load, self.clearance, self.roller_diameter, "roller")
        if self.slices < SLICES:
            raise BadInput(
                f"slices must be at least {SLICES}, as ISO 16281 has it, got {self.slices}; raise it"
            )

    @cached_property
    def kinematics(self) -> RollingKinematics:
        """What turns how fast."""
        return RollingKinematics(
            count=self.rollers,
            diameter=self.roller_diameter,
            pitch_diameter=self.pitch_diameter,
            speed=self.speed,
        )

    @property
    def angles(self) -> Field:
        """Where the rollers are, from the direction of the load [rad]."""
        return 2.0 * np.pi * np.arange(self.rollers) / self.rollers

    @cached_property
    def slice_centres(self) -> Field:
        """Along a roller, from its middle [m]."""
        return self.roller_length * ((np.arange(self.slices) + 0.5) / self.slices - 0.5)

    @cached_property
    def drop(self) -> Field:
        """Of one contact's profile at the slices' centres [m]."""
        if self.profile == "straight":
            return np.zeros(self.slices)
        return iso_profile(self.slice_centres, self.roller_length, self.roller_diameter)

    @cached_property
    def shift(self) -> float:
        """Of the inner ring against the outer one, along the load [m]: where the rollers carry the load."""

        def excess(shift: float) -> float:
            return (
                float(np.cos(self.angles) @ self._slice_loads(shift).sum(axis=1)) - self.radial_load
            )

        if excess(0.0) >= 0.0:
            return 0.0
        enough = grown(1e-6 + abs(self.clearance), lambda shift: excess(shift) > 0.0)
        return float(scipy.optimize.brentq(excess, 0.0, enough, xtol=1e-18, rtol=1e-14))

    @cached_property
    def slice_loads(self) -> Field:
        """On every slice of every roller [N], shape (rollers, slices)."""
        return self._slice_loads(self.shift)

    @property
    def loads(self) -> Field:
        """On every roller [N]."""
        loads: Field = self.slice_loads.sum(axis=1)
        return loads

    def contacts(self, pair: ElasticPair) -> tuple[MachineContact, ...]:  # noqa: ARG002 (ISO's stiffness of steel)
        """Both contacts of every loaded roller."""
        found, kinematics, per_length = [], self.kinematics, self.slices / self.roller_length
        for number, (angle, slices) in enumerate(zip(self.angles, self.slice_loads, strict=True)):
            for ring, radius, passages in zip(
                ("inner ring", "outer ring"),
                kinematics.radii,
                kinematics.overrolling_hz,
                strict=True,
            ):
                if slices.sum() > 0.0:
                    contact = MachineContact(
                        name=f"roller {number}, {ring}",
                        bodies=(ring, "roller"),
                        position=float(angle),
                        load=float(slices.sum()),
                        geometry="line",
                        radius=radius,
                        length=self.roller_length,
                        surface_speeds=(kinematics.surface_speed, kinematics.surface_speed),
                        overrolling_hz=passages,
                        heaviest_line_load=float(slices.max()) * per_length,
                    )
                    found.append(contact)
        return tuple(found)

    @property
    def frequencies(self) -> dict[str, float]:
        """Of shaft, rings, roller and cage [Hz]."""
        return self.kinematics.frequencies

    def notes(self, pair: ElasticPair) -> tuple[str, ...]:
        """What the model leaves out, and where it does not hold."""
        mass = STEEL_DENSITY * math.pi / 4.0 * self.roller_diameter**2 * self.roller_length
        said = [
            "Rings are rigid and parallel; ribs, misalignment and the stress at roller ends are not covered."
        ]
        if abs(pair.effective_modulus / STEEL[0] - 1.0) > STEEL[1]:
            said.append(
                "The load zone is that of steel rollers and rings (ISO 16281), whatever [material] says."
            )
        centrifugal = centrifugal_notes(self.kinematics.centrifugal_load(mass), self.contacts(pair))
        return (*said, *load_zone_notes(self.loads.tolist(), "roller"), *centrifugal)

    def title(self) -> str:
        """Rollers and how many of them carry."""
        return f"Cylindrical roller bearing, {int(np.sum(self.loads > 0.0))} of {self.rollers} rollers loaded"

    def _slice_loads(self, shift: float) -> Field:
        approach = 1e3 * (shift * np.cos(self.angles) - self.clearance / 2.0)  # mm
        elastic = np.maximum(approach[:, None] - 2e3 * self.drop, 0.0)
        stiffness = STIFFNESS * (1e3 * self.roller_length) ** (8.0 / 9.0) / self.slices
        return np.asarray(stiffness * elastic**EXPONENT)


def iso_profile(along: Field, length: float, diameter: float) -> Field:
    """ISO 16281's drop of a cylindrical roller [m], `along` its axis from the middle; infinite at its very end.

    0.35e-3 D ln(1/(1 - (2x/L)²)); of rollers longer than 2.5 D the middle is straight and the
    factor 0.5e-3.
    """
    ends = 2.5 * diameter
    if length <= ends:
        return np.asarray(-0.35e-3 * diameter * np.log(1.0 - (2.0 * along / length) ** 2))
    beyond = np.maximum(2.0 * np.abs(along) - (length - ends), 0.0) / ends
    return np.asarray(-0.5e-3 * diameter * np.log(1.0 - beyond**2))


def require_carried(load: float, clearance: float, diameter: float, element: str) -> None:
    """BadInput where no rolling element carries, or there is more play than any bearing has."""
    if not 0.0 <= load < math.inf:
        raise BadInput(f"the load must not be negative, got {load:g} N; correct its sign")
    if load == 0.0 and clearance >= 0.0:
        raise BadInput(
            f"a clearance of {1e6 * clearance:g} um without a load unloads every {element}; give a load, or a "
            "negative clearance for preload"
        )
    if abs(clearance) > WIDEST_PLAY * diameter:
        raise BadInput(
            f"clearance must be at most {1e6 * WIDEST_PLAY * diameter:.0f} um, a twentieth of the {element}'s "
            f"diameter, got {1e6 * clearance:g} um, which holds no {element} in place; lower it"
        )
