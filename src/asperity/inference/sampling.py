"""Samples of a posterior: importance sampling that learns where the posterior is, and nested sampling to check it by.

Unknowns are standard normal before any recording. What a proposal costs is the emulator; so every
draw is kept, and counts for each target that is asked of it.
"""

from collections.abc import Callable, Sequence
from copy import copy, deepcopy
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.special import logsumexp, ndtri

from asperity.core.arrays import Field
from asperity.core.errors import BadInput

FIRST, BATCH, ROUNDS = 4096, 2048, 30  # draws from the prior, and of each round after it
ENOUGH = 1000.0  # effective samples: a quantile is then known to a twentieth of the width
QUICKLY = 200.0  # of one recording more
FEWEST = 60.0  # below it a posterior was not found
CENTRES = 40  # of a proposal
# effective samples that a proposal is learnt from, at least: the target is flattened until then
LEARNT_FROM = 150.0
NARROWER = 0.6  # width of a proposal's parts over the width of the whole
FROM_PRIOR = 0.1
HOPELESS = 40.0  # in ln evidence below another model, and no more draws are spent on it
RULED_OUT = 12.0  # likewise, and it need not be found: odds of 160 000 to one
PROBED = 4  # rounds before that is believed
NEGLIGIBLE = 1e-5  # weight over the largest, of a draw that need not be kept
LIVE = 400  # points of nested sampling

Target = Callable[[Any], Field]  # what was computed for draws, to the logarithm of their likelihood
Evaluate = Callable[
    [Field], Any
]  # unknowns (n, d) to whatever a target is computed from; indexable by rows


@dataclass
class Pool:
    """Draws from several proposals, and what was computed for each.

    Parameters
    ----------
    evaluate : unknowns to what the targets take
    join, take : results of two calls to one; rows of a result
    dims : unknowns
    seed : of all draws
    """

    evaluate: Evaluate
    join: Callable[[Any, Any], Any]
    take: Callable[[Any, Any], Any]
    dims: int
    seed: int
    z: Field = field(init=False)
    shown: Any = field(init=False)
    proposals: list[tuple[int, Callable[[Field], Field]]] = field(init=False)

    def __post_init__(self) -> None:
        from scipy.stats import qmc

        self.rng = np.random.default_rng([self.seed, 1])
        uniform = qmc.Sobol(self.dims, rng=np.random.default_rng([self.seed, 2])).random(FIRST)
        self.z = ndtri(np.clip(uniform, 1e-9, 1.0 - 1e-9))
        self.shown = self.evaluate(self.z)
        self.proposals = [(FIRST, _log_normal)]
        self._log_proposed = _log_normal(self.z) + np.log(FIRST)

    @property
    def drawn(self) -> int:
        """How many draws there were, those included that were left out since."""
        return sum(count for count, _ in self.proposals)

    def reduced(self, targets: Sequence[Field]) -> "Pool":
        """Only the draws that count for one of these targets."""
        counts = np.zeros(len(self.z), dtype=bool)
        for target in targets:
            weights = self.log_weights(target)
            counts |= weights >= weights.max() + np.log(NEGLIGIBLE)
        other = self.with_columns(self.evaluate, self.take(self.shown, counts))
        other.z, other._log_proposed = self.z[counts], self._log_proposed[counts]
        return other

    def with_columns(self, evaluate: Evaluate, shown: Any) -> "Pool":
        """The same draws with something else computed for each."""
        other = copy(self)
        other.evaluate, other.shown, other.proposals = evaluate, shown, list(self.proposals)
        other.rng = deepcopy(self.rng)
        return other

    def log_weights(self, log_target: Field) -> Field:
        """Logarithms of importance weights, whose mean is the evidence."""
        return np.asarray(
            log_target + _log_normal(self.z) - (self._log_proposed - np.log(self.drawn))
        )

    def learn(self, log_weights: Field) -> None:
        """Draw another batch where the weights are."""
        proposal, drawn = _proposal(self.z, _flattened(log_weights), self.rng)
        self._log_proposed = np.logaddexp(self._log_proposed, proposal(self.z) + np.log(BATCH))
        earlier = np.stack([np.log(count) + density(drawn) for count, density in self.proposals])
        here = np.logaddexp(logsumexp(earlier, axis=0), proposal(drawn) + np.log(BATCH))
        self._log_proposed = np.concatenate([self._log_proposed, here])
        self.z = np.concatenate([self.z, drawn])
        self.shown = self.join(self.shown, self.evaluate(drawn))
        self.proposals.append((BATCH, proposal))


@dataclass(frozen=True)
class WeightedSamples:
    """A posterior as weighted draws: `z` (n, d), `weights` that sum to 1, ln evidence and its deviation."""

    z: Field
    weights: Field
    log_evidence: float
    log_evidence_std: float
    log_likelihood: Field

    @property
    def effective(self) -> float:
        """How many independent draws it is worth."""
        return float(1.0 / np.sum(self.weights**2))

    @property
    def information_bits(self) -> float:
        """What was learned of all unknowns together: the mean of ln L over the posterior, less ln evidence."""
        told = self.weights > 0.0
        return max(
            float(
                (self.weights[told] @ self.log_likelihood[told] - self.log_evidence) / np.log(2.0)
            ),
            0.0,
        )


