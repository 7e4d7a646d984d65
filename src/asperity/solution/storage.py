"""Reading of contact solutions from disk; `ContactSolution.save` writes them."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from asperity.contact.conditions import ContactConditions, ElasticPair
from asperity.contact.grid import Grid
from asperity.contact.rollers import RollerShape
from asperity.core.errors import UnreadableFile
from asperity.core.quantities import catalogue
from asperity.core.storage import read_netcdf
from asperity.ehl import (
    ContactSolution,
    Convergence,
    Figures,
    GridError,
    InletLayer,
    Iteration,
    Oil,
    Options,
    SolveStatus,
)
from asperity.ehl.contact_solution import DESCRIBED, ERRORS, FORMAT, HEADINGS, OIL, STEPS
from asperity.ehl.outcome import SolveStrategy
from asperity.lubricant import make_lubricant
from asperity.surface import Surface

if TYPE_CHECKING:
    import xarray

EARLIER_TEXTS = {  # of strategies, in files of earlier versions
    "with the second-order wedge of rough bodies": SolveStrategy.SECOND_ORDER,
    "with the bodies held while their distance was searched": SolveStrategy.FIXED_APPROACH,
}


def load_solution(path: str | Path) -> ContactSolution:
    """Load a contact solution saved by `ContactSolution.save`, every number unchanged.

    Raises
    ------
    UnreadableFile
        if the file is missing, damaged, or not a saved asperity run.
    """
    path, remedy = Path(path), "solve its case again"
    dataset = read_netcdf(path, {*catalogue(), *STEPS, "y"}, remedy)
    if "asperity_format" not in dataset.attrs:
        raise UnreadableFile(
            f"{path} is a netCDF file but not a saved asperity run; solve a case to create one"
        )
    if dataset.attrs["asperity_format"] != FORMAT:
        raise UnreadableFile(
            f"{path} has run format {dataset.attrs['asperity_format']}, this asperity reads "
            f"format {FORMAT}; {remedy}"
        )
    try:
        return _solution(dataset)
    except (ValueError, KeyError, TypeError, RuntimeError, AttributeError):
        raise UnreadableFile(f"{path} is damaged or not a saved asperity run; {remedy}") from None


def _solution(dataset: "xarray.Dataset") -> ContactSolution:
    described = {name: json.loads(dataset.attrs[name]) for name in DESCRIBED}
    lubricant = described["lubricant"]
    layer = described["options"].pop("inlet_layer", None)
    grid = described["grid"]
    pressure, gap, heights = (
        dataset[name].values for name in ("pressure", "gap", "surface_height")
    )
    return ContactSolution(
        conditions=_conditions(described["conditions"]),
        lubricant=None if lubricant is None else make_lubricant(lubricant),
        surface=Surface(heights, Grid(**{name: tuple(value) for name, value in grid.items()})),
        options=Options(
            **described["options"],
            inlet_layer=layer and InletLayer(tuple(layer["thickness"]), tuple(layer["y"])),
        ),
        pressure=pressure,
        gap=gap,
        in_contact=dataset["in_contact"].values.astype(bool),
        rigid_approach=float(dataset["rigid_approach"].values),
        convergence=_convergence(described["convergence"], _history(dataset)),
        viscosity_factor=dataset["viscosity_factor"].values
        if "viscosity_factor" in dataset
        else None,
        oil=_oil(dataset),
        versions=described["versions"],
        attributes={
            str(name): value
            for name, value in dataset.attrs.items()
            if name not in (*HEADINGS, *DESCRIBED)
        },
    )


def _conditions(described: dict[str, Any]) -> ContactConditions:
    described = {
        name: tuple(value) if isinstance(value, list) else value
        for name, value in described.items()
    }
    pair = {name: tuple(value) for name, value in described.pop("pair").items()}
    if described.get("shape"):
        described["shape"] = RollerShape(**described["shape"])
    return ContactConditions(pair=ElasticPair(**pair), **described)


def _history(dataset: "xarray.Dataset") -> tuple[Iteration, ...]:
    steps = [dataset[name].values.tolist() for name in STEPS]
    return tuple(
        Iteration((nx, ny), number, residual, load_error, change)
        for number, nx, ny, residual, load_error, change in zip(*steps, strict=True)
    )


def _oil(dataset: "xarray.Dataset") -> Oil | None:
    if not set(OIL) <= set(dataset.variables):
        return None
    return Oil(**{attribute: dataset[name].values for name, attribute in OIL.items()})


def _convergence(described: dict[str, Any], history: tuple[Iteration, ...]) -> Convergence:
    values: dict[str, Any] = {
        name: value for name, value in described.items() if name not in ("status", *ERRORS)
    }
    text = described.get("attempt", SolveStrategy.COARSE_TO_FINE)
    values["attempt"] = EARLIER_TEXTS.get(text) or SolveStrategy(text)
    errors: dict[str, Any] = dict.fromkeys(ERRORS)
    if described.get("iteration_error"):
        errors["iteration_error"] = Figures(**described["iteration_error"])
    if described.get("discretisation_error"):
        half = described["discretisation_error"]
        # runs of earlier versions have no `lean`
        lean = Figures(**(half.pop("lean", None) or dict.fromkeys(half, 0.0)))
        errors["discretisation_error"] = GridError(**half, lean=lean)
    return Convergence(**values, **errors, status=SolveStatus(described["status"]), history=history)
