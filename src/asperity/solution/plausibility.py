"""Plausibility notes on a contact: implausible input and solutions are noted, not refused."""

from collections.abc import Iterator, Mapping

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.contact.grid import Grid
from asperity.core.quantities import quantity
from asperity.ehl import (
    ContactSolution,
    InletLayer,
    Uncertainty,
    build_up_lengths,
    film_loss,
    flooded_inlet,
    flooded_reach,
    grid_shortfalls,
    inlet_length,
    least_film,
    loss_beyond_body,
    missing_inlet,
)
from asperity.ehl.film_formulas import central_film
from asperity.ehl.grid_design import CELLS_IN_INLET, MAX_CLR_ERROR, MAX_FILM_ERROR
from asperity.ehl.load_shares import carried_share
from asperity.ehl.outcome import SolveStrategy
from asperity.lubricant import Barus, Lubricant, Roelands
from asperity.solution.ends import LOADED_END, axial_distribution
from asperity.solution.regime import far_from_fits

UNEVEN_LOAD = 1.5  # largest over mean load per length of a roller, from which it is noted
OIL_ALPHA = 5e-9, 40e-9  # usual pressure-viscosity coefficients of oils [1/Pa]
SOFT = 1e9  # Young's modulus below which a body is rubber or the unit is wrong [Pa]
MIN_RUBBER_POISSON = 0.4  # Poisson's ratio below which a body is not rubber
MAX_MODULUS = 1.3e12  # [Pa]; diamond has 1.1 TPa
MAX_BARUS_EXPONENT = 15.0  # alpha p_h
MIN_MODULUS_RATIO = 20.0  # E' over the pressure, below which strains are not small
FARTHER = "farther out"
MIN_STARVATION = 0.03  # relative loss of film that is noted
# Ridges count as edges if cells twice as wide increase their radius by this factor.
EDGE_RATIO, MIN_RIDGES = 1.6, 20
NEARLY_FLOODED = 5.0  # inlet layer over flooded film, from which a ball keeps 98 % of its film
THIN_FILM_RATIO = 0.5  # film ratio below which no full film is expected
NO_LOAD_SHARE = 0.01  # asperity load share that counts as none
FILM_LOSS_PER_PRESSURE_LOSS = 0.75  # relative, for inlet pressure lost by a short inlet


def plausibility_notes(
    conditions: ContactConditions,
    lubricant: Lubricant | None,
    inlet_layer: InletLayer | None = None,
) -> tuple[str, ...]:
    """Return notes on doubtful input: bodies, load and oil, and on a starved inlet."""
    solids = _solids(conditions)
    oil = () if lubricant is None else _oil(conditions, lubricant)
    roller = _roller(conditions) if conditions.geometry == "roller" else ()
    if lubricant is None or inlet_layer is None:
        return (*solids, *roller, *oil)
    return (*solids, *roller, *oil, _layer_note(conditions, lubricant, inlet_layer))


def _layer_note(
    conditions: ContactConditions, lubricant: Lubricant, inlet_layer: InletLayer
) -> str:
    """Return how much of the flooded film's oil the inlet layer has."""
    flooded, layer = central_film(conditions, lubricant), max(inlet_layer.thickness)
    ratio = layer / flooded
    if conditions.endless:  # passes all oil up to the flooded flow
        state = "flooded" if ratio > 1.0 else "starved"
    else:
        state = "nearly flooded" if ratio > NEARLY_FLOODED else "starved"
    film = quantity("h_central_m")
    return (
        f"The inlet layer of {film.text(layer)} is {ratio:.2g} times the oil of the flooded film, "
        f"{film.text(flooded)} by a fit for smooth bodies: the contact is {state}."
    )


def inlet_notes(
    conditions: ContactConditions, lubricant: Lubricant | None, grid: Grid, *, rough: bool = False
) -> tuple[str, ...]:
    """Return a note if the inlet is too short (starved) or longer than the film needs.

    The loss follows from the pressure that builds up in Hertz's gap before the grid begins. The
    note also states Hamrock and Dowson's fully flooded inlet, m* = 1 + 3.06 (h R/a²)^0.58. Source:
    B. J. Hamrock, D. Dowson, J. Lubr. Technol. 99 (1977) 15.
    """
    if lubricant is None:
        return ()
    a = conditions.hertz.half_widths[0]
    flooded = max(flooded_inlet(conditions, lubricant), flooded_reach(conditions, lubricant)[0]) / a
    length = inlet_length(conditions, lubricant)
    present = f"The inlet of {-grid.lower[0] / a:.3g} half-widths is"
    if (loss := _starvation(conditions, lubricant, grid)) > MIN_STARVATION:
        if rough and film_loss(conditions, lubricant, grid) == loss:
            return (_beyond_roughness(loss),)
        if remedy := _remedy(conditions, lubricant, grid, flooded):
            statement = f"{present} starved: the film is about {100.0 * loss:.2g} % too thin"
            return (_starved(statement, flooded, _fully_flooded(length / a), remedy),)
    if beyond := _beyond_body(conditions, lubricant):
        return (beyond,)
    enough, cells = max(flooded, 1.6), length / grid.spacing[0]
    if -grid.lower[0] <= 2.0 * enough * a or cells >= CELLS_IN_INLET["rough"]:
        return ()
    statement = f"{present} longer than necessary ({_fully_flooded(length / a)})"
    return (_too_long(statement, enough, cells),)


