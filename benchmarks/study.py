"""Time of studies: the paper's on one and two workers, and the overhead of 10 000 cheap cases."""

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
    """Run the whole study from the command line on two workers and on one."""
    yield (
        f"The paper's study, levels {levels} apart, 5 seeds, 256 x 256, vibration and indicators"
        " included:\n"
    )
    taken = {}
    for workers in (2, 1):
        with tempfile.TemporaryDirectory() as folder:
            sweep = f'study.sq={{from="0.5 um", to="4 um", step="{levels}"}}'
            words = ["--out", folder, "--workers", str(workers), "--quiet", "--set", sweep]
            start = time.perf_counter()
            subprocess.run(
                [sys.executable, "-m", "asperity", "study", str(CASE), *words],
                check=True,
                stdout=subprocess.DEVNULL,
            )
            taken[workers] = time.perf_counter() - start
        yield f"- {workers} worker{'s' if workers > 1 else ''}: {taken[workers]:.1f} s in all"
    yield f"- parallel efficiency {taken[1] / (2.0 * taken[2]):.2f}"


def overhead(cases: int = 10_000) -> Iterator[str]:
    """Measure the overhead of cheap cases and the memory of the parent process."""
    yield f"\n{cases} cases of the vibration model alone, two workers:\n"
    case = load_case(CASE).with_overrides(CHEAP).with_overrides({"study.samples": cases})
    plan = plan_study(case)
    import asperity.study.evaluate as evaluation

    few = plan.cases[:: len(plan.cases) // 200]
    bare = [plan.case.with_overrides(planned.overrides) for planned in few]
    evaluation.evaluate(plan.case, "vibrate", few[0].overrides)
    with threadpool_limits(1):  # as in the workers
        start = time.process_time()
        for case in bare:
            evaluation.EVALUATIONS["vibrate"](case, ())
        work = (time.process_time() - start) / len(few)
    memory_mib: dict[int, float] = {}
    folder = Path(tempfile.mkdtemp())
    start, own, theirs = time.perf_counter(), time.process_time(), _children_s()
    result = run_study(
        plan,
        out=folder,
        workers=2,
        progress=lambda state: memory_mib.update({state.done: _resident_mib()}),
    )
    wall = time.perf_counter() - start
    parent, workers = (time.process_time() - own) / cases, (_children_s() - theirs) / cases
    early, late = (
        min(memory_mib, key=lambda done: abs(done - share * cases)) for share in (0.1, 0.9)
    )
    overhead_ms = 1e3 * (parent + workers - work)
    yield (
        f"- {1e3 * wall / cases:.2f} ms per case; CPU time: parent {1e3 * parent:.2f} ms,"
        f" workers {1e3 * workers:.2f} ms, of which work {1e3 * work:.2f} ms; overhead"
        f" {overhead_ms:.2f} ms per case"
    )
    memory = f"{memory_mib[early]:.0f} MiB after {early} cases, {memory_mib[late]:.0f} after {late}"
    yield f"- memory of the parent: {memory}; {result.failed} cases failed"
    shutil.rmtree(folder)


def _children_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _resident_mib() -> float:
    return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize() / 2**20


def lines(*, fast: bool) -> Iterator[str]:
    """Yield both results as Markdown; `fast` takes fewer cases."""
    yield "## Studies\n"
    yield from papers_study("0.5 um" if fast else "0.1 um")
    yield from overhead(1000 if fast else 10_000)


if __name__ == "__main__":
    for line in lines(fast="--fast" in sys.argv):
        print(line, flush=True)
