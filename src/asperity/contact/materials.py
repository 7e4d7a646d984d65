"""Named materials of the bodies: elastic constants, hardness and thermal properties.

The values in `materials.csv` are typical of the grade and treatment named there; moduli vary by 2
%, hardness and thermal properties by 10 %.
"""

import csv
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache
from importlib.resources import files

from asperity.core.errors import BadInput

MAX_QUOTED = 40  # characters of an unknown name in a message


@dataclass(frozen=True, slots=True, kw_only=True)
class Material:
    """Material of a body.

    `youngs_modulus` [Pa]; `hardness` [Pa], indentation hardness, the upper limit of the pressure;
    `density` [kg/m^3], `conductivity` [W/m/K], `heat_capacity` [J/kg/K]; `source` names grade and
    origin of the hardness.
    """

    name: str
    youngs_modulus: float
    poisson_ratio: float
    hardness: float
    density: float
    conductivity: float
    heat_capacity: float
    source: str


@cache
def materials() -> dict[str, Material]:
    """Return all named materials by name."""
    text = files("asperity.contact").joinpath("materials.csv").read_text("utf-8")
    return {row["name"]: _material(row) for row in csv.DictReader(text.splitlines())}


def material(name: str) -> Material:
    """Return a material by its name.

    Raises
    ------
    BadInput
        for an unknown name.

    Examples
    --------
    >>> from asperity.contact.materials import material
    >>> f"{material('case-hardened steel').hardness / 1e9:.1f} GPa"
    '6.8 GPa'
    """
    known = materials()
    if name in known:
        return known[name]
    folded = {other.lower(): other for other in known}
    matches = get_close_matches(name.lower(), folded, n=1)
    remedy = f"known are {', '.join(known)}"
    if matches:
        remedy = f'did you mean "{folded[matches[0]]}"?'
    raise BadInput(f'must be a named material, got "{name[:MAX_QUOTED]}"; {remedy}')


def _material(row: dict[str, str]) -> Material:
    return Material(
        name=row["name"],
        youngs_modulus=1e9 * float(row["youngs_modulus_gpa"]),
        poisson_ratio=float(row["poisson_ratio"]),
        hardness=1e9 * float(row["hardness_gpa"]),
        density=float(row["density_kg_m3"]),
        conductivity=float(row["conductivity_w_m_k"]),
        heat_capacity=float(row["heat_capacity_j_kg_k"]),
        source=row["source"],
    )