def _remedy(conditions: ContactConditions, lubricant: Lubricant, grid: Grid, flooded: float) -> str:
    """Return where a starved grid should start; empty where it is as large as one is chosen."""
    a, b = conditions.hertz.half_widths[0], conditions.hertz.half_widths[-1]
    side = flooded_reach(conditions, lubricant)[1]
    if flooded * a > -1.01 * grid.lower[0] or side > 1.01 * grid.upper[1]:
        sides = f" and grid.y at {-side / b:.3g}" if side > grid.upper[1] else ""
        return f"at {-flooded:.3g}{sides}"
    return "" if side > 0.0 else FARTHER


def _fully_flooded(length: float) -> str:
    """Return Hamrock and Dowson's fully flooded inlet, from the inlet length in half-widths."""
    return f"m* = {1.0 + 3.06 * length ** (1.5 * 0.58):.2g}"


def _starved(statement: str, flooded: float, fully_flooded: str, remedy: str) -> str:
    more = "more than " if remedy == FARTHER else ""
    return (
        f"{statement}. A flooded inlet needs {more}{flooded:.3g} half-widths ({fully_flooded}); "
        f"start grid.x {remedy} unless starvation is intended."
    )


def _too_long(statement: str, needed: float, cells: float) -> str:
    return (
        f"{statement}: starting grid.x at {-needed:.3g} gives more than the present {cells:.2g} "
        "cells where the film forms."
    )


def _beyond_roughness(loss: float) -> str:
    return (
        f"The film is about {100.0 * loss:.2g} % too thin: the pressure of so light a contact "
        "reaches beyond the grid of its roughness."
    )


def _starvation(conditions: ContactConditions, lubricant: Lubricant, grid: Grid) -> float:
    """Return the share of the film lost by the ends of the grid."""
    inlet = missing_inlet(conditions, lubricant, -grid.lower[0])
    return max(FILM_LOSS_PER_PRESSURE_LOSS * inlet, film_loss(conditions, lubricant, grid))


def _beyond_body(conditions: ContactConditions, lubricant: Lubricant) -> str:
    """Return a note on pressure beyond the body; empty if it matters little."""
    beyond = loss_beyond_body(conditions, lubricant)
    if beyond <= MIN_STARVATION:
        return ""
    return (
        "The body counts as an endless paraboloid, as in film formulas: about "
        f"{100.0 * beyond:.2g} % of the film is due to pressure beyond its radius, where a real "
        "body ends."
    )


def solution_notes(solution: ContactSolution, *, standing: bool = True) -> tuple[str, ...]:
    """Return notes on a solution: pressure, grid edges, resolution, deviation from formulas.

    `standing` is False if the solution is the start of a contact whose roughness moves.
    """
    return tuple(_of_solution(solution, standing=standing))


def undetermined(
    solution: ContactSolution, clr: Uncertainty, *, resolved: bool = False
) -> str | None:
    """Return the reason why this grid does not determine CLR (error `clr`); None if it does.

    Cells are not judged where they are `resolved`: compared with a coarser grid in all respects.
    """
    reasons: list[str] = []
    if not resolved and not is_below_contact_film(solution):
        reasons += grid_shortfalls(solution.conditions, solution.lubricant, solution.surface)
    # between smooth bodies the coarser grid has contact because it does not resolve the inlet
    if solution.surface.sq > 0.0:
        if clr.numerical is None:
            reasons.append("no coarser grid is available to estimate its error")
        elif max(clr.numerical) > MAX_CLR_ERROR:
            bar, limit = (
                quantity("clr").text(value) for value in (max(clr.numerical), MAX_CLR_ERROR)
            )
            reasons.append(f"its error bar is {bar}, above the limit of {limit}")
    return "; ".join(reasons) or None


