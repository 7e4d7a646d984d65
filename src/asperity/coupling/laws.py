"""Stiffness and damping laws: small frozen values, called with the contact under its load.

Each law states whether it describes the asperities' spring alone and whether it needs the solved
contact. A new law is a new class here and one line in its table; its parameters are keywords of
`VibrationModel` and keys of the case file.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Annotated, ClassVar, NamedTuple

import numpy as np

from asperity import solution as postprocessing
from asperity.contact.conditions import ContactConditions
from asperity.contact.hertz import line_stiffness, point_stiffness
from asperity.core.errors import BadInput, with_article
from asperity.core.quantities import Parameter, Parametric
from asperity.ehl import ContactSolution, ContactState

FILM_EXPONENT = 0.13  # h ~ load^-0.13: Dowson and Higginson's film of a line contact
# γ in K = F/(γ Sq): S. Akarapu, T. Sharp, M. O. Robbins, Phys. Rev. Lett. 106 (2011) 204301
ROUGHNESS_FACTOR = 0.48


class LoadedContact(NamedTuple):
    """Contact as seen by a law; `clr` replaces that of `state`; `solution` may be missing."""

    clr: float
    state: ContactState
    conditions: ContactConditions
    solution: ContactSolution | None = None

    @property
    def asperity_load(self) -> float:
        """Load on the asperities [N]."""
        return self.clr * self.conditions.load


class StiffnessLaw(ABC):
    """Stiffness of the contact [N/m].

    `asperities_alone`: the spring exists only with touching asperities, carries their load and
    grows with it; other laws need the solved contact. `by_load_share`: the law depends on the load
    share and on mean values only, so that it can be evaluated at another share. `point_spring`: a
    sphere's spring, force ~ compression^1.5, which a nonlinear response assumes.
    """

    name: ClassVar[str]
    asperities_alone: ClassVar[bool] = False
    by_load_share: ClassVar[bool] = False
    point_spring: ClassVar[bool] = False

    @abstractmethod
    def __call__(self, contact: LoadedContact) -> float:
        """Return dF/dz [N/m]."""

    def at_full_load(self, conditions: ContactConditions) -> "StiffnessLaw":  # noqa: ARG002 - the same in any contact
        """Return the law for the stiffness with all load on asperities."""
        return self


@dataclass(frozen=True, slots=True)
class HertzPoint(StiffnessLaw):
    """Stiffness of a sphere on a plane under the asperity load, with Rx and E* (Eqs 2-3)."""

    name = "hertz-point"
    asperities_alone = by_load_share = True
    point_spring = True

    def __call__(self, contact: LoadedContact) -> float:
        """Return 1.5 F/z0 [N/m]."""
        conditions = contact.conditions
        return point_stiffness(
            contact.asperity_load, conditions.radius_along_rolling, conditions.pair.reduced_modulus
        )


@dataclass(frozen=True, slots=True)
class _LineApproach(Parametric):
    """Reference depth of a line contact, on which its approach depends."""

    # None: 2R/e, a roller held at its centre
    reference_depth: Annotated[float | None, Parameter("m", "d", "reference depth")] = None


@dataclass(frozen=True, slots=True)
class HertzLine(_LineApproach, StiffnessLaw):
    """Stiffness of a smooth line contact under the asperity load: π E* L / (2 ln(2d/a))."""

    name = "hertz-line"
    asperities_alone = by_load_share = True

    def __call__(self, contact: LoadedContact) -> float:
        """Return S [N/m]; raise BadInput for a contact that is not a line contact."""
        conditions = contact.conditions
        if not conditions.long:
            raise BadInput(
                "stiffness law hertz-line needs a line contact, got "
                f"{with_article(conditions.geometry)} contact"
            )
        return line_stiffness(
            contact.asperity_load,
            conditions.line_length,
            conditions.radius_along_rolling,
            conditions.pair.reduced_modulus,
            self.reference_depth or postprocessing.roller_depth(conditions),
        )


@dataclass(frozen=True, slots=True)
class ParallelFilm(StiffnessLaw):
    """Asperity layer and film in parallel, in series with the bodies.

    1/S = 1/S_bodies + 1/(k_a + k_f). S_bodies is Hertz's point spring under the whole load, k_a =
    CLR F / (γ Sq) the stiffness of a randomly rough layer, k_f = (1 - CLR) F / (0.13 h) that of a
    film with h ~ load^-0.13, h its mean over the Hertz zone.
    """

    name = "parallel-film"
    by_load_share = True

    def __call__(self, contact: LoadedContact) -> float:
        """Return S [N/m]."""
        state = contact.state
        layers = contact.asperity_load / (ROUGHNESS_FACTOR * state.sq) if state.sq > 0.0 else 0.0
        if state.h_mean > 0.0:
            layers += (1.0 - contact.clr) * contact.conditions.load / (FILM_EXPONENT * state.h_mean)
        bodies = HertzPoint()(contact._replace(clr=1.0))
        return bodies if layers == 0.0 else 1.0 / (1.0 / bodies + 1.0 / layers)


@dataclass(frozen=True, slots=True)
class Tangent(_LineApproach, StiffnessLaw):
    """Tangent stiffness of the solved contact, asperities and film."""

    name = "tangent"

    def __call__(self, contact: LoadedContact) -> float:
        """Return dF/dδ [N/m].

        Raises
        ------
        BadInput
            without a solution.
        NotConverged
            if a neighbouring load cannot be solved.
        """
        if contact.solution is None:
            raise BadInput(
                "stiffness law tangent needs the solved contact; solve the case or use another law"
            )
        return postprocessing.tangent_stiffness(
            contact.solution, reference_depth=self.reference_depth
        ).total

    def at_full_load(self, conditions: ContactConditions) -> StiffnessLaw:
        """Return the law of the smooth, dry contact: a tangent holds at its own load share only."""
        return HertzLine(self.reference_depth) if conditions.long else HertzPoint()


STIFFNESS_LAWS: dict[str, type[StiffnessLaw]] = {
    law.name: law for law in (HertzPoint, HertzLine, ParallelFilm, Tangent)
}


class DampingLaw(ABC):
    """Damping ratio ζ of the oscillator; `damping_ratio` is the one stated in the model.

    `needs_solution`: the law needs the solved contact.
    """

    name: ClassVar[str]
    needs_solution: ClassVar[bool] = False

    @abstractmethod
    def __call__(
        self,
        *,
        mass: float,
        stiffness: float,
        damping_ratio: float,
        solution: ContactSolution | None = None,
    ) -> float:
        """Return ζ for a mass [kg] on a spring [N/m]."""

    def summary(self, damping_ratio: float) -> str:
        """Return the law and its value in a few words."""
        return f"damping ratio {damping_ratio:.3g} by the law {self.name}"


@dataclass(frozen=True, slots=True)
class RatioDamping(DampingLaw):
    """Constant damping ratio, C = 2 ζ ω m: the paper's Eq 5."""

    name = "ratio"
    divisor: ClassVar[float] = 1.0

    def __call__(
        self,
        *,
        mass: float,  # noqa: ARG002
        stiffness: float,  # noqa: ARG002
        damping_ratio: float,
        solution: ContactSolution | None = None,  # noqa: ARG002
    ) -> float:
        """Return ζ as stated, or as the law changes it."""
        return damping_ratio / self.divisor

    def summary(self, damping_ratio: float) -> str:
        """Return the damping ratio as text."""
        return f"damping ratio {damping_ratio:.3g}"


