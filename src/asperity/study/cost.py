"""Cost of a study, estimated from a few of its cases."""

from dataclasses import dataclass
from pathlib import Path

from asperity.core.processes import cores
from asperity.core.storage import MANIFEST
from asperity.study.evaluate import timed_batch
from asperity.study.execute import shard_cases
from asperity.study.plan import StudyPlan
from asperity.study.store import read_study_folder

PROCESS_S = 2.0  # time until a worker process has started and loaded its libraries


@dataclass(frozen=True)
class StudyCost:
    """Estimated cost of a study, from a few cases computed and discarded."""

    cases: int  # in this shard
    kept: int
    case_s: float  # time per case on one worker, mean of those tried
    tried: int
    workers: int
    start_s: float = 0.0  # time until a worker has loaded and compiled

    @property
    def seconds(self) -> float:
        """Remaining wall-clock time; workers start in parallel, one per processor."""
        remaining = self.cases - self.kept
        parallel = max(1, min(self.workers, cores(), remaining))
        return remaining * self.case_s / parallel + (self.start_s if remaining else 0.0)


def estimate_study(
    plan: StudyPlan,
    *,
    out: str | Path | None = None,
    workers: int | None = None,
    shard: tuple[int, int] = (1, 1),
) -> StudyCost:
    """Estimate the cost of a study from its first, middle and last case; nothing is stored.

    Raises
    ------
    BadInput
        for a folder that holds another study.
    """
    finished = (
        read_study_folder(Path(out), plan).finished()
        if out is not None and (Path(out) / MANIFEST).exists()
        else {}
    )
    share = shard_cases(plan, shard)
    if not share:
        return StudyCost(0, 0, 0.0, 0, workers or cores())
    chosen = [share[round(part * (len(share) - 1))].overrides for part in (0.0, 0.5, 1.0)]
    _, first = timed_batch(plan.case, plan.kind, [chosen[1]])  # loads and compiles
    _, seconds = timed_batch(plan.case, plan.kind, chosen)
    kept = sum(case.id in finished for case in share)
    case_s = seconds / len(chosen)
    start_s = PROCESS_S + max(0.0, first - case_s)
    return StudyCost(len(share), kept, case_s, len(chosen), workers or cores(), start_s)
