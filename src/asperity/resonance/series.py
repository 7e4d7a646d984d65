"""The contact resonance in every recording of a series: what stays is the machine, what moves is the contact.

One spectrum alone cannot tell a structural mode from the contact's; a series can. `separation`
fits, and what it found is judged here. docs/theory/indicators.md has the equations and how often
it is right.
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
from asperity.resonance.indicators import (
    STRONG_EVIDENCE,
    IndicatorMethod,
    contact_resonance,
    require_band,
)
from asperity.resonance.residuals import Witnesses, brought, left_over, witnesses_of
from asperity.resonance.resonance import Resonance, fitted_resonance, no_resonance
from asperity.resonance.sensor_change import moved_at
from asperity.resonance.separation import (
    Joint,
    Model,
    Templates,
    beside,
    coarser,
    models,
    separate,
    templates_on,
)
from asperity.resonance.spectrum_model import Blocks, expected_density, whittle_costs
from asperity.resonance.transfer import SPLINES, Transfer

SeriesMethod = Literal["joint", IndicatorMethod]

FEWEST_RECORDINGS = 6
MOST_BLOCKS = 600
LARGEST_MISFIT = 0.3  # rms, beyond chance, of what the model leaves of a spectrum
HEAVIEST_DAMPING = (
    0.1  # of a contact: 0.01 dry to 0.1 in boundary lubrication, the paper's section 2.1
)
STANDING = 0.1  # standard deviation of a line's places over its width, below which it does not move
MOVES = "moves against what all recordings share"
STANDS = "keeps its place and changes its height; CRFA is the part that changes, a lower bound"
SAME_SPACING = 1e-9
TENFOLD = float(np.log(10.0))  # change of a line across the band that a structure has to make
RIVAL = 10.0  # ln likelihood by which the place found must beat every other place in the band


@dataclass(frozen=True, eq=False, kw_only=True)
class Shared:
    """What all recordings of a series share, as some of them have settled it: enough to judge another beside them.

    `first`, `size` and `spacing_hz` say which lines stand in which blocks; `centre` [Hz] and
    `base` (ln density) are of blocks, shape (blocks,); `reach` [Hz], `transfer` and `doubt` of
    what the lines come through; `stands` and `shaped` as `Found` has them; `counts`, `change`,
    `by_chance` how far the recordings that settled it are from it, shape (recordings, blocks);
    `lacking` (blocks,) how far what was fitted to them.
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
        """Whether a spectrum has these lines."""
        end = self.first + self.size * self.centre.size
        return (
            end <= spectrum.frequency_hz.size
            and abs(spectrum.spacing_hz / self.spacing_hz - 1.0) < SAME_SPACING
        )

    @cached_property
    def _search(self) -> tuple[Templates, list[Model]]:
        """The search made ready; single precision, for it is some 30 MB and only begins the fit."""
        empty = np.ones((1, self.centre.size))
        coarse = coarser(Blocks(self.centre, empty, empty)).centre
        templates = templates_on(coarse)
        ready = models(np.exp(np.interp(coarse, self.centre, self.base)), templates, coarse)
        return templates, [Model(*(part.astype(np.float32) for part in model)) for model in ready]

    def resonances(
        self, spectra: Sequence[Spectrum], kept: Sequence[Mask] | None = None
    ) -> tuple[Resonance, ...]:
        """The contact resonance in each of further spectra, as `series_resonances` finds it.

        Raises
        ------
        BadInput
            for spectra on other lines, or without any vibration.
        """
        return separated_beside(self, spectra, kept).resonances


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
    """The resonances of a series, what its last part shares, and with which recordings a new part begins."""

    resonances: tuple[Resonance, ...]
    shared: Shared
    moved: tuple[int, ...]


class Separated(NamedTuple):
    """A series separated: its spectra in blocks, the fit, the resonances in it, and what it learned.

    `beside` says whether what it shares was known before.
    """

    blocks: Blocks
    found: "Found"
    resonances: tuple[Resonance, ...]
    shared: Shared
    beside: bool = False


def learn_series(
    spectra: Sequence[Spectrum], *, band_hz: tuple[float, float], kept: Sequence[Mask] | None = None
) -> LearnedSeries:
    """The joint separation of `series_resonances`, and what it learned, by which further spectra can be judged.

    Where what lies between contact and sensor changes, the recordings behind it are a series of
    their own.
    """
    whole = separated(spectra, band_hz=band_hz, kept=kept)
    first = moved_at(whole.blocks, whole.found.joint)
    if first is None:
        return LearnedSeries(whole.resonances, whole.shared, ())
    before, behind = (
        learn_series(spectra[part], band_hz=band_hz, kept=None if kept is None else kept[part])
        for part in (slice(first), slice(first, None))
    )
    moved = (*before.moved, first, *(first + one for one in behind.moved))
    return LearnedSeries(before.resonances + behind.resonances, behind.shared, moved)


