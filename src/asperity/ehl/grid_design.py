"""A grid for a contact: how far it reaches, and how fine it is; and whether a grid given by hand is fine enough.

All lengths inside are in Hertz half-widths, gaps in a²/R, as in the solver. What decides, from the
film of a smooth contact: the inlet over which its pressure builds up, (h R/a²)^(2/3) a; the oil
and the asperities that meet outside the Hertz zone; and the correlation lengths of the roughness.
"""

import math
from dataclasses import dataclass

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.contact.grid import MIN_CELLS, Grid
from asperity.contact.hertz import line_gap
from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.ehl.film_formulas import central_film, least_film
from asperity.ehl.scales import Scales
from asperity.lubricant import Lubricant
from asperity.surface import Surface, correlation_lengths

ACCURACY = 0.01  # of the film, unless another is asked for
FEWEST_COARSE_CELLS = (
    48  # along the longer axis of a coarser grid, which starts a finer one and tells its error
)
FEWEST_BESIDE = 16  # along an axis that is halved together with a longer one
FEWEST_IN_INLET = (
    4.0  # cells, below which the film is wrong: 1 % thin at four, 4 % at two, and no film at one
)
FEWEST_IN_CORRELATION = (
    4.0  # cells along a correlation length, below which asperities are not what they are
)
CELLS_IN_INLET = {
    "smooth line": 9.0,
    "smooth": 4.5,
    "rough": 5.0,
}  # at ACCURACY; errors fall with their square
CELLS_IN_CORRELATION = 8.0
CELLS_IN_CONTACT, FEWEST_IN_CONTACT = 20.0, 16.0  # across the Hertz zone
SPARE = 1.05  # more than the fewest, so that rounding leaves enough
SIDES = 0.6  # cells in y over those in x for films: side flow turns more slowly
FARTHEST = 30.0  # half-widths of inlet that a light contact is given at most
ASPERITIES_REACH = (
    5.0  # a rough body touches out to X² = 1 + 5 Sq R/a²: 2.5 Sq above the mean plane
)
CORRELATION_LENGTHS = 10.0  # along a line contact's piece
DRY_FILM_RATIO = (
    0.05  # below it no film carries a load that matters, and its inlet need not be resolved
)
LEAST_FILM_RATIO = (
    0.3  # Sq that count as film in rough contacts: asperities hold the inlet open as far as that
)
MOST_CELLS = 130_000  # of a rough contact at ACCURACY
# half-widths along a roller's axis, as long as that takes no more than the most lines of cells
END_CELL = 0.22
LINES_ALONG = 128, 504
PAST_END, FEWEST_COARSE = (
    4,
    24,
)  # lines of cells past a roller's end, if the grid has so many times as many
MOST_ACROSS = 512.0  # cells along x of a smooth roller
SPARE_ALONG = 0.05  # of a roller's loaded length: slices tell it that well
WIDEST_BAR = 0.15  # of CLR: beyond it mixed cannot be told from boundary lubrication


@dataclass(frozen=True, slots=True, kw_only=True)
class Texture:
    """What a grid has to know of a roughness before there is one on it.

    Parameters
    ----------
    sq : root-mean-square height [m]
    lengths : over which the autocorrelation falls to 1/e along x and y [m]; infinite where nothing varies
    least, most : extents along x and y that the grid must and can have [m]
    """

    sq: float
    lengths: tuple[float, float]
    least: tuple[float, float] = (0.0, 0.0)
    most: tuple[float, float] = (math.inf, math.inf)


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
    """The grid that a contact asks for.

    The inlet begins where no more than half of `accuracy` of the inlet's pressure is still missing
    (twice of it in a rough contact), at most 30 half-widths out; the domain holds asperities out
    to where 2.5 Sq no longer reach. Cells: 4.5 across the inlet length, 9 of a smooth line
    contact, 5 of a rough contact; 8 along a correlation length; 20 across the Hertz zone; more or
    fewer with the root of `accuracy`. A rough contact has 96 by 32 cells at least, so that a
    coarser grid tells its error, and about 130000 at most; `grid_shortfalls` says where they are
    too few.

    Parameters
    ----------
    conditions, lubricant : the contact; None for a dry one
    texture : its roughness; None for smooth bodies
    accuracy : relative error of the film that is wanted
    x, y : ends [m] that are given, and are obeyed
    cells : (nx, ny) that are given, and are obeyed

    Raises
    ------
    BadInput
        for an accuracy that is not between 1e-4 and 0.2.
    """
    if not 1e-4 <= accuracy <= 0.2:
        raise BadInput(
            f"accuracy must lie between 0.0001 and 0.2, got {accuracy:g}; 0.01 is the default"
        )
    texture = texture if texture is not None and texture.sq > 0.0 else None
    x, given = x or _along(conditions, lubricant, texture, accuracy), y
    y = y or _across(conditions, lubricant, texture, accuracy)
    if cells is None:
        cells = _cells(conditions, lubricant, texture, accuracy, (x[1] - x[0], y[1] - y[0]))
    if given is None and conditions.geometry == "roller":
        y = _past_the_ends(conditions, y, cells[1])
    return Grid(cells, (x[0], y[0]), (x[1], y[1]), periodic=(False, conditions.endless))


