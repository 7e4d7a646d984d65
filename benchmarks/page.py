"""Response times and memory of the live page in headless Chromium.

Measured are the time from a changed setting to new maps, the first content, three users at once and
a large file. Needs the extra `page`, Playwright and Debian's chromium. Times are by the clock, so
the machine's load is reported. CPU time of a change is split into server, solver and browser.
"""

import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

STEPS, USERS, SESSIONS, MEMORY_RELEASE_S = 40, 3, 200, 40.0
RECORDING = 37_500_000  # samples of eight bytes: 300 MB
TURN = """([key, text]) => new Promise(done => {
  const models = Bokeh.documents.flatMap(d => [...d._all_models.values()])
  const film = models.find(
    m => m.type === 'ColumnDataSource' && m.data.image?.[0]?.dtype === 'float32')
  const status = models.find(m => m.type === 'Div' && /Solved on/.test(m.text))
  const knob = models.find(m => m.type === 'TextInput' && m.title === key)
  const before = film.data, began = performance.now()
  let first = null, left = false
  knob.value = text
  const look = () => {
    const now = performance.now() - began
    if (first === null && film.data !== before) first = now
    if (!/Solved on/.test(status.text)) left = true
    const ended = left && /Solved on|NOT CONVERGED|Not solved/.test(status.text)
    if (ended || now > 60000) done([first ?? now, now])
    else setTimeout(look, 4)
  }
  look()
})"""


@contextmanager
def _server(folder: Path) -> Iterator[tuple[str, int]]:
    """Run the page's server; yields the address that it prints, and its process number."""
    process = subprocess.Popen(
        [sys.executable, "-m", "asperity", "page", "--port", "0"],
        stdout=subprocess.PIPE,
        text=True,
        cwd=folder,
    )
    try:
        assert process.stdout is not None
        found = re.search(r"http://\S+", process.stdout.readline())
        assert found is not None
        yield found[0], process.pid
    finally:
        process.send_signal(2)
        process.wait(60)


def _address(printed: str, page: str, query: str = "") -> str:
    """Return the address of a page with the token."""
    return f"{printed.replace('?', f'{page}?')}{query}"


def _knob(rng: random.Random) -> tuple[str, str]:
    """Draw a setting and a value for it."""
    return rng.choice(
        [
            ("Normal load, F", f"{rng.uniform(300, 900):.0f} N"),
            ("Entrainment speed, u", f"{rng.uniform(1, 4):.3g} m/s"),
            ("Composite roughness, Sq", f"{rng.uniform(0.5, 2):.3g} um"),
            ("Dynamic viscosity, η₀", f"{rng.uniform(0.05, 0.2):.3g} Pa s"),
        ]
    )


def _solved(page: Any) -> None:
    page.get_by_text(re.compile("Solved on")).wait_for(timeout=120_000)


def _row(name: str, seconds: list[float]) -> str:
    half, most, worst = (float(np.quantile(seconds, share)) for share in (0.5, 0.95, 1.0))
    return f"| {name} | {half:.2f} | {most:.2f} | {worst:.2f} |"


def _steps(page: Any, count: int, seed: int) -> tuple[list[float], list[float]]:
    rng = random.Random(seed)
    pairs = [page.evaluate(TURN, list(_knob(rng))) for _ in range(count)]
    return [first / 1e3 for first, _ in pairs], [whole / 1e3 for _, whole in pairs]


def _resident(process: int) -> float:
    """Return the memory of a process [MB]."""
    status = Path(f"/proc/{process}/status").read_text("ascii")
    return int(re.search(r"VmRSS:\s+(\d+)", status)[1]) / 1024.0  # type: ignore[index]


def _spent(process: int) -> dict[str, float]:
    """Return the CPU time so far [s] of the page's server, its solvers and the browser."""
    server, ours = _descendants(process), _descendants(os.getpid())
    return {
        "the server": _seconds([process]),
        "solving": _seconds(server - {process}),
        "the browser": _seconds(ours - server - {os.getpid()}),
    }


def _descendants(process: int) -> set[int]:
    """Return a process and all its descendants."""
    found, new = {process}, [process]
    while new:
        number = new.pop()
        for task in Path(f"/proc/{number}/task").glob("*/children"):
            with suppress(OSError):
                children = {int(text) for text in task.read_text("ascii").split()} - found
                found |= children
                new += children
    return found


def _seconds(processes: Iterable[int]) -> float:
    """Return the CPU time of processes so far [s]; ended processes count as 0."""
    ticks = 0
    for number in processes:
        with suppress(OSError):
            fields = Path(f"/proc/{number}/stat").read_text("ascii").rpartition(")")[2].split()
            ticks += int(fields[11]) + int(fields[12])
    return ticks / os.sysconf("SC_CLK_TCK")


