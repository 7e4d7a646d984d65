"""Damping as an indicator of load sharing: over roughness, and from 60 simulated series.

`python -m benchmarks.damping` runs this part alone. Contacts are solved once (96 x 48, model mixed)
and stored in build/damping.csv; `--seeds 0 1 2` solves fewer surfaces.
"""

import argparse
import csv
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from asperity.core.arrays import Field
from asperity.core.errors import AsperityError
from asperity.ehl import solve_contact
from asperity.paper import SAMPLES_SQ_UM, SAMPLES_STD_UM, Disturbance
from asperity.paper.rig_recording import (
    GRID_HZ,
    ContactLine,
    RigRecording,
    RigTest,
    draw_background,
)
from asperity.resonance import contact_resonance, remove_lines, series_resonances
from asperity.solution import OscillatingContact, contact_state
from asperity.vibration import ContactOscillator, FilteredNoise
from benchmarks.roughness_levels import paper_case

KEPT = Path(__file__).parents[1] / "build" / "damping.csv"
SQ_UM = (0.3, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0)
SEEDS = tuple(range(12))
LIGHT, HEAVY = 0.1, 1.0  # masses on the contact [kg]: resonances near 9 and 2.9 kHz
RATE_HZ, DURATION_S, SEGMENT = 20e3, 60.0, 40_000
BAND_HZ = (2.0e3, 4.1e3)
REST, REST_SCATTER = (
    0.01,
    0.1,
)  # structural damping ratio and its standard deviation between mountings
MOUNTING = 0.005  # relative standard deviation of a frequency between mountings
TESTS, TRAINING, SERIES = 3, 20, 60
SEVERE_UM = 1.8  # between the paper's stages


@dataclass(frozen=True)
class Point:
    """A solved contact and its response with two masses; stiffness [N/m].

    Yielded cells are elastic, except in a virgin contact.
    """

    sq_um: float
    seed: int
    clr: float
    stiffness: float
    light: float
    heavy: float
    virgin_stiffness: float
    virgin_light: float
    virgin_heavy: float


def points(seeds: Sequence[int]) -> list[Point]:
    """Return stored or newly solved points."""
    kept = {}
    if KEPT.exists():
        with KEPT.open() as file:
            for row in csv.DictReader(file):
                point = Point(
                    **{
                        entry.name: (int if entry.name == "seed" else float)(row[entry.name])
                        for entry in fields(Point)
                    }
                )
                kept[point.sq_um, point.seed] = point
    for seed in seeds:
        for sq_um in SQ_UM:
            if (sq_um, seed) not in kept:
                try:
                    kept[sq_um, seed] = solved(sq_um, seed)
                except (AsperityError, ZeroDivisionError) as failure:
                    print(f"  Sq {sq_um} um, seed {seed}: {failure}", flush=True)
        KEPT.parent.mkdir(exist_ok=True)
        with KEPT.open("w", newline="") as file:
            writer = csv.DictWriter(file, [entry.name for entry in fields(Point)])
            writer.writeheader()
            writer.writerows(asdict(point) for point in kept.values())
    return [kept[key] for key in sorted(kept) if key[1] in seeds]


def solved(sq_um: float, seed: int) -> Point:
    case = paper_case(sq_um, seed, 96).with_overrides({"model": "mixed", "grid.cells": [96, 48]})
    solution = solve_contact(case.conditions, case.lubricant, case.surface(), options=case.options)
    found = []
    for yielded in ("elastic", "flowing"):
        ready = OscillatingContact(solution, yielded=yielded)
        heavy, light = ready.resonance(HEAVY), ready.resonance(LIGHT)
        found += [heavy.stiffness, light.damping_ratio, heavy.damping_ratio]
    return Point(sq_um, seed, contact_state(solution).clr, *found)


def lines(seeds: Sequence[int] = SEEDS, *, fast: bool = False) -> Iterator[str]:
    """Yield Markdown lines; `fast` omits the series, which take ten minutes."""
    library = points(seeds)
    yield (
        "## Stiffness and damping over roughness (96 x 48, model mixed): mean ± deviation over"
        " surfaces\n"
    )
    yield from roughness_lines(library)
    if fast:
        return
    yield (
        f"\n## Stage and load share from {SERIES} series of {len(SAMPLES_SQ_UM)} rings, {TESTS}"
        " tests each\n"
    )
    yield from series_lines(library)