def uncertain_films(
    numbers: Mapping[str, float | None], solution: ContactSolution | None = None
) -> tuple[str, ...]:
    """Return the films whose error bar is above 15 %, each with its bar, from numbers by key.

    Or else the reason, if the grid of a solution is so small that the film is as much too thin.
    """
    oil = None if solution is None else solution.lubricant
    if (
        solution is not None
        and oil is not None
        and (
            reason := _cut_off(solution.conditions, oil, solution.grid)
            or _unchecked(solution.conditions, oil, numbers)
        )
    ):
        return (reason,)
    values = ((f"{name}_m", f"{name}_error_m") for name in ("h_min", "h_central"))
    return tuple(
        f"{quantity(key).name} ± {100.0 * bar / film:.0f} %"
        for key, error in values
        if (film := numbers[key]) and (bar := numbers[error]) and bar > MAX_FILM_ERROR * film
    )


def _cut_off(conditions: ContactConditions, oil: Lubricant, grid: Grid) -> str:
    """Return the reason why a light contact's film is not determined; empty if it is."""
    if loss_beyond_body(conditions, oil) > MAX_FILM_ERROR:
        return "the pressure of so light a contact reaches beyond the body"
    if film_loss(conditions, oil, grid) > MAX_FILM_ERROR:
        return "the grid is too small for so light a contact"
    return ""


def _unchecked(
    conditions: ContactConditions, oil: Lubricant, numbers: Mapping[str, float | None]
) -> str:
    """Return the reason why the error of a rigid ball's film is unknown; empty if it is known."""
    light = build_up_lengths(conditions, oil)[0] > 0.0
    return "no coarser grid to compare with" if light and numbers["h_min_error_m"] is None else ""


def is_below_contact_film(solution: ContactSolution) -> bool:
    """Return True for smooth bodies with a fitted film below the contact film, on any grid."""
    oil, smooth = solution.lubricant, not np.any(solution.surface.heights)
    floor = solution.options.contact_film
    return oil is not None and smooth and least_film(solution.conditions, oil) < floor


def _solids(conditions: ContactConditions) -> Iterator[str]:
    pair = conditions.pair
    hertz = conditions.hertz
    for body, (modulus, poisson) in enumerate(
        zip(pair.youngs_moduli, pair.poisson_ratios, strict=True), 1
    ):
        if modulus < SOFT and poisson < MIN_RUBBER_POISSON:
            yield (
                f"Body {body} has a Young's modulus of {modulus / 1e6:.4g} MPa and a Poisson's "
                f"ratio of {poisson:.3g}: this is neither a metal (210 GPa for steel) nor a "
                "rubber (0.49). Check the unit."
            )
        if modulus > MAX_MODULUS:
            yield (
                f"Body {body} has a Young's modulus of {modulus / 1e9:.4g} GPa, above that of "
                "diamond (1100 GPa). Check the unit."
            )
    if conditions.hardness is not None and conditions.hardness < hertz.p_max:
        yield (
            f"The hardness of {conditions.hardness / 1e9:.3g} GPa is below the maximum Hertz "
            f"pressure of {hertz.p_max / 1e9:.3g} GPa: the bulk yields, not only the asperities."
        )


def _roller(conditions: ContactConditions) -> Iterator[str]:
    load = conditions.sliced_load
    if load.sharp:
        yield (
            "The roller profile relieves the ends too little: the pressure of elastic "
            "half-spaces is singular there. Use more crown, or evaluate load per length and "
            "pressure at mid-length only."
        )
    if load.on_end > LOADED_END:
        yield (
            "The roller's ends carry load as half-spaces do; the free end surface of a real "
            "roller, which is softer, is not modelled."
        )
    if load.peak > UNEVEN_LOAD:
        low, high = load.ends
        yield (
            f"By slices, {100.0 * (high - low) / conditions.line_length:.0f} % of the roller "
            f"carries load, with a peak of {load.peak:.2g} times the mean; Hertz values and film "
            "formulas assume a uniform load."
        )


def _oil(conditions: ContactConditions, lubricant: Lubricant) -> Iterator[str]:
    law = lubricant.viscosity
    p_h = conditions.hertz.p_max
    alpha = getattr(law, "alpha", None)
    if alpha is not None and not OIL_ALPHA[0] <= alpha <= OIL_ALPHA[1]:
        yield (
            f"The pressure-viscosity coefficient of {alpha * 1e9:.3g} 1/GPa is outside the usual "
            "range of oils, 5 to 40. Check its unit."
        )
    if isinstance(law, Barus) and law.alpha * p_h > MAX_BARUS_EXPONENT:
        yield (
            f"Barus' law raises the viscosity by exp({law.alpha * p_h:.3g}) at the maximum Hertz "
            "pressure, which is unrealistic. Use Roelands' law."
        )
    if isinstance(law, Roelands) and not 0.0 < law.exponent <= 1.0:
        yield (
            f"Roelands' exponent z is {law.exponent:.3g}; oils have 0.4 to 0.8. Check eta0 and "
            "alpha."
        )


