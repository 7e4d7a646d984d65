"""Indicators measured on the simulated rig: failures and errors over SNR, intervals, wear stages.

`python -m benchmarks.indicators` runs this part alone; `--fast` uses a twentieth of the series.
"""

import argparse
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from time import perf_counter
from typing import NamedTuple

import numpy as np

from asperity.core.signals import Spectrum
from asperity.paper import (
    SAMPLES_SQ_UM,
    SAMPLES_STD_UM,
    TRENDS,
    Disturbance,
    Rig,
    RigSettings,
    simulate_rig,
)
from asperity.resonance import (
    CleanSpectrum,
    Resonance,
    contact_resonance,
    remove_lines,
    series_resonances,
)
from asperity.trend import StageErrors, split_stages

SNRS = (20.0, 10.0, 6.0, 3.0, 0.0)
SERIES = 60
DURATION = 300.0
SEGMENT = 80_000
FAR = 100.0  # Hz; a larger error is a failure
NINETY = 1.6449
TRIALS = 400
FEW, FEWER = 12, 3  # series, where fewer suffice
CRF_STD = 15.0
KNEE, RANGE = 1.8, (1.68, 1.92)
STRUCTURE_SIZES = (
    0.3,
    1.0,
)  # height of the highest mode of a structure's transfer function over the direct path

Reading = Callable[["RigSpectra"], Sequence[Resonance]]


class RigSpectra(NamedTuple):
    """A rig, its spectra, and its spectra without tones."""

    rig: Rig
    spectra: list[Spectrum]
    clean: list[CleanSpectrum]


