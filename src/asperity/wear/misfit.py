"""What a fit leaves of spectra, and what that makes of deviations.

A machine does not quite repeat itself, a structure is not quite followed. The fit is left to `separation`, what it
means to `series`; docs/theory/indicators.md has the equations.
"""

from typing import NamedTuple

import numpy as np

from asperity.arrays import Field, Mask
from asperity.wear.expected import LOOSE, Blocks, expected_density, lines_and_slopes
from asperity.wear.separation import Joint

COMMON_FROM = 0.1  # share of what all recordings share in a block, from which its residual is the machine's
WITNESS_FROM = 0.8  # of a parameter's influence, that a witness has to cover
TINY = 1e-100


class Witnesses(NamedTuple):
    """How far recordings are from what was fitted to them, relative to what all share; (recordings, blocks) each.

    `lacking` (blocks,) is by how much fits are off there, relative, squared, less chance: of all recordings whose lines
    reach there, the more the stronger they are.
    """

    counts: Mask  # where what all share is most of what is there
    change: Field
    by_chance: Field  # variance that chance brings
    lacking: Field


def shares_of(blocks: Blocks, joint: Joint) -> tuple[Field, Field]:
    """What line, place, damping and machine each have in what is expected (recordings, 4, blocks), and that."""
    line, by_f0, by_damping = lines_and_slopes(blocks.centre, joint.parameters)
    expected = expected_density(blocks, joint.parameters)
    return np.stack([line, by_f0, by_damping, expected - line], axis=1) / expected[:, None], expected


def witnesses_of(blocks: Blocks, joint: Joint, rows: list[int]) -> Witnesses:
    """How far some recordings are from what was fitted to all."""
    relative, expected = shares_of(blocks, joint)
    common = relative[rows, 3]
    counts = (common > COMMON_FROM) & (blocks.weight[rows] > 0.0)
    share = np.where(counts, common, 1.0)
    change = np.where(counts, (blocks.density / expected - 1.0)[rows] / share, 0.0)
    by_chance = np.where(counts, 1.0 / (np.maximum(blocks.weight[rows], 1.0) * share**2), 0.0)
    reached = relative[rows, 0] ** 2 * (blocks.weight[rows] > 0.0)
    beyond = (blocks.density / expected - 1.0)[rows] ** 2 - 1.0 / np.maximum(blocks.weight[rows], 1.0)
    lacking = np.sum(reached * beyond, axis=0) / np.maximum(np.sum(reached, axis=0), TINY)
    return Witnesses(counts, change, by_chance, lacking)


def _influence(blocks: Blocks, relative: Field) -> Field:
    """What a relative change of a recording's spectrum in each block does to each of its own parameters."""
    information = np.einsum("npb,nqb,nb->npq", relative, relative, blocks.weight, optimize=True) + LOOSE * np.eye(4)
    return np.linalg.solve(information, relative * blocks.weight[:, None])


def misfit_std(blocks: Blocks, joint: Joint, witnesses: Witnesses) -> Field:
    """Standard deviations (recordings, 4) that a machine brings which does not quite repeat itself, beside chance.

    What the fit of one recording would make of the residuals that the others have where its line lies: its influence
    a_b on each parameter, applied to r_jb of those recordings j whose own line is far; squared, averaged over them,
    less what chance explains.
    """
    relative, _ = shares_of(blocks, joint)
    felt = _influence(blocks, relative) * relative[:, None, 3]  # what a change of the machine does to each parameter
    moved = np.einsum("npb,jb->npj", felt, witnesses.change, optimize=True) ** 2
    expected_of_chance = np.einsum("npb,jb->npj", felt**2, witnesses.by_chance, optimize=True)
    whole = np.einsum("npb,jb->npj", felt**2, witnesses.counts.astype(float), optimize=True)
    # a witness has to cover nearly all that matters; the less chance blurs it, the more it counts
    enough = whole > WITNESS_FROM * np.sum(felt**2, axis=2)[:, :, None]
    witness = enough / np.maximum(expected_of_chance, TINY) ** 2
    variance = np.sum((moved - expected_of_chance) * witness, axis=2) / np.maximum(np.sum(witness, axis=2), TINY)
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)))


def lacking_std(blocks: Blocks, joint: Joint, witnesses: Witnesses) -> Field:
    """Standard deviations (recordings, 4) that a structure brings which the splines of its transfer do not follow.

    What fits leave where a line lies shows how far the model is off there. What it took up instead is taken to be as
    large, and the less alike the further apart, up to a spline's spacing, as what is slower is followed.
    """
    relative, _ = shares_of(blocks, joint)
    line = relative[:, 0] ** 2
    square = np.maximum(line @ witnesses.lacking / np.maximum(line.sum(axis=1), TINY), 0.0)
    apart = np.abs(blocks.centre[:, None] - blocks.centre) / joint.parameters.transfer.spacing_hz
    influence = _influence(blocks, relative)
    felt = np.sum(influence @ np.maximum(1.0 - apart, 0.0) * influence, axis=2)
    return np.asarray(np.sqrt(square[:, None] * np.maximum(felt, 0.0)))


def brought_std(blocks: Blocks, joint: Joint, witnesses: Witnesses) -> Field:
    """Standard deviations (recordings, 4) of all that chance does not bring."""
    return np.hypot(misfit_std(blocks, joint, witnesses), lacking_std(blocks, joint, witnesses))


def left_over(blocks: Blocks, expected: Field) -> Field:
    """Rms of what a fit leaves of each recording's spectrum, relative, beyond chance."""
    counted = blocks.weight > 0.0
    off = blocks.density / expected - 1.0
    excess = np.sum(counted * (off**2 - 1.0 / np.maximum(blocks.weight, 1.0)), axis=1) / np.sum(counted, axis=1)
    return np.asarray(np.sqrt(np.maximum(excess, 0.0)))
