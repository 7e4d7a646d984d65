"""Information gain of the advised next operating point against twenty random ones.

Machines have unknowns from the case's priors and one recorded operating point. Their recordings
follow the emulator with draws of its deviation, correlated between points as in the likelihood: the
draw of the first point stays, the others are new each time. The gain of a point is the decrease of
the posterior's entropy by its recording, once and averaged over ten recordings. Rows are stored in
docs/benchmarks/next-points-machines.csv and extended by later runs.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from asperity.case import load_case
from asperity.core.arrays import Field
from asperity.inference import (
    Emulator,
    ForwardModel,
    Observation,
    ObservationPoint,
    Setting,
    build_emulator,
    infer_observations,
    inference_setting,
)
from asperity.inference.likelihood import emulated_errors
from asperity.inference.next_point import TYPICAL_STD, PredictedRecordings, predict_recordings
from asperity.inference.observations import point_similarity
from benchmarks.inference import CASE, KEPT, LEAST_SHARE, LEFT_S, share
from benchmarks.rows import FOLDER, Rows

MACHINES, FEW, RANDOM, TIMES, SEED = 100, 8, 20, 10, 9
FIRST = (500.0, 0.8)  # first operating point of all machines
ROWS = FOLDER / "next-points-machines.csv"


def main() -> None:
    """Simulate recordings, advise, and print how often the advised point was better."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--machines", type=int, default=MACHINES)
    arguments.add_argument("--kept", type=Path, default=KEPT, help="folder of stored results")
    parsed = arguments.parse_args()
    with threadpool_limits(1):
        judge_all(parsed.machines, parsed.kept)
    print("\n".join(tables()))


def lines(*, fast: bool, seconds: float = float("inf")) -> Iterator[str]:
    """Yield the output of `python -m benchmarks next_points`: as many machines as time allows."""
    judge_all(FEW if fast else MACHINES, KEPT, end=perf_counter() + seconds - LEFT_S)
    yield from tables()


def judge_all(machines: int, kept: Path, *, end: float = float("inf")) -> None:
    """Judge the machines; write each row when it is done."""
    setting = inference_setting(load_case(CASE))
    emulator = build_emulator(setting, folder=kept / "emulator", workers=1)
    rows = Rows(ROWS, ("machine",))
    for number in range(machines):
        if perf_counter() > end:
            return
        if (number,) not in rows:
            rows.write([judged(setting, emulator, number)])


def judged(setting: Setting, emulator: Emulator, number: int) -> dict[str, Any]:
    """Return the information gain of the advised point and of random points in bits."""
    rng = np.random.default_rng([SEED, number])
    first = ForwardModel(setting, emulator, (ObservationPoint(*FIRST),))
    z = rng.standard_normal((1, first.dims))
    while first.states(z, ["clr"])["clr"][0, 0] < 0.05:
        z = rng.standard_normal((1, first.dims))
    own, usual = rng.standard_normal(1), [TYPICAL_STD[key] for key in ("crf", "damping")]
    crf, damping = np.exp(_recorded(first, z, own, rng)[:, 0])
    found = infer_observations(
        setting,
        emulator,
        [
            Observation(
                load_n=FIRST[0],
                entrainment_m_s=FIRST[1],
                crf_hz=crf,
                crf_std_hz=usual[0] * crf,
                damping_ratio=damping,
                damping_std=usual[1] * damping,
            )
        ],
        seed=number,
    )
    loads, speeds = (
        next(e for e in setting.operating if e.key.endswith(key)) for key in ("load", "speed")
    )
    places = [(found.next_point.load_n, found.next_point.entrainment_m_s)]
    places += [(loads.value(rng.random()), speeds.value(rng.random())) for _ in range(RANDOM)]
    points = tuple(ObservationPoint(*place) for place in places)
    shown, every = (
        predict_recordings(found.forward, found.draws, points),
        ForwardModel(setting, emulator, (ObservationPoint(*FIRST), *points)),
    )
    information_gain = np.array(
        [information_gains(shown, _recorded(every, z, own, rng)[:, 1:]) for _ in range(TIMES)]
    )
    shows = every.states(z, ["clr"])["clr"][0, 1:] > LEAST_SHARE
    once, mean = information_gain[0], information_gain.mean(axis=0)
    return {
        "machine": number,
        "advised_shows": int(shows[0]),
        "once": once[0],
        "once_random": once[1:].mean(),
        "mean": mean[0],
        "mean_random": mean[1:].mean(),
        "best_random": mean[1:].max(),
        "expected": found.next_point.information_bits,
        "load_n": places[0][0],
        "entrainment_m_s": places[0][1],
    }


def _recorded(forward: ForwardModel, z: Field, own: Field, rng: np.random.Generator) -> Field:
    """Return logarithms of the true machine's frequency and damping in one recording, (2, points).

    `own` is the standard normal draw of the emulator's error at the first point, constant in time.
    """
    shown = forward.predict(z, "hertz-point", heights=False)
    lower = np.linalg.cholesky(
        emulated_errors("crf", shown.crf_std, point_similarity(forward.points))[0]
    )
    errors = lower @ np.concatenate([own, rng.standard_normal(len(lower) - 1)])
    measured = rng.standard_normal((2, len(lower))) * [
        [TYPICAL_STD["crf"]],
        [TYPICAL_STD["damping"]],
    ]
    return np.stack([shown.crf[0] + errors, shown.damping[0]]) + measured


def information_gains(shown: PredictedRecordings, recorded: Field) -> Field:
    """Return the decrease of the posterior's entropy at each point in bits, from importance
    weights.
    """
    logs = np.asarray(
        sum(
            shown.channels[key].log_density(value, TYPICAL_STD[key])
            for key, value in zip(("crf", "damping"), recorded, strict=True)
        )
    )
    weights = np.exp(logs - logs.max(axis=0))
    weights /= weights.sum(axis=0)
    return np.asarray(np.sum(weights * np.log2(np.maximum(weights * len(weights), 1e-300)), axis=0))


def tables() -> Iterator[str]:
    """Yield how often the advised point is better, as Markdown, from all stored rows."""
    kept = Rows(ROWS, ("machine",))
    rows = [{key: float(value) for key, value in row.items() if key != "code"} for row in kept]
    yield (
        f"## The recommended next point against {RANDOM} random ones, machines recorded at one"
        " point"
    )
    yield f"Sample: {len(rows)} machines."
    if not rows:
        return
    yield (
        "| recordings at the point | machines | recommended point gains more than random ones on"
        " average | bits, recommended | bits, mean of random |"
    )
    yield "|---|---|---|---|---|"
    for key, name in (("once", "once"), ("mean", f"mean of {TIMES} times")):
        better = share([row[key] > row[f"{key}_random"] for row in rows])
        information_gain = [
            f"{np.median([row[name] for row in rows]):.2f}" for name in (key, f"{key}_random")
        ]
        yield f"| {name} | {len(rows)} | {better} | {information_gain[0]} | {information_gain[1]} |"
    shows = share([row["advised_shows"] == 1.0 for row in rows])
    yield (
        f"At the recommended point a line is detectable (CLR over {100 * LEAST_SHARE:.0f} %) in"
        f" {shows} of machines. Rows per code version: {kept.codes()}."
    )


if __name__ == "__main__":
    main()
