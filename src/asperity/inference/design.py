"""The question turned round: which load, speed, viscosity or finish keeps the load share below a value."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from scipy.special import ndtr

from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.core.quantities import quantity
from asperity.inference.forward import Forward
from asperity.inference.observations import OperatingPoint
from asperity.inference.outputs import CLR, OUTPUTS
from asperity.inference.priors import Unknown
from asperity.inference.settings import LOAD, SPEED, TEMPERATURE, Setting

SURELY = 0.95
VALUES = 25  # of each lever, along its range
CONTACTS = 600  # possible ones that each value is asked of
LEVERS = ("surface.sq", "lubricant.viscosity.eta0", TEMPERATURE, LOAD, SPEED)
NAMES = {LOAD: "load_n", SPEED: "entrainment_speed_m_s", TEMPERATURE: "oil_temperature_k"}

Way = Literal["at most", "at least", "any", "none"]


@dataclass(frozen=True)
class DesignVariable:
    """What one quantity alone must be for the load share to stay below a value, all else as it is known.

    `way` is "at most" or "at least" `bound` [SI]; "any" or "none" where all of the range does, or
    nothing of it. `values` [SI] and `chances` are the probabilities over the whole range.
    """

    key: str
    way: Way
    bound: float | None
    values: Field = field(repr=False)
    chances: Field = field(repr=False)

    def sentence(self) -> str:
        """In words."""
        entry = quantity(self.key)
        ends = f"{entry.number(float(self.values.min()))} to {entry.text(float(self.values.max()))}"
        if self.bound is None:
            return f"{entry.name}: {'any' if self.way == 'any' else 'none'} of {ends}"
        return f"{entry.name}: {self.way} {entry.text(self.bound)}"

    def scalars(self) -> dict[str, Any]:
        """As JSON has it."""
        return {
            "key": self.key,
            "way": self.way,
            "bound": self.bound,
            "values": self.values.tolist(),
            "chances": self.chances.tolist(),
        }


@dataclass(frozen=True)
class Design:
    """What keeps the load share below `clr` with a probability of 95 %; `now` is that probability as things are."""

    clr: float
    now: float
    levers: tuple[DesignVariable, ...]

    def sentence(self) -> str:
        """In words."""
        limit = quantity(CLR).text(self.clr)
        ways = "; ".join(lever.sentence() for lever in self.levers)
        return (
            f"CLR stays below {limit} with a probability of {self.now:.2f} as it is; with {SURELY:.2f}, by one alone, "
            f"for {ways}."
        )

    def scalars(self) -> dict[str, Any]:
        """As JSON has it."""
        return {
            "clr": self.clr,
            "probability": SURELY,
            "now": self.now,
            "sentence": self.sentence(),
            "levers": [lever.scalars() for lever in self.levers],
        }


def require_share(name: str, clr: float) -> None:
    """BadInput for what is no load share."""
    if not 0.0 < clr < 1.0:
        raise BadInput(f"{name} must be a load share between 0 and 1, got {clr:g}; 0.3 is 30 %")


def design_contact(forward: Forward, z: Field, *, clr: float) -> Design:
    """Which load, speed, viscosity (or temperature) or roughness keeps CLR below a value, at the first point.

    Each alone is put to values along its range, in all contacts that are possible; the rest of
    them stays.

    Parameters
    ----------
    forward : its first operating point is the one asked of
    z : unknowns of equally probable contacts (n, dims), before recordings or after
    clr : the load share that is not to be exceeded

    Raises
    ------
    BadInput
        for a load share that is none.
    """
    require_share("--design", clr)
    chosen = z[:: max(1, len(z) // CONTACTS)][:CONTACTS]
    own = replace(forward, points=forward.points[:1])
    levers = [_lever(own, chosen, entry, clr) for entry in _levers(own.setting)]
    return Design(clr, float(_chances(own, chosen, clr)[0]), tuple(levers))


def _levers(setting: Setting) -> Sequence[Unknown]:
    """Unknowns and operating quantities that somebody can choose."""
    known = {unknown.range.key: unknown for unknown in setting.contact}
    known |= {entry.key: Unknown(NAMES[entry.key], entry) for entry in setting.operating}
    return [known[key] for key in LEVERS if key in known]


def _lever(forward: Forward, z: Field, lever: Unknown, clr: float) -> DesignVariable:
    shares = np.linspace(0.0, 1.0, VALUES)
    values = lever.to_si(np.array([lever.range.value(share) for share in shares]))
    if lever.range.key in NAMES:
        asked = replace(
            forward,
            points=tuple(_moved(forward.points[0], lever.range.key, float(v)) for v in values),
        )
        chances = _chances(asked, z, clr)
    else:
        column = forward.setting.unknowns.index(lever)
        chances = np.array(
            [_chances(forward, _put(z, column, at), clr)[0] for at in lever.at_share(shares)]
        )
    enough = chances >= SURELY
    if enough.all() or not enough.any():
        return DesignVariable(lever.key, "any" if enough.all() else "none", None, values, chances)
    if enough[0]:
        last = int(np.argmin(enough)) - 1  # the end of what is enough from the low end on
        return DesignVariable(
            lever.key, "at most", _between(values, chances, last), values, chances
        )
    if enough[-1]:
        last = VALUES - 1 - int(np.argmin(enough[::-1]))
        return DesignVariable(
            lever.key, "at least", _between(values, chances, last), values, chances
        )
    return DesignVariable(lever.key, "none", None, values, chances)


def _between(values: Field, chances: Field, place: int) -> float:
    """Where the chance is enough, between two values."""
    order = np.argsort(chances[place : place + 2])
    return float(
        np.interp(SURELY, chances[place : place + 2][order], values[place : place + 2][order])
    )


def _chances(forward: Forward, z: Field, clr: float) -> Field:
    """Probability that CLR stays below, at each operating point: over contacts, and what the emulator leaves open."""
    mean, std = forward.emulated(z, [CLR])[CLR]
    limit = OUTPUTS[CLR].forward(np.array(clr))
    return np.asarray(ndtr((limit - mean) / np.maximum(std, 1e-9)).mean(axis=0))


def _moved(point: OperatingPoint, key: str, value: float) -> OperatingPoint:
    if key == LOAD:
        return replace(point, load_n=value)
    return (
        replace(point, entrainment_m_s=value)
        if key == SPEED
        else replace(point, temperature_k=value)
    )


def _put(z: Field, column: int, at: float) -> Field:
    moved = z.copy()
    moved[:, column] = at
    return moved
