"""What the contact's roughness does to a mass on it: which excitation passes below, averaged over which contact patch.

A law makes an `asperity.vibration.Excitation` of the contact under its load, and says what keeps
it from doing so.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, fields
from typing import Annotated, ClassVar, Literal, TypeAlias, get_args

from asperity.contact.conditions import ContactConditions
from asperity.contact.hertz import point_contact
from asperity.core.errors import BadInput, require_choice, require_positive
from asperity.core.quantities import Parameter, Parametric
from asperity.coupling.laws import LoadedContact
from asperity.ehl import ContactState
from asperity.vibration import Excitation, FilteredNoise, NoiseFilter, PatchAverage, SurfaceTrack

Coefficient: TypeAlias = Literal["readjusted", "kept"]


class ExcitationLaw(ABC):
    """What passes under the mass. `needs_solution`: only the solved contact can tell."""

    name: ClassVar[str]
    label: ClassVar[str]  # of a profile in a figure
    needs_solution: ClassVar[bool] = False

    @abstractmethod
    def __call__(self, contact: LoadedContact) -> Excitation:
        """The excitation of this contact; raises BadInput where it has none."""

    def objection(self, state: ContactState) -> str | None:  # noqa: ARG002 - none in any contact
        """Why nothing excites the mass on this contact; None where something does."""
        return None

    @property
    @abstractmethod
    def summary(self) -> str:
        """The excitation in a line; a noise's defaults are left out."""


@dataclass(frozen=True, kw_only=True)
class CutoffLaw(Parametric):
    """Cut-off of the profile: fc = fc_ref (CAR/CAR_ref)^q.

    The paper names no law. 30 Hz is the base case of its dry section 2, in which everything
    touches, hence CAR_ref = 1; q = 0.18 is where its "the two effects offset" holds (in
    proportion, q = 1, CRFA would grow 60 000-fold).
    """

    cutoff_reference_hz: Annotated[
        float, Parameter("Hz", "fc_ref", "cut-off reference frequency")
    ] = 30.0
    car_reference: Annotated[float, Parameter("", "CAR_ref", "reference CAR")] = 1.0
    cutoff_exponent: Annotated[float, Parameter("", "q")] = 0.18

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 <= self.cutoff_exponent <= 2.0:
            raise BadInput(
                f"cut-off exponent must lie between 0 and 2, got {self.cutoff_exponent:g}; 0.18 is the default"
            )

    def cutoff_hz(self, car: float) -> float:
        """Cut-off [Hz] of an area share CAR, counted in the Hertz zone as the paper does."""
        return float(self.cutoff_reference_hz * (car / self.car_reference) ** self.cutoff_exponent)


@dataclass(frozen=True, kw_only=True)
class NoiseExcitation(NoiseFilter, CutoffLaw, ExcitationLaw):
    """Filtered Gaussian noise of height Sq.

    By default Sq is the height of the process, not of the one record: scaling each record to Sq
    would hand the chance of a few hundred slow waves on to CRFA (about 9 % at 30 Hz and 4 s). The
    noise's `coefficient` is "readjusted" to the height at every cut-off, or "kept" from the
    reference cut-off.
    """

    coefficient: Coefficient = "readjusted"

    name = "noise"
    label = "filtered"

    def __post_init__(self) -> None:
        CutoffLaw.__post_init__(self)
        NoiseFilter.__post_init__(self)
        require_choice("noise coefficient", self.coefficient, get_args(Coefficient))

    def __call__(self, contact: LoadedContact) -> Excitation:
        """The noise behind the cut-off of this CAR; raises BadInput for a flat surface or where nothing touches."""
        car = require_positive("area share of the asperities (CAR)", contact.state.car)
        return FilteredNoise(
            height=require_positive("roughness Sq", contact.state.sq, "m"),
            cutoff_hz=self.cutoff_hz(car),
            reference_cutoff_hz=self.cutoff_reference_hz if self.coefficient == "kept" else None,
            **{entry.name: getattr(self, entry.name) for entry in fields(NoiseFilter)},
        )

    def objection(self, state: ContactState) -> str | None:
        """The noise's cut-off is counted inside the Hertz zone."""
        if state.car == 0.0:
            return "asperities touch outside the Hertz zone only, and the excitation is counted inside it"
        return None

    @property
    def summary(self) -> str:
        """Height, filter and cut-off."""
        height = {"rms": "RMS", "ra": "Ra"}[self.height_as]
        of = "" if self.height_of == "process" else f" of the {self.height_of}"
        kind = "" if self.filter == "continuous" else f"{self.filter} "
        order = "" if self.filter_order == 2 else f" of order {self.filter_order}"
        kept = ", coefficient kept" if self.coefficient == "kept" else ""
        return (
            f"white noise of {height} height Sq{of} behind a {kind}low pass{order} at {self.cutoff_reference_hz:.4g} Hz"
            f" × (CAR/{self.car_reference:.3g})^{self.cutoff_exponent:.3g}{kept}"
        )


