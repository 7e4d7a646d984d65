"""Names with markup, formulas or control codes, which must appear as text everywhere."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np

from benchmarks.attacks.inputs import run_command, small_text

NAMES = (
    "<script>alert(1)</script>",
    "<img src=x onerror=alert(1)>",
    '"><svg onload=alert(1)>',
    "';alert(1)//",
    "{{1237*8081}}",
    "{% raw %}",
    "=1+1",
    "+1+1",
    "-1+1",
    "@SUM(1)",
    "=HYPERLINK('x')",
    "\x1b[31mred",
    "\x1b]0;title\x07",
    "\x9b2J",
    "a\u202eb",
    "${HOME}",
    "$(id)",
    "`id`",
    "; id",
    "| id",
    "&amp;lt;b&gt;",
    "%s%s%n",
    "%00",
    "..%2f..",
    "[bold]x[/bold]",
    "javascript:alert(1)",
    "</style><b>",
    "]]>",
    "<!--",
    "\r\nSet-Cookie: a",
)


def injections(folder: Path) -> Callable[[int], str | None]:
    """Return a function that uses a hostile name, by number, for channel, unit, file and case."""
    values = np.random.default_rng(1).standard_normal((3000, 2))

    def attack(number: int) -> str | None:
        name = NAMES[number % len(NAMES)]
        place = folder / str(number)
        place.mkdir()
        file = re.sub(r"[/\x00]", "_", name)[:60] + ".csv"
        for copy in range(2):
            rows = "\n".join(f"{a:.6f},{b:.6f}" for a, b in values)
            quoted = name.replace('"', '""').replace("\r", "").replace("\n", "")
            (place / f"{copy}{file}").write_text(
                f'"{quoted} ({quoted})",b\n{rows}\n', "utf-8", errors="replace"
            )
        fault = run_command("check", str(place), "--rate", "20000")
        page, table = place / "page.html", place / "track.csv"
        about = ("--rate", "20000", "--channel", "1", "--band", "1000", "5000", "--method", "peak")
        fault = fault or run_command(
            "track", str(place), *about, "--report", str(page), "--out", str(table)
        )
        case = place / (re.sub(r"[/\x00]", "_", name)[:60] + ".toml")
        case.write_text(small_text(), "utf-8")
        fault = fault or run_command("solve", str(case), "-q", "--out", str(place / "run.nc"))
        fault = fault or run_command(
            "report", str(place / "run.nc"), "--out", str(place / "run.html")
        )
        return fault or _in_page(page) or _in_page(place / "run.html") or _in_table(table)

    return attack


def _in_page(page: Path) -> str | None:
    if not page.exists():
        return None
    text = page.read_text("utf-8")
    bad = re.search(r"<script>alert|<img src=x|<svg onload|</style><b>|9996197", text)
    return f"{page.name} holds {bad[0]!r}" if bad else None


def _in_table(table: Path) -> str | None:
    if not table.exists():
        return None
    formula = re.search(r'(?:^|,)"?[=+@][^,]*', table.read_text("utf-8"), re.M)
    return f"{table.name} holds {formula[0]!r}" if formula else None