@dataclass(frozen=True, slots=True)
class ConstantDamping(Parametric, DampingLaw):
    """Constant damping coefficient C at any load: ζ = C / (2 sqrt(S m))."""

    damping: Annotated[float, Parameter("N s/m", "C", "damping")]

    name = "constant"

    def __call__(
        self,
        *,
        mass: float,
        stiffness: float,
        damping_ratio: float,  # noqa: ARG002
        solution: ContactSolution | None = None,  # noqa: ARG002
    ) -> float:
        """Return the ζ of this C."""
        return self.damping / (2.0 * float(np.sqrt(stiffness * mass)))

    def summary(self, damping_ratio: float) -> str:  # noqa: ARG002
        """Return C as text."""
        return f"damping {self.damping:.3g} N s/m"


@dataclass(frozen=True, slots=True)
class HertzForRadian(RatioDamping):
    """The paper's Eq 5 with the frequency of Eq 4 in Hz, not rad/s: a damping ratio of ζ/2π."""

    name = "hertz-for-radian"
    divisor: ClassVar[float] = 2.0 * float(np.pi)
    summary = DampingLaw.summary


@dataclass(frozen=True, slots=True)
class ContactDamping(DampingLaw):
    """Damping of the solved contact, ω c/2k at the oscillator's frequency, plus the stated ζ.

    Asperities have carried this load before; see `asperity.solution.dynamic_stiffness`.
    """

    name = "contact"
    needs_solution = True

    def __call__(
        self,
        *,
        mass: float,
        stiffness: float,
        damping_ratio: float,
        solution: ContactSolution | None = None,
    ) -> float:
        """Return the total ζ.

        Raises
        ------
        BadInput
            without a solution, or if the total is not positive (self-excited vibration).
        """
        if solution is None:
            raise BadInput(
                'the damping law "contact" needs a solved contact; solve the case or use another'
            )
        frequency_hz = float(np.sqrt(stiffness / mass) / (2.0 * np.pi))
        contact_ratio = postprocessing.dynamic_stiffness(solution, frequency_hz).damping_ratio
        if contact_ratio + damping_ratio <= 0.0:
            raise BadInput(
                f"the oil excites vibration at {frequency_hz:.0f} Hz (damping ratio "
                f"{contact_ratio:.2g}) more than the stated {damping_ratio:g} damps it, so that "
                "no steady vibration exists; state more damping or another mass"
            )
        return contact_ratio + damping_ratio

    def summary(self, damping_ratio: float) -> str:
        """Return both contributions as text."""
        return f"damping ratio {damping_ratio:.3g} plus that of the solved contact"


DAMPING_LAWS: dict[str, type[DampingLaw]] = {
    law.name: law for law in (RatioDamping, ConstantDamping, HertzForRadian, ContactDamping)
}
