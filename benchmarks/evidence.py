"""Capacitance as evidence: intervals of CLR on simulated machines in thin films.

True contacts are new solutions (not the emulator's), means over twelve surfaces, with unknowns
drawn from the priors of examples/infer.toml, of standing roughness, where the emulator's film ratio
lies between 1 and 3 at 500 N and 1.91 m/s. Each is measured there and at four further operating
points. CRF follows the paper's spring under the true load share (none below 1 %), known to 0.5 %,
damping to 10 %. The capacitance is that of the solved contacts with an error of permittivity of 5 %
that the inference does not know, read to 2 %. Each machine is inferred without and with it.
`python -m benchmarks.evidence --machines 100`.
"""

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas

from asperity.case import load_case
from asperity.contact.hertz import point_stiffness
from asperity.core.arrays import Field
from asperity.core.coverage import QUANTILES
from asperity.inference import (
    Emulator,
    Observation,
    Setting,
    build_emulator,
    infer_observations,
    inference_setting,
)
from asperity.study import overrides_at, plan_points, run_study
from benchmarks.rows import FOLDER

CASE = Path(__file__).parents[1] / "examples" / "infer.toml"
KEPT = Path(__file__).parents[1] / "build" / "evidence"
ROWS = FOLDER / "evidence-machines.csv"
MACHINES, SEED, SURFACES = 100, 33, 12
FILM_RATIOS = 1.0, 3.0
MIN_SHARE = 0.01  # of the load, below which there is no resonance
CRF_STD, DAMPING_STD = 0.005, 0.1
CAPACITANCE_STD, PERMITTIVITY_STD = 0.02, 0.05
ROUNDING = 1e-3  # of a load share that counts as inside
PLACES = ((500.0, 1.91), (300.0, 0.8), (900.0, 0.8), (300.0, 2.5), (900.0, 2.5))


def main() -> None:
    """Solve, infer, and print coverage and width of intervals."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--machines", type=int, default=MACHINES)
    parsed = arguments.parse_args()
    table = judged(parsed.machines)
    table.to_csv(ROWS, index=False)
    print("\n".join(tables(table)))


def lines(*, fast: bool) -> Iterator[str]:  # noqa: ARG001 - short already
    """Yield the table of the stored machines; `python -m benchmarks.evidence` solves them again."""
    yield "## Capacitance as evidence: intervals of CLR on simulated machines"
    yield ""
    yield from tables(pandas.read_csv(ROWS))


def judged(machines: int) -> pandas.DataFrame:
    """Return a row per machine: truth, and intervals without and with the capacitance."""
    case = load_case(CASE).with_overrides({"contact.roughness": "standing"})
    setting = inference_setting(case)
    emulator = replace(build_emulator(setting, folder=KEPT / "emulator", workers=2), grid={})
    unknowns = list(drawn(setting, emulator, machines))
    points = [
        {
            **overrides_at(
                setting.case,
                [unknown.range for unknown in setting.contact],
                [float(unknown.share(z[place])) for place, unknown in enumerate(setting.contact)],
            ),
            "contact.load": f"{load:g} N",
            "contact.entrainment_speed": f"{speed:g} m/s",
        }
        for z in unknowns
        for load, speed in PLACES
    ]
    plain = setting.case.with_overrides({"vibration": "none"})
    study = run_study(
        plan_points(plain, points, seeds=SURFACES, kind="still"), out=KEPT / "places", workers=2
    )
    done = study.table[study.table["status"] == "done"].groupby("point")
    means = done[["clr", "capacitance_f", "h_mean_m", "sq_m"]].mean()[done.size() == SURFACES]
    rows = []
    for number, z in enumerate(unknowns):
        first = number * len(PLACES)
        if all(place in means.index for place in range(first, first + len(PLACES))):
            truth = means.loc[first : first + len(PLACES) - 1]
            rows.append(row(setting, emulator, number, z, truth))
    return pandas.DataFrame(rows)


def drawn(setting: Setting, emulator: Emulator, count: int) -> Iterator[Field]:
    """Yield unknowns from the priors with a film ratio in the range."""
    rng = np.random.default_rng(SEED)
    while count:
        z = rng.standard_normal(len(setting.unknowns))
        if FILM_RATIOS[0] < film_ratio(setting, emulator, z) < FILM_RATIOS[1]:
            count -= 1
            yield z


def film_ratio(setting: Setting, emulator: Emulator, z: Field) -> float:
    """Return the emulator's mean film over Sq."""
    found = infer_point(setting, emulator, z)
    return found["h_mean_m"] / found["sq_m"]


