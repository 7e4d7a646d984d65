"""When a limit is crossed: simulated wear histories, and machines that stay as they are.

Courses are straight, steepening, slackening and wandering, of contacts with unknowns from the case's priors, off the
emulator by its deviation, which stays along the course; scatter is white and of the size stated: what the filter takes
for granted too. Those count whose load share crosses 50 % between
the last recording and two series' lengths after it. Rows are kept in build/inference and gone on from.
"""

import argparse
import csv
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from asperity.arrays import Field
from asperity.case import load_case
from asperity.errors import AsperityError
from asperity.inference import (
    Emulator,
    Forward,
    Observation,
    Point,
    Setting,
    build_emulator,
    forecast_observations,
    setting_of,
)
from asperity.inference.course import KNOTS, along_range, between_knots
from asperity.inference.outputs import CLR, OUTPUTS
from benchmarks.inference import CASE, KEPT, LEFT_S, share

HISTORIES, STEADY, FEW = 60, 300, 10
VISITS, LIMIT, SEED = 30, 0.5, 4
CRF_STD, DAMPING_STD, HEIGHT_STD = 2e-3, 0.05, 0.08
SHAPES = ("straight", "steepening", "slackening", "wandering")
RATE = 0.3  # of a range over the series, standard deviation
AHEAD = 2.0  # series' lengths after the last recording
PLACE = (500.0, 1.91)
COLUMNS = (
    "kind", "number", "shape", "crossing", "low", "median", "high", "rises", "rising", "within", "already", "log_odds",
    "alarm", "clr_true", "clr_low", "clr_high", "seconds",
)  # fmt: skip


def main() -> None:
    """Draw, listen, forecast, and say how often intervals hold."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--histories", type=int, default=HISTORIES)
    arguments.add_argument("--steady", type=int, default=STEADY)
    arguments.add_argument("--kept", type=Path, default=KEPT, help="folder that keeps everything")
    wanted = arguments.parse_args()
    with threadpool_limits(1):
        judge_all(wanted.histories, wanted.steady, wanted.kept)
    print("\n".join(tables(wanted.kept)))


def lines(*, fast: bool, seconds: float = float("inf")) -> Iterator[str]:
    """What `python -m benchmarks forecast` prints: all series judged so far, as many more as there is time for."""
    end = perf_counter() + seconds - LEFT_S
    judge_all(FEW if fast else HISTORIES, FEW if fast else STEADY, KEPT, end=end)
    yield from tables(KEPT)


def judge_all(histories: int, steady: int, kept: Path, *, end: float = float("inf")) -> None:
    """A row for each series, as it is done."""
    setting = setting_of(load_case(CASE))
    emulator = build_emulator(setting, folder=kept / "emulator", workers=1)
    path = kept / "courses.csv"
    done = [(row["kind"], int(row["number"])) for row in csv.DictReader(path.open())] if path.exists() else []
    for kind, count in (("wearing", histories), ("steady", steady)):
        for number in range(count):
            if perf_counter() > end:
                return
            if (kind, number) not in done:
                row = judged(setting, emulator, kind, number)
                with path.open("a", newline="") as file:
                    writer = csv.DictWriter(file, list(row))
                    if file.tell() == 0:
                        writer.writeheader()
                    writer.writerow(row)


def judged(setting: Setting, emulator: Emulator, kind: str, number: int) -> dict[str, Any]:
    """One series: what is foretold of it, and what comes."""
    rng = np.random.default_rng([SEED, number, kind == "steady"])
    forward = Forward(setting, emulator, (Point(*PLACE),))
    crossing = np.nan
    while True:
        z = rng.standard_normal((1, len(setting.unknowns)))
        shape = SHAPES[number % len(SHAPES)] if kind == "wearing" else "steady"
        course = _course(shape, float(setting.unknowns[0].share(z[0, :1])[0]), rng)
        if course.min() < 0.0 or course.max() > 1.0:
            continue
        sounds, clr = _shown(forward, z, course, rng)
        if clr[: _at(1.0) + 1].min() < 0.02:
            continue  # nothing resonates
        if kind == "steady":
            break
        past = np.flatnonzero((clr - LIMIT) * (clr[_at(1.0)] - LIMIT) <= 0.0)
        past = past[past > _at(1.0)]
        if len(past):
            crossing = TIME[past[0]] - 1.0
            break
    began = process_time()
    try:
        found = forecast_observations(setting, emulator, _heard(sounds, rng), limit=(CLR, LIMIT), seed=number)
    except AsperityError:  # counts as not held
        return dict.fromkeys(COLUMNS, np.nan) | {
            "kind": kind, "number": number, "shape": shape, "crossing": crossing, "alarm": 0, "rises": 0, "rising": -1,
            "seconds": round(process_time() - began, 1),
        }  # fmt: skip
    return {
        "kind": kind, "number": number, "shape": shape, "crossing": crossing, "low": found.time.low,
        "median": found.time.median, "high": found.time.high, "rises": int(clr[-1] > clr[0]),
        "rising": int(found.rising), "within": found.within, "already": found.already, "log_odds": found.log_odds,
        "alarm": int(found.alarm), "clr_true": clr[_at(1.0)], "clr_low": found.clr.low, "clr_high": found.clr.high,
        "seconds": round(process_time() - began, 1),
    }  # fmt: skip


TIME = np.linspace(0.0, 1.0 + AHEAD, 601)


def _at(time: float) -> int:
    return int(np.searchsorted(TIME, time))


def _course(shape: str, begin: float, rng: np.random.Generator) -> Field:
    """Shares of the range of Sq over time, 1 the last recording."""
    if shape == "steady":
        return np.full(TIME.size, begin)
    rate = RATE * rng.standard_normal()
    if shape == "steepening":
        return begin + rate * (0.5 * TIME + 0.5 * TIME**2)
    if shape == "slackening":
        return begin + 1.5 * rate * (1.0 - np.exp(-TIME))
    wander = np.zeros(TIME.size)
    if shape == "wandering":
        speed = 0.3 * abs(rate) * np.sqrt(TIME[1]) * rng.standard_normal(TIME.size)
        wander = np.cumsum(np.cumsum(speed)) * TIME[1]
    return begin + rate * TIME + wander


def _shown(forward: Forward, z: Field, course: Field, rng: np.random.Generator) -> tuple[dict[str, Field], Field]:
    """Logarithms that the true contact shows, and its load share: the emulator's, off by a draw of its deviation."""
    unknown, grid = forward.setting.unknowns[0], np.linspace(0.0, 1.0, 4 * KNOTS)
    along = along_range(z, 0, unknown.at_share(grid))
    shown = forward.shown(along, "hertz-point", deviations=False)
    mean, _ = forward.emulated(along, [CLR], deviations=False)[CLR]
    _, std = forward.emulated(z, [CLR])[CLR]
    scale = between_knots(mean.T, course[None])[0][0] + std[0, 0] * rng.standard_normal()
    clr = OUTPUTS[CLR].back(scale)
    tables = {key: between_knots(getattr(shown, key).T, course[None])[0][0] for key in ("crf", "damping", "crfa")}
    before = OUTPUTS[CLR].back(between_knots(mean.T, course[None])[0][0])
    tables["crf"] = tables["crf"] + np.log(np.maximum(clr, 1e-4) / np.maximum(before, 1e-4)) / 6.0
    return tables, clr


