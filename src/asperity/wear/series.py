"""The contact resonance in every recording of a series: what stays is the machine, what moves is the contact.

One spectrum alone cannot tell a structural mode from the contact's; a series can. The joint separation fits
P_i(f) = g_i B(f) + A_i L(f; f_i, ζ_i) (f/f_i)^t to all spectra at once, B free in every block of lines.
docs/theory/indicators.md has the equations and how often it is right.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from asperity.arrays import Field, Mask
from asperity.errors import BadInput
from asperity.signals import Spectrum
from asperity.wear.indicators import (
    INDICATOR_METHODS,
    STRONG_EVIDENCE,
    Resonance,
    contact_resonance,
    line_and_slopes,
    line_shape,
    no_resonance,
    require_band,
)

FEWEST_RECORDINGS = 6
MOST_TOGETHER = 100  # recordings of a longer series that settle what all of them share
MOST_BLOCKS, COARSE_BLOCKS = 600, 160
DAMPINGS = np.geomspace(0.006, 0.08, 6)  # of the search
USUAL_DAMPING, DAMPING_SPREAD = 0.02, 1.0  # prior of ln ζ: centre, and a factor e either way as standard deviation
LEVELS = np.geomspace(0.03, 3e3, 21)  # of the search: a line's height over the base below it
LARGEST_MISFIT = 0.3  # rms, beyond chance, of what the model leaves of a spectrum
STARTS = (0.1, 0.3, 0.5)  # quantiles over the recordings, as first guesses of what is common to them
HEAVIEST_DAMPING = 0.1  # of a contact: 0.01 dry to 0.1 in boundary lubrication, the paper's section 2.1
LEAST_DAMPING, MOST_DAMPING = 1e-3, 0.3
LONGEST_STEP = np.array([1.0, 0.03, 0.5, 1.0])  # of ln A, ln f, ln ζ, ln g
MOST_STEPS = 60
SETTLED = 1e-3  # ln likelihood that the next step promises
LOOSE = 1e-4  # information of everything before the data, so that a line of no height has a defined place
STANDING = 0.1  # standard deviation of a line's places over its width, below which it does not move
MOVES = "moves against what all recordings share"
STANDS = "keeps its place and changes its height; CRFA is the part that changes, a lower bound"
SLOPE_STEP, STEEPEST = 0.1, 2.0
COMMON_FROM = 0.1  # share of what all recordings share in a block, from which its residual is the machine's
WITNESS_FROM = 0.8  # of a parameter's influence, that a witness has to cover
TINY = 1e-100
RIVAL = 10.0  # ln likelihood by which the place found must beat every other place in the band


class _Blocks(NamedTuple):
    """Spectra averaged over blocks of lines: density and independent ordinates (recordings, blocks)."""

    centre: Field  # (blocks,)
    density: Field
    weight: Field


class _Parameters(NamedTuple):
    """A_i, f_i, ζ_i, g_i as logarithms (recordings, 4), ln B (blocks,), and the slope t of what excites the lines."""

    own: Field
    base: Field
    slope: float = 0.0


class _Joint(NamedTuple):
    parameters: _Parameters
    cost: float
    std: Field  # (recordings, 4)


def series_resonances(
    spectra: Sequence[Spectrum],
    *,
    band_hz: tuple[float, float],
    method: str = "joint",
    kept: Sequence[Mask] | None = None,
) -> tuple[Resonance, ...]:
    """Find the contact resonance in each of `spectra`, in the same order.

    Parameters
    ----------
    band_hz : where to look [Hz]
    method : "joint" separates what is common to all spectra from a line that moves or changes its height between
        them, and needs 6 of them; any method of `contact_resonance` takes each spectrum by itself
    kept : masks (lines,) of the lines that count, such as `CleanSpectrum.kept`; all by default

    Raises
    ------
    BadInput
        for an unknown method, too few spectra for "joint", spectra on different frequencies, a band that does not fit
        them, values that are not finite.
    """
    if method in INDICATOR_METHODS:
        return tuple(contact_resonance(spectrum, band_hz=band_hz, method=method) for spectrum in spectra)
    if method != "joint":
        raise BadInput(f"series method must be one of joint, {', '.join(INDICATOR_METHODS)}, got {method!r}")
    if len(spectra) < FEWEST_RECORDINGS:
        raise BadInput(
            f"the joint separation needs at least {FEWEST_RECORDINGS} recordings to tell what stays from what moves, "
            f"got {len(spectra)}; take method likelihood or modes"
        )
    first = spectra[0]
    for spectrum in spectra:
        if spectrum.frequency_hz.shape != first.frequency_hz.shape or spectrum.spacing_hz != first.spacing_hz:
            raise BadInput(
                f"spectra of a series must have the same lines, got {spectrum.frequency_hz.size} every "
                f"{spectrum.spacing_hz:g} Hz beside {first.frequency_hz.size} every {first.spacing_hz:g} Hz; take one "
                "rate and one segment length for all"
            )
        if spectrum.smoothing_passes:
            raise BadInput("the joint separation needs unsmoothed spectra; pass the spectra themselves")
        inside = require_band(spectrum, band_hz)
    from threadpoolctl import threadpool_limits

    blocks = _blocks(spectra, inside, kept)
    silent = ~np.any(blocks.density > 0.0, axis=1)
    if np.any(silent):
        raise BadInput(
            f"recording {int(np.argmax(silent))} holds no vibration at all between {band_hz[0]:.0f} and "
            f"{band_hz[1]:.0f} Hz; leave it out"
        )
    with threadpool_limits(1, "blas"):  # matrices too small for two threads: they would wait for one another
        return _separated(blocks, band_hz)


def _blocks(spectra: Sequence[Spectrum], inside: Mask, kept: Sequence[Mask] | None) -> _Blocks:
    lines = np.flatnonzero(inside)
    size = -(-lines.size // MOST_BLOCKS)
    count = lines.size // size
    lines = lines[: count * size]
    shape = (len(spectra), count, size)
    density = np.stack([spectrum.density[lines] for spectrum in spectra]).reshape(shape)
    good = np.ones(shape, dtype=bool) if kept is None else np.stack([mask[lines] for mask in kept]).reshape(shape)
    share = good.sum(axis=2)
    averages = np.array([spectrum.averages for spectrum in spectra])[:, None]
    mean = np.where(share > 0, (density * good).sum(axis=2) / np.maximum(share, 1), density.mean(axis=2))
    centre = spectra[0].frequency_hz[lines].reshape(count, size).mean(axis=1)
    return _Blocks(centre, mean, averages * share)


def _coarser(blocks: _Blocks) -> _Blocks:
    size = -(-blocks.centre.size // COARSE_BLOCKS)
    count = blocks.centre.size // size
    shape = (-1, count, size)
    weight = blocks.weight[:, : count * size].reshape(shape)
    density = blocks.density[:, : count * size].reshape(shape)
    total = weight.sum(axis=2)
    mean = np.where(total > 0.0, (weight * density).sum(axis=2) / np.maximum(total, 1e-300), density.mean(axis=2))
    return _Blocks(blocks.centre[: count * size].reshape(count, size).mean(axis=1), mean, total)


class _Templates(NamedTuple):
    """Lines to look for: their resonance, damping, and shape on the blocks (templates, blocks)."""

    f0: Field
    damping: Field
    shape: Field


def _templates(centre: Field) -> _Templates:
    f0, damping = (part.ravel() for part in np.meshgrid(centre, DAMPINGS, indexing="ij"))
    return _Templates(f0, damping, line_shape(centre, f0[:, None], damping[:, None]))


def _search(blocks: _Blocks, base: Field, templates: _Templates) -> tuple[Field, Field]:
    """-ln likelihood of each recording for a line at each template, gain and height at their best, and ln of those.

    Shapes (recordings, templates) and (recordings, templates, 2): ln A, ln g. With P = g B M, M = 1 + a L B(f0)/B, the
    best gain is the mean of D/(B M); what remains are two matrix products.
    """
    nearest = np.searchsorted(blocks.centre, templates.f0).clip(0, base.size - 1)
    rise = templates.shape * (base[nearest][:, None] / base)
    relative = blocks.weight * blocks.density / base
    total = blocks.weight.sum(axis=1)[:, None]
    constant = (blocks.weight @ np.log(base))[:, None]
    least = np.full((blocks.density.shape[0], templates.f0.size), np.inf)
    values = np.zeros((*least.shape, 2))
    prior = 0.5 * (np.log(templates.damping / USUAL_DAMPING) / DAMPING_SPREAD) ** 2
    for height in LEVELS:
        model = 1.0 + height * rise
        gain = relative @ (1.0 / model).T / total
        cost = blocks.weight @ np.log(model).T + total * (np.log(gain) + 1.0) + constant + prior
        better = cost < least
        least = np.where(better, cost, least)
        found = np.stack([np.log(height * base[nearest]) + np.log(gain), np.log(gain)], axis=-1)
        values = np.where(better[..., None], found, values)
    return least, values


def _tracks(blocks: _Blocks, base: Field, templates: _Templates) -> Field:
    """The best line in each recording, given the base: ln A, ln f, ln ζ, ln g, shape (recordings, 4)."""
    cost, values = _search(blocks, base, templates)
    best = np.argmin(cost, axis=1)
    rows = np.arange(best.size)
    level, gain = values[rows, best].T
    return np.stack([level, np.log(templates.f0[best]), np.log(templates.damping[best]), gain], axis=1)


def _lines(centre: Field, at: _Parameters) -> tuple[Field, Field, Field]:
    """A L (f/f_i)^t, and its derivatives by ln f_i and ln ζ_i, (recordings, blocks)."""
    level, f0, damping = (np.exp(at.own[:, column, None]) for column in range(3))
    line, by_f0, by_damping = line_and_slopes(centre[None, :], f0, damping)
    tilt = level * (centre[None, :] / f0) ** at.slope
    return tilt * line, tilt * (by_f0 - at.slope * line), tilt * by_damping


def _settled_base(blocks: _Blocks, own: Field, base: Field) -> Field:
    """The base that fits best beside given lines and gains: Fisher scoring in ln B, each block by itself."""
    line = _lines(blocks.centre, _Parameters(own, base))[0]
    gain = np.exp(own[:, 3, None])
    log_base = np.log(base)
    for _ in range(12):
        part = gain * np.exp(log_base)
        expected = part + line
        relative = part / expected
        score = np.sum(blocks.weight * relative * (blocks.density / expected - 1.0), axis=0)
        information = np.sum(blocks.weight * relative**2, axis=0)
        step = score / np.maximum(information, 1e-9 * np.max(information))
        log_base = log_base + np.clip(step, -1.0, 1.0)
    return np.asarray(np.exp(log_base))


def _first_base(blocks: _Blocks, quantile: float) -> Field:
    """A quantile over the recordings, their levels evened out."""
    middle = np.exp(np.mean(np.log(np.maximum(blocks.density, 1e-300)), axis=0))
    gain = np.median(blocks.density / middle, axis=1)
    return np.asarray(np.quantile(blocks.density / gain[:, None], quantile, axis=0))


def _separated(blocks: _Blocks, band_hz: tuple[float, float]) -> tuple[Resonance, ...]:
    """What all recordings share from all of them, or of a long series from some, evenly chosen; then every line."""
    coarse = _coarser(blocks)
    templates = _templates(coarse.centre)
    recordings = blocks.density.shape[0]
    chosen = list(range(recordings))
    if recordings > MOST_TOGETHER:
        chosen = [round(place) for place in np.linspace(0.0, recordings - 1.0, MOST_TOGETHER)]
    joint = _together(_rows(blocks, chosen), _rows(coarse, chosen), templates)
    if recordings > len(chosen):
        shared = joint.parameters
        own = _tracks(coarse, np.exp(np.interp(coarse.centre, blocks.centre, shared.base)), templates)
        own[chosen] = shared.own
        joint = _each(blocks, shared._replace(own=own))
    return _judged(blocks, joint, coarse, templates, band_hz, chosen)


def _rows(blocks: _Blocks, chosen: list[int]) -> _Blocks:
    return _Blocks(blocks.centre, blocks.density[chosen], blocks.weight[chosen])


def _together(blocks: _Blocks, coarse: _Blocks, templates: _Templates) -> _Joint:
    """From several first guesses of what is common, the separation of the greatest likelihood."""
    best: _Joint | None = None
    for quantile in STARTS:
        base = _first_base(coarse, quantile)
        for _ in range(8):
            own = _tracks(coarse, base, templates)
            base = _settled_base(coarse, own, base)
        joint = _scored(coarse, _Parameters(own, np.log(base)))
        if best is None or joint.cost < best.cost:
            best = joint
    assert best is not None  # there are starts
    for _ in range(3):  # a recording caught in a side maximum is moved to the best place
        own = _tracks(coarse, np.exp(best.parameters.base), templates)
        moved = np.abs(own[:, 1] - best.parameters.own[:, 1]) > 0.01
        joint = _scored(coarse, _Parameters(np.where(moved[:, None], own, best.parameters.own), best.parameters.base))
        if not np.any(moved) or joint.cost >= best.cost - 1e-3:
            break
        best = joint
    base = np.exp(np.interp(blocks.centre, coarse.centre, best.parameters.base))
    base = _settled_base(blocks, best.parameters.own, base)
    return _sloped(blocks, _scored(blocks, _Parameters(best.parameters.own, np.log(base))))


class _Point(NamedTuple):
    """Where a scoring step stands: cost, score and information, the base's part apart."""

    cost: float
    own_score: Field  # (recordings, 4)
    own_information: Field  # (recordings, 4, 4)
    base_score: Field  # (blocks,)
    base_information: Field  # (blocks,)
    coupling: Field  # (recordings, 4, blocks)


