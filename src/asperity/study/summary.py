"""Verdict and JSON output of a study and of its cost estimate."""

from asperity.study.cost import StudyCost
from asperity.study.curve import WearCurve, curve_from_study, is_wear_study
from asperity.study.plan import StudyPlan
from asperity.study.result import StudyResult


def study_verdict(result: StudyResult) -> str:
    """Return the number of cases and failures, and the verdict of a finished wear curve."""
    total = f" of {len(result.plan.cases)}" if result.missing else ""
    sentence = f"{len(result.table)}{total} cases, {result.failed or 'none'} failed"
    if result.computed:
        sentence += f"; {result.computed} computed in {duration_text(result.seconds)}"
    curve = None if result.missing else finished_curve(result)
    if curve is not None:
        sentence += f". {curve.verdict()}"
    if result.remarks:
        sentence = f"{sentence.rstrip('.')}. {'. '.join(result.remarks)}"
    return f"{sentence.rstrip('.')}."


def study_scalars(result: StudyResult) -> dict[str, object]:
    """Return the JSON output of `asperity study`."""
    scalars: dict[str, object] = {
        "verdict": study_verdict(result),
        "cases": len(result.table),
        "planned": len(result.plan.cases),
        "computed": result.computed,
        "failed": result.failed,
        "seconds": result.seconds,
        "table": None if result.path is None else str(result.path),
        "axes": list(result.plan.axes),
        "seeds": result.plan.realisations,
    }
    curve = None if result.missing else finished_curve(result)
    if curve is not None:
        scalars["stages"] = {
            name: {
                "kind": stages.kind,
                "split_um": stages.split if stages.found else None,
                "interval_um": list(stages.interval) if stages.found else None,
                "verdict": stages.verdict,
            }
            for name, stages in curve.stages.items()
        }
    return scalars


def finished_curve(result: StudyResult) -> WearCurve | None:
    """Return the wear curve of a study of Sq with at least one successful case, else None."""
    return (
        curve_from_study(result)
        if is_wear_study(result) and len(result.table) > result.failed
        else None
    )


def estimate_verdict(cost: StudyCost) -> str:
    """Return the number of cases and the estimated time."""
    workers = "worker" if cost.workers == 1 else "workers"
    time = duration_text(cost.seconds)
    finished = f"{cost.cases} cases, {cost.kept} of them already computed"
    return f"{finished}: about {time} on {cost.workers} {workers}."


def estimate_scalars(plan: StudyPlan, cost: StudyCost) -> dict[str, object]:
    """Return the JSON output of `asperity study --dry-run`."""
    return {
        "verdict": estimate_verdict(cost),
        "cases": cost.cases,
        "kept": cost.kept,
        "points": len(plan.points),
        "seeds": plan.realisations,
        "seconds_a_case": cost.case_s,
        "seconds": cost.seconds,
        "workers": cost.workers,
    }


def duration_text(seconds: float) -> str:
    """Return a duration with two or three digits: 4.2 s, 37 s, 12 min, 3.1 h."""
    if seconds < 100:
        return f"{seconds:.0f} s" if seconds >= 10 else f"{seconds:.1f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
