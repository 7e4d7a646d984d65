"""Notes on a wear history: one sentence each on what limits its numbers."""

import math

import pandas

from asperity.simulation.wear.jump import WearingContact
from asperity.simulation.wear.state import WearState
from asperity.simulation.wear.tracks import BODIES
from asperity.surface import correlation_lengths
from asperity.wear import TrackPosition, combined_roughness

NAMES = ("first", "second")
RADIUS_TOLERANCE = 0.05  # relative, between the bodies' radii and the contact's
RECOMMENDED_CELLS = 8.0  # per correlation length, as in automatic grids
ENOUGH_CELLS = 0.8  # of them: the correlation length of a sample scatters
FEW_JUMPS = 5  # in which a point is sampled at few positions of the contact


def history_notes(contact: WearingContact, table: pandas.DataFrame, state: WearState) -> list[str]:
    """Return the notes that apply to a history with that table and final state."""
    every = (
        cells_note(contact),
        grooves_note(contact),
        radii_note(contact),
        standing_note(contact),
    )
    notes = (*every, few_jumps_note(contact, len(table) - 1, state))
    return [note for note in notes if note is not None]


def cells_note(contact: WearingContact) -> str | None:
    """Return a note if the roughness has too few cells per correlation length, with a remedy."""
    grid = contact.surfaces.grid
    if not any(contact.surfaces.rough):
        return None
    lengths = correlation_lengths(combined_roughness(contact.surfaces, TrackPosition(0, 0)))
    along = [length / spacing for length, spacing in zip(lengths, grid.spacing, strict=True)]
    fewest = min((count for count in along if not math.isnan(count)), default=math.inf)
    if not fewest < ENOUGH_CELLS * RECOMMENDED_CELLS:
        return None
    recommended = [
        cells
        if not count < RECOMMENDED_CELLS
        else 8 * math.ceil(RECOMMENDED_CELLS * cells / count / 8.0)
        for cells, count in zip(grid.cells, along, strict=True)
    ]
    stated = " by ".join("many" if math.isnan(count) else f"{count:.2g}" for count in along)
    return (
        f"The roughness has {stated} cells along its correlation lengths; "
        f"{RECOMMENDED_CELLS:g} are recommended. With fewer cells, CLR and wear rate depend on the "
        "grid (examples/wear.toml starts with a CLR of 0.70 and 0.72 on 64 and 128 cells); state "
        f'grid.cells = {recommended}, or "auto".'
    )


def grooves_note(contact: WearingContact) -> str | None:
    """Return a note on a smooth moving body that contacts a single track of its partner."""
    rough = contact.surfaces.rough
    speeds = contact.case.conditions.surface_speeds
    if not contact.case.conditions.endless or sum(rough) != 1 or 0.0 in speeds:
        return None
    smooth = rough.index(False)
    if contact.model.coefficients[smooth].k == 0.0:
        return None
    tracks = contact.perimeter(1 - smooth) / contact.surfaces.first.grid.extent[0]
    return (
        f"The {NAMES[smooth]} body is smooth and always contacts the same simulated track, one of "
        f"{tracks:.0f} around its partner: its grooves, largest depth and Sq are specific to that "
        "track; its mean depth is not."
    )


def radii_note(contact: WearingContact) -> str | None:
    """Return a note if speeds and over-rolling rates contradict the contact's radius."""
    stated = contact.model.overrolling
    conditions = contact.case.conditions
    if stated is None or 0.0 in conditions.surface_speeds:
        return None
    curvatures = [
        2.0 * math.pi * rate / abs(speed)
        for rate, speed in zip(stated, conditions.surface_speeds, strict=True)
    ]
    curvature = 1.0 / conditions.radius_along_rolling
    if abs(sum(curvatures) - curvature) <= RADIUS_TOLERANCE * curvature:
        return None
    first, second = (f"{1e3 / value:.4g}" for value in curvatures)
    return (
        f"wear.overrolling implies bodies of {first} and {second} mm radius, which do not give the "
        f"contact's {1e3 * conditions.radius_along_rolling:.4g} mm in external contact; check "
        "the order of the pair."
    )


def standing_note(contact: WearingContact) -> str | None:
    """Return a note if a body at rest can have no pits or marks although these are requested."""
    stationary = [NAMES[body] for body in BODIES if contact.bodies[body].speed == 0.0]
    mechanisms = [name for name in ("fatigue", "ploughing") if name in contact.model.mechanisms]
    if not stationary or not mechanisms:
        return None
    return (
        f"The {stationary[0]} body stands still and is not over-rolled: "
        f"no {' or '.join(mechanisms)} acts on it."
    )


def few_jumps_note(contact: WearingContact, jumps: int, state: WearState) -> str | None:
    """Return a note if few jumps sample a passage at few positions."""
    if jumps >= FEW_JUMPS or len(contact.positions(state)) == 1:
        return None
    return (
        f"In {jumps} jumps of {contact.patches} positions, each point was sampled at few positions "
        "of the contact: local depths scatter by about 10 %; volumes do not. Raise wear.patches "
        "or lower wear.step."
    )
