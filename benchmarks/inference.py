"""Contact spectroscopy on simulated machines: coverage of intervals with one and six operating
points.

True states are new contact solutions (not the emulator's), averaged over many surfaces, with
unknowns drawn from the case's priors. The rig simulates their recordings with structural modes,
noise and tones; the joint separation evaluates them. The emulator is the product's; it omits the
grid correction where the truth uses its own grid. True states are stored in
docs/benchmarks/inference-truths.csv, one line per operating point, so that a changed inference
needs no new solves. The emulator and unfinished contacts are stored in build/inference, intervals
in docs/benchmarks/inference-machines.csv, the source of the tables. `python -m
benchmarks.inference` runs this part alone, `--machines 60` with fewer machines, `--finer 10` with
as many whose truth uses twice the cells, `--known` with those already solved.
"""

import argparse
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import numpy as np
from scipy.stats import binomtest
from threadpoolctl import threadpool_limits

from asperity.case import load_case
from asperity.core.arrays import Field
from asperity.coupling import VibrationModel, dry_full_load
from asperity.inference import (
    Emulator,
    Inference,
    Observation,
    Setting,
    build_emulator,
    infer_observations,
    inference_setting,
)
from asperity.inference.inference import REGIMES, stage_probabilities
from asperity.inference.recording_input import resonance_band
from asperity.paper import Disturbance
from asperity.paper.rig_recording import GRID_HZ, RigTest, contact_line, draw_background
from asperity.resonance import remove_lines, series_resonances
from asperity.study import overrides_at, plan_points, run_study
from benchmarks.rows import FOLDER, Rows

CASE = Path(__file__).parents[1] / "examples" / "infer.toml"
KEPT = Path(__file__).parents[1] / "build" / "inference"
ROWS, TRUTHS = FOLDER / "inference-machines.csv", FOLDER / "inference-truths.csv"
MACHINES, FEW, SEED = 200, 6, 21
SURFACES = 12  # per true state: the mean scatters by 2 points of CLR; the emulator is off by 5
ALSO_OUTSIDE = (
    50  # number of machines simulated also with the laws that the inference does not contain
)
KEYS = ("clr", "car", "h_mean_m")
PLACES = tuple((load, speed) for load in (300.0, 500.0, 900.0) for speed in (0.8, 2.5))
SINGLE_POINT = PLACES[2]  # the operating point of single-point inference: 500 N, 0.8 m/s
TESTS = 2  # recordings per operating point
RATE_HZ, DURATION_S, SEGMENT = 20e3, 60.0, 40_000
LEAST_SHARE = 0.01  # CLR below which no line is detectable
INSIDE, FINER = "emulator grid", "twice the cells"
OUTSIDE = ("exponent 1/5", "CRF 5 % higher at 900 N")  # truths that violate both laws
LEFT_S = 60.0  # reserve of the time limit for writing the results


