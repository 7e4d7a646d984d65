"""Result of a contact as the page shows it, small enough to send between processes.

All values come from the run, its quantities or the closed forms of Hertz.
"""

from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from asperity.contact.conditions import ContactConditions
from asperity.contact.grid import Grid
from asperity.contact.hertz import ellipse_pressure
from asperity.core.arrays import Field, Mask
from asperity.core.quantities import NO_VALUE, UNKNOWN, Quantity, lines, quantity
from asperity.ehl import ContactSolution, ContactState, hertz_zone
from asperity.results import UNCERTAINTY, Run, lubrication
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
    "capacitance_f",
    "ultrasonic_reflection",
)
OPEN, TOUCHING, CAVITATED = 0, 1, 2  # state of a cell
BY_FORMULA = ("lambda_ratio",)  # tiles that do not depend on a solution
MAX_POINTS = 500  # of a curve of the spectrum
SOUND_S = 1.5  # of the acceleration to listen to
GAP_PERCENTILE = 99.0  # of the Hertz zone, where the colours of a film map end


class ResultTile(NamedTuple):
    """A highlighted number: key, value with unit, and uncertainty."""

    key: str
    value: str
    uncertainty: str

    @property
    def name(self) -> str:
        """Title of the quantity."""
        title = quantity(self.key).title
        return f"{title[:1].upper()}{title[1:]}"


