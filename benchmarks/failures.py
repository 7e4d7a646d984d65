"""Bearings that run to failure, simulated: an outer race, an inner race, a ball; short snapshots as
loggers keep them.

A fault's impulses ring modes of the housing and grow, rms to 15 to 25 times by the end; there is
no contact resonance. Judged after every snapshot. `python -m benchmarks.failures` runs this part
alone; `--fast` a tenth.
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
)  # a fault and length; where a spectrum is worked out; of each machine
LENGTHS = ((0.1, 20_000.0), (0.1, 25_600.0), (1.0, 20_000.0))  # of a snapshot [s], sampled at [Hz]
PER_TURN = {"outer race": 3.585, "inner race": 5.415, "ball": 4.713}  # of a 6205
CAGE_PER_TURN = 0.398
SHAFT_HZ = 30.0
GROWTH = (15.0, 25.0)
GAIN, MEMORY = (
    0.05,
    0.7,
)  # scatter of ln rms from snapshot to snapshot, and what each keeps of the one before
SLIP = 0.01  # of the time between two impulses
HALL = 0.3  # share of white noise in what a healthy machine says


class Machine(NamedTuple):
    """Snapshots [m/s^2] and the number of the first behind which the fault grows."""

    snapshots: list[np.ndarray]
    rate_hz: float
    begins: int


def machine(fault: str, seed: int, *, seconds: float = 0.1, rate_hz: float = 20_000.0) -> Machine:
    """A bearing from healthy to its end; `fault` is one of `PER_TURN`."""
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
        )  # debris and wear make all of it louder, too
        more = np.sqrt(louder**2 - 1.0)
        whole = _unit(healthy + turning) + more * (0.8 * fault_alone + 0.6 * rough)
        snapshots.append(0.5 * np.exp(gain) * whole)
    return Machine(snapshots, rate_hz, begins)


def _impulses(fault: str, samples: int, rate_hz: float, rng: np.random.Generator) -> np.ndarray:
    """An impulse each time a fault is passed, with slip; as loud as the load there."""
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
    """What modes of frequency, damping ratio and weight make of a force."""
    heard = np.zeros(force.size)
    for f0, damping, weight in modes:
        pole = np.exp((-damping + 1j * np.sqrt(1.0 - damping**2)) * 2.0 * np.pi * f0 / rate_hz)
        heard += weight * scipy.signal.lfilter(
            [1.0, -1.0], [1.0, -2.0 * pole.real, abs(pole) ** 2], force
        )
    return heard


def _unit(values: np.ndarray) -> np.ndarray:
    return np.asarray(values / np.sqrt(np.mean(values**2)))


def tracked(one: Machine, folder: Path) -> Track:
    """As `asperity track` says of the files of a machine."""
    names = []
    for number, values in enumerate(one.snapshots):
        names.append(folder / f"{number:03d}.npz")
        np.savez(names[-1], acc=values, fs=one.rate_hz, unit="m/s^2")
    return track_recordings(names)


class Outcome(NamedTuple):
    """Of a machine: snapshots from the fault's begin to the alarm, and from there to the end;
    claims of a resonance.
    """

    delay: float
    left: float
    early: bool
    claims: int


def outcome(fault: str, seed: int, seconds: float, rate_hz: float) -> Outcome:
    """A machine run to failure, judged."""
    one = machine(fault, seed, seconds=seconds, rate_hz=rate_hz)
    with TemporaryDirectory() as folder:
        track = tracked(one, Path(folder))
    states = track.alarm.states
    at = states.index("alarm") if "alarm" in states else np.inf
    return Outcome(at - one.begins, SNAPSHOTS - 1 - at, at <= one.begins, track.resonance_count)


def lines(*, fast: bool = False) -> Iterator[str]:
    """Markdown, a line at a time; `fast` takes a tenth of the machines."""
    share = 10 if fast else 1
    yield f"## Bearings run to failure: {SNAPSHOTS} snapshots each\n"
    yield (
        "| snapshots | fault | machines | alarm before the end | alarm while healthy | snapshots"
        " from the fault's begin, median | left to the end, least | a contact resonance claimed |"
    )
    yield "|---|---|---|---|---|---|---|---|"
    for seconds, rate_hz in LENGTHS:
        machines = max((MACHINES if seconds < 1.0 else FEW) // share, 1)
        for fault in PER_TURN:
            every = [outcome(fault, seed, seconds, rate_hz) for seed in range(machines)]
            delays, left = [one.delay for one in every], [one.left for one in every]
            yield (
                f"| {seconds:g} s at {rate_hz / 1e3:g} kHz | {fault} | {machines} |"
                f" {sum(value > 0.0 for value in left)} | {sum(one.early for one in every)} |"
                f" {np.median(delays):.0f} | {min(left):.0f} |"
                f" {sum(one.claims > 0 for one in every)} |"
            )


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(prog="python -m benchmarks.failures", description=__doc__)
    arguments.add_argument("--fast", action="store_true", help="a tenth of the machines")
    for line in lines(fast=arguments.parse_args().fast):
        print(line, flush=True)
