"""The contact resonance in every recording of a series: what is constant belongs to the machine.

A single spectrum cannot tell a structural mode from the contact's line; a series can. `separation`
fits, and the lines are judged here. docs/theory/indicators.md has the equations and the measured
error rates.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, NamedTuple, get_args

import numpy as np
import numpy.typing as npt

from asperity.core.arrays import Field, Mask
from asperity.core.errors import BadInput
from asperity.core.signals import Spectrum
from asperity.resonance.band_fit import STRONG_EVIDENCE
from asperity.resonance.indicators import IndicatorMethod, contact_resonance, require_band
from asperity.resonance.line_fit import JointFit
from asperity.resonance.line_judgement import JudgedLine, best_rival, line_gain, line_objection
from asperity.resonance.residuals import (
    ResidualStatistics,
    relative_residual,
    residual_statistics,
    systematic_errors,
)
from asperity.resonance.resonance import Resonance, fitted_resonance, no_resonance
from asperity.resonance.sensor_change import first_moved_recording
from asperity.resonance.separation import fit_to_shared, separate
from asperity.resonance.spectrum_model import SpectrumBlocks, expected_density
from asperity.resonance.template_search import (
    TemplateModel,
    Templates,
    coarser,
    line_templates,
    template_models,
)
from asperity.resonance.transfer import SPLINES, Transfer

SeriesMethod = Literal["joint", IndicatorMethod]

FEWEST_RECORDINGS = 6
MOST_BLOCKS = 600
# standard deviation of a line's frequency over its width below which it does not move
PLACE_SPREAD = 0.1
LINE_MOVES = "moves relative to the shared spectrum"
LINE_KEEPS_PLACE = (
    "keeps its frequency and changes its height; CRFA is the changing part, a lower bound"
)
SAME_SPACING = 1e-9
# change of ln T across the band above which the transfer shapes the line
TRANSFER_CHANGE = float(np.log(10.0))


@dataclass(frozen=True, eq=False, kw_only=True)
class Shared:
    """Spectrum that all recordings of a series share, sufficient to judge further recordings.

    `first`, `size` and `spacing_hz` define the lines of each block; `centre` [Hz] and `base` (ln
    density) belong to the blocks, shape (blocks,); `reach` [Hz], `transfer` and `doubt`
    (covariance) to the transfer; `stands` and `shaped` are as in `SeriesFit`; `counts`, `change`,
    `by_chance`, shape (recordings, blocks), and `lacking`, shape (blocks,), are the
    `ResidualStatistics` of the recordings fitted.
    """

    band_hz: tuple[float, float]
    first: int
    size: int
    spacing_hz: float
    centre: Field
    base: Field
    reach: tuple[float, float]
    transfer: Field
    doubt: Field
    stands: bool
    shaped: bool
    counts: Mask
    change: Field
    by_chance: Field
    lacking: Field

    def fits(self, spectrum: Spectrum) -> bool:
        """Return whether a spectrum has these lines."""
        end = self.first + self.size * self.centre.size
        return (
            end <= spectrum.frequency_hz.size
            and abs(spectrum.spacing_hz / self.spacing_hz - 1.0) < SAME_SPACING
        )

    @cached_property
    def _search(self) -> tuple[Templates, list[TemplateModel]]:
        """Prepared template search, in single precision (some 30 MB): it only starts the fit."""
        empty = np.ones((1, self.centre.size))
        coarse = coarser(SpectrumBlocks(self.centre, empty, empty)).centre
        templates = line_templates(coarse)
        prepared = template_models(
            np.exp(np.interp(coarse, self.centre, self.base)), templates, coarse
        )
        return templates, [
            TemplateModel(*(part.astype(np.float32) for part in model)) for model in prepared
        ]

    def resonances(
        self, spectra: Sequence[Spectrum], kept: Sequence[Mask] | None = None
    ) -> tuple[Resonance, ...]:
        """Find the contact resonance in each of further spectra, as `series_resonances` does.

        Raises
        ------
        BadInput
            for spectra on other lines, or without vibration.
        """
        return separate_with_shared(self, spectra, kept).resonances


def series_resonances(
    spectra: Sequence[Spectrum],
    *,
    band_hz: tuple[float, float],
    method: SeriesMethod = "joint",
    kept: Sequence[Mask] | None = None,
) -> tuple[Resonance, ...]:
    """Find the contact resonance in each of `spectra`, in the same order.

    Parameters
    ----------
    band_hz : search band [Hz]
    method : "joint" separates the spectrum common to all from a line that moves or changes its
        height, and needs 6 spectra; any method of `contact_resonance` takes each spectrum alone
    kept : masks (lines,) of the lines to use, such as `CleanSpectrum.kept`; all by default

    Raises
    ------
    BadInput
        for an unknown method, too few spectra for "joint", spectra on different frequencies, a band
        that does not fit them, values that are not finite.
    """
    if method not in get_args(SeriesMethod):
        raise BadInput(
            f"series method must be one of {', '.join(get_args(SeriesMethod))}, got {method!r}"
        )
    if method != "joint":
        return tuple(
            contact_resonance(spectrum, band_hz=band_hz, method=method) for spectrum in spectra
        )
    return learn_series(spectra, band_hz=band_hz, kept=kept).resonances


class LearnedSeries(NamedTuple):
    """Resonances of a series, the spectrum shared by its last part, and where new parts start."""

    resonances: tuple[Resonance, ...]
    shared: Shared
    moved: tuple[int, ...]


class SeparatedSeries(NamedTuple):
    """A separated series: block averages, the fit, the resonances, and the shared spectrum.

    `uses_shared` states whether the shared spectrum was known before.
    """

    blocks: SpectrumBlocks
    fit: "SeriesFit"
    resonances: tuple[Resonance, ...]
    shared: Shared
    uses_shared: bool = False


def learn_series(
    spectra: Sequence[Spectrum], *, band_hz: tuple[float, float], kept: Sequence[Mask] | None = None
) -> LearnedSeries:
    """Return the result of `series_resonances` and the shared spectrum for judging further spectra.

    Where the transfer from contact to sensor changes, the recordings from there on are treated as a
    series of their own.
    """
    separated = separate_series(spectra, band_hz=band_hz, kept=kept)
    first = first_moved_recording(separated.blocks, separated.fit.joint)
    if first is None:
        return LearnedSeries(separated.resonances, separated.shared, ())
    before, after = (
        learn_series(spectra[part], band_hz=band_hz, kept=None if kept is None else kept[part])
        for part in (slice(first), slice(first, None))
    )
    moved = (*before.moved, first, *(first + number for number in after.moved))
    return LearnedSeries(before.resonances + after.resonances, after.shared, moved)


def separate_series(
    spectra: Sequence[Spectrum], *, band_hz: tuple[float, float], kept: Sequence[Mask] | None = None
) -> SeparatedSeries:
    """Return the joint separation of `series_resonances` with all its parts."""
    if len(spectra) < FEWEST_RECORDINGS:
        raise BadInput(
            f"the joint separation needs at least {FEWEST_RECORDINGS} recordings, got "
            f"{len(spectra)}; use method likelihood or modes"
        )
    for spectrum in spectra:
        _require_same_lines(spectrum, spectra[0])
        inside = require_band(spectrum, band_hz)
    from threadpoolctl import threadpool_limits

    lines = np.flatnonzero(inside)
    size = -(-lines.size // MOST_BLOCKS)
    lines = lines[: lines.size // size * size]
    blocks = _block_average(spectra, lines, size, kept)
    empty = [has_no_vibration(spectrum, band_hz) for spectrum in spectra]
    if any(empty):
        raise BadInput(
            f"recording {empty.index(True)} holds no vibration between {band_hz[0]:.0f} and "
            f"{band_hz[1]:.0f} Hz; leave it out"
        )
    with threadpool_limits(1, "blas"):  # the matrices are too small for several threads
        fit, resonances = _fit_series(blocks, band_hz)
    transfer = fit.joint.parameters.transfer
    shared = Shared(
        band_hz=band_hz,
        first=int(lines[0]),
        size=size,
        spacing_hz=spectra[0].spacing_hz,
        centre=blocks.centre,
        base=fit.joint.parameters.base,
        reach=transfer[:2],
        transfer=transfer.coefficients,
        doubt=fit.joint.transfer_covariance,
        stands=fit.stands,
        shaped=fit.shaped,
        counts=fit.statistics.counted,
        change=fit.statistics.relative_change,
        by_chance=fit.statistics.chance_variance,
        lacking=fit.statistics.model_error,
    )
    return SeparatedSeries(blocks, fit, resonances, shared)


def _require_same_lines(spectrum: Spectrum, first: Spectrum) -> None:
    if (
        spectrum.frequency_hz.shape != first.frequency_hz.shape
        or spectrum.spacing_hz != first.spacing_hz
    ):
        raise BadInput(
            f"spectra of a series must have the same lines, got {spectrum.frequency_hz.size} every "
            f"{spectrum.spacing_hz:g} Hz and {first.frequency_hz.size} every {first.spacing_hz:g} "
            "Hz; use one rate and one segment length for all"
        )
    if spectrum.smoothing_passes:
        raise BadInput("the joint separation needs unsmoothed spectra; pass the spectra themselves")


def _fit_series(
    blocks: SpectrumBlocks, band_hz: tuple[float, float]
) -> tuple["SeriesFit", tuple[Resonance, ...]]:
    """Return the fit of a series and the line of each recording."""
    separation = separate(blocks)
    joint = separation.joint
    fit = SeriesFit(
        joint,
        separation.templates,
        separation.template_costs,
        residual_statistics(blocks, joint, separation.reference_rows),
        stands=_keeps_place(joint, _line_evidence(blocks, joint)[0] > STRONG_EVIDENCE),
        shaped=False,
    )
    resonances = _judge_lines(blocks, fit, band_hz)
    if _shaped_by_transfer(joint, np.array([resonance.found for resonance in resonances])):
        fit = fit._replace(shaped=True)
        resonances = _judge_lines(blocks, fit, band_hz)
    return fit, resonances


def has_no_vibration(spectrum: Spectrum, band_hz: tuple[float, float]) -> bool:
    """Return whether a spectrum is zero in the whole band."""
    return not np.any(spectrum.density[require_band(spectrum, band_hz)] > 0.0)


def separate_with_shared(
    shared: Shared, spectra: Sequence[Spectrum], kept: Sequence[Mask] | None = None
) -> SeparatedSeries:
    """Separate further spectra with the shared spectrum held; otherwise as `Shared.resonances`."""
    for spectrum in spectra:
        if not shared.fits(spectrum):
            raise BadInput(
                f"a spectrum of {spectrum.frequency_hz.size} lines every {spectrum.spacing_hz:g} "
                f"Hz does not belong to this series, whose lines are {shared.spacing_hz:g} Hz "
                "apart; judge it separately"
            )
    lines = shared.first + np.arange(shared.size * shared.centre.size)
    blocks = _block_average(spectra, lines, shared.size, kept)
    templates, prepared = shared._search
    transfer = Transfer(*shared.reach, shared.transfer)
    joint, template_costs = fit_to_shared(
        blocks, shared.base, transfer, shared.doubt, templates, prepared
    )
    statistics = ResidualStatistics(shared.counts, shared.change, shared.by_chance, shared.lacking)
    fit = SeriesFit(joint, templates, template_costs, statistics, shared.stands, shared.shaped)
    return SeparatedSeries(
        blocks, fit, _judge_lines(blocks, fit, shared.band_hz), shared, uses_shared=True
    )


def _block_average(
    spectra: Sequence[Spectrum], lines: npt.NDArray[np.intp], size: int, kept: Sequence[Mask] | None
) -> SpectrumBlocks:
    count = lines.size // size
    shape = (len(spectra), count, size)
    density = np.stack([spectrum.density[lines] for spectrum in spectra]).reshape(shape)
    used = (
        np.ones(shape, dtype=bool)
        if kept is None
        else np.stack([mask[lines] for mask in kept]).reshape(shape)
    )
    used_lines = used.sum(axis=2)
    averages = np.array([spectrum.averages for spectrum in spectra])[:, None]
    mean = np.where(
        used_lines > 0,
        (density * used).sum(axis=2) / np.maximum(used_lines, 1),
        density.mean(axis=2),
    )
    centre = spectra[0].frequency_hz[lines].reshape(count, size).mean(axis=1)
    return SpectrumBlocks(centre, mean, averages * used_lines)


class SeriesFit(NamedTuple):
    """Fit of a series to be judged: joint fit, templates and their costs, residual statistics.

    `stands` states whether the line keeps its frequency, `shaped` whether it does and is a line
    only through the fitted transfer.
    """

    joint: JointFit
    templates: Templates
    template_costs: Field
    statistics: ResidualStatistics
    stands: bool
    shaped: bool


def _line_evidence(blocks: SpectrumBlocks, joint: JointFit) -> tuple[Field, Field]:
    """Return the BIC gained by the line of each recording, and the density without it."""
    gain, without_line = line_gain(blocks, joint)
    return gain - 3.0 * np.log(blocks.weight.sum(axis=1)), without_line


def _keeps_place(joint: JointFit, significant: Mask) -> bool:
    """Return whether the line keeps its frequency; the base can then absorb part of its height."""
    values = joint.parameters.own
    frequencies = values[significant, 1]
    widths = 2.0 * np.exp(values[significant, 2])
    return frequencies.size > 0 and float(np.std(frequencies)) < PLACE_SPREAD * float(
        np.median(widths)
    )


def _shaped_by_transfer(joint: JointFit, detected: Mask) -> bool:
    """Return whether a line that keeps its frequency is shaped by the transfer.

    A change of the machine's spectrum could then look like a line.
    """
    transfer = joint.parameters.transfer
    if not detected.any() or not transfer.coefficients.size:
        return False
    transfer_shape = (
        transfer.columns(np.linspace(transfer.low, transfer.high, 10 * SPLINES))[:, 1:]
        @ transfer.coefficients[1:]
    )
    return _keeps_place(joint, detected) and float(np.ptp(transfer_shape)) > TRANSFER_CHANGE


def _judge_lines(
    blocks: SpectrumBlocks, fit: SeriesFit, band_hz: tuple[float, float]
) -> tuple[Resonance, ...]:
    """Return each recording's line, or the reason why it is not accepted."""
    joint = fit.joint
    evidence, without_line = _line_evidence(blocks, joint)
    errors = systematic_errors(blocks, joint, fit.statistics)
    std = np.hypot(joint.std, errors.std)[:, :3]
    behaviour = LINE_KEEPS_PLACE if fit.stands else LINE_MOVES
    resonances = []
    for i, line in enumerate(_judged_lines(blocks, fit, evidence, std)):
        objection = line_objection(line, band_hz) or _shape_objection(fit, line)
        if objection is not None:
            background = (blocks.centre, without_line[i])
            resonance = no_resonance(
                objection, band_hz, "joint", evidence=line.evidence, background=background
            )
        else:
            fitted = np.exp(joint.parameters.own[i])
            resonance = fitted_resonance(
                fitted[:3],
                np.where([fit.stands, False, False], np.nan, std[i] * fitted[:3]),
                reason=f"a line {line.width:.0f} Hz wide {behaviour} (BIC {line.evidence:+.0f})",
                band_hz=band_hz,
                method="joint",
                evidence=line.evidence,
                background=(blocks.centre, float(fitted[3]) * np.exp(joint.parameters.base)),
                crf_shared_std=float(errors.model_error[i, 1] * line.f0),
            )
        resonances.append(resonance)
    return tuple(resonances)


def _judged_lines(
    blocks: SpectrumBlocks, fit: SeriesFit, evidence: Field, std: Field
) -> list[JudgedLine]:
    """Return the criteria of each recording's line."""
    parameters = fit.joint.parameters
    misfit = relative_residual(blocks, expected_density(blocks, parameters))
    lines = []
    for i, values in enumerate(parameters.own):
        _, f0, zeta, _ = (float(value) for value in np.exp(values))
        rival = best_rival(f0, zeta, fit.template_costs[i], fit.templates)
        f0_std = float(std[i, 1]) * f0
        lines.append(JudgedLine(f0, f0_std, zeta, float(evidence[i]), float(misfit[i]), *rival))
    return lines


def _shape_objection(fit: SeriesFit, line: JudgedLine) -> str | None:
    if not fit.shaped:
        return None
    return (
        f"the peak at {line.f0:.0f} Hz keeps its frequency and is a line only if the transfer "
        "changes tenfold across the band; the machine's own spectrum may change like that"
    )
