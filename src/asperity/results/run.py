"""What the main job gives: a case solved, its load sharing read off, its contact resonance found; kept in one file.

Does no physics of its own, solves and prints nothing.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from asperity import ehl
from asperity.case import Case
from asperity.core.arrays import Field
from asperity.core.errors import AsperityError, BadInput
from asperity.core.quantities import lines, quantity, read
from asperity.coupling import Vibration, contact_vibration
from asperity.ehl import ContactSolution, ContactState
from asperity.resonance import Resonance
from asperity.results.dynamic import DynamicCurve, dynamic_curve
from asperity.results.surface_spread import (
    AVERAGED,
    Row,
    Scalar,
    half_interval,
    mean_row,
    whole_error,
)
from asperity.results.uncertainty_text import basis, in_words
from asperity.solution import (
    FILMS,
    HOT,
    AlongRoller,
    DynamicStiffness,
    FlashTemperature,
    Friction,
    LoadSharing,
    OwnResonance,
    RegimeCard,
    SubsurfaceStress,
    along_roller,
    clr_below,
    contact_state,
    friction_and_heat,
    own_resonance,
    regime_card,
    sharing_by_film,
    solution_notes,
    subsurface_stress,
    undetermined,
)

if TYPE_CHECKING:
    import xarray

FULL_FILM_BELOW = 0.01  # share of the load on asperities
BOUNDARY_FROM = 0.9

RUN_GROUPS = (*AVERAGED, "solver")
SHORT_GROUPS = tuple(
    group for group in RUN_GROUPS if group != "virgin"
)  # short tables show none of it
DOUBT = "uncertainty"  # group of the catalogue: of all surfaces together
ENDS = "ends"  # group of the catalogue: of rollers
DAMPING = "contact_damping_ratio"
CRUCIAL = ("clr", "clr_error", "car", "crf_hz", "crf_std_hz")
MAPS = (
    "von_mises",
    "von_mises_depth",
    "shear",
    "temperature_1",
    "temperature_2",
    "film_temperature",
)


@dataclass(frozen=True, kw_only=True)
class Run:
    """A solved case: the contact, what a tribologist reads off it, and how a mass on it vibrates.

    `vibration` is None for a case without [vibration]; `notes` are sentences a reader of the
    numbers has to know. Friction, heat and stress are worked out when they are first asked for.
    `others` are the numbers of further surfaces of the same kind that were solved: fields, state,
    vibration and friction are those of the first surface, `scalars` the means over all, and
    `error` says how far a single surface may be off them. `groups` of the catalogue are what
    `scalars` has of every surface.
    """

    case: Case
    solution: ContactSolution
    state: ContactState
    vibration: Vibration | None
    notes: tuple[str, ...] = ()
    others: tuple[Row, ...] = ()
    groups: tuple[str, ...] = RUN_GROUPS

    @cached_property
    def _rubbing(self) -> tuple[Friction, FlashTemperature] | str:
        """Friction and heat, or why there are none."""
        try:
            case = self.case
            return friction_and_heat(
                self.solution, boundary_friction=case.boundary_friction, thermal=case.thermal
            )
        except BadInput:
            raise
        except (
            AsperityError
        ) as error:  # the film, the load sharing and the stress are as good without it
            return str(error)

    @property
    def friction(self) -> Friction | None:
        """Friction under the case's boundary friction, oil and [thermal]; None where `friction_failure` says why."""
        return None if isinstance(self._rubbing, str) else self._rubbing[0]

    @property
    def heat(self) -> FlashTemperature | None:
        """Temperatures that friction causes; None where there is no friction."""
        return None if isinstance(self._rubbing, str) else self._rubbing[1]

    @property
    def remarks(self) -> tuple[str, ...]:
        """`notes`, and what a reader of friction, heat and stiffness over frequency has to know."""
        heat, curve = self.heat, self._over_frequency
        shaken = () if isinstance(curve, str) else curve.failures
        if isinstance(curve, str) and curve:
            shaken = (f"no stiffness over frequency: {curve}",)
        notes = (*self.notes, *(f"{sentence[:1].upper()}{sentence[1:]}." for sentence in shaken))
        if (
            heat is None
            or self.case.thermal.feedback
            or heat.film_max_k < HOT
            or self.solution.lubricant is None
        ):
            return notes
        hot = (
            f"The film warms up by up to {heat.film_max_k:.4g} K, and its oil is taken as viscous as when cold: "
            "friction and temperatures are too high; set thermal.feedback=true to let it thin."
        )
        return (*notes, hot)

    @property
    def friction_failure(self) -> str | None:
        """Why friction and heat could not be worked out; None when they were."""
        return self._rubbing if isinstance(self._rubbing, str) else None

    @cached_property
    def stress(self) -> SubsurfaceStress:
        """Stresses in body 1 under the solved pressure and friction's traction."""
        return subsurface_stress(
            self.solution, shear=None if self.friction is None else self.friction.shear
        )

    @property
    def resonance(self) -> Resonance | None:
        """The contact resonance; None where none was found or looked for."""
        resonance = None if self.vibration is None else self.vibration.resonance
        return resonance if resonance is not None and resonance.found else None

    @cached_property
    def _shaken(self) -> OwnResonance | str:
        """The mass on the solved contact's own stiffness, or why that is not known."""
        if self.case.vibration is None:
            return "no mass is stated; add [vibration]"
        if not self.solution.convergence.converged:
            return "the contact is not solved"
        try:
            return own_resonance(self.solution, self.case.vibration.mass)
        except AsperityError as error:  # every other number is as good without it
            return str(error)

    @property
    def own_resonance(self) -> OwnResonance | None:
        """The contact's own stiffness and damping where the mass resonates; None where `own_resonance_failure` is."""
        return None if isinstance(self._shaken, str) else self._shaken

    @property
    def own_resonance_failure(self) -> str | None:
        """Why there is no `own_resonance`; None where there is one."""
        return self._shaken if isinstance(self._shaken, str) else None

    @cached_property
    def _yielding(self) -> DynamicStiffness | str:
        """The same while cells at the pressure cap still yield, or why that is not known."""
        if isinstance(self._shaken, str):
            return self._shaken
        try:
            return self._shaken.virgin
        except AsperityError as error:  # the other limit is as good without it
            return str(error)

    @property
    def virgin_resonance(self) -> DynamicStiffness | None:
        """Stiffness and damping of virgin roughness; None where it is not known."""
        return None if isinstance(self._yielding, str) else self._yielding

    @cached_property
    def _over_frequency(self) -> DynamicCurve | str:
        """K and c over frequency, or why there are none; empty where the case asks for none."""
        count = self.case.contents.solver.dynamic
        if not count:
            return ""
        if not self.solution.convergence.converged:
            return "the contact is not solved"
        own = self.own_resonance
        try:
            return dynamic_curve(
                self.solution, count, None if own is None else own.elastic.frequency_hz
            )
        except AsperityError as error:  # every other number is as good without it
            return str(error)

    @property
    def dynamic_curve(self) -> DynamicCurve | None:
        """Stiffness and damping over frequency of the first surface's contact, as the case's `solver.dynamic` asks."""
        return None if isinstance(self._over_frequency, str) else self._over_frequency

    @property
    def damping_error(self) -> float | None:
        """How far the contact's damping ratio lies off on one further surface, with 90 %; None of one surface alone."""
        rows = (read(self, map(quantity, [DAMPING])), *self.others)
        found = [float(value) for row in rows if (value := row.get(DAMPING)) is not None]
        return half_interval(found) if len(found) > 1 else None

    @cached_property
    def sharing(self) -> LoadSharing:
        """The load by film."""
        return sharing_by_film(self.solution)

    @property
    def load_below(self) -> dict[str, float]:
        """Share of the load on films no thicker than each of `FILMS`."""
        return {f"{film * 1e9:.0f}nm": clr_below(self.solution, film) for film in FILMS}

    @property
    def error(self) -> ehl.ContactError:
        """How far load share and resonance may be off, and why."""
        assert self.state.error is not None  # it was read off a solution
        return self.state.error

    @cached_property
    def own_scalars(self) -> dict[str, Scalar]:
        """Every number of the first surface by its key in the catalogue of quantities, SI; None where there is none."""
        return self.numbers(self.groups)

    def numbers(self, groups: Sequence[str]) -> dict[str, Scalar]:
        """`own_scalars` of some groups of the catalogue; a roller's along its length go with them."""
        return read(self, lines(*groups, *([] if self.along is None else [ENDS])))

    @cached_property
    def along(self) -> AlongRoller | None:
        """A roller along its length; None for a contact of another geometry."""
        return along_roller(self.solution)

    def scalars(self) -> dict[str, Scalar]:
        """Every number of the run by its key, SI: means over its surfaces, and intervals; of the first how it went."""
        return mean_row((self.own_scalars, *self.others)) | read(self, lines(DOUBT))

    @cached_property
    def card(self) -> RegimeCard:
        """What kind of contact it is, and how far its film is from published fits."""
        return regime_card(self.solution)

    @cached_property
    def undetermined(self) -> str | None:
        """Why this grid cannot tell CLR; None where it can."""
        return undetermined(self.solution, self.error.clr)

    @property
    def determined(self) -> bool:
        """Whether CLR is more than a figure of this grid: converged, resolved, and with an error bar below 15 %."""
        return self.solution.convergence.converged and self.undetermined is None

    def summary(self) -> dict[str, Any]:
        """What `solve --json` prints: every number, the grid's cells, the regime card and what is to be noted.

        Of an oil by its data sheet also its numbers under `oil`, and below them the `origins` of
        each.
        """
        facts = self.case.oil_facts
        origins = {fact.key: ": ".join(filter(None, (fact.origin, fact.how))) for fact in facts}
        oil = (
            {"oil": {**{fact.key: fact.value for fact in facts}, "origins": origins}}
            if facts
            else {}
        )
        return {
            **self.scalars(),
            "cells": list(self.solution.grid.cells),
            "regime_card": self.card.to_dict(),
            **oil,
            **(
                {}
                if self.dynamic_curve is None
                else {"dynamic_curve": self.dynamic_curve.scalars()}
            ),
            "notes": [*self.remarks, *self._without_virgin()],
        }

    def _without_virgin(self) -> Iterator[str]:
        """A sentence where one limit of the contact's stiffness is known and the other is not, though asked for."""
        if (
            "virgin" in self.groups
            and self.own_resonance is not None
            and isinstance(self._yielding, str)
        ):
            yield f"There is no stiffness of virgin roughness: {self._yielding}."

    def verdict(self) -> str:
        """One sentence on the state of the contact, of its surfaces' means and with 90 % intervals.

        Full film: asperities carry less than 1 % of the load; boundary lubrication: 90 % or more;
        mixed between. On a grid that cannot tell CLR it says so instead, and why.
        """
        numbers, error = mean_row((self.crucial, *self.others)), self.error
        clr, car = (float(numbers[key]) for key in ("clr", "car"))
        if self.solution.lubricant is None:
            regime = "Dry contact"
        elif clr < FULL_FILM_BELOW:
            regime = "Full film"
        else:
            regime = "Boundary lubrication" if clr >= BOUNDARY_FROM else "Mixed lubrication"
        load, area = (quantity(key).text(value) for key, value in (("clr", clr), ("car", car)))
        shared = f"asperities carry {load} of the load {in_words('clr', error.clr)} on {area} of the Hertz zone"
        sentence = f"{regime}: {shared}"
        if self.undetermined is not None:
            sentence = (
                f"Grid too coarse, CLR not determined ({self.undetermined}): on this grid {shared}"
            )
        if not self.solution.convergence.converged:
            sentence = f"NOT CONVERGED, do not use: {sentence}"
        return f"{sentence}; {self._ends_in_words()}{self.resonance_in_words()}; {basis(error)}."

    def _ends_in_words(self) -> str:
        """What presses on a roller's ends, and on how much of it the load lies; nothing for other contacts."""
        if self.along is None:
            return ""
        numbers, edge = self.numbers([]), quantity("edge_pressure_pa")
        pressure, middle = (
            self.along.edge_pressure,
            quantity("middle_pressure_pa").named(numbers["middle_pressure_pa"]),
        )
        if pressure is None:
            said = f"no {edge.name}, the grid ends before"
        elif pressure.value is None:
            said = f"{edge.name} not determined, {middle}"
        else:
            hertz = pressure.value / self.solution.conditions.hertz.p_max
            said = f"{edge.short} {edge.text_in(numbers)}, {hertz:.2f} times an even load's"
        return f"{said}, {quantity('loaded_share').named(numbers['loaded_share'])}; "

    @property
    def crucial(self) -> Row:
        """What the verdict and the intervals need of the first surface: numbers that take no time."""
        return read(self, map(quantity, CRUCIAL))

    def resonance_in_words(self) -> str:
        """The contact resonance with its interval, or why there is none."""
        if self.vibration is None:
            return "vibration not asked for"
        rows = (self.crucial, *self.others)
        found = sum(row["crf_hz"] is not None for row in rows)
        error = self.error.crf_hz
        if not found or error is None:
            return f"no contact resonance ({self.vibration.resonance.reason.rstrip('.')})"
        most = "" if found == len(rows) else f", on {found} of {len(rows)} surfaces"
        return f"contact resonance at {error.value:.0f} Hz {in_words('crf_hz', error)}{most}"

    def to_dataset(self) -> "xarray.Dataset":
        """The run as an xarray dataset: its `contents`."""
        return self.contents().to_dataset()

    def contents(self) -> ehl.Contents:
        """The solution's contents, with every number of the run and maps of traction, temperature and von Mises stress.

        A run that is loaded takes nothing from these: they are worked out anew. Maps are in single
        precision.
        """
        (variables, coordinates, attributes), stress = self.solution.contents(), self.stress
        axis = {"axis": "Z", "positive": "down"}
        coordinates["depth"] = ("depth", stress.depths, quantity("depth").attributes | axis)
        for entry in map(quantity, MAPS):
            values: Field | None = entry.value_from(self)
            if values is not None:
                variables[entry.key] = (("x", "y"), values.astype(np.float32), entry.attributes)
        variables["von_mises"][2]["comment"] = f"Poisson's ratio {stress.poisson_ratio:g}"
        section = quantity("von_mises_section").attributes | {
            "comment": f"in the plane y = {stress.peak.y:g} m"
        }
        variables["von_mises_section"] = (
            ("x", "depth"),
            stress.von_mises[:, stress.row].astype(np.float32),
            section,
        )
        curve = self.dynamic_curve
        if curve is not None:
            coordinates["dynamic_frequency"] = (
                "dynamic_frequency",
                curve.frequency_hz,
                quantity("dynamic_frequency").attributes,
            )
            for suffix, branch in (("", curve.elastic), ("_virgin", curve.virgin)):
                for name in ("dynamic_stiffness", "dynamic_damping"):
                    values = getattr(branch, name.removeprefix("dynamic_"))
                    key = f"{name}{suffix}"
                    variables[key] = ("dynamic_frequency", values, quantity(key).attributes)
        for key, value in self.scalars().items():
            if value is not None and not isinstance(value, bool):
                variables[key] = ((), value, quantity(key).attributes)
        return ehl.Contents(variables, coordinates, attributes)

    def save(self, path: str | Path) -> Path:
        """Write the run as one netCDF that restates its case, whole or not at all, and return the path."""
        return self.contents().save(path)


