"""Search for lines by templates on coarse blocks: the initial guess of every fit."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from asperity.core.arrays import Field
from asperity.resonance.resonance import line_shape
from asperity.resonance.spectrum_model import PRIOR_DAMPING, PRIOR_DAMPING_STD, SpectrumBlocks

COARSE_BLOCKS = 160
DAMPINGS = np.geomspace(0.006, 0.08, 6)  # of the search
LEVELS = np.geomspace(0.03, 3e3, 21)  # of the search: a line's height over the base below it


class Templates(NamedTuple):
    """Candidate lines: natural frequency, damping, and shape on the blocks (templates, blocks)."""

    f0: Field
    damping: Field
    shape: Field


class TemplateModel(NamedTuple):
    """1/M and ln M, (templates, blocks), of lines of one height over a base of 1."""

    inverse: Field
    logarithm: Field


def coarser(blocks: SpectrumBlocks) -> SpectrumBlocks:
    """Return the spectra in fewer blocks, for searches."""
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
    return SpectrumBlocks(
        blocks.centre[: count * size].reshape(count, size).mean(axis=1), mean, total
    )


def line_templates(centre: Field) -> Templates:
    """Return candidate lines at every block, of several damping ratios."""
    f0, damping = (part.ravel() for part in np.meshgrid(centre, DAMPINGS, indexing="ij"))
    return Templates(f0, damping, line_shape(centre, f0[:, None], damping[:, None]))


def template_models(base: Field, templates: Templates, centre: Field) -> Iterator[TemplateModel]:
    """Yield M = 1 + a L B(f0)/B for every height a of the search."""
    relative_height = templates.shape * (base[_nearest(centre, templates)][:, None] / base)
    for height in LEVELS:
        model = 1.0 + height * relative_height
        yield TemplateModel(1.0 / model, np.log(model))


def _nearest(centre: Field, templates: Templates) -> npt.NDArray[np.intp]:
    return np.searchsorted(centre, templates.f0).clip(0, centre.size - 1)


def _damping_prior(templates: Templates) -> Field:
    return np.asarray(0.5 * (np.log(templates.damping / PRIOR_DAMPING) / PRIOR_DAMPING_STD) ** 2)


def search(
    blocks: SpectrumBlocks,
    base: Field,
    templates: Templates,
    prepared_models: Iterable[TemplateModel] | None = None,
) -> tuple[Field, Field]:
    """Return -ln likelihoods of a line at each template, and the best ln A and ln g.

    Shapes (recordings, templates) and (recordings, templates, 2). With P = g B M the best gain is
    the mean of D/(B M), which leaves two matrix products. `prepared_models` are `template_models`
    computed before.
    """
    local_base = base[_nearest(blocks.centre, templates)]
    weight = blocks.weight
    relative = weight * blocks.density / base
    total = weight.sum(axis=1)[:, None]
    constant = (weight @ np.log(base))[:, None]
    lowest = np.full((blocks.density.shape[0], templates.f0.size), np.inf)
    values = np.zeros((*lowest.shape, 2))
    prior = _damping_prior(templates)
    models = prepared_models or template_models(base, templates, blocks.centre)
    for height, model in zip(LEVELS, models, strict=True):
        precision = model.inverse.dtype  # mixed precisions would copy the larger matrix
        log_gain = np.log(relative.astype(precision) @ model.inverse.T / total)
        cost = (
            weight.astype(precision) @ model.logarithm.T
            + total * (log_gain + 1.0)
            + constant
            + prior
        )
        better = cost < lowest
        lowest = np.where(better, cost, lowest)
        level = np.log(height * local_base) + log_gain
        values = np.where(better[..., None], np.stack([level, log_gain], axis=-1), values)
    return lowest, values


def best_of(cost: Field, values: Field, templates: Templates) -> Field:
    """Return ln A, ln f, ln ζ, ln g of the most likely template of each recording."""
    best = np.argmin(cost, axis=1)
    rows = np.arange(best.size)
    level, gain = values[rows, best].T
    return np.stack(
        [level, np.log(templates.f0[best]), np.log(templates.damping[best]), gain], axis=1
    )


def lines_at_templates(
    blocks: SpectrumBlocks, base: Field, templates: Templates, best: npt.NDArray[np.intp]
) -> Field:
    """Return ln A, ln f, ln ζ, ln g at given templates, one per recording."""
    rows = []
    for row, number in enumerate(best):
        template = Templates(
            templates.f0[[number]], templates.damping[[number]], templates.shape[[number]]
        )
        single = SpectrumBlocks(blocks.centre, blocks.density[[row]], blocks.weight[[row]])
        rows.append(best_of(*search(single, base, template), template)[0])
    return np.array(rows).reshape(-1, 4)