def roughness_lines(library: Sequence[Point]) -> Iterator[str]:
    yield (
        "| Sq [um] | surfaces | CLR [%] | k [N/um] elastic | flowing | ζ at 2.9 kHz [%] elastic |"
        " flowing | ζ at 9 kHz [%] elastic | flowing |"
    )
    yield "|---|---|---|---|---|---|---|---|---|"
    scales = {"clr": 100.0, "stiffness": 1e-6, "virgin_stiffness": 1e-6} | dict.fromkeys(
        ("heavy", "virgin_heavy", "light", "virgin_light"), 100.0
    )
    for sq_um in SQ_UM:
        here = [point for point in library if point.sq_um == sq_um]
        if here:
            cells = [
                "{:.3g} ± {:.2g}".format(*moments([scale * getattr(point, name) for point in here]))
                for name, scale in scales.items()
            ]
            yield f"| {sq_um:g} | {len(here)} | " + " | ".join(cells) + " |"


def moments(values: Sequence[float]) -> tuple[float, float]:
    return float(np.mean(values)), float(np.std(values, ddof=1)) if len(values) > 1 else 0.0


# Series
# -------------------------------------------------------------------------------------------------


class Ring(NamedTuple):
    """True state of a ring and the recordings of its tests."""

    sq_um: float
    clr: float
    recordings: list[RigRecording]


class Reading(NamedTuple):
    """Logarithms of frequency and damping ratio of a ring, averaged over tests with a resonance."""

    sq_um: float
    clr: float
    frequency: float
    damping: float


def series_lines(library: Sequence[Point]) -> Iterator[str]:
    yield (
        "| frequency from | other lines in the band | rings with a resonance | source | CLR error,"
        " rms"
        " [points] | rings in the right stage | series with 11 of 12 right |"
    )
    yield "|---|---|---|---|---|---|---|"
    for law in ("the paper's (CLR F)^(1/6)", "the contact itself"):
        for modes in (0, 4):
            made = [
                readings(series(library, number, law, modes), modes)
                for number in range(TRAINING + SERIES)
            ]
            training, judged = made[:TRAINING], made[TRAINING:]
            total = SERIES * len(SAMPLES_SQ_UM)
            found = sum(len(rings) for rings in judged)
            other = "noise" if modes == 0 else f"{modes} modes"
            for name in ("frequency", "damping", "both"):
                yield (
                    f"| {law} | {other} | {100 * found / total:.0f} % | {name} | "
                    + regression_cells(training, judged, name)
                )


def series(library: Sequence[Point], number: int, law: str, modes: int) -> list[Ring]:
    """Return one rig: one background, and a new surface for each ring."""
    rng = np.random.default_rng([7, number])
    frequency = np.arange(0.0, RATE_HZ / 2.0 + GRID_HZ, GRID_HZ)
    disturbance = Disturbance(snr_db=10.0, modes=modes)
    background = draw_background(frequency, BAND_HZ, disturbance, rng)
    rings = []
    for sample, (nominal, std) in enumerate(zip(SAMPLES_SQ_UM, SAMPLES_STD_UM, strict=True)):
        sq_um = float(np.clip(nominal + std * rng.standard_normal(), SQ_UM[0], SQ_UM[-1]))
        clr, stiffness, damping = between(
            library, sq_um, int(rng.choice(sorted({point.seed for point in library})))
        )
        if (
            law != "the contact itself"
        ):  # the published curve: full load at 3834 Hz; a line for 0.1 kg
            stiffness = HEAVY * (2.0 * np.pi * 3834.0 * max(clr, 0.02) ** (1.0 / 6.0)) ** 2
        recordings = []
        for test in range(TESTS):
            mounted = stiffness * (1.0 + MOUNTING * rng.standard_normal()) ** 2
            rest = REST * np.exp(REST_SCATTER * rng.standard_normal())
            spring = ContactOscillator(
                mass=HEAVY, stiffness=mounted, damping_ratio=rest + damping, load=500.0
            )
            about = RigTest(sample + 1, test + 1, nominal * 1e-6, std * 1e-6, RATE_HZ, DURATION_S)
            line = line_of(spring, sq_um, clr, frequency)
            recordings.append(background.recorded(about, line, disturbance, rng))
        rings.append(Ring(sq_um, clr, recordings))
    return rings


