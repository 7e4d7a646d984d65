"""The main job: a case solved, its load sharing read off, its contact resonance found; kept in one file.

Does no physics of its own; prints nothing.
"""

import json
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from asperity.arrays import Field
from asperity.case import Case, load_case
from asperity.coupling import (
    LINEAR_UP_TO,
    Vibration,
    contact_vibration,
    dry_full_load,
    needs_solution,
    require_sampling,
)
from asperity.ehl import (
    FILMS,
    HOT,
    ContactSolution,
    ContactState,
    FlashTemperature,
    Friction,
    Iteration,
    LoadSharing,
    SubsurfaceStress,
    clr_below,
    contact_state,
    friction_and_heat,
    load_solution,
    save_dataset,
    sharing_by_film,
    solve_thermal_contact,
    subsurface_stress,
)
from asperity.errors import AsperityError, BadInput, NotConverged, UnreadableFile
from asperity.quantities import catalogue
from asperity.surface import Surface
from asperity.wear import Resonance

if TYPE_CHECKING:
    import xarray

FULL_FILM_BELOW = 0.01  # share of the load on asperities
BOUNDARY_FROM = 0.9

Scalar = float | int | bool | None


@dataclass(frozen=True, kw_only=True)
class Run:
    """A solved case: the contact, what a tribologist reads off it, and what an accelerometer would hear.

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
            return friction_and_heat(
                self.solution, boundary_friction=self.case.boundary_friction, thermal=self.case.thermal
            )
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
    def stress(self) -> SubsurfaceStress:
        """Stresses in body 1 under the solved pressure and friction's traction."""
        return subsurface_stress(self.solution, shear=None if self.friction is None else self.friction.shear)

    @property
    def resonance(self) -> Resonance | None:
        """The contact resonance; None where none was found or looked for."""
        resonance = None if self.vibration is None else self.vibration.resonance
        return resonance if resonance is not None and resonance.found else None

    @cached_property
    def sharing(self) -> LoadSharing:
        """The load by film."""
        return sharing_by_film(self.solution)

    @property
    def load_below(self) -> dict[str, float]:
        """Share of the load on films no thicker than each of `FILMS`."""
        return {f"{film * 1e9:.0f}nm": clr_below(self.solution, film) for film in FILMS}

    def scalars(self) -> dict[str, Scalar]:
        """Every number of the run by its key in the catalogue of quantities, SI; None where there is none."""
        return {entry.key: _read(self, entry.source) for entry in catalogue().values() if entry.source}

    def verdict(self) -> str:
        """One sentence on the state of the contact.

        Full film: asperities carry less than 1 % of the load; boundary lubrication: 90 % or more; mixed between.
        """
        clr, car = self.state.clr, self.state.car
        if self.solution.lubricant is None:
            regime = "Dry contact"
        elif clr < FULL_FILM_BELOW:
            regime = "Full film"
        else:
            regime = "Boundary lubrication" if clr >= BOUNDARY_FROM else "Mixed lubrication"
        sentence = f"{regime}: asperities carry {100 * clr:.1f} % of the load on {100 * car:.1f} % of the Hertz zone"
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
        deviation = _finite(resonance.crf_std_hz)
        if deviation is None:
            return f"contact resonance at {resonance.crf_hz:.0f} Hz"
        decimals = 1 if deviation < 2.0 else 0
        return f"contact resonance at {resonance.crf_hz:.{decimals}f} ± {deviation:.{decimals}f} Hz"

    def to_dataset(self) -> "xarray.Dataset":
        """The solution's dataset, with maps of traction, temperature and von Mises stress in single precision.

        A run that is loaded takes nothing from these maps: they are worked out anew.
        """
        dataset, stress = self.solution.to_dataset(), self.stress
        depth = {"long_name": "depth below the surface of body 1", "units": "m", "axis": "Z", "positive": "down"}
        dataset = dataset.assign_coords(depth=("depth", stress.depths, depth))
        where = f"largest below the surface of body 1, Poisson's ratio {stress.poisson_ratio:g}"
        maps: dict[str, tuple[Field, str, str]] = {
            "von_mises": (stress.largest, f"von Mises stress, {where}", "Pa"),
            "von_mises_depth": (stress.depth_of_largest, "depth of the largest von Mises stress", "m"),
        }
        if self.friction is not None and self.heat is not None:
            maps |= {
                "shear": (self.friction.shear, "traction along rolling on body 1", "Pa"),
                "temperature_1": (self.heat.surface_1, "temperature of surface 1 above ambient", "K"),
                "temperature_2": (self.heat.surface_2, "temperature of surface 2 above ambient", "K"),
                "film_temperature": (self.heat.film, "mean temperature across the film above ambient", "K"),
            }
        for name, (values, text, unit) in maps.items():
            dataset[name] = (("x", "y"), values.astype(np.float32), {"long_name": text, "units": unit})
        section = {"long_name": f"von Mises stress in the plane y = {stress.peak.y:g} m", "units": "Pa"}
        dataset["von_mises_section"] = (("x", "depth"), stress.von_mises[:, stress.row].astype(np.float32), section)
        return dataset

    def save(self, path: str | Path) -> Path:
        """Write the run as one netCDF that restates its case, whole or not at all, and return the path."""
        return save_dataset(self.to_dataset(), path)


