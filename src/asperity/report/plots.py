"""Drawings of results for `.plot()`, by the exhibits of their reports."""

from collections.abc import Callable, Mapping
from functools import partial, singledispatch
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from asperity.core.errors import BadInput, require_choice
from asperity.core.quantities import quantity
from asperity.core.signals import Spectrum
from asperity.ehl import ContactSolution, ContactState
from asperity.machines import MachineResult
from asperity.monitoring import Track
from asperity.report.base import Exhibit
from asperity.report.cycle.exhibits import over_cycle
from asperity.report.drawing import display, group_values, name_axes
from asperity.report.machine.contact_path import along_path
from asperity.report.machine.sketch import machine_sketch
from asperity.report.motion.exhibits import curves as motion_curves
from asperity.report.run.contact import centre_line, contact_map, film_map, pressure_map
from asperity.report.sensor_view import response_figure
from asperity.report.study.page import study_exhibits
from asperity.report.style import BLUE, ON_PAGE, Medium
from asperity.report.track.exhibits import amplitude, levels, trend
from asperity.report.wear.exhibits import curves as wear_curves
from asperity.results import Run, SensorView
from asperity.simulation import CycleResult, History, WearHistory
from asperity.solution import contact_state
from asperity.study import StudyOverview, StudyResult
from asperity.surface import Surface

MAX_LINES = 1000  # of a spectrum that are drawn: the lines of a periodogram scatter by decades
Draw = Callable[[Medium], Figure]


class _Solved(NamedTuple):
    """A solution with its state, as the maps of a run need them."""

    solution: ContactSolution
    state: ContactState


def draw_result(result: object, drawing: str = "") -> Figure:
    """Draw a result by the name of the drawing; the first one by default."""
    drawings = drawings_of(result)
    if not drawings:
        raise BadInput(f"this {type(result).__name__} has nothing to draw")
    if drawing:
        require_choice("drawing", drawing, tuple(drawings))
    with ON_PAGE.drawing():
        figure = (drawings[drawing] if drawing else next(iter(drawings.values())))(ON_PAGE)
        figure.draw_without_rendering()  # ticks are created by drawing, in the style of this moment
    return figure


@singledispatch
def drawings_of(result: object) -> Mapping[str, Draw]:
    """Return the drawings of a result by name."""
    raise BadInput(f"a {type(result).__name__} has no drawing")


def _exhibits(*exhibits: Exhibit) -> dict[str, Draw]:
    return {exhibit.name: exhibit.draw for exhibit in exhibits}


@drawings_of.register
def _(run: Run) -> Mapping[str, Draw]:
    return _exhibits(film_map(run), contact_map(run), pressure_map(run), centre_line(run))


@drawings_of.register
def _(solution: ContactSolution) -> Mapping[str, Draw]:
    solved = _Solved(solution, contact_state(solution))
    return _exhibits(film_map(solved), pressure_map(solved), centre_line(solved))


@drawings_of.register
def _(track: Track) -> Mapping[str, Draw]:
    resonances = (trend(track), amplitude(track)) if track.resonance_count else ()
    overall = levels(track)
    return _exhibits(*resonances, *(() if overall is None else (overall,)))


@drawings_of.register
def _(result: StudyResult) -> Mapping[str, Draw]:
    return _exhibits(*study_exhibits(StudyOverview(result)))


@drawings_of.register
def _(history: WearHistory) -> Mapping[str, Draw]:
    return _exhibits(wear_curves(history))


@drawings_of.register
def _(history: History) -> Mapping[str, Draw]:
    return _exhibits(motion_curves(history))


@drawings_of.register
def _(result: CycleResult) -> Mapping[str, Draw]:
    return _exhibits(over_cycle(result))


@drawings_of.register
def _(result: MachineResult) -> Mapping[str, Draw]:
    return _exhibits(machine_sketch(result), along_path(result))


@drawings_of.register
def _(surface: Surface) -> Mapping[str, Draw]:
    return {"map": partial(_height_map, surface)}


@drawings_of.register
def _(spectrum: Spectrum) -> Mapping[str, Draw]:
    return {"density": partial(_density, spectrum)}


@drawings_of.register
def _(view: SensorView) -> Mapping[str, Draw]:
    return {"response": partial(response_figure, view)}


def _height_map(surface: Surface, medium: Medium) -> Figure:
    figure, axes = medium.panel(3.5)
    (x0, y0), (x1, y1) = surface.grid.lower, surface.grid.upper
    corners = (*display("x_m", np.array([x0, x1])), *display("y_m", np.array([y0, y1])))
    heights = display("height_m", surface.heights.T)
    image = axes.imshow(heights, origin="lower", extent=corners, cmap="viridis")
    name_axes(axes, "x_m", "y_m")
    axes.set_title(quantity("sq_m").named(surface.sq))
    label = quantity("height_m").axis
    figure.colorbar(image, ax=axes, orientation="horizontal", aspect=40, label=label)
    return figure


def _density(spectrum: Spectrum, medium: Medium) -> Figure:
    figure, axes = medium.panel(3.5)
    size = max(1, (spectrum.frequency_hz.size - 1) // MAX_LINES)
    frequency, density = (
        group_values(values[1:], size).mean(axis=1)
        for values in (spectrum.frequency_hz, spectrum.density)
    )
    axes.semilogy(frequency, density, linewidth=0.9, color=BLUE)
    if size > 1:
        axes.set_title(f"Mean of {size} neighbouring lines")
    axes.set(xlabel="frequency [Hz]", ylabel=f"power spectral density [{spectrum.unit}]")
    return figure
