"""Structures of bodies and springs."""

from collections.abc import Mapping, Sequence

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.structure.matrices import Structure

GROUND = "ground"
MAX_BODIES = 300
BODY_KEYS = ("bodies", "springs", "contact", "sensor", "stiffness_damping")
SPRING_KEYS = ("between", "stiffness", "damping")


def structure_of_bodies(content: Mapping[str, object]) -> Structure:
    """Return the structure of bodies on springs, each with one displacement.

    Parameters
    ----------
    content : `bodies`, mass by name [kg]; `springs`, each with `between` two bodies or the ground,
        `stiffness` [N/m] and perhaps `damping` [N s/m]; `contact` and `sensor`, number by body;
        perhaps `stiffness_damping` [s], damping over stiffness of springs without their own. An end
        of a spring may be a sum of displacements, such as {shaft = 1.0, rotation = 1.0}

    Raises
    ------
    BadInput
        for unknown keys or bodies, and as `Structure`.

    Examples
    --------
    >>> from asperity.structure import structure_of_bodies
    >>> holder = {"between": ["holder", "ground"], "stiffness": 1e6}
    >>> structure = structure_of_bodies(
    ...     {
    ...         "bodies": {"holder": 0.1},
    ...         "springs": [holder],
    ...         "contact": {"holder": 1.0},
    ...         "sensor": {"holder": 1.0},
    ...         "stiffness_damping": 1e-6,
    ...     }
    ... )
    >>> structure.damping.tolist()
    [[1.0]]
    """
    masses = _table("bodies", content["bodies"])
    names = tuple(masses)
    if GROUND in names or len(names) > MAX_BODIES:
        raise BadInput(f"bodies must be at most {MAX_BODIES}, none of them called {GROUND}")
    ratio = _number("stiffness_damping", content.get("stiffness_damping", 0.0))
    stiffness, damping = _assembled(content.get("springs", ()), names, ratio)
    return Structure(
        mass=np.diag(list(masses.values())),
        stiffness=stiffness,
        damping=damping,
        contact=_displacement("contact", content["contact"], names),
        sensor=_displacement("sensor", content["sensor"], names),
    )


def _assembled(springs: object, names: Sequence[str], ratio: float) -> tuple[Field, Field]:
    """Return the stiffness and damping matrices of springs; damping over stiffness is `ratio`."""
    if not isinstance(springs, Sequence) or not all(
        isinstance(entry, Mapping) for entry in springs
    ):
        raise BadInput("springs must be tables [[springs]] with between and stiffness")
    stiffness, damping = np.zeros((2, len(names), len(names)))
    for number, spring in enumerate(springs, 1):
        if unknown := sorted(set(spring) - set(SPRING_KEYS)):
            raise BadInput(
                f"unknown key {unknown[0]!r} in spring {number}; use {', '.join(SPRING_KEYS)}"
            )
        if missing := [key for key in SPRING_KEYS[:2] if key not in spring]:
            raise BadInput(f"spring {number} has no {missing[0]}; add it")
        stretch = _stretch(number, spring["between"], names)
        own = _number(f"stiffness of spring {number}", spring["stiffness"])
        friction = _number(f"damping of spring {number}", spring.get("damping", ratio * own))
        stiffness += own * np.outer(stretch, stretch)
        damping += friction * np.outer(stretch, stretch)
    return stiffness, damping


def _stretch(number: int, between: object, names: Sequence[str]) -> Field:
    """Return the change of length of a spring per displacement of each body."""
    if not isinstance(between, Sequence) or isinstance(between, str) or len(between) != 2:
        raise BadInput(f"spring {number} must be between two bodies, got {between!r}")
    first, second = (
        _displacement(
            f"spring {number}",
            ({} if end == GROUND else {end: 1.0}) if isinstance(end, str) else end,
            names,
        )
        for end in between
    )
    return first - second


def _displacement(place: str, value: object, names: Sequence[str]) -> Field:
    """Return a sum of displacements as numbers of all bodies."""
    table = _table(place, value)
    if unknown := sorted(set(table) - set(names)):
        raise BadInput(f"{place} names {unknown[0]!r}, not one of the bodies {', '.join(names)}")
    return np.array([table.get(name, 0.0) for name in names])


def _table(place: str, value: object) -> dict[str, float]:
    if not isinstance(value, Mapping):
        raise BadInput(f"{place} must be a table of numbers by body, got {value!r}")
    return {str(name): _number(f"{place}.{name}", number) for name, number in value.items()}


def _number(place: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise BadInput(f"{place} must be a number in SI units, got {value!r}")
    return float(value)
