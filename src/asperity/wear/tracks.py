"""Positions of two tracks under the contact, and mapping of contact fields onto the tracks.

Positions are whole cells, so nothing is interpolated: the depth removed at a position equals the
depth lost by the track, to rounding.
"""

from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field
from asperity.surface import MovingSurfaces, Surface

GOLDEN = 0.6180339887498949


class TrackPosition(NamedTuple):
    """Cell of each track that lies under the first cells of the contact; 0 if it stands still."""

    first: int
    second: int


def positions(
    cells: tuple[int, int], moves: tuple[bool, bool], count: int, jump: int, seed: int
) -> tuple[TrackPosition, ...]:
    """Return `count` positions, evenly spaced along each track, paired at random per jump.

    Parameters
    ----------
    cells : of both tracks along rolling
    moves : False for a body that stands still or is uniform along its track
    count, jump, seed : number of positions, number of the jump and seed of the run
    """
    rng = np.random.default_rng([seed, jump])
    along = [np.arange(count), rng.permutation(count)]
    starts = []
    for body, (length, moving) in enumerate(zip(cells, moves, strict=True)):
        offset = (GOLDEN * (jump + 1) * (body + 1)) % 1.0
        starts.append(
            np.floor((along[body] + offset) * length / count).astype(int) % length
            if moving
            else 0 * along[0]
        )
    return tuple(
        TrackPosition(int(first), int(second)) for first, second in zip(*starts, strict=True)
    )


def surfaces_at(surfaces: MovingSurfaces, position: TrackPosition) -> MovingSurfaces:
    """Return both bodies' surfaces with their tracks at a position at time 0."""
    first, second = (
        Surface(np.roll(surface.heights, -start, axis=0), surface.grid)
        for surface, start in zip((surfaces.first, surfaces.second), position, strict=True)
    )
    return MovingSurfaces(first, second, surfaces.speeds, surfaces.grid)


def combined_roughness(surfaces: MovingSurfaces, position: TrackPosition) -> Surface:
    """Return the sum of both bodies' heights on the contact's grid at a position."""
    return surfaces_at(surfaces, position).composite_at(0.0)


def map_to_track(
    field: Field, cells: tuple[int, int], position: TrackPosition, body: int, outside: float = 0.0
) -> Field:
    """Place a contact field on a body's track of `cells`, in its own frame; `outside` elsewhere."""
    track = np.full(cells, outside)
    track[: field.shape[0]] = field if body == 0 else field[:, ::-1]
    return np.roll(track, position[body], axis=0)


def to_other_track(field: Field, position: TrackPosition, body: int) -> Field:
    """Map a field on one body's track to the other's, of equal length, at this position."""
    return np.roll(np.roll(field, -position[body], axis=0)[:, ::-1], position[1 - body], axis=0)
