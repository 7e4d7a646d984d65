"""Dynamic stiffness and damping of a solved contact over frequency.

Each frequency takes a third of the solution time at 128 x 128 cells and as long as the solution at
256 x 256. The case states how many (`solver.dynamic`); the default is none.
"""

import math
from dataclasses import dataclass

import numpy as np

from asperity.core.arrays import Field, finite_or_none
from asperity.core.errors import AsperityError
from asperity.ehl import ContactSolution
from asperity.solution import OscillatingContact, Yielded

FREQUENCIES = 13  # default number
SPAN = (0.1, 4.0)  # frequency range over the resonance frequency


@dataclass(frozen=True, slots=True, kw_only=True)
class DynamicBranch:
    """Stiffness k [N/m] and damping c [N s/m] at each frequency, nan if not determined.

    `slow` is the stiffness at 0 Hz, where the film follows fully.
    """

    stiffness: Field
    damping: Field
    slow: float


@dataclass(frozen=True, slots=True, kw_only=True)
class DynamicCurve:
    """k(ω) and c(ω) of a solved contact, with cells at the cap `elastic` or flowing (`virgin`).

    `failures` lists the frequencies without a result, one sentence each.
    """

    frequency_hz: Field
    elastic: DynamicBranch
    virgin: DynamicBranch
    failures: tuple[str, ...] = ()

    def scalars(self) -> dict[str, object]:
        """Return the curve for `solve --json`; None where it is not determined."""
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
    """Compute the dynamic stiffness of a solved contact at `count` frequencies.

    Parameters
    ----------
    count : number of frequencies, logarithmically spaced over `SPAN`
    resonance_hz : one of the frequencies; default that at which oil crosses a half-width in one
        radian

    Raises
    ------
    BadInput
        for a solution of the conserving model, or of bodies at rest without a resonance.
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
    oscillating = OscillatingContact(solution, yielded=yielded)
    results = []
    for frequency_hz in (0.0, *frequency):
        try:
            dynamic = oscillating.evaluate(float(frequency_hz))
            results.append((dynamic.stiffness, dynamic.damping))
        except AsperityError as error:
            failures.append(str(error))
            results.append((math.nan, math.nan))
    stiffness, damping = np.array(results).T
    return DynamicBranch(stiffness=stiffness[1:], damping=damping[1:], slow=float(stiffness[0]))