def main() -> None:
    """Solve, simulate recordings, infer, and print the coverage of intervals."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--machines", type=int, default=MACHINES)
    arguments.add_argument(
        "--finer", type=int, default=0, help="machines whose truth uses twice the cells"
    )
    arguments.add_argument("--fast", action="store_true", help=f"{FEW} machines")
    arguments.add_argument("--kept", type=Path, default=KEPT, help="folder of stored results")
    arguments.add_argument("--known", action="store_true", help="only machines with stored truth")
    parsed = arguments.parse_args()
    with threadpool_limits(1):
        judge_all(
            FEW if parsed.fast else parsed.machines, parsed.finer, parsed.kept, known=parsed.known
        )
    print("\n".join(tables()))


def lines(*, fast: bool, seconds: float = float("inf")) -> Iterator[str]:
    """Yield the output of `python -m benchmarks inference`: all stored machines, and more while
    time is left.
    """
    end = perf_counter() + seconds - LEFT_S
    judge_all(FEW if fast else MACHINES, 0, KEPT, end=end)
    yield from tables()


def judge_all(
    machines: int, finer: int, kept: Path, *, known: bool = False, end: float = float("inf")
) -> None:
    """Judge every machine in turn; write its rows when it is done."""
    setting = inference_setting(load_case(CASE))
    emulator = build_emulator(setting, folder=kept / "emulator", workers=1)
    print(emulator.sentence(), flush=True)
    on_its_grid = replace(emulator, grid={})
    rows, truths = Rows(ROWS, ("machine", "law")), Truths(setting, kept)
    for number, z in zip(range(machines), machines_of(setting), strict=False):
        for law in (
            INSIDE,
            *([FINER] if number < finer else []),
            *(OUTSIDE if number < ALSO_OUTSIDE else []),
        ):
            if perf_counter() > end:
                return
            grid = GRIDS[law == FINER]
            if (number, law) in rows or (known and (number, grid) not in truths.rows):
                continue
            machine = Machine(number, law, z, truths(number, z, grid))
            began = process_time()
            found = list(judged(setting, emulator if law == FINER else on_its_grid, machine))
            rows.write([row | {"seconds": process_time() - began} for row in found])


# Truths
# -------------------------------------------------------------------------------------------------

GRIDS = ("as the emulator's", "twice the cells")


@dataclass(frozen=True)
class Machine:
    """A simulated machine: unknowns, and its contact states at `PLACES` (None if a solve
    failed).
    """

    number: int
    law: str
    z: Field
    states: Mapping[str, Field] | None


def machines_of(setting: Setting) -> Iterator[Field]:
    """Yield the unknowns of one machine after another: standard normal draws of the case's
    priors.
    """
    rng = np.random.default_rng(SEED)
    while True:
        yield rng.standard_normal(len(setting.unknowns))


@dataclass
class Truths:
    """Contact states of machines at `PLACES`, averaged over surfaces; stored, or solved and
    stored.
    """

    setting: Setting
    kept: Path

    def __post_init__(self) -> None:
        self.rows = Rows(TRUTHS, ("machine", "grid"))

    def __call__(self, number: int, z: Field, grid: str) -> dict[str, Field] | None:
        """Return the states of one machine, or None if a contact could not be solved."""
        if (number, grid) not in self.rows:
            states, seconds = self._solved(number, z, grid)
            self.rows.write(
                [
                    {"machine": number, "grid": grid, "load_n": load, "entrainment_m_s": speed}
                    | {key: "" if states is None else states[key][place] for key in KEYS}
                    | {"seconds": seconds}
                    for place, (load, speed) in enumerate(PLACES)
                ]
            )
        own = [row for row in self.rows if (row["machine"], row["grid"]) == (str(number), grid)]
        if any(row[key] == "" for row in own for key in KEYS):
            return None
        return {key: np.array([float(row[key]) for row in own]) for key in KEYS}

    def _solved(self, number: int, z: Field, grid: str) -> tuple[dict[str, Field] | None, float]:
        """Return the states and the time of all contacts together."""
        case = self.setting.case
        if grid != GRIDS[0]:
            case = case.with_overrides({"grid.cells": [2 * count for count in case.grid.cells]})
        shares = [
            float(unknown.share(z[place])) for place, unknown in enumerate(self.setting.contact)
        ]
        base = overrides_at(case, [unknown.range for unknown in self.setting.contact], shares)
        points = [
            {**base, "contact.load": f"{load:g} N", "contact.entrainment_speed": f"{speed:g} m/s"}
            for load, speed in PLACES
        ]
        without_resonance = case.with_overrides(
            {"vibration": "none"}
        )  # skip the tangent stiffness, which doubles the time
        plan = plan_points(without_resonance, points, seeds=SURFACES, kind="solve")
        there = self.kept / ("truth" if grid == GRIDS[0] else "truth-finer") / f"{number:03d}"
        with ThreadPoolExecutor(1) as executor:  # one process per machine would double the time
            table = run_study(plan, out=there, executor=executor).table
        means = table[table["status"] == "done"].groupby("point")[list(KEYS)].agg(["mean", "count"])
        if len(means) < len(PLACES) or (means[KEYS[0], "count"] < SURFACES).any():
            return None, float(table["seconds"].sum())
        return {key: means[key, "mean"].to_numpy() for key in KEYS}, float(table["seconds"].sum())


def recordings(setting: Setting, machine: Machine) -> list[Observation]:
    """Return a machine's observations: the joint separation of all its simulated recordings."""
    assert machine.states is not None
    values = {
        unknown.key: float(unknown.value(machine.z[i : i + 1])[0])
        for i, unknown in enumerate(setting.unknowns)
    }
    stated = setting.case.vibration
    assert stated is not None
    model = stated.with_choices(
        mass=values["mass_kg"],
        damping_ratio=values["damping_ratio"],
        cutoff_exponent=values["cutoff_exponent"],
    )
    rng = np.random.default_rng([SEED, machine.number])
    frequency = np.arange(0.0, RATE_HZ / 2.0 + GRID_HZ, GRID_HZ)
    band = resonance_band(setting)
    background = draw_background(frequency, band, Disturbance(), rng)
    spectra, places = [], []
    for place, (load, speed) in enumerate(PLACES):
        clr, car = (float(machine.states[key][place]) for key in ("clr", "car"))
        if clr < LEAST_SHARE or car == 0.0:
            continue  # no resonance
        conditions = setting.case.with_overrides({"contact.load": f"{load:g} N"}).conditions
        state = replace(dry_full_load(conditions, values["sq_m"]), clr=clr, car=car)
        line = contact_line(
            state, conditions, wrongly(model, machine.law, clr, load), frequency, RATE_HZ
        )
        for test in range(TESTS):
            ring = RigTest(machine.number + 1, test + 1, values["sq_m"], 1e-8, RATE_HZ, DURATION_S)
            spectra.append(background.recorded(ring, line, Disturbance(), rng).spectrum(SEGMENT))
            places.append((load, speed))
    if len(spectra) < 6:
        return []
    cleaned = [remove_lines(spectrum) for spectrum in spectra]
    found = series_resonances(
        [clean.spectrum for clean in cleaned],
        band_hz=band,
        method="joint",
        kept=[clean.kept for clean in cleaned],
    )
    return [
        Observation(
            load_n=load,
            entrainment_m_s=speed,
            crf_hz=resonance.crf_hz,
            crf_std_hz=resonance.crf_std,
            crf_shared_std_hz=resonance.crf_shared_std,
            crfa=resonance.crfa if resonance.crfa_std > 0.0 else np.nan,
            crfa_std=resonance.crfa_std if resonance.crfa_std > 0.0 else np.nan,
            damping_ratio=resonance.damping_ratio,
            damping_std=resonance.damping_ratio_std,
        )
        for (load, speed), resonance in zip(places, found, strict=True)
        if resonance.found
    ]


