"""Quantities derived from one solved contact on demand."""

from dataclasses import dataclass
from functools import cached_property

from asperity.case import Case
from asperity.core.errors import BadInput
from asperity.ehl import ContactSolution, ContactState
from asperity.results.determined import Determined
from asperity.solution import (
    FILMS,
    AxialDistribution,
    FlashTemperature,
    Friction,
    LoadSharing,
    Observables,
    SubsurfaceStress,
    axial_distribution,
    clr_below,
    friction_and_heat,
    observables,
    sharing_by_film,
    subsurface_stress,
)


@dataclass(frozen=True, kw_only=True, repr=False)
class Derived:
    """Friction, heat, stress, load sharing and observables of a solved contact of a case."""

    case: Case
    solution: ContactSolution
    state: ContactState

    @cached_property
    def _friction_and_heat(self) -> Determined[tuple[Friction, FlashTemperature]]:
        """Friction and heat, if determined."""
        case = self.case
        return Determined.attempt(
            lambda: friction_and_heat(
                self.solution, boundary_friction=case.boundary_friction, thermal=case.thermal
            ),
            reraise=(BadInput,),
        )

    @property
    def friction(self) -> Friction | None:
        """Friction with the case's boundary friction, oil and [thermal]; None if it failed."""
        determined = self._friction_and_heat.value
        return None if determined is None else determined[0]

    @property
    def heat(self) -> FlashTemperature | None:
        """Temperatures due to friction; None without friction."""
        determined = self._friction_and_heat.value
        return None if determined is None else determined[1]

    @property
    def friction_failure(self) -> str | None:
        """Reason why friction and heat are not available; None if they are."""
        return self._friction_and_heat.reason or None

    @cached_property
    def stress(self) -> SubsurfaceStress:
        """Stresses in body 1 under the solved pressure and the traction of friction."""
        return subsurface_stress(
            self.solution, shear=None if self.friction is None else self.friction.shear
        )

    @cached_property
    def sharing(self) -> LoadSharing:
        """Load shares by film thickness."""
        return sharing_by_film(self.solution)

    @property
    def load_below(self) -> dict[str, float]:
        """Load share on films no thicker than each of `FILMS`."""
        return {f"{film * 1e9:.0f}nm": clr_below(self.solution, film) for film in FILMS}

    @cached_property
    def axial(self) -> AxialDistribution | None:
        """Distributions along a roller; None for another geometry."""
        return axial_distribution(self.solution)

    @cached_property
    def observables(self) -> Observables | None:
        """Capacitance, resistance and reflection that sensors observe; None if it failed."""
        rise = 0.0 if self.heat is None else self.heat.film
        return Determined.attempt(
            lambda: observables(
                self.solution, self.case.sensing, thermal=self.case.thermal, film_rise=rise
            )
        ).value
