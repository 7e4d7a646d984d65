"""Forecast when a limit is crossed: simulated wear histories, and machines without wear.

Unknowns come from the case's priors. Each contact deviates from the emulator by a draw of its
standard deviation, constant along the course. One class meets the filter's assumptions: straight,
steepening, slackening and wandering courses with white scatter of the stated size. The other
violates them: a course with a jump, one that runs in and then roughens, and CRF with twice the
stated scatter and autocorrelation 0.7. Only series count whose load share crosses 50 % between the
last recording and two series' lengths later. Rows are stored in
docs/benchmarks/forecast-courses.csv and extended by later runs.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from asperity.case import load_case
from asperity.core.arrays import Field
from asperity.core.errors import AsperityError
from asperity.inference import (
    Emulator,
    ForwardModel,
    Observation,
    ObservationPoint,
    Setting,
    build_emulator,
    forecast_observations,
    inference_setting,
)
from asperity.inference.drifting_contact import along_range
from asperity.inference.kalman_filter import KNOTS, between_knots
from asperity.inference.outputs import CLR, OUTPUTS
from benchmarks.inference import CASE, KEPT, LEFT_S, share
from benchmarks.rows import FOLDER, Rows

HISTORIES, STEADY, FEW = 60, 300, 10
VISITS, LIMIT, SEED = 30, 0.5, 4
CRF_STD, DAMPING_STD, HEIGHT_STD = 2e-3, 0.05, 0.08
ROWS = FOLDER / "forecast-courses.csv"
SHAPES = ("straight", "steepening", "slackening", "wandering")
OTHERS = ("jumping", "run in, then roughening", "straight, autocorrelated scatter")
CLASSES = {
    "wearing": SHAPES,
    "otherwise": OTHERS,
    "steady": ("steady",),
    "slow": ("steady, autocorrelated scatter",),
}
REMEMBERED, SCATTER = (
    0.7,
    2.0,
)  # autocorrelated scatter: autocorrelation between visits; ratio to the stated deviation
RATE = 0.3  # standard deviation, as a share of a range over the series
AHEAD = 2.0  # series' lengths after the last recording
PLACE = (500.0, 1.91)
COLUMNS = (
    "kind",
    "number",
    "shape",
    "crossing",
    "low",
    "median",
    "high",
    "rises",
    "rising",
    "within",
    "already",
    "log_odds",
    "alarm",
    "clr_true",
    "clr_low",
    "clr_high",
    "seconds",
)


def main() -> None:
    """Simulate recordings, forecast, and print the coverage of the intervals."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--histories", type=int, default=HISTORIES)
    arguments.add_argument("--steady", type=int, default=STEADY)
    arguments.add_argument("--kept", type=Path, default=KEPT, help="folder of stored results")
    parsed = arguments.parse_args()
    with threadpool_limits(1):
        judge_all(parsed.histories, parsed.steady, parsed.kept)
    print("\n".join(tables()))


def lines(*, fast: bool, seconds: float = float("inf")) -> Iterator[str]:
    """Yield the output of `python -m benchmarks forecast`: all stored series, and more while
    time is left.
    """
    end = perf_counter() + seconds - LEFT_S
    judge_all(FEW if fast else HISTORIES, FEW if fast else STEADY, KEPT, end=end)
    yield from tables()


def judge_all(histories: int, steady: int, kept: Path, *, end: float = float("inf")) -> None:
    """Judge the series; write each row when it is done."""
    setting = inference_setting(load_case(CASE))
    emulator = build_emulator(setting, folder=kept / "emulator", workers=1)
    rows = Rows(ROWS, ("kind", "number"))
    counts = {"wearing": histories, "otherwise": histories, "steady": steady, "slow": steady}
    for number in range(max(counts.values())):
        for kind in (kind for kind, count in counts.items() if number < count):
            if perf_counter() > end:
                return
            if (kind, number) not in rows:
                rows.write([judged(setting, emulator, kind, number)])


