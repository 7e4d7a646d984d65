"""Design: the load, speed, viscosity or roughness that keeps CLR below a value."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from scipy.special import ndtr

from asperity.core.arrays import Field
from asperity.core.documents import JsonObject
from asperity.core.errors import BadInput
from asperity.core.quantities import quantity
from asperity.inference.forward import ForwardModel
from asperity.inference.observations import ObservationPoint
from asperity.inference.outputs import CLR, OUTPUTS
from asperity.inference.priors import Unknown
from asperity.inference.settings import LOAD, SPEED, TEMPERATURE, Setting

PROBABILITY = 0.95  # required of CLR below the value
VALUES = 25  # of each design variable, along its range
CONTACTS = 600  # draws evaluated at each value
VARIABLE_KEYS = ("surface.sq", "lubricant.viscosity.eta0", TEMPERATURE, LOAD, SPEED)
NAMES = {LOAD: "load_n", SPEED: "entrainment_speed_m_s", TEMPERATURE: "oil_temperature_k"}

Way = Literal["at most", "at least", "any", "none"]


@dataclass(frozen=True)
class DesignVariable:
    """Bound on one quantity that keeps CLR below a value, all else as known.

    `way` is "at most" or "at least" `bound` [SI], or "any" or "none" of the range. `chances` are
    the probabilities at `values` [SI] over the range.
    """

    key: str
    way: Way
    bound: float | None
    values: Field = field(repr=False)
    chances: Field = field(repr=False)

    def sentence(self) -> str:
        """Return the result as a sentence."""
        entry = quantity(self.key)
        span = f"{entry.number(float(self.values.min()))} to {entry.text(float(self.values.max()))}"
        if self.bound is None:
            return f"{entry.name}: {'any' if self.way == 'any' else 'none'} of {span}"
        return f"{entry.name}: {self.way} {entry.text(self.bound)}"

    def scalars(self) -> JsonObject:
        """Return the JSON output."""
        return {
            "key": self.key,
            "way": self.way,
            "bound": self.bound,
            "values": self.values.tolist(),
            "chances": self.chances.tolist(),
        }


@dataclass(frozen=True)
class Design:
    """Changes that keep CLR below `clr` with a probability of 95 %; `now` is the present one."""

    clr: float
    now: float
    levers: tuple[DesignVariable, ...]

    def sentence(self) -> str:
        """Return the result as a sentence."""
        limit = quantity(CLR).text(self.clr)
        bounds = "; ".join(lever.sentence() for lever in self.levers)
        return (
            f"CLR stays below {limit} with a probability of {self.now:.2f} at present; "
            f"changing one quantity gives {PROBABILITY:.2f} for {bounds}."
        )

    def scalars(self) -> JsonObject:
        """Return the JSON output."""
        return {
            "clr": self.clr,
            "probability": PROBABILITY,
            "now": self.now,
            "sentence": self.sentence(),
            "levers": [lever.scalars() for lever in self.levers],
        }


def require_share(name: str, clr: float) -> None:
    """Raise BadInput unless `clr` is a load share."""
    if not 0.0 < clr < 1.0:
        raise BadInput(f"{name} must be a load share between 0 and 1, got {clr:g}; 0.3 is 30 %")


def design_contact(forward: ForwardModel, z: Field, *, clr: float) -> Design:
    """Find the load, speed, viscosity (or temperature) or roughness that keeps CLR below a value.

    Each quantity alone is varied along its range for all draws, at the first operating point.

    Parameters
    ----------
    forward : its first operating point is the one evaluated
    z : draws of the unknowns (n, dims), from prior or posterior
    clr : maximum load share

    Raises
    ------
    BadInput
        for a `clr` outside 0 to 1.
    """
    require_share("`clr`", clr)
    chosen = z[:: max(1, len(z) // CONTACTS)][:CONTACTS]
    model = replace(forward, points=forward.points[:1])
    levers = [_design_variable(model, chosen, entry, clr) for entry in _variables(model.setting)]
    return Design(clr, float(_probability_below(model, chosen, clr)[0]), tuple(levers))


def _variables(setting: Setting) -> Sequence[Unknown]:
    """Return the unknowns and operating quantities that can be chosen by design."""
    candidates = {unknown.range.key: unknown for unknown in setting.contact}
    candidates |= {entry.key: Unknown(NAMES[entry.key], entry) for entry in setting.operating}
    return [candidates[key] for key in VARIABLE_KEYS if key in candidates]


def _design_variable(
    forward: ForwardModel, z: Field, unknown: Unknown, clr: float
) -> DesignVariable:
    shares = np.linspace(0.0, 1.0, VALUES)
    values = unknown.to_si(np.array([unknown.range.value(share) for share in shares]))
    key = unknown.range.key
    if key in NAMES:
        varied = replace(
            forward, points=tuple(_with_value(forward.points[0], key, float(v)) for v in values)
        )
        chances = _probability_below(varied, z, clr)
    else:
        column = forward.setting.unknowns.index(unknown)
        chances = np.array(
            [
                _probability_below(forward, _with_column(z, column, value), clr)[0]
                for value in unknown.at_share(shares)
            ]
        )
    sufficient = chances >= PROBABILITY
    way: Way = "any" if sufficient.all() else "none"
    bound = None
    if sufficient[0] and not sufficient.all():
        last = int(np.argmin(sufficient)) - 1  # end of the sufficient values from the low end
        way = "at most"
        bound = _crossing(values, chances, last)
    elif sufficient[-1] and not sufficient.all():
        last = VALUES - 1 - int(np.argmin(sufficient[::-1]))
        way = "at least"
        bound = _crossing(values, chances, last)
    return DesignVariable(unknown.key, way, bound, values, chances)


def _crossing(values: Field, chances: Field, index: int) -> float:
    """Interpolate the value at which the probability is reached."""
    order = np.argsort(chances[index : index + 2])
    return float(
        np.interp(PROBABILITY, chances[index : index + 2][order], values[index : index + 2][order])
    )


def _probability_below(forward: ForwardModel, z: Field, clr: float) -> Field:
    """Return the probability of CLR below `clr` at each point, over draws and emulator error."""
    mean, std = forward.emulate(z, [CLR])[CLR]
    limit = OUTPUTS[CLR].forward(np.array(clr))
    return np.asarray(ndtr((limit - mean) / np.maximum(std, 1e-9)).mean(axis=0))


def _with_value(point: ObservationPoint, key: str, value: float) -> ObservationPoint:
    if key == LOAD:
        return replace(point, load_n=value)
    return (
        replace(point, entrainment_m_s=value)
        if key == SPEED
        else replace(point, temperature_k=value)
    )


def _with_column(z: Field, column: int, value: float) -> Field:
    changed = z.copy()
    changed[:, column] = value
    return changed