def _heard(sounds: dict[str, Field], rng: np.random.Generator) -> list[Observation]:
    heard = []
    for at in np.linspace(0.0, 1.0, VISITS):
        place = _at(at)
        crf, damping, crfa = (
            float(np.exp(sounds[key][place] + std * rng.standard_normal()))
            for key, std in (("crf", CRF_STD), ("damping", DAMPING_STD), ("crfa", HEIGHT_STD))
        )
        heard.append(
            Observation(
                load_n=PLACE[0], entrainment_m_s=PLACE[1], crf_hz=crf, crf_std_hz=CRF_STD * crf,
                damping_ratio=damping, damping_std=DAMPING_STD * damping, crfa=crfa, crfa_std=HEIGHT_STD * crfa,
                x=100.0 * at,
            )
        )  # fmt: skip
    return heard


def tables(kept: Path) -> Iterator[str]:
    """Shares of intervals that hold and of alarms, as Markdown."""
    path = kept / "courses.csv"
    rows = list(csv.DictReader(path.open())) if path.exists() else []
    yield "## The time to CLR 50 %: intervals of 90 % over simulated wear histories"
    yield f"Sample: {len(rows)} series."
    if not rows:
        return
    yield "| course | series | held | upper end over lower (median) | CLR at the last recording held | change told |"
    yield "|---|---|---|---|---|---|"
    wearing = [row for row in rows if row["kind"] == "wearing"]
    for shape in (*SHAPES, "all"):
        own = [row for row in wearing if shape in (row["shape"], "all")]
        if own:
            inside = [_held(row) for row in own]
            width = np.nanmedian([float(row["high"]) / max(float(row["low"]), 1e-9) for row in own])
            now = [float(row["clr_low"]) <= float(row["clr_true"]) <= float(row["clr_high"]) for row in own]
            told = [float(row["log_odds"]) >= np.log(100.0) for row in own]
            yield f"| {shape} | {len(own)} | {share(inside)} | {width:.1f} | {share(now)} | {share(told)} |"
    steady = [row for row in rows if row["kind"] == "steady"]
    if steady:
        alarms, told = (int(sum(flags)) for flags in ([row["alarm"] == "1" for row in steady],
                        [float(row["log_odds"]) >= np.log(100.0) for row in steady]))  # fmt: skip
        yield f"Of {len(steady)} machines that stay as they are, {told} are told to change and {alarms} are alarmed of."
    yield f"A forecast took {np.median([float(row['seconds']) for row in rows]):.1f} s of a processor (median)."


def _held(row: dict[str, str]) -> bool:
    low, high, true = (float(row[key]) for key in ("low", "high", "crossing"))
    return row["rises"] == row["rising"] and low <= 100.0 * true <= high


if __name__ == "__main__":
    main()
