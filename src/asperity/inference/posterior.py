"""Posteriors of all models, and what contacts they leave possible: draws of unknowns with the contact's state.

A model is a law of the contact's spring, with or without a term for its error. Models are weighed
by their evidence.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeVar

import numpy as np
from scipy.special import logsumexp

from asperity.core.arrays import Field
from asperity.core.errors import AsperityError
from asperity.inference.forward import LAWS, LEAST_SHARE, ChannelPrediction, Forward, Law
from asperity.inference.likelihood import (
    SIZES,
    WEIGHTS,
    emulated_errors,
    law_errors,
    log_at_sizes,
    log_likelihood,
)
from asperity.inference.observations import OperatingPoint, point_similarity
from asperity.inference.outputs import CAR, CLR, FILM, FRICTION, OUTPUTS
from asperity.inference.sampling import (
    FEWEST,
    QUICKLY,
    RULED_OUT,
    Pool,
    WeightedSamples,
    importance,
    nested,
)

Sampler = Literal["importance", "nested"]
DRAWS = 2000  # equally probable ones, of each posterior
STATE = (CLR, CAR, FILM, FRICTION)
MODELS: tuple[tuple[Law, bool], ...] = tuple(
    (law, discrepancy) for law in LAWS for discrepancy in (True, False)
)


@dataclass(frozen=True)
class ModelEvidence:
    """A law, with or without its error, and how probable what was heard makes it among all models.

    `found` is whether its posterior could be sampled; one that is ruled out need not be.
    """

    law: Law
    discrepancy: bool
    log_evidence: float
    log_evidence_std: float
    probability: float
    information_bits: float
    effective: float

    def scalars(self) -> dict[str, Any]:
        """As JSON has it."""
        return dict(vars(self))


@dataclass(frozen=True)
class Draws:
    """Equally probable contacts: unknowns z (n, dims), states (n, points) in their own units, which law each is by.

    `sizes` are the law's errors that each has in ln CRF, ln ζ and ln CRFA; `effective` how many
    independent ones they are worth.
    """

    z: Field
    law: Field  # number in LAWS
    sizes: Mapping[str, Field]
    states: Mapping[str, Field]
    effective: float

    def taken(self, rows: Any) -> "Draws":
        """Some of them."""
        sizes, states = (
            {key: one[rows] for key, one in whole.items()} for whole in (self.sizes, self.states)
        )
        return replace(self, z=self.z[rows], law=self.law[rows], sizes=sizes, states=states)


def sample_models(
    forward: Forward,
    pools: Mapping[Law, Pool],
    *,
    sampler: Sampler,
    seed: int,
    quickly: bool = False,
) -> tuple[tuple[ModelEvidence, ...], dict[tuple[Law, bool], WeightedSamples]]:
    """Every model sampled, with its evidence; `quickly` is enough where draws were learnt before.

    Raises
    ------
    AsperityError
        where the posterior of a model that counts was not found.
    """
    forward = forward.heard
    sampled: dict[tuple[Law, bool], WeightedSamples] = {}
    how: dict[str, Any] = {"enough": QUICKLY, "probed": 0} if quickly else {}
    best = -np.inf
    for law, discrepancy in _likeliest_first(forward, pools):
        target = _target(forward.points, discrepancy=discrepancy)
        if sampler == "nested":
            one = nested(_evaluate(forward, law), target, forward.dims, seed)
        else:
            one = importance(pools[law], target, best=best, **how)
        sampled[law, discrepancy], best = one, max(best, one.log_evidence)
    for (law, _), one in sampled.items():
        if one.effective < FEWEST and one.log_evidence > best - RULED_OUT:
            raise AsperityError(
                f"the posterior by the law {law} was not found: its draws are worth {one.effective:.0f}; take nested "
                "sampling, or wider priors"
            )
    total = logsumexp([one.log_evidence for one in sampled.values()])
    models = tuple(
        ModelEvidence(
            law,
            discrepancy,
            one.log_evidence,
            one.log_evidence_std,
            float(np.exp(one.log_evidence - total)),
            one.information_bits,
            one.effective,
        )
        for (law, discrepancy), one in sorted(
            sampled.items(), key=lambda entry: MODELS.index(entry[0])
        )
    )
    return models, sampled


def _likeliest_first(forward: Forward, pools: Mapping[Law, Pool]) -> list[tuple[Law, bool]]:
    """Models by what the draws that are there make of them: draws are then not spent on the hopeless."""

    def likelihood(model: tuple[Law, bool]) -> float:
        return float(_target(forward.points, discrepancy=model[1])(pools[model[0]].shown).max())

    return sorted(MODELS, key=likelihood, reverse=True)


def _target(
    points: tuple[OperatingPoint, ...], *, discrepancy: bool
) -> Callable[[ChannelPrediction], Field]:
    return lambda shown: log_likelihood(shown, points, discrepancy=discrepancy)


def _evaluate(forward: Forward, law: Law) -> Callable[[Field], ChannelPrediction]:
    return lambda z: forward.shown(z, law)


def new_pools(forward: Forward, seed: int) -> dict[Law, Pool]:
    """Draws from the prior, for each law."""
    return {
        law: Pool(_evaluate(forward.heard, law), joined, taken, forward.dims, seed) for law in LAWS
    }


def with_point(pools: Mapping[Law, Pool], forward: Forward, added: Forward) -> dict[Law, Pool]:
    """The draws that count, with one more operating point, `added`, behind those of before; `forward` has them all."""
    extended, forward = {}, forward.heard
    before = forward.points[: -len(added.points)]
    for law, whole in pools.items():
        pool = whole.reduced(
            [_target(before, discrepancy=flag)(whole.shown) for flag in (True, False)]
        )
        more = added.shown(pool.z, law)
        columns = ChannelPrediction(
            *(np.hstack(pair) for pair in zip(pool.shown, more, strict=True))
        )
        extended[law] = pool.with_columns(_evaluate(forward, law), columns)
    return extended


Columns = TypeVar("Columns", bound=tuple[Field, ...])


def taken(shown: Columns, rows: Field) -> Columns:
    """Some rows of each column."""
    return type(shown)(*(column[rows] for column in shown))


def joined(first: Columns, second: Columns) -> Columns:
    """Rows of one behind those of the other."""
    return type(first)(*(np.concatenate(pair) for pair in zip(first, second, strict=True)))


# Draws
# ----------------------------------------------------------------------


def posterior_draws(
    forward: Forward,
    sampled: Mapping[tuple[Law, bool], WeightedSamples],
    *,
    discrepancy: bool,
    seed: int,
) -> Draws:
    """Equally probable contacts by both laws, weighed by their evidence, with or without the laws' error."""
    rng = np.random.default_rng([seed, 4, discrepancy])
    both = [sampled[law, discrepancy] for law in LAWS]
    total = logsumexp([one.log_evidence for one in both])
    shares = np.exp([one.log_evidence - total for one in both])
    counts = np.round(DRAWS * shares).astype(int)
    parts = [
        _drawn(forward, law, one, int(count), rng, discrepancy=discrepancy)
        for law, one, count in zip(LAWS, both, counts, strict=True)
        if count
    ]
    effective = float(
        1.0 / np.sum([share**2 / one.effective for share, one in zip(shares, both, strict=True)])
    )
    whole = _joined_draws(parts)
    return replace(whole, effective=effective)


