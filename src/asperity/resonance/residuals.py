"""What a fit leaves of spectra, and what that makes of deviations.

A machine does not quite repeat itself, a structure is not quite followed. The fit is left to
`separation`, what it means to `series`; docs/theory/indicators.md has the equations.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field, Mask
from asperity.resonance.separation import Joint
from asperity.resonance.spectrum_model import LOOSE, Blocks, shares_of

COMMON_FROM = (
    0.1  # share of what all recordings share in a block, from which its residual is the machine's
)
WITNESS_FROM = 0.8  # of a parameter's influence, that a witness has to cover
TINY = 1e-100


class Witnesses(NamedTuple):
    """How far recordings are from what was fitted to them, relative to what all share; (recordings, blocks) each.

    `lacking` (blocks,) is by how much fits are off there, relative, squared, less chance: of all
    recordings whose lines reach there, the more the stronger they are.
    """

    counts: Mask  # where what all share is most of what is there
    change: Field
    by_chance: Field  # variance that chance brings
    lacking: Field


def witnesses_of(blocks: Blocks, joint: Joint, rows: list[int]) -> Witnesses:
    """How far some recordings are from what was fitted to all."""
    relative, expected = shares_of(blocks, joint.parameters)
    common = relative[rows, 3]
    counts = (common > COMMON_FROM) & (blocks.weight[rows] > 0.0)
    share = np.where(counts, common, 1.0)
    change = np.where(counts, (blocks.density / expected - 1.0)[rows] / share, 0.0)
    by_chance = np.where(counts, 1.0 / (np.maximum(blocks.weight[rows], 1.0) * share**2), 0.0)
    reached = relative[rows, 0] ** 2 * (blocks.weight[rows] > 0.0)
    beyond = (blocks.density / expected - 1.0)[rows] ** 2 - 1.0 / np.maximum(
        blocks.weight[rows], 1.0
    )
    lacking = np.sum(reached * beyond, axis=0) / np.maximum(np.sum(reached, axis=0), TINY)
    return Witnesses(counts, change, by_chance, lacking)


class Brought(NamedTuple):
    """Standard deviations (recordings, 4) that chance does not bring.

    Of a machine that does not quite repeat itself, and of a structure that is not quite followed.
    """

    misfit: Field
    lacking: Field

    @property
    def std(self) -> Field:
        """Both together."""
        return np.asarray(np.hypot(self.misfit, self.lacking))


def brought(blocks: Blocks, joint: Joint, witnesses: Witnesses) -> Brought:
    """What machine and structure bring to each recording's own parameters."""
    relative, _ = shares_of(blocks, joint.parameters)
    weighted = relative * blocks.weight[:, None]
    # what a relative change of a recording's spectrum in each block does to each of its own
    # parameters
    influence = np.linalg.solve(weighted @ relative.swapaxes(1, 2) + LOOSE * np.eye(4), weighted)
    spacing = joint.parameters.transfer.spacing_hz
    return Brought(
        _misfit_std(influence * relative[:, None, 3], witnesses),
        _lacking_std(blocks.centre, relative[:, 0] ** 2, influence, spacing, witnesses),
    )


def _misfit_std(felt: Field, witnesses: Witnesses) -> Field:
    """Of a machine that does not quite repeat itself, whose changes are `felt` so by each parameter.

    What the fit of one recording would make of the residuals that the others have where its line
    lies: its influence a_b on each parameter, applied to r_jb of those recordings j whose own line
    is far; squared, averaged over them, less what chance explains.
    """
    squares = felt**2
    moved = (felt @ witnesses.change.T) ** 2
    expected_of_chance = squares @ witnesses.by_chance.T
    whole = squares @ witnesses.counts.T.astype(float)
    # a witness has to cover nearly all that matters; the less chance blurs it, the more it counts
    enough = whole > WITNESS_FROM * np.sum(squares, axis=2)[:, :, None]
    witness = enough / np.maximum(expected_of_chance, TINY) ** 2
    variance = np.sum((moved - expected_of_chance) * witness, axis=2) / np.maximum(
        np.sum(witness, axis=2), TINY
    )
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)))


def _lacking_std(
    centre: Field, line: Field, influence: Field, spacing_hz: float, witnesses: Witnesses
) -> Field:
    """Of a structure that the splines of its transfer do not follow; `line` is the line's share, squared.

    What fits leave where a line lies shows how far the model is off there. What it took up instead
    is taken to be as large, and the less alike the further apart, up to a spline's spacing, as
    what is slower is followed.
    """
    square = np.maximum(line @ witnesses.lacking / np.maximum(line.sum(axis=1), TINY), 0.0)
    felt = np.sum(influence @ _alike(centre.tobytes(), spacing_hz) * influence, axis=2)
    return np.asarray(np.sqrt(square[:, None] * np.maximum(felt, 0.0)))


@lru_cache(maxsize=4)
def _alike(centres: bytes, spacing_hz: float) -> Field:
    """How alike blocks are, by how far their centres are apart: a series asks for the same ones each time."""
    centre = np.frombuffer(centres)
    alike = np.maximum(1.0 - np.abs(centre[:, None] - centre) / spacing_hz, 0.0)
    alike.flags.writeable = False
    return alike


def left_over(blocks: Blocks, expected: Field) -> Field:
    """Rms of what a fit leaves of each recording's spectrum, relative, beyond chance."""
    counted = blocks.weight > 0.0
    off = blocks.density / expected - 1.0
    excess = np.sum(counted * (off**2 - 1.0 / np.maximum(blocks.weight, 1.0)), axis=1) / np.sum(
        counted, axis=1
    )
    return np.asarray(np.sqrt(np.maximum(excess, 0.0)))
