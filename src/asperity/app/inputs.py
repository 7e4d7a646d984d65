"""Inputs of the page: values of a case that can be changed, named by the catalogue.

A case has the inputs of `INPUT_SPECS` whose keys are in its tables. Values are written as in the
case file and validated by the case, not here.
"""

import math
import re
import tomllib
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields
from functools import cached_property
from types import MappingProxyType
from typing import Any, NamedTuple

from asperity.case import Case, MachineCase, split_amount
from asperity.core.documents import Table
from asperity.core.errors import BadInput
from asperity.core.quantities import Quantity, quantity
from asperity.coupling import CONTACT_PATCHES, DAMPING_LAWS, EXCITATIONS, STIFFNESS_LAWS
from asperity.lubricant import DENSITY_LAWS, FRICTION_LAWS, RHEOLOGY_LAWS, VISCOSITY_LAWS

MOST_PRESSED = "highest pressure"  # of a machine's contacts, by Hertz
PER_DECADE = 40  # slider steps per decade
GRIDS = (64, 96, 128, 192, 256)  # selectable numbers of cells along each axis
MAX_LENGTH = 200  # characters of a value


class InputSpec(NamedTuple):
    """An input: its quantity in the catalogue, its group and its range.

    `ends` are minimum, maximum and step of a plain number; the slider of an amount covers
    `decades` up and down from the value of the case. `more` marks inputs that are hidden at first.
    A choice has a `title` and the table of its `laws`, or `names`; an input of a machine has a
    `title` and a `meaning` in place of a quantity.
    """

    quantity: str
    group: str
    ends: tuple[float, float, float] | None = None
    decades: float = 1.0
    more: bool = False
    title: str = ""
    laws: Mapping[str, type] = MappingProxyType({})
    names: tuple[str, ...] = ()
    meaning: str = ""


def _law(title: str, group: str, laws: Mapping[str, type]) -> InputSpec:
    return InputSpec("", group, more=True, title=title, laws=laws)


def _machine(title: str, meaning: str, *, decades: float = 1.0, more: bool = False) -> InputSpec:
    return InputSpec("", MACHINE, decades=decades, more=more, title=title, meaning=meaning)


