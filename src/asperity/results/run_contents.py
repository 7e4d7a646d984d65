"""Variables, coordinates and attributes of a run as they are stored."""

from typing import TYPE_CHECKING

import numpy as np

from asperity import ehl
from asperity.core.arrays import Field
from asperity.core.quantities import quantity

if TYPE_CHECKING:
    from asperity.results.run import Run

MAPS = (
    "von_mises",
    "von_mises_depth",
    "shear",
    "temperature_1",
    "temperature_2",
    "film_temperature",
)


def run_contents(run: "Run") -> ehl.FileContents:
    """Return the solution's contents, with all numbers of the run and maps of derived fields.

    Maps of traction, temperature and von Mises stress are in single precision. A loaded run
    recomputes them.
    """
    (variables, coordinates, attributes), stress = run.solution.contents(), run.stress
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
    curve = run.dynamic_curve
    if curve is not None:
        coordinates["dynamic_frequency"] = (
            "dynamic_frequency",
            curve.frequency_hz,
            quantity("dynamic_frequency").attributes,
        )
        for suffix, branch in (("", curve.elastic), ("_virgin", curve.virgin)):
            for name in ("dynamic_stiffness", "dynamic_damping"):
                values = getattr(branch, name.removeprefix("dynamic_"))
                key = f"{name}{suffix}"
                variables[key] = ("dynamic_frequency", values, quantity(key).attributes)
    for key, value in run.scalars().items():
        if value is not None and not isinstance(value, bool):
            variables[key] = ((), value, quantity(key).attributes)
    return ehl.FileContents(variables, coordinates, attributes)