def inlet_length(conditions: ContactConditions, lubricant: Lubricant, sq: float = 0.0) -> float:
    """The inlet over which the film's pressure builds up before a Hertz zone, (h R/a²)^(2/3) a [m].

    Asperities of `sq` [m] hold it open where the film is thinner than 0.3 Sq.
    """
    scales = Scales.of(conditions, lubricant)
    film = max(_film(conditions, lubricant), LEAST_FILM_RATIO * sq / scales.gap)
    return float(film ** (2.0 / 3.0)) * scales.length


def flooded_inlet(
    conditions: ContactConditions, lubricant: Lubricant, missing: float = ACCURACY / 2.0
) -> float:
    """How far before the contact's centre [m] all but the share `missing` of the inlet's pressure builds up.

    The pressure gradient outside is that of Reynolds' equation in Hertz's gap, h over the square
    of itself and the gap.
    """
    return _flooded(_film(conditions, lubricant), missing) * conditions.hertz.half_widths[0]


def missing_inlet(conditions: ContactConditions, lubricant: Lubricant, begins: float) -> float:
    """The share of the inlet's pressure that builds up farther than `begins` [m] before the contact's centre."""
    x, built = _built_up(_film(conditions, lubricant))
    return float(1.0 - np.interp(begins / conditions.hertz.half_widths[0], x, built))


def grid_shortfalls(
    conditions: ContactConditions, lubricant: Lubricant | None, surface: Surface
) -> tuple[str, ...]:
    """Why a solution on the surface's grid cannot tell CLR, a clause each; nothing where it can.

    Fewer than 4 cells across the inlet length, unless the film is below 0.05 Sq and carries
    nothing; or fewer than 4 along a correlation length of the surface.
    """
    found = []
    sq, (dx, dy) = surface.sq, surface.grid.spacing
    if lubricant is not None and least_film(conditions, lubricant) > DRY_FILM_RATIO * sq:
        across = inlet_length(conditions, lubricant, sq) / dx
        if across < FEWEST_IN_INLET:
            found.append(
                f"{across:.2g} cells across the inlet, where {FEWEST_IN_INLET:.0f} are needed"
            )
    if sq > 0.0:
        for axis, cell, length in zip("xy", (dx, dy), correlation_lengths(surface), strict=True):
            if (
                length < (FEWEST_IN_CORRELATION - 0.5) * cell
            ):  # a sample's length scatters about that of its kind
                along = f"{length / cell:.2g} cells along the correlation length in {axis}"
                found.append(f"{along}, where {FEWEST_IN_CORRELATION:.0f} are needed")
    return tuple(found)


def _film(conditions: ContactConditions, lubricant: Lubricant) -> float:
    """Central film of the smooth contact in a²/R, its oil compressed by Hertz's pressure."""
    squeezed = np.array([conditions.hertz.p_max])
    ratio = float(lubricant.density(squeezed)[0]) / lubricant.density.rho0
    return central_film(conditions, lubricant) / ratio / Scales.of(conditions, lubricant).gap


def _flooded(film: float, missing: float) -> float:
    x, built = _built_up(film)
    return float(min(np.interp(1.0 - missing, built, x), FARTHEST))


