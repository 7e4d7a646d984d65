"""Compare four studies with the paper's published values: `python -m benchmarks.anchors [CELLS]`.

Default: examples/paper.toml with its own model and with the paper's. As published: the domain in
the paper, which starves the film. Calibrated: the free parameters that fit the anchors best
(docs/theory/calibration.md). The last two use the paper's model.
"""

import sys
from pathlib import Path

from asperity.case import load_case
from asperity.paper import PAPER_ANCHORS, compare_with_anchors, rig_deviation
from asperity.study import WearCurve, curve_from_study, plan_study, run_study, study_executor

EXAMPLES = Path(__file__).parents[1] / "examples"
CASES = {
    "default": ("paper.toml", "mixed"),
    "default, the paper's model": ("paper.toml", "paper"),
    "as published": ("paper-as-printed.toml", "paper"),
    "calibrated": ("paper-calibrated.toml", "paper"),
}
PERCENT = ("car", "car_domain", "clr")


def shown(quantity: str, value: float) -> str:
    if value != value:
        return "-"
    if quantity in PERCENT:
        return f"{100 * value:.1f} %"
    return f"{value:.2f} um" if quantity == "split" else f"{value:.0f} Hz"


def curves(cells: int | None) -> dict[str, WearCurve]:
    found = {}
    with study_executor() as executor:
        for name, (file, model) in CASES.items():
            case = load_case(EXAMPLES / file).with_overrides({"model": model})
            if cells is not None:
                case = case.with_overrides({"grid.cells": [cells, cells]})
            found[name] = curve_from_study(run_study(plan_study(case), executor=executor))
    return found


def print_anchors(cells: int | None = None) -> None:
    found = curves(cells)
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
    print_anchors(int(sys.argv[1]) if len(sys.argv) > 1 else None)
