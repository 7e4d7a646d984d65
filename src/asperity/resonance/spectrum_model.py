"""What parameters say of a series' spectra: a base that all share, and a line beside it in each.

P_i(f) = g_i B(f) + A_i L(f; f_i, ζ_i) T(f)/T(f_i), its -ln likelihood, score and information. How
it is fitted is left to `separation`; docs/theory/indicators.md has the equations.
"""

from typing import NamedTuple

import numpy as np

from asperity.core.arrays import Field
from asperity.resonance.resonance import line_and_slopes, line_shape
from asperity.resonance.transfer import Transfer

USUAL_DAMPING, DAMPING_SPREAD = (
    0.02,
    1.0,
)  # prior of ln ζ: centre, and a factor e either way as standard deviation
LEAST_DAMPING, MOST_DAMPING = 1e-3, 0.3
# information of everything before the data, so that a line of no height has a defined place
LOOSE = 1e-4


class Blocks(NamedTuple):
    """Spectra averaged over blocks of lines: density and independent ordinates (recordings, blocks)."""

    centre: Field  # (blocks,)
    density: Field
    weight: Field


class Parameters(NamedTuple):
    """A_i, f_i, ζ_i, g_i as logarithms (recordings, 4), ln B (blocks,), and what the lines come through."""

    own: Field
    base: Field
    transfer: Transfer = Transfer()


def lines_and_slopes(centre: Field, at: Parameters) -> tuple[Field, Field, Field]:
    """A L T(f)/T(f_i), and its derivatives by ln f_i and ln ζ_i, (recordings, blocks)."""
    f0, damping = (np.exp(at.own[:, column, None]) for column in (1, 2))
    line, by_f0, by_damping = line_and_slopes(centre[None, :], f0, damping)
    passed, steep = _passed(centre, at), at.transfer.steepness(f0[:, 0])[:, None]
    return passed * line, passed * (by_f0 - steep * line), passed * by_damping


def lines(centre: Field, at: Parameters) -> Field:
    """A L T(f)/T(f_i), (recordings, blocks)."""
    f0, damping = (np.exp(at.own[:, column, None]) for column in (1, 2))
    return np.asarray(_passed(centre, at) * line_shape(centre[None, :], f0, damping))


def _passed(centre: Field, at: Parameters) -> Field:
    """A T(f)/T(f_i), (recordings, blocks)."""
    transfer = at.transfer
    here = transfer.columns(np.exp(at.own[:, 1])) @ transfer.coefficients
    return np.asarray(
        np.exp(
            at.own[:, 0, None] + transfer.columns(centre) @ transfer.coefficients - here[:, None]
        )
    )


def away(centre: Field, at: Parameters) -> Field:
    """What the transfer's coefficients stand at, less that at each line's place; (recordings, blocks, coefficients)."""
    here = at.transfer.columns(np.exp(at.own[:, 1]))
    return np.asarray(at.transfer.columns(centre)[None] - here[:, None])


class Point(NamedTuple):
    """Where a scoring step stands: cost, score and information; the base's part and the transfer's apart."""

    cost: float
    own_score: Field  # (recordings, 4)
    own_information: Field  # (recordings, 4, 4)
    base_score: Field  # (blocks,)
    base_information: Field  # (blocks,)
    coupling: Field  # (recordings, 4, blocks)
    passed_score: Field  # (coefficients,)
    passed_information: Field  # (coefficients, coefficients)
    passed_own: Field  # (recordings, 4, coefficients)
    passed_coupling: Field  # (coefficients, blocks)


def expected_density(blocks: Blocks, at: Parameters) -> Field:
    """What the parameters say of each block, (recordings, blocks)."""
    return np.asarray(lines(blocks.centre, at) + np.exp(at.own[:, 3, None] + at.base))


def whittle_costs(blocks: Blocks, expected: Field) -> Field:
    """-ln likelihood of each recording."""
    return np.asarray(
        np.sum(blocks.weight * (np.log(expected) + blocks.density / expected), axis=1)
    )


def costs_at(blocks: Blocks, at: Parameters) -> Field:
    """-ln likelihood of each recording, its prior included."""
    return np.asarray(whittle_costs(blocks, expected_density(blocks, at)) + _prior(at.own))


