"""Automatic grids: extent and resolution for a contact, and checks of grids chosen by hand.

Lengths are in Hertz half-widths, gaps in a²/R, as in the solver. Three things decide, from the film
of a smooth contact: the inlet over which its pressure builds up, (h R/a²)^(2/3) a; oil and asperity
contact outside the Hertz zone; and the correlation lengths of the roughness.
"""

import math
from dataclasses import dataclass

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.contact.grid import MIN_CELLS, Grid
from asperity.contact.hertz import line_gap
from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.ehl.far_pressure import (
    CELLS_IN_LENGTH,
    CELLS_IN_LIGHT_ZONE,
    OUTLET_LENGTHS,
    build_up_lengths,
    flooded_reach,
)
from asperity.ehl.film_formulas import central_film, least_film, require_thin_film
from asperity.ehl.scales import Scales
from asperity.lubricant import Lubricant
from asperity.surface import Surface, correlation_lengths

ACCURACY = 0.01  # default relative error of the film
MIN_COARSE_CELLS = 48  # along the longer axis of a grid that starts a finer one
MIN_CELLS_SHORT_AXIS = 16  # along an axis that is halved together with a longer one
MIN_CELLS_IN_INLET = 4.0  # the film is 1 % thin with four cells, 4 % with two, absent with one
MIN_CELLS_IN_CORRELATION = 4.0  # fewer do not resolve asperities
# at ACCURACY; errors fall with the square
CELLS_IN_INLET = {"smooth line": 9.0, "smooth": 4.5, "rough": 5.0}
CELLS_IN_CORRELATION = 8.0
CELLS_IN_CONTACT, MIN_CELLS_IN_CONTACT = 20.0, 16.0  # across the Hertz zone
CELL_MARGIN = 1.05  # on minimum numbers, against rounding
SIDE_CELL_RATIO = 0.6  # cells in y over cells in x: side flow varies more slowly
MAX_INLET = MAX_OUTLET = 30.0  # half-widths; for light contacts
LIGHT = 20.0  # half-widths over which the pressure of a light, smooth contact extends
CONTACT_REACH = 5.0  # a rough body touches out to X² = 1 + 5 Sq R/a²: 2.5 Sq above the mean plane
CORRELATION_LENGTHS = 10.0  # along the modelled length of a line contact
DRY_FILM_RATIO = 0.05  # below it the film carries no load, and its inlet is not resolved
MIN_FILM_RATIO = 0.3  # in Sq: asperities hold the inlet of a rough contact open by this film
MAX_CELLS = 130_000  # of a rough contact at ACCURACY ...
MAX_ROUGH_CELLS = 2_000_000  # ... whose roughness needs more
# half-widths along a roller's axis, within the limits of ROLLER_LINES
END_CELL = 0.22
ROLLER_LINES = 128, 504
LINES_PAST_END = 4  # past a roller's end ...
MIN_LINES_PER_PAST_END = 24  # ... if the grid has so many times as many lines
MAX_ROLLER_CELLS = 512.0  # cells along x of a smooth roller
ROLLER_MARGIN = 0.05  # of a roller's loaded length: the accuracy of slices
MAX_FILM_ERROR = 0.15  # half-width in the film above which a verdict states it
MAX_CLR_ERROR = 0.15  # half-width above which mixed and boundary lubrication are indistinguishable


@dataclass(frozen=True, slots=True, kw_only=True)
class Texture:
    """Statistics of a roughness that decide its grid.

    Parameters
    ----------
    sq : root-mean-square height [m]
    lengths : autocorrelation lengths (decay to 1/e) along x and y [m]; infinite if uniform
    least, most : smallest and largest possible extent along x and y [m]
    largest_cell : largest cells along x and y that the roughness accepts [m]
    """

    sq: float
    lengths: tuple[float, float]
    least: tuple[float, float] = (0.0, 0.0)
    most: tuple[float, float] = (math.inf, math.inf)
    largest_cell: tuple[float, float] = (math.inf, math.inf)


