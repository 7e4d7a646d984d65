"""What a reader of a wear history has to know of it, beside its numbers: a sentence each."""

import math

import pandas

from asperity.simulation.wear.jump import BODIES, WearingContact
from asperity.simulation.wear.state import WearState
from asperity.surface import correlation_lengths
from asperity.wear import TrackPosition, combined_roughness

NAMES = ("first", "second")
FAR = 0.05  # relative, by which the bodies' radii may miss the contact's unsaid
WANTED = 8.0  # cells along a correlation length, as a grid that is chosen has
ENOUGH = 0.8  # of them: a sample's correlation length scatters about that of its kind
FEW = 5  # jumps, in which a point has met the contact at few places of it


def told(ageing: WearingContact, table: pandas.DataFrame, worn: WearState) -> list[str]:
    """Those that apply to a history of that table that ended so."""
    every = (of_cells(ageing), of_grooves(ageing), of_radii(ageing), of_standing(ageing))
    return [one for one in (*every, of_few_jumps(ageing, len(table) - 1, worn)) if one is not None]


def of_cells(ageing: WearingContact) -> str | None:
    """That the roughness has too few cells for its load share and its wear, and how many it wants; None of enough."""
    grid = ageing.surfaces.grid
    if not any(ageing.surfaces.rough):
        return None
    lengths = correlation_lengths(combined_roughness(ageing.surfaces, TrackPosition(0, 0)))
    along = [length / spacing for length, spacing in zip(lengths, grid.spacing, strict=True)]
    if not min((one for one in along if not math.isnan(one)), default=math.inf) < ENOUGH * WANTED:
        return None
    wanted = [
        cells if not one < WANTED else 8 * math.ceil(WANTED * cells / one / 8.0)
        for cells, one in zip(grid.cells, along, strict=True)
    ]
    told = " by ".join("many" if math.isnan(one) else f"{one:.2g}" for one in along)
    return (
        f"The roughness has {told} cells along its correlation lengths, where {WANTED:g} are wanted: on "
        "so few CLR comes out too high, and what wears too fast (examples/wear.toml begins with a CLR of 0.71, 0.64 "
        f'and 0.60 on 64, 128 and 256 cells); state grid.cells = {wanted}, or "auto".'
    )


def of_grooves(ageing: WearingContact) -> str | None:
    """How little of its partner a smooth moving body meets in an endless contact; None where that does no harm."""
    rough, speeds = ageing.surfaces.rough, ageing.case.conditions.surface_speeds
    if not ageing.case.conditions.endless or sum(rough) != 1 or 0.0 in speeds:
        return None
    smooth = rough.index(False)
    if ageing.model.coefficients[smooth].k == 0.0:
        return None
    tracks = ageing.perimeter(1 - smooth) / ageing.surfaces.first.grid.extent[0]
    return (
        f"The {('first', 'second')[smooth]} body is smooth and meets one track of {tracks:.0f} all round its partner, "
        "again and again: its grooves, largest depth and Sq are that track's doing; its mean depth is not."
    )


def of_radii(ageing: WearingContact) -> str | None:
    """How far speeds and stated over-rolling rates are from the contact's radius; None where they fit."""
    stated, conditions = ageing.model.overrolling, ageing.case.conditions
    if stated is None or 0.0 in conditions.surface_speeds:
        return None
    curvatures = [
        2.0 * math.pi * rate / abs(speed)
        for rate, speed in zip(stated, conditions.surface_speeds, strict=True)
    ]
    contact = 1.0 / conditions.radius_along_rolling
    if abs(sum(curvatures) - contact) <= FAR * contact:
        return None
    first, second = (f"{1e3 / curvature:.4g}" for curvature in curvatures)
    return (
        f"wear.overrolling makes bodies of {first} and {second} mm radius, which outside one another do not give the "
        f"contact's {1e3 * conditions.radius_along_rolling:.4g} mm; check that the pair is in the bodies' order."
    )


def of_standing(ageing: WearingContact) -> str | None:
    """That a body at rest gets no pits and no marks; None where that leaves nothing out."""
    still = [NAMES[body] for body in BODIES if ageing.bodies[body].speed == 0.0]
    passing = [name for name in ("fatigue", "ploughing") if name in ageing.model.mechanisms]
    if not still or not passing:
        return None
    return f"Nothing over-rolls the {still[0]} body, which stands still: {' and '.join(passing)} spare it."


def of_few_jumps(ageing: WearingContact, jumps: int, worn: WearState) -> str | None:
    """That few jumps sample a passage at few places; None of many, and where nothing is rough or moves."""
    if jumps >= FEW or len(ageing.positions(worn)) == 1:
        return None
    return (
        f"In {jumps} jumps of {ageing.patches} positions each point has met the contact at few places of it: depths at "
        "a point scatter by some 10 %, volumes do not. More wear.patches, or a smaller wear.step, sample it more often."
    )
