"""[sensing]: electrical and acoustic properties."""

from typing import Annotated

from asperity.case.messages import Section
from asperity.case.units import OPTIONAL, PAIRED, Length, Number, amount_in, default_amount, plain
from asperity.solution import Sensing

_DEFAULT = Sensing()
_Resistivity = Annotated[float, amount_in("ohm m")]


class SensingSection(Section):
    """[sensing]: what capacitance, contact resistance and ultrasonic reflection depend on."""

    permittivity: Number = _DEFAULT.permittivity
    resistivity: Annotated[tuple[_Resistivity, _Resistivity], PAIRED] = (
        default_amount(_DEFAULT.resistivity[0], "ohm m"),
        default_amount(_DEFAULT.resistivity[1], "ohm m"),
    )
    film_resistivity: Annotated[float, amount_in("ohm m^2", 0.0)] = default_amount(
        _DEFAULT.film_resistivity, "ohm m^2"
    )
    boundary_film: Annotated[Length | None, OPTIONAL] = None
    ultrasonic_frequency: Annotated[float, amount_in("Hz")] = default_amount(
        _DEFAULT.ultrasonic_frequency_hz, "Hz"
    )

    def sensing(self) -> Sensing:
        """Return the properties in SI units."""
        return Sensing(
            permittivity=self.permittivity,
            resistivity=plain(self.resistivity),
            film_resistivity=plain(self.film_resistivity),
            boundary_film=plain(self.boundary_film),
            ultrasonic_frequency_hz=plain(self.ultrasonic_frequency),
        )