def lines(*, fast: bool = False) -> Iterator[str]:
    """Yield Markdown lines; `fast` uses a twentieth of the series and trials."""
    share = 20 if fast else 1
    yield (
        f"## Indicators: 12 samples x 5 repeats of {DURATION:g} s at 20 kHz, {SERIES // share}"
        " series per row\n"
    )
    yield from table_lines(SERIES // share)
    few, fewer = max(FEW // share, 1), max(FEWER // share, 1)
    yield f"\n## Indicators: single spectra, {fewer} series per row\n"
    yield from table_lines(fewer, (20.0, 6.0, 0.0), BY_ITSELF)
    yield f"\n## Indicators: short recordings of 10 s, {few} series per row\n"
    yield from table_lines(few, (10.0, 0.0), METHODS, duration_s=10.0)
    yield (
        "\n## Indicators: poor repeatability of the machine (modes' levels 0.3 dB, frequencies"
        f" 0.05 %), {few} series per row\n"
    )
    yield from table_lines(few, (6.0, 0.0), METHODS, mode_gain_db=0.3, mode_drift=5e-4)
    yield f"\n## Indicators: line transmitted by a structure, {few} series per row\n"
    yield from through_lines(few)
    yield f"\n## Stages: {TRIALS // share} trials per row, CRF standard deviation {CRF_STD:g} Hz\n"
    yield from stage_lines(TRIALS // share)


def drawn(snr_db: float, seed: int, *, duration_s: float = DURATION, **choices: float) -> Rig:
    disturbance = Disturbance(
        snr_db=snr_db,
        modes=int(np.random.default_rng(seed).integers(2, 7)),
        **choices,  # type: ignore[arg-type]
    )
    return simulate_rig(RigSettings(duration_s=duration_s, seed=seed), disturbance=disturbance)


def transferred(rig: Rig, size: float, seed: int) -> Rig:
    """Return the rig with its contact line passed through a structure.

    The transfer function is
    1 + 2 to 6 modes
    ^2 in the band, with damping ratios of 0.4 to 3 %.
    """
    rng = np.random.default_rng([5, seed])
    frequency = rig.recordings[0].frequency_hz
    passed = np.ones(frequency.size, dtype=complex)
    for _ in range(int(rng.integers(2, 7))):
        f0, damping = rng.uniform(*rig.band_hz), np.exp(rng.uniform(np.log(0.004), np.log(0.03)))
        height = size * rng.uniform(0.3, 1.0) * rng.choice([-1.0, 1.0])
        passed += (
            height * 2j * damping / (1.0 - (frequency / f0) ** 2 + 2j * damping * frequency / f0)
        )
    power = np.abs(passed) ** 2
    recordings = [
        replace(
            recording,
            contact_density=recording.contact_density * power,
            crfa=recording.crfa * float(np.interp(recording.crf_hz, frequency, power)),
        )
        for recording in rig.recordings
    ]
    return replace(rig, recordings=tuple(recordings))


def moved(rig: Rig, size: float, seed: int) -> Rig:
    """Return the same rig with the sensor moved to another place of the structure halfway."""
    first, second = transferred(rig, size, seed), transferred(rig, size, 1000 + seed)
    half = len(rig.recordings) // 2
    return replace(rig, recordings=(*first.recordings[:half], *second.recordings[half:]))


def through_lines(series: int) -> Iterator[str]:
    """Yield the errors of the joint separation with a structure between contact and sensor."""
    yield (
        "| recordings | modes up to | failures | error > 100 Hz | not found | CRF rms error [Hz] |"
        " stated [Hz] | CRFA rms error | CRFA median error | 90 % intervals cover CRF and CRFA | s"
        " a series |"
    )
    yield "|---|---|---|---|---|---|---|---|---|---|---|"
    for duration_s, name, way in (
        (10.0, "10 s", transferred),
        (DURATION, f"{DURATION:g} s", transferred),
        (10.0, "10 s, sensor moved halfway", moved),
    ):
        for size in STRUCTURE_SIZES:
            tally = Tally()
            for number in range(series):
                rig = way(drawn(6.0, 3000 + number, duration_s=duration_s), size, number)
                began = perf_counter()
                found = joint(spectra_of(rig))
                tally.seconds += (perf_counter() - began) / series
                tally.add(rig, found)
            yield f"| {name} | {size:g} | {tally.row()} |"


def spectra_of(rig: Rig) -> RigSpectra:
    first = rig.recordings[0]
    length = min(SEGMENT, round(first.duration_s * first.rate_hz))
    spectra = [recording.spectrum(length) for recording in rig.recordings]
    clean = [
        remove_lines(recording, shaft_hz=rig.shaft_hz, band_hz=rig.band_hz) for recording in spectra
    ]
    return RigSpectra(rig, spectra, clean)


def papers(spectra: RigSpectra) -> Sequence[Resonance]:
    """Return the highest point of the band after smoothing cubically over five points three
    times.
    """
    return [
        contact_resonance(spectrum, band_hz=spectra.rig.band_hz, method="peak")
        for spectrum in spectra.spectra
    ]


def alone(spectra: RigSpectra) -> Sequence[Resonance]:
    """Fit one oscillator line over a floor to each recording, tones removed."""
    return [
        contact_resonance(cleaned.spectrum, band_hz=spectra.rig.band_hz)
        for cleaned in spectra.clean
    ]


def modes(spectra: RigSpectra) -> Sequence[Resonance]:
    """Fit as many lines as each spectrum needs and return the strongest; tones removed."""
    return [
        contact_resonance(cleaned.spectrum, band_hz=spectra.rig.band_hz, method="modes")
        for cleaned in spectra.clean
    ]


def joint(spectra: RigSpectra) -> Sequence[Resonance]:
    """Separate fixed from moving lines in all recordings; tones removed."""
    return series_resonances(
        [cleaned.spectrum for cleaned in spectra.clean],
        band_hz=spectra.rig.band_hz,
        kept=[cleaned.kept for cleaned in spectra.clean],
    )


class Tally:
    """Errors of one method over many series."""

    def __init__(self) -> None:
        self.crf: list[float] = []
        self.crfa: list[float] = []
        self.crf_std: list[float] = []
        self.covered: list[tuple[bool, bool]] = []
        self.lost = self.wrong = self.all = 0
        self.seconds = 0.0

    def add(self, rig: Rig, found: Sequence[Resonance]) -> None:
        for true, resonance in zip(rig.recordings, found, strict=True):
            self.all += 1
            if not resonance.found:
                self.lost += 1
                continue
            error = resonance.crf_hz - true.crf_hz
            if abs(error) > FAR:
                self.wrong += 1
                continue
            relative = resonance.crfa / true.crfa - 1.0
            self.crf.append(error)
            self.crfa.append(relative)
            if np.isfinite(resonance.crf_std):
                self.crf_std.append(resonance.crf_std)
                self.covered.append(
                    (
                        abs(error) < NINETY * resonance.crf_std,
                        abs(resonance.crfa - true.crfa) < NINETY * resonance.crfa_std,
                    )
                )

    def row(self) -> str:
        def percent(count: int) -> str:
            return f"{100 * count / self.all:.1f} %"

        if self.covered:
            coverage = " and ".join(f"{100 * part:.0f} %" for part in np.mean(self.covered, axis=0))
            stated = f"{np.median(self.crf_std):.2f}"
        else:
            coverage, stated = "none stated", "none"
        rms = np.sqrt(np.mean(np.square(self.crf))) if self.crf else np.nan
        crfa = 100 * np.sqrt(np.mean(np.square(self.crfa))) if self.crfa else np.nan
        return (
            f"{percent(self.wrong + self.lost)} | {percent(self.wrong)} | {percent(self.lost)} |"
            f" {rms:.2f} | {stated} | {crfa:.1f} % |"
            f" {100 * np.median(self.crfa) if self.crfa else np.nan:+.1f} % | {coverage} |"
            f" {self.seconds:.1f}"
        )


METHODS: dict[str, Reading] = {"paper's highest point": papers, "joint": joint}
BY_ITSELF: dict[str, Reading] = {"one line": alone, "modes": modes}


def table_lines(
    series: int,
    snrs: Sequence[float] = SNRS,
    methods: Mapping[str, Reading] = METHODS,
    **choices: float,
) -> Iterator[str]:
    yield (
        "| SNR [dB] | method | failures | error > 100 Hz | not found | CRF rms error [Hz] | stated"
        " [Hz] | CRFA rms error | CRFA median error | 90 % intervals cover CRF and CRFA | s a"
        " series |"
    )
    yield "|---|---|---|---|---|---|---|---|---|---|---|"
    for snr_db in snrs:
        tallies = {name: Tally() for name in methods}
        for number in range(series):
            rig_spectra = spectra_of(drawn(snr_db, 1000 + number, **choices))
            for name, method in methods.items():
                began = perf_counter()
                found = method(rig_spectra)
                tallies[name].seconds += (perf_counter() - began) / series
                tallies[name].add(rig_spectra.rig, found)
        for name, tally in tallies.items():
            yield f"| {snr_db:g} | {name} | {tally.row()} |"


def stage_lines(trials: int) -> Iterator[str]:
    yield (
        "| truth | Sq | tests per sample | severe | running-in | no distinct stage | no change"
        " | break in 1.68 to 1.92 um | 90 % interval covers | sd of the break [um] |"
    )
    yield "|---|---|---|---|---|---|---|---|---|---|"
    truths: dict[str, Callable[[np.ndarray], np.ndarray]] = {
        "knee at 1.8 um": TRENDS["knee"],
        "saturating, length 0.5 um": saturating(0.5),
        "saturating, length 0.8 um": TRENDS["smooth"],
        "saturating, length 2 um": saturating(2.0),
        "CLR saturating, CRF its sixth root": lambda sq: (
            3879.0 * (0.95 - 0.77 * np.exp(-(sq * 1e6 - 0.54) / 0.9)).clip(0.02) ** (1 / 6)
        ),
        "Hill curve": lambda sq: 2500.0 + 1500.0 * sq**2 / (sq**2 + 0.8e-6**2),
        "straight line": lambda sq: 2921.93 + 300.0 * (sq * 1e6 - 0.54),
        "constant": TRENDS["constant"],
    }
    for name, truth in truths.items():
        for errors, tests in ((0.0, 1), (0.0, 5), (0.5, 5), (1.0, 5)):
            known = f"error {errors:g} times the published ±" if errors else "exact"
            yield f"| {name} | {known} | {tests} | {stage_row(truth, errors, tests, trials)} |"


def saturating(length_um: float) -> Callable[[np.ndarray], np.ndarray]:
    def truth(sq: np.ndarray) -> np.ndarray:
        grown = (1.0 - np.exp(-(sq * 1e6 - 0.54) / length_um)) / (1.0 - np.exp(-2.95 / length_um))
        return np.asarray(2921.93 + (3811.88 - 2921.93) * grown)

    return truth


def saturating_share(sq: np.ndarray) -> np.ndarray:
    share = 0.95 - 0.77 * np.exp(-(sq * 1e6 - 0.54) / 0.9)
    return np.asarray(3879.0 * share.clip(0.02) ** (1.0 / 6.0))


def stage_row(
    truth: Callable[[np.ndarray], np.ndarray], errors: float, tests: int, trials: int
) -> str:
    rng = np.random.default_rng(7)
    kinds: dict[str, int] = {}
    splits, covered = [], 0
    for _ in range(trials):
        true_sq = np.array(SAMPLES_SQ_UM) + errors * np.array(SAMPLES_STD_UM) * rng.standard_normal(
            12
        )
        crf = truth(np.repeat(true_sq, tests) * 1e-6) + CRF_STD * rng.standard_normal(12 * tests)
        x_std = np.repeat(SAMPLES_STD_UM, tests) * errors if errors else None
        found = split_stages(
            np.repeat(SAMPLES_SQ_UM, tests), crf, errors=StageErrors(crf_hz=CRF_STD, x=x_std)
        )
        kinds[found.kind] = kinds.get(found.kind, 0) + 1
        if found.found:
            splits.append(found.split)
            covered += found.interval[0] <= KNEE <= found.interval[1]
    order = ("severe", "running-in", "no distinct stage", "no change")
    shares = " | ".join(f"{100 * kinds.get(kind, 0) / trials:.1f} %" for kind in order)
    if truth is not TRENDS["knee"]:
        return f"{shares} | - | - | -"
    inside = sum(RANGE[0] <= split <= RANGE[1] for split in splits)
    return (
        f"{shares} | {100 * inside / trials:.1f} % | {100 * covered / max(len(splits), 1):.0f} % |"
        f" {np.std(splits):.3f}"
    )


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.indicators", description=__doc__)
    arguments.add_argument(
        "--fast", action="store_true", help="a twentieth of the series and trials"
    )
    for line in lines(fast=arguments.parse_args().fast):
        print(line, flush=True)