def wrongly(model: VibrationModel, law: str, clr: float, load: float) -> VibrationModel:
    """Return the model with a mass that shifts its frequency to another law's."""
    if law == OUTSIDE[0]:  # CRF ~ (CLR F)^(1/5), the same as by 1/6 at 250 N
        factor = (clr * load / 250.0) ** (1.0 / 5.0 - 1.0 / 6.0)
    elif law == OUTSIDE[1]:
        factor = 1.05 if load == PLACES[-1][0] else 1.0
    else:
        return model
    return model.with_choices(mass=model.mass / factor**2)


# Judgement
# -------------------------------------------------------------------------------------------------

ENDS = tuple(
    f"{key}_{name}{end}"
    for key in ("clr", "sq")
    for name in ("", "exact_")
    for end in ("low", "high")
)
HELD = (
    "clr_true",
    "sq_true",
    *ENDS,
    "clr_bits",
    "sq_bits",
    "stage_true",
    "stage_held",
    "stage_probability",
    "likeliest",
    "likeliest_probability",
    "law_error",
    "exact_probability",
    "own_probability",
    "identifiable",
)


def judged(setting: Setting, emulator: Emulator, machine: Machine) -> Iterator[dict[str, Any]]:
    """Yield a row for the machine inferred at one operating point, and one at all points."""
    observations_of_all = [] if machine.states is None else recordings(setting, machine)
    at_one = [
        observation
        for observation in observations_of_all
        if observation.conditions[:2] == SINGLE_POINT
    ]
    for points, observations in ((1, at_one), (len(PLACES), observations_of_all)):
        row = {
            "machine": machine.number,
            "law": machine.law,
            "points": points,
            "observations": len(observations),
        }
        if not observations:
            yield row | dict.fromkeys(HELD, "")
            continue
        found = infer_observations(setting, emulator, observations, seed=machine.number)
        yield row | coverage(found, observations[0].conditions[:2], machine)


def coverage(found: Inference, at: tuple[float, float], machine: Machine) -> dict[str, Any]:
    """Return truth and intervals of Sq, and of CLR and stage at one observed operating point."""
    assert machine.states is not None
    place = next(
        number
        for number, point in enumerate(found.forward.points)
        if number and (point.load_n, point.entrainment_m_s) == at
    )
    clr = float(machine.states["clr"][PLACES.index(at)])
    ends = {}
    for name, draws in (("", found.draws), ("exact_", found.exact)):
        for key, values in (
            ("sq", found.values(draws)["sq_m"]),
            ("clr", found.values(draws, place)["clr"]),
        ):
            low, high = np.quantile(values, (0.05, 0.95))
            ends |= {f"{key}_{name}low": float(low), f"{key}_{name}high": float(high)}
    own = found.point_estimates()[place - 1]
    true_stage = max(stage_probabilities(np.array([clr])).items(), key=lambda entry: entry[1])[0]
    ordered = sorted(REGIMES, key=lambda stage: -own.stages[stage])
    reached = np.cumsum([own.stages[stage] for stage in ordered])
    needed = ordered[: int(np.searchsorted(reached, 0.9)) + 1]
    return {
        **{key: ends[key] for key in ENDS},
        "clr_true": clr,
        "sq_true": float(found.setting.unknowns[0].value(machine.z[:1])[0]),
        "clr_bits": own.state["clr"].information_bits,
        "sq_bits": found.posterior()["sq_m"].information_bits,
        "stage_true": true_stage,
        "stage_held": int(true_stage in needed),
        "stage_probability": own.stages[true_stage],
        "likeliest": ordered[0],
        "likeliest_probability": own.stages[ordered[0]],
        "law_error": found.law_error,
        "exact_probability": found.models[1].probability,
        "own_probability": found.law_probability("own"),
        "identifiable": int(found.identifiable),
    }