POSITION = "position"  # key of the contact of a machine; no key of a case file
MACHINE = "Machine"
MOTION = "Load and motion"
OIL = "Oil"
ROUGHNESS = "Roughness"
BODIES = "Bodies"
VIBRATION = "Vibration"
GRID = "Grid"
MODEL = "Model"
SECOND = "Roughness of the second body"
PRESETS = ("sound", "paper")
GRID_MEANING = (
    "cells along and across rolling for standing roughness. Running roughness has a grid of its "
    "own with at most these cells, about 3200 in all, chosen from the correlation lengths"
)
_SURFACE: dict[str, InputSpec] = {
    "sq": InputSpec("sq_m", ROUGHNESS),
    "correlation_length.0": InputSpec("correlation_length_x_m", ROUGHNESS),
    "correlation_length.1": InputSpec("correlation_length_y_m", ROUGHNESS),
    "groove_width": InputSpec("groove_width_m", ROUGHNESS),
    "groove_length": InputSpec("groove_length_m", ROUGHNESS),
    "crater_radius": InputSpec("crater_radius_m", ROUGHNESS),
    "direction_deg": InputSpec("lay_deg", ROUGHNESS, (-90.0, 90.0, 5.0)),
    "skewness": InputSpec("ssk", ROUGHNESS, (-2.0, 2.0, 0.05)),
    "kurtosis": InputSpec("sku", ROUGHNESS, (1.5, 10.0, 0.1)),
    "hurst": InputSpec("hurst", ROUGHNESS, (0.1, 1.0, 0.05)),
    "plateau_share": InputSpec("plateau_share", ROUGHNESS, (0.05, 0.95, 0.05)),
    "place": InputSpec("surface_place", ROUGHNESS, (0, 20, 1)),
    "seed": InputSpec("surface_seed", ROUGHNESS, (0, 50, 1)),
}
_MACHINES = {
    "torque": _machine("Torque", "on the pinion"),
    "radial_load": _machine("Radial load", "on the inner ring, downwards in the drawing"),
    "axial_load": _machine("Axial load", "on the inner ring"),
    "load": _machine("Load", "between the discs"),
    "spring_load": _machine("Spring load", "on the closed follower"),
    "speed": _machine("Speed", "of the pinion, the inner ring or the cam"),
    "clearance": _machine("Clearance", "diametral, of the mounted bearing", decades=0.7),
    "lift": _machine("Lift", "largest displacement of the follower", decades=0.1, more=True),
    "spring_rate": _machine("Spring rate", "force over lift", more=True),
    "follower_mass": _machine("Follower mass", "moving with the follower", more=True),
    "face_width": _machine("Face width", "length of the teeth in contact", decades=0.5, more=True),
}
INPUT_SPECS: dict[str, InputSpec] = {
    POSITION: InputSpec("", MACHINE, title="Contact"),
    **{f"machine.{key}": spec for key, spec in _MACHINES.items()},
    "model": InputSpec("", MODEL, title="Contact model", names=("mixed", "conserving", "paper")),
    "contact.load": InputSpec("load_n", MOTION),
    "contact.entrainment_speed": InputSpec("entrainment_speed_m_s", MOTION),
    "contact.slip": InputSpec("slide_to_roll", MOTION, (-2.0, 2.0, 0.01)),
    "lubricant.temperature": InputSpec("oil_temperature_k", OIL),
    "lubricant.viscosity_40": InputSpec("oil_viscosity_40_m2_s", OIL),
    "lubricant.viscosity_100": InputSpec("oil_viscosity_100_m2_s", OIL, more=True),
    "lubricant.viscosity.eta0": InputSpec("oil_viscosity_pa_s", OIL),
    "lubricant.viscosity.alpha": InputSpec("oil_alpha_1_pa", OIL, decades=0.3),
    "lubricant.alpha": InputSpec("oil_alpha_1_pa", OIL, decades=0.3),
    "lubricant.rheology.tau0": InputSpec("eyring_stress_pa", OIL, more=True),
    "lubricant.viscosity.law": _law("Viscosity law", OIL, VISCOSITY_LAWS),
    "lubricant.density.law": _law("Density law", OIL, DENSITY_LAWS),
    "lubricant.rheology.law": _law("Rheology law", OIL, RHEOLOGY_LAWS),
    "lubricant.friction.law": _law("Limiting shear stress law", OIL, FRICTION_LAWS),
    **{f"surface.{key}": entry for key, entry in _SURFACE.items()},
    **{f"surface.second.{key}": entry._replace(group=SECOND) for key, entry in _SURFACE.items()},
    "material.hardness": InputSpec("hardness_pa", BODIES, decades=0.7),
    "material.boundary_friction": InputSpec("boundary_friction", BODIES, (0.0, 0.4, 0.01)),
    "contact.radius": InputSpec("radius_m", BODIES, decades=0.5, more=True),
    "vibration.mass": InputSpec("mass_kg", VIBRATION, more=True),
    "vibration.damping_ratio": InputSpec(
        "damping_ratio", VIBRATION, (0.005, 0.2, 0.005), more=True
    ),
    "vibration.preset": InputSpec("", VIBRATION, more=True, title="Preset", names=PRESETS),
    "vibration.damping_law": _law("Damping law", VIBRATION, DAMPING_LAWS),
    "vibration.stiffness_law": _law("Stiffness law", VIBRATION, STIFFNESS_LAWS),
    "vibration.excitation": _law("Excitation", VIBRATION, EXCITATIONS),
    "vibration.patch": _law("Contact patch", VIBRATION, CONTACT_PATCHES),
    "grid.cells": InputSpec("grid_cells", GRID, meaning=GRID_MEANING),
}


