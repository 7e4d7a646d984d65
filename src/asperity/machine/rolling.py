"""Kinematics of rolling bearings: speeds and characteristic frequencies."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from asperity.core.errors import BadInput, require_positive
from asperity.machine.element import MachineContact, require_count, rotation_hz

STEEL_DENSITY = 7800.0  # kg/m^3
CENTRIFUGAL_THRESHOLD = 0.01  # centrifugal over largest contact load, above which a note is given


@dataclass(frozen=True, kw_only=True)
class RollingKinematics:
    """Rolling elements between a rotating inner and a fixed outer ring, without slip.

    Parameters
    ----------
    count : number of rolling elements
    diameter : diameter of a rolling element [m]
    pitch_diameter : diameter of the circle of their centres [m]
    speed : speed of the inner ring [rad/s]
    contact_angle : [rad]

    Examples
    --------
    >>> from asperity.machine import RollingKinematics
    >>> bearing = RollingKinematics(count=9, diameter=7.94e-3, pitch_diameter=39.04e-3, speed=188.0)
    >>> {name: round(hz, 1) for name, hz in bearing.frequencies.items()}
    {'shaft_hz': 29.9, 'bpfo_hz': 107.3, 'bpfi_hz': 162.0, 'bsf_hz': 70.5, 'ftf_hz': 11.9}
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
                f"{self.count} rolling elements of {1e3 * self.diameter:g} mm do not fit on a "
                f"pitch_diameter of {1e3 * self.pitch_diameter:g} mm; lower their number or raise "
                "pitch_diameter"
            )

    @property
    def ratio(self) -> float:
        """γ = D cos α/d_m."""
        return self.diameter * math.cos(self.contact_angle) / self.pitch_diameter

    @property
    def cage_speed(self) -> float:
        """Speed of the cage [rad/s]: ω_i (1 - γ)/2."""
        return self.speed * (1.0 - self.ratio) / 2.0

    @property
    def spin(self) -> float:
        """Speed of a rolling element about its axis [rad/s]: (d_m/2D)(1 - γ²) ω_i."""
        return self.pitch_diameter / (2.0 * self.diameter) * (1.0 - self.ratio**2) * self.speed

    @property
    def surface_speed(self) -> float:
        """Speed of all surfaces in the frame of the cage [m/s]: (d_m/4)(1 - γ²) ω_i."""
        return self.pitch_diameter / 4.0 * (1.0 - self.ratio**2) * self.speed

    @property
    def radii(self) -> tuple[float, float]:
        """Effective radius along rolling at the inner and the outer ring [m]: (D/2)(1 ∓ γ)."""
        return self.diameter / 2.0 * (1.0 - self.ratio), self.diameter / 2.0 * (1.0 + self.ratio)

    @property
    def frequencies(self) -> dict[str, float]:
        """Frequencies of shaft, outer- and inner-ring passage, rolling element and cage [Hz]."""
        cage = rotation_hz(self.cage_speed)
        return {
            "shaft_hz": rotation_hz(self.speed),
            "bpfo_hz": self.count * cage,
            "bpfi_hz": self.count * (rotation_hz(self.speed) - cage),
            "bsf_hz": rotation_hz(self.spin),
            "ftf_hz": cage,
        }

    @property
    def overrolling_hz(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Overrolling rates of ring and rolling element, at the inner and the outer ring [Hz]."""
        hertz = self.frequencies
        return (hertz["bpfi_hz"], hertz["bsf_hz"]), (hertz["bpfo_hz"], hertz["bsf_hz"])

    def centrifugal_load(self, mass: float) -> float:
        """Return the centrifugal load of a rolling element of this mass [kg] [N]."""
        return mass * self.pitch_diameter / 2.0 * self.cage_speed**2


def centrifugal_notes(load: float, contacts: tuple[MachineContact, ...]) -> tuple[str, ...]:
    """Return a note that the centrifugal load is neglected, if it is relevant."""
    largest = max(contact.load for contact in contacts)
    if load <= CENTRIFUGAL_THRESHOLD * largest:
        return ()
    return (
        f"The centrifugal load of {load:.3g} N on the outer ring is neglected (largest load "
        f"{largest:.4g} N).",
    )


def load_zone_notes(loads: list[float], element: str) -> tuple[str, ...]:
    """Return a note on a single loaded element, or on the positions of the elements."""
    if sum(load > 0.0 for load in loads) == 1:
        return (f"A single {element} carries the whole load.",)
    if max(loads) == min(loads):
        return ()
    return (
        f"{element.capitalize()} 0 is in line with the radial load; the maximum load is smaller "
        f"when the load passes between two {element}s.",
    )


def double_until(start: float, sufficient: Callable[[float], bool]) -> float:
    """Double `start` until it is sufficient."""
    value = start
    while not sufficient(value):
        value *= 2.0
    return value