def _memory(browser: Any, url: str, process: int, count: int) -> tuple[float, float]:
    """Return the server's memory [MB] before and after visits, each until the maps appear."""

    def visits(number: int) -> None:
        for _ in range(number):
            page = browser.new_page()
            page.goto(_address(url, "contact"))
            page.locator(".block.film .bk-Figure").wait_for(timeout=120_000)
            page.close()

    visits(20)  # loads everything that stays in memory
    time.sleep(MEMORY_RELEASE_S)
    before = _resident(process)
    visits(count)
    time.sleep(MEMORY_RELEASE_S)
    return before, _resident(process)


def lines(*, fast: bool) -> Iterator[str]:
    """Measure the page and yield the tables as Markdown."""
    from playwright.sync_api import sync_playwright

    steps, parts = 10 if fast else STEPS, dict[int, dict[str, float]]()
    path = shutil.which("chromium")
    if path is None:
        raise SystemExit("the live page is measured in chromium; apt-get install chromium")
    yield "## The live page\n"
    with tempfile.TemporaryDirectory() as folder, _server(Path(folder)) as (url, process):
        with sync_playwright() as driver:
            browser = driver.chromium.launch(executable_path=path, args=["--no-sandbox"])
            page = browser.new_page()
            page.goto(_address(url, "contact"))
            _solved(page)
            yield "| wall-clock time [s] | median | 95 % | longest |"
            yield "|---|---|---|---|"
            contents, wholes = [], []
            for _ in range(3 if fast else 8):
                began = time.perf_counter()
                visit = browser.new_page()
                visit.goto(_address(url, "contact"))
                visit.get_by_role("textbox", name="Load, F").wait_for()
                contents.append(time.perf_counter() - began)
                _solved(visit)
                wholes.append(time.perf_counter() - began)
                visit.close()
            yield _row("first content: settings and progress", contents)
            yield _row("first contact: solved, all figures drawn", wholes)
            for cells in (128, 256):
                page.goto(_address(url, "contact", f"&grid.cells={cells}+x+{cells}"))
                _solved(page)
                before = _spent(process)
                first, whole = _steps(page, steps, cells)
                parts[cells] = {
                    name: (spent - before[name]) / steps for name, spent in _spent(process).items()
                }
                yield _row(f"changed setting to new maps, {cells} x {cells}, coarse", first)
                yield _row(f"changed setting to full solution, {cells} x {cells}", whole)
            yield _row(
                f"changed setting to full solution, 128 x 128, {USERS} users at once",
                _crowd(browser, url, steps // 4),
            )
            size = RECORDING // (10 if fast else 1)
            name = f"recording of {size * 8 / 1e6:.0f} MB uploaded to verdict"
            yield _row(name, [_drop(browser, url, Path(folder), size)])
            before, after = _memory(browser, url, process, 20 if fast else SESSIONS)
            browser.close()
        yield ""
        yield "| CPU time per changed setting [s] | 128 x 128 | 256 x 256 |"
        yield "|---|---|---|"
        for name in parts[128]:
            yield f"| {name} | {parts[128][name]:.2f} | {parts[256][name]:.2f} |"
        yield ""
        yield (
            f"After {20 if fast else SESSIONS} visits the server grew from {before:.0f} to"
            f" {after:.0f} MB. Machine load ({os.cpu_count()} processors) at the end:"
            f" {os.getloadavg()[1]:.1f}."
        )


def _crowd(browser: Any, url: str, count: int) -> list[float]:
    """Return the seconds of every step with several users at once."""
    pages = [browser.new_context().new_page() for _ in range(USERS)]
    for page in pages:
        page.goto(_address(url, "contact"))
        _solved(page)
    rng, seconds = random.Random(3), []
    for _ in range(count):
        for page in pages:
            page.evaluate(f"pair => {{ window.turned = ({TURN})(pair) }}", list(_knob(rng)))
        seconds += [page.evaluate("() => window.turned")[1] / 1e3 for page in pages]
    for page in pages:
        page.context.close()
    return seconds


def _drop(browser: Any, url: str, folder: Path, size: int) -> float:
    """Return the seconds from the upload of a large recording to its verdict."""
    np.save(folder / "long.npy", np.random.default_rng(0).standard_normal(size))
    page = browser.new_page()
    page.goto(_address(url, "recordings"))
    for name, text in (("Sampling rate", "50 kHz"), ("Unit of the values", "m/s^2")):
        box = page.get_by_role("textbox", name=re.compile(f"^{name}"))
        box.fill(text)
        box.press("Enter")
    began = time.perf_counter()
    page.locator("input[type=file]").set_input_files(folder / "long.npy")
    page.get_by_text("1 recordings read").wait_for(timeout=300_000)
    page.close()
    return time.perf_counter() - began