@dataclass(frozen=True)
class CaseInput:
    """A value of a case that can be changed.

    `key` is that of the case file (an entry of a pair ends in its index); `written` the value in
    the case: a quantity with its unit as text, a plain number, "auto" or two counts for the grid,
    or the name of a law. `names` are the options of a choice.
    """

    key: str
    written: Any
    names: tuple[str, ...] = ()

    @property
    def _quantity(self) -> Quantity:
        """Entry of the catalogue."""
        return quantity(INPUT_SPECS[self.key].quantity)

    @property
    def title(self) -> str:
        """Label of the input."""
        title = INPUT_SPECS[self.key].title or self._quantity.title
        if self.key.startswith("surface.second."):
            return f"Second body: {title[:1].lower()}{title[1:]}"
        unit = " (°)" if self.key.endswith("_deg") else ""
        return f"{title[:1].upper()}{title[1:]}{unit}"

    @property
    def hint(self) -> str:
        """Text of the tooltip: meaning, range of the slider, and key of the case file."""
        meaning = f"{self.meaning[:1].upper()}{self.meaning[1:]}. " if self.meaning else ""
        if self.choices:
            return f"{meaning}Case file: {self.key}"
        low, high = (shown(self.value_text(end)) for end in self.positions)
        return f"{meaning}Slider: {low} to {high}; type any other value. Case file: {self.key}"

    @property
    def meaning(self) -> str:
        """Explanation of the quantity."""
        spec = INPUT_SPECS[self.key]
        return spec.meaning or ("" if self.names else self._quantity.meaning)

    @property
    def group(self) -> str:
        """Heading under which the input is shown."""
        return INPUT_SPECS[self.key].group

    @property
    def more(self) -> bool:
        """Hidden until more inputs are requested."""
        return INPUT_SPECS[self.key].more

    @property
    def text(self) -> str:
        """Value of the case as typed text."""
        if isinstance(self.written, list):
            return " x ".join(str(count) for count in self.written)
        return str(self.written)

    @property
    def choices(self) -> tuple[str, ...]:
        """Options of a choice; empty for a number."""
        if self.key != "grid.cells":
            return self.names
        grids = [f"{cells} x {cells}" for cells in GRIDS]
        return tuple(dict.fromkeys([self.text, *grids, "auto"]))

    @cached_property
    def _amount(self) -> tuple[float, str]:
        number, unit = split_amount(self.written)
        return float(number), unit

    @property
    def _linear(self) -> bool:
        """Linear slider: plain numbers and temperatures; otherwise logarithmic."""
        return (
            INPUT_SPECS[self.key].ends is not None
            or self._amount[1] in ("degC", "degF")
            or self._amount[0] <= 0.0
        )

    @property
    def ends(self) -> tuple[float, float, float]:
        """Minimum, maximum and step of a linear slider, in the unit of the case."""
        ends = INPUT_SPECS[self.key].ends
        if ends is not None:
            low, high, step = ends
            return min(low, float(self.written)), max(high, float(self.written)), step
        return self._amount[0] - 60.0, self._amount[0] + 60.0, 1.0

    @property
    def positions(self) -> tuple[int, int]:
        """First and last position of the slider."""
        if not self._linear:
            last = round(INPUT_SPECS[self.key].decades * PER_DECADE)
            return -last, last
        low, high, step = self.ends
        return 0, round((high - low) / step)

    def value_text(self, position: int) -> str:
        """Return the value at a slider position as written in the case file."""
        if not self._linear:
            number, unit = self._amount
            return (
                self.text
                if position == 0
                else f"{float(f'{number * 10.0 ** (position / PER_DECADE):.3g}'):.6g} {unit}"
            )
        low, _, step = self.ends
        value = low + position * step
        if INPUT_SPECS[self.key].ends is None:
            return f"{value:.6g} {self._amount[1]}"
        return str(round(value)) if isinstance(self.written, int) else f"{round(value, 6):g}"

    def _steps(self, text: str) -> float | None:
        """Return the slider steps to a written value, which may lie beyond the slider."""
        try:
            value = float(split_amount(text, self._amount[1])[0])
        except BadInput:
            return None
        if self._linear:
            low, _, step = self.ends
            return (value - low) / step
        return PER_DECADE * math.log10(value / self._amount[0]) if value > 0.0 else None

    def position(self, text: str) -> int | None:
        """Return the slider position nearest to a written value; None for an unsuitable unit."""
        steps = self._steps(text)
        if steps is None:
            return None
        first, last = self.positions
        return max(first, min(last, round(steps)))

    def beyond(self, text: str) -> str:
        """Return a sentence on a written value beyond the slider; empty for others."""
        steps = None if self.choices else self._steps(text)
        first, last = self.positions if steps is not None else (0, 0)
        if steps is None or first <= round(steps) <= last:
            return ""
        size = "large" if steps > last else "small"
        low, high = (shown(self.value_text(end)) for end in (first, last))
        return (
            f"{self.title}: {shown(text)} is too {size} to be solved here; choose {low} to {high}."
        )


