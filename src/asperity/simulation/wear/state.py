"""State of a wearing contact between two jumps, and its conversion to and from arrays."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from asperity.core.arrays import Field
from asperity.simulation.folder import Arrays
from asperity.surface import MovingSurfaces
from asperity.wear import MechanismState

Both = tuple[Field, Field]
FIELDS = ("worn", "flattened", "changed", "rates")


@dataclass(frozen=True, kw_only=True)
class WearState:
    """Both bodies' tracks at the beginning of a jump; maps in each body's own frame [m].

    `number` of the jump and its `time` [s]; `worn` the depth removed by the law, `flattened` the
    plastic flattening, `changed` the change by mechanisms (negative: removed). `booked` is the
    volume that `worn` must amount to [m^3], k times asperity load times sliding distance;
    `mechanical` the volume that mechanisms removed. `rates` [m/s] and `seconds` of the previous
    jump, to compare two jumps with one; `error` the accumulated relative error of Sq; `longest` [s]
    the limit that mechanisms set for the next jump. `facts` of the jump and `states` of the
    mechanisms, by name and body.
    """

    number: int = 0
    time: float = 0.0
    worn: Both
    flattened: Both
    changed: Both
    rates: Both
    seconds: float = 0.0
    booked: tuple[float, float] = (0.0, 0.0)
    mechanical: tuple[float, float] = (0.0, 0.0)
    error: float = 0.0
    longest: float = math.inf
    facts: Mapping[str, float] = field(default_factory=dict)
    states: Mapping[str, MechanismState] = field(default_factory=dict)

    @classmethod
    def unworn(cls, surfaces: MovingSurfaces) -> "WearState":
        """Return the state before any wear."""
        zero = (np.zeros(surfaces.first.grid.cells), np.zeros(surfaces.second.grid.cells))
        return cls(worn=zero, flattened=zero, changed=zero, rates=zero)

    def lowered(self, body: int) -> Field:
        """Return the depth by which a body's track is lower than at first [m]."""
        return np.asarray(self.worn[body] + self.flattened[body] - self.changed[body])

    def arrays(self) -> Arrays:
        """Return the arrays to store, by name."""
        arrays: Arrays = {
            f"{name}_{body}": getattr(self, name)[body] for name in FIELDS for body in (0, 1)
        }
        numbers = (
            self.number,
            self.time,
            self.seconds,
            self.error,
            self.longest,
            *self.booked,
            *self.mechanical,
        )
        arrays["numbers"] = np.array(numbers)
        for name, value in self.facts.items():
            arrays[f"fact:{name}"] = np.array(value)
        for name, state in self.states.items():
            arrays |= {f"state:{name}:{key}": value for key, value in state.items()}
        return arrays

    @classmethod
    def from_arrays(cls, arrays: Arrays) -> "WearState":
        """Rebuild a state from `arrays`."""
        number, time, seconds, error, longest, *volumes = map(float, arrays["numbers"])
        states: dict[str, Arrays] = {}
        for name, value in arrays.items():
            if name.startswith("state:"):
                mechanism, _, key = name.removeprefix("state:").partition(":")
                states.setdefault(mechanism, {})[key] = value
        facts = {
            name.removeprefix("fact:"): float(value)
            for name, value in arrays.items()
            if name.startswith("fact:")
        }
        maps: dict[str, Any] = {name: (arrays[f"{name}_0"], arrays[f"{name}_1"]) for name in FIELDS}
        base = cls(
            **maps, number=int(number), time=time, seconds=seconds, error=error, longest=longest
        )
        booked = (volumes[0], volumes[1])
        mechanical = (volumes[2], volumes[3])
        return replace(base, booked=booked, mechanical=mechanical, facts=facts, states=states)
