"""Accuracy of wear stages determined from CRF, from the line's damping, or from both with one
break.

`python -m benchmarks.damping_stages` runs this part alone. Indicators scatter about known courses:
the paper's twelve rings, five tests each, standard deviation 15 Hz in CRF and 10 % in damping. In
the solved contact (library of benchmarks.damping) every ring has its own surface and other parts
damp with 0.01. A second table gives the damping from the joint separation of lines that move, or
hardly move.
"""

import argparse
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from asperity.core.arrays import Field
from asperity.paper import SAMPLES_SQ_UM, SAMPLES_STD_UM, Disturbance
from asperity.paper.rig_recording import GRID_HZ, RigTest, draw_background
from asperity.resonance import damping_objection, remove_lines, series_resonances
from asperity.trend import StageErrors, StageSource, split_stages
from asperity.vibration import ContactOscillator
from benchmarks.damping import (
    BAND_HZ,
    DURATION_S,
    HEAVY,
    RATE_HZ,
    REST,
    SEEDS,
    SEGMENT,
    Point,
    between,
    line_of,
    points,
)

TESTS, TRIALS = 5, 200
CRF_STD, DAMPING_STD = 15.0, 0.1  # Hz; relative
ENDS = (SAMPLES_SQ_UM[0], SAMPLES_SQ_UM[-1])
LOWEST, HIGHEST = 2921.93, 3811.88  # the paper's published CRFs
FULL_LOAD = 3834.0
SOURCES: tuple[StageSource, ...] = ("crf", "damping", "both")
KINDS = ("severe", "running-in", "no distinct stage", "no change", "disagree")

Course = Callable[[Field], Field]


class Truth(NamedTuple):
    """CRF [Hz] and damping ratio over Sq [um], and the break of each, if any."""

    name: str
    crf: Course
    damping: Course
    knee: float | None = None


def frequency(knee: float, up: bool = True) -> Course:
    ends = (LOWEST, 3640.0, HIGHEST) if up else (HIGHEST, 3093.0, LOWEST)
    return lambda sq: np.interp(sq, (ENDS[0], knee, ENDS[1]), ends)


def width(knee: float, down: bool = True) -> Course:
    ends = np.log((0.04, 0.014, 0.012) if down else (0.012, 0.034, 0.04))
    return lambda sq: np.asarray(np.exp(np.interp(sq, (ENDS[0], knee, ENDS[1]), ends)))


def level(value: float) -> Course:
    return lambda sq: np.full(sq.shape, value)


def smooth(first: float, last: float) -> Course:
    def course(sq: Field) -> Field:
        grown = (1.0 - np.exp(-(sq - ENDS[0]) / 0.8)) / (1.0 - np.exp(-(ENDS[1] - ENDS[0]) / 0.8))
        return np.asarray(first + (last - first) * grown)

    return course


TRUTHS = (
    Truth("both break at 1.8 um", frequency(1.8), width(1.8), 1.8),
    Truth("CRF level, damping breaks at 1.8 um", level(3400.0), width(1.8), 1.8),
    Truth("CRF breaks at 1.8 um, damping level", frequency(1.8), level(0.02), 1.8),
    Truth("CRF breaks at 1.31 um, damping at 2.43 um", frequency(1.31), width(2.43)),
    Truth("both smooth", smooth(LOWEST, HIGHEST), smooth(0.04, 0.012)),
    Truth("both constant", level(3400.0), level(0.02)),
    Truth("CRF breaks at 1.8 um, damping rises", frequency(1.8), width(1.8, down=False)),
)


def lines(*, fast: bool = False) -> Iterator[str]:
    """Yield Markdown lines."""
    yield f"## Stages from CRF, damping and both, {TRIALS} trials per row\n"
    heads = [
        "truth",
        "source",
        *(f"classed: {kind}" for kind in KINDS),
        "break, mean ± sd [um]",
        "90 % interval covers",
    ]
    yield f"| {' | '.join(heads)} |"
    yield "|---" * len(heads) + "|"
    trials = TRIALS // 5 if fast else TRIALS
    for truth in TRUTHS:
        drawn = [draws(truth, np.random.default_rng([7, number])) for number in range(trials)]
        yield from rows(truth.name, truth.knee, drawn)
    library = points(SEEDS)
    for law in ("by the contact's own stiffness", "by (CLR F)^(1/6)"):
        drawn = [
            solved(library, law, np.random.default_rng([8, number])) for number in range(trials)
        ]
        yield from rows(f"the solved contact, CRF {law}", None, drawn)
    yield from width_lines(fast=fast)


def draws(truth: Truth, rng: np.random.Generator) -> tuple[Field, Field]:
    """Return CRF and damping of every test."""
    sq = np.repeat(SAMPLES_SQ_UM, TESTS)
    return scattered(truth.crf(sq), truth.damping(sq), rng)


def solved(library: Sequence[Point], law: str, rng: np.random.Generator) -> tuple[Field, Field]:
    """Return CRF and damping of rings with surfaces from the library."""
    seeds = sorted({point.seed for point in library})
    rings = np.array([between(library, sq, int(rng.choice(seeds))) for sq in SAMPLES_SQ_UM])
    clr, stiffness, damping = np.repeat(rings, TESTS, axis=0).T
    crf = FULL_LOAD * np.maximum(clr, 0.02) ** (1.0 / 6.0)
    if law.startswith("by the contact"):  # mass 1 kg, in hertz
        crf = np.sqrt(stiffness) / (2.0 * np.pi)
    return scattered(crf, REST + damping, rng)


