"""Temperature-viscosity law (ASTM D341) and viscosity index (ASTM D2270) of kinematic viscosities.

The interface uses m^2/s; the standards, and computations inside this module, use mm^2/s.
"""

import math
from bisect import bisect_right
from dataclasses import dataclass

from asperity.core.errors import BadInput

WARM, HOT = 313.15, 373.15  # 40 and 100 °C, the temperatures of data sheets [K]
MM2 = 1e-6  # mm^2/s [m^2/s]
MIN_VISCOSITY = 0.21 * MM2  # lower limit of D341 [m^2/s]
MIN_VISCOSITY_OF_INDEX = 2.0 * MM2  # lower limit of D2270, at 100 °C [m^2/s]
# Fits of D2270's appendix to its table: lower limit of the viscosity Y at 100 °C [mm^2/s], and
# coefficients of L and H, a Y² + b Y + c
_BASIC_OILS = (
    (2.0, (1.14673, 1.7576, -0.109), (0.84155, 1.5521, -0.077)),
    (3.8, (3.38095, -15.4952, 33.196), (0.78571, 1.7929, -0.183)),
    (4.4, (2.5, -7.2143, 13.812), (0.82143, 1.5679, 0.119)),
    (5.0, (0.101, 16.635, -45.469), (0.04985, 9.1613, -18.557)),
    (6.4, (3.35714, -23.5643, 78.466), (0.22619, 7.7369, -16.656)),
    (7.0, (0.01191, 21.475, -72.87), (0.79762, -0.7321, 14.61)),
    (7.7, (0.41858, 16.1558, -56.04), (0.05794, 10.5156, -28.24)),
    (9.0, (0.88779, 7.5527, -16.6), (0.26665, 6.7015, -10.81)),
    (12.0, (0.7672, 10.7972, -38.18), (0.20073, 8.4658, -22.49)),
    (15.0, (0.97305, 5.3135, -2.2), (0.28889, 5.9741, -4.93)),
    (18.0, (0.97256, 5.25, -0.98), (0.24504, 7.416, -16.73)),
    (22.0, (0.91413, 7.4759, -21.82), (0.20323, 9.1267, -34.23)),
    (28.0, (0.87031, 9.7157, -50.77), (0.18411, 10.1015, -46.75)),
    (40.0, (0.84703, 12.6752, -133.31), (0.17029, 11.4866, -80.62)),
    (55.0, (0.85921, 11.1009, -83.19), (0.1713, 11.368, -76.94)),
    (70.0, (0.83531, 14.6731, -216.246), (0.16841, 11.8493, -96.947)),
)


def _thin_oil_term(nu: float) -> float:
    """Return the term of D341 for thin oils; below 1e-3 above 2 mm^2/s."""
    return math.exp(-1.47 - 1.84 * nu - 0.51 * nu**2)


@dataclass(frozen=True, slots=True)
class Walther:
    """Walther's equation log₁₀ log₁₀ Z = A - B log₁₀ T. Source: ASTM D341.

    Z = ν + 0.7 + exp(-1.47 - 1.84 ν - 0.51 ν²), ν in mm²/s, T in kelvin.
    """

    a: float
    b: float

    @classmethod
    def through(cls, first: tuple[float, float], second: tuple[float, float]) -> "Walther":
        """Fit the line through two pairs of temperature [K] and kinematic viscosity [m^2/s]."""
        (x1, w1), (x2, w2) = (
            (math.log10(t), math.log10(math.log10(nu / MM2 + 0.7 + _thin_oil_term(nu / MM2))))
            for t, nu in (first, second)
        )
        b = (w1 - w2) / (x2 - x1)
        return cls(w1 + b * x1, b)

    def _z(self, temperature: float) -> float:
        return float(10.0**10.0 ** (self.a - self.b * math.log10(temperature)))

    def __call__(self, temperature: float) -> float:
        """Return ν [m²/s] at a temperature [K]."""
        without_term = self._z(temperature) - 0.7
        nu = without_term
        for _ in range(60):  # fixed-point iteration, contraction factor at most 0.42
            nu = without_term - _thin_oil_term(nu)
        return nu * MM2

    def thinning(self, temperature: float) -> float:
        """Return -d(ln ν)/dT [1/K]."""
        z = self._z(temperature)
        nu = self(temperature) / MM2
        slope = 1.0 - (1.84 + 1.02 * nu) * _thin_oil_term(nu)  # dZ/dν
        return self.b * z * math.log(z) / (nu * temperature * slope)


def _basic_oils(hot: float) -> tuple[float, float]:
    """Return L and H [mm^2/s], viscosities at 40 °C of oils of index 0 and 100.

    `hot` is their viscosity at 100 °C [mm^2/s].
    """
    row = _BASIC_OILS[bisect_right(_BASIC_OILS, hot, key=lambda entry: entry[0]) - 1]
    low, high = ((a * hot + b) * hot + c for a, b, c in row[1:])
    return low, high


def viscosity_index(viscosity_40: float, viscosity_100: float) -> float:
    """Return the viscosity index of kinematic viscosities [m^2/s] at 40 and 100 °C.

    L and H follow the standard's fits to its table, accurate to 0.1 %. Raises BadInput below 2
    mm²/s at 100 °C. Source: ASTM D2270, ISO 2909.

    Examples
    --------
    >>> from asperity.lubricant import viscosity_index
    >>> f"{viscosity_index(viscosity_40=46e-6, viscosity_100=6.8e-6):.0f}"
    '102'
    """
    warm = viscosity_40 / MM2
    hot = viscosity_100 / MM2
    if viscosity_100 < MIN_VISCOSITY_OF_INDEX:
        raise BadInput(
            f"a viscosity index is defined above 2 mm^2/s at 100 degC, got {hot:.4g} mm^2/s; "
            "give viscosity_40 and viscosity_100 without an index"
        )
    low, high = _basic_oils(hot)
    if warm > high:
        return 100.0 * (low - warm) / (low - high)
    exponent = math.log10(high / warm) / math.log10(hot)
    return 100.0 + float(10.0**exponent - 1.0) / 0.00715


def viscosity_100_of(viscosity_40: float, index: float) -> float:
    """Return the kinematic viscosity [m^2/s] at 100 °C from that at 40 °C and the viscosity index.

    Raises BadInput if no viscosity above 2 mm²/s has that index.

    Examples
    --------
    >>> from asperity.lubricant import viscosity_100_of
    >>> f"{viscosity_100_of(viscosity_40=46e-6, index=100.0) * 1e6:.2f} mm2/s"
    '6.76 mm2/s'
    """
    from scipy.optimize import brentq  # slow import, rarely needed

    lowest = MIN_VISCOSITY_OF_INDEX
    highest = viscosity_40
    if not (
        highest > lowest
        and viscosity_index(viscosity_40, lowest) <= index <= viscosity_index(viscosity_40, highest)
    ):
        raise BadInput(
            f"viscosity_index of {index:g} is impossible for {viscosity_40 / MM2:.4g} mm^2/s at 40 "
            "degC and at least 2 mm^2/s at 100 degC; give viscosity_100 instead"
        )
    return float(
        brentq(
            lambda hot: viscosity_index(viscosity_40, hot) - index,
            lowest,
            highest,
            xtol=1e-15,
            rtol=1e-12,
        )
    )
