"""Tables of a study's report, in words and display units: levels, points, anchors and facts."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from asperity.core.quantities import NO_VALUE, Quantity, in_print, quantity
from asperity.report.study.curve import stage_names, surface_count
from asperity.report.study.quantity_names import axis_label, value_label
from asperity.study import StudyOverview, StudyPlan, as_written

MAX_POINTS = 60  # rows of a table in the page; the csv has all points
MAX_OUTPUTS = 8  # columns of that table
COMPUTED = {
    "solve": "contact and vibration",
    "shake": "contact and vibration, with dynamic stiffness and damping of the contact",
    "vibrate": "vibration model only",
    "surfaces": "contact and vibration, over several surfaces each",
}
LEVELS = (
    "clr",
    "car",
    "car_domain",
    "crf_sound_hz",
    "crfa_sound",
    "crf_paper_hz",
    "crfa_paper",
    "contact_damping_ratio",
)


class Cell(NamedTuple):
    """A value in a table, with a detail in small type below it."""

    value: str
    detail: str = ""


def anchor_rows(study: StudyOverview) -> list[dict[str, str]]:
    """Return the rows of the anchors: required value, study's value, interval, deviation, met."""
    if study.curve is None or not study.anchors:
        return []
    rows = []
    for _, row in study.tables["anchors"].iterrows():
        entry = _entry(row["quantity"])
        sense = "" if row["sense"] == "about" else f"{row['sense']} "
        rows.append(
            {
                "name": in_print(row["anchor"]),
                "source": row["source"],
                "required": f"{sense}{entry.text(row['printed'], row['tolerance'])}",
                "computed": entry.text(row["ours"]),
                "interval": _interval(entry, row["low"], row["high"]) or NO_VALUE,
                "deviation": f"{'+' if row['miss'] >= 0.0 else ''}{entry.number(row['miss'])}",
                "met": "yes" if row["met"] else "within the interval" if row["possible"] else "NO",
            }
        )
    return rows


def _entry(column: str) -> Quantity:
    """Return the quantity of a column; a plain number if the catalogue lacks it."""
    try:
        return quantity(column)
    except KeyError:
        return replace(quantity("dynamic_load"), key=column, name=column, form=".4g")


def _interval(entry: Quantity, low: float, high: float) -> str:
    """Return an interval as text, empty if it is not finite."""
    return (
        f"{entry.number(low)} to {entry.number(high)}"
        if np.isfinite(low) and np.isfinite(high)
        else ""
    )


def level_rows(study: StudyOverview) -> list[list[Cell]]:
    """Return head and rows of the levels of a wear curve: means with their intervals."""
    curve = study.curve
    if curve is None:
        return []
    summary = study.tables["levels"]
    stages = curve.stages.get("sound")
    sq = quantity("sq_m")
    entries = [quantity(key) for key in LEVELS if key in summary]
    rows = [
        [Cell(sq.label), Cell("Used"), *(Cell(entry.short, entry.display) for entry in entries)]
    ]
    has_split = stages is not None and stages.found
    if has_split:
        rows[0].append(Cell("Stage", "preset sound"))
    for level, row in enumerate(summary.to_dict("records")):
        cells = [Cell(sq.number(curve.sq[level])), Cell(str(curve.values("clr", level).size))]
        for entry in entries:
            low = row[f"{entry.key}_low"]
            high = row[f"{entry.key}_high"]
            cells.append(Cell(entry.number(row[entry.key]), _interval(entry, low, high)))
        if stages is not None and has_split:
            before, after = stage_names(stages)
            cells.append(Cell(after if row["sq_um"] >= stages.split else before))
        rows.append(cells)
    return rows


def has_many_points(study: StudyOverview) -> bool:
    """Return True if there are too many points for a table in the page."""
    return study.curve is None and len(study.result.plan.points) > MAX_POINTS


def point_rows(study: StudyOverview) -> list[list[Cell]]:
    """Return head and rows of the points of a study: means and standard deviations."""
    if study.curve is not None or has_many_points(study) or not len(study.used):
        return []
    entries = [
        replace(quantity(key), deviation=f"{key}_std") for key in study.outputs[:MAX_OUTPUTS]
    ]
    head = [*(Cell(axis_label(axis)) for axis in study.axes), Cell("Used")]
    rows = [[*head, *(Cell(entry.short, entry.display) for entry in entries)]]
    for _, point in study.tables["points"].iterrows():
        first = int(np.argmax(study.used["point"].to_numpy() == point["point"]))
        labels = (value_label(axis, axis.values[first]) for axis in study.axes)
        numbers: Sequence[str] = [entry.number_in(dict(point)) for entry in entries]
        rows.append([*map(Cell, labels), Cell(f"{point['cases']:.0f}"), *map(_stacked, numbers)])
    return rows


def _stacked(number: str) -> Cell:
    """Split a number into its value and the deviation below it."""
    value, _, deviation = number.partition(" ± ")
    return (
        Cell(value, f"± {deviation}") if deviation and not number.startswith("(") else Cell(number)
    )


def facts(study: StudyOverview) -> list[tuple[str, str]]:
    """Return the facts about the study: cases, values, seeds, folder, versions."""
    plan = study.result.plan
    points = f"{len(plan.points)} points" if len(plan.points) > 1 else "1 point"
    rows = [
        ("Computed", COMPUTED[plan.kind]),
        ("Cases", f"{len(plan.cases)}: {points} of {surface_count(study)}"),
    ]
    rows += [(key, _range(plan, key)) for key in plan.axes]
    seeding = {
        "independent": "independent for every case, derived from the case's seed",
        "common": "the same set at every point",
    }
    seeds = (
        "seeds of the surfaces: " + ", ".join(map(str, plan.seeds))
        if plan.seeds
        else seeding[plan.seeding]
    )
    rows.append(("Seeds", f"{seeds}; listed in cases.csv"))
    if study.result.folder is not None:
        rows.append(("Folder", study.result.folder.resolve().name))
    rows.append(
        (
            "Versions",
            ", ".join(f"{name} {number}" for name, number in study.result.versions.items()),
        )
    )
    return rows


def _range(plan: StudyPlan, key: str) -> str:
    """Return the values of a swept key as text."""
    values = list(dict.fromkeys(as_written(point[key]) for point in plan.points if key in point))
    few = len(values) <= 8
    return in_print(
        ", ".join(values) if few else f"{len(values)} values, {values[0]} to {values[-1]}"
    )