def _prior(own: Field) -> Field:
    return np.asarray(0.5 * ((own[:, 2] - np.log(USUAL_DAMPING)) / DAMPING_SPREAD) ** 2)


def shares_of(blocks: Blocks, at: Parameters) -> tuple[Field, Field]:
    """What line, place, damping and machine each have in what is expected (recordings, 4, blocks), and that."""
    line, by_f0, by_damping = lines_and_slopes(blocks.centre, at)
    common = np.exp(at.own[:, 3, None] + at.base)
    expected = line + common
    return np.stack([line, by_f0, by_damping, common], axis=1) / expected[:, None], expected


class OwnPoint(NamedTuple):
    """Where a step of lines stands beside a base and a transfer that are known: score and information."""

    score: Field  # (recordings, 4)
    information: Field  # (recordings, 4, 4)
    # (recordings, 4, blocks): what each parameter changes, times the independent ordinates
    weighted: Field
    line: Field  # (recordings, blocks): the line's share

    def passed(self, centre: Field, at: Parameters) -> Field:
        """The parameters' information in common with the transfer's coefficients, (recordings, 4, coefficients)."""
        felt, here = self.weighted * self.line[:, None], at.transfer.columns(np.exp(at.own[:, 1]))
        return np.asarray(
            felt @ at.transfer.columns(centre) - np.sum(felt, axis=2)[..., None] * here[:, None]
        )


def own_at(blocks: Blocks, at: Parameters) -> OwnPoint:
    """Score and information of the lines alone."""
    return _own(blocks, at, *shares_of(blocks, at))[0]


def _own(
    blocks: Blocks, at: Parameters, relative: Field, expected: Field
) -> tuple[OwnPoint, Field]:
    """The lines' score and information; and by how much spectra are off what is expected."""
    off = blocks.weight * (blocks.density / expected - 1.0)
    weighted = relative * blocks.weight[:, None]
    score = np.einsum("npb,nb->np", relative, off)
    score[:, 2] -= (at.own[:, 2] - np.log(USUAL_DAMPING)) / DAMPING_SPREAD**2
    information = weighted @ relative.swapaxes(1, 2) + LOOSE * np.eye(4)
    information[:, 2, 2] += DAMPING_SPREAD**-2
    return OwnPoint(score, information, weighted, relative[:, 0]), off


def point_at(blocks: Blocks, at: Parameters, stiff: Field) -> Point:
    """Cost, score and information at some parameters; `stiff` is the transfer's information before the data."""
    relative, expected = shares_of(blocks, at)
    own, off = _own(blocks, at, relative, expected)
    weighted, base_part = own.weighted, relative[:, 3]
    passed = relative[:, 0, :, None] * away(blocks.centre, at)
    coefficients = at.transfer.coefficients
    flat, weights = (
        passed.reshape(blocks.weight.size, coefficients.size),
        blocks.weight.reshape(-1, 1),
    )
    fit = float(
        np.sum(blocks.weight * (np.log(expected) + blocks.density / expected))
        + np.sum(_prior(at.own))
    )
    return Point(
        cost=fit + 0.5 * float(coefficients @ stiff @ coefficients),
        own_score=own.score,
        own_information=own.information,
        base_score=np.sum(base_part * off, axis=0),
        base_information=np.sum(blocks.weight * base_part**2, axis=0) + LOOSE,
        coupling=weighted * base_part[:, None],
        passed_score=off.ravel() @ flat - stiff @ coefficients,
        passed_information=flat.T @ (weights * flat) + stiff,
        passed_own=np.matmul(weighted, passed),
        passed_coupling=np.einsum("nb,nbc->cb", blocks.weight * base_part, passed, optimize=True),
    )


def bounds_of(blocks: Blocks) -> tuple[Field, Field]:
    """Least and greatest ln A, ln f, ln ζ, ln g."""
    low, high = np.log(0.97 * blocks.centre[0]), np.log(1.03 * blocks.centre[-1])
    return np.array([-60.0, low, np.log(LEAST_DAMPING), -60.0]), np.array(
        [60.0, high, np.log(MOST_DAMPING), 60.0]
    )
