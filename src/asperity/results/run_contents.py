"""Variables, coordinates and attributes of a run as they are stored."""

from typing import Protocol, TypeAlias

import numpy as np

from asperity import ehl
from asperity.core.arrays import Field
from asperity.core.quantities import quantity
from asperity.results.dynamic import DynamicCurve
from asperity.results.surface_spread import Scalar
from asperity.solution import SubsurfaceStress

Variable: TypeAlias = tuple[str, Field, dict[str, str]]  # dimension, values, attributes
MAPS = (
    "von_mises",
    "von_mises_depth",
    "shear",
    "temperature_1",
    "temperature_2",
    "film_temperature",
)


class SolvedRun(Protocol):
    """The parts of a run that its file holds."""

    @property
    def solution(self) -> ehl.ContactSolution:
        """Solved contact of the first surface."""

    @property
    def stress(self) -> SubsurfaceStress:
        """Subsurface stress."""

    @property
    def dynamic_curve(self) -> DynamicCurve | None:
        """Stiffness and damping over frequency."""

    def scalars(self) -> dict[str, Scalar]:
        """Return the numbers of the run by key."""


def run_contents(run: SolvedRun) -> ehl.FileContents:
    """Return the solution's contents, with all numbers of the run and maps of derived fields.

    Maps of traction, temperature and von Mises stress are in single precision. A loaded run
    recomputes them.
    """
    (variables, coordinates, attributes) = run.solution.contents()
    stress = run.stress
    axis = {"axis": "Z", "positive": "down"}
    coordinates["depth"] = ("depth", stress.depths, quantity("depth").attributes | axis)
    for entry in map(quantity, MAPS):
        values: Field | None = entry.value_from(run)
        if values is not None:
            variables[entry.key] = (("x", "y"), values.astype(np.float32), entry.attributes)
    variables["von_mises"][2]["comment"] = f"Poisson's ratio {stress.poisson_ratio:g}"
    section = quantity("von_mises_section").attributes | {
        "comment": f"in the plane y = {stress.peak.y:g} m"
    }
    variables["von_mises_section"] = (
        ("x", "depth"),
        stress.von_mises[:, stress.row].astype(np.float32),
        section,
    )
    if run.dynamic_curve is not None:
        frequency = "dynamic_frequency"
        values = run.dynamic_curve.frequency_hz
        coordinates[frequency] = (frequency, values, quantity(frequency).attributes)
        variables |= _dynamic_variables(run.dynamic_curve)
    for key, value in run.scalars().items():
        if value is not None and not isinstance(value, bool):
            variables[key] = ((), value, quantity(key).attributes)
    return ehl.FileContents(variables, coordinates, attributes)


def _dynamic_variables(curve: DynamicCurve) -> dict[str, Variable]:
    """Return stiffness and damping of both branches over frequency."""
    variables: dict[str, Variable] = {}
    for suffix, branch in (("", curve.elastic), ("_virgin", curve.virgin)):
        for name in ("stiffness", "damping"):
            key = f"dynamic_{name}{suffix}"
            values = getattr(branch, name)
            variables[key] = ("dynamic_frequency", values, quantity(key).attributes)
    return variables