def auto_grid(
    conditions: ContactConditions,
    lubricant: Lubricant | None,
    texture: Texture | None = None,
    *,
    accuracy: float = ACCURACY,
    x: tuple[float, float] | None = None,
    y: tuple[float, float] | None = None,
    cells: tuple[int, int] | None = None,
) -> Grid:
    """Return a grid that resolves a contact to a given accuracy.

    The inlet begins where at most half of `accuracy` of the inlet's pressure is missing (twice
    `accuracy` for a rough contact); inlet and outlet lie at most 30 half-widths from the centre,
    unless a smooth contact is so light that the pressure beyond carries a share of it
    (`flooded_reach`), or asperities may touch farther out: the domain includes contact up to 2.5 Sq
    above the mean plane. Cells: 4.5 across the inlet length, 9 for a smooth line contact, 5 for a
    rough contact; 8 along a correlation length; 20 across the Hertz zone (16 at most of a light
    contact); scaled with the root of `accuracy`. A rough contact has at least 96 by 32 cells, so
    that a coarser grid can estimate its error, and about 130000 at most, or up to 2 million that
    its roughness needs; `grid_shortfalls` reports coarser grids.

    Parameters
    ----------
    conditions, lubricant : the contact; None for a dry one
    texture : its roughness; None for smooth bodies
    accuracy : target relative error of the film
    x, y : prescribed ends [m]
    cells : prescribed (nx, ny)

    Raises
    ------
    BadInput
        for an accuracy that is not between 1e-4 and 0.2, a film that is not thin, or roughness that
        needs more than 2 million cells.
    """
    require_thin_film(conditions, lubricant)
    if not 1e-4 <= accuracy <= 0.2:
        raise BadInput(
            f"accuracy must lie between 0.0001 and 0.2, got {accuracy:g}; 0.01 is the default"
        )
    texture = texture if texture is not None and texture.sq > 0.0 else None
    x, prescribed_y = x or _range_x(conditions, lubricant, texture, accuracy), y
    y = y or _range_y(conditions, lubricant, texture, accuracy)
    if cells is None:
        cells = _cells(conditions, lubricant, texture, accuracy, (x[1] - x[0], y[1] - y[0]))
    if prescribed_y is None and conditions.geometry == "roller":
        y = _extend_past_ends(conditions, y, cells[1])
    return Grid(cells, (x[0], y[0]), (x[1], y[1]), periodic=(False, conditions.endless))


def inlet_length(conditions: ContactConditions, lubricant: Lubricant, sq: float = 0.0) -> float:
    """Return the length of pressure build-up before a Hertz zone, (h R/a²)^(2/3) a [m].

    Asperities of `sq` [m] hold the inlet open where the film is thinner than 0.3 Sq.
    """
    scales = Scales.from_conditions(conditions, lubricant)
    film = max(_film(conditions, lubricant), MIN_FILM_RATIO * sq / scales.gap)
    return float(film ** (2.0 / 3.0)) * scales.length


def flooded_inlet(
    conditions: ContactConditions, lubricant: Lubricant, missing: float = ACCURACY / 2.0
) -> float:
    """Return the inlet length [m], from the centre, that misses a share of the inlet pressure.

    The pressure gradient in the inlet is that of Reynolds' equation in the Hertz gap, which is
    proportional to the gap over the cube of film plus gap.
    """
    return _flooded_length(_film(conditions, lubricant), missing) * conditions.hertz.half_widths[0]


def missing_inlet(conditions: ContactConditions, lubricant: Lubricant, begins: float) -> float:
    """Return the share of the inlet pressure built up farther than `begins` [m] from the centre."""
    x, share = _pressure_build_up(_film(conditions, lubricant))
    return float(1.0 - np.interp(begins / conditions.hertz.half_widths[0], x, share))


def grid_shortfalls(
    conditions: ContactConditions, lubricant: Lubricant | None, surface: Surface
) -> tuple[str, ...]:
    """Return the reasons why the surface's grid does not determine CLR, a clause each.

    Fewer than 4 cells across the inlet length, unless the film is below 0.05 Sq and carries
    nothing; or fewer than 4 along a correlation length of the surface.
    """
    shortfalls = []
    sq = surface.sq
    (dx, dy) = surface.grid.spacing
    if lubricant is not None and least_film(conditions, lubricant) > DRY_FILM_RATIO * sq:
        across = inlet_length(conditions, lubricant, sq) / dx
        if across < MIN_CELLS_IN_INLET:
            shortfalls.append(
                f"{across:.2g} cells across the inlet, where {MIN_CELLS_IN_INLET:.0f} are needed"
            )
    if sq > 0.0:
        for axis, cell, length in zip("xy", (dx, dy), correlation_lengths(surface), strict=True):
            # a sample's correlation length scatters about that of its kind
            if length < (MIN_CELLS_IN_CORRELATION - 0.5) * cell:
                along = f"{length / cell:.2g} cells along the correlation length in {axis}"
                shortfalls.append(f"{along}, where {MIN_CELLS_IN_CORRELATION:.0f} are needed")
    return tuple(shortfalls)