@dataclass(frozen=True, kw_only=True)
class _Passing(Parametric):
    """Roughness passes the contact at this speed; None: the sliding speed."""

    passing_speed: Annotated[float | None, Parameter("m/s", "v", "passing speed")] = None

    def speed(self, conditions: ContactConditions) -> float:
        """Speed [m/s]; raises BadInput where nothing passes."""
        speed = conditions.sliding_speed if self.passing_speed is None else self.passing_speed
        if speed == 0.0:
            raise BadInput(
                "roughness passes the contact at the sliding speed, which is 0; give passing_speed, or slip"
            )
        return speed


@dataclass(frozen=True, kw_only=True)
class SurfaceExcitation(_Passing, ExcitationLaw):
    """The solved contact's surface, its own spectrum run over."""

    name = "surface"
    label = "the surface run over"
    needs_solution = True

    def __call__(self, contact: LoadedContact) -> Excitation:
        """The surface's track; raises BadInput without a solution, for a flat surface, or where nothing passes."""
        speed = self.speed(contact.conditions)
        if contact.solution is None:
            raise BadInput(
                "excitation surface needs the solved contact's surface; solve the case, or take noise"
            )
        return SurfaceTrack.of(contact.solution.surface, speed)

    summary = "the surface's own spectrum run over"


EXCITATIONS: dict[str, type[ExcitationLaw]] = {
    law.name: law for law in (NoiseExcitation, SurfaceExcitation)
}


class PatchLaw(ABC):
    """Over which contact patch an excitation is averaged."""

    name: ClassVar[str]

    @abstractmethod
    def __call__(self, source: Excitation, contact: LoadedContact) -> Excitation:
        """The averaged excitation."""

    @property
    def summary(self) -> str:
        """The patch, to stand behind its excitation."""
        return f", averaged over a {self.name} patch"


@dataclass(frozen=True, kw_only=True)
class NoPatch(PatchLaw):
    """The profile as it is."""

    name = "none"

    def __call__(self, source: Excitation, contact: LoadedContact) -> Excitation:  # noqa: ARG002
        """The excitation itself."""
        return source

    summary = ""


@dataclass(frozen=True, kw_only=True)
class LinePatch(_Passing, PatchLaw):
    """Half-width of the smooth line contact under the whole load."""

    name = "line"

    def __call__(self, source: Excitation, contact: LoadedContact) -> Excitation:
        """Averaged over the line; raises BadInput where nothing passes."""
        half_width, speed = contact.conditions.hertz.half_widths[0], self.speed(contact.conditions)
        return PatchAverage(source=source, shape="line", half_width=half_width, speed=speed)


@dataclass(frozen=True, kw_only=True)
class PointPatch(_Passing, PatchLaw):
    """Radius of the sphere's contact under the asperities' load."""

    name = "point"

    def __call__(self, source: Excitation, contact: LoadedContact) -> Excitation:
        """Averaged over the circle; raises BadInput where nothing passes or asperities carry nothing."""
        conditions, speed = contact.conditions, self.speed(contact.conditions)
        load = require_positive("load share of the asperities (CLR)", contact.clr) * conditions.load
        point = point_contact(
            load, conditions.radius_along_rolling, conditions.pair.reduced_modulus
        )
        return PatchAverage(
            source=source, shape="point", half_width=point.half_widths[0], speed=speed
        )


CONTACT_PATCHES: dict[str, type[PatchLaw]] = {
    law.name: law for law in (NoPatch, LinePatch, PointPatch)
}
