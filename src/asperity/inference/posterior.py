"""Posteriors of all models: draws of unknowns with the contact's state.

A model is a spring law with or without a discrepancy term. Models are weighted by their evidence.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from asperity.core.arrays import Field, Mask
from asperity.core.documents import JsonObject
from asperity.core.errors import AsperityError
from asperity.inference.forward import LAWS, MIN_SHARE, ChannelPrediction, ForwardModel, Law
from asperity.inference.likelihood import (
    SIZES,
    WEIGHTS,
    emulated_errors,
    law_errors,
    log_at_sizes,
    log_likelihood,
    measured_channel,
)
from asperity.inference.observations import ObservationPoint, point_similarity
from asperity.inference.outputs import CAR, CLR, FILM, FRICTION, OUTPUTS
from asperity.inference.sampling import (
    ENOUGH,
    FEWEST,
    PROBED,
    QUICK_ENOUGH,
    RULED_OUT,
    Pool,
    WeightedSamples,
    importance,
    nested,
)

Sampler = Literal["importance", "nested"]
ContactPool: TypeAlias = Pool[ChannelPrediction]
DRAWS = 2000  # equally probable draws of a posterior
STATE = (CLR, CAR, FILM, FRICTION)
MODELS: tuple[tuple[Law, bool], ...] = tuple(
    (law, discrepancy) for law in LAWS for discrepancy in (True, False)
)


@dataclass(frozen=True)
class ModelEvidence:
    """Evidence and posterior probability of a model: a law with or without discrepancy."""

    law: Law
    discrepancy: bool
    log_evidence: float
    log_evidence_std: float
    probability: float
    information_bits: float
    effective: float

    def scalars(self) -> JsonObject:
        """Return the JSON output of the model."""
        return dict(vars(self))


@dataclass(frozen=True)
class Draws:
    """Equally probable contacts: unknowns z (n, dims), law, and states (n, points) in own units.

    `sizes` are the law's errors of each draw in ln CRF, ln ζ and ln CRFA; `effective` is the
    effective sample size.
    """

    z: Field
    law: Field  # index in LAWS
    sizes: Mapping[str, Field]
    states: Mapping[str, Field]
    effective: float

    def select_rows(self, rows: NDArray[np.intp]) -> "Draws":
        """Return the draws of some rows."""
        sizes, states = (
            {key: values[rows] for key, values in columns.items()}
            for columns in (self.sizes, self.states)
        )
        return replace(self, z=self.z[rows], law=self.law[rows], sizes=sizes, states=states)


def sample_models(
    forward: ForwardModel,
    pools: Mapping[Law, ContactPool],
    *,
    sampler: Sampler,
    seed: int,
    quickly: bool = False,
) -> tuple[tuple[ModelEvidence, ...], dict[tuple[Law, bool], WeightedSamples]]:
    """Sample every model and return its evidence; `quickly` needs fewer effective draws.

    Raises
    ------
    AsperityError
        if the posterior of a relevant model was not found.
    """
    forward = forward.observed
    sampled: dict[tuple[Law, bool], WeightedSamples] = {}
    required, probed = (QUICK_ENOUGH, 0) if quickly else (ENOUGH, PROBED)
    best = -np.inf
    for law, discrepancy in _by_likelihood(forward, pools):
        target = _target(forward.points, discrepancy=discrepancy)
        if sampler == "nested":
            samples = nested(_evaluate(forward, law), target, forward.dims, seed)
        else:
            samples = importance(pools[law], target, best=best, enough=required, probed=probed)
        sampled[law, discrepancy], best = samples, max(best, samples.log_evidence)
    for (law, _), samples in sampled.items():
        if samples.effective < FEWEST and samples.log_evidence > best - RULED_OUT:
            raise AsperityError(
                f"the posterior of the law {law} was not found: effective sample size "
                f"{samples.effective:.0f}; use nested sampling or wider priors"
            )
    return _evidence(sampled), sampled


def _evidence(sampled: Mapping[tuple[Law, bool], WeightedSamples]) -> tuple[ModelEvidence, ...]:
    """Return the evidence of each model and its posterior probability."""
    total = logsumexp([samples.log_evidence for samples in sampled.values()])
    return tuple(
        ModelEvidence(
            law,
            discrepancy,
            samples.log_evidence,
            samples.log_evidence_std,
            float(np.exp(samples.log_evidence - total)),
            samples.information_bits,
            samples.effective,
        )
        for (law, discrepancy), samples in sorted(
            sampled.items(), key=lambda entry: MODELS.index(entry[0])
        )
    )


def _by_likelihood(
    forward: ForwardModel, pools: Mapping[Law, ContactPool]
) -> list[tuple[Law, bool]]:
    """Return the models by their largest likelihood so far, so that poor models need few draws."""

    def likelihood(model: tuple[Law, bool]) -> float:
        return float(_target(forward.points, discrepancy=model[1])(pools[model[0]].outputs).max())

    return sorted(MODELS, key=likelihood, reverse=True)


def _target(
    points: tuple[ObservationPoint, ...], *, discrepancy: bool
) -> Callable[[ChannelPrediction], Field]:
    return lambda prediction: log_likelihood(prediction, points, discrepancy=discrepancy)


def _evaluate(forward: ForwardModel, law: Law) -> Callable[[Field], ChannelPrediction]:
    return lambda z: forward.predict(z, law)


def new_pools(forward: ForwardModel, seed: int) -> dict[Law, ContactPool]:
    """Draw from the prior for each law."""
    return {
        law: Pool(_evaluate(forward.observed, law), join_rows, select_rows, forward.dims, seed)
        for law in LAWS
    }


def with_point(
    pools: Mapping[Law, ContactPool], forward: ForwardModel, added: ForwardModel
) -> dict[Law, ContactPool]:
    """Return the relevant draws with one more operating point; `forward` has all points."""
    extended, forward = {}, forward.observed
    previous = forward.points[: -len(added.points)]
    for law, complete in pools.items():
        pool = complete.reduced(
            [_target(previous, discrepancy=flag)(complete.outputs) for flag in (True, False)]
        )
        outputs = added.predict(pool.z, law)
        columns = ChannelPrediction(
            *(np.hstack(pair) for pair in zip(pool.outputs, outputs, strict=True))
        )
        extended[law] = pool.with_columns(_evaluate(forward, law), columns)
    return extended


Columns = TypeVar("Columns", bound=tuple[Field, ...])


def select_rows(columns: Columns, rows: Mask | slice) -> Columns:
    """Return some rows of each column."""
    return type(columns)(*(column[rows] for column in columns))


def join_rows(first: Columns, second: Columns) -> Columns:
    """Concatenate the rows of two results."""
    return type(first)(*(np.concatenate(pair) for pair in zip(first, second, strict=True)))


# Draws
# ----------------------------------------------------------------------


def posterior_draws(
    forward: ForwardModel,
    sampled: Mapping[tuple[Law, bool], WeightedSamples],
    *,
    discrepancy: bool,
    seed: int,
) -> Draws:
    """Draw equally probable contacts from both laws, weighted by evidence."""
    rng = np.random.default_rng([seed, 4, discrepancy])
    both = [sampled[law, discrepancy] for law in LAWS]
    total = logsumexp([samples.log_evidence for samples in both])
    shares = np.exp([samples.log_evidence - total for samples in both])
    counts = np.round(DRAWS * shares).astype(int)
    parts = [
        _draw(forward, law, samples, int(count), rng, discrepancy=discrepancy)
        for law, samples, count in zip(LAWS, both, counts, strict=True)
        if count
    ]
    effective = float(
        1.0
        / np.sum(
            [share**2 / samples.effective for share, samples in zip(shares, both, strict=True)]
        )
    )
    return replace(_joined_draws(parts), effective=effective)


def emulated_share(forward: ForwardModel, draws: Draws) -> float:
    """Return the emulator's share of CLR's posterior variance on its scale, at the case's point."""
    _, std = replace(forward, points=forward.points[:1]).emulate(draws.z, [CLR])[CLR]
    total = float(np.var(OUTPUTS[CLR].forward(draws.states[CLR][:, 0])))
    return min(float(np.mean(std**2)) / total, 1.0)


