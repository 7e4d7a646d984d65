"""Knobs: the values of a case that can be turned, each named by the catalogue and written as the case file has it.

A case has the knobs of `TURNED` whose keys stand in its own tables. What a knob may be is not
decided here: the case refuses what it cannot take.
"""

import math
import tomllib
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from functools import cached_property
from types import MappingProxyType
from typing import Any, NamedTuple

from asperity.case import Case, split_amount
from asperity.core.errors import BadInput
from asperity.core.quantities import Quantity, quantity
from asperity.coupling import CONTACT_PATCHES, DAMPING_LAWS, EXCITATIONS, STIFFNESS_LAWS
from asperity.lubricant import DENSITY_LAWS, FRICTION_LAWS, RHEOLOGY_LAWS, VISCOSITY_LAWS

PER_DECADE = 40  # steps of a knob that goes by factors
GRIDS = (64, 96, 128, 192, 256)  # cells along each axis that are offered
LONGEST = 200  # characters that a knob may be set to


class _Turned(NamedTuple):
    """A key that can be turned: its line in the catalogue, its group, how far it goes.

    `ends` are lowest value, highest and step of a plain number; an amount goes `decades` up and
    down from the case's own value. `more` are shown when more knobs are asked for. One of several
    names has a title of its own and the table of its laws, or just the names.
    """

    quantity: str
    group: str
    ends: tuple[float, float, float] | None = None
    decades: float = 1.0
    more: bool = False
    title: str = ""
    laws: Mapping[str, type] = MappingProxyType({})
    names: tuple[str, ...] = ()


def _law(title: str, group: str, laws: Mapping[str, type]) -> _Turned:
    return _Turned("", group, more=True, title=title, laws=laws)


MOTION, OIL, ROUGHNESS, BODIES, VIBRATION, GRID = (
    "Load and motion",
    "Oil",
    "Roughness",
    "Bodies",
    "Vibration",
    "Grid",
)
MODEL, SECOND = "Model", "Roughness of the second body"
PRESETS = ("sound", "paper")
_SURFACE: dict[str, _Turned] = {
    "sq": _Turned("sq_m", ROUGHNESS),
    "correlation_length.0": _Turned("correlation_length_x_m", ROUGHNESS),
    "correlation_length.1": _Turned("correlation_length_y_m", ROUGHNESS),
    "groove_width": _Turned("groove_width_m", ROUGHNESS),
    "groove_length": _Turned("groove_length_m", ROUGHNESS),
    "crater_radius": _Turned("crater_radius_m", ROUGHNESS),
    "direction_deg": _Turned("lay_deg", ROUGHNESS, (-90.0, 90.0, 5.0)),
    "skewness": _Turned("ssk", ROUGHNESS, (-2.0, 2.0, 0.05)),
    "kurtosis": _Turned("sku", ROUGHNESS, (1.5, 10.0, 0.1)),
    "hurst": _Turned("hurst", ROUGHNESS, (0.1, 1.0, 0.05)),
    "plateau_share": _Turned("plateau_share", ROUGHNESS, (0.05, 0.95, 0.05)),
    "place": _Turned("surface_place", ROUGHNESS, (0, 20, 1)),
    "seed": _Turned("surface_seed", ROUGHNESS, (0, 50, 1)),
}
TURNED: dict[str, _Turned] = {
    "model": _Turned("", MODEL, title="Contact model", names=("mixed", "conserving", "paper")),
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
    "lubricant.viscosity.law": _law("Viscosity law", OIL, VISCOSITY_LAWS),
    "lubricant.density.law": _law("Density law", OIL, DENSITY_LAWS),
    "lubricant.rheology.law": _law("Rheology law", OIL, RHEOLOGY_LAWS),
    "lubricant.friction.law": _law("Law of the highest shear stress", OIL, FRICTION_LAWS),
    **{f"surface.{key}": turned for key, turned in _SURFACE.items()},
    **{f"surface.second.{key}": turned._replace(group=SECOND) for key, turned in _SURFACE.items()},
    "material.hardness": _Turned("hardness_pa", BODIES, decades=0.7),
    "material.boundary_friction": _Turned("boundary_friction", BODIES, (0.0, 0.4, 0.01)),
    "contact.radius": _Turned("radius_m", BODIES, decades=0.5, more=True),
    "vibration.mass": _Turned("mass_kg", VIBRATION, more=True),
    "vibration.damping_ratio": _Turned("damping_ratio", VIBRATION, (0.005, 0.2, 0.005), more=True),
    "vibration.preset": _Turned("", VIBRATION, more=True, title="Preset", names=PRESETS),
    "vibration.damping_law": _law("Damping law", VIBRATION, DAMPING_LAWS),
    "vibration.stiffness_law": _law("Stiffness law", VIBRATION, STIFFNESS_LAWS),
    "vibration.excitation": _law("Excitation", VIBRATION, EXCITATIONS),
    "vibration.patch": _law("Contact patch", VIBRATION, CONTACT_PATCHES),
    "grid.cells": _Turned("grid_cells", GRID),
}