# Tables
# -------------------------------------------------------------------------------------------------


def tables() -> Iterator[str]:
    """Yield coverage (with 90 % binomial intervals) and widths as Markdown, from all stored
    rows.
    """
    kept = Rows(ROWS, ("machine", "law"))
    every = list(kept)
    yield "## Coverage of 90 % intervals on simulated machines"
    yield (
        "| truth | points | machines | CLR covered | CLR covered, laws exact | Sq covered | Sq"
        " covered, laws"
        " exact | stage covered | most likely stage correct (stated probability) |"
    )
    yield "|---|---|---|---|---|---|---|---|---|"
    groups = {(row["law"], row["points"]): [] for row in every}
    for row in every:
        groups[row["law"], row["points"]].append(row)
    solved_rows = {
        key: [row for row in rows if row["clr_true"]] for key, rows in sorted(groups.items())
    }
    solved_rows = {key: rows for key, rows in solved_rows.items() if rows}
    for (law, points), rows in solved_rows.items():
        inside = [
            share([within(row, key, name) for row in rows])
            for key in ("clr", "sq")
            for name in ("", "exact_")
        ]
        right = np.mean([row["likeliest"] == row["stage_true"] for row in rows])
        stated_probability = np.mean([float(row["likeliest_probability"]) for row in rows])
        stage = share([row["stage_held"] == "1" for row in rows])
        cells = (
            law,
            points,
            len(rows),
            *inside,
            stage,
            f"{100 * right:.0f} % ({100 * stated_probability:.0f} %)",
        )
        yield f"| {' | '.join(map(str, cells))} |"
    yield "## Width of the intervals and information gain (medians)"
    yield (
        "| truth | points | CLR, points of load | laws exact | Sq, upper end over lower | laws"
        " exact | bits of CLR | bits of Sq | law's error, % of CRF | ln evidence of an error over"
        " none |"
    )
    yield "|---|---|---|---|---|---|---|---|---|---|"
    for (law, points), rows in solved_rows.items():
        clr = [
            f"{100 * median(rows, f'clr_{name}high', f'clr_{name}low', np.subtract):.0f}"
            for name in ("", "exact_")
        ]
        sq = [
            f"{median(rows, f'sq_{name}high', f'sq_{name}low', np.divide):.2f}"
            for name in ("", "exact_")
        ]
        information_gain = [
            f"{np.median([float(row[f'{key}_bits']) for row in rows]):.1f}" for key in ("clr", "sq")
        ]
        error = f"{100 * np.median([float(row['law_error']) for row in rows]):.1f}"
        exact = np.clip([float(row["exact_probability"]) for row in rows], 1e-300, 1.0 - 1e-9)
        odds = f"{np.median(np.log(1.0 / exact - 1.0)):.1f}"
        yield f"| {' | '.join((law, points, *clr, *sq, *information_gain, error, odds))} |"
    machines = {row["machine"] for row in every}
    yield f"Sample: {len(machines)} machines."
    unobserved = {
        row["machine"]
        for row in every
        if row["law"] == INSIDE and row["points"] != "1" and row["observations"] == "0"
    }
    yield (
        f"{len(machines)} machines with {SURFACES} surfaces at each operating point; for"
        f" {len(unobserved)} too few recordings show a line, so they have no result. Rows per code"
        f" version: {kept.codes()}."
    )


def within(row: Mapping[str, str], key: str, name: str) -> bool:
    """Return True if an interval contains the truth."""
    low, high, true = (float(row[f"{key}_{end}"]) for end in (f"{name}low", f"{name}high", "true"))
    return low <= true <= high


def median(rows: Sequence[Mapping[str, str]], high: str, low: str, how: np.ufunc) -> float:
    """Return the median of `how` applied to two columns."""
    return float(
        np.median(how([float(row[high]) for row in rows], [float(row[low]) for row in rows]))
    )


def share(inside: Sequence[bool]) -> str:
    """Return a share with its 90 % interval (Clopper and Pearson)."""
    found = float(np.mean(inside))
    exact = binomtest(int(np.sum(inside)), len(inside)).proportion_ci(0.9)
    return f"{100 * found:.0f} % ({100 * exact.low:.0f} to {100 * exact.high:.0f})"


if __name__ == "__main__":
    main()