def posterior_shares(forward: ForwardModel, draws: Draws, count: int, seed: int) -> Field:
    """Draw emulator inputs (count, ranges) from the posterior, cycling through the points."""
    rng = np.random.default_rng([seed, 6])
    chosen = forward.shares(draws.z[rng.permutation(len(draws.z))[:count]])
    return np.asarray(chosen[np.arange(len(chosen)), np.arange(len(chosen)) % len(forward.points)])


def prior_draws(forward: ForwardModel, seed: int, known: Draws | None = None) -> Draws:
    """Draw contacts from the prior, or extend `known` draws by further operating points."""
    present = 0 if known is None else known.states[CLR].shape[1]
    rng = np.random.default_rng([seed, 5, *([present] if present else [])])
    z = rng.standard_normal((DRAWS, forward.dims)) if known is None else known.z
    states = {}
    if present < len(forward.points):
        emulated = replace(forward, points=forward.points[present:]).emulate(z, STATE)
        states = {
            key: OUTPUTS[key].back(mean + std * rng.standard_normal(mean.shape))
            for key, (mean, std) in emulated.items()
        }
    if known is not None:
        states = {
            key: np.hstack([known.states[key], *([states[key]] if states else [])]) for key in STATE
        }
    return Draws(
        z, np.zeros(DRAWS, int), dict.fromkeys(WEIGHTS, np.zeros(DRAWS)), states, float(DRAWS)
    )


