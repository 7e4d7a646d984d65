"""Units of the solver: Hertz half-widths along the surface, p_h for pressure, a²/R for gaps."""

from dataclasses import dataclass

from asperity.contact.conditions import ContactConditions
from asperity.lubricant import Lubricant


@dataclass(frozen=True, slots=True)
class Scales:
    """Half-width a [m], pressure p_h [Pa], gap a²/R [m] and speed number.

    The speed number is λ = 12 η₀ u R²/(a³ p_h), 0 for a dry contact.
    """

    length: float
    pressure: float
    gap: float
    speed: float

    @classmethod
    def from_conditions(
        cls, conditions: ContactConditions, lubricant: Lubricant | None
    ) -> "Scales":
        """Return the scales of a contact; a and R are those along rolling."""
        a = conditions.hertz.half_widths[0]
        p_h = conditions.hertz.p_max
        radius = conditions.radius_along_rolling
        eta0 = lubricant.viscosity.eta0 if lubricant else 0.0
        return cls(
            a,
            p_h,
            a**2 / radius,
            12.0 * eta0 * conditions.entrainment_speed * radius**2 / (a**3 * p_h),
        )
