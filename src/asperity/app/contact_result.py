"""Answer: what the page shows of a solved contact, read off a run; small enough to travel between processes.

Nothing is worked out here that is not in the run, its quantities or Hertz's closed forms.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.contact.grid import Grid
from asperity.contact.hertz import ellipse_pressure
from asperity.core.arrays import Field, Mask
from asperity.core.quantities import NO_VALUE, Quantity, lines, quantity, read
from asperity.ehl import ContactSolution, ContactState, hertz_zone
from asperity.results import UNCERTAINTY, Run
from asperity.solution import contact_state

TILES = (
    "clr",
    "car",
    "h_central_m",
    "lambda_ratio",
    "friction_coefficient",
    "flash_temperature_max_k",
    "crf_hz",
    "crfa",
)
OPEN, TOUCHING, RUPTURED = 0, 1, 2  # what a cell is
NOT_DETERMINED = "± not determined"
BY_FORMULA = ("lambda_ratio",)  # of the tiles: what no solution enters
MOST_POINTS = 500  # of a spectrum's curve
CLEAR_SHARE = 99.0  # per cent of the Hertz zone's gaps that a map's colours show


class Tile(NamedTuple):
    """A number that stands out: its key, its value with unit, and what is known of its doubt."""

    key: str
    value: str
    doubt: str

    @property
    def name(self) -> str:
        """What it is called."""
        title = quantity(self.key).title
        return f"{title[:1].upper()}{title[1:]}"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sound:
    """The spectrum about the searched band, with the line fitted to it; `reason` says why there is none.

    Frequencies [Hz], densities [(m/s^2)^2/Hz]; `curve` is empty where the method fits none, and
    the whole is where no asperity touches.
    """

    frequency: Field
    density: Field
    curve: Field
    band_hz: tuple[float, float]
    full_load_crf_hz: float
    crf_hz: float | None = None
    crf_std_hz: float | None = None
    reason: str = ""


@dataclass(frozen=True, kw_only=True, eq=False)
class Picture:
    """Maps of a contact as the page shows them.

    `x` and `y` [m] are cell centres, `gap` [m], `pressure` [Pa] and `cells` (`OPEN`, `TOUCHING`,
    `RUPTURED`) have shape (nx, ny). `gap_top` is where the colours of a film map end [m].
    """

    x: Field
    y: Field
    extent: tuple[tuple[float, float], tuple[float, float]]
    gap: Field
    pressure: Field
    cells: Any
    gap_top: float
    half_widths: tuple[float, float]
    hertz_pressure: float
    endless: bool

    def line(self, y: float) -> int:
        """The row of cells nearest to y [m]."""
        return int(np.argmin(np.abs(self.y - y)))

    def hertz(self, row: int) -> Field:
        """Hertz's pressure of the smooth, dry contact along that row of cells [Pa]."""
        y = 0.0 if self.endless else float(self.y[row])
        return ellipse_pressure(self.x, y, self.half_widths, self.hertz_pressure)


@dataclass(frozen=True, kw_only=True, eq=False)
class Answer(Picture):
    """A solved contact as the page shows it.

    `row` holds numbers by their keys in the catalogue, SI. `coarse` is an answer on fewer cells,
    which is shown until the full one has come, and has no error bar.
    """

    text: str
    coarse: bool
    converged: bool
    determined: bool
    verdict: str
    explained: str
    notes: tuple[str, ...]
    row: dict[str, Any]
    seconds: float
    sound: Sound | None = None

    @property
    def tiles(self) -> list[Tile]:
        """The numbers that stand out, each with its interval, or that it is not determined."""
        return [
            Tile(key, quantity(key).text(self.row.get(key)), self.doubt(quantity(key)))
            for key in TILES
        ]

    def doubt(self, entry: Quantity) -> str:
        """The interval of a number of this contact, its error bar, or that neither is known."""
        value = self.row.get(entry.key)
        if value is None:
            return ""
        if self.coarse:
            return "coarse answer"
        if entry.ends[0] in self.row:
            low, high = (self.row.get(end) for end in entry.ends)
            if low is None or high is None or not self.determined:
                return NOT_DETERMINED
            return entry.interval(low, high)
        if entry.deviation:
            deviation = self.row.get(entry.deviation)
            if deviation is None:
                return NOT_DETERMINED
            left = entry.clipped_interval(value, deviation)
            if left is not None:
                return entry.interval(*left)
            _, _, spread = entry.number(value, deviation).partition(" ± ")
            return f"± {spread.rstrip(')')} {entry.display}".rstrip() if spread else ""
        return "" if entry.key in BY_FORMULA else NOT_DETERMINED