def _expected(blocks: _Blocks, at: _Parameters) -> Field:
    return np.asarray(_lines(blocks.centre, at)[0] + np.exp(at.own[:, 3, None] + at.base))


def _costs(blocks: _Blocks, at: _Parameters) -> Field:
    """-ln likelihood of each recording, its prior included."""
    expected = _expected(blocks, at)
    return np.asarray(np.sum(blocks.weight * (np.log(expected) + blocks.density / expected), axis=1) + _prior(at.own))


def _cost(blocks: _Blocks, at: _Parameters) -> float:
    return float(np.sum(_costs(blocks, at)))


def _prior(own: Field) -> Field:
    return np.asarray(0.5 * ((own[:, 2] - np.log(USUAL_DAMPING)) / DAMPING_SPREAD) ** 2)


def _point(blocks: _Blocks, at: _Parameters) -> _Point:
    line, by_f0, by_damping = _lines(blocks.centre, at)
    common = np.exp(at.own[:, 3, None] + at.base)
    expected = line + common
    relative = np.stack([line, by_f0, by_damping, common], axis=1) / expected[:, None]
    off = blocks.weight * (blocks.density / expected - 1.0)
    weighted = relative * blocks.weight[:, None]
    own_score = np.einsum("npb,nb->np", relative, off)
    own_score[:, 2] -= (at.own[:, 2] - np.log(USUAL_DAMPING)) / DAMPING_SPREAD**2
    own_information = np.einsum("npb,nqb->npq", weighted, relative, optimize=True)
    own_information[:, 2, 2] += DAMPING_SPREAD**-2
    base_part = relative[:, 3]
    return _Point(
        cost=float(np.sum(blocks.weight * (np.log(expected) + blocks.density / expected)) + np.sum(_prior(at.own))),
        own_score=own_score,
        own_information=own_information + LOOSE * np.eye(4),
        base_score=np.sum(base_part * off, axis=0),
        base_information=np.sum(blocks.weight * base_part**2, axis=0) + LOOSE,
        coupling=weighted * base_part[:, None],
    )


