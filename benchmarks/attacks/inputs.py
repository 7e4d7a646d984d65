"""Malformed case files and `--set` values."""

import contextlib
import io
import random
import re
from collections.abc import Callable
from pathlib import Path

from asperity.cli import main

CASE = Path(__file__).parents[2] / "examples" / "paper.toml"
FAST = {
    'model = "mixed"': 'model = "mixed"',
    "cells = [256, 256]": "cells = [32, 16]",
    '["20 um", "20 um"]': '["60 um", "60 um"]',
}
VALUES = (
    "0",
    "-1",
    "1e308",
    "1e-308",
    "inf",
    "nan",
    "-inf",
    "1e400",
    '""',
    '" "',
    '"1 m"',
    '"1e309 N"',
    '"-5 N"',
    '"0 Pa"',
    '"1 N m"',
    '"5"',
    "true",
    "[]",
    "[[]]",
    "[1]",
    "[1, 2, 3]",
    "{}",
    "{a=1}",
    '"none"',
    '"auto"',
    "1979-05-27",
    "0x7fff",
    "9" * 400,
    f'"{"x" * 5000}"',
    '"\\u0000"',
    '"\\u001b[31m"',
    "'''\n'''",
    "[8, 8]",
    "[1e9, 8]",
    "[99999999, 99999999]",
    '["1 um", "1 km"]',
    '"1e-30 m"',
    '"1e30 m"',
    '"1 parsec"',
    '"5 µm"',
    '"5 degC"',
    '"10 cSt"',
    '"5 %"',
    '"1/0 m"',
    '"m"',
    '{ law = "barus" }',
    '{ law = "unheard of" }',
    "{ from = 1 }",
    "0.1",
    "1.0",
    "2",
    "-0.0",
    '"gaussian"',
    '"flat"',
    '"line"',
    '"point"',
    '"elliptic"',
    '"unified"',
    '"conserving"',
    '"paper"',
    '["1 m"]',
    '"9**9**9 m"',
    "\"__import__('os') m\"",
)
KEYS = (
    "model",
    "contact",
    "contact.geometry",
    "contact.radius",
    "contact.length",
    "contact.load",
    "contact.entrainment_speed",
    "contact.slip",
    "material.youngs_modulus",
    "material.poisson_ratio",
    "material.hardness",
    "material.boundary_friction",
    "lubricant",
    "lubricant.viscosity",
    "lubricant.viscosity.eta0",
    "lubricant.viscosity.alpha",
    "lubricant.density",
    "lubricant.rheology",
    "surface",
    "surface.kind",
    "surface.sq",
    "surface.correlation_length",
    "surface.seed",
    "surface.file",
    "grid.cells",
    "grid.x",
    "grid.y",
    "grid.accuracy",
    "solver.tolerance",
    "solver.max_iterations",
    "solver.contact_film",
    "solver.surfaces",
    "thermal",
    "thermal.feedback",
    "vibration",
    "vibration.mass",
    "vibration.rate",
    "vibration.duration",
    "vibration.damping_ratio",
    "vibration.preset",
    "motion",
    "motion.steps",
    "motion.track",
    "study.sq",
    "study.seeds",
    "study.samples",
    "nothing",
    "contact.nothing",
    "a.b.c.d",
    "..",
    "contact.",
    "\x1b[2J",
    "é",
)
_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")


def small_text(iterations: int = 5) -> str:
    """Return the paper's case on a coarse grid that solves quickly."""
    text = CASE.read_text("utf-8")
    for old, new in FAST.items():
        text = text.replace(old, new)
    return text.replace("[solver]", f"[solver]\nsurfaces = 1\nmax_iterations = {iterations}").split(
        "[vibration]"
    )[0]


def run_command(*arguments: str) -> str | None:
    """Run a command in this process and return its fault, or None."""
    out, errors = io.StringIO(), io.StringIO()
    code: object = 0
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(errors):
        try:
            main(arguments)
        except SystemExit as end:
            code = end.code or 0
    text = errors.getvalue()
    if code not in (0, 1, 2, 3, 4, 5):
        return f"ends with {code}"
    if _CONTROL.search(text) or _CONTROL.search(out.getvalue()):
        return "control characters on the terminal"
    if code in (1, 2) and (
        len(text) > 500 or text.count("\n") != 1 or not text.startswith("error: ")
    ):
        return f"refusal of {len(text)} characters, {text.count(chr(10))} lines: {text[:80]!r}"
    return None


def mutated(text: str, rng: random.Random) -> str:
    """Return a case file with one to three random changes."""
    lines = text.splitlines()
    for _ in range(rng.randint(1, 3)):
        at = rng.randrange(len(lines))
        kind = rng.randrange(7)
        if kind == 0:
            del lines[at]
        elif kind == 1:
            lines.insert(rng.randrange(len(lines)), lines[at])
        elif kind == 2 and "=" in lines[at]:
            lines[at] = f"{lines[at].split('=')[0]}= {rng.choice(VALUES)}"
        elif kind == 3 and lines[at]:
            place = rng.randrange(len(lines[at]))
            lines[at] = (
                lines[at][:place]
                + chr(rng.choice((0, 7, 27, 34, 91, 93, 125, 233, 0x202E, 0x1F600)))
                + lines[at][place:]
            )
        elif kind == 4:
            lines[at] = lines[at].replace("1", rng.choice(("9" * 30, "-1", "1e99", "0", ".")))
        elif kind == 5:
            lines[at] = re.sub(
                r'"(\S+) (\S+)"',
                lambda m: f'"{m[1]} {rng.choice(("kg", "N", "Hz", "µm", "%", "K", "°C"))}"',
                lines[at],
            )
        else:
            lines[at] = lines[at][::-1]
    return "\n".join(lines) + "\n"


def cases(folder: Path) -> Callable[[int], str | None]:
    """Return a function that solves a malformed case file, chosen by number."""
    text = small_text()

    def attack(number: int) -> str | None:
        (folder / "case.toml").write_text(
            mutated(text, random.Random(number)), "utf-8", errors="replace"
        )
        return run_command("solve", str(folder / "case.toml"), "-q")

    return attack


def settings(folder: Path) -> Callable[[int], str | None]:
    """Return a function that passes a value on the command line, chosen by number."""
    (folder / "case.toml").write_text(small_text(), "utf-8")

    def attack(number: int) -> str | None:
        rng = random.Random(number)
        key, value = rng.choice(KEYS), rng.choice(VALUES)
        commands = (
            ("solve",),
            ("solve",),
            ("run", "--steps", "1"),
            ("study", "--dry-run"),
            ("vibrate",),
        )
        command, *more = rng.choice(commands)
        return run_command(
            command, str(folder / "case.toml"), "-q", *more, "--set", f"{key}={value}"
        )

    return attack