def _built_up(film: float) -> tuple[Field, Field]:
    """Places before the centre, and the share of the inlet's pressure that builds up between each and the edge."""
    beyond = np.concatenate(
        [np.linspace(0.0, 1.0, 1001) ** 2, np.geomspace(1.0, 50.0 * FARTHEST, 2000)[1:]]
    )
    x = 1.0 + beyond
    gap = line_gap(x, 1.0, 1.0)
    slope = gap / (film + gap) ** 3
    built = np.concatenate([[0.0], np.cumsum(np.diff(x) * (slope[1:] + slope[:-1]))])
    return x, built / built[-1]


def _along(
    conditions: ContactConditions,
    lubricant: Lubricant | None,
    texture: Texture | None,
    accuracy: float,
) -> tuple[float, float]:
    a = conditions.hertz.half_widths[0] * _widest(conditions)
    touching = _touching(conditions, texture, a**2 / conditions.radius_along_rolling)
    inlet, outlet = max(1.4, touching), max(1.3, touching)
    if lubricant is not None:
        film = _film(conditions, lubricant)
        inlet = max(inlet, 1.6, _flooded(film, _missing(texture, accuracy)))
        outlet = max(
            outlet, math.sqrt(1.3**2 + 1.44 * film)
        )  # a rigid cylinder's film ruptures at 0.67 sqrt(film)
    return _held(-inlet * a, outlet * a, texture, 0)


def _across(
    conditions: ContactConditions,
    lubricant: Lubricant | None,
    texture: Texture | None,
    accuracy: float,
) -> tuple[float, float]:
    a, b = conditions.hertz.half_widths
    if conditions.endless:
        length = (
            2.0 * a
            if texture is None
            else max(2.0 * a, CORRELATION_LENGTHS * _finite(texture.lengths[1], a))
        )
        return _held(-length / 2.0, length / 2.0, texture, 1)
    if conditions.geometry == "roller":
        return _along_roller(conditions, lubricant, texture, accuracy)
    radius = conditions.radius_across_rolling
    reach = max(1.3, _touching(conditions, texture, b**2 / radius))
    if lubricant is not None:
        film = (
            _film(conditions, lubricant) * (a**2 / conditions.radius_along_rolling) * radius / b**2
        )
        sides = min(
            1.0, 0.7 + 0.3 * film
        )  # thin films end sooner at the sides than before the contact
        reach = max(reach, 1.0 + sides * (_flooded(film, _missing(texture, accuracy)) - 1.0))
    return _held(-reach * b, reach * b, texture, 1)


def _widest(conditions: ContactConditions) -> float:
    """The widest place of a dry roller by slices, in half-widths."""
    return math.sqrt(conditions.sliced_load.peak) if conditions.geometry == "roller" else 1.0


def _along_roller(
    conditions: ContactConditions,
    lubricant: Lubricant | None,
    texture: Texture | None,
    accuracy: float,
) -> tuple[float, float]:
    """From one end to the other; less where a crown keeps the ends far off the load."""
    (low, high), end = conditions.sliced_load.ends, conditions.end
    spare = SPARE_ALONG * (high - low) - _along(conditions, lubricant, texture, accuracy)[0]
    return max(low - spare, -end), min(high + spare, end)


def _past_the_ends(
    conditions: ContactConditions, y: tuple[float, float], lines: int
) -> tuple[float, float]:
    """The same with some of the lines of cells past each end of the roller that it comes to.

    So many that its end lies on a border of cells twice as large too, and of those again: the
    error bar of what presses on it is told by them.
    """
    past = PAST_END if lines >= FEWEST_COARSE * PAST_END else 1
    before, after = (
        past * reached for reached in (y[0] <= -conditions.end, y[1] >= conditions.end)
    )
    cell = (y[1] - y[0]) / (lines - before - after)
    return y[0] - before * cell, y[1] + after * cell


def _missing(texture: Texture | None, accuracy: float) -> float:
    """Of the inlet's pressure: more from rough contacts, whose film is not as well known."""
    return accuracy / 2.0 if texture is None else 2.0 * accuracy


def _touching(conditions: ContactConditions, texture: Texture | None, gap: float) -> float:
    """How far out bodies may touch, in half-widths along which the undeformed gap grows by `gap`/2."""
    crowded = (
        1.0
        if conditions.hardness is None
        else max(1.0, conditions.hertz.p_max / conditions.hardness)
    )
    rough = 0.0 if texture is None else ASPERITIES_REACH * texture.sq / gap
    return 1.2 * crowded if texture is None else max(1.2 * crowded, math.sqrt(crowded**2 + rough))


