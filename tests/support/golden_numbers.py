"""Reference numbers that refactoring must not change: `--json` output of small cases and their
tables.

`python -m support.golden_numbers` (from `tests`) rewrites them in `reference/golden`. Do so only
when a change of numbers is intended and named in the changelog.
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
ROUNDING = 1e-11  # absolute tolerance for numbers that are zero apart from rounding
TIMES = ("seconds", "solve_seconds")  # differ from run to run
RESIDUALS = (
    "reynolds_residual",
    "load_error",
)  # residuals of solved equations, which depend on the processor
ITERATIONS = 0.2  # of Newton's method, whose steps depend on the processor, too
SOLVER_TOLERANCE = 1e-4  # the solver's tolerance, which bounds these residuals
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


def run_json(*arguments: str) -> dict[str, Any]:
    """Return the JSON output of a command."""
    from asperity.cli import main

    printed = StringIO()
    try:
        with redirect_stdout(printed):
            main([*arguments, "--json"])
    except SystemExit as end:
        if end.code not in (0, None, 3, 4):  # an alarm or an undetermined state
            raise
    return json.loads(printed.getvalue())


def solved(*overrides: str, case: str = "paper.toml") -> dict[str, Any]:
    words = ("--surfaces", "1", "--snapshot")
    return run_json("solve", str(EXAMPLES / case), *words, *_set(overrides))


def running() -> dict[str, Any]:
    output = run_json("solve", str(EXAMPLES / "paper.toml"), *_set(("grid.cells=[64, 32]",)))
    return {key: value for key, value in output.items() if key not in RESIDUALS}


def elliptic() -> dict[str, Any]:
    text = (EXAMPLES / "ball-on-disc.toml").read_text("utf-8")
    text = text.replace('geometry = "point"', 'geometry = "elliptic"').replace(
        '"12.5 mm"', '["8 mm", "20 mm"]'
    )
    start, rest = text.split("[surface]")
    Path("case.toml").write_text(
        f"{start}[surface]{GROUND}\n[grid]{rest.split('[grid]')[1]}", "utf-8"
    )
    return run_json(
        "solve",
        "case.toml",
        "--surfaces",
        "1",
        "--snapshot",
        *_set(("grid.cells=[48, 48]", "thermal.feedback=true")),
    )


def study() -> dict[str, Any]:
    swept = ('study.sq=["0.5 um", "1.5 um", "3 um", "4 um"]', "study.seeds=2")
    output = run_json(
        "study",
        str(EXAMPLES / "paper.toml"),
        "--out",
        "study",
        "--workers",
        "1",
        "--snapshot",
        *_set((*SMALL, *swept)),
    )
    return {**output, "rows": _rows(Path("study/table.parquet"))}


def history(*overrides: str, steps: int, listen: bool = False) -> dict[str, Any]:
    words = ("--listen",) if listen else ()
    output = run_json(
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
    return {**output, "rows": _rows(table)}


def tracked() -> dict[str, Any]:
    rig = run_json("rig", "--out", "rig", "--samples", "6", "--repeats", "2", "--duration", "2 s")
    table = ("--table", "rig/table.csv", "--case", "rig/rig.toml", "--workers", "1")
    checked = run_json(
        "check",
        "rig/recordings" if Path("rig/recordings").is_dir() else "rig",
        "--case",
        "rig/rig.toml",
    )
    return {"rig": rig, "check": checked, "track": run_json("track", "rig", *table)}


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
        "plain": run_json("surface", "map.txt", *words),
        "filtered": run_json("surface", "map.txt", *words, *filtered),
    }


def curves() -> dict[str, Any]:
    case, small = str(EXAMPLES / "paper.toml"), _set(("grid.cells=[48, 32]",))
    small = (*small, "--snapshot")
    speeds = ("--speed", "0.2", "--speed", "2", "--sq", "0.5 um")
    return {
        "stribeck": run_json("stribeck", case, *speeds, *small),
        "traction": run_json("traction", case, "--slip", "0.05", "--slip", "0.3", *small),
    }


CASES: dict[str, Callable[[], dict[str, Any]]] = {
    "paper": lambda: solved(*SMALL),
    "running": running,
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
        "sound": run_json("vibrate", str(EXAMPLES / "paper.toml")),
        "paper": run_json("vibrate", str(EXAMPLES / "paper-as-printed.toml"), "--preset", "paper"),
        "nonlinear": run_json(
            "vibrate", str(EXAMPLES / "paper.toml"), *_set(("vibration.response=nonlinear",))
        ),
        "table1": run_json("vibrate", "--table1", "--records", "20"),
    },
    "track": tracked,
    "surface": measured,
    "curves": curves,
}


def numbers(name: str) -> dict[str, Any]:
    """Compute the numbers of a case in a temporary folder."""
    with TemporaryDirectory() as folder, chdir(folder):
        return _reproducible(CASES[name]())


def differences(then: Any, now: Any, tolerance: float, where: str = "") -> list[str]:
    """List the differences between two trees, one per line, for numbers with a relative
    `tolerance`.
    """
    if isinstance(then, dict) and isinstance(now, dict):
        missing = [f"{where}.{key} is missing" for key in then.keys() - now.keys()]
        nested = [
            differences(then[key], now[key], tolerance, f"{where}.{key}")
            for key in then
            if key in now
        ]
        return [*missing, *(line for lines in nested for line in lines)]
    if isinstance(then, list) and isinstance(now, list) and len(then) == len(now):
        nested = [
            differences(*pair, tolerance, f"{where}[{n}]")
            for n, pair in enumerate(zip(then, now, strict=True))
        ]
        return [line for lines in nested for line in lines]
    if where.endswith(RESIDUALS) and type(now) is float:
        same = abs(now) < SOLVER_TOLERANCE
    elif where.endswith(".iterations") and type(now) is int:
        same = abs(now - then) <= ITERATIONS * then
    elif type(then) is type(now) is float:
        same = then == now or abs(then - now) <= max(tolerance * max(abs(then), abs(now)), ROUNDING)
    elif isinstance(then, str) and isinstance(now, str) and tolerance > 0.0:
        same = True  # digits in a sentence follow the numbers in other fields
    else:
        same = type(then) is type(now) and then == now
    return [] if same else [f"{where}: {then!r} is now {now!r}"]


def _reproducible(tree: Any) -> Any:
    if isinstance(tree, dict):
        return {key: _reproducible(value) for key, value in tree.items() if key not in TIMES}
    if isinstance(tree, str):
        return re.sub(r"\b\d+(\.\d+)? s\b", "some s", tree)
    return [_reproducible(value) for value in tree] if isinstance(tree, list) else tree


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
