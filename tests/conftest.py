"""Put this folder on the import path for `support`; mark the slow files, which run first and which
`make quick` skips.
"""

import os
import sys
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path

import pytest

# Every core runs a test already; several threads of BLAS per process would wait for one another
# and take three times the processor time. Read when numpy is loaded, here and in child processes.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.pop("COLUMNS", None)  # of the parallel runner's terminal; output would wrap to it
os.unsetenv("COLUMNS")  # GNU readline, which pytest imports, sets it beside `os.environ`

HERE = Path(__file__).parent
SLOW = set((HERE / "slow.txt").read_text("utf-8").split())  # files of more than about 10 s
SOLVERS = (  # modules that start workers where several cores are idle
    *("machines.solve", "results.running", "results.solve", "simulation.cycle.run"),
    *("simulation.wear.contact", "cli.simulated.wear", "study.execute"),
)


@pytest.fixture(autouse=True)
def _without_log_lines(monkeypatch):
    """Print no lines of progress in this process; their times depend on the load of the machine."""
    if (output := sys.modules.get("asperity.cli.output")) is not None:
        monkeypatch.setattr(output, "FIRST_LINE_S", 1e6)


@pytest.fixture
def in_this_process(monkeypatch):
    """Solve contacts in this process, as with one core; starting a worker takes seconds.

    For tests of what is solved; those of workers start them.
    """
    monkeypatch.setattr("asperity.core.processes.cores", lambda: 1)
    for module in SOLVERS:
        monkeypatch.setattr(f"asperity.{module}.cores", lambda: 1)
    monkeypatch.setattr("asperity.study.execute._pool", lambda _: ThreadPoolExecutor(1))


@pytest.fixture
def short_tracks(monkeypatch):
    """Solve running roughness on 400 cells and over 4 passages of the Hertz zone, not 6.

    In this process; for tests of what is done with running contacts, not of their numbers.
    """
    for module in ("results.running", "transient.running"):
        monkeypatch.setattr(f"asperity.{module}.PASSAGES", 4)
    for name in ("MOST_RUNNING_CELLS", "MANY_RUNNING_CELLS"):
        monkeypatch.setattr(f"asperity.case.case.{name}", 400)


@pytest.fixture
def thinnest_film_only(monkeypatch):
    """Solve only the contact of a machine with the thinnest film; the others get its numbers."""
    solve, formulas = map(import_module, ("asperity.machines.solve", "asperity.ehl.film_formulas"))
    plan_all = solve._plan

    def plan(case, contacts):
        cases = [case.case(contact) for contact in contacts]
        films = [formulas.least_film(other.conditions, other.lubricant) for other in cases]
        plan, _ = plan_all(case, [contacts[films.index(min(films))]])
        return plan, dict.fromkeys((contact.name for contact in contacts), 0)

    monkeypatch.setattr(solve, "_plan", plan)


@pytest.fixture
def coarse_search(monkeypatch):
    """Search for lines on half as many blocks, in a quarter of the time.

    For tests of what is done with resonances; their fit starts from the search.
    """
    monkeypatch.setattr("asperity.resonance.template_search.COARSE_BLOCKS", 80)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark tests of slow files, and run these files first, so that processes end together."""
    for item in items:
        if item.path.relative_to(HERE).as_posix() in SLOW:
            item.add_marker(pytest.mark.slow)
    items.sort(key=lambda item: item.get_closest_marker("slow") is None)