def _film(conditions: ContactConditions, lubricant: Lubricant) -> float:
    """Return the central film of the smooth contact in a²/R, compressed at Hertz pressure."""
    squeezed = np.array([conditions.hertz.p_max])
    ratio = float(lubricant.density(squeezed)[0]) / lubricant.density.rho0
    return (
        central_film(conditions, lubricant)
        / ratio
        / Scales.from_conditions(conditions, lubricant).gap
    )


def _flooded_length(film: float, missing: float) -> float:
    """Return the inlet length that misses a share of the pressure."""
    x, share = _pressure_build_up(film)
    return float(min(np.interp(1.0 - missing, share, x), MAX_INLET))


def _pressure_build_up(film: float) -> tuple[Field, Field]:
    """Return positions before the centre and the share of inlet pressure built up inside each."""
    distance = np.concatenate(
        [np.linspace(0.0, 1.0, 1001) ** 2, np.geomspace(1.0, 50.0 * MAX_INLET, 2000)[1:]]
    )
    x = 1.0 + distance
    gap = line_gap(x, 1.0, 1.0)
    slope = gap / (film + gap) ** 3
    share = np.concatenate([[0.0], np.cumsum(np.diff(x) * (slope[1:] + slope[:-1]))])
    return x, share / share[-1]


def _range_x(
    conditions: ContactConditions,
    lubricant: Lubricant | None,
    texture: Texture | None,
    accuracy: float,
) -> tuple[float, float]:
    """Return the ends of the grid along rolling [m]."""
    a = conditions.hertz.half_widths[0] * _max_half_width(conditions)
    touching = _contact_extent(conditions, texture, a**2 / conditions.radius_along_rolling)
    inlet = max(1.4, touching)
    outlet = max(1.3, touching)
    if lubricant is not None:
        film = _film(conditions, lubricant)
        inlet = max(inlet, 1.6, _flooded_length(film, _missing_share(texture, accuracy)))
        # a rigid cylinder's film ruptures at 0.67 sqrt(film)
        outlet = max(outlet, min(math.sqrt(1.3**2 + 1.44 * film), MAX_OUTLET))
        if texture is None:
            inlet = max(inlet, flooded_reach(conditions, lubricant)[0] / a)
            outlet = max(outlet, OUTLET_LENGTHS * build_up_lengths(conditions, lubricant)[0] / a)
    return _fit_texture(-inlet * a, outlet * a, texture, 0)


def _range_y(
    conditions: ContactConditions,
    lubricant: Lubricant | None,
    texture: Texture | None,
    accuracy: float,
) -> tuple[float, float]:
    """Return the ends of the grid across rolling [m]."""
    a, b = conditions.hertz.half_widths
    if conditions.endless:
        length = 2.0 * a
        if texture is not None:  # straight ridges across y have no length
            lay = texture.lengths[1]
            length = max(length, CORRELATION_LENGTHS * (lay if math.isfinite(lay) else a))
        return _fit_texture(-length / 2.0, length / 2.0, texture, 1)
    if conditions.geometry == "roller":
        return _roller_range(conditions, lubricant, texture, accuracy)
    radius = conditions.radius_across_rolling
    reach = max(1.3, _contact_extent(conditions, texture, b**2 / radius))
    if lubricant is not None:
        film = (
            _film(conditions, lubricant) * (a**2 / conditions.radius_along_rolling) * radius / b**2
        )
        # the pressure of thin films extends less to the sides than before the contact
        sides = min(1.0, 0.7 + 0.3 * film)
        reach = max(
            reach, 1.0 + sides * (_flooded_length(film, _missing_share(texture, accuracy)) - 1.0)
        )
        if texture is None:
            reach = max(reach, flooded_reach(conditions, lubricant)[1] / b)
    return _fit_texture(-reach * b, reach * b, texture, 1)