def numbers_of(run: Run) -> dict[str, Any]:
    """The page's numbers of a run, with what is known of their doubt; nothing that takes longer than the contact."""
    shown = [quantity(key) for key in TILES]
    deviations = [quantity(entry.deviation) for entry in shown if entry.deviation]
    return read(run, [*shown, *deviations, quantity("sq_m"), *lines(UNCERTAINTY)])


def answer_of(run: Run, seconds: float) -> Answer:
    """A run as the page shows it; `seconds` is what solving it took."""
    notes = list(run.notes)
    if run.friction_failure is not None:
        notes.append(f"No friction and no temperature: {run.friction_failure}.")
    return _answer(
        run.solution,
        run.case.text,
        numbers_of(run),
        coarse=False,
        determined=run.determined,
        verdict=run.verdict(),
        notes=tuple(notes),
        seconds=seconds,
        sound=_sound(run),
    )


def coarse_answer(solution: ContactSolution, text: str, seconds: float) -> Answer:
    """A solution on few cells as the page shows it at first: maps, and numbers that take no time."""
    state: ContactState = contact_state(solution)
    return _answer(
        solution,
        text,
        {"clr": state.clr, "car": state.car, "h_central_m": state.h_central, "sq_m": state.sq},
        coarse=True,
        determined=False,
        verdict="",
        notes=(),
        seconds=seconds,
        sound=None,
    )


def _answer(solution: ContactSolution, text: str, row: dict[str, Any], **told: Any) -> Answer:
    drawn = picture_parts(
        solution.conditions,
        solution.grid,
        solution.gap,
        solution.pressure,
        solution.in_contact,
        solution.cavitated,
    )
    convergence = solution.convergence
    return Answer(
        text=text,
        row=row,
        converged=convergence.converged,
        explained=convergence.explain(),
        **drawn,
        **told,
    )


def picture_parts(
    conditions: ContactConditions,
    grid: Grid,
    gap: Field,
    pressure: Field,
    touching: Mask,
    ruptured: Mask,
) -> dict[str, Any]:
    """What a `Picture` is made of: fields in single precision, and Hertz's contact."""
    cells = np.full(grid.cells, OPEN, np.uint8)
    cells[ruptured] = RUPTURED
    cells[touching] = TOUCHING
    zone = gap[hertz_zone(conditions, grid)]
    return {
        "x": grid.x,
        "y": grid.y,
        "extent": ((grid.lower[0], grid.upper[0]), (grid.lower[1], grid.upper[1])),
        "gap": gap.astype(np.float32),
        "pressure": pressure.astype(np.float32),
        "cells": cells,
        "gap_top": float(np.percentile(zone, CLEAR_SHARE)) if zone.size else 0.0,
        "half_widths": conditions.hertz.half_widths,
        "hertz_pressure": conditions.hertz.p_max,
        "endless": conditions.endless,
    }


def _sound(run: Run) -> Sound | None:
    """The spectrum near the band, with means of neighbours where it has more lines than are seen."""
    vibration = run.vibration
    if vibration is None:
        return None
    (low, high), resonance = vibration.band_hz, vibration.resonance
    about: dict[str, Any] = {
        "band_hz": vibration.band_hz,
        "full_load_crf_hz": vibration.full_load_crf_hz,
    }
    none = np.empty(0)
    if vibration.spectrum is None:
        return Sound(frequency=none, density=none, curve=none, reason=resonance.reason, **about)
    margin = 0.35 * (high - low)
    spectrum = vibration.spectrum
    near = (spectrum.frequency_hz >= low - margin) & (spectrum.frequency_hz <= high + margin)
    together = max(1, -(-int(np.count_nonzero(near)) // MOST_POINTS))
    frequency, density = (
        _means(values[near], together) for values in (spectrum.frequency_hz, spectrum.density)
    )
    curve = resonance.curve(frequency) if np.isfinite(resonance.damping_ratio) else none
    found = resonance.found
    return Sound(
        frequency=frequency,
        density=density,
        curve=curve,
        crf_hz=resonance.crf_hz if found else None,
        crf_std_hz=resonance.crf_std if found and np.isfinite(resonance.crf_std) else None,
        reason=resonance.reason,
        **about,
    )


def _means(values: Field, together: int) -> Field:
    return np.asarray(
        values[: values.size // together * together].reshape(-1, together).mean(axis=1)
    )


def difference(key: str, value: Any, pinned: Any) -> str:
    """How far a number lies from that of a pinned contact, with its unit; a dash where one of them has none."""
    if value is None or pinned is None:
        return NO_VALUE
    entry = quantity(key)
    sign = "+" if value >= pinned else ""
    return f"{sign}{entry.text(value - pinned)}"