def _held(low: float, high: float, texture: Texture | None, axis: int) -> tuple[float, float]:
    """The ends, moved apart or together about their middle until the roughness fits in between."""
    if texture is None:
        return low, high
    length = min(max(high - low, texture.least[axis]), texture.most[axis])
    scale = length / (high - low)
    return low * scale, high * scale


def _spacing(
    conditions: ContactConditions,
    lubricant: Lubricant | None,
    texture: Texture | None,
    finer: float,
) -> tuple[float, float]:
    """Cells [m], `finer` times as fine as at `ACCURACY`; the coarsest that will do for 0."""
    (a, b), line = conditions.hertz.half_widths, conditions.endless
    dx = dy = 2.0 / max(CELLS_IN_CONTACT * finer, FEWEST_IN_CONTACT)
    if lubricant is not None:
        inlet = inlet_length(conditions, lubricant, 0.0 if texture is None else texture.sq) / a
        kind = "rough" if texture is not None else "smooth line" if line else "smooth"
        across = max(CELLS_IN_INLET[kind] * finer, SPARE * FEWEST_IN_INLET)
        dx = min(dx, inlet / across)
        dy = min(dy, inlet / across / SIDES)
    dx, dy = dx * a, math.inf if line else dy * b  # along a line nothing varies but the roughness
    if conditions.geometry == "roller":
        dy = _between_lines(conditions, finer)
    if texture is not None:
        along = max(CELLS_IN_CORRELATION * finer, SPARE * FEWEST_IN_CORRELATION)
        dx, dy = min(dx, texture.lengths[0] / along), min(dy, texture.lengths[1] / along)
    return dx, dy


def _between_lines(conditions: ContactConditions, finer: float) -> float:
    """Distance of lines of cells along a roller [m]: a share of the half-width, by which its ends' pressures change."""
    (low, high), a = conditions.sliced_load.ends, conditions.hertz.half_widths[0]
    fewest, most = (count * max(finer, 0.5) for count in LINES_ALONG)
    return min(max(END_CELL * a / max(finer, 0.5), (high - low) / most), (high - low) / fewest)


def _cells(
    conditions: ContactConditions,
    lubricant: Lubricant | None,
    texture: Texture | None,
    accuracy: float,
    extent: tuple[float, float],
) -> tuple[int, int]:
    """As many as are wanted; where those are too many, down to the fewest that will do, and then fewer."""
    finer = math.sqrt(ACCURACY / accuracy)
    wanted = _counts(_spacing(conditions, lubricant, texture, finer), extent)
    if (
        conditions.geometry == "roller" and texture is None
    ):  # under a light load the film is wider than Hertz's zone
        wanted = min(wanted[0], MOST_ACROSS * max(finer, 0.5)), wanted[1]
    most = MOST_CELLS * max(1.0, ACCURACY / accuracy)
    if texture is not None and wanted[0] * wanted[1] > most:
        fewest = _counts(_spacing(conditions, lubricant, texture, 0.0), extent)
        for _ in range(2):  # where one axis stands at its fewest, the other gives the rest
            fewer = math.sqrt(wanted[0] * wanted[1] / most)
            wanted = max(wanted[0] / fewer, fewest[0]), max(wanted[1] / fewer, fewest[1])
        too_many = max(1.0, math.sqrt(wanted[0] * wanted[1] / (1.15 * most)))
        wanted = wanted[0] / too_many, wanted[1] / too_many
    if texture is not None:  # so many that a coarser grid tells how far the load share may be off
        wanted = max(wanted[0], 2.0 * FEWEST_COARSE_CELLS), max(wanted[1], 2.0 * FEWEST_BESIDE)
    return _even(wanted[0]), _even(wanted[1])


def _counts(spacing: tuple[float, float], extent: tuple[float, float]) -> tuple[float, float]:
    return extent[0] / spacing[0], extent[1] / spacing[1]


def _finite(length: float, otherwise: float) -> float:
    return length if math.isfinite(length) else otherwise


def _even(count: float) -> int:
    """At least this many cells, and a number that halves well."""
    return max(MIN_CELLS, 8 * math.ceil(count / 8.0))
