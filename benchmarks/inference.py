"""Contact spectroscopy on simulated machines: do intervals hold the truth, at one operating point and at six.

Truths are contacts solved anew (never the emulator's), means over several surfaces, with unknowns drawn from the case's
priors; their recordings are the rig's, with structural modes, noise and tones, and go through the joint separation.
`python -m benchmarks.inference` runs this part alone; contacts, emulator and rows are kept in build/inference and gone
on from. `--machines 40` draws more.
"""

import argparse
import csv
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binom
from threadpoolctl import threadpool_limits

from asperity.arrays import Field
from asperity.case import load_case
from asperity.coupling import VibrationModel, dry_full_load
from asperity.inference import (
    Emulator,
    Inference,
    Observation,
    Setting,
    build_emulator,
    infer_observations,
    setting_of,
)
from asperity.inference.inference import stages
from asperity.inference.listening import band_of
from asperity.paper import Disturbance
from asperity.paper.rig_recording import GRID_HZ, RigTest, contact_line, draw_background
from asperity.study import load_study, overrides_at, plan_points, run_study
from asperity.wear import remove_lines, series_resonances

CASE = Path(__file__).parents[1] / "examples" / "infer.toml"
KEPT = Path(__file__).parents[1] / "build" / "inference"
MACHINES, SURFACES, SEED = 40, 6, 20
LOADS, SPEEDS = (300.0, 500.0, 900.0), (0.8, 2.5)
ONE = 2  # the operating point of those inferred from one: 500 N, 0.8 m/s
TESTS = 2  # recordings at each operating point
RATE_HZ, DURATION_S, SEGMENT = 20e3, 60.0, 40_000
LEAST_SHARE = 0.01  # CLR below which there is no line to be found
OUTSIDE = ("exponent 1/5", "stiffer by 5 % at 900 N")  # truths that neither law has


def main() -> None:
    """Solve, listen, infer, and say how often intervals hold."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--machines", type=int, default=MACHINES)
    arguments.add_argument("--fast", action="store_true", help="six machines")
    arguments.add_argument("--kept", type=Path, default=KEPT, help="folder that keeps everything")
    wanted = arguments.parse_args()
    run(6 if wanted.fast else wanted.machines, wanted.kept)


def run(machines: int, kept: Path) -> None:
    """Every machine, in turn; a row each as it is done."""
    setting = setting_of(load_case(CASE))
    emulator = build_emulator(setting, folder=kept / "emulator", workers=1)
    print(emulator.sentence(), flush=True)
    emulator = replace(
        emulator, grid={}
    )  # truths are solved on its own grid: what a finer one changes is no part of them
    truths = solved(setting, machines, kept / "truth")
    rows = kept / "rows.csv"
    done = {} if not rows.exists() else {(row["machine"], row["law"]): True for row in csv.DictReader(rows.open())}
    for number, (z, states) in enumerate(truths):
        for law in ("inside", *outside(number)):
            if (str(number), law) in done:
                continue
            with threadpool_limits(1):
                found = list(judged(setting, emulator, number, law, z, states))
            with rows.open("a", newline="") as file:
                writer = csv.DictWriter(file, list(found[0]))
                if file.tell() == 0:
                    writer.writeheader()
                writer.writerows(found)
    report(rows)


def outside(number: int) -> tuple[str, ...]:
    """Laws that neither model has, of every third machine one."""
    return () if number % 3 else (OUTSIDE[number // 3 % len(OUTSIDE)],)


def solved(setting: Setting, machines: int, folder: Path) -> Iterator[tuple[Field, dict[str, Field]]]:
    """Unknowns of each machine, and its contact's state at each operating point: the mean over its surfaces."""
    rng = np.random.default_rng(SEED)
    unknowns = [rng.standard_normal(len(setting.unknowns)) for _ in range(MACHINES)][:machines]
    points = []
    for z in unknowns:
        shares = [float(unknown.share(z[place])) for place, unknown in enumerate(setting.contact)]
        base = overrides_at(setting.case, [unknown.range for unknown in setting.contact], shares)
        points += [
            {**base, "contact.load": f"{load:g} N", "contact.entrainment_speed": f"{speed:g} m/s"}
            for load in LOADS
            for speed in SPEEDS
        ]
    plan = plan_points(setting.case, points, seeds=SURFACES, kind="still")
    finished = load_study(folder) if (folder / "manifest.json").exists() else None
    wanted = {case.id for case in plan.cases}
    if finished is None or not wanted <= set(finished.table["case_id"]):
        finished = run_study(plan, out=folder, workers=1)
    table = finished.table[finished.table["status"] == "done"]
    means = table.groupby("point")[["clr", "car", "h_mean_m"]].agg(["mean", "count"])
    for number, z in enumerate(unknowns):
        own = [number * len(LOADS) * len(SPEEDS) + place for place in range(len(LOADS) * len(SPEEDS))]
        if all(place in means.index and means.loc[place, ("clr", "count")] >= SURFACES - 1 for place in own):
            yield z, {key: means.loc[own, (key, "mean")].to_numpy() for key in ("clr", "car", "h_mean_m")}


