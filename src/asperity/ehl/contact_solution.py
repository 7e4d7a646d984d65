"""Result of a contact solve: fields, convergence, and the netCDF file format (`save`)."""

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
from asperity.core.displayed import Displayed
from asperity.core.errors import BadInput
from asperity.core.files import versions
from asperity.core.quantities import quantity
from asperity.core.storage import write_with_digest
from asperity.ehl.outcome import CONSERVING, Convergence, Options
from asperity.lubricant import Lubricant, describe_lubricant
from asperity.surface import Surface

if TYPE_CHECKING:
    import xarray

FORMAT = 2  # increases when an earlier reader could not read the file
HEADINGS = ("Conventions", "title", "source", "asperity_format")  # plain attributes of the file
# attributes that hold JSON
DESCRIBED = ("conditions", "lubricant", "options", "grid", "convergence", "versions")
ERRORS = ("iteration_error", "discretisation_error")
OIL = {
    "film_content": "content",
    "oil_pressure": "pressure",
    "plastic_growth": "growth",
}  # variable: field of Oil
STEPS = {  # variable: long name
    "step_number": "step number on its grid",
    "step_cells_x": "cells of the grid along x",
    "step_cells_y": "cells of the grid along y",
    "step_residual": "relative residual",
    "step_load_error": "relative load error",
    "step_change": "relative change",
}


class FileContents(NamedTuple):
    """Contents of a netCDF file: variables and coordinates by name, and attributes.

    A variable is (dimensions, values, attributes). Written without xarray, whose import takes
    longer than writing.
    """

    variables: dict[str, Any]
    coordinates: dict[str, Any]
    attributes: dict[str, Any]

    def to_dataset(self) -> "xarray.Dataset":
        """Return the contents as an xarray dataset."""
        import xarray

        return xarray.Dataset(*self)

    def save(self, path: str | Path) -> Path:
        """Write a file with its digest, completely or not at all, and return the path.

        Raises
        ------
        BadInput
            if the folder does not exist or is not writable.
        AsperityError
            if writing fails part way, as on a full disk; no partial file remains.
        """
        import h5netcdf

        path, buffer = Path(path), BytesIO()  # in memory: HDF5 crashes on a full disk
        packed = {"compression": "gzip", "compression_opts": 1, "shuffle": True}
        with h5netcdf.File(buffer, "w") as file:
            for name, (dimensions, data, attributes) in {
                **self.coordinates,
                **self.variables,
            }.items():
                along = (dimensions,) if isinstance(dimensions, str) else dimensions
                values = np.asarray(data)
                for dimension, length in zip(along, values.shape, strict=True):
                    if dimension not in file.dimensions:
                        file.dimensions[dimension] = length
                kind = packed if values.ndim == 2 else {}
                file.create_variable(name, along, data=values, **kind).attrs.update(attributes)
            file.attrs.update(self.attributes)
        write_with_digest(path, buffer.getvalue())
        return path


@dataclass(frozen=True, slots=True, kw_only=True)
class Oil:
    """State of the oil in a two-pressure model, (nx, ny).

    `content` is the share of the gap that is oil, `pressure` [Pa] the oil pressure (the remainder
    of the solution's is contact pressure), `growth` [m] the permanent opening of the gap by oil at
    the cap: part of the solution's gap.
    """

    content: Field
    pressure: Field
    growth: Field


@dataclass(frozen=True, kw_only=True, repr=False)
class ContactSolution(Displayed):
    """A solved contact.

    `pressure` [Pa], `gap` [m] between the deformed surfaces and `in_contact` have shape (nx, ny) on
    `grid`; `rigid_approach` [m] is h0 in h = h0 + x^2/(2R) + deflection - roughness. The solution
    includes its conditions, lubricant (None when dry), surface and options. `oil` is the state of
    the oil in a two-pressure model; there `in_contact` marks cells whose elastic bodies touch,
    perhaps with oil pressed between them at the cap, and `gap` is the total height of the film.
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
    viscosity_factor: Field | None = None  # local over isothermal viscosity, (nx, ny); None: 1
    oil: Oil | None = None
    # free text stored with the run, such as its case
    attributes: Mapping[str, str] = field(default_factory=dict)
    # software that solved it, for a solution read from a file
    versions: Mapping[str, str] = field(default_factory=dict)

    @property
    def grid(self) -> Grid:
        """Grid of all fields: that of the surface."""
        return self.surface.grid

    @property
    def cavitated(self) -> Mask:
        """Cells with ruptured oil: no pressure and no contact.

        In the conserving model, cells that are not full of oil.
        """
        if self.lubricant is None:
            return np.zeros(self.pressure.shape, dtype=bool)
        if self.options.model == CONSERVING and self.oil is not None:
            return np.asarray(self.oil.content < 1.0)
        return (self.pressure <= 0.0) & ~self.in_contact

    @property
    def p_cap(self) -> float | None:
        """Upper bound of the pressure [Pa]; None when elastic."""
        return self.conditions.hardness

    def to_dataset(self) -> "xarray.Dataset":
        """Return the solution as an xarray dataset; raises like `contents`."""
        return self.contents().to_dataset()

    def contents(self) -> FileContents:
        """Return the solution with CF attributes; `load_solution` needs nothing else.

        Fields lie on (x, y), the convergence history on (step). Everything else is JSON in the
        attributes `conditions`, `lubricant`, `options`, `grid`, `convergence` and `versions`, with
        floats in full precision; the solution's own attributes, such as its case, are stored
        unchanged.

        Raises
        ------
        BadInput
            if an attribute of the solution has a name that the format uses.
        """
        reserved = sorted({*HEADINGS, *DESCRIBED} & set(self.attributes))
        if reserved:
            raise BadInput(
                f"attribute {reserved[0]!r} of the solution has a name that the run file reserves; "
                "rename it"
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
        return FileContents({**self._maps(), **self._steps()}, coordinates, attributes)

    def _maps(self) -> dict[str, Any]:
        fields = {
            "pressure": self.pressure,
            "gap": self.gap,
            "surface_height": self.surface.heights,
        }
        if self.viscosity_factor is not None:
            fields["viscosity_factor"] = self.viscosity_factor
        if self.oil is not None:
            fields |= {name: getattr(self.oil, attribute) for name, attribute in OIL.items()}
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
        convergence = self.convergence
        conditions = asdict(self.conditions)
        if conditions["shape"] is None:
            del conditions["shape"]  # rollers only; unknown to readers older than rollers
        options = asdict(self.options)
        if options["inlet_layer"] is None:
            del options["inlet_layer"]  # starved contacts only, likewise
        return {
            "conditions": conditions,
            "lubricant": None if self.lubricant is None else describe_lubricant(self.lubricant),
            "options": options,
            "grid": asdict(self.grid),
            "convergence": {
                "status": convergence.status.value,
                "tolerance": convergence.tolerance,
                "seconds": convergence.seconds,
                "attempt": convergence.attempt.value,
                **{
                    name: getattr(convergence, name) and asdict(getattr(convergence, name))
                    for name in ERRORS
                },
            },
            "versions": versions(),
        }

    def save(self, path: str | Path) -> Path:
        """Write the solution as netCDF and return the path; raises like `FileContents.save`."""
        return self.contents().save(path)
