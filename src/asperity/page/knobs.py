"""Knobs: the values of a case that can be turned, each named by the catalogue and written as the case file has it.

A case has the knobs of `TURNED` whose keys stand in its own tables. What a knob may be is not decided here: the case
refuses what it cannot take.
"""

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

from asperity.case import Case, split_amount
from asperity.errors import BadInput
from asperity.quantities import Quantity, quantity

PER_DECADE = 40  # steps of a knob that goes by factors
GRIDS = (64, 96, 128, 192, 256)  # cells along each axis that are offered
LONGEST = 200  # characters that a knob may be set to


class _Turned(NamedTuple):
    """A key that can be turned: its line in the catalogue, its group, how far it goes.

    `ends` are lowest value, highest and step of a plain number; an amount goes `decades` up and down from the case's
    own value. `more` are shown when more knobs are asked for.
    """

    quantity: str
    group: str
    ends: tuple[float, float, float] | None = None
    decades: float = 1.0
    more: bool = False


MOTION, OIL, ROUGHNESS, BODIES, VIBRATION, GRID = "Load and motion", "Oil", "Roughness", "Bodies", "Vibration", "Grid"
TURNED: dict[str, _Turned] = {
    "contact.load": _Turned("load_n", MOTION),
    "contact.entrainment_speed": _Turned("entrainment_speed_m_s", MOTION),
    "contact.slip": _Turned("slide_to_roll", MOTION, (-2.0, 2.0, 0.01)),
    "lubricant.temperature": _Turned("oil_temperature_k", OIL),
    "lubricant.viscosity_40": _Turned("oil_viscosity_40_m2_s", OIL),
    "lubricant.viscosity_100": _Turned("oil_viscosity_100_m2_s", OIL, more=True),
    "lubricant.viscosity.eta0": _Turned("oil_viscosity_pa_s", OIL),
    "lubricant.viscosity.alpha": _Turned("oil_alpha_1_pa", OIL, decades=0.3),
    "lubricant.alpha": _Turned("oil_alpha_1_pa", OIL, decades=0.3),
    "lubricant.rheology.tau0": _Turned("eyring_stress_pa", OIL, more=True),
    "surface.sq": _Turned("sq_m", ROUGHNESS),
    "surface.correlation_length.0": _Turned("correlation_length_x_m", ROUGHNESS),
    "surface.correlation_length.1": _Turned("correlation_length_y_m", ROUGHNESS),
    "surface.groove_width": _Turned("groove_width_m", ROUGHNESS),
    "surface.groove_length": _Turned("groove_length_m", ROUGHNESS),
    "surface.crater_radius": _Turned("crater_radius_m", ROUGHNESS),
    "surface.direction_deg": _Turned("lay_deg", ROUGHNESS, (-90.0, 90.0, 5.0)),
    "surface.skewness": _Turned("ssk", ROUGHNESS, (-2.0, 2.0, 0.05)),
    "surface.kurtosis": _Turned("sku", ROUGHNESS, (1.5, 10.0, 0.1)),
    "surface.hurst": _Turned("hurst", ROUGHNESS, (0.1, 1.0, 0.05)),
    "surface.plateau_share": _Turned("plateau_share", ROUGHNESS, (0.05, 0.95, 0.05)),
    "surface.place": _Turned("surface_place", ROUGHNESS, (0, 20, 1)),
    "surface.seed": _Turned("surface_seed", ROUGHNESS, (0, 50, 1)),
    "material.hardness": _Turned("hardness_pa", BODIES, decades=0.7),
    "material.boundary_friction": _Turned("boundary_friction", BODIES, (0.0, 0.4, 0.01)),
    "contact.radius": _Turned("radius_m", BODIES, decades=0.5, more=True),
    "vibration.mass": _Turned("mass_kg", VIBRATION, more=True),
    "vibration.damping_ratio": _Turned("damping_ratio", VIBRATION, (0.005, 0.2, 0.005), more=True),
    "grid.cells": _Turned("grid_cells", GRID),
}


