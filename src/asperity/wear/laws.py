"""Laws of removal: how fast a body loses depth where asperities of the other one rub over it, dw/dt = k times a law.

k is a wear coefficient in 1/Pa, each body's own: 1e-15 1/Pa is 1e-6 mm^3/(N m). Archard's
dimensionless K is k times the hardness. What only oil parts does not wear: a law is told the
pressure where bodies touch, and 0 elsewhere.
"""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, Protocol, get_args

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import BadInput, require_choice
from asperity.core.quantities import Parameter, Parametric

GAS_CONSTANT = 8.31446261815324  # [J/(mol K)]
Severity = Literal["mild", "moderate", "severe"]
SEVERITIES: tuple[Severity, ...] = get_args(Severity)
PRIORS: dict[
    Severity, tuple[float, float]
] = {  # dimensionless K: lubricated and mild, to unlubricated and severe
    "mild": (1e-10, 1e-8),
    "moderate": (1e-8, 1e-6),
    "severe": (1e-6, 1e-3),
}
SCATTER = (
    0.5  # standard deviation of ln k from test to test: -40 to +60 %, Podra and Andersson (1999)
)
NORMAL = 1.6448536269514722  # standard deviations on either side of 90 % of a normal distribution


@dataclass(frozen=True, slots=True, kw_only=True)
class Rubbing:
    """What happens to one body where the other rubs over it; maps of any shape.

    `pressure` where bodies touch [Pa], the oil there counted as CLR counts it; `shear` the
    friction that it causes [Pa], 0 or more; `temperature` of this body's surface [K], None unless
    the law asks for it; `sliding_speed` [m/s].
    """

    pressure: Field
    shear: Field
    sliding_speed: float
    temperature: Field | None = None


class RemovalLaw(Protocol):
    """A law of removal: a frozen dataclass of parameters."""

    needs_temperature: ClassVar[bool]

    def __call__(self, rubbing: Rubbing) -> Field:
        """What k is multiplied with for the depth lost in a second [Pa m/s], 0 or more."""
        ...

    def equal_to_archard(self, k: float, boundary_friction: float) -> float:
        """The law's coefficient [1/Pa] that takes off what Archard's takes off with `k`, where the law can tell."""
        ...


@dataclass(frozen=True, slots=True)
class Archard(Parametric):
    """Wear in proportion to asperity pressure and sliding: dw/dt = k p_a |u_s|.

    Source: J. F. Archard, J. Appl. Phys. 24 (1953) 981; on the contact pressure of mixed contacts
    D. Zhu, A. Martini, W. Wang, Y. Hu, B. Lisowsky, Q. J. Wang, J. Tribol. 129 (2007) 544.
    """

    needs_temperature: ClassVar[bool] = False

    def __call__(self, rubbing: Rubbing) -> Field:
        """p_a |u_s| [Pa m/s]."""
        return np.asarray(rubbing.pressure * rubbing.sliding_speed)

    def equal_to_archard(self, k: float, boundary_friction: float) -> float:  # noqa: ARG002
        """Its own k."""
        return k


@dataclass(frozen=True, slots=True)
class DissipatedEnergy(Parametric):
    """Wear in proportion to the friction work of the asperities: dw/dt = k τ_a |u_s|, k in m^3/J.

    τ_a is the boundary friction times the asperities' pressure, as in friction and heat of a
    contact; shearing the film wears nothing. 1 mm^3/J is 1e-9 m^3/J. Source: S. Fouvry, T.
    Liskiewicz, Ph. Kapsa, S. Hannel, E. Sauger, Wear 255 (2003) 287; A. Ramalho, J. C. Miranda,
    Wear 260 (2006) 361.
    """

    needs_temperature: ClassVar[bool] = False

    def __call__(self, rubbing: Rubbing) -> Field:
        """τ_a |u_s| [W/m^2]."""
        return np.asarray(rubbing.shear * rubbing.sliding_speed)

    def equal_to_archard(self, k: float, boundary_friction: float) -> float:
        """Its k over the boundary friction."""
        if boundary_friction <= 0.0:
            raise BadInput(
                "the energy law needs friction where bodies touch, got a boundary friction of 0; raise it"
            )
        return k / boundary_friction


