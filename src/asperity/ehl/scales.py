"""The units the solver thinks in: lengths along the surface in Hertz half-widths, pressures in p_h, gaps in a^2/R."""

from dataclasses import dataclass

from asperity.contact.conditions import ContactConditions
from asperity.lubricant import Lubricant


@dataclass(frozen=True, slots=True)
class Scales:
    """Half-width a [m], pressure p_h [Pa], gap a^2/R [m], and the speed number λ = 12 η₀ u R²/(a³ p_h) (0 when dry)."""

    length: float
    pressure: float
    gap: float
    speed: float

    @classmethod
    def from_conditions(
        cls, conditions: ContactConditions, lubricant: Lubricant | None
    ) -> "Scales":
        """Scales of a contact; a and R are those along rolling."""
        a, p_h, radius = (
            conditions.hertz.half_widths[0],
            conditions.hertz.p_max,
            conditions.radius_along_rolling,
        )
        eta0 = lubricant.viscosity.eta0 if lubricant else 0.0
        return cls(
            a,
            p_h,
            a**2 / radius,
            12.0 * eta0 * conditions.entrainment_speed * radius**2 / (a**3 * p_h),
        )