def run_of(
    case: Case,
    solution: ContactSolution,
    notes: Sequence[str],
    others: Sequence[Row] = (),
    vibration: Vibration | None = None,
    groups: tuple[str, ...] = RUN_GROUPS,
) -> Run:
    """The run of a case that is solved, its vibration worked out, unless it is known.

    `others` are the numbers of further surfaces, of these `groups` of the catalogue.
    """
    state = contact_state(solution)
    model = case.vibration
    if model is not None and vibration is None:
        with case.naming("vibration"):
            vibration = contact_vibration(state, case.conditions, model, solution=solution)
    notes = (*notes, *solution_notes(solution))
    if solution.options.model == "conserving":
        notes = (*notes, _threshold(solution))
    if not solution.convergence.converged:
        notes = (f"Not converged: {solution.convergence.explain()}.", *notes)
    rows = tuple(others)
    run = Run(
        case=case,
        solution=solution,
        state=state,
        vibration=vibration,
        notes=notes,
        others=rows,
        groups=groups,
    )
    error = whole_error(state, (run.crucial, *others), case.conditions, model, vibration)
    return replace(run, state=replace(state, error=error))


def _threshold(solution: ContactSolution) -> str:
    """What the conserving model's share of asperities counts, and what another film would make of it."""
    sharing = sharing_by_film(solution)
    shares = ", ".join(
        f"{100 * share:.0f} % of at most {film * 1e9:.0f} nm"
        for film, share in zip(sharing.films, sharing.below, strict=True)
    )
    return (
        "Model conserving: CLR and CAR count cells whose elastic bodies touch, though oil at the cap may have parted "
        f"them since; by film, the load lies on {shares}. The share at the contact film depends on the grid."
    )