def _reduced(point: _Point, damping: float) -> tuple[Field, Field]:
    """Information of the recordings' own parameters once the base is eliminated, and that of the base; both damped.

    Levels of g and B are fixed against one another by Σ ln g = 0.
    """
    recordings, own, _ = point.own_information.shape
    base_information = point.base_information * (1.0 + damping)
    flat = point.coupling.reshape(recordings * own, -1)
    reduced = -(flat / base_information) @ flat.T
    diagonal = np.einsum("npp->np", point.own_information)
    for i in range(recordings):
        at = slice(i * own, (i + 1) * own)
        reduced[at, at] += point.own_information[i] + damping * np.diag(diagonal[i])
    gauge = np.tile([0.0, 0.0, 0.0, 1.0], recordings)
    reduced += float(np.mean(diagonal[:, 3])) * np.outer(gauge, gauge) / recordings
    return reduced, base_information


def _bounds(blocks: _Blocks) -> tuple[Field, Field]:
    """Least and greatest ln A, ln f, ln ζ, ln g."""
    low, high = np.log(0.97 * blocks.centre[0]), np.log(1.03 * blocks.centre[-1])
    return np.array([-60.0, low, np.log(LEAST_DAMPING), -60.0]), np.array([60.0, high, np.log(MOST_DAMPING), 60.0])