def scattered(crf: Field, damping: Field, rng: np.random.Generator) -> tuple[Field, Field]:
    return crf + CRF_STD * rng.standard_normal(crf.size), damping * np.exp(
        DAMPING_STD * rng.standard_normal(damping.size)
    )


def rows(name: str, knee: float | None, drawn: Sequence[tuple[Field, Field]]) -> Iterator[str]:
    sq = np.repeat(SAMPLES_SQ_UM, TESTS)
    for source in SOURCES:
        found = [
            split_stages(
                sq,
                crf,
                damping_ratio=damping,
                errors=StageErrors(crf_hz=CRF_STD, damping_ratio=DAMPING_STD * damping),
                source=source,
            )
            for crf, damping in drawn
        ]
        share = [100.0 * np.mean([result.kind == kind for result in found]) for kind in KINDS]
        broken = [result for result in found if result.found]
        splits = np.array([result.split for result in broken])
        place = (
            f"{splits.mean():.2f} ± {splits.std():.2f}" if len(broken) > 0.1 * len(found) else "-"
        )
        covers = "-"
        if knee is not None and place != "-":
            inside = [stages.interval[0] <= knee <= stages.interval[1] for stages in broken]
        covers = f"{100.0 * np.mean(inside):.0f} %"
        yield (
            f"| {name} | {source} | {' | '.join(f'{part:.0f} %' for part in share)} | {place} |"
            f" {covers} |"
        )


WIDTH_SERIES, REPEATS = 6, 3
STIFFNESS = 3.32e8  # N/m: 2900 Hz


def width_lines(*, fast: bool = False) -> Iterator[str]:
    """Yield errors of damping from the joint separation, for lines that move or hardly move."""
    count = WIDTH_SERIES // 3 if fast else WIDTH_SERIES
    yield (
        f"\n## Damping by the joint separation, {count} series of {len(SAMPLES_SQ_UM) * REPEATS}"
        " recordings per row\n"
    )
    heads = [
        "damping",
        "frequency scatters by",
        "found",
        "of these, stationary",
        "error, mean and rms",
        "stated",
        "covered",
    ]
    yield f"| {' | '.join(heads)} |"
    yield "|---" * len(heads) + "|"
    for name, law in (("falls from 0.04 to 0.012", width(1.8)), ("constant at 0.02", level(0.02))):
        for scatter in (0.0, 0.002, 0.005, 0.02):
            rows_of_series = [
                row for number in range(count) for row in judged(law, scatter, number)
            ]
            damping_rows = [row for row in rows_of_series if row is not None]
            off, stated, stationary = (np.array(part) for part in zip(*damping_rows, strict=True))
            covered = np.mean(np.abs(off) < 1.645 * stated)
            cells = [
                f"{100 * part:.1f} %"
                for part in (np.mean(off), np.sqrt(np.mean(off**2)), np.median(stated))
            ]
            found = f"{100 * len(damping_rows) / len(rows_of_series):.0f} %"
            yield (
                f"| {name} | {100 * scatter:g} % | {found} | {100 * np.mean(stationary):.0f} % |"
                f" {cells[0]}, {cells[1]} | {cells[2]} | {100 * covered:.0f} % |"
            )


def judged(law: Course, scatter: float, number: int) -> Iterator[tuple[float, float, bool] | None]:
    """Yield log of found over true damping, its deviation, and True for a stationary line."""
    rng = np.random.default_rng([11, number])
    frequency = np.arange(0.0, RATE_HZ / 2.0 + GRID_HZ, GRID_HZ)
    disturbance = Disturbance(snr_db=10.0, modes=4)
    background = draw_background(frequency, BAND_HZ, disturbance, rng)
    truth, clean = [], []
    for sample, (sq, std) in enumerate(zip(SAMPLES_SQ_UM, SAMPLES_STD_UM, strict=True)):
        for test in range(REPEATS):
            ratio = float(law(np.array([sq]))[0]) * float(np.exp(0.03 * rng.standard_normal()))
            stiffness = STIFFNESS * (1.0 + scatter * rng.standard_normal()) ** 2
            spring = ContactOscillator(
                mass=HEAVY, stiffness=stiffness, damping_ratio=ratio, load=500.0
            )
            about = RigTest(sample + 1, test + 1, sq * 1e-6, std * 1e-6, RATE_HZ, DURATION_S)
            recording = background.recorded(
                about, line_of(spring, sq, 0.5, frequency), disturbance, rng
            )
            truth.append(ratio)
            clean.append(remove_lines(recording.spectrum(SEGMENT), shaft_hz=(60.0,)))
    found = series_resonances(
        [cleaned.spectrum for cleaned in clean],
        band_hz=BAND_HZ,
        kept=[cleaned.kept for cleaned in clean],
    )
    for ratio, resonance, cleaned in zip(truth, found, clean, strict=True):
        known = damping_objection(resonance, cleaned.spectrum.resolution_hz) is None
        own = resonance.damping_ratio
        stationary = "keeps its frequency" in resonance.reason
        yield (
            (float(np.log(own / ratio)), resonance.damping_ratio_std / own, stationary)
            if known
            else None
        )


def main() -> None:
    """Print the tables as Markdown."""
    arguments = argparse.ArgumentParser(
        prog="python -m benchmarks.damping_stages", description=__doc__
    )
    arguments.add_argument("--fast", action="store_true", help="use a fifth of the trials")
    with threadpool_limits(1):
        for line in lines(fast=arguments.parse_args().fast):
            print(line, flush=True)


if __name__ == "__main__":
    main()