@dataclass(frozen=True)
class Knob:
    """A value of a case that can be turned.

    `key` is the case file's (that of one entry of a pair ends in its number), `written` what the case has there: a
    quantity with its unit as text, a bare number, "auto" or two counts for the grid.
    """

    key: str
    written: Any

    @property
    def quantity(self) -> Quantity:
        """Its line in the catalogue."""
        return quantity(TURNED[self.key].quantity)

    @property
    def group(self) -> str:
        """What it is turned together with."""
        return TURNED[self.key].group

    @property
    def more(self) -> bool:
        """Whether it is one of those that few turn."""
        return TURNED[self.key].more

    @property
    def text(self) -> str:
        """What the case has, as one types it."""
        if isinstance(self.written, list):
            return " x ".join(str(count) for count in self.written)
        return str(self.written)

    @property
    def identifier(self) -> str:
        """The key as a name in HTML."""
        return self.key.replace(".", "-").replace("_", "-")

    @property
    def choices(self) -> tuple[str, ...]:
        """What it is chosen among; none where it is a number."""
        if self.key != "grid.cells":
            return ()
        offered = [f"{cells} x {cells}" for cells in GRIDS]
        return tuple(dict.fromkeys([self.text, *offered, "auto"]))

    @cached_property
    def _amount(self) -> tuple[float, str]:
        number, unit = split_amount(self.written)
        return float(number), unit

    @property
    def _even(self) -> bool:
        """Whether it is turned in even steps: plain numbers, and temperatures on a scale with a zero of its own."""
        return TURNED[self.key].ends is not None or self._amount[1] in ("degC", "degF") or self._amount[0] <= 0.0

    @property
    def ends(self) -> tuple[float, float, float]:
        """Lowest and highest value of the slider, and its step; of amounts in their own unit."""
        stated = TURNED[self.key].ends
        if stated is not None:
            low, high, step = stated
            return min(low, float(self.written)), max(high, float(self.written)), step
        return self._amount[0] - 60.0, self._amount[0] + 60.0, 1.0

    @property
    def positions(self) -> tuple[int, int]:
        """The slider's first and last position."""
        if not self._even:
            reach = round(TURNED[self.key].decades * PER_DECADE)
            return -reach, reach
        low, high, step = self.ends
        return 0, round((high - low) / step)

    def at(self, position: int) -> str:
        """What the knob is set to at a position of the slider, as the case file writes it."""
        if not self._even:
            number, unit = self._amount
            return (
                self.text if position == 0 else f"{float(f'{number * 10.0 ** (position / PER_DECADE):.3g}'):.6g} {unit}"
            )
        low, _, step = self.ends
        value = low + position * step
        if TURNED[self.key].ends is None:
            return f"{value:.6g} {self._amount[1]}"
        return str(round(value)) if isinstance(self.written, int) else f"{round(value, 6):g}"

    def position(self, text: str) -> int | None:
        """The slider's position nearest to a value as written; None where it is in no unit of this knob's."""
        try:
            value = float(split_amount(text, self._amount[1])[0])
        except BadInput:
            return None
        first, last = self.positions
        if self._even:
            low, _, step = self.ends
            place = (value - low) / step
        else:
            if not value > 0.0:
                return None
            place = PER_DECADE * math.log10(value / self._amount[0])
        return max(first, min(last, round(place)))


def knobs_of(case: Case) -> dict[str, Knob]:
    """The knobs of a case by their keys, in the order in which they are shown."""
    tables = tomllib.loads(case.text)
    found = ((key, _at(tables, key)) for key in TURNED)
    return {key: Knob(key, value) for key, value in found if value is not None and _single(key, value)}


def overrides(case: Case, changes: Mapping[str, str]) -> dict[str, object]:
    """Changes of knobs as `Case.with_overrides` takes them: a pair whole, cells as a list."""
    tables, merged = tomllib.loads(case.text), dict[str, object]()
    for key, text in changes.items():
        stem, _, place = key.rpartition(".")
        if place.isdigit():
            whole = merged.get(stem, list(_at(tables, stem)))
            assert isinstance(whole, list)
            whole[int(place)] = text
            merged[stem] = whole
        else:
            merged[key] = _cells(text) if key == "grid.cells" else text
    return merged


def _cells(text: str) -> str:
    """What is typed as 128 x 128 or 128 × 128, as the case file has it."""
    parts = [part.strip() for part in text.replace("×", "x").split("x")]
    return f"[{parts[0]}, {parts[1]}]" if len(parts) == 2 and all(part.isdigit() for part in parts) else text


def _at(tables: Mapping[str, Any], key: str) -> Any:
    """What stands at a dotted key; None where nothing does."""
    found: Any = tables
    for name in key.split("."):
        if isinstance(found, list) and name.isdigit():
            found = found[int(name)] if int(name) < len(found) else None
        else:
            found = found.get(name) if isinstance(found, Mapping) else None
    return found


def _single(key: str, value: object) -> bool:
    """Whether a value is one that a knob can hold: no table, and no pair but the grid's cells."""
    return not isinstance(value, Mapping) and (not isinstance(value, list) or key == "grid.cells")
