"""The paper's contact: as the case that the package brings along, as section 2's, and told from any other."""

from importlib.resources import files

from asperity.case import Case, load_case
from asperity.contact.conditions import ContactConditions, ElasticPair
from asperity.paper.numbers import RADIUS, RIG_LOAD

# Section 4's steel: the printed 219.78 GPa as Hertz's modulus would give 4147 Hz at 200 N, half of
# it 3292 Hz
PAIR = ElasticPair((207e9, 207e9), (0.3, 0.3))
NEAR = 0.1  # of the rig's own values: the paper prints speed and radius in more than one way


def papers_contact(load: float) -> ContactConditions:
    """Section 2's contact: a sphere on a plane that slides at the rig's 0.42 m/s."""
    return ContactConditions(
        pair=PAIR, geometry="point", radius=RADIUS, load=load, surface_speeds=(2.12, 1.70)
    )


def papers_text() -> str:
    """The paper's case file, as the package brings it along."""
    return files("asperity.paper").joinpath("paper.toml").read_text("utf-8")


def papers_case() -> Case:
    """The paper's contact as a case."""
    return load_case(papers_text(), name="paper.toml")


def rig_case() -> Case:
    """The paper's case with the Young's modulus of its section 4, which the rig's steel has."""
    moduli = [f"{modulus * 1e-9:g} GPa" for modulus in PAIR.youngs_moduli]
    return papers_case().with_overrides({"material.youngs_modulus": moduli})


def is_papers_contact(case: Case) -> bool:
    """Whether a case is the contact of the paper's rig, near enough for its printed numbers to belong beside it."""
    conditions = case.conditions
    if conditions.geometry != "line" or case.lubricant is None:
        return False
    rigs = {
        "radius_along_rolling": RADIUS,
        "length": 10e-3,
        "load": RIG_LOAD,
        "entrainment_speed": 1.91,
    }
    return all(
        abs(getattr(conditions, name) - value) <= NEAR * value for name, value in rigs.items()
    )
