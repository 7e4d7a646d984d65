"""A contact solution on disk: one netCDF file that holds all of it, bit for bit, and is written whole or not at all."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from asperity.arrays import Field
from asperity.conditions import ContactConditions, ElasticPair
from asperity.ehl.solution import ContactSolution, Convergence, Figures, Iteration, Oil, Options, SolveStatus
from asperity.errors import BadInput, UnreadableFile
from asperity.files import versions, whole_file
from asperity.grid import Grid
from asperity.lubricant import DENSITY_LAWS, FRICTION_LAWS, RHEOLOGY_LAWS, VISCOSITY_LAWS, Lubricant
from asperity.surface import Surface

if TYPE_CHECKING:
    import xarray

FORMAT = 1  # counts up when a reader of the format before could not read the file
_LAWS: dict[str, dict[str, Any]] = {
    "viscosity": VISCOSITY_LAWS,
    "density": DENSITY_LAWS,
    "rheology": RHEOLOGY_LAWS,
    "friction": FRICTION_LAWS,
}
_OWN = (
    "Conventions",
    "title",
    "source",
    "asperity_format",
    "conditions",
    "lubricant",
    "options",
    "grid",
    "convergence",
    "versions",
)
_ERRORS = ("iteration_error", "discretisation_error")
_FIELDS = ("pressure", "gap", "surface_height")
_FACTOR = "viscosity_factor"
_OIL = {  # variable: field of Oil, what it is, unit
    "film_content": ("content", "share of the gap that is oil", "1"),
    "oil_pressure": ("pressure", "pressure of the oil alone", "Pa"),
    "plastic_growth": ("growth", "gap that oil at the cap has pressed open for good", "m"),
}


def solution_to_dataset(solution: ContactSolution) -> "xarray.Dataset":
    """A solution as a dataset with CF attributes.

    Fields lie on (x, y), the convergence history on (step). What is not a field travels as JSON in the attributes
    `conditions`, `lubricant`, `options`, `grid`, `convergence` and `versions`, floats in full; the solution's own
    attributes, such as its case, stand beside them as they are.

    Raises
    ------
    BadInput
        if one of the solution's attributes bears a name that the format uses itself.
    """
    import xarray

    taken = sorted(set(solution.attributes) & set(_OWN))
    if taken:
        raise BadInput(f"attribute {taken[0]!r} of the solution is a name that the run file uses itself; rename it")
    grid, history = solution.grid, solution.convergence.history
    fields = {
        "pressure": (solution.pressure, "contact pressure", "Pa"),
        "gap": (solution.gap, "gap between the deformed surfaces", "m"),
        "surface_height": (solution.surface.heights, "composite roughness, positive is material", "m"),
    }
    steps = {
        "step_number": ("step number on its grid", [step.number for step in history]),
        "step_cells_x": ("cells of the grid along x", [step.cells[0] for step in history]),
        "step_cells_y": ("cells of the grid along y", [step.cells[1] for step in history]),
        "step_residual": ("relative residual", [step.residual for step in history]),
        "step_load_error": ("relative load error", [step.load_error for step in history]),
        "step_change": ("relative change", [step.change for step in history]),
    }
    contact = {
        "long_name": "asperity contact",
        "flag_values": np.array([0, 1], np.int8),
        "flag_meanings": "apart touching",
    }
    approach = {"long_name": "approach of the bodies at the contact centre", "units": "m"}
    variables: dict[str, Any] = {
        **{name: (("x", "y"), data, {"long_name": text, "units": unit}) for name, (data, text, unit) in fields.items()},
        "in_contact": (("x", "y"), solution.in_contact.astype(np.int8), contact),
        "rigid_approach": ((), solution.rigid_approach, approach),
        **_factor_variable(solution.viscosity_factor),
        **_oil_variables(solution.oil),
        **{
            name: (("step",), np.array(data), {"long_name": text, "units": "1"}) for name, (text, data) in steps.items()
        },
    }
    coordinates: dict[str, Any] = {
        "x": ("x", grid.x, {"long_name": "position along rolling", "units": "m", "axis": "X"}),
        "y": ("y", grid.y, {"long_name": "position along the contact line", "units": "m", "axis": "Y"}),
    }
    used = versions()
    convergence = solution.convergence
    described = {
        "conditions": asdict(solution.conditions),
        "lubricant": None if solution.lubricant is None else _laws_in(solution.lubricant),
        "options": asdict(solution.options),
        "grid": asdict(grid),
        "convergence": {
            "status": convergence.status.value,
            "tolerance": convergence.tolerance,
            "seconds": convergence.seconds,
            "attempt": convergence.attempt,
            **{name: getattr(convergence, name) and asdict(getattr(convergence, name)) for name in _ERRORS},
        },
        "versions": used,
    }
    attributes = {
        "Conventions": "CF-1.11",
        "title": "Mixed elastohydrodynamic contact",
        "source": f"asperity {used['asperity']}",
        "asperity_format": FORMAT,
        **{name: json.dumps(value) for name, value in described.items()},
        **solution.attributes,
    }
    return xarray.Dataset(variables, coordinates, attributes)


def save_solution(solution: ContactSolution, path: str | Path) -> Path:
    """Write a solution as netCDF, whole or not at all, and return the path; raises what `save_dataset` does."""
    return save_dataset(solution_to_dataset(solution), path)


def save_dataset(dataset: "xarray.Dataset", path: str | Path) -> Path:
    """Write a solution's dataset, with whatever was added to it, as netCDF, whole or not at all; return the path.

    Raises
    ------
    BadInput
        if the folder does not exist or cannot be written to.
    AsperityError
        if writing fails half way, as on a full disk; nothing is left behind then.
    """
    path = Path(path)
    checked = {"zlib": True, "complevel": 1, "shuffle": True}  # zlib's checksum tells a flipped bit on reading
    encoding: dict[str, dict[str, Any]] = {str(name): {"_FillValue": None} for name in dataset.variables}
    for name, variable in dataset.variables.items():
        if variable.ndim == 2:
            encoding[str(name)] |= checked
    with whole_file(path) as part:
        dataset.to_netcdf(part, engine="h5netcdf", encoding=encoding)
    return path


def load_solution(path: str | Path) -> ContactSolution:
    """Read a solution back, every number as it was.

    Raises
    ------
    UnreadableFile
        if the file is missing, damaged, or not a run of asperity.
    """
    import xarray

    path = Path(path)
    if not path.is_file():
        raise UnreadableFile(f"{path} does not exist; check its name" if not path.exists() else f"{path} is not a file")
    try:
        with xarray.open_dataset(path, engine="h5netcdf", decode_cf=False) as opened:
            if "asperity_format" not in opened.attrs:
                raise UnreadableFile(f"{path} is netCDF but not a run of asperity; solve a case to get one")
            if opened.attrs["asperity_format"] != FORMAT:
                raise UnreadableFile(
                    f"{path} has run format {opened.attrs['asperity_format']}, this asperity reads format {FORMAT}; "
                    "solve its case again"
                )
            return _solution(opened.load())
    except UnreadableFile:
        raise
    except (OSError, ValueError, KeyError, TypeError, RuntimeError, AttributeError):  # as h5py and xarray find it
        raise UnreadableFile(f"{path} is damaged or not a run of asperity; solve its case again") from None


def _factor_variable(factor: Field | None) -> dict[str, Any]:
    if factor is None:
        return {}
    return {_FACTOR: (("x", "y"), factor, {"long_name": "viscosity over that at ambient temperature", "units": "1"})}


def _oil_variables(oil: Oil | None) -> dict[str, Any]:
    if oil is None:
        return {}
    return {
        name: (("x", "y"), getattr(oil, part), {"long_name": text, "units": unit})
        for name, (part, text, unit) in _OIL.items()
    }


def _laws_in(lubricant: Lubricant) -> dict[str, dict[str, Any]]:
    described = {}
    for family, laws in _LAWS.items():
        law = getattr(lubricant, family)
        name = next((name for name, kind in laws.items() if type(law) is kind), None)
        if name is None:
            raise BadInput(f"{type(law).__name__} is not a {family} law that can be kept; add it to its table of laws")
        described[family] = {"law": name, **asdict(law)}
    return described


def _law(family: str, described: dict[str, Any]) -> Any:
    parameters = dict(described)
    return _LAWS[family][parameters.pop("law")](**parameters)


def _solution(dataset: "xarray.Dataset") -> ContactSolution:
    described = {name: json.loads(dataset.attrs[name]) for name in _OWN[4:]}
    conditions, lubricant, grid = described["conditions"], described["lubricant"], described["grid"]
    pair = ElasticPair(**{name: tuple(value) for name, value in conditions.pop("pair").items()})
    conditions = {name: tuple(value) if isinstance(value, list) else value for name, value in conditions.items()}
    steps = {
        name: dataset[f"step_{name}"].values.tolist()
        for name in ("number", "cells_x", "cells_y", "residual", "load_error", "change")
    }
    history = tuple(
        Iteration((nx, ny), number, residual, load_error, change)
        for number, nx, ny, residual, load_error, change in zip(*steps.values(), strict=True)
    )
    pressure, gap, heights = (dataset[name].values for name in _FIELDS)
    return ContactSolution(
        conditions=ContactConditions(pair=pair, **conditions),
        lubricant=None
        if lubricant is None
        else Lubricant(**{name: _law(name, law) for name, law in lubricant.items()}),
        surface=Surface(heights, Grid(**{name: tuple(value) for name, value in grid.items()})),
        options=Options(**described["options"]),
        pressure=pressure,
        gap=gap,
        in_contact=dataset["in_contact"].values.astype(bool),
        rigid_approach=float(dataset["rigid_approach"].values),
        convergence=_convergence(described["convergence"], history),
        viscosity_factor=dataset[_FACTOR].values if _FACTOR in dataset else None,
        oil=_oil(dataset),
        attributes={str(name): value for name, value in dataset.attrs.items() if name not in _OWN},
    )


def _oil(dataset: "xarray.Dataset") -> Oil | None:
    if not set(_OIL) <= set(dataset.variables):
        return None
    return Oil(**{part: dataset[name].values for name, (part, _, _) in _OIL.items()})


def _convergence(described: dict[str, Any], history: tuple[Iteration, ...]) -> Convergence:
    rest: dict[str, Any] = {name: value for name, value in described.items() if name not in ("status", *_ERRORS)}
    errors: dict[str, Any] = {name: described.get(name) and Figures(**described[name]) for name in _ERRORS}
    return Convergence(**rest, **errors, status=SolveStatus(described["status"]), history=history)
