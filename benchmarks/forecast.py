"""When a limit is crossed: simulated wear histories, and machines that stay as they are.

Contacts have unknowns from the case's priors, and are off the emulator by its deviation, which
stays along the course. Of one class courses are straight, steepening, slackening and wandering,
and scatter is white and of the size stated: what the filter takes for granted too. The other class
has what it does not: a course that jumps, one that runs in and then roughens, and CRF that
scatters by twice the size stated and remembers the visit before by 0.7. Those count whose load
share crosses 50 % between the last recording and two series' lengths after it. Rows are kept in
docs/benchmarks/forecast-courses.csv and gone on from.
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
from asperity.inference.drifting_contact import KNOTS, along_range, between_knots
from asperity.inference.outputs import CLR, OUTPUTS
from benchmarks.inference import CASE, KEPT, LEFT_S, share
from benchmarks.rows import FOLDER, Rows

HISTORIES, STEADY, FEW = 60, 300, 10
VISITS, LIMIT, SEED = 30, 0.5, 4
CRF_STD, DAMPING_STD, HEIGHT_STD = 2e-3, 0.05, 0.08
ROWS = FOLDER / "forecast-courses.csv"
SHAPES = ("straight", "steepening", "slackening", "wandering")
OTHERS = ("jumping", "run in, then roughening", "straight, scatter remembers")
CLASSES = {
    "wearing": SHAPES,
    "otherwise": OTHERS,
    "steady": ("steady",),
    "slow": ("steady, scatter remembers",),
}
REMEMBERED, SCATTER = (
    0.7,
    2.0,
)  # of scatter that remembers: from visit to visit, and over the deviation stated
RATE = 0.3  # of a range over the series, standard deviation
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
    """Draw, listen, forecast, and say how often intervals hold."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--histories", type=int, default=HISTORIES)
    arguments.add_argument("--steady", type=int, default=STEADY)
    arguments.add_argument("--kept", type=Path, default=KEPT, help="folder that keeps everything")
    wanted = arguments.parse_args()
    with threadpool_limits(1):
        judge_all(wanted.histories, wanted.steady, wanted.kept)
    print("\n".join(tables()))


def lines(*, fast: bool, seconds: float = float("inf")) -> Iterator[str]:
    """What `python -m benchmarks forecast` prints: all series judged so far, as many more as there
    is time for.
    """
    end = perf_counter() + seconds - LEFT_S
    judge_all(FEW if fast else HISTORIES, FEW if fast else STEADY, KEPT, end=end)
    yield from tables()


def judge_all(histories: int, steady: int, kept: Path, *, end: float = float("inf")) -> None:
    """A row for each series, as it is done."""
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
    """One series: what is foretold of it, and what comes."""
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
            continue  # nothing resonates
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
            setting, emulator, _heard(sounds, rng, shape), limit=(CLR, LIMIT), seed=number
        )
    except AsperityError:  # counts as not held
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
    """Shares of the range of Sq over time, 1 the last recording."""
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
    """Logarithms that the true contact shows, and its load share: the emulator's, off by a draw of
    its deviation.
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


def _heard(sounds: dict[str, Field], rng: np.random.Generator, shape: str) -> list[Observation]:
    heard, slow = [], 0.0
    for at in np.linspace(0.0, 1.0, VISITS):
        place = _at(at)
        crf, damping, crfa = (
            float(np.exp(sounds[key][place] + std * rng.standard_normal()))
            for key, std in (("crf", CRF_STD), ("damping", DAMPING_STD), ("crfa", HEIGHT_STD))
        )
        if "remembers" in shape:
            fresh = rng.standard_normal() * (np.sqrt(1.0 - REMEMBERED**2) if heard else 1.0)
            slow = REMEMBERED * slow + fresh
            crf = float(np.exp(sounds["crf"][place] + SCATTER * CRF_STD * slow))
        heard.append(
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
    return heard


def tables() -> Iterator[str]:
    """Shares of intervals that hold and of alarms, as Markdown: of all rows that are kept."""
    kept = Rows(ROWS, ("kind", "number"))
    rows = list(kept)
    yield "## The time to CLR 50 %: intervals of 90 % over simulated wear histories"
    yield f"Sample: {len(rows)} series."
    if not rows:
        return
    yield (
        "| course | series | held | upper end over lower (median) | CLR at the last recording held"
        " | change told |"
    )
    yield "|---|---|---|---|---|---|"
    for kind, whole in (
        ("wearing", "all of these, as the filter assumes"),
        ("otherwise", "all that it does not assume"),
    ):
        own = [row for row in rows if row["kind"] == kind]
        for shape in (*CLASSES[kind], whole):
            if some := [row for row in own if shape in (row["shape"], whole)]:
                yield _line(shape, some)
    for kind, what in (
        ("steady", "that stay as they are"),
        ("slow", "that do, and scatter that remembers"),
    ):
        if own := [row for row in rows if row["kind"] == kind]:
            alarms, told = (
                int(sum(flags))
                for flags in (
                    [row["alarm"] == "1" for row in own],
                    [float(row["log_odds"]) >= np.log(100.0) for row in own],
                )
            )
            yield (
                f"Of {len(own)} machines {what}, {told} are told to change and {alarms} are"
                " alarmed of."
            )
    took = np.median([float(row["seconds"]) for row in rows])
    yield (
        f"A forecast took {took:.1f} s of a processor (median). Rows by the code that found them:"
        f" {kept.codes()}."
    )


def _line(shape: str, rows: list[dict[str, str]]) -> str:
    width = np.nanmedian([float(row["high"]) / max(float(row["low"]), 1e-9) for row in rows])
    now = [
        float(row["clr_low"]) <= float(row["clr_true"]) <= float(row["clr_high"]) for row in rows
    ]
    told = [float(row["log_odds"]) >= np.log(100.0) for row in rows]
    held = share([_held(row) for row in rows])
    return f"| {shape} | {len(rows)} | {held} | {width:.1f} | {share(now)} | {share(told)} |"


def _held(row: dict[str, str]) -> bool:
    low, high, true = (float(row[key]) for key in ("low", "high", "crossing"))
    return row["rises"] == row["rising"] and low <= 100.0 * true <= high


if __name__ == "__main__":
    main()
