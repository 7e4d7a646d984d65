"""How shear thins the oil: one frozen law a class. So far only the oil that does not."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Newtonian:
    """Shear stress proportional to shear rate; the effective viscosity is the viscosity itself."""


RHEOLOGY_LAWS: dict[str, type[Newtonian]] = {"newtonian": Newtonian}
