"""Excitation of the mass by the contact's roughness, and averaging over the contact patch.

A law turns the contact under its load into an `asperity.vibration.Excitation`, or states why it
cannot.
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
    """Excitation of the mass. `needs_solution`: the law needs the solved contact."""

    name: ClassVar[str]
    label: ClassVar[str]  # label of a profile in a figure
    needs_solution: ClassVar[bool] = False

    @abstractmethod
    def __call__(self, contact: LoadedContact) -> Excitation:
        """Return the excitation of this contact; raise BadInput if there is none."""

    def objection(self, state: ContactState) -> str | None:  # noqa: ARG002 - none in any contact
        """Return the reason why this contact has no excitation; None if it has one."""
        return None

    @property
    @abstractmethod
    def summary(self) -> str:
        """Description in one line; default values are omitted."""


@dataclass(frozen=True, kw_only=True)
class CutoffLaw(Parametric):
    """Cut-off frequency of the profile: fc = fc_ref (CAR/CAR_ref)^q.

    The paper states no law. 30 Hz is the base case of its dry section 2, in which everything
    touches, hence CAR_ref = 1; at q = 0.18 its "the two effects offset" holds (in proportion, q =
    1, CRFA would grow 60 000-fold).
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
                f"cut-off exponent must be between 0 and 2, got {self.cutoff_exponent:g}; the "
                "default is 0.18"
            )

    def cutoff_hz(self, car: float) -> float:
        """Return the cut-off [Hz] at an area share CAR in the Hertz zone."""
        return float(self.cutoff_reference_hz * (car / self.car_reference) ** self.cutoff_exponent)


@dataclass(frozen=True, kw_only=True)
class NoiseExcitation(NoiseFilter, CutoffLaw, ExcitationLaw):
    """Filtered Gaussian noise of height Sq.

    By default Sq is the height of the process, not of a single record: scaling each record to Sq
    would transfer the scatter of a few hundred slow waves to CRFA (about 9 % at 30 Hz and 4 s). The
    noise `coefficient` is "readjusted" to the height at every cut-off, or "kept" from the reference
    cut-off.
    """

    coefficient: Coefficient = "readjusted"

    name = "noise"
    label = "filtered"

    def __post_init__(self) -> None:
        CutoffLaw.__post_init__(self)
        NoiseFilter.__post_init__(self)
        require_choice("noise coefficient", self.coefficient, get_args(Coefficient))

    def __call__(self, contact: LoadedContact) -> Excitation:
        """Return the noise at this CAR's cut-off; raise BadInput if flat or without contact."""
        car = require_positive("area share of the asperities (CAR)", contact.state.car)
        return FilteredNoise(
            height=require_positive("roughness Sq", contact.state.sq, "m"),
            cutoff_hz=self.cutoff_hz(car),
            reference_cutoff_hz=self.cutoff_reference_hz if self.coefficient == "kept" else None,
            **{entry.name: getattr(self, entry.name) for entry in fields(NoiseFilter)},
        )

    def objection(self, state: ContactState) -> str | None:
        """Return the reason if no asperity touches in the Hertz zone, on which CAR depends."""
        if state.car == 0.0:
            return (
                "asperities touch outside the Hertz zone only, but the excitation is defined "
                "inside it"
            )
        return None

    @property
    def summary(self) -> str:
        """Height, filter and cut-off."""
        height = {"rms": "RMS", "ra": "Ra"}[self.height_as]
        scope = "" if self.height_of == "process" else f" of the {self.height_of}"
        kind = "" if self.filter == "continuous" else f"{self.filter} "
        order = "" if self.filter_order == 2 else f" of order {self.filter_order}"
        suffix = ", coefficient kept" if self.coefficient == "kept" else ""
        return (
            f"white noise of {height} height Sq{scope} behind a {kind}low pass{order} at "
            f"{self.cutoff_reference_hz:.4g} Hz × "
            f"(CAR/{self.car_reference:.3g})^{self.cutoff_exponent:.3g}{suffix}"
        )


@dataclass(frozen=True, kw_only=True)
class _Passing(Parametric):
    """Speed at which roughness passes the contact; default the sliding speed."""

    passing_speed: Annotated[float | None, Parameter("m/s", "v", "passing speed")] = None

    def speed(self, conditions: ContactConditions) -> float:
        """Return the speed [m/s]; raise BadInput if it is zero."""
        speed = conditions.sliding_speed if self.passing_speed is None else self.passing_speed
        if speed == 0.0:
            raise BadInput(
                "roughness passes the contact at the sliding speed, which is 0; give "
                "passing_speed or slip"
            )
        return speed


@dataclass(frozen=True, kw_only=True)
class SurfaceExcitation(_Passing, ExcitationLaw):
    """Spectrum of the solved contact's surface, traversed at the passing speed."""

    name = "surface"
    label = "surface profile"
    needs_solution = True

    def __call__(self, contact: LoadedContact) -> Excitation:
        """Return the surface's track; raise BadInput without solution, roughness or speed."""
        speed = self.speed(contact.conditions)
        if contact.solution is None:
            raise BadInput(
                "excitation surface needs the solved contact's surface; solve the case or use noise"
            )
        return SurfaceTrack.from_surface(contact.solution.surface, speed)

    summary = "spectrum of the contact's surface"


EXCITATIONS: dict[str, type[ExcitationLaw]] = {
    law.name: law for law in (NoiseExcitation, SurfaceExcitation)
}


class PatchLaw(ABC):
    """Averaging of an excitation over a contact patch."""

    name: ClassVar[str]

    @abstractmethod
    def __call__(self, source: Excitation, contact: LoadedContact) -> Excitation:
        """Return the averaged excitation."""

    @property
    def summary(self) -> str:
        """Description of the patch, appended to that of the excitation."""
        return f", averaged over a {self.name} patch"


@dataclass(frozen=True, kw_only=True)
class NoPatch(PatchLaw):
    """No averaging."""

    name = "none"

    def __call__(self, source: Excitation, contact: LoadedContact) -> Excitation:  # noqa: ARG002
        """Return the excitation unchanged."""
        return source

    summary = ""


@dataclass(frozen=True, kw_only=True)
class LinePatch(_Passing, PatchLaw):
    """Patch with the half-width of the smooth line contact under the whole load."""

    name = "line"

    def __call__(self, source: Excitation, contact: LoadedContact) -> Excitation:
        """Return the average over the line; raise BadInput if the speed is zero."""
        half_width = contact.conditions.hertz.half_widths[0]
        speed = self.speed(contact.conditions)
        return PatchAverage(source=source, shape="line", half_width=half_width, speed=speed)


@dataclass(frozen=True, kw_only=True)
class PointPatch(_Passing, PatchLaw):
    """Patch with the radius of the sphere's contact under the asperity load."""

    name = "point"

    def __call__(self, source: Excitation, contact: LoadedContact) -> Excitation:
        """Return the average over the circle; raise BadInput without speed or asperity load."""
        conditions = contact.conditions
        speed = self.speed(contact.conditions)
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
