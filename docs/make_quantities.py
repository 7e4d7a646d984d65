"""Writes docs/quantities.md, the catalogue of quantities as a page: `make docs`."""

from pathlib import Path

from asperity.core.quantities import Quantity, catalogue

PAGE = Path(__file__).with_name("quantities.md")
OPENING = """# Quantities

Every number that asperity states: under this key in `--json`, in tables and in files, in this unit. \
Pages and figures show it in the display unit where that is another one. \
The deviation is the key of its standard deviation or error bar. \
Made by `make docs` from `src/asperity/core/quantities.csv`, the one place where any of this is said.
"""
TITLES = {  # of groups, where the group's own name does not do
    "load": "Load and contact area",
    "sharing": "Load by film",
    "ends": "A roller along its length",
    "heat": "Temperature",
    "resonance": "Contact resonance",
    "own": "Stiffness and damping of the contact itself",
    "virgin": "The same while it still yields",
    "dynamic": "Stiffness and damping over frequency",
    "map": "Maps in a run's file",
    "vibration": "Vibration model",
    "curve": "Friction curves",
    "history": "Steps of a history",
    "history_vibration": "Vibration of a history",
    "track": "Series of recordings",
    "recording": "A recording",
    "axis": "Axes and parts of figures",
    "condition": "Conditions",
    "oil": "An oil by its data sheet",
    "rating": "Ratings of a machine",
    "knob": "Knobs of the live page",
    "band": "Where a resonance is looked for",
    "table1": "The paper's Table 1",
}


def page() -> str:
    """The catalogue as markdown, a table for each group in the order in which groups first come."""
    groups = dict.fromkeys(entry.group for entry in catalogue().values())
    return "\n".join([OPENING, *(_table(group) for group in groups)])


def _table(group: str) -> str:
    entries = [entry for entry in catalogue().values() if entry.group == group]
    named = any(entry.standard_name for entry in entries)
    heads = [
        "key",
        "symbol",
        "unit",
        "shown in",
        "deviation",
        "quantity",
        *(["CF name"] if named else []),
    ]
    rows = [_row(entry) + ([entry.standard_name] if named else []) for entry in entries]
    lines = [f"| {' | '.join(cells)} |" for cells in (heads, *rows)]
    return "\n".join(
        [
            f"## {TITLES.get(group, group.capitalize())}",
            "",
            lines[0],
            "|---" * len(heads) + "|",
            *lines[1:],
            "",
        ]
    )


def _row(entry: Quantity) -> list[str]:
    keys = [f"`{key}`" if key else "" for key in (entry.key, entry.deviation)]
    unit, shown = (
        "-" if text in ("", "1") else text for text in (entry.unit, entry.display or entry.unit)
    )
    told = f"{entry.name}: {entry.meaning}" if entry.meaning else entry.name
    return [
        keys[0],
        entry.symbol,
        unit,
        "" if shown == unit else shown,
        keys[1],
        told.replace("|", r"\|"),
    ]


if __name__ == "__main__":
    PAGE.write_text(page(), "utf-8")