def _max_half_width(conditions: ContactConditions) -> float:
    """Return the largest half-width of a dry roller by slices, in Hertz half-widths."""
    return math.sqrt(conditions.sliced_load.peak) if conditions.geometry == "roller" else 1.0


def _roller_range(
    conditions: ContactConditions,
    lubricant: Lubricant | None,
    texture: Texture | None,
    accuracy: float,
) -> tuple[float, float]:
    """Return the ends of a roller, or of its loaded length if a crown unloads its ends."""
    (low, high) = conditions.sliced_load.ends
    end = conditions.end
    spare = ROLLER_MARGIN * (high - low) - _range_x(conditions, lubricant, texture, accuracy)[0]
    return max(low - spare, -end), min(high + spare, end)


def _extend_past_ends(
    conditions: ContactConditions, y: tuple[float, float], lines: int
) -> tuple[float, float]:
    """Extend the grid by lines of cells past each end of the roller that it reaches.

    The number of lines puts a roller's end on a cell border of the two next coarser grids, whose
    edge pressures estimate the error.
    """
    past = LINES_PAST_END if lines >= MIN_LINES_PER_PAST_END * LINES_PAST_END else 1
    before, after = (
        past * reached for reached in (y[0] <= -conditions.end, y[1] >= conditions.end)
    )
    cell = (y[1] - y[0]) / (lines - before - after)
    return y[0] - before * cell, y[1] + after * cell


def _missing_share(texture: Texture | None, accuracy: float) -> float:
    """Return the missing share of inlet pressure.

    It is larger for rough contacts, whose film is less certain.
    """
    return accuracy / 2.0 if texture is None else 2.0 * accuracy


def _contact_extent(conditions: ContactConditions, texture: Texture | None, gap: float) -> float:
    """Return the extent of possible contact in half-widths.

    The undeformed gap grows by `gap`/2 along one.
    """
    crowded = (
        1.0
        if conditions.hardness is None
        else max(1.0, conditions.hertz.p_max / conditions.hardness)
    )
    rough = 0.0 if texture is None else CONTACT_REACH * texture.sq / gap
    return 1.2 * crowded if texture is None else max(1.2 * crowded, math.sqrt(crowded**2 + rough))


def _fit_texture(
    low: float, high: float, texture: Texture | None, axis: int
) -> tuple[float, float]:
    """Scale the ends about their centre to an extent that the roughness allows."""
    if texture is None:
        return low, high
    length = min(max(high - low, texture.least[axis]), texture.most[axis])
    scale = length / (high - low)
    return low * scale, high * scale


def _spacing(
    conditions: ContactConditions,
    lubricant: Lubricant | None,
    texture: Texture | None,
    refinement: float,
) -> tuple[float, float]:
    """Return the cell sizes [m], `refinement` times as fine as at `ACCURACY`.

    A refinement of 0 gives the coarsest acceptable cells.
    """
    lengths = build_up_lengths(conditions, lubricant)
    if texture is None and lengths[0] > 0.0:
        cells = CELLS_IN_LENGTH * refinement
        return lengths[0] / cells, lengths[1] / cells
    return _spacing_about_hertz(conditions, lubricant, texture, refinement)


def _spacing_about_hertz(
    conditions: ContactConditions,
    lubricant: Lubricant | None,
    texture: Texture | None,
    refinement: float,
) -> tuple[float, float]:
    """Return the cell sizes [m] of a contact whose pressure is about that of Hertz."""
    (a, b) = conditions.hertz.half_widths
    dx = dy = 2.0 / max(CELLS_IN_CONTACT * refinement, MIN_CELLS_IN_CONTACT)
    if lubricant is not None:
        inlet = inlet_length(conditions, lubricant, 0.0 if texture is None else texture.sq) / a
        kind = "rough" if texture is not None else "smooth line" if conditions.endless else "smooth"
        across = max(CELLS_IN_INLET[kind] * refinement, CELL_MARGIN * MIN_CELLS_IN_INLET)
        dx = min(dx, inlet / across)
        dy = min(dy, inlet / across / SIDE_CELL_RATIO)
        if texture is None and flooded_reach(conditions, lubricant)[0] > LIGHT * a:
            least = 2.0 / (CELLS_IN_LIGHT_ZONE * refinement)
            dx, dy = max(dx, least), max(dy, least)
    # a line contact varies along y by its roughness only
    dx, dy = dx * a, math.inf if conditions.endless else dy * b
    if conditions.geometry == "roller":
        dy = _line_distance(conditions, refinement)
    if texture is not None:
        along = max(CELLS_IN_CORRELATION * refinement, CELL_MARGIN * MIN_CELLS_IN_CORRELATION)
        dx, dy = min(dx, texture.lengths[0] / along), min(dy, texture.lengths[1] / along)
    return dx, dy