def judged(
    setting: Setting, emulator: Emulator, number: int, law: str, z: Field, states: dict[str, Field]
) -> Iterator[dict[str, Any]]:
    """A row for the machine heard at one operating point, and one at all of them."""
    heard = recordings(setting, number, law, z, states)
    sq = float(setting.unknowns[0].value(z[:1])[0])
    places = [(load, speed) for load in LOADS for speed in SPEEDS]
    at_one = [one for one in heard if (one.load_n, one.entrainment_m_s) == places[ONE]]
    for points, observations in ((1, at_one), (len(places), heard)):
        row: dict[str, Any] = {"machine": number, "law": law, "points": points, "heard": len(observations)}
        if not observations:
            yield row | dict.fromkeys(HELD, "")
            continue
        found = infer_observations(setting, emulator, observations, seed=number)
        yield row | held(found, places[ONE] if points == 1 else observations[0].place[:2], places, sq, states)


HELD = (
    "sq_true", "sq_low", "sq_high", "sq_exact_low", "sq_exact_high", "sq_bits", "clr_true", "clr_low", "clr_high",
    "clr_exact_low", "clr_exact_high", "clr_bits", "stage_true", "stage_probability", "law_error", "exact_probability",
    "own_probability",
)  # fmt: skip


def held(
    found: Inference,
    at: tuple[float, float],
    places: Sequence[tuple[float, float]],
    sq: float,
    states: dict[str, Field],
) -> dict[str, Any]:
    """Truth and intervals of Sq, and of CLR and stage at one operating point that was heard."""
    place = next(
        number for number, point in enumerate(found.forward.points)
        if number and (point.load_n, point.entrainment_m_s) == at
    )  # fmt: skip
    clr = float(states["clr"][list(places).index(at)])
    ends = {}
    for name, draws in (("", found.draws), ("exact_", found.exact)):
        for key, values in (("sq", found.values(draws)["sq_m"]), ("clr", found.values(draws, place)["clr"])):
            low, high = np.quantile(values, (0.05, 0.95))
            ends |= {f"{key}_{name}low": float(low), f"{key}_{name}high": float(high)}
    own = found.at_points()[place - 1]
    true_stage = max(stages(np.array([clr])).items(), key=lambda entry: entry[1])[0]
    return {
        key: {
            **ends,
            "sq_true": sq,
            "sq_bits": found.posterior()["sq_m"].information_bits,
            "clr_true": clr,
            "clr_bits": own.state["clr"].information_bits,
            "stage_true": true_stage,
            "stage_probability": own.stages[true_stage],
            "law_error": found.law_error,
            "exact_probability": found.models[1].probability,
            "own_probability": found.law_probability("own"),
        }[key]
        for key in HELD
    }


