"""Stages of wear: where along time or roughness the contact resonance changes its pace, or that it does not.

A broken stick with a Bayesian break stands against smooth curves and against no change at all: on a smooth curve a
stick alone reports a precise false knee. Knows nothing of recordings; docs/theory/indicators.md has the equations.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike

from asperity.arrays import Field
from asperity.errors import BadInput

Detector = Literal["bayesian"]
StageKind = Literal["severe", "running-in", "no distinct stage", "no change", "too few"]

FEWEST_PLACES = 7  # different x: three on either side of a break, and one to contradict
STRONG_EVIDENCE = 6.0  # BIC difference, "strong": Kass and Raftery, J. Am. Stat. Assoc. 90 (1995)
MOST_PLACES = 240  # recordings of a long watch are averaged in neighbouring groups down to so many
BREAKS, SCATTERS, CURVATURES = 161, 15, 48  # grid points of break, scatter and bend of the smooth curves
SEVERE_FROM = 0.5  # probability


@dataclass(frozen=True, slots=True, kw_only=True)
class Stages:
    """What a series of CRFs says about stages of wear.

    Parameters
    ----------
    kind : "severe", CRF rises, and from `split` on at another pace: the paper's normal and severe stage. "running-in",
        it falls and then does so at another pace. "no distinct stage", it changes, but a smooth curve explains it as
        well. "no change". "too few" places to tell
    split, interval : the break, in units of x, and its 90 % interval; nan unless a stage was found
    probability : shape (recordings,), of being in the severe stage; 0 where the break belongs to running-in, nan
        where there are too few places to tell. Weighs the broken stick against the smooth curves, so that it stays
        below 1 where no stage is distinct
    labels : "normal", "severe" (probability 0.5 or more), "running-in", "steady" or "none", one a recording
    evidence : BIC of each model less that of the best; 0 is the best, 6 more is strong evidence against
    slopes : of CRF before and after the break [Hz per unit of x]
    scatter_hz : standard deviation of CRF about the best model beyond the errors given [Hz]
    verdict : all of this in one sentence
    """

    kind: StageKind
    split: float = np.nan
    interval: tuple[float, float] = (np.nan, np.nan)
    probability: Field
    labels: tuple[str, ...]
    evidence: dict[str, float]
    slopes: tuple[float, float] = (np.nan, np.nan)
    scatter_hz: float
    verdict: str

    @property
    def found(self) -> bool:
        """Whether there is a break to speak of."""
        return self.kind in ("severe", "running-in")


def split_stages(
    x: ArrayLike,
    crf_hz: ArrayLike,
    crfa: ArrayLike | None = None,
    *,
    crf_std_hz: ArrayLike | None = None,
    x_std: ArrayLike | None = None,
    detector: Detector = "bayesian",
    unit: str = "",
) -> Stages:
    """Find the break between normal and severe wear along `x`, if there is one.

    Parameters
    ----------
    x : shape (recordings,), time or roughness, in any order; recordings at the same x are repeats of one test
    crf_hz : shape (recordings,) [Hz]; nan where none was found
    crfa : shape (recordings,), a weak second channel: a sudden bend of its logarithm narrows the break, and decides
        nothing
    crf_std_hz, x_std : standard deviations, one for all or shape (recordings,); repeats at one x share its error.
        Scatter beyond them is estimated
    detector : name in STAGE_DETECTORS
    unit : of x, for the sentence

    Raises
    ------
    BadInput
        for an unknown detector, shapes that differ, x that is not finite, negative deviations.
    """
    if detector not in STAGE_DETECTORS:
        raise BadInput(f"stage detector must be one of {', '.join(STAGE_DETECTORS)}, got {detector!r}")
    x, crf_hz = np.asarray(x, dtype=float), np.asarray(crf_hz, dtype=float)
    lengths = [np.shape(values) for values in (x, crf_hz, crfa) if values is not None]
    if x.ndim != 1 or len(set(lengths)) > 1:
        raise BadInput(f"x, CRF and CRFA must be rows of one length, got shapes {', '.join(map(str, lengths))}")
    if x.size == 0:
        raise BadInput("stages need recordings, got none")
    if not np.isfinite(x).all():
        raise BadInput("x must be finite for every recording, got some that is not; leave those recordings out")
    crf_std = _deviations("CRF deviation", crf_std_hz, x.size)
    x_error = _deviations("x deviation", x_std, x.size)
    second = None if crfa is None else np.asarray(crfa, dtype=float)
    return STAGE_DETECTORS[detector](x, crf_hz, second, crf_std, x_error, unit)


def _deviations(name: str, value: ArrayLike | None, recordings: int) -> Field:
    given = np.asarray(0.0 if value is None else value, dtype=float)
    if given.shape not in ((), (recordings,)):
        raise BadInput(f"{name} must be one number or {recordings}, one a recording, got shape {given.shape}")
    deviations = np.broadcast_to(given, recordings)
    if np.any(deviations[np.isfinite(deviations)] < 0.0):
        raise BadInput(f"{name} must be 0 or more, got {np.nanmin(deviations):g}; give standard deviations")
    return np.where(np.isfinite(deviations), deviations, 0.0)


class _Places(NamedTuple):
    """Means over the repeats at each place, ordered; shape (places,)."""

    x: Field
    x_std: Field
    y: Field
    variance: Field  # of y, from the errors given and the scatter of repeats


class _Candidate(NamedTuple):
    """A model with its one bend parameter k (break, or length of saturation) on a grid, linear in all else.

    `model(k, places)` gives the expected columns at the places, errors in x included, (grid, places, linear
    parameters), and their derivatives by x.
    """

    name: str
    bends: Field
    model: Callable[[Field, _Places], tuple[Field, Field]]
    parameters: int


class _Fitted(NamedTuple):
    """Over the grid of bends and scatters: log likelihood, the same with linear parameters integrated out, those."""

    best: float  # greatest log likelihood
    marginal: Field  # (grid, scatters)
    linear: Field  # (grid, scatters, linear parameters)


def _bayesian(x: Field, crf: Field, crfa: Field | None, crf_std: Field, x_std: Field, unit: str) -> Stages:
    """Broken stick against saturating curves, a straight line and a constant, by BIC."""
    start, reach = float(np.min(x)), max(float(np.ptp(x)), np.finfo(float).tiny)
    x, x_std = (x - start) / reach, x_std / reach  # so that no unit of x is too small for the algebra
    known = np.isfinite(crf)
    places = _places(x[known], crf[known], crf_std[known], x_std[known])
    if places.x.size < FEWEST_PLACES:
        verdict = f"Too few to tell: a stage needs CRFs at {FEWEST_PLACES} different places, got {places.x.size}."
        return _without_stage("too few", verdict, {}, np.full(x.size, np.nan), np.nan)
    compared = _compared(places)
    evidence, stick = compared.evidence, compared.fits["broken stick"]
    log_break = _log_sum(stick.marginal)
    if crfa is not None:
        log_break = log_break + _sudden_bend(x, crfa, x_std, compared.breaks)
    density = np.exp(log_break - np.max(log_break))
    density /= np.sum(density)
    after = _after(x, x_std, compared.breaks, density)
    low, split, high = _quantiles(compared.breaks, density, (0.05, 0.5, 0.95))
    nearest = int(np.argmin(np.abs(compared.breaks - split)))
    _, before_slope, change = stick.linear[nearest, int(np.argmax(stick.marginal[nearest]))]
    slopes = (float(before_slope), float(before_slope + change))
    rising = slopes[0] * (split - places.x[0]) + slopes[1] * (places.x[-1] - split) > 0.0

    smooth = min(value for name, value in evidence.items() if name not in ("broken stick", "no change"))
    over = f"{start + reach * places.x[0]:.4g} to {start + reach * places.x[-1]:.4g} {unit}".rstrip()
    severe = after * compared.share if rising else np.zeros(x.size)
    if evidence["no change"] - min(smooth, evidence["broken stick"]) < STRONG_EVIDENCE:
        mean, error = float(np.mean(places.y)), float(np.std(places.y, ddof=1))
        verdict = f"No change: CRF holds at {mean:.0f} ± {error:.0f} Hz over {over}."
        return _without_stage("no change", verdict, evidence, severe, compared.scatter)
    if smooth - evidence["broken stick"] < STRONG_EVIDENCE:
        verdict = (
            f"No distinct stage: CRF changes over {over}, but a smooth curve explains it "
            f"{'better' if smooth < evidence['broken stick'] else 'as well'} (BIC of a break "
            f"{evidence['broken stick'] - smooth:+.1f} against it, {-STRONG_EVIDENCE:.0f} needed)."
        )
        return _without_stage("no distinct stage", verdict, evidence, severe, compared.scatter)
    names = ("normal", "severe") if rising else ("running-in", "steady")
    per = f" Hz per {unit}" if unit else " Hz per unit of x"
    before, behind = (f"{'rises' if slope > 0.0 else 'falls'} by {abs(slope) / reach:.3g}" for slope in slopes)
    low, split, high = (start + reach * place for place in (low, split, high))
    where = f"{split:.4g} ({low:.4g} to {high:.4g}, 90 %)" + (f" {unit}" if unit else "")
    return Stages(
        kind="severe" if rising else "running-in",
        split=split,
        interval=(low, high),
        probability=severe,
        labels=tuple(names[int(p >= SEVERE_FROM)] for p in after),
        evidence=evidence,
        slopes=(slopes[0] / reach, slopes[1] / reach),
        scatter_hz=compared.scatter,
        verdict=f"{'Severe wear from' if rising else 'Running-in until'} {where}: "
        f"CRF {before}{per} before and {behind} after.",
    )


class _Compared(NamedTuple):
    """Candidates fitted to the places; `share` of the broken stick among them, `scatter` [Hz] of the best."""

    breaks: Field
    fits: dict[str, _Fitted]
    evidence: dict[str, float]
    share: float
    scatter: float


def _compared(places: _Places) -> _Compared:
    candidates = _candidates(places)
    scatters = _scatters(places)
    fits = {candidate.name: _fit(candidate, places, scatters) for candidate in candidates}
    bic = {
        candidate.name: -2.0 * fits[candidate.name].best + (candidate.parameters + 1) * float(np.log(places.x.size))
        for candidate in candidates
    }
    least = min(bic.values())
    evidence = {name: value - least for name, value in bic.items()}
    weights = {name: float(np.exp(-0.5 * value)) for name, value in evidence.items()}
    best = fits[min(evidence, key=lambda name: evidence[name])]
    return _Compared(
        breaks=candidates[0].bends,
        fits=fits,
        evidence=evidence,
        share=weights["broken stick"] / sum(weights.values()),
        scatter=float(scatters[int(np.argmax(np.max(best.marginal, axis=0)))]),
    )


STAGE_DETECTORS: dict[Detector, Callable[[Field, Field, Field | None, Field, Field, str], Stages]] = {
    "bayesian": _bayesian
}


def _without_stage(
    kind: StageKind, verdict: str, evidence: dict[str, float], probability: Field, scatter: float
) -> Stages:
    return Stages(
        kind=kind,
        probability=probability,
        labels=("none",) * probability.size,
        evidence=evidence,
        scatter_hz=scatter,
        verdict=verdict,
    )


def _places(x: Field, y: Field, y_std: Field, x_std: Field) -> _Places:
    """Repeats averaged; their own scatter, pooled, counts where it is larger than the deviations given."""
    if x.size == 0:
        return _Places(x, x_std, y, y)
    at, index = np.unique(x, return_inverse=True)
    if at.size > MOST_PLACES:  # neighbours in groups of equal number
        index = index * MOST_PLACES // at.size
    count = np.bincount(index).astype(float)

    def mean(values: Field) -> Field:
        return np.asarray(np.bincount(index, values) / count)

    middle, centre = mean(y), mean(x)
    given = mean(y_std**2)
    spare = y.size - count.size
    if spare > 0:
        excess = float(np.sum((y - middle[index]) ** 2)) / spare - float(np.sum(given * (count - 1.0))) / spare
        given = given + max(excess, 0.0)
    return _Places(centre, mean(x_std), middle, given / count)


def _scatters(places: _Places) -> Field:
    """Grid of standard deviations, beyond the errors given, of the places about a curve [Hz]."""
    span = max(float(np.ptp(places.y)), 1e-6 * float(np.max(np.abs(places.y))), 1e-9)
    return np.concatenate([[span * 1e-4], span * np.geomspace(2e-3, 0.7, SCATTERS - 1)])


def _candidates(places: _Places) -> list[_Candidate]:
    x = places.x
    breaks = np.linspace(x[2], x[-3], BREAKS)
    lengths = np.ptp(x) * np.geomspace(0.05, 5.0, CURVATURES)
    none = np.zeros(1)
    return [
        _Candidate("broken stick", breaks, _stick, 4),
        _Candidate("saturating exponential", lengths, _exponential, 4),
        _Candidate("saturating hyperbola", lengths, _hyperbola, 4),
        _Candidate("straight line", none, _line, 2),
        _Candidate("no change", none, _constant, 1),
    ]


def _beside_constant(column: Field, slope: Field) -> tuple[Field, Field]:
    """A constant and one column, and their derivatives by x."""
    return np.stack([np.ones_like(column), column], axis=-1), np.stack([np.zeros_like(slope), slope], axis=-1)


def _stick(k: Field, at: _Places) -> tuple[Field, Field]:
    """1, x and the hinge max(x - k, 0), in the mean over the error of x: (x - k) Φ(z) + s φ(z), z = (x - k)/s."""
    ahead = at.x[None, :] - k[:, None]
    blur = np.maximum(at.x_std, 1e-12)[None, :]
    z = ahead / blur
    over = scipy.special.ndtr(z)  # P(true x > k), shape (breaks, places)
    bent = ahead * over + blur * np.exp(-0.5 * np.minimum(z**2, 1400.0)) / np.sqrt(2.0 * np.pi)
    straight = np.broadcast_to(at.x - at.x[0], over.shape)
    one = np.ones_like(over)
    return np.stack([one, straight, bent], axis=-1), np.stack([np.zeros_like(over), one, over], axis=-1)


def _exponential(k: Field, at: _Places) -> tuple[Field, Field]:
    along = np.exp(-(at.x - at.x[0])[None, :] / k[:, None])
    return _beside_constant(along, -along / k[:, None])


def _hyperbola(k: Field, at: _Places) -> tuple[Field, Field]:
    along = 1.0 / (1.0 + (at.x - at.x[0])[None, :] / k[:, None])
    return _beside_constant(along, -(along**2) / k[:, None])


def _line(_: Field, at: _Places) -> tuple[Field, Field]:
    return _beside_constant((at.x - at.x[0])[None], np.ones_like(at.x)[None])


def _constant(_: Field, at: _Places) -> tuple[Field, Field]:
    return np.ones((1, at.x.size, 1)), np.zeros((1, at.x.size, 1))


def _fit(candidate: _Candidate, places: _Places, scatters: Field) -> _Fitted:
    """Weighted least squares at every bend and scatter; the error of x counts with the slope there (iterated)."""
    columns, slopes = (part[:, None] for part in candidate.model(candidate.bends, places))  # (bends, 1, places, linear)
    own = places.variance + scatters[:, None] ** 2  # (scatters, places)
    variance = np.broadcast_to(own, (columns.shape[0], *own.shape))
    uncertain = bool(np.any(places.x_std > 0.0))
    for _ in range(6 if uncertain else 1):
        information = np.einsum("bsp,btpi,btpj->bsij", 1.0 / variance, columns, columns, optimize=True)
        right = np.einsum("bsp,btpi->bsi", places.y / variance, columns, optimize=True)
        ridge = 1e-12 * np.einsum("bsii->bs", information)[..., None, None] * np.eye(columns.shape[-1])
        linear = np.linalg.solve(information + ridge, right[..., None])[..., 0]
        steepness = np.einsum("btpi,bsi->bsp", slopes, linear, optimize=True)
        if uncertain:
            variance = own + (steepness * places.x_std) ** 2
    off = places.y - np.einsum("btpi,bsi->bsp", columns, linear, optimize=True)
    likelihood = -0.5 * np.sum(off**2 / variance + np.log(2.0 * np.pi * variance), axis=-1)
    marginal = likelihood - 0.5 * np.linalg.slogdet(information + ridge)[1]
    return _Fitted(float(np.max(likelihood)), marginal, linear)


def _sudden_bend(x: Field, crfa: Field, x_std: Field, breaks: Field) -> Field:
    """Logarithm of P(ln CRFA | break), but for a constant: a hinge over a parabola; smooth growth says nothing."""
    known = np.isfinite(crfa) & (crfa > 0.0)
    places = _places(x[known], np.log(crfa[known]), np.zeros(int(np.sum(known))), x_std[known])
    if places.x.size < FEWEST_PLACES:
        return np.zeros(breaks.size)

    def model(k: Field, at: _Places) -> tuple[Field, Field]:
        stick, sloped = _stick(k, at)
        x = stick[..., 1:2]
        return np.concatenate([stick, x**2], axis=-1), np.concatenate([sloped, 2.0 * x], axis=-1)

    candidate = _Candidate("ln CRFA", breaks, model, 5)
    return _log_sum(_fit(candidate, places, _scatters(places)).marginal)


def _after(x: Field, x_std: Field, breaks: Field, density: Field) -> Field:
    """Probability that each recording's true x lies beyond the break."""
    blur = np.maximum(x_std, 1e-12)
    return np.asarray(scipy.special.ndtr((x[:, None] - breaks[None, :]) / blur[:, None]) @ density)


def _log_sum(marginal: Field) -> Field:
    """Over the scatters, which are evenly spaced in their logarithm."""
    top = np.max(marginal, axis=1, keepdims=True)
    return np.asarray(np.log(np.sum(np.exp(marginal - top), axis=1)) + top[:, 0])


def _quantiles(breaks: Field, density: Field, wanted: tuple[float, float, float]) -> tuple[float, float, float]:
    cumulative = np.concatenate([[0.0], np.cumsum(density)])
    step = breaks[1] - breaks[0]
    edges = np.concatenate([breaks - step / 2.0, [breaks[-1] + step / 2.0]])
    low, middle, high = np.interp(wanted, cumulative, edges)
    return float(low), float(middle), float(high)