def _line_distance(conditions: ContactConditions, refinement: float) -> float:
    """Return the distance of lines of cells along a roller [m].

    It is a share of the half-width, the scale of pressure changes at the ends.
    """
    (low, high) = conditions.sliced_load.ends
    a = conditions.hertz.half_widths[0]
    fewest, most = (count * max(refinement, 0.5) for count in ROLLER_LINES)
    return min(max(END_CELL * a / max(refinement, 0.5), (high - low) / most), (high - low) / fewest)


def _cells(
    conditions: ContactConditions,
    lubricant: Lubricant | None,
    texture: Texture | None,
    accuracy: float,
    extent: tuple[float, float],
) -> tuple[int, int]:
    """Return the number of cells: the target, or fewer if it is too large."""
    refinement = math.sqrt(ACCURACY / accuracy)
    target = _counts(_spacing(conditions, lubricant, texture, refinement), extent)
    # under a light load the film is wider than the Hertz zone
    if conditions.geometry == "roller" and texture is None:
        target = min(target[0], MAX_ROLLER_CELLS * max(refinement, 0.5)), target[1]
    if texture is not None:
        max_cells = MAX_CELLS * max(1.0, ACCURACY / accuracy)
        if target[0] * target[1] > max_cells:
            fewest = _counts(_spacing(conditions, lubricant, texture, 0.0), extent)
            target = _reduced(target, fewest, max_cells)
        accepted = _counts(texture.largest_cell, extent)
        _require_affordable(accepted)
        target = max(target[0], accepted[0]), max(target[1], accepted[1])
    if texture is not None or not (lubricant is None or conditions.endless):
        # a coarser grid must be possible for the error estimate
        target = max(target[0], 2.0 * MIN_COARSE_CELLS), max(target[1], 2.0 * MIN_CELLS_SHORT_AXIS)
    return _even(target[0]), _even(target[1])


def _require_affordable(cells: tuple[float, float]) -> None:
    """Raise BadInput for roughness that needs more cells than a chosen grid may have."""
    if (excess := cells[0] * cells[1] / MAX_ROUGH_CELLS) > 1.0:
        nx, ny = map(_even, cells)
        raise BadInput(
            f"the roughness needs {nx} x {ny} cells, more than the {MAX_ROUGH_CELLS:.0f} of a "
            f"chosen grid; make its shortest length {1.01 * math.sqrt(excess):.2f} times as long, "
            f"or state grid.cells = [{nx}, {ny}]"
        )


def _reduced(
    target: tuple[float, float], fewest: tuple[float, float], max_cells: float
) -> tuple[float, float]:
    """Reduce cells along x and y to about `max_cells` in all, if possible not below `fewest`."""
    for _ in range(2):  # if one axis is at its minimum, the other takes the rest
        fewer = math.sqrt(target[0] * target[1] / max_cells)
        target = max(target[0] / fewer, fewest[0]), max(target[1] / fewer, fewest[1])
    too_many = max(1.0, math.sqrt(target[0] * target[1] / (1.15 * max_cells)))
    return target[0] / too_many, target[1] / too_many


def _counts(spacing: tuple[float, float], extent: tuple[float, float]) -> tuple[float, float]:
    """Return the cells along x and y."""
    return extent[0] / spacing[0], extent[1] / spacing[1]


def _even(count: float) -> int:
    """Return at least this many cells, divisible by 8."""
    return max(MIN_CELLS, 8 * math.ceil(count / 8.0))
