"""Table of oils with measured viscosity and pressure-viscosity coefficient."""

import csv
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from asperity.core.errors import BadInput
from asperity.lubricant.data_sheet import OilSheet
from asperity.lubricant.friction import ZERO_CELSIUS
from asperity.lubricant.walther import HOT, WARM, Walther

SOURCE = "Stachowiak and Batchelor, Engineering Tribology, table 2.3"
_CELSIUS = (30, 60, 100)  # temperatures of measurement


@dataclass(frozen=True, slots=True)
class MeasuredOil:
    """Mineral oil at 30, 60 and 100 °C: dynamic viscosities [Pa s] and alphas [1/Pa].

    `alphas` are slopes at ambient pressure, None if not measured. `index` is the class of the
    viscosity index: high, medium or low.
    """

    name: str
    index: str
    viscosities: tuple[float, ...]
    alphas: tuple[float | None, ...]

    def sheet(self, temperature: float) -> OilSheet:
        """Return the oil at a temperature [K], interpolated by D341 and linearly in alpha.

        The density is estimated. Raises BadInput outside the temperatures of measurement.
        """
        celsius = temperature - ZERO_CELSIUS
        for low in (0, 1):
            first = self.alphas[low]
            last = self.alphas[low + 1]
            if (
                first is None
                or last is None
                or not _CELSIUS[low] <= round(celsius, 9) <= _CELSIUS[low + 1]
            ):
                continue
            weight = (celsius - _CELSIUS[low]) / (_CELSIUS[low + 1] - _CELSIUS[low])
            line = self._line(low)
            return OilSheet(
                viscosity_40=line(WARM),
                viscosity_100=line(HOT),
                alpha=first + weight * (last - first),
                measured=f"{self.name}, {SOURCE}",
            )
        lowest = next(
            t for t, alpha in zip(_CELSIUS, self.alphas, strict=True) if alpha is not None
        )
        raise BadInput(
            f"temperature must lie between {lowest} and 100 degC, where the oil {self.name} was "
            f"measured, got {celsius:.4g} degC; correct it, or give the oil by its grade"
        )

    def _line(self, low: int) -> Walther:
        """Fit D341 to two viscosities; iterate, as kinematic viscosity and density are coupled."""
        density = OilSheet(grade="VG 100").density
        for _ in range(8):  # converges to 1e-12: a decade of viscosity changes density by 5 %
            points = [
                (t + ZERO_CELSIUS, self.viscosities[i] / density(t + ZERO_CELSIUS))
                for i, t in _pair(low)
            ]
            line = Walther.through(points[0], points[1])
            density = OilSheet(viscosity_40=line(WARM), viscosity_100=line(HOT)).density
        return line


def _pair(low: int) -> list[tuple[int, int]]:
    return [(i, _CELSIUS[i]) for i in (low, low + 1)]


@cache
def measured_oils() -> dict[str, MeasuredOil]:
    """Return the table of measured oils by name.

    Examples
    --------
    >>> from asperity.lubricant import measured_oils
    >>> sorted(measured_oils())[:2]
    ['cylinder high-VI', 'cylinder low-VI']
    """
    lines = files("asperity.lubricant").joinpath("measured.csv").read_text("utf-8").splitlines()
    oils = {}
    for row in csv.DictReader(lines):
        alphas = (row[f"alpha_{t}_1_gpa"] for t in _CELSIUS)
        oils[row["name"]] = MeasuredOil(
            row["name"],
            row["index"],
            tuple(1e-3 * float(row[f"eta_{t}_mpa_s"]) for t in _CELSIUS),
            tuple(1e-9 * float(text) if text else None for text in alphas),
        )
    return oils