def _scored(blocks: _Blocks, start: _Parameters) -> _Joint:
    """Damped Fisher scoring of everything at once; the base, whose blocks do not couple, is eliminated first."""
    lower, upper = _bounds(blocks)
    at = start._replace(own=np.clip(start.own, lower, upper))
    point = _point(blocks, at)
    damping = 1e-3
    for _ in range(MOST_STEPS):
        reduced, base_information = _reduced(point, damping)
        flat = point.coupling.reshape(reduced.shape[0], -1)
        right = point.own_score.ravel() - flat @ (point.base_score / base_information)
        step = np.linalg.solve(reduced, right)
        base_step = (point.base_score - flat.T @ step) / base_information
        promised = 0.5 * float(step @ point.own_score.ravel() + base_step @ point.base_score)
        if promised < SETTLED:
            break
        step = np.clip(step.reshape(at.own.shape), -LONGEST_STEP, LONGEST_STEP)
        trial = at._replace(own=np.clip(at.own + step, lower, upper), base=at.base + np.clip(base_step, -2.0, 2.0))
        if _cost(blocks, trial) < point.cost:
            at = trial
            point = _point(blocks, at)
            damping = max(damping / 5.0, 1e-7)
        elif damping > 1e6:
            break
        else:
            damping *= 4.0
    reduced, _ = _reduced(point, 0.0)
    std = np.sqrt(np.diag(np.linalg.inv(reduced))).reshape(at.own.shape)
    return _Joint(at, point.cost, std)


