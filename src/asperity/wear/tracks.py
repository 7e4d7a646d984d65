"""Where two tracks lie as the contact is solved on them: positions by whole cells, and maps laid back onto the tracks.

By whole cells nothing is interpolated, so that what wears off one position is what comes off the
track, to rounding.
"""

from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field
from asperity.surface import MovingSurfaces, Surface

GOLDEN = 0.6180339887498949


class Position(NamedTuple):
    """Cell of either track that lies under the first cells of the contact; 0 for one that stands still."""

    first: int
    second: int


def positions(
    cells: tuple[int, int], moves: tuple[bool, bool], count: int, jump: int, seed: int
) -> tuple[Position, ...]:
    """So many positions, evenly along each track and in every pairing as likely, others at every jump.

    Parameters
    ----------
    cells : of both tracks along rolling
    moves : which of them has anywhere to go: a body that stands still, or that is the same everywhere, has not
    count, jump, seed : how many, and which jump of which run; the same give the same
    """
    rng = np.random.default_rng([seed, jump])
    along = [np.arange(count), rng.permutation(count)]
    places = []
    for which, (length, goes) in enumerate(zip(cells, moves, strict=True)):
        offset = (GOLDEN * (jump + 1) * (which + 1)) % 1.0
        places.append(
            np.floor((along[which] + offset) * length / count).astype(int) % length
            if goes
            else 0 * along[0]
        )
    return tuple(Position(int(first), int(second)) for first, second in zip(*places, strict=True))


def seen(surfaces: MovingSurfaces, position: Position) -> Surface:
    """What the contact sees of both at a position: the sum of their heights on its grid."""
    length = surfaces.grid.cells[0]
    first, second = (
        np.roll(surface.heights, -start, axis=0)[:length]
        for surface, start in zip((surfaces.first, surfaces.second), position, strict=True)
    )
    return Surface(first + second[:, ::-1], surfaces.grid)


def on_track(
    field: Field, cells: tuple[int, int], position: Position, body: int, beside: float = 0.0
) -> Field:
    """A map of the contact on a body's track of so many cells, in the body's own frame; a number `beside` it."""
    track = np.full(cells, beside)
    track[: field.shape[0]] = field if body == 0 else field[:, ::-1]
    return np.roll(track, position[body], axis=0)


def across(field: Field, position: Position, body: int) -> Field:
    """What lies on one body's track where it lies on the other's, as long a one, that faces it at this position."""
    return np.roll(np.roll(field, -position[body], axis=0)[:, ::-1], position[1 - body], axis=0)
