"""The paper's contact: packaged case, conditions of section 2, and a test for the rig's contact."""

from importlib.resources import files

from asperity.case import Case, load_case
from asperity.contact.conditions import ContactConditions, ElasticPair
from asperity.paper.numbers import RADIUS, RIG_LOAD

# Section 4's steel: the published 219.78 GPa as Hertz's modulus would give 4147 Hz at 200 N, half
# of it 3292 Hz
PAIR = ElasticPair((207e9, 207e9), (0.3, 0.3))
TOLERANCE = 0.1  # relative: the paper prints several values of speed and radius


def papers_contact(load: float) -> ContactConditions:
    """Return section 2's contact: a sphere on a plane, sliding at the rig's 0.42 m/s."""
    return ContactConditions(
        pair=PAIR, geometry="point", radius=RADIUS, load=load, surface_speeds=(2.12, 1.70)
    )


def papers_text() -> str:
    """Return the text of the packaged case file of the paper."""
    return files("asperity.paper").joinpath("paper.toml").read_text("utf-8")


def papers_case() -> Case:
    """Return the paper's contact as a case."""
    return load_case(papers_text(), name="paper.toml")


def rig_case() -> Case:
    """Return the paper's case with the Young's modulus of the rig's steel (section 4)."""
    moduli = [f"{modulus * 1e-9:g} GPa" for modulus in PAIR.youngs_moduli]
    return papers_case().with_written({"material.youngs_modulus": moduli})


def is_papers_contact(case: Case) -> bool:
    """Return True if a case is close enough to the paper's rig for the published numbers."""
    conditions = case.conditions
    if conditions.geometry != "line" or case.lubricant is None:
        return False
    expected = {
        "radius_along_rolling": RADIUS,
        "length": 10e-3,
        "load": RIG_LOAD,
        "entrainment_speed": 1.91,
    }
    return all(
        abs(getattr(conditions, name) - value) <= TOLERANCE * value
        for name, value in expected.items()
    )