def _each(blocks: _Blocks, start: _Parameters) -> _Joint:
    """Damped Fisher scoring of every recording's own parameters beside a base that is known."""
    lower, upper = _bounds(blocks)
    at = start._replace(own=np.clip(start.own, lower, upper))
    point, costs = _point(blocks, at), _costs(blocks, at)
    damping = np.full(costs.size, 1e-3)
    for _ in range(MOST_STEPS):
        diagonal = np.einsum("npp->np", point.own_information)
        damped = point.own_information + (damping[:, None] * diagonal)[:, :, None] * np.eye(4)
        step = np.linalg.solve(damped, point.own_score[..., None])[..., 0]
        if np.max(np.sum(step * point.own_score, axis=1)) < 2.0 * SETTLED or np.min(damping) > 1e6:
            break
        tried = np.clip(at.own + np.clip(step, -LONGEST_STEP, LONGEST_STEP), lower, upper)
        trial_costs = _costs(blocks, at._replace(own=tried))
        better = trial_costs < costs
        at = at._replace(own=np.where(better[:, None], tried, at.own))
        costs = np.where(better, trial_costs, costs)
        damping = np.where(better, np.maximum(damping / 5.0, 1e-7), damping * 4.0)
        point = _point(blocks, at)
    std = np.sqrt(np.einsum("npp->np", np.linalg.inv(point.own_information)))
    return _Joint(at, float(np.sum(costs)), std)


