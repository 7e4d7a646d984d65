"""The main job: a case solved, its load sharing read off, its contact resonance found; kept in one file.

Does no physics of its own; prints nothing.
"""

import json
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from asperity import ehl
from asperity.arrays import Field
from asperity.case import Case, load_case
from asperity.coupling import Vibration, contact_vibration, require_sampling
from asperity.ehl import FILMS, HOT, ContactSolution, ContactState, FlashTemperature, Friction, friction_and_heat
from asperity.errors import AsperityError, BadInput, NotConverged, UnreadableFile
from asperity.quantities import lines, quantity, read
from asperity.surface import Surface
from asperity.wear import Resonance

if TYPE_CHECKING:
    import xarray

FULL_FILM_BELOW = 0.01  # share of the load on asperities
BOUNDARY_FROM = 0.9

Scalar = float | int | bool | None
RUN_GROUPS = ("load", "sharing", "film", "pressure", "friction", "heat", "stress", "resonance", "solver")
MAPS = ("von_mises", "von_mises_depth", "shear", "temperature_1", "temperature_2", "film_temperature")


@dataclass(frozen=True, kw_only=True)
class Run:
    """A solved case: the contact, what a tribologist reads off it, and how a mass on it vibrates.

    `vibration` is None for a case without [vibration]; `notes` are sentences a reader of the numbers has to know.
    Friction, heat and stress are worked out when they are first asked for.
    """

    case: Case
    solution: ContactSolution
    state: ContactState
    vibration: Vibration | None
    notes: tuple[str, ...] = ()

    @cached_property
    def _rubbing(self) -> tuple[Friction, FlashTemperature] | str:
        """Friction and heat, or why there are none."""
        try:
            case = self.case
            return friction_and_heat(self.solution, boundary_friction=case.boundary_friction, thermal=case.thermal)
        except BadInput:
            raise
        except AsperityError as error:  # the film, the load sharing and the stress are as good without it
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
        """`notes`, and what a reader of friction and heat has to know."""
        heat = self.heat
        if heat is None or self.case.thermal.feedback or heat.film_max_k < HOT or self.solution.lubricant is None:
            return self.notes
        hot = (
            f"The film warms up by up to {heat.film_max_k:.4g} K, and its oil is taken as viscous as when cold: "
            "friction and temperatures are too high; set thermal.feedback=true to let it thin."
        )
        return (*self.notes, hot)

    @property
    def friction_failure(self) -> str | None:
        """Why friction and heat could not be worked out; None when they were."""
        return self._rubbing if isinstance(self._rubbing, str) else None

    @cached_property
    def stress(self) -> ehl.SubsurfaceStress:
        """Stresses in body 1 under the solved pressure and friction's traction."""
        return ehl.subsurface_stress(self.solution, shear=None if self.friction is None else self.friction.shear)

    @property
    def resonance(self) -> Resonance | None:
        """The contact resonance; None where none was found or looked for."""
        resonance = None if self.vibration is None else self.vibration.resonance
        return resonance if resonance is not None and resonance.found else None

    @cached_property
    def sharing(self) -> ehl.LoadSharing:
        """The load by film."""
        return ehl.sharing_by_film(self.solution)

    @property
    def load_below(self) -> dict[str, float]:
        """Share of the load on films no thicker than each of `FILMS`."""
        return {f"{film * 1e9:.0f}nm": ehl.clr_below(self.solution, film) for film in FILMS}

    def scalars(self) -> dict[str, Scalar]:
        """Every number of the run by its key in the catalogue of quantities, SI; None where there is none."""
        return read(self, lines(*RUN_GROUPS))

    def verdict(self) -> str:
        """One sentence on the state of the contact.

        Full film: asperities carry less than 1 % of the load; boundary lubrication: 90 % or more; mixed between.
        """
        clr = self.state.clr
        if self.solution.lubricant is None:
            regime = "Dry contact"
        elif clr < FULL_FILM_BELOW:
            regime = "Full film"
        else:
            regime = "Boundary lubrication" if clr >= BOUNDARY_FROM else "Mixed lubrication"
        load, area = (quantity(key).text(value) for key, value in (("clr", clr), ("car", self.state.car)))
        sentence = f"{regime}: asperities carry {load} of the load on {area} of the Hertz zone"
        if not self.solution.convergence.converged:
            sentence = f"NOT CONVERGED, do not use: {sentence}"
        return f"{sentence}; {self.resonance_in_words()}."

    def resonance_in_words(self) -> str:
        """The contact resonance with its standard deviation, or why there is none."""
        if self.vibration is None:
            return "vibration not asked for"
        resonance = self.vibration.resonance
        if not resonance.found:
            return f"no contact resonance ({resonance.reason.rstrip('.')})"
        deviation = resonance.crf_std_hz
        if not math.isfinite(deviation):
            return f"contact resonance at {resonance.crf_hz:.0f} Hz"
        decimals = 1 if deviation < 2.0 else 0
        return f"contact resonance at {resonance.crf_hz:.{decimals}f} ± {deviation:.{decimals}f} Hz"

    def to_dataset(self) -> "xarray.Dataset":
        """The solution's dataset, with every number of the run and maps of traction, temperature and von Mises stress.

        A run that is loaded takes nothing from these: they are worked out anew. Maps are in single precision.
        """
        dataset, stress = self.solution.to_dataset(), self.stress
        axis = {"axis": "Z", "positive": "down"}
        dataset = dataset.assign_coords(depth=("depth", stress.depths, quantity("depth").attributes | axis))
        for entry in map(quantity, MAPS):
            values: Field | None = entry.at(self)
            if values is not None:
                dataset[entry.key] = (("x", "y"), values.astype(np.float32), entry.attributes)
        dataset["von_mises"].attrs["comment"] = f"Poisson's ratio {stress.poisson_ratio:g}"
        section = quantity("von_mises_section").attributes | {"comment": f"in the plane y = {stress.peak.y:g} m"}
        dataset["von_mises_section"] = (("x", "depth"), stress.von_mises[:, stress.row].astype(np.float32), section)
        for key, value in self.scalars().items():
            if value is not None and not isinstance(value, bool):
                dataset[key] = ((), value, quantity(key).attributes)
        return dataset

    def save(self, path: str | Path) -> Path:
        """Write the run as one netCDF that restates its case, whole or not at all, and return the path."""
        return ehl.save_dataset(self.to_dataset(), path)


