"""Electrical and acoustic properties of a contact, for what sensors observe of it."""

from dataclasses import dataclass
from typing import Annotated

from asperity.core.errors import BadInput, require_positive
from asperity.core.quantities import Parameter, Parametric

MAX_PERMITTIVITY = 5.0  # polar liquids do not follow Clausius and Mossotti


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensing(Parametric):
    """Properties of oil and bodies that `observables` needs.

    Parameters
    ----------
    permittivity : relative permittivity of the oil at ambient pressure
    resistivity : resistivity of the two bodies [Ω m]; bearing steel by default
    film_resistivity : resistance of surface films on touching spots, times their area [Ω m²]
    boundary_film : thickness of an insulating film on touching cells, which are then capacitors
        [m]; None: they conduct and have no capacitance
    ultrasonic_frequency_hz : frequency of the ultrasonic reflection [Hz]

    Raises
    ------
    BadInput
        for a permittivity below 1 or above 5, and other values that are not positive
        (`film_resistivity` may be 0).
    """

    permittivity: Annotated[float, Parameter("", "ε_r")] = 2.2
    resistivity: tuple[float, float] = (2.2e-7, 2.2e-7)
    film_resistivity: Annotated[float, Parameter("ohm m^2")] = 0.0
    boundary_film: Annotated[float | None, Parameter("m", positive="boundary_film")] = None
    ultrasonic_frequency_hz: Annotated[float, Parameter("Hz", positive="ultrasonic_frequency")] = (
        10e6
    )

    def __post_init__(self) -> None:
        Parametric.__post_init__(self)
        if not 1.0 <= self.permittivity <= MAX_PERMITTIVITY:
            raise BadInput(
                f"permittivity must be 1 to {MAX_PERMITTIVITY:g}, got {self.permittivity:g}: it "
                "follows the density as that of non-polar oils; mineral oils have 2.1 to 2.4"
            )
        for resistivity in self.resistivity:
            require_positive("resistivity", resistivity, "ohm m")
        if self.film_resistivity != 0.0:
            require_positive("film_resistivity", self.film_resistivity, "ohm m^2")
