"""What of a contact is implausible: noted, not refused, a sentence each."""

from collections.abc import Iterator

import numpy as np

from asperity.contact.conditions import ContactConditions
from asperity.contact.grid import Grid
from asperity.core.quantities import quantity
from asperity.ehl import (
    ContactSolution,
    Uncertainty,
    flooded_inlet,
    grid_shortfalls,
    inlet_length,
    least_film,
    missing_inlet,
)
from asperity.ehl.grid_design import CELLS_IN_INLET, MAX_CLR_ERROR
from asperity.ehl.load_shares import carried_share
from asperity.lubricant import Barus, Lubricant, Roelands
from asperity.solution.ends import BEARING, along_roller
from asperity.solution.regime import far_from_fits

UNEVEN = 1.5  # largest over mean load per length along a roller, from which it is said
OILS = 5e-9, 40e-9  # pressure-viscosity coefficients [1/Pa]
SOFT = 1e9  # Young's modulus below which a body is rubber or a slip of the unit [Pa]
COMPRESSIBLE = 0.4  # Poisson's ratio below which it is not rubber
STIFFEST = 1.3e12  # diamond has 1.1 TPa
LARGEST_BARUS = 15.0  # alpha p_h
HALF_SPACE = (
    20.0  # E' over a pressure below which bodies are no elastic half-spaces of small strain
)
STARVED = 0.03  # loss of film that is said
EDGED, FEWEST_RIDGES = (
    1.6,
    20,
)  # radius of ridges over that on the cells as they are, on cells twice as wide
THIN, NOTHING = (
    0.5,
    0.01,
)  # film ratio below which no film is expected, and a load share that is none
FILM_BY_PRESSURE = (
    0.75  # relative loss of film over the share of the inlet's pressure that is missing
)


def plausibility_notes(
    conditions: ContactConditions, lubricant: Lubricant | None
) -> tuple[str, ...]:
    """What a reader of the results should doubt about the bodies, the load and the oil."""
    solids, oil = _solids(conditions), () if lubricant is None else _oil(conditions, lubricant)
    return (*solids, *(_roller(conditions) if conditions.geometry == "roller" else ()), *oil)


def inlet_notes(
    conditions: ContactConditions, lubricant: Lubricant | None, grid: Grid
) -> tuple[str, ...]:
    """Whether the grid's inlet starves the film, or is so long that it takes cells from where the film is made.

    By the pressure that Hertz's gap builds up before the grid begins; Hamrock and Dowson's inlet
    of full flooding, m* = 1 + 3.06 (h R/a²)^0.58, stands beside it. Source: B. J. Hamrock, D.
    Dowson, J. Lubr. Technol. 99 (1977) 15.
    """
    if lubricant is None:
        return ()
    a, begins = conditions.hertz.half_widths[0], -grid.lower[0]
    loss = FILM_BY_PRESSURE * missing_inlet(conditions, lubricant, begins)
    flooded = flooded_inlet(conditions, lubricant) / a
    length = inlet_length(conditions, lubricant)
    fully = 1.0 + 3.06 * (length / a) ** (1.5 * 0.58)
    if loss > STARVED:
        return (
            f"The inlet of {begins / a:.3g} half-widths starves the film by about {100.0 * loss:.2g} %: it is flooded "
            f"from {flooded:.3g} on (m* = {fully:.2g}); start grid.x at {-flooded:.3g} unless that is meant.",
        )
    cells = length / grid.spacing[0]
    if begins > 2.0 * max(flooded, 1.6) * a and cells < CELLS_IN_INLET["rough"]:
        ample = max(flooded, 1.6)
        return (
            f"The inlet of {begins / a:.3g} half-widths is longer than the film needs (m* = {fully:.2g}): grid.x from "
            f"{-ample:.3g} leaves more cells than the present {cells:.2g} where the film is made.",
        )
    return ()


def solution_notes(solution: ContactSolution) -> tuple[str, ...]:
    """What a reader should know of this solution: pressure, edges, resolution, and a film far from its fits."""
    return tuple(_of_solution(solution))


def undetermined(solution: ContactSolution, clr: Uncertainty) -> str | None:
    """Why the solution's grid cannot tell CLR, of which `clr` says how far it may be off; None where it can."""
    reasons = list(grid_shortfalls(solution.conditions, solution.lubricant, solution.surface))
    # between smooth bodies the coarser grid touches because it does not show the inlet, which this
    # one does
    if solution.surface.sq > 0.0:
        if clr.numerical is None:
            reasons.append("no coarser grid tells how far it may be off")
        elif max(clr.numerical) > MAX_CLR_ERROR:
            bar, most = (
                quantity("clr").text(value) for value in (max(clr.numerical), MAX_CLR_ERROR)
            )
            reasons.append(f"an error bar of {bar}, where at most {most} tell something")
    return "; ".join(reasons) or None


def _solids(conditions: ContactConditions) -> Iterator[str]:
    pair, hertz = conditions.pair, conditions.hertz
    for body, (modulus, poisson) in enumerate(
        zip(pair.youngs_moduli, pair.poisson_ratios, strict=True), 1
    ):
        if modulus < SOFT and poisson < COMPRESSIBLE:
            yield (
                f"Body {body} has a Young's modulus of {modulus / 1e6:.4g} MPa and a Poisson's ratio of {poisson:.3g}: "
                "it is neither a metal (210 GPa for steel) nor a rubber (0.49); check the unit."
            )
        if modulus > STIFFEST:
            yield (
                f"Body {body} has a Young's modulus of {modulus / 1e9:.4g} GPa, above diamond's 1100 GPa; "
                "check the unit."
            )
    if conditions.hardness is not None and conditions.hardness < hertz.p_max:
        yield (
            f"The hardness of {conditions.hardness / 1e9:.3g} GPa lies below Hertz's largest pressure of "
            f"{hertz.p_max / 1e9:.3g} GPa: the bodies themselves yield, not their asperities alone."
        )


