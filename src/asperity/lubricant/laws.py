"""Every law that a case file and a run file can name, by its family, and laws as tables of their parameters."""

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
    """What its family's table calls a law; raises BadInput for one that is not in it."""
    name = next((name for name, kind in LAWS[family].items() if type(law) is kind), None)
    if name is None:
        raise BadInput(
            f"{type(law).__name__} is not a {family} law that can be kept; add it to its table of laws"
        )
    return name


def describe_law(family: LawFamily, law: Any) -> dict[str, Any]:
    """Name and parameters [SI] of a law; raises what `law_name` does."""
    return {"law": law_name(family, law), **asdict(law)}


def make_law(family: LawFamily, description: Mapping[str, Any]) -> Any:
    """The law that `describe_law` describes."""
    return LAWS[family][description["law"]](
        **{name: value for name, value in description.items() if name != "law"}
    )
