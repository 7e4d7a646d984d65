"""Laws of the contact's spring and damper, each a small frozen value that is called with the contact under its load.

A law answers for itself: whether it is the asperities' spring alone, whether it needs the solved
contact. A new law is a new class here and one line in its table; its parameters are keywords of
`VibrationModel` and keys of the case file.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Annotated, ClassVar, NamedTuple

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.contact.hertz import line_stiffness, point_stiffness
from asperity.core.errors import BadInput, with_article
from asperity.core.quantities import Parameter, Parametric
from asperity.ehl import ContactSolution, ContactState
from asperity.solution import dynamic_stiffness, roller_depth, tangent_stiffness

FILM_EXPONENT = 0.13  # h ~ load^-0.13: Dowson and Higginson's film of a line contact
# γ in K = F/(γ Sq): S. Akarapu, T. Sharp, M. O. Robbins, Phys. Rev. Lett. 106 (2011) 204301
ROUGHNESS_FACTOR = 0.48


class LoadedContact(NamedTuple):
    """What a law may look at; `clr` in place of the state's own. Without a solution only scalars are known."""

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

    `asperities_alone`: no spring without touching asperities, and it carries and grows with their
    load; other laws need the solved contact. `by_load_share`: what it takes of the contact is its
    load share and means over it, so that it can be asked at another share. `point_spring`: a
    sphere's, force ~ compression^1.5, which a nonlinear response supposes.
    """

    name: ClassVar[str]
    asperities_alone: ClassVar[bool] = False
    by_load_share: ClassVar[bool] = False
    point_spring: ClassVar[bool] = False

    @abstractmethod
    def __call__(self, contact: LoadedContact) -> float:
        """dF/dz [N/m]."""

    def at_full_load(self, conditions: ContactConditions) -> "StiffnessLaw":  # noqa: ARG002 - the same in any contact
        """The law that says how stiff the contact is with all load on asperities."""
        return self


@dataclass(frozen=True, slots=True)
class HertzPoint(StiffnessLaw):
    """Stiffness of a sphere on a plane under the asperities' load, Rx and E* of the contact: the paper's Eqs 2-3."""

    name = "hertz-point"
    asperities_alone = by_load_share = True
    point_spring = True

    def __call__(self, contact: LoadedContact) -> float:
        """1.5 F/z0 [N/m]."""
        conditions = contact.conditions
        return point_stiffness(
            contact.asperity_load, conditions.radius_along_rolling, conditions.pair.reduced_modulus
        )


@dataclass(frozen=True, slots=True)
class _LineApproach(Parametric):
    """A line contact's approach depends on the depth that it is measured from."""

    # None: 2R/e, a roller held at its centre
    reference_depth: Annotated[float | None, Parameter("m", "d", "reference depth")] = None


@dataclass(frozen=True, slots=True)
class HertzLine(_LineApproach, StiffnessLaw):
    """Stiffness of a smooth line contact under the asperities' load: π E* L / (2 ln(2d/a))."""

    name = "hertz-line"
    asperities_alone = by_load_share = True

    def __call__(self, contact: LoadedContact) -> float:
        """S [N/m]; raises BadInput for a contact that is no line."""
        conditions = contact.conditions
        if not conditions.long:
            raise BadInput(
                f"stiffness law hertz-line needs a line contact, got {with_article(conditions.geometry)} contact"
            )
        return line_stiffness(
            contact.asperity_load,
            conditions.line_length,
            conditions.radius_along_rolling,
            conditions.pair.reduced_modulus,
            self.reference_depth or roller_depth(conditions),
        )


@dataclass(frozen=True, slots=True)
class ParallelFilm(StiffnessLaw):
    """Asperity layer and oil film side by side, both on the elastic bodies: 1/S = 1/S_bodies + 1/(k_a + k_f).

    S_bodies is Hertz's point spring under the whole load, k_a = CLR F / (γ Sq) the stiffness of a
    randomly rough layer, k_f = (1 - CLR) F / (0.13 h) that of a film with h ~ load^-0.13, h its
    mean over the Hertz zone.
    """

    name = "parallel-film"
    by_load_share = True

    def __call__(self, contact: LoadedContact) -> float:
        """S [N/m]."""
        state = contact.state
        layers = contact.asperity_load / (ROUGHNESS_FACTOR * state.sq) if state.sq > 0.0 else 0.0
        if state.h_mean > 0.0:
            layers += (1.0 - contact.clr) * contact.conditions.load / (FILM_EXPONENT * state.h_mean)
        bodies = HertzPoint()(contact._replace(clr=1.0))
        return bodies if layers == 0.0 else 1.0 / (1.0 / bodies + 1.0 / layers)


