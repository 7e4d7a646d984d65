"""Studies: the paper's own on one and two workers, and what ten thousand cheap cases cost beside
their own work.
"""

import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from threadpoolctl import threadpool_limits

from asperity.case import load_case
from asperity.study import plan_study, run_study

CASE = Path(__file__).parents[1] / "examples" / "paper.toml"
CHEAP = {  # the vibration model alone, on a record of 5000 samples
    "grid.cells": [32, 32],
    "surface.correlation_length": "30 um",
    "vibration.duration": "0.05 s",
    "study": {
        "kind": "vibrate",
        "contact.load": {"from": "100 N", "to": "500 N"},
        "sq": {"from": "0.5 um", "to": "4 um"},
        "samples": 10_000,
    },
}


def papers_study(levels: str = "0.1 um") -> Iterator[str]:
    """All of it from the command line, on two workers and on one."""
    yield (
        f"The paper's study, {levels} from level to level, 5 seeds, 256 x 256, vibration and"
        " indicators included:\n"
    )
    taken = {}
    for workers in (2, 1):
        with tempfile.TemporaryDirectory() as folder:
            sweep = f'study.sq={{from="0.5 um", to="4 um", step="{levels}"}}'
            words = ["--out", folder, "--workers", str(workers), "--quiet", "--set", sweep]
            begun = time.perf_counter()
            subprocess.run(
                [sys.executable, "-m", "asperity", "study", str(CASE), *words],
                check=True,
                stdout=subprocess.DEVNULL,
            )
            taken[workers] = time.perf_counter() - begun
        yield (
            f"- {workers} worker{'s' if workers > 1 else ''}: {taken[workers]:.1f} s from the"
            " prompt"
        )
    yield f"- parallel efficiency {taken[1] / (2.0 * taken[2]):.2f}"


def overhead(cases: int = 10_000) -> Iterator[str]:
    """Ten thousand cheap cases: time beside the work itself, memory of the parent."""
    yield f"\n{cases} cases of the vibration model alone, two workers:\n"
    case = load_case(CASE).with_overrides(CHEAP).with_overrides({"study.samples": cases})
    plan = plan_study(case)
    import asperity.study.evaluate as evaluation

    few = plan.cases[:: len(plan.cases) // 200]
    bare = [plan.case.with_overrides(one.overrides) for one in few]
    evaluation.evaluate(plan.case, "vibrate", few[0].overrides)
    with threadpool_limits(1):  # as in the workers
        begun = time.process_time()
        for one in bare:
            evaluation.EVALUATIONS["vibrate"](one, ())
        work = (time.process_time() - begun) / len(few)
    held: dict[int, float] = {}
    folder = Path(tempfile.mkdtemp())
    begun, own, theirs = time.perf_counter(), time.process_time(), _children_s()
    result = run_study(
        plan, out=folder, workers=2, progress=lambda how: held.update({how.done: _resident_mib()})
    )
    wall = time.perf_counter() - begun
    parent, workers = (time.process_time() - own) / cases, (_children_s() - theirs) / cases
    early, late = (min(held, key=lambda done: abs(done - share * cases)) for share in (0.1, 0.9))
    beside = 1e3 * (parent + workers - work)
    yield (
        f"- {1e3 * wall / cases:.2f} ms a case; processor time: parent {1e3 * parent:.2f} ms,"
        f" workers {1e3 * workers:.2f} ms, of it work {1e3 * work:.2f} ms; overhead {beside:.2f} ms"
        " a case"
    )
    memory = f"{held[early]:.0f} MiB after {early} cases, {held[late]:.0f} after {late}"
    yield f"- the parent holds {memory}; {result.failed} cases failed"
    shutil.rmtree(folder)


def _children_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _resident_mib() -> float:
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / 2**20


def lines(*, fast: bool) -> Iterator[str]:
    """Both, shortened if asked."""
    yield "## Studies\n"
    yield from papers_study("0.5 um" if fast else "0.1 um")
    yield from overhead(1000 if fast else 10_000)


if __name__ == "__main__":
    for line in lines(fast="--fast" in sys.argv):
        print(line, flush=True)
