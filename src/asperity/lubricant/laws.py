"""Laws by the names in case and run files, and their conversion to and from parameter tables."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, Literal

from asperity.core.errors import BadInput
from asperity.lubricant.density import DENSITY_LAWS
from asperity.lubricant.friction import FRICTION_LAWS
from asperity.lubricant.rheology import RHEOLOGY_LAWS
from asperity.lubricant.thermal import WARMTH_LAWS
from asperity.lubricant.viscosity import VISCOSITY_LAWS

LawFamily = Literal["viscosity", "density", "rheology", "friction", "warmth"]

LAWS: dict[LawFamily, Mapping[str, type]] = {
    "viscosity": VISCOSITY_LAWS,
    "density": DENSITY_LAWS,
    "rheology": RHEOLOGY_LAWS,
    "friction": FRICTION_LAWS,
    "warmth": WARMTH_LAWS,
}


def law_name(family: LawFamily, law: object) -> str:
    """Return the name of a law in the table of its family; raise BadInput if it is not there."""
    name = next((name for name, kind in LAWS[family].items() if type(law) is kind), None)
    if name is None:
        raise BadInput(
            f"{type(law).__name__} is not a {family} law that can be stored; add it to its table "
            "of laws"
        )
    return name


def describe_law(family: LawFamily, law: Any) -> dict[str, Any]:
    """Return the name and parameters [SI] of a law; raises as `law_name`."""
    return {"law": law_name(family, law), **asdict(law)}


def make_law(family: LawFamily, description: Mapping[str, Any]) -> Any:
    """Create a law from the result of `describe_law`.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.lubricant import make_law
    >>> viscosity = make_law("viscosity", {"law": "barus", "eta0": 0.1, "alpha": 20e-9})
    >>> viscosity(np.array([0.1e9])).round(3)
    array([0.739])
    """
    return LAWS[family][description["law"]](
        **{name: value for name, value in description.items() if name != "law"}
    )