def separated(
    spectra: Sequence[Spectrum], *, band_hz: tuple[float, float], kept: Sequence[Mask] | None = None
) -> Separated:
    """The joint separation of `series_resonances`, with all that it rests on."""
    if len(spectra) < FEWEST_RECORDINGS:
        raise BadInput(
            f"the joint separation needs at least {FEWEST_RECORDINGS} recordings to tell what stays from what moves, "
            f"got {len(spectra)}; take method likelihood or modes"
        )
    first = spectra[0]
    for spectrum in spectra:
        if (
            spectrum.frequency_hz.shape != first.frequency_hz.shape
            or spectrum.spacing_hz != first.spacing_hz
        ):
            raise BadInput(
                f"spectra of a series must have the same lines, got {spectrum.frequency_hz.size} every "
                f"{spectrum.spacing_hz:g} Hz beside {first.frequency_hz.size} every {first.spacing_hz:g} Hz; take one "
                "rate and one segment length for all"
            )
        if spectrum.smoothing_passes:
            raise BadInput(
                "the joint separation needs unsmoothed spectra; pass the spectra themselves"
            )
        inside = require_band(spectrum, band_hz)
    from threadpoolctl import threadpool_limits

    lines = np.flatnonzero(inside)
    size = -(-lines.size // MOST_BLOCKS)
    lines = lines[: lines.size // size * size]
    blocks = _blocked(spectra, lines, size, kept)
    silent = [is_silent(spectrum, band_hz) for spectrum in spectra]
    if any(silent):
        raise BadInput(
            f"recording {silent.index(True)} holds no vibration at all between {band_hz[0]:.0f} and "
            f"{band_hz[1]:.0f} Hz; leave it out"
        )
    with threadpool_limits(
        1, "blas"
    ):  # matrices too small for two threads: they would wait for one another
        separation = separate(blocks)
        joint = separation.joint
        witnesses = witnesses_of(blocks, joint, separation.witnesses)
        stands = _stands(joint, _evidence(blocks, joint)[0] > STRONG_EVIDENCE)
        found = Found(
            joint, separation.templates, separation.elsewhere, witnesses, stands, shaped=False
        )
        resonances = _judged(blocks, found, band_hz)
        if _shaped(joint, np.array([one.found for one in resonances])):
            found = found._replace(shaped=True)
            resonances = _judged(blocks, found, band_hz)
    shared = Shared(
        band_hz=band_hz,
        first=int(lines[0]),
        size=size,
        spacing_hz=first.spacing_hz,
        centre=blocks.centre,
        base=joint.parameters.base,
        reach=joint.parameters.transfer[:2],
        transfer=joint.parameters.transfer.coefficients,
        doubt=joint.doubt,
        stands=stands,
        shaped=found.shaped,
        counts=witnesses.counts,
        change=witnesses.change,
        by_chance=witnesses.by_chance,
        lacking=witnesses.lacking,
    )
    return Separated(blocks, found, resonances, shared)


def is_silent(spectrum: Spectrum, band_hz: tuple[float, float]) -> bool:
    """Whether a spectrum holds no vibration at all in the band."""
    return not np.any(spectrum.density[require_band(spectrum, band_hz)] > 0.0)


def separated_beside(
    shared: Shared, spectra: Sequence[Spectrum], kept: Sequence[Mask] | None = None
) -> Separated:
    """Further spectra separated by what a series has settled; otherwise as `Shared.resonances`."""
    for spectrum in spectra:
        if not shared.fits(spectrum):
            raise BadInput(
                f"a spectrum of {spectrum.frequency_hz.size} lines every {spectrum.spacing_hz:g} Hz is not of this "
                f"series, whose lines are {shared.spacing_hz:g} Hz apart; judge it by itself"
            )
    lines = shared.first + np.arange(shared.size * shared.centre.size)
    blocks = _blocked(spectra, lines, shared.size, kept)
    templates, ready = shared._search
    passed = Transfer(*shared.reach, shared.transfer)
    joint, elsewhere = beside(blocks, shared.base, passed, shared.doubt, templates, ready)
    witnesses = Witnesses(shared.counts, shared.change, shared.by_chance, shared.lacking)
    found = Found(joint, templates, elsewhere, witnesses, shared.stands, shared.shaped)
    return Separated(blocks, found, _judged(blocks, found, shared.band_hz), shared, beside=True)


def _blocked(
    spectra: Sequence[Spectrum], lines: npt.NDArray[np.intp], size: int, kept: Sequence[Mask] | None
) -> Blocks:
    count = lines.size // size
    shape = (len(spectra), count, size)
    density = np.stack([spectrum.density[lines] for spectrum in spectra]).reshape(shape)
    good = (
        np.ones(shape, dtype=bool)
        if kept is None
        else np.stack([mask[lines] for mask in kept]).reshape(shape)
    )
    share = good.sum(axis=2)
    averages = np.array([spectrum.averages for spectrum in spectra])[:, None]
    mean = np.where(
        share > 0, (density * good).sum(axis=2) / np.maximum(share, 1), density.mean(axis=2)
    )
    centre = spectra[0].frequency_hz[lines].reshape(count, size).mean(axis=1)
    return Blocks(centre, mean, averages * share)


class Found(NamedTuple):
    """A fit to be judged: lines and what they stand beside; -ln likelihood of a line at each template.

    `stands` is whether the line keeps its place, `shaped` whether it does so and is one by what it
    comes through alone.
    """

    joint: Joint
    templates: Templates
    elsewhere: Field
    witnesses: Witnesses
    stands: bool
    shaped: bool


def gain_of(blocks: Blocks, joint: Joint) -> tuple[Field, Field]:
    """Twice by how much a line beside what all share makes each recording likelier (ln); what all share alone."""
    bare = np.exp(joint.parameters.base)
    relative = np.sum(blocks.weight * blocks.density / bare, axis=1) / blocks.weight.sum(axis=1)
    alone = relative[:, None] * bare
    with_line = whittle_costs(blocks, expected_density(blocks, joint.parameters))
    return 2.0 * (whittle_costs(blocks, alone) - with_line), alone


def _evidence(blocks: Blocks, joint: Joint) -> tuple[Field, Field]:
    """By how much (BIC) a line beside what all share explains each recording better; what all share alone."""
    gain, alone = gain_of(blocks, joint)
    return gain - 3.0 * np.log(blocks.weight.sum(axis=1)), alone


def _stands(joint: Joint, significant: Mask) -> bool:
    """A line that keeps its place can lend any part of its height to what all recordings share."""
    own = joint.parameters.own
    places, widths = own[significant, 1], 2.0 * np.exp(own[significant, 2])
    return places.size > 0 and float(np.std(places)) < STANDING * float(np.median(widths))


def _shaped(joint: Joint, found: Mask) -> bool:
    """Lines that keep their place cannot tell a structure that shapes them: any change of a spectrum would be one."""
    passed = joint.parameters.transfer
    if not found.any() or not passed.coefficients.size:
        return False
    bent = (
        passed.columns(np.linspace(passed.low, passed.high, 10 * SPLINES))[:, 1:]
        @ passed.coefficients[1:]
    )
    return _stands(joint, found) and float(np.ptp(bent)) > TENFOLD


def _judged(blocks: Blocks, found: Found, band_hz: tuple[float, float]) -> tuple[Resonance, ...]:
    """Which of the lines are there, each with its reason."""
    joint = found.joint
    own, base, _ = joint.parameters
    evidence, alone = _evidence(blocks, joint)
    bare, expected = np.exp(base), expected_density(blocks, joint.parameters)
    beyond = brought(blocks, joint, found.witnesses)
    shared, std = beyond.lacking, np.hypot(joint.std, beyond.std)
    misfit = left_over(blocks, expected)
    way = STANDS if found.stands else MOVES
    resonances = []
    for i in range(own.shape[0]):
        fitted = np.exp(own[i])
        deviations = std[i, :3] * fitted[:3]
        _, f0, zeta, gain = (float(value) for value in fitted)
        rival = rival_of(f0, zeta, found.elsewhere[i], found.templates)
        line = JudgedLine(
            f0, float(deviations[1]), zeta, float(evidence[i]), float(misfit[i]), *rival
        )
        objection = objection_to(line, band_hz) or (_of_shape(f0) if found.shaped else None)
        if objection is not None:
            background = (blocks.centre, alone[i])
            resonances.append(
                no_resonance(
                    objection, band_hz, "joint", evidence=line.evidence, background=background
                )
            )
            continue
        resonances.append(
            fitted_resonance(
                fitted[:3],
                np.where([found.stands, False, False], np.nan, deviations),
                reason=f"a line {line.width:.0f} Hz wide {way} (BIC {line.evidence:+.0f})",
                band_hz=band_hz,
                method="joint",
                evidence=line.evidence,
                background=(blocks.centre, gain * bare),
                crf_shared_std=float(shared[i, 1] * f0),
            )
        )
    return tuple(resonances)


def _of_shape(f0: float) -> str:
    return (
        f"what stands out at {f0:.0f} Hz keeps its place and is a line only behind a structure that changes it tenfold "
        "across the band: the machine's own spectrum may change like that"
    )


class JudgedLine(NamedTuple):
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
        """Half-power width [Hz]."""
        return 2.0 * self.damping * self.f0


def rival_of(f0: float, damping: float, cost: Field, templates: Templates) -> tuple[float, float]:
    """The best place more than three widths away, and by how much the line's own is better."""
    away = np.abs(templates.f0 - f0) > 6.0 * damping * f0
    if np.all(away) or not np.any(away):
        return np.nan, np.inf
    return float(templates.f0[away][np.argmin(cost[away])]), float(
        np.min(cost[away]) - np.min(cost[~away])
    )


def objection_to(line: JudgedLine, band_hz: tuple[float, float]) -> str | None:
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
        return f"the line at {line.f0:.0f} Hz is wider than half the band ({line.width:.0f} Hz): a slope, not a resonance"
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