def judged(setting: Setting, emulator: Emulator, kind: str, number: int) -> dict[str, Any]:
    """Return the forecast of one series and the true course."""
    rng = np.random.default_rng([SEED, number, list(CLASSES).index(kind)])
    forward = ForwardModel(setting, emulator, (ObservationPoint(*PLACE),))
    crossing = np.nan
    while True:
        z = rng.standard_normal((1, len(setting.unknowns)))
        shape = CLASSES[kind][number % len(CLASSES[kind])]
        course = _course(shape, float(setting.unknowns[0].share(z[0, :1])[0]), rng)
        if course.min() < 0.0 or course.max() > 1.0:
            continue
        sounds, clr = _shown(forward, z, course, rng)
        if clr[: _at(1.0) + 1].min() < 0.02:
            continue  # no resonance
        if "steady" in shape:
            break
        past = np.flatnonzero((clr - LIMIT) * (clr[_at(1.0)] - LIMIT) <= 0.0)
        past = past[past > _at(1.0)]
        if len(past):
            crossing = TIME[past[0]] - 1.0
            break
    began = process_time()
    try:
        found = forecast_observations(
            setting, emulator, _observations(sounds, rng, shape), limit=(CLR, LIMIT), seed=number
        )
    except AsperityError:  # counts as not covered
        return dict.fromkeys(COLUMNS, np.nan) | {
            "kind": kind,
            "number": number,
            "shape": shape,
            "crossing": crossing,
            "alarm": 0,
            "rises": 0,
            "rising": -1,
            "seconds": round(process_time() - began, 1),
        }
    return {
        "kind": kind,
        "number": number,
        "shape": shape,
        "crossing": crossing,
        "low": found.time.low,
        "median": found.time.median,
        "high": found.time.high,
        "rises": int(clr[-1] > clr[0]),
        "rising": int(found.rising),
        "within": found.within,
        "already": found.already,
        "log_odds": found.log_odds,
        "alarm": int(found.alarm),
        "clr_true": clr[_at(1.0)],
        "clr_low": found.clr.low,
        "clr_high": found.clr.high,
        "seconds": round(process_time() - began, 1),
    }


TIME = np.linspace(0.0, 1.0 + AHEAD, 601)


def _at(time: float) -> int:
    return int(np.searchsorted(TIME, time))


def _course(shape: str, begin: float, rng: np.random.Generator) -> Field:
    """Return Sq over time as shares of its range; 1 is the last recording."""
    if shape.startswith("steady"):
        return np.full(TIME.size, begin)
    rate = RATE * rng.standard_normal()
    if shape == "steepening":
        return begin + rate * (0.5 * TIME + 0.5 * TIME**2)
    if shape == "slackening":
        return begin + 1.5 * rate * (1.0 - np.exp(-TIME))
    if shape == "jumping":
        return begin + rate * TIME + 0.5 * RATE * rng.standard_normal() * (rng.random() < TIME)
    if shape == "run in, then roughening":
        return (
            begin
            - 0.5 * RATE * rng.random() * (1.0 - np.exp(-TIME / 0.15))
            + 0.5 * abs(rate) * TIME**2
        )
    wander = np.zeros(TIME.size)
    if shape == "wandering":
        speed = 0.3 * abs(rate) * np.sqrt(TIME[1]) * rng.standard_normal(TIME.size)
        wander = np.cumsum(np.cumsum(speed)) * TIME[1]
    return begin + rate * TIME + wander


def _shown(
    forward: ForwardModel, z: Field, course: Field, rng: np.random.Generator
) -> tuple[dict[str, Field], Field]:
    """Return the logarithms of the true contact's indicators, and its load share.

    The contact is the emulator's, shifted by a draw of its deviation.
    """
    unknown, grid = forward.setting.unknowns[0], np.linspace(0.0, 1.0, 4 * KNOTS)
    along = along_range(z, 0, unknown.at_share(grid))
    shown = forward.predict(along, "hertz-point", deviations=False)
    mean, _ = forward.emulate(along, [CLR], deviations=False)[CLR]
    _, std = forward.emulate(z, [CLR])[CLR]
    scale = between_knots(mean.T, course[None])[0][0] + std[0, 0] * rng.standard_normal()
    clr = OUTPUTS[CLR].back(scale)
    tables = {
        key: between_knots(getattr(shown, key).T, course[None])[0][0]
        for key in ("crf", "damping", "crfa")
    }
    before = OUTPUTS[CLR].back(between_knots(mean.T, course[None])[0][0])
    tables["crf"] = tables["crf"] + np.log(np.maximum(clr, 1e-4) / np.maximum(before, 1e-4)) / 6.0
    return tables, clr


