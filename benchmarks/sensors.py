"""One machine on two sensors, each with its own structure: detections, false claims and coverage.

The contact's line is the same random process on both sensors; the background of each is its own or
partly common. `python -m benchmarks.sensors` runs this part alone; `--fast` a tenth of it.
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
FAR = 100.0  # Hz: a line at this distance is another one
DAMPING, SHARPER = 0.02, 0.012  # of the contact's line, and of a moving structural mode

ROWS: dict[str, dict[str, Any]] = {
    "line on both": {},
    "70 % of the background common to both": {"alike": 0.7},
    "through structures, modes up to 0.5": {"size": 0.5},
    "through structures, modes up to 1": {"size": 1.0},
    "weak on both, 3 % of the background": {"heights": (0.03, 0.03)},
    "below the detection limit of either sensor alone": {"heights": (0.012, 0.012)},
    "strong on one, weak on the other": {"heights": (0.7, 0.03)},
    "no line, a moving mode on one": {"heights": (0.0, 0.0), "moving": True},
    "line on one, a moving mode on the other": {"heights": (0.0, 0.7), "moving": True},
    "line on both, a moving mode on one": {"heights": (0.7, 0.7), "moving": True},
}


def lines(*, fast: bool = False) -> Iterator[str]:
    """Yield the table as Markdown; `fast` takes a tenth of the series."""
    series = SERIES // (10 if fast else 1)
    yield f"## One line on two sensors: {series} series of {TRUTH.size} recordings per row\n"
    yield (
        "| signal | claimed | falsely claimed | sensors disagree | found by the better sensor alone"
        " | CRF rms error [Hz] | one sensor [Hz] | coverage of 90 % intervals | one sensor |"
    )
    yield "|---|---|---|---|---|---|---|---|---|"
    for name, choices in ROWS.items():
        yield f"| {name} | {row(choices, series)} |"


def row(choices: dict[str, Any], series: int) -> str:
    """Return a row of the table."""
    together, alone, claimed, wrong, disagreeing, by_best = [], [], 0, 0, 0, 0
    for seed in range(series):
        result = resonances_of_sensors(two_sensors(seed, **choices), band_hz=BAND)
        disagreeing += sum(
            resonance.reason.startswith(SENSORS_DISAGREE) for resonance in result.resonances
        )
        by_best += max(
            sum(resonance is not None and resonance.found for resonance in resonances)
            for resonances in result.alone.values()
        )
        for number, (joint, true) in enumerate(zip(result.resonances, TRUTH, strict=True)):
            claimed += joint.found
            far = joint.found and (
                choices.get("heights") == (0.0, 0.0) or abs(joint.crf_hz - true) > FAR
            )
            wrong += far
            single = [resonances[number] for resonances in result.alone.values()]
            detected = [
                resonance for resonance in single if resonance is not None and resonance.found
            ]
            if joint.found and not far:
                together.append((joint.crf_hz - true, joint.crf_std))
                if detected:
                    best = min(detected, key=lambda resonance: resonance.crf_std)
                    alone.append((best.crf_hz - true, best.crf_std))
    total = series * TRUTH.size
    shares = [f"{100.0 * count / total:.1f} %" for count in (claimed, wrong, disagreeing, by_best)]
    if not together:
        return f"{' | '.join(shares)} | - | - | - | -"
    both = [np.array(part).T for part in (together, alone) if part]
    errors = [f"{np.sqrt(np.mean(off**2)):.2f}" for off, _ in both]
    covered = [f"{100.0 * np.mean(np.abs(off) < NINETY * std):.0f} %" for off, std in both]
    pairs = (" | ".join([*cells, "-"][:2]) for cells in (errors, covered))
    return " | ".join([*shares, *pairs])


def two_sensors(
    seed: int,
    *,
    heights: tuple[float, float] = (0.7, 0.5),
    averages: int = 50,
    size: float = 0.0,
    alike: float = 0.0,
    moving: bool = False,
) -> dict[str, list[Spectrum]]:
    """Simulate the spectra of sensors a and b.

    Parameters
    ----------
    heights : height of the line over the highest mode on each sensor
    size : height of the structures' modes over the direct path
    alike : common share of the background
    moving : True: sensor a measures a mode that moves by 100 to 400 Hz
    """
    rng = np.random.default_rng([3, seed])
    backgrounds, paths = (
        [machine(rng), machine(rng)],
        [path_transfer(rng, size), path_transfer(rng, size)],
    )
    moved = rng.uniform(1900.0, 2400.0) + rng.uniform(100.0, 400.0) * np.linspace(
        0.0, 1.0, TRUTH.size
    )
    found: dict[str, list[Spectrum]] = {"a": [], "b": []}
    for number, f0 in enumerate(TRUTH):
        line, both = _waves(rng, averages), _waves(rng, averages)
        for sensor, name in enumerate(found):
            background = np.exp(0.2 * rng.standard_normal()) * backgrounds[sensor]
            if moving and sensor == 0:
                background = background + line_shape(FREQUENCY, moved[number], SHARPER)
            own = np.sqrt(alike) * both + np.sqrt(1.0 - alike) * _waves(rng, averages)
            height = heights[sensor] * paths[sensor] * line_shape(FREQUENCY, f0, DAMPING)
            density = np.mean(
                np.abs(np.sqrt(height) * line + np.sqrt(background) * own) ** 2, axis=0
            )
            found[name].append(_spectrum(density, averages))
    return found


def machine(rng: np.random.Generator) -> Field:
    """Draw a constant background: noise that falls with frequency and three modes in the band."""
    background = 0.1 * (np.maximum(FREQUENCY, 1.0) / 2000.0) ** -0.7
    for f0 in rng.uniform(*BAND, 3):
        background = background + rng.uniform(0.2, 1.0) * line_shape(
            FREQUENCY, f0, np.exp(rng.uniform(np.log(5e-3), np.log(2e-2)))
        )
    return np.asarray(background)


def path_transfer(rng: np.random.Generator, size: float) -> Field:
    """Draw |1 + two modes|^2, the power transfer of the structure between contact and sensor."""
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