@dataclass(frozen=True, slots=True)
class Tangent(_LineApproach, StiffnessLaw):
    """Tangent stiffness of the solved contact itself, asperities and film: `asperity.solution.tangent_stiffness`."""

    name = "tangent"

    def __call__(self, contact: LoadedContact) -> float:
        """dF/dδ [N/m]; raises BadInput without a solution, NotConverged where a neighbouring load has none."""
        if contact.solution is None:
            raise BadInput(
                "stiffness law tangent needs the solved contact; solve the case, or take another law"
            )
        return self.of(contact.solution)

    def of(self, solution: ContactSolution) -> float:
        """dF/dδ of a solved contact [N/m]."""
        return tangent_stiffness(solution, reference_depth=self.reference_depth).total

    def at_full_load(self, conditions: ContactConditions) -> StiffnessLaw:
        """That of the smooth, dry contact: a tangent belongs to its own load share."""
        return HertzLine(self.reference_depth) if conditions.long else HertzPoint()


STIFFNESS_LAWS: dict[str, type[StiffnessLaw]] = {
    law.name: law for law in (HertzPoint, HertzLine, ParallelFilm, Tangent)
}


class DampingLaw(ABC):
    """Damping ratio ζ of the oscillator; `damping_ratio` is the one that the model states.

    `needs_solution`: only the solved contact can tell.
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
        """ζ, of a mass [kg] on a spring [N/m]."""

    def summary(self, damping_ratio: float) -> str:
        """The law and its number in a few words."""
        return f"damping ratio {damping_ratio:.3g} by the law {self.name}"


@dataclass(frozen=True, slots=True)
class RatioDamping(DampingLaw):
    """C = 2 ζ ω m: the paper's Eq 5."""

    name = "ratio"

    def __call__(
        self,
        *,
        mass: float,  # noqa: ARG002
        stiffness: float,  # noqa: ARG002
        damping_ratio: float,
        solution: ContactSolution | None = None,  # noqa: ARG002
    ) -> float:
        """ζ as stated."""
        return damping_ratio

    def summary(self, damping_ratio: float) -> str:
        """The ratio."""
        return f"damping ratio {damping_ratio:.3g}"


@dataclass(frozen=True, slots=True)
class ConstantDamping(Parametric, DampingLaw):
    """C is the same at any load: ζ = C / (2 sqrt(S m))."""

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
        """ζ of this C."""
        return self.damping / (2.0 * float(np.sqrt(stiffness * mass)))

    def summary(self, damping_ratio: float) -> str:  # noqa: ARG002
        """C."""
        return f"damping {self.damping:.3g} N s/m"


@dataclass(frozen=True, slots=True)
class HertzForRadian(DampingLaw):
    """The paper's Eq 5 with Eq 4's hertz in it: a damping ratio of ζ/2π."""

    name = "hertz-for-radian"

    def __call__(
        self,
        *,
        mass: float,  # noqa: ARG002
        stiffness: float,  # noqa: ARG002
        damping_ratio: float,
        solution: ContactSolution | None = None,  # noqa: ARG002
    ) -> float:
        """ζ/2π."""
        return damping_ratio / (2.0 * float(np.pi))


@dataclass(frozen=True, slots=True)
class ContactDamping(DampingLaw):
    """The solved contact's own ω c/2k at the oscillator's frequency, on top of ζ of all the rest, which is stated.

    Of asperities that have borne this load before; `asperity.solution.dynamic_stiffness`.
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
        """ζ of both; raises BadInput without a solution, or where the contact feeds more than the rest damps."""
        if solution is None:
            raise BadInput(
                "damping law contact needs the solved contact; solve the case, or take another law"
            )
        frequency_hz = float(np.sqrt(stiffness / mass) / (2.0 * np.pi))
        own = dynamic_stiffness(solution, frequency_hz).damping_ratio
        if own + damping_ratio <= 0.0:
            raise BadInput(
                f"the contact's oil feeds a vibration of {frequency_hz:.0f} Hz (damping ratio {own:.2g}) more than the "
                f"stated {damping_ratio:g} damps: no steady vibration; state more damping, or another mass"
            )
        return own + damping_ratio

    def summary(self, damping_ratio: float) -> str:
        """What is added to what."""
        return f"damping ratio {damping_ratio:.3g} and the solved contact's own"


DAMPING_LAWS: dict[str, type[DampingLaw]] = {
    law.name: law for law in (RatioDamping, ConstantDamping, HertzForRadian, ContactDamping)
}
