"""Posterior sampling: adaptive importance sampling, and nested sampling as a check.

The prior of all unknowns is standard normal. Evaluating the emulator dominates the cost, so every
draw is kept and reused for all targets.
"""

from collections.abc import Callable, Sequence
from copy import copy, deepcopy
from dataclasses import dataclass, field
from typing import Generic, TypeVar

import numpy as np
from scipy.special import logsumexp, ndtri
from threadpoolctl import threadpool_limits

from asperity.core.arrays import Field, Mask
from asperity.core.errors import BadInput, install_text

FIRST, BATCH, ROUNDS = 4096, 2048, 30  # draws from the prior, draws per round, rounds
ENOUGH = 1000.0  # effective sample size: the error of a quantile is 1/20 of the width
QUICK_ENOUGH = 200.0  # effective sample size for one more recording
FEWEST = 60.0  # effective sample size below which a posterior was not found
CENTRES = 40  # components of a proposal
MIN_EFFECTIVE = 150.0  # effective sample size of a proposal; the target is tempered to reach it
COMPONENT_WIDTH = 0.6  # width of a proposal's components relative to the whole
PRIOR_WEIGHT = 0.1  # of the prior in a proposal
HOPELESS = 40.0  # deficit in ln evidence from which on no more draws are spent on a model
RULED_OUT = 12.0  # deficit from which on a model counts as ruled out: odds of 160 000 to one
PROBED = 4  # rounds before a model may be ruled out
NEGLIGIBLE = 1e-5  # weight relative to the largest, below which a draw is dropped
LIVE_POINTS = 400  # of nested sampling

Outputs = TypeVar("Outputs")  # of draws: the inputs of targets
Target = Callable[[Outputs], Field]  # outputs of draws to log-likelihoods
Evaluate = Callable[[Field], Outputs]  # unknowns (n, d) to outputs


@dataclass
class Pool(Generic[Outputs]):
    """Draws from several proposals, and the outputs computed for each.

    Parameters
    ----------
    evaluate : maps unknowns to the outputs that targets use
    join, take : concatenate two outputs; select rows of an output
    dims : number of unknowns
    seed : random seed
    """

    evaluate: Evaluate[Outputs]
    join: Callable[[Outputs, Outputs], Outputs]
    take: Callable[[Outputs, Mask | slice], Outputs]
    dims: int
    seed: int
    z: Field = field(init=False)
    outputs: Outputs = field(init=False)
    proposals: list[tuple[int, Callable[[Field], Field]]] = field(init=False)

    def __post_init__(self) -> None:
        from scipy.stats import qmc

        self.rng = np.random.default_rng([self.seed, 1])
        uniform = qmc.Sobol(self.dims, rng=np.random.default_rng([self.seed, 2])).random(FIRST)
        self.z = ndtri(np.clip(uniform, 1e-9, 1.0 - 1e-9))
        self.outputs = self.evaluate(self.z)
        self.proposals = [(FIRST, _log_normal)]
        self._log_proposed = _log_normal(self.z) + np.log(FIRST)

    @property
    def drawn(self) -> int:
        """Number of draws, including those dropped since."""
        return sum(count for count, _ in self.proposals)

    def reduced(self, targets: Sequence[Field]) -> "Pool[Outputs]":
        """Return a pool of only the draws relevant for one of these targets."""
        counts = np.zeros(len(self.z), dtype=bool)
        for target in targets:
            weights = self.log_weights(target)
            counts |= weights >= weights.max() + np.log(NEGLIGIBLE)
        other = self.with_columns(self.evaluate, self.take(self.outputs, counts))
        other.z, other._log_proposed = self.z[counts], self._log_proposed[counts]
        return other

    def with_columns(self, evaluate: Evaluate[Outputs], outputs: Outputs) -> "Pool[Outputs]":
        """Return the same draws with other outputs."""
        other = copy(self)
        other.evaluate, other.outputs, other.proposals = evaluate, outputs, list(self.proposals)
        other.rng = deepcopy(self.rng)
        return other

    def log_weights(self, log_target: Field) -> Field:
        """Return ln importance weights; the mean weight is the evidence."""
        return np.asarray(
            log_target + _log_normal(self.z) - (self._log_proposed - np.log(self.drawn))
        )

    def learn(self, log_weights: Field) -> None:
        """Draw another batch from a proposal fitted to the weights."""
        proposal = _Proposal.from_draws(self.z, _tempered(log_weights), self.rng)
        drawn = proposal.draw(self.rng)
        self._log_proposed = np.logaddexp(self._log_proposed, proposal(self.z) + np.log(BATCH))
        earlier = np.stack([np.log(count) + density(drawn) for count, density in self.proposals])
        log_drawn = np.logaddexp(logsumexp(earlier, axis=0), proposal(drawn) + np.log(BATCH))
        self._log_proposed = np.concatenate([self._log_proposed, log_drawn])
        self.z = np.concatenate([self.z, drawn])
        self.outputs = self.join(self.outputs, self.evaluate(drawn))
        self.proposals.append((BATCH, proposal))


@dataclass(frozen=True)
class WeightedSamples:
    """A posterior as weighted draws: `z` (n, d), normalised `weights`, ln evidence and error."""

    z: Field
    weights: Field
    log_evidence: float
    log_evidence_std: float
    log_likelihood: Field

    def resample(self, count: int, rng: np.random.Generator) -> Field:
        """Draw equally probable unknowns (count, d) by systematic resampling."""
        levels = (rng.random() + np.arange(count)) / count
        rows = np.searchsorted(np.cumsum(self.weights), levels)
        return np.asarray(self.z[np.minimum(rows, len(self.weights) - 1)])

    @property
    def effective(self) -> float:
        """Effective sample size."""
        return float(1.0 / np.sum(self.weights**2))

    @property
    def information_bits(self) -> float:
        """Information gain on all unknowns: posterior mean of ln L minus ln evidence, in bits."""
        used = self.weights > 0.0
        return max(
            float(
                (self.weights[used] @ self.log_likelihood[used] - self.log_evidence) / np.log(2.0)
            ),
            0.0,
        )


