"""Kinematics of rolling bearings: what turns how fast, and how often what passes."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from asperity.core.errors import BadInput, require_positive
from asperity.machine.element import MachineContact, require_count, turns

STEEL_DENSITY = 7800.0  # kg/m^3
WORTH_SAYING = 0.01  # centrifugal load over the largest contact load


@dataclass(frozen=True, kw_only=True)
class RollingKinematics:
    """Rolling elements between two rings, of which the inner one turns, without slip.

    Parameters
    ----------
    count : rolling elements
    diameter : of one [m]
    pitch_diameter : of the circle of their centres [m]
    speed : of the inner ring [rad/s]
    contact_angle : [rad]
    """

    count: int
    diameter: float
    pitch_diameter: float
    speed: float
    contact_angle: float = 0.0

    def __post_init__(self) -> None:
        require_count("the number of rolling elements", self.count, 3)
        require_positive("the diameter of rolling elements", self.diameter, "m")
        require_positive("pitch_diameter", self.pitch_diameter, "m")
        require_positive("speed", self.speed, "rad/s")
        if self.diameter >= self.pitch_diameter * math.sin(math.pi / self.count):
            raise BadInput(
                f"{self.count} rolling elements of {1e3 * self.diameter:g} mm do not fit on a pitch_diameter of "
                f"{1e3 * self.pitch_diameter:g} mm; lower their number or raise pitch_diameter"
            )

    @property
    def ratio(self) -> float:
        """γ = D cos α/d_m."""
        return self.diameter * math.cos(self.contact_angle) / self.pitch_diameter

    @property
    def cage_speed(self) -> float:
        """[rad/s]: ω_i (1 - γ)/2."""
        return self.speed * (1.0 - self.ratio) / 2.0

    @property
    def spin(self) -> float:
        """Of a rolling element about its own axis, in the frame of the cage [rad/s]: (d_m/2D)(1 - γ²) ω_i."""
        return self.pitch_diameter / (2.0 * self.diameter) * (1.0 - self.ratio**2) * self.speed

    @property
    def surface_speed(self) -> float:
        """Of every surface of both contacts, in the frame of the cage [m/s]: (d_m/4)(1 - γ²) ω_i."""
        return self.pitch_diameter / 4.0 * (1.0 - self.ratio**2) * self.speed

    @property
    def radii(self) -> tuple[float, float]:
        """Effective radius along rolling at the inner and the outer ring [m]: (D/2)(1 ∓ γ)."""
        return self.diameter / 2.0 * (1.0 - self.ratio), self.diameter / 2.0 * (1.0 + self.ratio)

    @property
    def frequencies(self) -> dict[str, float]:
        """Shaft, passages over the outer and inner ring, rolling element about its axis, and cage [Hz]."""
        cage = turns(self.cage_speed)
        return {
            "shaft_hz": turns(self.speed),
            "bpfo_hz": self.count * cage,
            "bpfi_hz": self.count * (turns(self.speed) - cage),
            "bsf_hz": turns(self.spin),
            "ftf_hz": cage,
        }

    @property
    def overrolling_hz(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Of ring and rolling element, at the inner and at the outer ring [Hz]."""
        found = self.frequencies
        return (found["bpfi_hz"], found["bsf_hz"]), (found["bpfo_hz"], found["bsf_hz"])

    def centrifugal_load(self, mass: float) -> float:
        """Of a rolling element of this mass [kg], on the outer ring [N]."""
        return mass * self.pitch_diameter / 2.0 * self.cage_speed**2


def centrifugal_notes(load: float, contacts: tuple[MachineContact, ...]) -> tuple[str, ...]:
    """That the centrifugal load is left out, where it would count."""
    largest = max(contact.load for contact in contacts)
    if load <= WORTH_SAYING * largest:
        return ()
    return (
        f"The centrifugal load of {load:.3g} N on the outer ring is left out (largest load {largest:.4g} N).",
    )


def load_zone_notes(loads: list[float], element: str) -> tuple[str, ...]:
    """That one rolling element alone bears the load, or where they stand."""
    if sum(load > 0.0 for load in loads) == 1:
        return (f"One {element} alone carries the whole load.",)
    if max(loads) == min(loads):
        return ()
    return (
        f"{element.capitalize()} 0 stands under the radial load; where it passes between two, they bear less.",
    )


def grown(start: float, enough: Callable[[float], bool]) -> float:
    """`start`, doubled until it is enough."""
    value = start
    while not enough(value):
        value *= 2.0
    return value
