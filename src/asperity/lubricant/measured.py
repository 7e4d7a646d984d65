"""Oils whose viscosity and pressure-viscosity coefficient were measured: a short table, and sheets made of it."""

import csv
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from asperity.core.errors import BadInput
from asperity.lubricant.data_sheet import OilSheet
from asperity.lubricant.friction import FREEZING
from asperity.lubricant.walther import HOT, WARM, Walther

SOURCE = "Stachowiak and Batchelor, Engineering Tribology, table 2.3"
_CELSIUS = (30, 60, 100)  # where they were measured


@dataclass(frozen=True, slots=True)
class MeasuredOil:
    """A mineral oil at 30, 60 and 100 °C: dynamic viscosities [Pa s] and alphas at ambient pressure [1/Pa].

    `index` says of which kind it is: of high, medium or low viscosity index. An alpha that was not
    measured is None.
    """

    name: str
    index: str
    viscosities: tuple[float, ...]
    alphas: tuple[float | None, ...]

    def sheet(self, temperature: float) -> OilSheet:
        """The oil at a temperature [K] between those where it was measured, by D341 and a straight line for alpha.

        Its density is estimated: the table has none. Raises BadInput outside.
        """
        celsius = temperature - FREEZING
        for low in (0, 1):
            first, last = self.alphas[low], self.alphas[low + 1]
            if (
                first is None
                or last is None
                or not _CELSIUS[low] <= round(celsius, 9) <= _CELSIUS[low + 1]
            ):
                continue
            share = (celsius - _CELSIUS[low]) / (_CELSIUS[low + 1] - _CELSIUS[low])
            line = self._line(low)
            return OilSheet(
                viscosity_40=line(WARM),
                viscosity_100=line(HOT),
                alpha=first + share * (last - first),
                measured=f"{self.name}, {SOURCE}",
            )
        least = next(t for t, alpha in zip(_CELSIUS, self.alphas, strict=True) if alpha is not None)
        raise BadInput(
            f"temperature must lie between {least} and 100 degC, where the oil {self.name} was measured, got "
            f"{celsius:.4g} degC; correct it, or give the oil by its grade"
        )

    def _line(self, low: int) -> Walther:
        """D341 through two of its viscosities; kinematic ones take the density, which takes the one at 40 °C."""
        density = OilSheet(grade="VG 100").density
        for _ in range(8):  # a decade of viscosity is 5 % of density: settled to 1e-12
            points = [
                (t + FREEZING, self.viscosities[i] / density(t + FREEZING)) for i, t in _pair(low)
            ]
            line = Walther.through(points[0], points[1])
            density = OilSheet(viscosity_40=line(WARM), viscosity_100=line(HOT)).density
        return line


def _pair(low: int) -> list[tuple[int, int]]:
    return [(i, _CELSIUS[i]) for i in (low, low + 1)]


@cache
def measured_oils() -> dict[str, MeasuredOil]:
    """The table, by name."""
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