def importance(
    pool: Pool[Outputs],
    log_target: Target[Outputs],
    *,
    enough: float = ENOUGH,
    rounds: int = ROUNDS,
    best: float = -np.inf,
    probed: int = PROBED,
    least: float = 0.0,
    longest: int = 0,
) -> WeightedSamples:
    """Sample a target adaptively until the effective sample size is `enough`.

    Parameters
    ----------
    pool : draws so far; further ones are added
    log_target : outputs to log-likelihoods
    enough : effective sample size to reach
    rounds : maximum number of rounds
    best : ln evidence of the best other model
    probed : rounds after which sampling stops if the model is far worse than `best`
    least : effective sample size to reach even in more rounds, unless the model is ruled out
    longest : maximum number of rounds to reach `least`
    """
    target: Field = np.empty(0)
    with threadpool_limits(1, "blas"):  # the matrices are too small for several threads
        for number in range(max(rounds, longest) + 1):
            fresh = pool.take(pool.outputs, slice(len(target), None))
            target = np.concatenate([target, log_target(fresh)])
            weights = pool.log_weights(target)
            deficit = best - (float(logsumexp(weights)) - np.log(pool.drawn))
            rejected = number >= probed and deficit > HOPELESS
            done = number >= rounds and (_effective(weights) >= least or deficit > RULED_OUT)
            if _effective(weights) >= enough or rejected or done or number >= max(rounds, longest):
                break
            pool.learn(weights)
    peak = float(logsumexp(weights))
    normal = np.exp(weights - peak)
    relative = np.sqrt(max(float(np.sum(normal**2)) - 1.0 / pool.drawn, 0.0))
    return WeightedSamples(
        pool.z, normal, peak - float(np.log(pool.drawn)), float(relative), target
    )


def nested(
    evaluate: Evaluate[Outputs], log_target: Target[Outputs], dims: int, seed: int
) -> WeightedSamples:
    """Sample a target by nested sampling (dynesty), slower and more robust to several modes.

    Raises
    ------
    BadInput
        without dynesty.
    """
    try:
        import dynesty
    except ModuleNotFoundError:
        raise BadInput(
            f"nested sampling needs dynesty, which is not installed; {install_text('infer')}"
        ) from None
    sampler = dynesty.NestedSampler(
        lambda z: float(log_target(evaluate(z[None]))[0]),
        lambda share: ndtri(np.clip(share, 1e-9, 1.0 - 1e-9)),
        dims,
        nlive=LIVE_POINTS,
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


def _tempered(log_weights: Field) -> Field:
    """Return normalised weights of the target, tempered to a minimum effective sample size."""
    power = 1.0
    while _effective(power * log_weights) < MIN_EFFECTIVE and power > 1e-6:
        power *= 0.8
    return np.asarray(np.exp(power * log_weights - logsumexp(power * log_weights)))


@dataclass(frozen=True)
class _Proposal:
    """Mixture of equal normals around `centres` (n, d), and the prior.

    `lower` is the Cholesky factor of the normals' covariance, `inverse` its inverse.
    """

    centres: Field
    lower: Field
    inverse: Field
    whitened: Field
    log_norm: float

    @classmethod
    def from_draws(cls, z: Field, weights: Field, rng: np.random.Generator) -> "_Proposal":
        """Fit a proposal to weighted draws."""
        mean = weights @ z
        covariance = (weights[:, None] * (z - mean)).T @ (z - mean)
        covariance = COMPONENT_WIDTH**2 * covariance + 1e-4 * np.eye(len(mean))
        centres = z[rng.choice(len(z), CENTRES, p=weights)]
        lower = np.linalg.cholesky(covariance)
        log_norm = -np.sum(np.log(np.diag(lower))) - 0.5 * len(mean) * np.log(2.0 * np.pi)
        inverse = np.linalg.inv(lower)
        return cls(centres, lower, inverse, centres @ inverse.T, log_norm)

    def __call__(self, points: Field) -> Field:
        """Return the ln density at points (n, d)."""
        z = points @ self.inverse.T
        exponent = z @ self.whitened.T  # minus half the squared distance to each centre, in place
        exponent -= 0.5 * np.sum(self.whitened**2, axis=1)
        exponent -= 0.5 * np.sum(z**2, axis=1)[:, None]
        peak = exponent.max(axis=1)
        exponent -= peak[:, None]
        parts = peak + np.log(np.exp(exponent, out=exponent).mean(axis=1)) + self.log_norm
        return np.asarray(
            np.logaddexp(
                np.log1p(-PRIOR_WEIGHT) + parts, np.log(PRIOR_WEIGHT) + _log_normal(points)
            )
        )

    def draw(self, rng: np.random.Generator) -> Field:
        """Draw a batch."""
        dims = len(self.lower)
        drawn = (
            self.centres[rng.integers(CENTRES, size=BATCH)]
            + rng.standard_normal((BATCH, dims)) @ self.lower.T
        )
        from_prior = rng.random(BATCH) < PRIOR_WEIGHT
        drawn[from_prior] = rng.standard_normal((int(from_prior.sum()), dims))
        return np.asarray(drawn)