@dataclass(frozen=True, slots=True)
class FilmDefect(Parametric):
    """Archard's law where the adsorbed film has gaps: dw/dt = k ψ p_a |u_s|, hotter contacts wear faster.

    ψ = 1 - exp(-(X/(|u_s| t0)) exp(-E/(R T))), the share of surface sites that a molecule has left
    while an asperity passes; k is that of the bare metal. Source: C. N. Rowe, ASLE Trans. 9 (1966)
    101; T. A. Stolarski, Wear 58 (1980) 99; the defaults are of the order that Rowe's n-hexadecane
    gives, recollected, not checked against it.
    """

    needs_temperature: ClassVar[bool] = True

    spacing: Annotated[float, Parameter("m", "X", "spacing of adsorbed molecules")] = 3e-10
    period: Annotated[float, Parameter("s", "t₀", "period of an adsorbed molecule's vibration")] = (
        3e-12
    )
    heat: Annotated[float, Parameter("J/mol", "E", "heat of adsorption")] = 4.9e4

    def defects(self, temperature: Field, sliding_speed: float) -> Field:
        """Share ψ of sites without a molecule at a surface temperature [K], 0 to 1."""
        crossing = self.spacing / (sliding_speed * self.period)
        return np.asarray(-np.expm1(-crossing * np.exp(-self.heat / (GAS_CONSTANT * temperature))))

    def __call__(self, rubbing: Rubbing) -> Field:
        """ψ p_a |u_s| [Pa m/s]."""
        if rubbing.sliding_speed == 0.0:
            return np.zeros_like(rubbing.pressure)
        if rubbing.temperature is None:
            raise ValueError("the film-defect law needs temperatures")
        bare = self.defects(rubbing.temperature, rubbing.sliding_speed)
        return np.asarray(bare * rubbing.pressure * rubbing.sliding_speed)

    def equal_to_archard(self, k: float, boundary_friction: float) -> float:  # noqa: ARG002
        """Its own k, that of bare metal."""
        return k


REMOVAL_LAWS: dict[str, type[RemovalLaw]] = {
    "archard": Archard,
    "energy": DissipatedEnergy,
    "film-defect": FilmDefect,
}


@dataclass(frozen=True, slots=True)
class Coefficient:
    """A wear coefficient k [1/Pa] and the ends of its 90 % interval over k."""

    k: float
    low: float
    high: float

    @classmethod
    def stated(cls, k: float, scatter: float = SCATTER) -> "Coefficient":
        """One that is known, from another test of the same kind perhaps: `scatter` is the deviation of its logarithm.

        Raises
        ------
        BadInput
            for a negative or infinite k, or scatter.
        """
        for name, value in (("wear coefficient k", k), ("scatter of k", scatter)):
            if not 0.0 <= value < math.inf:
                raise BadInput(
                    f"{name} must be finite and not negative, got {value:g}; correct its sign or value"
                )
        reach = math.exp(NORMAL * scatter)
        return cls(k, 1.0 / reach, reach)

    @classmethod
    def of_class(cls, severity: Severity, hardness: float | None) -> "Coefficient":
        """Of a class of wear, whose ends are the interval: the geometric mean of K between them over the hardness.

        Raises
        ------
        BadInput
            for a class that is none, or without a hardness [Pa].
        """
        require_choice("class of wear", severity, SEVERITIES)
        if hardness is None:
            raise BadInput(
                f'a class of wear ("{severity}") gives K = k times the hardness, and the case states no hardness; '
                "state material.hardness, or k in 1/Pa"
            )
        low, high = PRIORS[severity]
        middle = math.sqrt(low * high)
        return cls(middle / hardness, low / middle, high / middle)
