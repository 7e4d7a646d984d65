"""One machine on two sensors, each through its own structure: how often the line is found, held,
and wrongly claimed.

The contact's line is one random wave for both; what else a sensor hears is its own, or in part the
other's too. `python -m benchmarks.sensors` runs this part alone; `--fast` a tenth of it.
"""

import argparse
from collections.abc import Iterator
from typing import Any

import numpy as np

from asperity.core.arrays import Field
from asperity.core.signals import Spectrum
from asperity.resonance import SENSORS_DISAGREE, line_shape, resonances_of_sensors

SERIES = 40
BAND = (1800.0, 4000.0)
FREQUENCY = np.arange(0.0, 4400.0, 2.0)
TRUTH = np.linspace(2900.0, 3750.0, 12)
NINETY = 1.6449
FAR = 100.0  # Hz: another line
DAMPING, SHARPER = 0.02, 0.012  # of the contact's line, and of a structure's that moves

ROWS: dict[str, dict[str, Any]] = {
    "a line on both": {},
    "most of the rest is heard by both": {"alike": 0.7},
    "through structures, modes up to 0.5": {"size": 0.5},
    "through structures, modes up to 1": {"size": 1.0},
    "weak on both, 3 % of the rest": {"heights": (0.03, 0.03)},
    "weaker than either finds alone": {"heights": (0.012, 0.012)},
    "loud on one, weak on the other": {"heights": (0.7, 0.03)},
    "a mode that moves, on one only": {"heights": (0.0, 0.0), "moving": True},
    "the line on one, a mode that moves on the other": {"heights": (0.0, 0.7), "moving": True},
    "the line on both, a mode that moves on one": {"heights": (0.7, 0.7), "moving": True},
}


def lines(*, fast: bool = False) -> Iterator[str]:
    """Markdown, a line at a time; `fast` takes a tenth of the series."""
    series = SERIES // (10 if fast else 1)
    yield f"## One line on two sensors: {series} series of {TRUTH.size} recordings a row\n"
    yield (
        "| what is heard | claimed | of those wrong | sensors disagree | found by the better alone"
        " | CRF rms error [Hz] | alone [Hz] | 90 % intervals cover | alone |"
    )
    yield "|---|---|---|---|---|---|---|---|---|"
    for name, choices in ROWS.items():
        yield f"| {name} | {row(choices, series)} |"


def row(choices: dict[str, Any], series: int) -> str:
    """A row of the table."""
    together, alone, claimed, wrong, apart, by_best = [], [], 0, 0, 0, 0
    for seed in range(series):
        told = resonances_of_sensors(two_sensors(seed, **choices), band_hz=BAND)
        apart += sum(one.reason.startswith(SENSORS_DISAGREE) for one in told.resonances)
        by_best += max(
            sum(one is not None and one.found for one in every) for every in told.alone.values()
        )
        for number, (one, true) in enumerate(zip(told.resonances, TRUTH, strict=True)):
            claimed += one.found
            far = one.found and (
                choices.get("heights") == (0.0, 0.0) or abs(one.crf_hz - true) > FAR
            )
            wrong += far
            heard = [every[number] for every in told.alone.values()]
            best = [other for other in heard if other is not None and other.found]
            if one.found and not far:
                together.append((one.crf_hz - true, one.crf_std))
                if best:
                    least = min(best, key=lambda other: other.crf_std)
                    alone.append((least.crf_hz - true, least.crf_std))
    total = series * TRUTH.size
    shares = [f"{100.0 * count / total:.1f} %" for count in (claimed, wrong, apart, by_best)]
    if not together:
        return f"{' | '.join(shares)} | - | - | - | -"
    both = [np.array(part).T for part in (together, alone) if part]
    errors = [f"{np.sqrt(np.mean(off**2)):.2f}" for off, _ in both]
    held = [f"{100.0 * np.mean(np.abs(off) < NINETY * std):.0f} %" for off, std in both]
    return (
        f"{' | '.join(shares)} | {' | '.join([*errors, '-'][:2])} | {' | '.join([*held, '-'][:2])}"
    )


def two_sensors(
    seed: int,
    *,
    heights: tuple[float, float] = (0.7, 0.5),
    averages: int = 50,
    size: float = 0.0,
    alike: float = 0.0,
    moving: bool = False,
) -> dict[str, list[Spectrum]]:
    """Spectra by sensor, a and b.

    `heights` of the line over the loudest mode on each; `size` of the structures' modes over the
    direct way; `alike` the share of the rest that both hear; `moving` whether a hears a mode that
    moves by 100 to 400 Hz.
    """
    rng = np.random.default_rng([3, seed])
    rests, ways = [machine(rng), machine(rng)], [passed_on(rng, size), passed_on(rng, size)]
    moved = rng.uniform(1900.0, 2400.0) + rng.uniform(100.0, 400.0) * np.linspace(
        0.0, 1.0, TRUTH.size
    )
    found: dict[str, list[Spectrum]] = {"a": [], "b": []}
    for number, f0 in enumerate(TRUTH):
        line, both = _waves(rng, averages), _waves(rng, averages)
        for sensor, name in enumerate(found):
            rest = np.exp(0.2 * rng.standard_normal()) * rests[sensor]
            if moving and sensor == 0:
                rest = rest + line_shape(FREQUENCY, moved[number], SHARPER)
            own = np.sqrt(alike) * both + np.sqrt(1.0 - alike) * _waves(rng, averages)
            height = heights[sensor] * ways[sensor] * line_shape(FREQUENCY, f0, DAMPING)
            density = np.mean(np.abs(np.sqrt(height) * line + np.sqrt(rest) * own) ** 2, axis=0)
            found[name].append(_spectrum(density, averages))
    return found


def machine(rng: np.random.Generator) -> Field:
    """What stays of what a sensor hears: noise that falls with frequency, and three modes in the
    band.
    """
    heard = 0.1 * (np.maximum(FREQUENCY, 1.0) / 2000.0) ** -0.7
    for f0 in rng.uniform(*BAND, 3):
        heard = heard + rng.uniform(0.2, 1.0) * line_shape(
            FREQUENCY, f0, np.exp(rng.uniform(np.log(5e-3), np.log(2e-2)))
        )
    return np.asarray(heard)


def passed_on(rng: np.random.Generator, size: float) -> Field:
    """|1 + two modes|^2: what a structure between contact and sensor makes of the contact's
    line.
    """
    factor = np.ones(FREQUENCY.size, dtype=complex)
    for _ in range(2):
        f0, damping = rng.uniform(*BAND), rng.uniform(0.008, 0.03)
        height = size * rng.uniform(0.3, 1.0) * rng.choice([-1.0, 1.0])
        factor += (
            height * 2j * damping / (1.0 - (FREQUENCY / f0) ** 2 + 2j * damping * FREQUENCY / f0)
        )
    return np.asarray(np.abs(factor) ** 2)


def _waves(rng: np.random.Generator, averages: int) -> np.ndarray:
    shape = (averages, FREQUENCY.size)
    return np.asarray((rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2.0))


def _spectrum(density: Field, averages: int) -> Spectrum:
    return Spectrum(
        frequency_hz=FREQUENCY,
        density=density,
        unit="(m/s^2)^2/Hz",
        duration_s=averages / 2.0,
        segment=6000,
        window="boxcar",
        resolution_hz=2.0,
        averages=float(averages),
    )


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.sensors", description=__doc__)
    arguments.add_argument("--fast", action="store_true", help="a tenth of the series")
    for line in lines(fast=arguments.parse_args().fast):
        print(line, flush=True)
