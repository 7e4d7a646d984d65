"""Wear laws: rate of depth loss of a body where asperities slide over it, dw/dt = k times a law.

k is a wear coefficient in 1/Pa, one per body: 1e-15 1/Pa is 1e-6 mm^3/(N m). Archard's
dimensionless K is k times the hardness. The oil film does not wear: laws receive the pressure
where the bodies touch, and 0 elsewhere.
"""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, Protocol, get_args

import numpy as np

from asperity.core.arrays import Field
from asperity.core.coverage import NORMAL_FACTOR
from asperity.core.errors import BadInput, require_choice
from asperity.core.quantities import Parameter, Parametric

GAS_CONSTANT = 8.31446261815324  # [J/(mol K)]
Severity = Literal["mild", "moderate", "severe"]
SEVERITIES: tuple[Severity, ...] = get_args(Severity)
# range of the dimensionless K, from lubricated and mild to unlubricated and severe
PRIORS: dict[Severity, tuple[float, float]] = {
    "mild": (1e-10, 1e-8),
    "moderate": (1e-8, 1e-6),
    "severe": (1e-6, 1e-3),
}
# standard deviation of ln k from test to test: -40 to +60 %, Podra and Andersson (1999)
SCATTER = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class RubbingConditions:
    """Conditions at one body's surface under sliding asperities; maps of any shape.

    `pressure` where the bodies touch [Pa], with the oil there counted as CLR counts it; `shear` the
    friction stress that it causes [Pa], 0 or more; `temperature` of this body's surface [K], None
    unless the law needs it; `sliding_speed` [m/s].
    """

    pressure: Field
    shear: Field
    sliding_speed: float
    temperature: Field | None = None


class RemovalLaw(Protocol):
    """Wear law: a frozen dataclass of parameters."""

    needs_temperature: ClassVar[bool]

    def __call__(self, rubbing: RubbingConditions) -> Field:
        """Return what k multiplies to give the rate of depth loss [Pa m/s], 0 or more."""
        ...

    def equivalent_coefficient(self, k: float, boundary_friction: float) -> float:
        """Return this law's coefficient [1/Pa] that removes as much as Archard's law with `k`."""
        ...


@dataclass(frozen=True, slots=True)
class Archard(Parametric):
    """Wear proportional to asperity pressure and sliding speed: dw/dt = k p_a |u_s|.

    Source: J. F. Archard, J. Appl. Phys. 24 (1953) 981; on the contact pressure of mixed contacts
    D. Zhu, A. Martini, W. Wang, Y. Hu, B. Lisowsky, Q. J. Wang, J. Tribol. 129 (2007) 544.

    Examples
    --------
    >>> import numpy as np
    >>> from asperity.wear import Archard, RubbingConditions
    >>> conditions = RubbingConditions(
    ...     pressure=np.array([1e9]), shear=np.array([1e8]), sliding_speed=0.5
    ... )
    >>> Archard()(conditions)
    array([5.e+08])
    """

    needs_temperature: ClassVar[bool] = False

    def __call__(self, rubbing: RubbingConditions) -> Field:
        """Return p_a |u_s| [Pa m/s]."""
        return np.asarray(rubbing.pressure * rubbing.sliding_speed)

    def equivalent_coefficient(self, k: float, boundary_friction: float) -> float:  # noqa: ARG002
        """Return `k` itself."""
        return k


@dataclass(frozen=True, slots=True)
class DissipatedEnergy(Parametric):
    """Wear proportional to the friction power of asperities: dw/dt = k τ_a |u_s|, [k] = m^3/J.

    τ_a is the boundary friction coefficient times the asperity pressure, as in the friction and
    heat of a contact; film shear causes no wear. 1 mm^3/J is 1e-9 m^3/J. Source: S. Fouvry, T.
    Liskiewicz, Ph. Kapsa, S. Hannel, E. Sauger, Wear 255 (2003) 287; A. Ramalho, J. C. Miranda,
    Wear 260 (2006) 361.
    """

    needs_temperature: ClassVar[bool] = False

    def __call__(self, rubbing: RubbingConditions) -> Field:
        """Return τ_a |u_s| [W/m^2]."""
        return np.asarray(rubbing.shear * rubbing.sliding_speed)

    def equivalent_coefficient(self, k: float, boundary_friction: float) -> float:
        """Return `k` over the boundary friction."""
        if boundary_friction <= 0.0:
            raise BadInput(
                "the energy law needs friction where bodies touch, got a boundary friction of 0; "
                "raise it"
            )
        return k / boundary_friction


