"""Numbers that a change of the house must not move: what `--json` says of small cases, and the
tables behind it.

`python -m support.golden_numbers` (from `tests`) writes them anew into `reference/golden`: only
when a change of numbers is meant, and the changelog says which.
"""

import json
import os
import re
import sys
from collections.abc import Callable
from contextlib import chdir, redirect_stdout
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

TESTS = Path(__file__).parents[1]
REFERENCE = TESTS / "reference" / "golden"
EXAMPLES = TESTS.parent / "examples"
ROUNDING = 1e-11  # of what would be nothing
TIMES = ("seconds", "solve_seconds")  # what no two runs share
LEFT = (
    "reynolds_residual",
    "load_error",
)  # of equations that are solved: any two processors leave something else
SOLVED = 1e-4  # the solver's tolerance, which it has to be below
SMALL = ("grid.cells=[64, 48]", "vibration.duration=0.2 s")
ROLLING = ("grid.cells=[48, 32]", "surface.correlation_length=40 um")
GROUND = """
kind = "ground"
sq = "0.5 um"
groove_width = "40 um"
groove_length = "150 um"
direction_deg = 90
seed = 1
"""


def say(*arguments: str) -> dict[str, Any]:
    """What a command prints as JSON."""
    from asperity.cli import main

    printed = StringIO()
    try:
        with redirect_stdout(printed):
            main([*arguments, "--json"])
    except SystemExit as end:
        if end.code not in (0, None, 3, 4):  # an alarm, or no way to tell
            raise
    return json.loads(printed.getvalue())


def solved(*overrides: str, case: str = "paper.toml") -> dict[str, Any]:
    return say("solve", str(EXAMPLES / case), "--surfaces", "1", *_set(overrides))


def elliptic() -> dict[str, Any]:
    text = (EXAMPLES / "ball-on-disc.toml").read_text("utf-8")
    text = text.replace('geometry = "point"', 'geometry = "elliptic"').replace(
        '"12.5 mm"', '["8 mm", "20 mm"]'
    )
    start, rest = text.split("[surface]")
    Path("case.toml").write_text(
        f"{start}[surface]{GROUND}\n[grid]{rest.split('[grid]')[1]}", "utf-8"
    )
    return say(
        "solve",
        "case.toml",
        "--surfaces",
        "1",
        *_set(("grid.cells=[48, 48]", "thermal.feedback=true")),
    )


def study() -> dict[str, Any]:
    swept = ('study.sq=["0.5 um", "1.5 um", "3 um", "4 um"]', "study.seeds=2")
    said = say(
        "study",
        str(EXAMPLES / "paper.toml"),
        "--out",
        "study",
        "--workers",
        "1",
        *_set((*SMALL, *swept)),
    )
    return {**said, "rows": _rows(Path("study/table.parquet"))}


def history(*overrides: str, steps: int, listen: bool = False) -> dict[str, Any]:
    words = ("--listen",) if listen else ()
    said = say(
        "run",
        str(EXAMPLES / "paper.toml"),
        "--steps",
        str(steps),
        "--out",
        "h",
        *words,
        *_set(overrides),
    )
    table, *_ = Path("h").glob("*.parquet")
    return {**said, "rows": _rows(table)}


def tracked() -> dict[str, Any]:
    made = say("rig", "--out", "rig", "--samples", "6", "--repeats", "2", "--duration", "2 s")
    table = ("--table", "rig/table.csv", "--case", "rig/rig.toml", "--workers", "1")
    checked = say(
        "check",
        "rig/recordings" if Path("rig/recordings").is_dir() else "rig",
        "--case",
        "rig/rig.toml",
    )
    return {"rig": made, "check": checked, "track": say("track", "rig", *table)}


def measured() -> dict[str, Any]:
    x, y = np.meshgrid(np.arange(96), np.arange(80), indexing="ij")
    waves = (
        0.8 * np.sin(x / 5.0)
        + 0.5 * np.cos(y / 7.0 + x / 11.0)
        + 0.1 * ((7 * x + 13 * y) % 17) / 17
        + 0.01 * x
    )
    np.savetxt("map.txt", waves.T, fmt="%.6f")
    words = ("--unit", "um", "--pixel", "2 um")
    filtered = ("--form", "cylinder", "--s-filter", "8 um", "--outliers", "remove")
    return {
        "plain": say("surface", "map.txt", *words),
        "filtered": say("surface", "map.txt", *words, *filtered),
    }


def curves() -> dict[str, Any]:
    case, small = str(EXAMPLES / "paper.toml"), _set(("grid.cells=[48, 32]",))
    speeds = ("--speed", "0.2", "--speed", "2", "--sq", "0.5 um")
    return {
        "stribeck": say("stribeck", case, *speeds, *small),
        "traction": say("traction", case, "--slip", "0.05", "--slip", "0.3", *small),
    }