def solve_case(
    case: Case,
    *,
    surface: Surface | None = None,
    progress: Callable[[ehl.Iteration], None] | None = None,
    strict: bool = True,
) -> Run:
    """Solve a case, and work out its vibration.

    Parameters
    ----------
    case : what to solve
    surface : composite roughness on the case's grid, in place of the case's own
    progress : called after every step of the solver
    strict : raise when the solver stops before its tolerance; else the run says so

    Raises
    ------
    BadInput
        for a surface that does not fit the case's grid, or cannot be made or read.
    NotConverged
        if `strict`; its `solution` is the unfinished contact.
    """
    if surface is not None:
        if surface.grid != case.grid:
            grids = f"got {surface.grid} where the case has {case.grid}"
            raise BadInput(f"surface must lie on the case's grid, {grids}; make it on case.grid")
        case = replace(case, stored=surface)
    roughness = case.surface()
    if case.vibration is not None:
        with case.naming("vibration"):
            require_sampling(case.conditions, case.vibration, roughness.sq)  # before the time a solution takes
    notes = (*case.surface_notes, *case.notes)
    kept = {"case": case.text, "notes": json.dumps(notes)}
    try:
        solution = ehl.solve_thermal_contact(
            case.conditions,
            case.lubricant,
            roughness,
            boundary_friction=case.boundary_friction,
            thermal=case.thermal,
            options=case.options,
            progress=progress,
            strict=strict,
        )
    except NotConverged as unfinished:
        raise NotConverged(replace(unfinished.solution, attributes=kept), str(unfinished)) from None
    return _run(case, replace(solution, attributes=kept), notes)


def load_run(path: str | Path) -> Run:
    """Read a run back: its fields as they were solved, everything else worked out from them anew.

    Raises
    ------
    UnreadableFile
        if the file is missing, damaged, or holds no case.
    """
    path = Path(path)
    solution = ehl.load_solution(path)
    try:
        text, notes = solution.attributes["case"], tuple(json.loads(solution.attributes["notes"]))
    except (KeyError, ValueError):
        alone = f"{path} holds a solution without its case"
        raise UnreadableFile(f"{alone}; save the run (Run.save), not its solution alone") from None
    case = load_case(text, folder=path.parent, name=str(path), stored=solution.surface)
    case = replace(case, stored_notes=tuple(note for note in notes if note not in case.notes))
    return _run(case, solution, notes)


def _run(case: Case, solution: ContactSolution, notes: tuple[str, ...]) -> Run:
    state = ehl.contact_state(solution)
    model = case.vibration
    with case.naming("vibration"):
        vibration = None if model is None else contact_vibration(state, case.conditions, model, solution=solution)
    if solution.options.model == "conserving":
        notes = (*notes, _threshold(solution))
    if not solution.convergence.converged:
        notes = (f"Not converged: {solution.convergence.explain()}.", *notes)
    return Run(case=case, solution=solution, state=state, vibration=vibration, notes=notes)


def _threshold(solution: ContactSolution) -> str:
    """What the conserving model's share of asperities counts, and what another film would make of it."""
    sharing = ehl.sharing_by_film(solution)
    shares = ", ".join(
        f"{100 * share:.0f} % of at most {film * 1e9:.0f} nm"
        for film, share in zip(sharing.films, sharing.below, strict=True)
    )
    return (
        "Model conserving: CLR and CAR count cells whose elastic bodies touch, though oil at the cap may have parted "
        f"them since; by film, the load lies on {shares}. The share at the contact film depends on the grid."
    )
