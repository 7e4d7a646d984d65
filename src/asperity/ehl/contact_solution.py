"""What a contact solve returns: fields, how it converged, and its way to disk; `asperity.solution.storage` reads it back."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.contact.grid import Grid
from asperity.core.arrays import Field, Mask
from asperity.core.errors import BadInput
from asperity.core.files import versions
from asperity.core.quantities import quantity
from asperity.core.storage import write_with_digest
from asperity.ehl.outcome import CONSERVING, Convergence, Options
from asperity.lubricant import Lubricant, describe_lubricant
from asperity.surface import Surface

if TYPE_CHECKING:
    import xarray

FORMAT = 2  # counts up when a reader of the format before could not read the file
HEADINGS = (
    "Conventions",
    "title",
    "source",
    "asperity_format",
)  # attributes of the file, and those that hold JSON
DESCRIBED = ("conditions", "lubricant", "options", "grid", "convergence", "versions")
ERRORS = ("iteration_error", "discretisation_error")
OIL = {
    "film_content": "content",
    "oil_pressure": "pressure",
    "plastic_growth": "growth",
}  # variable: field of Oil
STEPS = {  # variable: what it is
    "step_number": "step number on its grid",
    "step_cells_x": "cells of the grid along x",
    "step_cells_y": "cells of the grid along y",
    "step_residual": "relative residual",
    "step_load_error": "relative load error",
    "step_change": "relative change",
}


class Contents(NamedTuple):
    """What a netCDF file holds: variables and coordinates by name, as (dimensions, values, attributes), and attributes.

    Written without xarray, which with pandas takes longer to load than to write.
    """

    variables: dict[str, Any]
    coordinates: dict[str, Any]
    attributes: dict[str, Any]

    def to_dataset(self) -> "xarray.Dataset":
        """The same in memory."""
        import xarray

        return xarray.Dataset(*self)

    def save(self, path: str | Path) -> Path:
        """Write a file with its digest, whole or not at all, and return the path.

        Raises
        ------
        BadInput
            if the folder does not exist or cannot be written to.
        AsperityError
            if writing fails half way, as on a full disk; nothing is left behind then.
        """
        import h5netcdf

        path, made = (
            Path(path),
            BytesIO(),
        )  # in memory: the HDF5 library does not survive a disk that is full
        packed = {"compression": "gzip", "compression_opts": 1, "shuffle": True}
        with h5netcdf.File(made, "w") as file:
            for name, (dimensions, given, attributes) in {
                **self.coordinates,
                **self.variables,
            }.items():
                along, values = (
                    (dimensions,) if isinstance(dimensions, str) else dimensions,
                    np.asarray(given),
                )
                for dimension, length in zip(along, values.shape, strict=True):
                    if dimension not in file.dimensions:
                        file.dimensions[dimension] = length
                kind = packed if values.ndim == 2 else {}
                file.create_variable(name, along, data=values, **kind).attrs.update(attributes)
            file.attrs.update(self.attributes)
        write_with_digest(path, made.getvalue())
        return path


@dataclass(frozen=True, slots=True, kw_only=True)
class Oil:
    """What the conserving model knows of the oil besides, (nx, ny).

    `content` is the share of the gap that is oil, `pressure` [Pa] the oil's own (the rest of the
    solution's is elastic contact), `growth` [m] how far oil at the cap has pressed the gap open
    for good: part of the solution's gap.
    """

    content: Field
    pressure: Field
    growth: Field


@dataclass(frozen=True, kw_only=True)
class ContactSolution:
    """A solved contact.

    `pressure` [Pa], `gap` [m] between the deformed surfaces and `in_contact` have shape (nx, ny)
    on `grid`; `rigid_approach` [m] is h0 in h = h0 + x^2/(2R) + deflection - roughness. What was
    solved travels along: conditions, lubricant (None when dry), surface and options. `oil` is what
    the conserving model adds; there `in_contact` are the cells whose elastic bodies touch, with
    oil at the cap perhaps pressed between them since (the solid side), and `gap` is the film's
    whole height.
    """

    conditions: ContactConditions
    lubricant: Lubricant | None
    surface: Surface
    options: Options
    pressure: Field
    gap: Field
    in_contact: Mask
    rigid_approach: float
    convergence: Convergence
    viscosity_factor: Field | None = (
        None  # what warmth left of the oil's viscosity, (nx, ny); None where it left all
    )
    oil: Oil | None = None
    attributes: Mapping[str, str] = field(
        default_factory=dict
    )  # free text kept with the run, such as its case
    versions: Mapping[str, str] = field(
        default_factory=dict
    )  # of a solution read from a file: what solved it

    @property
    def grid(self) -> Grid:
        """The grid of all fields: the surface's."""
        return self.surface.grid

    @property
    def cavitated(self) -> Mask:
        """Cells in which the oil has ruptured: no pressure, no contact; in the conserving model any not full of oil."""
        if self.lubricant is None:
            return np.zeros(self.pressure.shape, dtype=bool)
        if self.options.model == CONSERVING and self.oil is not None:
            return np.asarray(self.oil.content < 1.0)
        return (self.pressure <= 0.0) & ~self.in_contact

    @property
    def p_cap(self) -> float | None:
        """The pressure no cell exceeds [Pa], None when elastic."""
        return self.conditions.hardness

    def to_dataset(self) -> "xarray.Dataset":
        """The solution as an xarray dataset: its `contents`; raises what they do."""
        return self.contents().to_dataset()

    def contents(self) -> Contents:
        """The solution with CF attributes; all that `load_solution` needs is in it.

        Fields lie on (x, y), the convergence history on (step). What is not a field travels as
        JSON in the attributes `conditions`, `lubricant`, `options`, `grid`, `convergence` and
        `versions`, floats in full; the solution's own attributes, such as its case, stand beside
        them as they are.

        Raises
        ------
        BadInput
            if one of the solution's attributes bears a name that the format uses itself.
        """
        taken = sorted({*HEADINGS, *DESCRIBED} & set(self.attributes))
        if taken:
            raise BadInput(
                f"attribute {taken[0]!r} of the solution is a name that the run file uses itself; rename it"
            )
        coordinates: dict[str, Any] = {
            "x": ("x", self.grid.x, {**quantity("x_m").attributes, "axis": "X"}),
            "y": ("y", self.grid.y, {**quantity("y_m").attributes, "axis": "Y"}),
        }
        described = self._described()
        attributes = {
            "Conventions": "CF-1.11",
            "title": "Mixed elastohydrodynamic contact",
            "source": f"asperity {described['versions']['asperity']}",
            "asperity_format": FORMAT,
            **{name: json.dumps(value) for name, value in described.items()},
            **self.attributes,
        }
        return Contents({**self._maps(), **self._steps()}, coordinates, attributes)

    def _maps(self) -> dict[str, Any]:
        fields = {
            "pressure": self.pressure,
            "gap": self.gap,
            "surface_height": self.surface.heights,
        }
        if self.viscosity_factor is not None:
            fields["viscosity_factor"] = self.viscosity_factor
        if self.oil is not None:
            fields |= {name: getattr(self.oil, part) for name, part in OIL.items()}
        contact = {
            "long_name": "asperity contact",
            "flag_values": np.array([0, 1], np.int8),
            "flag_meanings": "apart touching",
        }
        return {
            **{
                name: (("x", "y"), values, quantity(name).attributes)
                for name, values in fields.items()
            },
            "in_contact": (("x", "y"), self.in_contact.astype(np.int8), contact),
            "rigid_approach": ((), self.rigid_approach, quantity("rigid_approach").attributes),
        }

    def _steps(self) -> dict[str, Any]:
        rows = [
            (step.number, *step.cells, step.residual, step.load_error, step.change)
            for step in self.convergence.history
        ]
        columns = zip(*rows, strict=True)
        return {
            name: (("step",), np.array(column), {"long_name": text, "units": "1"})
            for (name, text), column in zip(STEPS.items(), columns, strict=True)
        }

    def _described(self) -> dict[str, Any]:
        convergence, conditions = self.convergence, asdict(self.conditions)
        if conditions["shape"] is None:
            del conditions[
                "shape"
            ]  # which most contacts cannot have, and readers before there were rollers do not know
        return {
            "conditions": conditions,
            "lubricant": None if self.lubricant is None else describe_lubricant(self.lubricant),
            "options": asdict(self.options),
            "grid": asdict(self.grid),
            "convergence": {
                "status": convergence.status.value,
                "tolerance": convergence.tolerance,
                "seconds": convergence.seconds,
                "attempt": convergence.attempt,
                **{
                    name: getattr(convergence, name) and asdict(getattr(convergence, name))
                    for name in ERRORS
                },
            },
            "versions": versions(),
        }

    def save(self, path: str | Path) -> Path:
        """Write the solution as netCDF, whole or not at all, and return the path; raises what `Contents.save` does."""
        return self.contents().save(path)