def between(library: Sequence[Point], sq_um: float, seed: int) -> tuple[float, float, float]:
    """Return CLR, stiffness and damping ratio of one surface at any height."""
    own = [point for point in library if point.seed == seed]
    at = [point.sq_um for point in own]
    clr, stiffness, damping = (
        float(np.interp(sq_um, at, [getattr(point, name) for point in own]))
        for name in ("clr", "stiffness", "heavy")
    )
    return clr, stiffness, damping


def line_of(spring: ContactOscillator, sq_um: float, clr: float, frequency: Field) -> ContactLine:
    noise = FilteredNoise(height=sq_um * 1e-6, cutoff_hz=30.0)
    density = np.zeros(frequency.size)
    density[1:] = spring.gain(frequency[1:]) * noise.density(frequency[1:], RATE_HZ)
    f0 = spring.natural_frequency_hz
    return ContactLine(
        sq_um * 1e-6,
        clr,
        f0,
        float(np.interp(f0, frequency, density)),
        spring.damping_ratio,
        density,
    )


def readings(rings: Sequence[Ring], modes: int) -> list[Reading]:
    """Return fits of single lines, or joint fits if the structure resonates too."""
    clean = [
        remove_lines(recording.spectrum(SEGMENT), shaft_hz=(60.0,))
        for ring in rings
        for recording in ring.recordings
    ]
    if modes:
        found = series_resonances(
            [cleaned.spectrum for cleaned in clean],
            band_hz=BAND_HZ,
            kept=[cleaned.kept for cleaned in clean],
        )
    else:
        found = tuple(contact_resonance(cleaned.spectrum, band_hz=BAND_HZ) for cleaned in clean)
    read = []
    for number, ring in enumerate(rings):
        resonances = [
            resonance
            for resonance in found[number * TESTS : (number + 1) * TESTS]
            if resonance.found
        ]
        if resonances:
            logs = [
                float(np.mean(np.log([getattr(resonance, name) for resonance in resonances])))
                for name in ("crf_hz", "damping_ratio")
            ]
            read.append(Reading(ring.sq_um, ring.clr, *logs))
    return read


def regression_cells(
    training: Sequence[Sequence[Reading]], judged: Sequence[Sequence[Reading]], name: str
) -> str:
    """Return regressions of the odds of CLR and of the stage on quadratics of the readings.

    They are trained on other series.
    """
    learnt = [reading for rings in training for reading in rings]
    centre, width = (
        moment(np.array([(reading.frequency, reading.damping) for reading in learnt]), axis=0)
        for moment in (np.mean, np.std)
    )

    def columns(rings: Sequence[Reading]) -> Field:
        scaled = (
            np.array([(reading.frequency, reading.damping) for reading in rings]) - centre
        ) / width
        parts = scaled if name == "both" else scaled[:, [0 if name == "frequency" else 1]]
        squares = [
            parts[:, i] * parts[:, j]
            for i in range(parts.shape[1])
            for j in range(i, parts.shape[1])
        ]
        return np.column_stack([np.ones(len(rings)), parts, *squares])

    odds = np.array([np.log((ring.clr + 0.01) / (1.01 - ring.clr)) for ring in learnt])
    side = np.array([1.0 if ring.sq_um > SEVERE_UM else -1.0 for ring in learnt])
    of_clr, of_stage = (
        np.linalg.lstsq(columns(learnt), target, rcond=None)[0] for target in (odds, side)
    )
    off, right, whole = [], [], 0
    for rings in judged:
        if not rings:
            continue
        guessed = columns(rings) @ of_clr
        off += list(1.02 / (1.0 + np.exp(-guessed)) - 0.01 - np.array([ring.clr for ring in rings]))
        same = (columns(rings) @ of_stage > 0.0) == np.array(
            [ring.sq_um > SEVERE_UM for ring in rings]
        )
        right += list(same)
        whole += int(np.count_nonzero(same) >= len(SAMPLES_SQ_UM) - 1)
    return (
        f"{100 * np.sqrt(np.mean(np.square(off))):.0f} | {100 * np.mean(right):.0f} % | {whole} of"
        f" {len(judged)} |"
    )


def main() -> None:
    """Print the tables as Markdown."""
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.damping", description=__doc__)
    arguments.add_argument("--seeds", type=int, nargs="+", default=SEEDS)
    with threadpool_limits(1):
        for line in lines(tuple(arguments.parse_args().seeds)):
            print(line, flush=True)


if __name__ == "__main__":
    main()