Numbers: TypeAlias = dict[str, Any]  # by key of the catalogue, SI


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ResonanceSpectrum:
    """Spectrum around the search band with the fitted resonance; `reason` if there is none.

    Frequencies [Hz], densities [(m/s^2)^2/Hz]. `curve` is empty if the method fits none; all arrays
    are empty if no asperity touches.
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
class ContactMaps:
    """Maps of a contact.

    `x` and `y` [m] are cell centres; `gap` [m], `pressure` [Pa] and `cells` (`OPEN`, `TOUCHING`,
    `CAVITATED`) have shape (nx, ny). `gap_top` is the upper end of the colours of the film [m].
    `instant_area` is the share of the Hertz zone that the maps show in contact, where they are one
    instant of moving roughness and the numbers are means over time.
    """

    x: Field
    y: Field
    extent: tuple[tuple[float, float], tuple[float, float]]
    gap: Field
    pressure: Field
    cells: npt.NDArray[np.uint8]
    gap_top: float
    half_widths: tuple[float, float]
    hertz_pressure: float
    endless: bool
    instant_area: float | None = None

    def nearest_row(self, y: float) -> int:
        """Return the row of cells nearest to y [m]."""
        return int(np.argmin(np.abs(self.y - y)))

    def has_cells_of(self, other: "ContactMaps") -> bool:
        """Return True if both have the same domain and the same number of cells."""
        return self.gap.shape == other.gap.shape and np.allclose(
            self.extent, other.extent, rtol=1e-6, atol=0.0
        )

    def hertz(self, row: int) -> Field:
        """Return the Hertz pressure of the smooth, dry contact along a row of cells [Pa]."""
        y = 0.0 if self.endless else float(self.y[row])
        return ellipse_pressure(self.x, y, self.half_widths, self.hertz_pressure)


@dataclass(frozen=True, kw_only=True, eq=False)
class ContactResult(ContactMaps):
    """A solved contact.

    `row` holds numbers by their keys in the catalogue, SI. A `coarse` result, on fewer cells and
    without error bars, is shown until the full one has arrived. `regime` is the lubrication regime,
    `sound` the first `SOUND_S` of the simulated acceleration [m/s^2]; empty without vibration.
    """

    text: str
    coarse: bool
    converged: bool
    determined: bool
    regime: str
    verdict: str
    explained: str
    notes: tuple[str, ...]
    row: Numbers
    seconds: float
    spectrum: ResonanceSpectrum | None = None
    sound: Field = field(default_factory=lambda: np.empty(0))
    sound_rate_hz: float = 0.0

    @property
    def tiles(self) -> list[ResultTile]:
        """Highlighted numbers with their uncertainties."""
        return [
            ResultTile(key, quantity(key).text(self.row.get(key)), self.uncertainty(quantity(key)))
            for key in TILES
        ]

    def uncertainty(self, entry: Quantity) -> str:
        """Return interval or error bar of a number, or that it is not determined."""
        value = self.row.get(entry.key)
        if value is None:
            return ""
        if self.coarse:
            return "coarse snapshot"
        if entry.ends[0] in self.row:
            low, high = (self.row.get(end) for end in entry.ends)
            if low is None or high is None or not self.determined:
                return UNKNOWN
            return entry.interval(low, high)
        if entry.deviation:
            deviation = self.row.get(entry.deviation)
            if deviation is None:
                return UNKNOWN
            bounded = entry.clipped_interval(value, deviation)
            if bounded is not None:
                return entry.interval(*bounded)
            _, _, spread = entry.number(value, deviation).partition(" ± ")
            return f"± {spread.replace(')', '')} {entry.display}".rstrip() if spread else ""
        return "" if entry.key in BY_FORMULA else UNKNOWN


def numbers_of(run: Run) -> Numbers:
    """Return the numbers of a run that the page shows, with their uncertainties."""
    tiles = [quantity(key) for key in TILES]
    deviations = [quantity(entry.deviation) for entry in tiles if entry.deviation]
    return run.quantities([*tiles, *deviations, quantity("sq_m"), *lines(UNCERTAINTY)])


def result_of_run(run: Run, seconds: float) -> ContactResult:
    """Return the result of a run that took `seconds` to solve."""
    notes = list(run.notes)
    if run.friction_failure is not None:
        notes.append(f"No friction and temperature: {run.friction_failure}.")
    return _build_result(
        run.solution,
        run.case.text,
        numbers_of(run),
        coarse=False,
        converged=run.converged,
        explained=run.convergence_text,
        determined=run.determined,
        regime=run.lubrication,
        verdict=run.verdict(),
        notes=tuple(notes),
        moving=run.running is not None,
        seconds=seconds,
        spectrum=_resonance_spectrum(run),
        **_sound(run),
    )


def coarse_result(
    solution: ContactSolution, text: str, seconds: float, *, moving: bool
) -> ContactResult:
    """Return the result of a coarse solution: maps, and numbers that are quick to compute.

    `moving` is True if the full one will be a mean over time.
    """
    state: ContactState = contact_state(solution)
    return _build_result(
        solution,
        text,
        {"clr": state.clr, "car": state.car, "h_central_m": state.h_central, "sq_m": state.sq},
        coarse=True,
        converged=solution.convergence.converged,
        explained=solution.convergence.explain(),
        determined=False,
        regime=lubrication(state.clr, lubricated=solution.lubricant is not None),
        verdict="",
        notes=(),
        moving=moving,
        seconds=seconds,
        spectrum=None,
    )


def _build_result(
    solution: ContactSolution, text: str, row: Numbers, *, moving: bool, **fields: Any
) -> ContactResult:
    maps = map_fields(
        solution.conditions,
        solution.grid,
        solution.gap,
        solution.pressure,
        solution.in_contact,
        solution.cavitated,
    )
    if moving:
        zone = hertz_zone(solution.conditions, solution.grid)
        maps["instant_area"] = float(solution.in_contact[zone].mean())
    return ContactResult(text=text, row=row, **maps, **fields)


def map_fields(
    conditions: ContactConditions,
    grid: Grid,
    gap: Field,
    pressure: Field,
    touching: Mask,
    cavitated: Mask,
) -> dict[str, Any]:
    """Return the fields of `ContactMaps`, in single precision."""
    cells = np.full(grid.cells, OPEN, np.uint8)
    cells[cavitated] = CAVITATED
    cells[touching] = TOUCHING
    zone = gap[hertz_zone(conditions, grid)]
    return {
        "x": grid.x,
        "y": grid.y,
        "extent": ((grid.lower[0], grid.upper[0]), (grid.lower[1], grid.upper[1])),
        "gap": gap.astype(np.float32),
        "pressure": pressure.astype(np.float32),
        "cells": cells,
        "gap_top": float(np.percentile(zone, GAP_PERCENTILE)) if zone.size else 0.0,
        "half_widths": conditions.hertz.half_widths,
        "hertz_pressure": conditions.hertz.p_max,
        "endless": conditions.endless,
    }


def _resonance_spectrum(run: Run) -> ResonanceSpectrum | None:
    """Return the spectrum around the band, averaged over neighbouring lines if there are many."""
    vibration = run.vibration
    if vibration is None:
        return None
    (low, high) = vibration.band_hz
    resonance = vibration.resonance
    spectrum_in_band = partial(
        ResonanceSpectrum,
        band_hz=vibration.band_hz,
        full_load_crf_hz=vibration.full_load_crf_hz,
    )
    empty = np.empty(0)
    if vibration.spectrum is None:
        return spectrum_in_band(
            frequency=empty, density=empty, curve=empty, reason=resonance.reason
        )
    margin = 0.35 * (high - low)
    spectrum = vibration.spectrum
    inside = (spectrum.frequency_hz >= low - margin) & (spectrum.frequency_hz <= high + margin)
    group_size = max(1, -(-int(np.count_nonzero(inside)) // MAX_POINTS))
    frequency, density = (
        group_means(values[inside], group_size)
        for values in (spectrum.frequency_hz, spectrum.density)
    )
    curve = resonance.curve(frequency) if np.isfinite(resonance.damping_ratio) else empty
    found = resonance.found
    return spectrum_in_band(
        frequency=frequency,
        density=density,
        curve=curve,
        crf_hz=resonance.crf_hz if found else None,
        crf_std_hz=resonance.crf_std if found and np.isfinite(resonance.crf_std) else None,
        reason=resonance.reason,
    )


def _sound(run: Run) -> Numbers:
    """Return the beginning of the simulated acceleration in single precision, and its rate."""
    response = None if run.vibration is None else run.vibration.response
    if response is None:
        return {}
    count = round(SOUND_S * response.rate_hz)
    return {
        "sound": response.values[:count].astype(np.float32),
        "sound_rate_hz": response.rate_hz,
    }


def group_means(values: Field, size: int) -> Field:
    """Return the means of groups of `size` neighbours; an incomplete last group is dropped."""
    return np.asarray(values[: values.size // size * size].reshape(-1, size).mean(axis=1))


def spectrum_title(result: ContactResult) -> str:
    """Return the title of the spectrum: the resonance, or why there is none."""
    spectrum = result.spectrum
    if spectrum is None:
        return "No vibration requested"
    if spectrum.crf_hz is None:
        return f"No contact resonance: {spectrum.reason}"
    crf = quantity("crf_hz")
    fitted = (
        f", fitted to ± {crf.text(spectrum.crf_std_hz)}" if spectrum.crf_std_hz is not None else ""
    )
    return f"{crf.named(spectrum.crf_hz)}{fitted}"


def difference(key: str, value: float | None, pinned: float | None) -> str:
    """Return the difference of a number to the pinned contact's, with unit; a dash if unknown."""
    if value is None or pinned is None:
        return NO_VALUE
    entry = quantity(key)
    sign = "+" if value >= pinned else ""
    return f"{sign}{entry.text(value - pinned)}"