@dataclass(frozen=True, slots=True)
class FilmDefect(Parametric):
    """Archard's law with the fraction of defects in the adsorbed film: dw/dt = k ψ p_a |u_s|.

    ψ = 1 - exp(-(X/(|u_s| t0)) exp(-E/(R T))) is the fraction of surface sites that a molecule has
    left while an asperity passes, so hotter contacts wear faster; k is that of the bare metal.
    Source: C. N. Rowe, ASLE Trans. 9 (1966) 101; T. A. Stolarski, Wear 58 (1980) 99; the defaults
    have the order of magnitude of Rowe's n-hexadecane, quoted from memory and not checked.
    """

    needs_temperature: ClassVar[bool] = True

    spacing: Annotated[float, Parameter("m", "X", "spacing of adsorbed molecules")] = 3e-10
    period: Annotated[float, Parameter("s", "t₀", "vibration period of an adsorbed molecule")] = (
        3e-12
    )
    heat: Annotated[float, Parameter("J/mol", "E", "heat of adsorption")] = 4.9e4

    def defects(self, temperature: Field, sliding_speed: float) -> Field:
        """Return the fraction ψ of sites without a molecule at a temperature [K], 0 to 1."""
        crossing = self.spacing / (sliding_speed * self.period)
        return np.asarray(-np.expm1(-crossing * np.exp(-self.heat / (GAS_CONSTANT * temperature))))

    def __call__(self, rubbing: RubbingConditions) -> Field:
        """Return ψ p_a |u_s| [Pa m/s]."""
        if rubbing.sliding_speed == 0.0:
            return np.zeros_like(rubbing.pressure)
        if rubbing.temperature is None:
            raise ValueError("the film-defect law needs temperatures")
        bare = self.defects(rubbing.temperature, rubbing.sliding_speed)
        return np.asarray(bare * rubbing.pressure * rubbing.sliding_speed)

    def equivalent_coefficient(self, k: float, boundary_friction: float) -> float:  # noqa: ARG002
        """Return `k` itself, that of bare metal."""
        return k


REMOVAL_LAWS: dict[str, type[RemovalLaw]] = {
    "archard": Archard,
    "energy": DissipatedEnergy,
    "film-defect": FilmDefect,
}


@dataclass(frozen=True, slots=True)
class WearCoefficient:
    """Wear coefficient k [1/Pa], and the ends of its interval relative to k.

    Examples
    --------
    >>> from asperity.wear import WearCoefficient
    >>> WearCoefficient.from_value(1e-17)
    WearCoefficient(k=1e-17, low=0.4393641049274925, high=2.276016608514317)
    """

    k: float
    low: float
    high: float

    @classmethod
    def from_value(cls, k: float, scatter: float = SCATTER) -> "WearCoefficient":
        """Return a known coefficient; `scatter` is the standard deviation of ln k.

        Raises
        ------
        BadInput
            for a negative or infinite `k` or `scatter`.
        """
        for name, value in (("wear coefficient k", k), ("scatter of k", scatter)):
            if not 0.0 <= value < math.inf:
                raise BadInput(
                    f"{name} must be finite and not negative, got {value:g}; "
                    "correct its sign or value"
                )
        reach = math.exp(NORMAL_FACTOR * scatter)
        return cls(k, 1.0 / reach, reach)

    @classmethod
    def from_severity(cls, severity: Severity, hardness: float | None) -> "WearCoefficient":
        """Return a wear class's coefficient: geometric mean of its range of K over hardness.

        The ends of the range are the interval.

        Raises
        ------
        BadInput
            for an unknown class, or without a hardness [Pa].
        """
        require_choice("class of wear", severity, SEVERITIES)
        if hardness is None:
            raise BadInput(
                f'a class of wear ("{severity}") gives K = k times the hardness, '
                "and the case states no hardness; state material.hardness, or k in 1/Pa"
            )
        low, high = PRIORS[severity]
        middle = math.sqrt(low * high)
        return cls(middle / hardness, low / middle, high / middle)