def _observations(
    sounds: dict[str, Field], rng: np.random.Generator, shape: str
) -> list[Observation]:
    observations, slow = [], 0.0
    for at in np.linspace(0.0, 1.0, VISITS):
        place = _at(at)
        crf, damping, crfa = (
            float(np.exp(sounds[key][place] + std * rng.standard_normal()))
            for key, std in (("crf", CRF_STD), ("damping", DAMPING_STD), ("crfa", HEIGHT_STD))
        )
        if "autocorrelated" in shape:
            fresh = rng.standard_normal() * (np.sqrt(1.0 - REMEMBERED**2) if observations else 1.0)
            slow = REMEMBERED * slow + fresh
            crf = float(np.exp(sounds["crf"][place] + SCATTER * CRF_STD * slow))
        observations.append(
            Observation(
                load_n=PLACE[0],
                entrainment_m_s=PLACE[1],
                crf_hz=crf,
                crf_std_hz=CRF_STD * crf,
                damping_ratio=damping,
                damping_std=DAMPING_STD * damping,
                crfa=crfa,
                crfa_std=HEIGHT_STD * crfa,
                x=100.0 * at,
            )
        )
    return observations


def tables() -> Iterator[str]:
    """Yield coverage and alarm rates of all stored rows as Markdown."""
    kept = Rows(ROWS, ("kind", "number"))
    rows = list(kept)
    yield "## Time to CLR 50 %: coverage of 90 % intervals on simulated wear histories"
    yield f"Sample: {len(rows)} series."
    if not rows:
        return
    yield (
        "| course | series | covered | upper over lower end (median) | CLR at the last recording"
        " covered"
        " | change detected |"
    )
    yield "|---|---|---|---|---|---|"
    for kind, whole in (
        ("wearing", "all that meet the filter's assumptions"),
        ("otherwise", "all that violate them"),
    ):
        own = [row for row in rows if row["kind"] == kind]
        for shape in (*CLASSES[kind], whole):
            if some := [row for row in own if shape in (row["shape"], whole)]:
                yield _line(shape, some)
    for kind, kind_text in (
        ("steady", "without wear"),
        ("slow", "with autocorrelated scatter and without wear"),
    ):
        if own := [row for row in rows if row["kind"] == kind]:
            alarms = sum(row["alarm"] == "1" for row in own)
            changes = sum(float(row["log_odds"]) >= np.log(100.0) for row in own)
            yield (
                f"{changes} of {len(own)} machines {kind_text} were classed as changing;"
                f" {alarms} raised an alarm."
            )
    took = np.median([float(row["seconds"]) for row in rows])
    yield (
        f"A forecast took {took:.1f} s of CPU time (median). Rows per code version: {kept.codes()}."
    )


def _line(shape: str, rows: list[dict[str, str]]) -> str:
    width = np.nanmedian([float(row["high"]) / max(float(row["low"]), 1e-9) for row in rows])
    now = [
        float(row["clr_low"]) <= float(row["clr_true"]) <= float(row["clr_high"]) for row in rows
    ]
    change_detected = [float(row["log_odds"]) >= np.log(100.0) for row in rows]
    covered = share([_covered(row) for row in rows])
    return (
        f"| {shape} | {len(rows)} | {covered} | {width:.1f} | {share(now)} |"
        f" {share(change_detected)}"
        " |"
    )


def _covered(row: dict[str, str]) -> bool:
    low, high, true = (float(row[key]) for key in ("low", "high", "crossing"))
    return row["rises"] == row["rising"] and low <= 100.0 * true <= high


if __name__ == "__main__":
    main()
