"""The joint separation: what all spectra of a series share, and one line beside it in each.

P_i(f) = g_i B(f) + A_i L(f; f_i, ζ_i) T(f)/T(f_i) is fitted to all spectra at once, B free in
every block of lines. docs/theory/indicators.md has the equations.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from asperity.core.arrays import Field, Mask
from asperity.resonance.likelihood_fit import damped_scoring
from asperity.resonance.resonance import line_shape
from asperity.resonance.spectrum_model import (
    DAMPING_SPREAD,
    USUAL_DAMPING,
    Blocks,
    OwnPoint,
    Parameters,
    Point,
    bounds_of,
    costs_at,
    lines,
    own_at,
    point_at,
)
from asperity.resonance.transfer import Transfer, rises, through

MOST_TOGETHER = 100  # recordings of a longer series that settle what all of them share
COARSE_BLOCKS = 160
DAMPINGS = np.geomspace(0.006, 0.08, 6)  # of the search
LEVELS = np.geomspace(0.03, 3e3, 21)  # of the search: a line's height over the base below it
STARTS = (
    0.1,
    0.3,
    0.5,
)  # quantiles over the recordings, as first guesses of what is common to them
LONGEST_STEP = np.array([1.0, 0.03, 0.5, 1.0])  # of ln A, ln f, ln ζ, ln g
MOST_STEPS = 60
SETTLED = 1e-3  # ln likelihood that the next step promises
PACES = (0.3, 1e-4)  # of the transfer from spline to spline: the first guess, and the least
LIFTED = (
    0.1  # of the weakest line over it: what the base is at least when the transfer's fit begins
)
SAME_PACE, MOST_PACES = 0.1, 8  # change of its logarithm that no longer counts


class Joint(NamedTuple):
    """Where the joint fit ended: parameters, -ln likelihood, and standard deviations of the recordings' own.

    `doubt` is the covariance of the transfer's coefficients, `pace` their prior deviation from
    spline to spline.
    """

    parameters: Parameters
    cost: float
    std: Field  # (recordings, 4)
    doubt: Field
    pace: float = PACES[0]


class Templates(NamedTuple):
    """Lines to look for: their resonance, damping, and shape on the blocks (templates, blocks)."""

    f0: Field
    damping: Field
    shape: Field


class Separation(NamedTuple):
    """The joint fit; -ln likelihood (recordings, templates) of a line at each template; who settled what is shared."""

    joint: Joint
    templates: Templates
    elsewhere: Field
    witnesses: list[int]


def coarser(blocks: Blocks) -> Blocks:
    """The same in fewer blocks, for searches."""
    size = -(-blocks.centre.size // COARSE_BLOCKS)
    count = blocks.centre.size // size
    shape = (-1, count, size)
    weight = blocks.weight[:, : count * size].reshape(shape)
    density = blocks.density[:, : count * size].reshape(shape)
    total = weight.sum(axis=2)
    mean = np.where(
        total > 0.0,
        (weight * density).sum(axis=2) / np.maximum(total, 1e-300),
        density.mean(axis=2),
    )
    return Blocks(blocks.centre[: count * size].reshape(count, size).mean(axis=1), mean, total)


def templates_on(centre: Field) -> Templates:
    """Lines at every block, of several dampings."""
    f0, damping = (part.ravel() for part in np.meshgrid(centre, DAMPINGS, indexing="ij"))
    return Templates(f0, damping, line_shape(centre, f0[:, None], damping[:, None]))


class Model(NamedTuple):
    """1/M and ln M, (templates, blocks), of lines of one height over a base of 1."""

    inverse: Field
    logarithm: Field


def models(base: Field, templates: Templates, centre: Field) -> Iterator[Model]:
    """M = 1 + a L B(f0)/B for every height a of the search."""
    rise = templates.shape * (base[_nearest(centre, templates)][:, None] / base)
    for height in LEVELS:
        model = 1.0 + height * rise
        yield Model(1.0 / model, np.log(model))


def _nearest(centre: Field, templates: Templates) -> npt.NDArray[np.intp]:
    return np.searchsorted(centre, templates.f0).clip(0, centre.size - 1)


def search(
    blocks: Blocks, base: Field, templates: Templates, prepared: Iterable[Model] | None = None
) -> tuple[Field, Field]:
    """-ln likelihood of each recording for a line at each template, gain and height at their best, and ln of those.

    Shapes (recordings, templates) and (recordings, templates, 2): ln A, ln g. With P = g B M the
    best gain is the mean of D/(B M); what remains are two matrix products. `prepared` are the
    `models`, where they are at hand.
    """
    height_of = base[_nearest(blocks.centre, templates)]
    relative = blocks.weight * blocks.density / base
    total = blocks.weight.sum(axis=1)[:, None]
    constant = (blocks.weight @ np.log(base))[:, None]
    least = np.full((blocks.density.shape[0], templates.f0.size), np.inf)
    values = np.zeros((*least.shape, 2))
    prior = 0.5 * (np.log(templates.damping / USUAL_DAMPING) / DAMPING_SPREAD) ** 2
    for height, model in zip(
        LEVELS, prepared or models(base, templates, blocks.centre), strict=True
    ):
        as_precise = model.inverse.dtype  # a product of two precisions would copy the larger one
        gain = relative.astype(as_precise) @ model.inverse.T / total
        cost = (
            blocks.weight.astype(as_precise) @ model.logarithm.T
            + total * (np.log(gain) + 1.0)
            + constant
            + prior
        )
        better = cost < least
        least = np.where(better, cost, least)
        logarithms = np.stack([np.log(height * height_of) + np.log(gain), np.log(gain)], axis=-1)
        values = np.where(better[..., None], logarithms, values)
    return least, values


def _tracks(blocks: Blocks, base: Field, templates: Templates) -> Field:
    """The best line in each recording, given the base: ln A, ln f, ln ζ, ln g, shape (recordings, 4)."""
    return best_of(*search(blocks, base, templates), templates)


def best_of(cost: Field, values: Field, templates: Templates) -> Field:
    """The likeliest template of each recording: ln A, ln f, ln ζ, ln g."""
    best = np.argmin(cost, axis=1)
    rows = np.arange(best.size)
    level, gain = values[rows, best].T
    return np.stack(
        [level, np.log(templates.f0[best]), np.log(templates.damping[best]), gain], axis=1
    )


def levelled(
    blocks: Blocks, base: Field, templates: Templates, best: npt.NDArray[np.intp]
) -> Field:
    """The lines at given templates, one a recording, gain and height at their best: ln A, ln f, ln ζ, ln g."""
    rows = []
    for row, number in enumerate(best):
        one = Templates(
            templates.f0[[number]], templates.damping[[number]], templates.shape[[number]]
        )
        heard = Blocks(blocks.centre, blocks.density[[row]], blocks.weight[[row]])
        rows.append(best_of(*search(heard, base, one), one)[0])
    return np.array(rows).reshape(-1, 4)


def beside(
    blocks: Blocks,
    base: Field,
    transfer: Transfer,
    doubt: Field,
    templates: Templates,
    prepared: Iterable[Model],
) -> tuple[Joint, Field]:
    """Lines of recordings beside what others have settled: ln B (blocks,) and transfer; the fit, and `elsewhere`."""
    coarse = coarser(blocks)
    cost, values = search(
        coarse, np.exp(np.interp(coarse.centre, blocks.centre, base)), templates, prepared
    )
    return alone_beside(
        blocks, Parameters(best_of(cost, values, templates), base, transfer), doubt
    ), cost


def _settled_base(blocks: Blocks, own: Field, base: Field) -> Field:
    """The base that fits best beside given lines and gains: Fisher scoring in ln B, each block by itself."""
    line = lines(blocks.centre, Parameters(own, base))
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


def _first_base(blocks: Blocks, quantile: float) -> Field:
    """A quantile over the recordings, their levels evened out."""
    middle = np.exp(np.mean(np.log(np.maximum(blocks.density, 1e-300)), axis=0))
    gain = np.median(blocks.density / middle, axis=1)
    return np.asarray(np.quantile(blocks.density / gain[:, None], quantile, axis=0))


def separate(blocks: Blocks) -> Separation:
    """What all recordings share from all of them, or of a long series from some, evenly chosen; then every line."""
    coarse = coarser(blocks)
    templates = templates_on(coarse.centre)
    recordings = blocks.density.shape[0]
    chosen = list(range(recordings))
    if recordings > MOST_TOGETHER:
        chosen = [round(place) for place in np.linspace(0.0, recordings - 1.0, MOST_TOGETHER)]
    joint = _together(_rows(blocks, chosen), _rows(coarse, chosen), templates)
    if recordings > len(chosen):
        shared = joint.parameters
        own = _tracks(
            coarse, np.exp(np.interp(coarse.centre, blocks.centre, shared.base)), templates
        )
        own[chosen] = shared.own
        joint = alone_beside(blocks, shared._replace(own=own), joint.doubt)._replace(
            pace=joint.pace
        )
    elsewhere, _ = search(
        coarse, np.exp(np.interp(coarse.centre, blocks.centre, joint.parameters.base)), templates
    )
    return Separation(joint, templates, elsewhere, chosen)


def _rows(blocks: Blocks, chosen: list[int]) -> Blocks:
    return Blocks(blocks.centre, blocks.density[chosen], blocks.weight[chosen])


def _together(blocks: Blocks, coarse: Blocks, templates: Templates) -> Joint:
    """From several first guesses of what is common, the separation of the greatest likelihood."""
    best: Joint | None = None
    for quantile in STARTS:
        base = _first_base(coarse, quantile)
        for _ in range(8):
            own = _tracks(coarse, base, templates)
            base = _settled_base(coarse, own, base)
        joint = _scored(coarse, Parameters(own, np.log(base)))
        if best is None or joint.cost < best.cost:
            best = joint
    assert best is not None  # there are starts
    for _ in range(3):  # a recording caught in a side maximum is moved to the best place
        own = _tracks(coarse, np.exp(best.parameters.base), templates)
        moved = np.abs(own[:, 1] - best.parameters.own[:, 1]) > 0.01
        joint = _scored(
            coarse,
            Parameters(np.where(moved[:, None], own, best.parameters.own), best.parameters.base),
        )
        if not np.any(moved) or joint.cost >= best.cost - 1e-3:
            break
        best = joint
    base = np.exp(np.interp(blocks.centre, coarse.centre, best.parameters.base))
    base = _settled_base(blocks, best.parameters.own, base)
    low, high = bounds_of(blocks)
    passed = through(float(np.exp(low[1])), float(np.exp(high[1])))
    return _passed_on(
        blocks, _lifted(blocks, Parameters(best.parameters.own, np.log(base), passed))
    )


def _lifted(blocks: Blocks, at: Parameters) -> Parameters:
    """The same with a base that is nowhere nil below a line: in its logarithm no step would lead away from there."""
    line = lines(blocks.centre, at)
    least = np.min(line / np.exp(at.own[:, 3, None]), axis=0)
    return at._replace(base=np.maximum(at.base, np.log(LIFTED * least)))


def _reduced(point: Point, damping: Field | float) -> tuple[Field, Field, Field]:
    """Information of the recordings' own parameters and the transfer once the base is eliminated; that of the base.

    Both damped; and their coupling. Levels of g and B are fixed against one another by Σ ln g = 0.
    """
    recordings, own, _ = point.own_information.shape
    base_information = point.base_information * (1.0 + damping)
    size = recordings * own
    flat = np.concatenate([point.coupling.reshape(size, -1), point.passed_coupling])
    reduced = -(flat / base_information) @ flat.T
    diagonal = np.einsum("npp->np", point.own_information)
    for i in range(recordings):
        at = slice(i * own, (i + 1) * own)
        reduced[at, at] += point.own_information[i] + damping * np.diag(diagonal[i])
    gauge = np.tile([0.0, 0.0, 0.0, 1.0], recordings)
    reduced[:size, :size] += float(np.mean(diagonal[:, 3])) * np.outer(gauge, gauge) / recordings
    beside = point.passed_own.reshape(size, -1)
    reduced[:size, size:] += beside
    reduced[size:, :size] += beside.T
    reduced[size:, size:] += point.passed_information + damping * np.diag(
        np.diag(point.passed_information)
    )
    return reduced, base_information, flat


def _scored(blocks: Blocks, start: Parameters, pace: float = PACES[0]) -> Joint:
    """Damped Fisher scoring of everything at once; the base, whose blocks do not couple, is eliminated first."""
    lower, upper = bounds_of(blocks)
    stiff = start.transfer.stiffness(pace)

    def placed(at: Parameters) -> tuple[Parameters, Point]:
        return at, point_at(blocks, at, stiff)

    def propose(
        state: tuple[Parameters, Point], damping: Field
    ) -> tuple[Mask, Callable[[Mask], tuple[Parameters, Point]]] | None:
        at, point = state
        reduced, base_information, flat = _reduced(point, damping)
        score = np.concatenate([point.own_score.ravel(), point.passed_score])
        step = np.linalg.solve(reduced, score - flat @ (point.base_score / base_information))
        base_step = (point.base_score - flat.T @ step) / base_information
        promised = 0.5 * float(step @ score + base_step @ point.base_score)
        if promised < SETTLED:
            return None
        own, passed = step[: at.own.size].reshape(at.own.shape), step[at.own.size :]
        trial = Parameters(
            np.clip(at.own + np.clip(own, -LONGEST_STEP, LONGEST_STEP), lower, upper),
            at.base + np.clip(base_step, -2.0, 2.0),
            at.transfer._replace(
                coefficients=at.transfer.coefficients + np.clip(passed, -1.0, 1.0)
            ),
        )
        stretch = 0.5 * float(trial.transfer.coefficients @ stiff @ trial.transfer.coefficients)
        return np.array([np.sum(costs_at(blocks, trial)) + stretch < point.cost]), lambda _: placed(
            trial
        )

    start = start._replace(own=np.clip(start.own, lower, upper))
    (at, point), _ = damped_scoring(placed(start), propose, steps=MOST_STEPS, least=1e-7, most=1e6)
    covariance = np.linalg.inv(_reduced(point, 0.0)[0])
    own = at.own.size
    std = np.sqrt(np.diag(covariance)[:own]).reshape(at.own.shape)
    return Joint(at, point.cost, std, covariance[own:, own:], pace)


class Heard(NamedTuple):
    """What one sensor hears: its blocks, where its lines are thought to be, and the doubt about its transfer."""

    blocks: Blocks
    at: Parameters
    doubt: Field


class Lines(NamedTuple):
    """Lines of recordings, each of one place and damping on all sensors.

    `own` (sensors, recordings, 4) are as in `Parameters`; `inverse` (recordings, n, n) is of the
    information in all that is one's own, of which each sensor's are at `places`; `cost`
    (recordings,); by sensor `points`, and `dragged`, what each coefficient of its transfer does to
    all that is one's own (recordings, n, coefficients).
    """

    own: Field
    cost: Field
    inverse: Field
    points: list[OwnPoint]
    dragged: list[Field]


def places(sensor: int) -> list[int]:
    """Where ln A, ln f, ln ζ, ln g of a sensor stand among what is a recording's own; f and ζ are all sensors'."""
    return [0, 1, 2, 3] if sensor == 0 else [2 + 2 * sensor, 1, 2, 3 + 2 * sensor]


def each(sensors: Sequence[Heard]) -> Lines:
    """Damped Fisher scoring of every recording's own parameters beside bases and transfers that are known."""
    lower, upper = bounds_of(sensors[0].blocks)
    count, size = len(sensors), 2 + 2 * len(sensors)
    again = (count - 1.0) * DAMPING_SPREAD**-2  # the prior of a damping counts once

    def cost_of(own: Field) -> Field:
        every = [
            costs_at(one.blocks, one.at._replace(own=mine))
            for one, mine in zip(sensors, own, strict=True)
        ]
        return np.asarray(
            np.sum(every, axis=0) - 0.5 * again * (own[0, :, 2] - np.log(USUAL_DAMPING)) ** 2
        )

    def placed(own: Field, cost: Field) -> tuple[Field, Field, list[OwnPoint], Field, Field]:
        points = [
            own_at(one.blocks, one.at._replace(own=mine))
            for one, mine in zip(sensors, own, strict=True)
        ]
        score, information = np.zeros((own.shape[1], size)), np.zeros((own.shape[1], size, size))
        for sensor, point in enumerate(points):
            at = np.array(places(sensor))
            score[:, at] += point.score
            information[:, at[:, None], at] += point.information
        score[:, 2] += again * (own[0, :, 2] - np.log(USUAL_DAMPING))
        information[:, 2, 2] -= again
        return own, cost, points, score, information

    def propose(
        state: tuple[Field, Field, list[OwnPoint], Field, Field], damping: Field
    ) -> tuple[Mask, Callable[[Mask], tuple[Field, Field, list[OwnPoint], Field, Field]]] | None:
        own, cost, _, score, information = state
        diagonal = np.einsum("npp->np", information)
        damped = information + (damping[:, None] * diagonal)[:, :, None] * np.eye(size)
        step = np.linalg.solve(damped, score[..., None])[..., 0]
        if np.max(np.sum(step * score, axis=1)) < 2.0 * SETTLED:
            return None
        by_sensor = np.stack([step[:, places(sensor)] for sensor in range(count)])
        trial = np.clip(own + np.clip(by_sensor, -LONGEST_STEP, LONGEST_STEP), lower, upper)
        trial_cost = cost_of(trial)
        return trial_cost < cost, lambda better: placed(
            np.where(better[:, None], trial, own), np.where(better, trial_cost, cost)
        )

    own = np.stack([np.clip(one.at.own, lower, upper) for one in sensors])
    state = placed(own, cost_of(own))
    state, _ = damped_scoring(
        state, propose, steps=MOST_STEPS, least=1e-7, most=1e6, fits=own.shape[1]
    )
    own, cost, points, _, information = state
    inverse = np.linalg.inv(information)
    dragged: list[Field] = [
        inverse[:, :, places(sensor)] @ point.passed(one.blocks.centre, one.at._replace(own=mine))
        for sensor, (point, one, mine) in enumerate(zip(points, sensors, own, strict=True))
    ]
    return Lines(own, cost, inverse, points, dragged)


def alone_beside(blocks: Blocks, start: Parameters, doubt: Field) -> Joint:
    """Lines of one sensor beside a base and a transfer that are known."""
    found = each([Heard(blocks, start, doubt)])
    (dragged,) = found.dragged
    variance = np.einsum("npp->np", found.inverse) + np.sum(dragged @ doubt * dragged, axis=2)
    return Joint(
        start._replace(own=found.own[0]), float(np.sum(found.cost)), np.sqrt(variance), doubt
    )


def _passed_on(blocks: Blocks, start: Parameters) -> Joint:
    """The separation beside the likeliest pace of the transfer (MacKay's evidence); its error counts in all others."""
    pace, least = PACES
    joint = _scored(blocks, start, pace)
    for _ in range(MOST_PACES):
        change = rises(joint.doubt.shape[0] - 1)
        steps = change @ joint.parameters.transfer.coefficients[1:]
        told = steps.size - float(np.trace(change @ joint.doubt[1:, 1:] @ change.T)) / pace**2
        likelier = max(float(np.sqrt(steps @ steps / max(told, 1e-3))), least)
        if abs(np.log(likelier / pace)) < SAME_PACE:
            break
        pace = likelier
        joint = _scored(blocks, joint.parameters, pace)
    return joint