def _sloped(blocks: _Blocks, joint: _Joint) -> _Joint:
    """The separation with the likeliest slope t, by parabolas through three of them; its error counts in all others."""
    for _ in range(3):
        slope = joint.parameters.slope
        below, above = (
            _scored(blocks, joint.parameters._replace(slope=slope + step)) for step in (-SLOPE_STEP, SLOPE_STEP)
        )
        bend = below.cost - 2.0 * joint.cost + above.cost
        if bend <= 0.0:
            return joint
        change = 0.5 * SLOPE_STEP * (below.cost - above.cost) / bend
        change = min(max(change, -STEEPEST - slope), STEEPEST - slope)
        joint = _scored(blocks, joint.parameters._replace(slope=slope + change))
        if abs(change) < SLOPE_STEP:
            break
    dragged = (above.parameters.own - below.parameters.own) / (2.0 * np.sqrt(bend))  # by one deviation of t
    return joint._replace(std=np.hypot(joint.std, dragged))


def _misfit(blocks: _Blocks, joint: _Joint, witnesses: list[int]) -> Field:
    """Standard deviations (recordings, 4) that a machine brings which does not quite repeat itself, beside chance.

    What the fit of one recording would make of the residuals that the others have where its line lies: its influence
    a_b on each parameter, applied to r_jb of those recordings j whose own line is far; squared, averaged over them,
    less what chance explains. `witnesses` are the indices j.
    """
    line, by_f0, by_damping = _lines(blocks.centre, joint.parameters)
    expected = _expected(blocks, joint.parameters)
    relative = np.stack([line, by_f0, by_damping, expected - line], axis=1) / expected[:, None]
    information = np.einsum("npb,nqb,nb->npq", relative, relative, blocks.weight, optimize=True) + LOOSE * np.eye(4)
    influence = np.linalg.solve(information, relative * blocks.weight[:, None])
    common = relative[:, 3]
    felt = influence * common[:, None]  # what a relative change of the machine in block b does to each parameter
    counts = ((common > COMMON_FROM) & (blocks.weight > 0.0))[witnesses]
    share = np.where(counts, common[witnesses], 1.0)
    change = np.where(counts, (blocks.density / expected - 1.0)[witnesses] / share, 0.0)
    by_chance = np.where(counts, 1.0 / (np.maximum(blocks.weight[witnesses], 1.0) * share**2), 0.0)
    heard = np.einsum("npb,jb->npj", felt, change, optimize=True) ** 2
    expected_of_chance = np.einsum("npb,jb->npj", felt**2, by_chance, optimize=True)
    whole = np.einsum("npb,jb->npj", felt**2, counts.astype(float), optimize=True)
    # a witness has to be heard over nearly all that matters; the less chance blurs it, the more it counts
    heard_enough = whole > WITNESS_FROM * np.sum(felt**2, axis=2)[:, :, None]
    witness = heard_enough / np.maximum(expected_of_chance, TINY) ** 2
    variance = np.sum((heard - expected_of_chance) * witness, axis=2) / np.maximum(np.sum(witness, axis=2), TINY)
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)))