def _roller(conditions: ContactConditions) -> Iterator[str]:
    load = conditions.sliced_load
    if load.sharp:
        yield (
            "The roller's shape falls back too little for its ends: the pressure of elastic half-spaces has no limit "
            "there. Take more crown, or read load per length and pressure at mid-length."
        )
    if load.on_end > BEARING:
        yield (
            "The roller's ends bear load as ends of half-spaces do; that a real roller ends in a free surface, which "
            "is softer, is not modelled."
        )
    if load.peak > UNEVEN:
        low, high = load.ends
        yield (
            f"By slices the load lies on {100.0 * (high - low) / conditions.line_length:.0f} % of the roller, and is "
            f"{load.peak:.2g} times its mean there: Hertz's values and fitted films are those of an even load."
        )


def _oil(conditions: ContactConditions, lubricant: Lubricant) -> Iterator[str]:
    law, p_h = lubricant.viscosity, conditions.hertz.p_max
    alpha = getattr(law, "alpha", None)
    if alpha is not None and not OILS[0] <= alpha <= OILS[1]:
        yield (
            f"The pressure-viscosity coefficient of {alpha * 1e9:.3g} 1/GPa lies outside 5 to 40, where oils lie; "
            "check its unit."
        )
    if isinstance(law, Barus) and law.alpha * p_h > LARGEST_BARUS:
        yield (
            f"Barus' law thickens the oil by exp({law.alpha * p_h:.3g}) at Hertz's pressure, far beyond any oil; "
            "take Roelands' law."
        )
    if isinstance(law, Roelands) and not 0.0 < law.exponent <= 1.0:
        yield (
            f"Roelands' exponent z is {law.exponent:.3g}, where oils have 0.4 to 0.8; check eta0 and alpha."
        )


def _of_solution(solution: ContactSolution) -> Iterator[str]:
    conditions, lubricant, grid = solution.conditions, solution.lubricant, solution.grid
    highest, modulus = float(solution.pressure.max()), conditions.pair.effective_modulus
    if highest > modulus / HALF_SPACE:
        yield (
            f"The largest pressure of {highest / 1e9:.3g} GPa exceeds a twentieth of E' = {modulus / 1e9:.4g} GPa: "
            "the strains are no longer small, and real bodies yield or tear."
        )
    if edges := _reached_edges(solution):
        yield f"Contact runs into the {edges} of the grid, and what lies beyond it is missing: widen the grid."
    if shortfalls := grid_shortfalls(conditions, lubricant, solution.surface):
        yield f"The grid of {grid.cells[0]} x {grid.cells[1]} cells has {'; '.join(shortfalls)}."
    if lubricant is not None and (radii := ridge_radii(solution)) and radii[1] > EDGED * radii[0]:
        here, wider = (f"{1e6 * radius:.2g} um" for radius in radii)
        yield (
            f"The ridges that touch are edges: along x their radius is {here} on these cells and {wider} on cells "
            "twice as wide. Each finer grid shows the oil other inlets, so that CLR may have no limit that a grid "
            "could show; its interval holds the next finer grid and no more."
        )
    if lubricant is not None and np.any(solution.surface.heights):
        ratio = least_film(conditions, lubricant) / solution.surface.sq
        if ratio < THIN and carried_share(solution.pressure, solution.in_contact) < NOTHING:
            yield (
                f"By its film ratio of {ratio:.2g} this contact would be called mixed or boundary lubricated, and its "
                "asperities bear next to nothing: oil that flows past standing roughness presses it flat. What moves "
                "need not be pressed so; asperity run tells."
            )
    if (along := along_roller(solution)) is not None:
        yield from along.undetermined
    if (far := far_from_fits(solution)) is not None:
        yield far


def ridge_radii(solution: ContactSolution) -> tuple[float, float] | None:
    """Median radius along x of the crests that touch [m], by differences over one cell and over two.

    Those of a smooth crest agree; of an edge, whose radius is what the cells make of it, the
    second is twice the first. None where fewer than twenty touch.
    """
    heights, dx = solution.surface.heights, solution.grid.spacing[0]
    crest = heights[2:-2]
    near, far = (
        2.0 * crest - heights[2 - n : -2 - n] - heights[2 + n : heights.shape[0] - 2 + n]
        for n in (1, 2)
    )
    touching = solution.in_contact[2:-2] & (near > 0.0) & (far > 0.0)
    touching &= (crest >= heights[1:-3]) & (crest >= heights[3:-1])
    if np.count_nonzero(touching) < FEWEST_RIDGES:
        return None
    return float(dx**2 / np.median(near[touching])), float(4.0 * dx**2 / np.median(far[touching]))


def _reached_edges(solution: ContactSolution) -> str:
    """Which edges the contact has come to, within two cells."""
    touching = solution.in_contact
    found = [
        name
        for name, rows in (("inlet edge", touching[:2]), ("outlet edge", touching[-2:]))
        if rows.any()
    ]
    ends = (
        max(abs(end) for end in (solution.grid.y[0], solution.grid.y[-1]))
        >= solution.conditions.end
    )
    if (
        not solution.grid.periodic[1]
        and not ends
        and (touching[:, :2].any() or touching[:, -2:].any())
    ):
        found.append("sides")
    return " and ".join(found)