CASES: dict[str, Callable[[], dict[str, Any]]] = {
    "paper": lambda: solved(*SMALL),
    "paper-model": lambda: solved(*SMALL, "model=paper"),
    "smooth": lambda: solved(*SMALL, 'surface={kind="flat"}'),
    "printed-preset": lambda: solved(*SMALL, "vibration.preset=paper", "surface.sq=2.5 um"),
    "conserving": lambda: solved(*SMALL, "model=conserving", "surface.sq=0.6 um"),
    "dry": lambda: solved(*SMALL, "lubricant=none", "surface.sq=2 um"),
    "tangent": lambda: solved(
        "grid.cells=[48, 32]",
        "vibration.stiffness_law=tangent",
        "vibration.excitation=surface",
        "vibration.rate=200 kHz",
        "surface.sq=2 um",
    ),
    "warm": lambda: solved(
        *SMALL, "thermal.feedback=true", 'lubricant.rheology={law="ree-eyring", tau0="5 MPa"}'
    ),
    "warm-paper-model": lambda: solved(
        *SMALL,
        "thermal.feedback=true",
        'lubricant.rheology={law="ree-eyring", tau0="5 MPa"}',
        "model=paper",
    ),
    "ball": lambda: solved(
        "grid.cells=[64, 64]", "vibration.duration=0.2 s", case="ball-on-disc.toml"
    ),
    "ball-paper-model": lambda: solved(
        "grid.cells=[64, 64]", "vibration.duration=0.2 s", "model=paper", case="ball-on-disc.toml"
    ),
    "ellipse": elliptic,
    "study": study,
    "history": lambda: history(*ROLLING, "motion.flattening=true", steps=6, listen=True),
    "history-paper-model": lambda: history(
        *ROLLING, "motion.flattening=true", "model=paper", steps=6, listen=True
    ),
    "history-conserving": lambda: history(
        *ROLLING, "model=conserving", "surface.sq=0.6 um", steps=2
    ),
    "vibrate": lambda: {
        "sound": say("vibrate", str(EXAMPLES / "paper.toml")),
        "paper": say("vibrate", str(EXAMPLES / "paper-as-printed.toml"), "--preset", "paper"),
        "nonlinear": say(
            "vibrate", str(EXAMPLES / "paper.toml"), *_set(("vibration.response=nonlinear",))
        ),
        "table1": say("vibrate", "--table1", "--records", "20"),
    },
    "track": tracked,
    "surface": measured,
    "curves": curves,
}


def numbers(name: str) -> dict[str, Any]:
    """The numbers of a case, worked out in a folder of its own."""
    with TemporaryDirectory() as folder, chdir(folder):
        return _lasting(CASES[name]())


def differences(then: Any, now: Any, tolerance: float, where: str = "") -> list[str]:
    """Where two trees of numbers differ, a line each; numbers by more than `tolerance` of the
    larger one.
    """
    if isinstance(then, dict) and isinstance(now, dict):
        gone = [f"{where}.{key} is gone" for key in then.keys() - now.keys()]
        each = [
            differences(then[key], now[key], tolerance, f"{where}.{key}")
            for key in then
            if key in now
        ]
        return [*gone, *(line for lines in each for line in lines)]
    if isinstance(then, list) and isinstance(now, list) and len(then) == len(now):
        each = [
            differences(*pair, tolerance, f"{where}[{n}]")
            for n, pair in enumerate(zip(then, now, strict=True))
        ]
        return [line for lines in each for line in lines]
    if where.endswith(LEFT) and type(now) is float:
        same = abs(now) < SOLVED
    elif type(then) is type(now) is float:
        same = then == now or abs(then - now) <= max(tolerance * max(abs(then), abs(now)), ROUNDING)
    elif isinstance(then, str) and isinstance(now, str) and tolerance > 0.0:
        same = True  # digits in a sentence follow the numbers beside it
    else:
        same = type(then) is type(now) and then == now
    return [] if same else [f"{where}: {then!r} is now {now!r}"]


def _lasting(tree: Any) -> Any:
    if isinstance(tree, dict):
        return {key: _lasting(value) for key, value in tree.items() if key not in TIMES}
    if isinstance(tree, str):
        return re.sub(r"\b\d+(\.\d+)? s\b", "some s", tree)
    return [_lasting(value) for value in tree] if isinstance(tree, list) else tree


def _rows(table: Path) -> list[dict[str, Any]]:
    import pandas

    return json.loads(pandas.read_parquet(table).to_json(orient="records", double_precision=15))


def _set(overrides: tuple[str, ...]) -> list[str]:
    return [word for override in overrides for word in ("--set", override)]


if __name__ == "__main__":
    for name in sys.argv[1:] or CASES:
        sys.stderr.write(f"{name}\n")
        text = json.dumps(numbers(name), indent=1, sort_keys=True)
        (REFERENCE / f"{name}.json").write_text(text + os.linesep, "utf-8")