def _judged(
    blocks: _Blocks,
    joint: _Joint,
    coarse: _Blocks,
    templates: _Templates,
    band_hz: tuple[float, float],
    witnesses: list[int],
) -> tuple[Resonance, ...]:
    """Which of the lines are there, each with its reason."""
    own, base, _ = joint.parameters
    expected = _expected(blocks, joint.parameters)
    with_line = np.sum(blocks.weight * (np.log(expected) + blocks.density / expected), axis=1)
    bare = np.exp(base)
    relative = np.sum(blocks.weight * blocks.density / bare, axis=1) / blocks.weight.sum(axis=1)
    alone = relative[:, None] * bare
    without = np.sum(blocks.weight * (np.log(alone) + blocks.density / alone), axis=1)
    evidence = 2.0 * (without - with_line) - 3.0 * np.log(blocks.weight.sum(axis=1))

    std = np.hypot(joint.std, _misfit(blocks, joint, witnesses))
    off = blocks.density / expected - 1.0
    counted = blocks.weight > 0.0
    chance = np.sum(counted, axis=1)
    misfit = np.sqrt(
        np.maximum(np.sum(counted * (off**2 - 1.0 / np.maximum(blocks.weight, 1.0)), axis=1) / chance, 0.0)
    )
    cost, _ = _search(coarse, np.exp(np.interp(coarse.centre, blocks.centre, base)), templates)

    significant = evidence > STRONG_EVIDENCE
    places, widths = own[significant, 1], 2.0 * np.exp(own[significant, 2])
    # a line that keeps its place can lend any part of its height to what all recordings share
    stands = places.size > 0 and float(np.std(places)) < STANDING * float(np.median(widths))
    found = []
    for i in range(own.shape[0]):
        level, f0, zeta, gain = (float(value) for value in np.exp(own[i]))
        level_std, f0_std, zeta_std = (float(value) for value in std[i, :3] * [level, f0, zeta])
        line = _Line(f0, f0_std, zeta, float(evidence[i]), float(misfit[i]), *_rival(f0, zeta, cost[i], templates))
        objection = _objection(line, band_hz)
        if objection is not None:
            silent = no_resonance(objection, band_hz, "joint", evidence=line.evidence)
            found.append(replace(silent, background=(blocks.centre, alone[i])))
            continue
        found.append(
            Resonance(
                crf_hz=f0,
                crfa=level,
                crf_std=f0_std,
                crfa_std=np.nan if stands else level_std,
                found=True,
                reason=f"a line {line.width:.0f} Hz wide {STANDS if stands else MOVES} (BIC {line.evidence:+.0f})",
                band_hz=band_hz,
                method="joint",
                damping_ratio=zeta,
                damping_ratio_std=zeta_std,
                evidence=line.evidence,
                background=(blocks.centre, gain * bare),
            )
        )
    return tuple(found)


class _Line(NamedTuple):
    """A recording's line as it is judged; `lead` in ln likelihood over a line at `rival`, the best place elsewhere."""

    f0: float
    f0_std: float
    damping: float
    evidence: float
    misfit: float
    rival: float
    lead: float

    @property
    def width(self) -> float:
        return 2.0 * self.damping * self.f0


def _rival(f0: float, damping: float, cost: Field, templates: _Templates) -> tuple[float, float]:
    """The best place more than three widths away, and by how much the line's own is better."""
    away = np.abs(templates.f0 - f0) > 6.0 * damping * f0
    if np.all(away) or not np.any(away):
        return np.nan, np.inf
    return float(templates.f0[away][np.argmin(cost[away])]), float(np.min(cost[away]) - np.min(cost[~away]))


def _objection(line: _Line, band_hz: tuple[float, float]) -> str | None:
    """Why a line is not the contact's, or cannot be told to be."""
    low, high = band_hz
    if line.evidence < STRONG_EVIDENCE:
        return (
            f"nothing moves or changes height against what all recordings share between {low:.0f} and {high:.0f} Hz "
            f"(BIC {line.evidence:+.1f})"
        )
    if line.misfit > LARGEST_MISFIT:
        return (
            f"the spectrum is not what all recordings share and one line beside it (off by {100 * line.misfit:.0f} % "
            "beyond chance)"
        )
    if not low + 3.0 * line.f0_std < line.f0 < high - 3.0 * line.f0_std:
        return f"what stands out peaks at or beyond the edge of the band {low:.0f} to {high:.0f} Hz"
    if line.width > (high - low) / 2.0:
        return (
            f"the line at {line.f0:.0f} Hz is wider than half the band ({line.width:.0f} Hz): a slope, not a resonance"
        )
    if line.damping > HEAVIEST_DAMPING:
        return (
            f"the line at {line.f0:.0f} Hz is wider than a contact's damping makes one ({line.width:.0f} Hz, damping "
            f"ratio {line.damping:.2g}; {HEAVIEST_DAMPING:g} is the most): a slope, or part of the machine"
        )
    if line.lead < RIVAL:
        return f"a line at {line.rival:.0f} Hz would do as well as the one at {line.f0:.0f} Hz"
    if line.f0_std > line.width:
        return f"the line at {line.f0:.0f} Hz cannot be told from what all recordings share (± {line.f0_std:.0f} Hz)"
    return None