def importance(
    pool: Pool,
    log_target: Target,
    *,
    enough: float = ENOUGH,
    rounds: int = ROUNDS,
    best: float = -np.inf,
    probed: int = PROBED,
    least: float = 0.0,
    longest: int = 0,
) -> WeightedSamples:
    """Sample a target from better and better proposals, until the draws are worth `enough` or for so many rounds.

    `best` is the ln evidence of another model: beside one that is far better, no draws are spent
    after `probed` rounds. Where draws are worth less than `least` after all rounds, and the model
    is not ruled out, it goes on for `longest`.
    """
    target: Field = np.empty(0)
    for number in range(max(rounds, longest) + 1):
        fresh = pool.take(pool.shown, slice(len(target), None))
        target = np.concatenate([target, log_target(fresh)])
        weights = pool.log_weights(target)
        behind = best - (float(logsumexp(weights)) - np.log(pool.drawn))
        hopeless = number >= probed and behind > HOPELESS
        found = number >= rounds and (_effective(weights) >= least or behind > RULED_OUT)
        if _effective(weights) >= enough or hopeless or found or number >= max(rounds, longest):
            break
        pool.learn(weights)
    peak = float(logsumexp(weights))
    normal = np.exp(weights - peak)
    relative = np.sqrt(max(float(np.sum(normal**2)) - 1.0 / pool.drawn, 0.0))
    return WeightedSamples(
        pool.z, normal, peak - float(np.log(pool.drawn)), float(relative), target
    )


def nested(evaluate: Evaluate, log_target: Target, dims: int, seed: int) -> WeightedSamples:
    """The same by nested sampling (dynesty), which finds what importance sampling may miss, and takes longer.

    Raises
    ------
    BadInput
        without dynesty.
    """
    try:
        import dynesty
    except ModuleNotFoundError:
        raise BadInput(
            "nested sampling needs dynesty, which is not installed; pip install 'asperity[infer]'"
        ) from None
    sampler = dynesty.NestedSampler(
        lambda z: float(log_target(evaluate(z[None]))[0]),
        lambda share: ndtri(np.clip(share, 1e-9, 1.0 - 1e-9)),
        dims,
        nlive=LIVE,
        sample="rwalk",
        rstate=np.random.default_rng([seed, 3]),
    )
    sampler.run_nested(dlogz=0.1, print_progress=False)
    results = sampler.results
    weights = np.exp(results.logwt - results.logz[-1])
    return WeightedSamples(
        np.asarray(results.samples),
        weights / weights.sum(),
        float(results.logz[-1]),
        float(results.logzerr[-1]),
        np.asarray(results.logl),
    )


def _log_normal(z: Field) -> Field:
    return np.asarray(-0.5 * np.sum(z**2, axis=1) - 0.5 * z.shape[1] * np.log(2.0 * np.pi))


def _effective(log_weights: Field) -> float:
    return float(np.exp(2.0 * logsumexp(log_weights) - logsumexp(2.0 * log_weights)))


def _flattened(log_weights: Field) -> Field:
    """Normalised weights, of a target flattened until draws are worth enough to learn from."""
    power = 1.0
    while _effective(power * log_weights) < LEARNT_FROM and power > 1e-6:
        power *= 0.8
    return np.asarray(np.exp(power * log_weights - logsumexp(power * log_weights)))


def _proposal(
    z: Field, weights: Field, rng: np.random.Generator
) -> tuple[Callable[[Field], Field], Field]:
    """Normals about draws taken by their weights, the prior beside them; its density's logarithm, and a batch of it."""
    mean = weights @ z
    covariance = (weights[:, None] * (z - mean)).T @ (z - mean)
    covariance = NARROWER**2 * covariance + 1e-4 * np.eye(len(mean))
    centres = z[rng.choice(len(z), CENTRES, p=weights)]
    lower = np.linalg.cholesky(covariance)
    log_norm = -np.sum(np.log(np.diag(lower))) - 0.5 * len(mean) * np.log(2.0 * np.pi)
    inverse = np.linalg.inv(lower)
    whitened = centres @ inverse.T

    def density(at: Field) -> Field:
        own = at @ inverse.T
        minus = own @ whitened.T  # of half the square of the distance to each centre, in place
        minus -= 0.5 * np.sum(whitened**2, axis=1)
        minus -= 0.5 * np.sum(own**2, axis=1)[:, None]
        peak = minus.max(axis=1)
        minus -= peak[:, None]
        parts = peak + np.log(np.exp(minus, out=minus).mean(axis=1)) + log_norm
        return np.asarray(
            np.logaddexp(np.log1p(-FROM_PRIOR) + parts, np.log(FROM_PRIOR) + _log_normal(at))
        )

    drawn = (
        centres[rng.integers(CENTRES, size=BATCH)]
        + rng.standard_normal((BATCH, len(mean))) @ lower.T
    )
    anywhere = rng.random(BATCH) < FROM_PRIOR
    drawn[anywhere] = rng.standard_normal((int(anywhere.sum()), len(mean)))
    return density, drawn