def solve_case(
    case: Case,
    *,
    surface: Surface | None = None,
    progress: Callable[[Iteration], None] | None = None,
    strict: bool = True,
) -> Run:
    """Solve a case and listen to it.

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
            raise BadInput(
                f"surface must lie on the case's grid, got {surface.grid} where the case has {case.grid}; "
                "make it on case.grid"
            )
        case = replace(case, stored=surface)
    roughness = case.surface()
    if case.vibration is not None:
        with case.naming("vibration"):
            require_sampling(case.conditions, case.vibration, roughness.sq)  # before the time a solution takes
    notes = (*case.surface_notes, *case.notes)
    kept = {"case": case.text, "notes": json.dumps(notes)}
    try:
        solution = solve_thermal_contact(
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


def vibrate_case(case: Case, *, progress: Callable[[Iteration], None] | None = None) -> tuple[Vibration, ContactState]:
    """The vibration model alone: what the case sounds like, and the contact that was listened to.

    That is the paper's section 2, dry and with all load on asperities of the case's Sq; or the solved contact, where
    the case's stiffness law or excitation needs one.

    Raises
    ------
    BadInput
        for a case without [vibration], or one that `contact_vibration` refuses.
    NotConverged
        if the contact is needed and cannot be solved.
    """
    model = case.vibration
    if model is None:
        raise BadInput(f"{case.source}: vibration is left out; add [vibration] with mass and damping_ratio")
    if needs_solution(model):
        run = solve_case(case, progress=progress)
        assert run.vibration is not None  # the case has a model
        return run.vibration, run.state
    state = dry_full_load(case.conditions, case.surface().sq)
    with case.naming("vibration"):
        return contact_vibration(state, case.conditions, model), state


def vibration_scalars(heard: Vibration, state: ContactState, case: Case) -> dict[str, Any]:
    """Every number of `asperity vibrate --json` by its name, SI; None where there is none."""
    found, spring = heard.resonance, heard.oscillator
    return {
        "verdict": vibration_verdict(heard, state, case),
        "crf_hz": _finite(found.crf_hz),
        "crfa": _finite(found.crfa),
        "crf_std_hz": _finite(found.crf_std_hz),
        "crfa_std": _finite(found.crfa_std),
        "found": found.found,
        "reason": found.reason,
        "band_hz": list(heard.band_hz),
        "full_load_crf_hz": heard.full_load_crf_hz,
        "natural_frequency_hz": None if spring is None else spring.natural_frequency_hz,
        "stiffness_n_per_m": None if spring is None else spring.stiffness,
        "damping_ratio": None if spring is None else spring.damping_ratio,
        "expected_crfa": heard.expected_crfa,
        "dynamic_load": heard.dynamic_load,
        "contact_loss": heard.contact_loss,
        "clr": state.clr,
        "car": state.car,
        "sq_m": state.sq,
        "load_n": case.conditions.load,
    }


def vibration_verdict(heard: Vibration, state: ContactState, case: Case) -> str:
    """One sentence: the resonance, of which contact, and whether its spring may be taken as linear."""
    found, model = heard.resonance, case.vibration
    solved = model is not None and needs_solution(model)
    contact = (
        f"solved contact, {100 * state.clr:.0f} % of {case.conditions.load:g} N on asperities"
        if solved
        else f"dry contact, all {case.conditions.load:g} N on asperities"
    )
    if not found.found:
        return f"No contact resonance ({found.reason.rstrip('.')}): {contact}."
    deviation = f" ± {found.crf_std_hz:.1f}" if _finite(found.crf_std_hz) is not None else ""
    sentence = f"Contact resonance at {found.crf_hz:.1f}{deviation} Hz, CRFA {found.crfa:.3g} (m/s^2)^2/Hz: {contact}"
    linear = model is not None and model.response != "nonlinear"
    if linear and heard.dynamic_load is not None and heard.dynamic_load > LINEAR_UP_TO:
        sentence += (
            f"; but the dynamic force is {100 * heard.dynamic_load:.0f} % of the load, too much for a linear spring: "
            "take vibration.response = nonlinear"
        )
    return f"{sentence}."


def load_run(path: str | Path) -> Run:
    """Read a run back: its fields as they were solved, everything else worked out from them anew.

    Raises
    ------
    UnreadableFile
        if the file is missing, damaged, or holds no case.
    """
    path = Path(path)
    solution = load_solution(path)
    try:
        text, notes = solution.attributes["case"], tuple(json.loads(solution.attributes["notes"]))
    except (KeyError, ValueError):
        raise UnreadableFile(
            f"{path} holds a solution without its case; solve the case with asperity solve --out"
        ) from None
    case = load_case(text, folder=path.parent, name=str(path), stored=solution.surface)
    case = replace(case, stored_notes=tuple(note for note in notes if note not in case.notes))
    return _run(case, solution, notes)


def _run(case: Case, solution: ContactSolution, notes: tuple[str, ...]) -> Run:
    state = contact_state(solution)
    model = case.vibration
    with case.naming("vibration"):
        vibration = None if model is None else contact_vibration(state, case.conditions, model, solution=solution)
    if solution.oil is not None:
        notes = (*notes, _threshold(solution))
    if not solution.convergence.converged:
        notes = (f"Not converged: {solution.convergence.explain()}.", *notes)
    return Run(case=case, solution=solution, state=state, vibration=vibration, notes=notes)


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


def _read(run: Run, source: str) -> Scalar:
    """A number of a run by the attributes that lead to it; None where one of them is None or the number is nan."""
    value: Any = run
    for name in source.split("."):
        if value is None:
            return None
        value = value[name] if isinstance(value, dict) else getattr(value, name)
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
