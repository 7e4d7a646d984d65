"""Whether the advised next operating point teaches more than twenty drawn at random, of machines heard at one.

Machines have unknowns from the case's priors and show what the emulator says, off by a draw of its deviation. What a
point teaches is how far the posterior's entropy falls by what is heard there: once, and in the mean over ten times.
"""

import argparse
import csv
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from asperity.arrays import Field
from asperity.case import load_case
from asperity.inference import (
    LAWS,
    Emulator,
    Forward,
    Inference,
    Observation,
    Point,
    Setting,
    build_emulator,
    infer_observations,
    setting_of,
)
from asperity.inference.next_point import USUAL_DAMPING_STD, USUAL_STD
from benchmarks.inference import CASE, KEPT, LEAST_SHARE, LEFT_S, share

MACHINES, FEW, RANDOM, TIMES, SEED = 100, 8, 20, 10, 9
FIRST = (500.0, 0.8)  # where each was heard


def main() -> None:
    """Hear, advise, hear again, and say how often the advice was the better."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--machines", type=int, default=MACHINES)
    arguments.add_argument("--kept", type=Path, default=KEPT, help="folder that keeps everything")
    wanted = arguments.parse_args()
    with threadpool_limits(1):
        judge_all(wanted.machines, wanted.kept)
    print("\n".join(tables(wanted.kept)))


def lines(*, fast: bool, seconds: float = float("inf")) -> Iterator[str]:
    """What `python -m benchmarks next_points` prints: as many machines as there is time for."""
    judge_all(FEW if fast else MACHINES, KEPT, end=perf_counter() + seconds - LEFT_S)
    yield from tables(KEPT)


def judge_all(machines: int, kept: Path, *, end: float = float("inf")) -> None:
    """A row for each machine, as it is done."""
    setting = setting_of(load_case(CASE))
    emulator = build_emulator(setting, folder=kept / "emulator", workers=1)
    path = kept / "next.csv"
    done = {int(row["machine"]) for row in csv.DictReader(path.open())} if path.exists() else set()
    for number in range(machines):
        if perf_counter() > end:
            return
        if number not in done:
            row = judged(setting, emulator, number)
            with path.open("a", newline="") as file:
                writer = csv.DictWriter(file, list(row))
                if file.tell() == 0:
                    writer.writeheader()
                writer.writerow(row)


def judged(setting: Setting, emulator: Emulator, number: int) -> dict[str, Any]:
    """Bits that the advised point teaches, and those drawn at random."""
    rng = np.random.default_rng([SEED, number])
    first = Forward(setting, emulator, (Point(*FIRST),))
    z = rng.standard_normal((1, first.dims))
    while first.states(z, ["clr"])["clr"][0, 0] < 0.05:
        z = rng.standard_normal((1, first.dims))
    crf, damping = (float(np.exp(values[0, 0])) for values in _heard(first, z, rng))
    found = infer_observations(
        setting,
        emulator,
        [
            Observation(
                load_n=FIRST[0], entrainment_m_s=FIRST[1], crf_hz=crf, crf_std_hz=USUAL_STD * crf,
                damping_ratio=damping, damping_std=USUAL_DAMPING_STD * damping,
            )
        ],
        seed=number,
    )  # fmt: skip
    loads, speeds = (next(e for e in setting.operating if e.key.endswith(key)) for key in ("load", "speed"))
    places = [(found.next_point.load_n, found.next_point.entrainment_m_s)]
    places += [(loads.value(rng.random()), speeds.value(rng.random())) for _ in range(RANDOM)]
    there = replace(first, points=tuple(Point(*place) for place in places))
    bits = np.array([taught(found, there, _heard(there, z, rng)) for _ in range(TIMES)])
    shows = there.states(z, ["clr"])["clr"][0] > LEAST_SHARE
    once, mean = bits[0], bits.mean(axis=0)
    return {
        "machine": number, "advised_shows": int(shows[0]), "once": once[0], "once_random": once[1:].mean(),
        "mean": mean[0], "mean_random": mean[1:].mean(), "best_random": mean[1:].max(),
        "expected": found.next_point.information_bits,
    }  # fmt: skip


def _heard(forward: Forward, z: Field, rng: np.random.Generator) -> tuple[Field, Field]:
    """Logarithms of frequency and damping as the true machine shows them once, (1, points) each."""
    shown = forward.shown(z, "hertz-point", heights=False)
    size = shown.crf.shape
    crf = shown.crf + np.hypot(shown.crf_std, USUAL_STD) * rng.standard_normal(size)
    return crf, shown.damping + USUAL_DAMPING_STD * rng.standard_normal(size)


def taught(found: Inference, there: Forward, heard: tuple[Field, Field]) -> Field:
    """Bits by which the entropy of what is possible falls at each point: by the weights that what is heard gives."""
    draws = found.draws
    logs = np.zeros((len(draws.z), len(there.points)))
    for number, law in enumerate(LAWS):
        rows = draws.law == number
        if rows.any():
            shown = there.shown(draws.z[rows], law, heights=False)
            of_crf, of_damping = (draws.sizes[key][rows][:, None] for key in ("crf", "damping"))
            spreads = (
                np.sqrt(shown.crf_std**2 + USUAL_STD**2 + of_crf**2),
                np.sqrt(shown.damping_std**2 + USUAL_DAMPING_STD**2 + of_damping**2),
            )
            for value, mean, spread in zip(heard, (shown.crf, shown.damping), spreads, strict=True):
                logs[rows] += -0.5 * ((value - mean) / spread) ** 2 - np.log(spread)
    weights = np.exp(logs - logs.max(axis=0))
    weights /= weights.sum(axis=0)
    return np.asarray(np.sum(weights * np.log2(np.maximum(weights * len(weights), 1e-300)), axis=0))


def tables(kept: Path) -> Iterator[str]:
    """How often the advice is the better, as Markdown."""
    path = kept / "next.csv"
    read = list(csv.DictReader(path.open())) if path.exists() else []
    rows = [{key: float(value) for key, value in row.items()} for row in read]
    yield f"## The advised next point against {RANDOM} drawn at random, machines heard at one"
    yield f"Sample: {len(rows)} machines."
    if not rows:
        return
    yield "| heard there | machines | advised teaches more than their mean | bits, advised | bits, mean of the random |"
    yield "|---|---|---|---|---|"
    for key, name in (("once", "once"), ("mean", f"mean of {TIMES} times")):
        better = share([row[key] > row[f"{key}_random"] for row in rows])
        bits = [f"{np.median([row[name] for row in rows]):.2f}" for name in (key, f"{key}_random")]
        yield f"| {name} | {len(rows)} | {better} | {bits[0]} | {bits[1]} |"
    shows = share([row["advised_shows"] == 1.0 for row in rows])
    yield f"At the advised point a line is to be heard (CLR over {100 * LEAST_SHARE:.0f} %) in {shows} of machines."


if __name__ == "__main__":
    main()