def recordings(setting: Setting, number: int, law: str, z: Field, states: dict[str, Field]) -> list[Observation]:
    """What the rig hears of a machine, by the joint separation of all its recordings."""
    values = {unknown.key: float(unknown.value(z[i : i + 1])[0]) for i, unknown in enumerate(setting.unknowns)}
    stated = setting.case.vibration
    assert stated is not None
    model = stated.with_choices(
        mass=values["mass_kg"], damping_ratio=values["damping_ratio"], cutoff_exponent=values["cutoff_exponent"]
    )
    rng = np.random.default_rng([SEED, number])
    frequency = np.arange(0.0, RATE_HZ / 2.0 + GRID_HZ, GRID_HZ)
    band = band_of(setting)
    background = draw_background(frequency, band, Disturbance(), rng)
    spectra, places = [], []
    for place, (load, speed) in enumerate((load, speed) for load in LOADS for speed in SPEEDS):
        clr = float(states["clr"][place])
        if clr < LEAST_SHARE or states["car"][place] == 0.0:
            continue  # nothing resonates
        conditions = setting.case.with_overrides({"contact.load": f"{load:g} N"}).conditions
        state = replace(dry_full_load(conditions, values["sq_m"]), clr=clr, car=float(states["car"][place]))
        line = contact_line(state, conditions, wrongly(model, law, clr, load), frequency, RATE_HZ)
        for test in range(TESTS):
            ring = RigTest(number + 1, test + 1, values["sq_m"], 1e-8, RATE_HZ, DURATION_S)
            spectra.append(background.recorded(ring, line, Disturbance(), rng).spectrum(SEGMENT))
            places.append((load, speed))
    if len(spectra) < 6:
        return []
    cleaned = [remove_lines(spectrum) for spectrum in spectra]
    found = series_resonances(
        [clean.spectrum for clean in cleaned], band_hz=band, method="joint", kept=[clean.kept for clean in cleaned]
    )
    return [
        Observation(
            load_n=load, entrainment_m_s=speed, crf_hz=one.crf_hz, crf_std_hz=one.crf_std,
            crfa=one.crfa if one.crfa_std > 0.0 else np.nan, crfa_std=one.crfa_std if one.crfa_std > 0.0 else np.nan,
            damping_ratio=one.damping_ratio, damping_std=one.damping_ratio_std,
        )
        for (load, speed), one in zip(places, found, strict=True)
        if one.found
    ]  # fmt: skip


def wrongly(model: VibrationModel, law: str, clr: float, load: float) -> VibrationModel:
    """The model with a mass that makes its frequency another law's."""
    if law == OUTSIDE[0]:  # CRF ~ (CLR F)^(1/5), the same as by 1/6 at 250 N
        factor = (clr * load / 250.0) ** (1.0 / 5.0 - 1.0 / 6.0)
    elif law == OUTSIDE[1]:
        factor = 1.05 if load == LOADS[-1] else 1.0
    else:
        return model
    return model.with_choices(mass=model.mass / factor**2)


def report(path: Path) -> None:
    """Shares of intervals that hold, with 90 % of the binomial, and widths."""
    rows = [row for row in csv.DictReader(path.open()) if row["sq_true"]]
    for law in dict.fromkeys(row["law"] for row in rows):
        for points in ("1", "6"):
            own = [row for row in rows if row["law"] == law and row["points"] == points]
            if not own:
                continue
            said = [f"{law}, {points} point{'s' if points != '1' else ''}, {len(own)} machines:"]
            for key in ("clr", "sq"):
                for name in ("", "exact_"):
                    low, high, true = (np.array([float(row[f"{key}_{end}"]) for row in own])
                                       for end in (f"{name}low", f"{name}high", "true"))  # fmt: skip
                    inside = int(np.sum((low <= true) & (true <= high)))
                    width = np.median(100.0 * (high - low)) if key == "clr" else np.median(high / low)
                    unit = "points wide" if key == "clr" else "times from end to end"
                    said.append(
                        f"{key}{' if exact' if name else ''} held {share(inside, len(own))}, {width:.2f} {unit};"
                    )
            bits = [np.median([float(row[f"{key}_bits"]) for row in own]) for key in ("clr", "sq")]
            stage = int(np.sum([float(row["stage_probability"]) > 0.05 for row in own]))
            error = np.median([float(row["law_error"]) for row in own])
            said.append(f"stage held {share(stage, len(own))}; {bits[0]:.1f} and {bits[1]:.1f} bits of CLR and Sq;")
            said.append(f"law's error {100 * error:.1f} % of CRF (median)")
            print(" ".join(said), flush=True)


def share(inside: int, count: int) -> str:
    """A share with its 90 % interval, were it the true one."""
    low, high = binom.interval(0.9, count, inside / count)
    return f"{100 * inside / count:.0f} % ({100 * low / count:.0f} to {100 * high / count:.0f})"


if __name__ == "__main__":
    main()