def emulated_share(forward: Forward, draws: Draws) -> float:
    """Share of CLR's variance over the posterior, on its scale, that is the emulator's own: at the case's own point."""
    _, std = replace(forward, points=forward.points[:1]).emulated(draws.z, [CLR])[CLR]
    whole = float(np.var(OUTPUTS[CLR].forward(draws.states[CLR][:, 0])))
    return min(float(np.mean(std**2)) / whole, 1.0)


def posterior_shares(forward: Forward, draws: Draws, count: int, seed: int) -> Field:
    """Shares of the emulator's ranges of contacts drawn from the posterior, (count, ranges): at each point in turn."""
    rng = np.random.default_rng([seed, 6])
    chosen = forward.shares(draws.z[rng.permutation(len(draws.z))[:count]])
    return np.asarray(chosen[np.arange(len(chosen)), np.arange(len(chosen)) % len(forward.points)])


def prior_draws(forward: Forward, seed: int, known: Draws | None = None) -> Draws:
    """Equally probable contacts before any recording; those `known` with more operating points behind theirs."""
    there = 0 if known is None else known.states[CLR].shape[1]
    rng = np.random.default_rng([seed, 5, *([there] if there else [])])
    z = rng.standard_normal((DRAWS, forward.dims)) if known is None else known.z
    states = {}
    if there < len(forward.points):
        emulated = replace(forward, points=forward.points[there:]).emulated(z, STATE)
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