def shown(text: str) -> str:
    """Return a value as the page shows it: µm for um, ° for deg."""
    degrees = re.sub(r" deg$", "°", re.sub(r" deg(?=[CF]$)", " °", text))
    return re.sub(r"\bum\b", "µm", degrees)


def written(text: str) -> str:
    """Return a typed value as a case file writes it: um for µm, deg for °."""
    degrees = re.sub(r"\s*°\s*(?=C|F|$)", " deg", text)
    return re.sub(r"[µμ](?=m\b)", "u", degrees)


def case_inputs(case: Case | MachineCase) -> dict[str, CaseInput]:
    """Return the inputs of a case by key, in display order."""
    tables = tomllib.loads(case.text)
    if isinstance(case, MachineCase):
        tables[POSITION] = MOST_PRESSED
    entries = ((key, _lookup(tables, key)) for key in INPUT_SPECS)
    inputs = [
        CaseInput(key, value, _contacts(case) if key == POSITION else _names(tables, key))
        for key, value in entries
        if value is not None and _is_single(key, value)
    ]
    return {
        case_input.key: case_input
        for case_input in inputs
        if not _is_choice(case_input.key) or len(case_input.names) > 1
    }


def _is_choice(key: str) -> bool:
    """Return True for a choice among laws or names."""
    spec = INPUT_SPECS[key]
    return bool(spec.title) and not spec.meaning


def _contacts(case: Case | MachineCase) -> tuple[str, ...]:
    """Return the contacts of a machine that can be selected."""
    if not isinstance(case, MachineCase):
        return ()
    moving = (contact.name for contact in case.contacts if not contact.stands_still)
    return (MOST_PRESSED, *moving)


def _names(tables: Table, key: str) -> tuple[str, ...]:
    """Return the options of a choice; laws whose required parameters the case lacks are omitted."""
    spec = INPUT_SPECS[key]
    table = _lookup(tables, key.rpartition(".")[0])
    possible = [name for name, law in spec.laws.items() if _required_parameters(law) <= set(table)]
    return (*spec.names, *possible)


def _required_parameters(law: type) -> set[str]:
    """Return the names of the parameters of a law that have no default."""
    return {
        field.name
        for field in fields(law)
        if field.default is MISSING and field.default_factory is MISSING
    }


def overrides(case: Case | MachineCase, changes: Mapping[str, str]) -> dict[str, object]:
    """Convert changed inputs to overrides of the case.

    Pairs are given whole, cells as a list, and laws with their own parameters only.
    """
    tables = tomllib.loads(case.text)
    merged = dict[str, object]()
    values = {key: text for key, text in changes.items() if key != POSITION}
    for key, text in sorted(
        values.items(), key=lambda change: change[0].rpartition(".")[2] != "law"
    ):
        stem, _, suffix = key.rpartition(".")
        if suffix == "law" and text in INPUT_SPECS[key].laws:
            names = {part.name for part in fields(INPUT_SPECS[key].laws[text])}
            merged[stem] = {
                "law": text,
                **{name: value for name, value in _lookup(tables, stem).items() if name in names},
            }
        elif suffix.isdigit():
            pair = merged.get(stem, list(_lookup(tables, stem)))
            assert isinstance(pair, list)
            pair[int(suffix)] = text
            merged[stem] = pair
        else:
            merged[key] = _cells(text) if key == "grid.cells" else text
    return merged


def _cells(text: str) -> str:
    """Convert typed cells, 128 x 128 or 128 × 128, to the form of the case file."""
    parts = [part.strip() for part in text.replace("×", "x").split("x")]
    return (
        f"[{parts[0]}, {parts[1]}]"
        if len(parts) == 2 and all(part.isdigit() for part in parts)
        else text
    )


def _lookup(tables: Table, key: str) -> Any:
    """Return the value at a dotted key, or None."""
    value: object = tables
    for name in key.split("."):
        if isinstance(value, list) and name.isdigit():
            value = value[int(name)] if int(name) < len(value) else None
        else:
            value = value.get(name) if isinstance(value, Mapping) else None
    return value


def _is_single(key: str, value: object) -> bool:
    """Return True for a value that one input can hold: no table, and no pair except the cells."""
    return not isinstance(value, Mapping) and (not isinstance(value, list) or key == "grid.cells")
