"""Simulated bearings run to failure: outer race, inner race and ball faults; short logger
snapshots.

A fault's impulses excite modes of the housing and grow until rms has risen 15 to 25 times; there is
no contact resonance. The alarm is judged after every snapshot. `python -m benchmarks.failures` runs
this part alone; `--fast` uses a tenth of the machines.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
import scipy

from asperity.monitoring import Track, track_recordings

MACHINES, FEW, SNAPSHOTS = (
    40,
    8,
    40,
)  # per fault and length; snapshots with a spectrum; snapshots per machine
LENGTHS = (
    (0.1, 20_000.0),
    (0.1, 25_600.0),
    (1.0, 20_000.0),
)  # snapshot length [s], sampling rate [Hz]
PER_TURN = {"outer race": 3.585, "inner race": 5.415, "ball": 4.713}  # impulses per turn of a 6205
CAGE_PER_TURN = 0.398
SHAFT_HZ = 30.0
GROWTH = (15.0, 25.0)
GAIN, MEMORY = (
    0.05,
    0.7,
)  # standard deviation of ln rms between snapshots, and its autocorrelation
SLIP = 0.01  # relative standard deviation of the time between impulses
HALL = 0.3  # share of white noise in the signal of a healthy machine


class Machine(NamedTuple):
    """Snapshots [m/s^2] and the number of the last healthy one."""

    snapshots: list[np.ndarray]
    rate_hz: float
    begins: int


def machine(fault: str, seed: int, *, seconds: float = 0.1, rate_hz: float = 20_000.0) -> Machine:
    """Return a bearing from healthy to failure; `fault` is a key of `PER_TURN`."""
    rng = np.random.default_rng([17, seed, list(PER_TURN).index(fault)])
    modes = np.column_stack(
        [rng.uniform(900.0, 0.4 * rate_hz, 4), rng.uniform(0.01, 0.05, 4), rng.uniform(0.3, 1.0, 4)]
    )
    begins = int(rng.integers(SNAPSHOTS // 2 - 5, SNAPSHOTS - 10))
    grown = np.clip((np.arange(SNAPSHOTS) - begins) / (SNAPSHOTS - 1.0 - begins), 0.0, 1.0)
    rms = np.exp(np.log(rng.uniform(*GROWTH)) * grown ** rng.uniform(1.0, 2.0))
    gain, snapshots = 0.0, []
    for louder in rms:
        gain = MEMORY * gain + np.sqrt(1.0 - MEMORY**2) * GAIN * rng.standard_normal()
        samples = round(seconds * rate_hz)
        healthy = _unit(
            _rung(rng.standard_normal(samples), modes, rate_hz)
        ) + HALL * rng.standard_normal(samples)
        turning = 0.2 * np.sin(
            2.0 * np.pi * SHAFT_HZ * np.arange(samples) / rate_hz + rng.uniform(0.0, 2.0 * np.pi)
        )
        fault_alone = _unit(_rung(_impulses(fault, samples, rate_hz, rng), modes, rate_hz))
        rough = _unit(
            _rung(rng.standard_normal(samples), modes, rate_hz)
        )  # debris and wear raise the whole signal
        more = np.sqrt(louder**2 - 1.0)
        whole = _unit(healthy + turning) + more * (0.8 * fault_alone + 0.6 * rough)
        snapshots.append(0.5 * np.exp(gain) * whole)
    return Machine(snapshots, rate_hz, begins)


def _impulses(fault: str, samples: int, rate_hz: float, rng: np.random.Generator) -> np.ndarray:
    """Return one impulse per passage of the fault, with slip, modulated by the local load."""
    train = np.zeros(samples)
    period = rate_hz / (PER_TURN[fault] * SHAFT_HZ)
    at = rng.uniform(0.0, period)
    while at < samples:
        turns = {"outer race": 0.0, "inner race": 1.0, "ball": CAGE_PER_TURN}[fault]
        zone = (
            1.0
            if not turns
            else 0.5 * (1.1 + np.cos(2.0 * np.pi * turns * SHAFT_HZ * at / rate_hz))
        )
        train[int(at)] += zone * np.exp(0.3 * rng.standard_normal())
        at += period * (1.0 + SLIP * rng.standard_normal())
    return train


def _rung(force: np.ndarray, modes: np.ndarray, rate_hz: float) -> np.ndarray:
    """Return the response of modes (frequency, damping ratio, weight) to a force."""
    response = np.zeros(force.size)
    for f0, damping, weight in modes:
        pole = np.exp((-damping + 1j * np.sqrt(1.0 - damping**2)) * 2.0 * np.pi * f0 / rate_hz)
        response += weight * scipy.signal.lfilter(
            [1.0, -1.0], [1.0, -2.0 * pole.real, abs(pole) ** 2], force
        )
    return response


def _unit(values: np.ndarray) -> np.ndarray:
    return np.asarray(values / np.sqrt(np.mean(values**2)))


def tracked(simulated: Machine, folder: Path) -> Track:
    """Return the result of `asperity track` for the files of a machine."""
    names = []
    for number, values in enumerate(simulated.snapshots):
        names.append(folder / f"{number:03d}.npz")
        np.savez(names[-1], acc=values, fs=simulated.rate_hz, unit="m/s^2")
    return track_recordings(names)


class Outcome(NamedTuple):
    """Snapshots from the start of the fault to the alarm and from there to the end; claimed
    resonances.
    """

    delay: float
    left: float
    early: bool
    claims: int


def outcome(fault: str, seed: int, seconds: float, rate_hz: float) -> Outcome:
    """Run a machine to failure and judge it."""
    simulated = machine(fault, seed, seconds=seconds, rate_hz=rate_hz)
    with TemporaryDirectory() as folder:
        track = tracked(simulated, Path(folder))
    states = track.alarm.states
    at = states.index("alarm") if "alarm" in states else np.inf
    return Outcome(
        at - simulated.begins, SNAPSHOTS - 1 - at, at <= simulated.begins, track.resonance_count
    )


def lines(*, fast: bool = False) -> Iterator[str]:
    """Yield Markdown lines; `fast` uses a tenth of the machines."""
    share = 10 if fast else 1
    yield f"## Bearings run to failure: {SNAPSHOTS} snapshots each\n"
    yield (
        "| snapshots | fault | machines | alarm before the end | alarm while healthy | snapshots"
        " from fault onset to alarm, median | snapshots left before failure, minimum | contact"
        " resonance claimed |"
    )
    yield "|---|---|---|---|---|---|---|---|"
    for seconds, rate_hz in LENGTHS:
        machines = max((MACHINES if seconds < 1.0 else FEW) // share, 1)
        for fault in PER_TURN:
            every = [outcome(fault, seed, seconds, rate_hz) for seed in range(machines)]
            delays, left = [result.delay for result in every], [result.left for result in every]
            yield (
                f"| {seconds:g} s at {rate_hz / 1e3:g} kHz | {fault} | {machines} |"
                f" {sum(value > 0.0 for value in left)} | {sum(result.early for result in every)} |"
                f" {np.median(delays):.0f} | {min(left):.0f} |"
                f" {sum(result.claims > 0 for result in every)} |"
            )


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.failures", description=__doc__)
    arguments.add_argument("--fast", action="store_true", help="use a tenth of the machines")
    for line in lines(fast=arguments.parse_args().fast):
        print(line, flush=True)