def infer_point(setting: Setting, emulator: Emulator, z: Field) -> dict[str, float]:
    """Return the emulator's film at the case's own load and speed, and Sq."""
    from asperity.inference import ForwardModel, ObservationPoint

    conditions = setting.case.conditions
    point = ObservationPoint(conditions.load, conditions.entrainment_speed)
    forward = ForwardModel(setting, emulator, (point,))
    film = forward.states(z[None, :], ["h_mean_m"])["h_mean_m"][0, 0]
    return {"h_mean_m": float(film), "sq_m": float(forward.unknown(z[None, :], "sq_m", 1.0)[0])}


def row(
    setting: Setting, emulator: Emulator, number: int, z: Field, truth: pandas.DataFrame
) -> dict[str, float]:
    """Return the truth of a machine, and the ends of its intervals of CLR."""
    rng = np.random.default_rng([SEED, number])
    values = {
        unknown.key: float(unknown.value(z[i : i + 1])[0])
        for i, unknown in enumerate(setting.unknowns)
    }
    permittivity = np.exp(PERMITTIVITY_STD * rng.standard_normal())
    electric, resonances = [], []
    for (load, speed), state in zip(PLACES, truth.to_dict("records"), strict=True):
        scale = permittivity * state["capacitance_f"]
        scale *= np.exp(CAPACITANCE_STD * rng.standard_normal())
        electric.append(
            Observation(
                load_n=load,
                entrainment_m_s=speed,
                capacitance_f=scale,
                capacitance_std_f=CAPACITANCE_STD * scale,
            )
        )
        if state["clr"] >= MIN_SHARE:
            resonances.append(resonance(setting, values, load, speed, state["clr"], rng))
    ends = {}
    for name, observations in (("without", resonances), ("with", [*resonances, *electric])):
        found = infer_observations(setting, emulator, observations, seed=number)
        draws = found.draws if observations else found.prior
        low, high = np.quantile(draws.states["clr"][:, 0], [QUANTILES[0], QUANTILES[-1]])
        ends |= {f"clr_{name}_low": float(low), f"clr_{name}_high": float(high)}
    own = truth.iloc[0]
    return {
        "machine": number,
        "film_ratio": float(own["h_mean_m"]) / values["sq_m"],
        "clr": float(own["clr"]),
        "resonances": len(resonances),
        **ends,
    }


def resonance(
    setting: Setting,
    values: dict[str, float],
    load: float,
    speed: float,
    clr: float,
    rng: np.random.Generator,
) -> Observation:
    """Return the resonance of a machine by the paper's spring, with errors."""
    conditions = setting.case.conditions
    stiffness = point_stiffness(
        clr * load, conditions.radius_along_rolling, conditions.pair.reduced_modulus
    )
    crf_hz = np.sqrt(stiffness / values["mass_kg"]) / (2.0 * np.pi)
    crf_hz *= np.exp(CRF_STD * rng.standard_normal())
    damping = values["damping_ratio"] * np.exp(DAMPING_STD * rng.standard_normal())
    return Observation(
        load_n=load,
        entrainment_m_s=speed,
        crf_hz=float(crf_hz),
        crf_std_hz=float(CRF_STD * crf_hz),
        damping_ratio=float(damping),
        damping_std=float(DAMPING_STD * damping),
    )


def tables(table: pandas.DataFrame) -> Iterator[str]:
    """Yield the table of widths and coverage."""
    yield (
        "| film ratio | machines | resonances at five points | width of CLR without, with "
        "capacitance | ratio (median) | coverage without, with |"
    )
    yield "|---|---|---|---|---|---|"
    groups = {
        f"{low:g} to {high:g}": table["film_ratio"].between(low, high)
        for low, high in ((1.0, 1.5), (1.5, 2.0), (2.0, 3.0), FILM_RATIOS)
    }
    groups["fewer than three resonances"] = table["resonances"] < 3
    for name, chosen in groups.items():
        part = table[chosen]
        widths, covered = {}, {}
        for kind in ("without", "with"):
            low, high = part[f"clr_{kind}_low"], part[f"clr_{kind}_high"]
            widths[kind] = high - low
            inside = (part["clr"] >= low - ROUNDING) & (part["clr"] <= high + ROUNDING)
            covered[kind] = 100.0 * inside.mean()
        yield (
            f"| {name} | {len(part)} | {part['resonances'].mean():.1f} | "
            f"{100 * widths['without'].median():.1f}, {100 * widths['with'].median():.1f} points | "
            f"{(widths['with'] / widths['without']).median():.2f} | "
            f"{covered['without']:.0f}, {covered['with']:.0f} % |"
        )


if __name__ == "__main__":
    main()