def _draw(
    forward: ForwardModel,
    law: Law,
    sampled: WeightedSamples,
    count: int,
    rng: np.random.Generator,
    *,
    discrepancy: bool,
) -> Draws:
    z = sampled.resample(count, rng)
    emulated = forward.emulate(z, tuple(dict.fromkeys((*STATE, *forward.required_outputs(law)))))
    prediction = forward.predict_from(z, law, emulated)
    none = dict.fromkeys(WEIGHTS, np.zeros(count))
    sizes = _sizes(prediction, forward.points, rng) if discrepancy else none
    states = {}
    for key in STATE:
        mean, std = emulated[key]
        if key == CLR and law == "hertz-point":
            scaled = _corrected(mean, std, prediction, forward.points, sizes["crf"], rng)
        else:
            scaled = mean + std * rng.standard_normal(mean.shape)
        states[key] = OUTPUTS[key].back(scaled)
    return Draws(z, np.full(count, LAWS.index(law)), sizes, states, sampled.effective)


def _sizes(
    prediction: ChannelPrediction, points: tuple[ObservationPoint, ...], rng: np.random.Generator
) -> dict[str, Field]:
    """Draw the sizes of the law's errors for each contact from their posterior."""
    sizes = {}
    for channel, weight in WEIGHTS.items():
        logs = log_at_sizes(prediction, points, channel)
        shares = np.exp(logs - logsumexp(logs, axis=0))
        index = np.sum(np.cumsum(shares, axis=0) < rng.random(shares.shape[1]), axis=0)
        sizes[channel] = weight * np.array(SIZES)[np.minimum(index, len(SIZES) - 1)]
    return sizes


def _corrected(
    mean: Field,
    std: Field,
    prediction: ChannelPrediction,
    points: tuple[ObservationPoint, ...],
    size: Field,
    rng: np.random.Generator,
) -> Field:
    """Draw load shares with the emulator's error conditional on all CRF, on CLR's scale.

    By Matheron's rule: a joint draw of shares and frequencies is corrected by the difference of
    the measured frequencies from it.
    """
    measured, measured_std = measured_channel(points, "crf")
    observed = ~np.isnan(measured)
    similarity = point_similarity(points)
    emulator = emulated_errors("crf", std, similarity)
    errors = _draw_normal(emulator, rng)
    if not observed.any():
        return mean + errors
    share = OUTPUTS[CLR].back(mean)
    # d ln CRF / d scale
    slope = (1.0 / (6.0 * np.maximum(share, MIN_SHARE) * OUTPUTS[CLR].slope(share)))[:, observed]
    law = law_errors(
        "crf", prediction.log_force[:, observed], size, similarity[np.ix_(observed, observed)]
    )
    noise = law + np.diag(measured_std[observed] ** 2)
    across = emulator[:, :, observed] * slope[:, None]  # covariance of shares and frequencies
    total = across[:, observed] * slope[:, :, None] + noise
    residual = (
        (measured - prediction.crf)[:, observed]
        - slope * errors[:, observed]
        - _draw_normal(noise, rng)
    )
    correction = across @ np.linalg.solve(total, residual[:, :, None])
    return np.asarray(mean + errors + correction[:, :, 0])


def _draw_normal(covariance: Field, rng: np.random.Generator) -> Field:
    """Draw from a zero-mean normal distribution for each covariance, (n, points)."""
    count, points, _ = covariance.shape
    lower = np.linalg.cholesky(covariance + 1e-12 * np.eye(points))
    return np.asarray((lower @ rng.standard_normal((count, points, 1)))[:, :, 0])


def _joined_draws(parts: list[Draws]) -> Draws:
    return Draws(
        np.concatenate([part.z for part in parts]),
        np.concatenate([part.law for part in parts]),
        {key: np.concatenate([part.sizes[key] for part in parts]) for key in WEIGHTS},
        {key: np.concatenate([part.states[key] for part in parts]) for key in STATE},
        sum(part.effective for part in parts),
    )