@dataclass(frozen=True)
class Knob:
    """A value of a case that can be turned.

    `key` is the case file's (that of one entry of a pair ends in its number), `written` what the
    case has there: a quantity with its unit as text, a bare number, "auto" or two counts for the
    grid, the name of a law. `names` are those that it is chosen among.
    """

    key: str
    written: Any
    names: tuple[str, ...] = ()

    @property
    def _quantity(self) -> Quantity:
        """Its line in the catalogue."""
        return quantity(TURNED[self.key].quantity)

    @property
    def title(self) -> str:
        """What it is called."""
        title = TURNED[self.key].title or self._quantity.title
        if self.key.startswith("surface.second."):
            return f"Second body: {title[:1].lower()}{title[1:]}"
        return f"{title[:1].upper()}{title[1:]}"

    @property
    def meaning(self) -> str:
        """What it means, where its title does not say it all."""
        return "" if self.names else self._quantity.meaning

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
            return self.names
        offered = [f"{cells} x {cells}" for cells in GRIDS]
        return tuple(dict.fromkeys([self.text, *offered, "auto"]))

    @cached_property
    def _amount(self) -> tuple[float, str]:
        number, unit = split_amount(self.written)
        return float(number), unit

    @property
    def _even(self) -> bool:
        """Whether it is turned in even steps: plain numbers, and temperatures on a scale with a zero of its own."""
        return (
            TURNED[self.key].ends is not None
            or self._amount[1] in ("degC", "degF")
            or self._amount[0] <= 0.0
        )

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
                self.text
                if position == 0
                else f"{float(f'{number * 10.0 ** (position / PER_DECADE):.3g}'):.6g} {unit}"
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
    knobs = [
        Knob(key, value, _names(tables, key))
        for key, value in found
        if value is not None and _single(key, value)
    ]
    return {knob.key: knob for knob in knobs if not TURNED[knob.key].title or len(knob.names) > 1}


def _names(tables: Mapping[str, Any], key: str) -> tuple[str, ...]:
    """What a knob is chosen among: of laws those that need nothing which the case does not have."""
    turned, around = TURNED[key], _at(tables, key.rpartition(".")[0])
    known = [name for name, law in turned.laws.items() if _needed(law) <= set(around)]
    return (*turned.names, *known)


def _needed(law: type) -> set[str]:
    """Parameters that a law cannot do without."""
    return {
        part.name
        for part in fields(law)
        if part.default is MISSING and part.default_factory is MISSING
    }


def overrides(case: Case, changes: Mapping[str, str]) -> dict[str, object]:
    """Changes of knobs as `Case.with_overrides` takes them: a pair whole, cells as a list, laws with their own."""
    tables, merged = tomllib.loads(case.text), dict[str, object]()
    for key, text in sorted(
        changes.items(), key=lambda change: change[0].rpartition(".")[2] != "law"
    ):
        stem, _, place = key.rpartition(".")
        if place == "law" and text in TURNED[key].laws:  # which knows no other law's parameters
            own = {part.name for part in fields(TURNED[key].laws[text])}
            merged[stem] = {
                "law": text,
                **{name: value for name, value in _at(tables, stem).items() if name in own},
            }
        elif place.isdigit():
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
    return (
        f"[{parts[0]}, {parts[1]}]"
        if len(parts) == 2 and all(part.isdigit() for part in parts)
        else text
    )


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
