"""Change each constant that controls the search for a solution, on a contact that shows its effect.

`asperity.ehl.controls` holds the constants. Steps are Newton steps on all grids (of running
roughness in all time steps), and evaluations of the elastic deflection, of which every step of an
iterative linear solver has one or more.

`python -m benchmarks.controls [RECORD.CONSTANT ...]` changes constants up and down on all contacts
and prints the largest effects: the way to find the row of a new constant, or that it needs none.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields
from typing import NamedTuple

from asperity.core.arrays import Field
from asperity.core.errors import AsperityError
from asperity.ehl import controls
from asperity.ehl.deflection import Deflection
from benchmarks.search_contacts import contacts


class Effort(NamedTuple):
    """Work for a contact: Newton steps, evaluations of the deflection; and its load share."""

    solved: bool
    newton: int
    deflections: int
    clr: float

    def __str__(self) -> str:
        return f"{self.newton} / {self.deflections}" if self.solved else "not solved"


class Change(NamedTuple):
    """Another value of a constant, and the contact that shows the effect."""

    value: float
    contact: str


# of the changes tried, one with a large effect
ROWS = {
    "Residuals.initial_guess": Change(0.3, "wide 1, 64, conserving"),
    "Residuals.rough_solution": Change(3e-3, "wide 210, 64, mixed"),
    "Residuals.divergence": Change(1e9, "isoviscous ball, paper"),
    "Residuals.coarse_grid": Change(3e-4, "hard steel 0"),
    "StepLimits.max_pressure_step": Change(0.8, "wide 304, 64, paper"),
    "StepLimits.max_relative_step": Change(0.8, "wide 180, 64, mixed"),
    "StepLimits.max_approach_step": Change(0.1, "wide 241, 64, conserving"),
    "StepLimits.approach_growth": Change(0.4, "wide 402, 64, unified"),
    "StepLimits.stagnation_iterations": Change(3, "smooth ball M 20, L 10, mixed"),
    "StepLimits.min_damping": Change(0.2, "starved line, 0.7 um"),
    "MixedNewton.line_search_residual": Change(0.09, "hard steel 0"),
    "MixedNewton.max_residual_growth": Change(0.5, "starved ball, 5 nm"),
    "MixedNewton.max_film_decrease": Change(0.1, "hard steel 0"),
    "MixedNewton.max_pressure_change": Change(0.7, "running, 4 cells"),
    "MixedLinearSolver.tolerance_close": Change(0.03, "wide 203, 128, mixed"),
    "MixedLinearSolver.thin_film": Change(0.0, "polymer line, conserving"),
    "MixedLinearSolver.max_tolerance_time_step": Change(0.1, "running, 1 cell"),
    "MixedLinearSolver.max_nearly_closed": Change(0.3, "wide 241, 64, conserving"),
    "Preconditioner.max_coarse_cells": Change(20, "smooth ball M 20, L 10, mixed"),
    "Preconditioner.min_halved_cells": Change(4, "oscillating, 1 kHz"),
    "Preconditioner.cycles": Change(1, "oscillating, 100 kHz"),
    "Preconditioner.min_pivot": Change(0.06, "smooth ball M 20, L 10, mixed"),
    "KrylovMethod.tolerance": Change(0.3, "wide 304, 64, paper"),
    "KrylovMethod.max_steps": Change(10, "oscillating, 100 kHz"),
    "KrylovMethod.reorthogonalise": Change(0.1, "oscillating, 100 kHz"),
    "DryContact.max_krylov_steps": Change(10, "wide 203, 128, mixed"),
    "DryContact.max_rounds": Change(10, "wide 203, 128, mixed"),
    "DryContact.window_margin": Change(10**9, "polymer line, conserving"),
    "DryContact.tolerance": Change(3e-4, "wide 390, 64, mixed"),
    "LocalRefinement.worst_residual": Change(0.5, "smooth ball of 256 x 256"),
    "LocalRefinement.max_box_share": Change(0.0, "smooth ball of 256 x 256"),
    "LocalRefinement.margin": Change(9, "smooth ball of 256 x 256"),
    "GridContinuation.max_iterations": Change(13, "running, conserving"),
    "GridContinuation.min_coarse_inlet_cells": Change(0.1, "smooth line M 200, L 5"),
    "MixedSearchControls.max_long_iterations": Change(27, "wide 361, 64, conserving"),
    "MixedSearchControls.backward_tolerance": Change(0.02, "wide 0, 64, mixed"),
    "MixedSearchControls.max_imbalance": Change(3e-7, "starved line, 0.2 um"),
    "MixedSearchControls.imbalance_to_tolerance": Change(0.0, "running, conserving"),
    "TimeMarching.tolerance": Change(0.017, "wide 1, 64, conserving"),
    "TimeMarching.max_newton_steps": Change(30, "hard steel 40"),
    "TimeMarching.max_steps": Change(2, "starved line, 0.2 um"),
    "TimeMarching.final_length": Change(0.3, "starved line, 0.2 um"),
    "TimeMarching.min_length": Change(0.9, "hard steel 40"),
    "Meniscus.front": Change(40.0, "starved line, 0.2 um"),
    "Meniscus.front_film": Change(0.0, "starved line, 0.2 um"),
    "Meniscus.first_length": Change(1.5, "starved ball, 15 nm"),
    "Meniscus.forcing": Change(1.0, "starved line, 0.2 um"),
    "RigidFilm.max_steps": Change(3, "rigid channel"),
    "RigidFilm.max_log_viscosity_step": Change(0.1, "rigid channel"),
}


def records() -> dict[str, object]:
    """Return the records of constants by the name of their class."""
    found = (getattr(controls, name) for name in vars(controls) if name.isupper())
    return {type(record).__name__: record for record in found}


def constants() -> dict[str, float]:
    """Return every constant, as `Record.constant`."""
    return {
        f"{name}.{field.name}": getattr(record, field.name)
        for name, record in records().items()
        for field in fields(record)  # type: ignore[arg-type]
    }


@contextmanager
def changed(constant: str, value: float) -> Iterator[None]:
    """Set a constant to another value for a while."""
    record, _, field = constant.partition(".")
    usual = constants()[constant]
    object.__setattr__(records()[record], field, value)
    try:
        yield
    finally:
        object.__setattr__(records()[record], field, usual)


@contextmanager
def counted() -> Iterator[list[int]]:
    """Count evaluations of the elastic deflection in a list of one number."""
    count, usual = [0], Deflection.__call__

    def counting(self: Deflection, pressure: Field) -> Field:
        count[0] += 1
        return usual(self, pressure)

    Deflection.__call__ = counting  # type: ignore[method-assign]
    try:
        yield count
    finally:
        Deflection.__call__ = usual  # type: ignore[method-assign]


def effort(contact: str) -> Effort:
    """Solve a contact of `contacts` and return what it took."""
    with counted() as count:
        try:
            solved, newton, clr = contacts()[contact]()
        except AsperityError:
            return Effort(False, 0, count[0], float("nan"))
    return Effort(solved, newton, count[0], clr)


def lines(*, fast: bool) -> Iterator[str]:  # noqa: ARG001 - a row takes a second
    """Yield the table of all constants as Markdown."""
    yield "## Constants of the search for a solution"
    yield ""
    yield "Newton steps / evaluations of the deflection."
    yield ""
    yield "| constant | value | changed to | contact | steps | steps with the change |"
    yield "|---|---|---|---|---|---|"
    usual: dict[str, Effort] = {}
    for constant, (value, contact) in ROWS.items():
        if contact not in usual:
            usual[contact] = effort(contact)
        with changed(constant, value):
            now = effort(contact)
        yield (
            f"| {constant} | {constants()[constant]:g} | {value:g} | {contact} |"
            f" {usual[contact]} | {now} |"
        )


def _alternatives(value: float) -> list[float]:
    if isinstance(value, int):
        return [max(1, round(value / 3)), 3 * value]
    if 0.45 <= value < 1.0:
        return [value**3, value**0.33]
    return [value / 3.0, 3.0 * value]


def search(names: list[str]) -> None:
    """Print the largest effects on all contacts of changes of some constants."""
    usual = {name: effort(name) for name in contacts()}
    for constant, value in constants().items():
        if names and not any(name in constant for name in names):
            continue
        for other in _alternatives(value):
            with changed(constant, other):
                now = {name: effort(name) for name in contacts()}
            worse = sorted(((_ratio(usual[name], now[name]), name) for name in usual), reverse=True)
            shown = [
                f"{name} ({usual[name]} -> {now[name]})"
                for ratio, name in worse[:3]
                if ratio > 1.05
            ]
            print(f"{constant} {value:g} -> {other:g}: {', '.join(shown)}", flush=True)


def _ratio(usual: Effort, now: Effort) -> float:
    """Return how many times more steps a contact takes; infinite if it is lost."""
    if usual.solved != now.solved:
        return float("inf") if usual.solved else 0.0
    return max(
        (now.newton + 3) / (usual.newton + 3), (now.deflections + 10) / (usual.deflections + 10)
    )


if __name__ == "__main__":
    search(sys.argv[1:])
