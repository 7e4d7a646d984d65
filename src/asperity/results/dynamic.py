"""Stiffness and damping of a solved contact over frequency: its dynamic stiffness, asked for as often as wanted.

Each frequency costs a third of the solve at 128 x 128 cells and as much as the solve at 256 x 256,
so a case says how many (`solver.dynamic`); none by default.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from asperity.core.arrays import Field, finite_or_none
from asperity.core.errors import AsperityError
from asperity.ehl import ContactSolution
from asperity.solution import ShakenContact, Yielded

FREQUENCIES = 13  # unless the case says
SPAN = (0.1, 4.0)  # of the resonance, from and to


@dataclass(frozen=True, slots=True, kw_only=True)
class DynamicBranch:
    """k [N/m] and c [N s/m] at each frequency, shape (frequencies,), nan where there is no answer.

    `slow` is the stiffness against a change so slow that the film follows.
    """

    stiffness: Field
    damping: Field
    slow: float


@dataclass(frozen=True, slots=True, kw_only=True)
class DynamicCurve:
    """k(ω) and c(ω) of a solved contact: yielded cells elastic, as on tracks that come round again, and `virgin`.

    `failures` are the frequencies without an answer, a sentence each.
    """

    frequency_hz: Field
    elastic: DynamicBranch
    virgin: DynamicBranch
    failures: tuple[str, ...] = ()

    def scalars(self) -> dict[str, Any]:
        """What `solve --json` prints of it; None where there is no answer."""
        return {
            "frequency_hz": self.frequency_hz.tolist(),
            "stiffness_n_m": _listed(self.elastic.stiffness),
            "damping_ns_m": _listed(self.elastic.damping),
            "slow_stiffness_n_m": finite_or_none(self.elastic.slow),
            "stiffness_virgin_n_m": _listed(self.virgin.stiffness),
            "damping_virgin_ns_m": _listed(self.virgin.damping),
            "slow_stiffness_virgin_n_m": finite_or_none(self.virgin.slow),
        }


def _listed(values: Field) -> list[float | None]:
    return [finite_or_none(float(value)) for value in values]


def dynamic_curve(
    solution: ContactSolution, count: int, resonance_hz: float | None
) -> DynamicCurve:
    """Shake a solved contact at so many frequencies.

    Parameters
    ----------
    count : of the frequencies, evenly on a logarithmic scale over `SPAN`
    resonance_hz : one of them; without it, where the oil crosses a half-width in a radian of the oscillation

    Raises
    ------
    BadInput
        for a solution of the conserving model, or of bodies that do not move and have no resonance given.
    """
    middle = resonance_hz
    if middle is None:
        conditions = solution.conditions
        speed = (
            conditions.entrainment_speed or conditions.hertz.half_widths[0]
        )  # 1/s where nothing moves
        middle = speed / (2.0 * math.pi * conditions.hertz.half_widths[0])
    octaves = np.linspace(math.log(SPAN[0]), math.log(SPAN[1]), count)
    octaves -= octaves[np.argmin(np.abs(octaves))]  # one of them is the resonance itself
    frequency = middle * np.exp(octaves)
    failures: list[str] = []
    elastic, virgin = (
        _branch(solution, frequency, yielded, failures) for yielded in ("elastic", "flowing")
    )
    return DynamicCurve(
        frequency_hz=frequency, elastic=elastic, virgin=virgin, failures=tuple(failures)
    )


def _branch(
    solution: ContactSolution, frequency: Field, yielded: Yielded, failures: list[str]
) -> DynamicBranch:
    shaken = ShakenContact(solution, yielded=yielded)
    found = []
    for one in (0.0, *frequency):
        try:
            answer = shaken.at(float(one))
            found.append((answer.stiffness, answer.damping))
        except AsperityError as refusal:
            failures.append(str(refusal))
            found.append((math.nan, math.nan))
    stiffness, damping = np.array(found).T
    return DynamicBranch(stiffness=stiffness[1:], damping=damping[1:], slow=float(stiffness[0]))
