"""Compare studies with the paper's published values: `python -m benchmarks.anchors`.

Running and standing: examples/paper.toml with running roughness and with snapshots. The others are
snapshots with the paper's model: the same case; the domain in the paper, which starves the film;
the free parameters that fit the anchors best (docs/theory/calibration.md).

`--curves FILE` writes CAR, CLR, CRF and CRFA over roughness as CSV, a row per study and level.
"""

import argparse
from pathlib import Path

import pandas

from asperity.case import load_case
from asperity.paper import PAPER_ANCHORS, compare_with_anchors, rig_deviation
from asperity.study import WearCurve, curve_from_study, plan_study, run_study, study_executor

EXAMPLES = Path(__file__).parents[1] / "examples"
SNAPSHOT = {"contact.roughness": "standing"}
CASES = {
    "running": ("paper.toml", {}),
    "standing": ("paper.toml", SNAPSHOT),
    "standing, the paper's model": ("paper.toml", {**SNAPSHOT, "model": "paper"}),
    "as published": ("paper-as-printed.toml", {**SNAPSHOT, "model": "paper"}),
    "calibrated": ("paper-calibrated.toml", {**SNAPSHOT, "model": "paper"}),
}
PERCENT = ("car", "car_domain", "clr")


def shown(quantity: str, value: float) -> str:
    if value != value:
        return "-"
    if quantity in PERCENT:
        return f"{100 * value:.1f} %"
    return f"{value:.2f} um" if quantity == "split" else f"{value:.0f} Hz"


def curves(names: list[str]) -> dict[str, WearCurve]:
    found = {}
    with study_executor() as executor:
        for name in names:
            file, overrides = CASES[name]
            case = load_case(EXAMPLES / file).with_overrides(overrides)
            found[name] = curve_from_study(run_study(plan_study(case), executor=executor))
    return found


def write_curves(found: dict[str, WearCurve], path: Path) -> None:
    """Write the studies' summaries."""
    tables = [curve.summary().assign(study=name) for name, curve in found.items()]
    pandas.concat(tables).to_csv(path, index=False, float_format="%.4g")


def print_anchors(found: dict[str, WearCurve]) -> None:
    print("\n| anchor | published | " + " | ".join(found) + " |")
    print("|---|---|" + "---|" * len(found))
    tables = {
        name: compare_with_anchors(curve).set_index("anchor") for name, curve in found.items()
    }
    for anchor in PAPER_ANCHORS:
        sign = {"about": "", "at least": "≥ ", "at most": "≤ "}[anchor.sense]
        cells_shown = []
        for table in tables.values():
            row = table.loc[anchor.name]
            span = f"{shown(anchor.quantity, row['low'])} to {shown(anchor.quantity, row['high'])}"
            text = (
                "none"
                if row["ours"] != row["ours"]
                else f"{shown(anchor.quantity, row['ours'])} ({span})"
            )
            cells_shown.append(f"**{text}**" if row["met"] else text)
        print(
            f"| {anchor.name} | {sign}{shown(anchor.quantity, anchor.value)} |"
            f" {' | '.join(cells_shown)} |"
        )
    for name, reference in (
        ("ends", "two published ends"),
        ("knee", "12 rings, bent"),
        ("smooth", "12 rings, saturating"),
    ):
        off = [f"{rig_deviation(curve)[name]:.0f} Hz" for curve in found.values()]
        print(f"| rms deviation of CRF from the rig, {reference} | - | {' | '.join(off)} |")
    for preset in ("sound", "paper"):
        stages = [curve.stages[preset].kind for curve in found.values()]
        print(f"| stages, preset {preset} | severe | {' | '.join(stages)} |")
    failed = [str(curve.left_out) for curve in found.values()]
    print(f"| cases that failed, of 180 | - | {' | '.join(failed)} |")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", action="append", choices=CASES)
    parser.add_argument("--curves", type=Path)
    chosen = parser.parse_args()
    studies = curves(chosen.only or list(CASES))
    print_anchors(studies)
    if chosen.curves is not None:
        write_curves(studies, chosen.curves)