def _drawn(
    forward: Forward,
    law: Law,
    sampled: WeightedSamples,
    count: int,
    rng: np.random.Generator,
    *,
    discrepancy: bool,
) -> Draws:
    places = (rng.random() + np.arange(count)) / count
    chosen = np.minimum(
        np.searchsorted(np.cumsum(sampled.weights), places), len(sampled.weights) - 1
    )
    z = sampled.z[chosen]
    emulated = forward.emulated(z, tuple(dict.fromkeys((*STATE, *forward.outputs(law)))))
    shown = forward.shown_by(z, law, emulated)
    none = dict.fromkeys(WEIGHTS, np.zeros(count))
    sizes = _sizes(shown, forward.points, rng) if discrepancy else none
    states = {}
    for key in STATE:
        mean, std = emulated[key]
        if key == CLR and law == "hertz-point":
            scaled = _corrected(mean, std, shown, forward.points, sizes["crf"], rng)
        else:
            scaled = mean + std * rng.standard_normal(mean.shape)
        states[key] = OUTPUTS[key].back(scaled)
    return Draws(z, np.full(count, LAWS.index(law)), sizes, states, sampled.effective)


def _sizes(
    shown: ChannelPrediction, points: tuple[OperatingPoint, ...], rng: np.random.Generator
) -> dict[str, Field]:
    """How large the law's errors are, drawn for each contact from what was heard."""
    found = {}
    for channel, weight in WEIGHTS.items():
        logs = log_at_sizes(shown, points, channel)
        shares = np.exp(logs - logsumexp(logs, axis=0))
        place = np.sum(np.cumsum(shares, axis=0) < rng.random(shares.shape[1]), axis=0)
        found[channel] = weight * np.array(SIZES)[np.minimum(place, len(SIZES) - 1)]
    return found


def _corrected(
    mean: Field,
    std: Field,
    shown: ChannelPrediction,
    points: tuple[OperatingPoint, ...],
    size: Field,
    rng: np.random.Generator,
) -> Field:
    """Load shares that the emulator left open, drawn with what all CRF together say of them: on CLR's scale.

    By Matheron's rule: a joint draw of shares and frequencies, moved by what the frequencies heard
    differ from it.
    """
    heard = np.array([point.crf.value for point in points])
    here = ~np.isnan(heard)
    near = point_similarity(points)
    emulator = emulated_errors("crf", std, near)
    errors = _drawn_normal(emulator, rng)
    if not here.any():
        return mean + errors
    share = OUTPUTS[CLR].back(mean)
    slope = 1.0 / (
        6.0 * np.maximum(share, LEAST_SHARE) * OUTPUTS[CLR].slope(share)
    )  # d ln CRF / d scale
    slope = slope[:, here]
    measured = np.array([point.crf.std for point in points])[here]
    rest = law_errors("crf", shown.lever[:, here], size, near[np.ix_(here, here)]) + np.diag(
        measured**2
    )
    across = emulator[:, :, here] * slope[:, None]  # of shares and frequencies
    whole = across[:, here] * slope[:, :, None] + rest
    off = heard[here] - shown.crf[:, here] - slope * errors[:, here] - _drawn_normal(rest, rng)
    moved = across @ np.linalg.solve(whole, off[:, :, None])
    return np.asarray(mean + errors + moved[:, :, 0])


def _drawn_normal(covariance: Field, rng: np.random.Generator) -> Field:
    """A draw of no mean for each covariance, (n, points)."""
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