def _of_solution(solution: ContactSolution, *, standing: bool) -> Iterator[str]:
    conditions, lubricant = solution.conditions, solution.lubricant
    highest = float(solution.pressure.max())
    modulus = conditions.pair.effective_modulus
    if highest > modulus / MIN_MODULUS_RATIO:
        yield (
            f"The largest pressure of {highest / 1e9:.3g} GPa exceeds a twentieth of E' = "
            f"{modulus / 1e9:.4g} GPa: strains are not small, and real bodies yield or fracture."
        )
    if edges := _reached_edges(solution):
        yield f"The contact reaches the {edges} of the grid and is cut off there. Widen the grid."
    yield from _of_cells(solution)
    if solution.convergence.attempt == SolveStrategy.ARITHMETIC_MEANS:
        yield (
            "The hot film is solved with arithmetic mean mobilities of the faces between cells, "
            "which drain thin films too fast: CLR is too high, by up to 0.3 on a coarse grid."
        )
    if (
        lubricant is not None
        and (radii := ridge_radii(solution))
        and radii[1] > EDGE_RATIO * radii[0]
    ):
        narrow, wide = (f"{1e6 * radius:.2g} um" for radius in radii)
        yield (
            f"The touching ridges are sharp edges: their radius along x is {narrow} on these cells "
            f"and {wide} on cells twice as wide. CLR may therefore not converge with the grid; "
            "its interval covers one refinement only."
        )
    if standing and lubricant is not None and np.any(solution.surface.heights):
        ratio = least_film(conditions, lubricant) / solution.surface.sq
        if (
            ratio < THIN_FILM_RATIO
            and carried_share(solution.pressure, solution.in_contact) < NO_LOAD_SHARE
        ):
            yield (
                f"The film ratio of {ratio:.2g} indicates mixed or boundary lubrication, but the "
                "asperities carry almost no load: oil that flows past stationary roughness "
                "flattens it. Moving roughness may carry more: contact.roughness = running."
            )
    if (profile := axial_distribution(solution)) is not None:
        yield from profile.undetermined
    if (deviation := far_from_fits(solution)) is not None:
        yield deviation


def _of_cells(solution: ContactSolution) -> Iterator[str]:
    conditions, oil, cells = solution.conditions, solution.lubricant, solution.grid.cells
    if oil is not None and is_below_contact_film(solution):
        film, floor = 1e9 * least_film(conditions, oil), 1e9 * solution.options.contact_film
        yield (
            f"The film of the smooth bodies, {film:.2g} nm by the fit of its regime, is below the "
            f"contact film of {floor:.3g} nm. Films below it are not computed: CLR is the load at "
            "the contact film, not on asperities."
        )
    elif shortfalls := grid_shortfalls(conditions, oil, solution.surface):
        yield f"The grid of {cells[0]} x {cells[1]} cells has {'; '.join(shortfalls)}."


def ridge_radii(solution: ContactSolution) -> tuple[float, float] | None:
    """Return the median radius along x of the touching crests [m], with cell steps of one and two.

    Both agree for smooth crests. For an edge, whose radius is set by the cells, the second is twice
    the first. None if fewer than twenty crests touch.
    """
    heights = solution.surface.heights
    dx = solution.grid.spacing[0]
    crest = heights[2:-2]
    narrow, wide = (
        2.0 * crest - heights[2 - n : -2 - n] - heights[2 + n : heights.shape[0] - 2 + n]
        for n in (1, 2)
    )
    touching = solution.in_contact[2:-2] & (narrow > 0.0) & (wide > 0.0)
    touching &= (crest >= heights[1:-3]) & (crest >= heights[3:-1])
    if np.count_nonzero(touching) < MIN_RIDGES:
        return None
    return float(dx**2 / np.median(narrow[touching])), float(
        4.0 * dx**2 / np.median(wide[touching])
    )


def _reached_edges(solution: ContactSolution) -> str:
    """Return the grid edges that the contact reaches, within two cells."""
    touching = solution.in_contact
    edges = [
        name
        for name, rows in (("inlet edge", touching[:2]), ("outlet edge", touching[-2:]))
        if rows.any()
    ]
    reaches_end = (
        max(abs(end) for end in (solution.grid.y[0], solution.grid.y[-1]))
        >= solution.conditions.end
    )
    if (
        not solution.grid.periodic[1]
        and not reaches_end
        and (touching[:, :2].any() or touching[:, -2:].any())
    ):
        edges.append("sides")
    return " and ".join(edges)
