"""Overview of a study for reports: valid rows, curve or axes, mapped contacts, tables, failures."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import pandas
from threadpoolctl import threadpool_limits

from asperity.core.errors import AsperityError, BadInput
from asperity.core.quantities import quantity
from asperity.core.storage import version_notes
from asperity.paper import (
    PAPER_ANCHORS,
    SPLIT_ANCHOR,
    Anchor,
    compare_with_anchors,
    is_papers_contact,
    rig_prediction,
)
from asperity.results import Run, solve_case
from asperity.study.axes import SweptAxis, swept_axis, varying_outputs
from asperity.study.curve import SQ_KEY, WearCurve, curve_from_study, is_wear_study
from asperity.study.evaluate import BOTH_PRESETS, DONE, case_at
from asperity.study.plan import SEED_KEYS, as_written
from asperity.study.result import StudyResult

MAX_MAPS = 8  # as in the paper's Figs 5 and 6
MAX_REASONS = 10
MAX_NAMED = 5  # failed points named per reason
VISIBLE_DIFFERENCE = 5e-4  # of CLR, visible in a map's percentages


class FailureReason(NamedTuple):
    """A reason of failure, the number of cases and their points."""

    text: str
    number: int
    cases: str


@dataclass(frozen=True)
class StudyOverview:
    """Contents of a study's report; missing and failed cases are left out of every mean.

    Parameters
    ----------
    result : with at least one computed case; BadInput otherwise
    stated_anchors : anchors for a study of Sq; None: the paper's, if the case is its contact
    progress : called with a label of the contact being solved
    """

    result: StudyResult
    stated_anchors: Sequence[Anchor] | None = None
    progress: Callable[[str], None] | None = None

    def __post_init__(self) -> None:
        if not len(self.result.table):
            planned = len(self.result.plan.cases)
            raise BadInput(
                f"the study has no computed case yet, of {planned}; run it with asperity study"
            )

    @cached_property
    def used(self) -> pandas.DataFrame:
        """The rows of converged cases."""
        rows: pandas.DataFrame = self.result.table[self.result.table["status"] == DONE]
        return rows

    @cached_property
    def curve(self) -> WearCurve | None:
        """The wear curve, if the study varies only Sq."""
        return (
            curve_from_study(self.result) if len(self.used) and is_wear_study(self.result) else None
        )

    @property
    def papers(self) -> bool:
        """True if the study is compared with the paper's published numbers."""
        return (
            self.stated_anchors is None
            and self.curve is not None
            and is_papers_contact(self.result.plan.case)
        )

    @cached_property
    def anchors(self) -> tuple[Anchor, ...]:
        """Anchors to compare the curve with."""
        if self.stated_anchors is not None:
            return tuple(self.stated_anchors)
        names = (
            {SPLIT_ANCHOR, *self.used}
            if self.curve is not None and self.curve.stages
            else set(self.used)
        )
        return tuple(anchor for anchor in PAPER_ANCHORS if self.papers and anchor.quantity in names)

    @cached_property
    def axes(self) -> list[SweptAxis]:
        """The swept quantities with more than one value, over the valid rows."""
        keys = [key for key in self.result.plan.axes if key not in SEED_KEYS]
        swept = [swept_axis(self.result.plan, self.used, key) for key in keys]
        return [axis for axis in swept if axis.distinct.size > 1]

    @cached_property
    def outputs(self) -> list[str]:
        """Keys of the outputs that vary over the converged cases."""
        return varying_outputs(self.used)

    def verdict(self) -> str:
        """Return one sentence on the ranges of the study's outputs."""
        if self.curve is not None:
            return self.curve.verdict()
        failed = self.result.failed
        total = len(self.result.table)
        sentence = f"{total} cases over {', '.join(self.result.plan.axes) or 'seeds'}"
        for key in self.outputs:
            if key in ("clr", "crf_sound_hz", "crf_hz"):
                entry = quantity(key)
                values = self.used[key] * entry.factor
                span = f"{values.min():.4g} to {values.max():.4g} {entry.display}"
                sentence += f"; {entry.symbol} from {span}"
        return (
            f"{failed} OF {total} CASES FAILED and are left out: {sentence}."
            if failed
            else f"{sentence}."
        )

    # Maps
    # ----------------------------------------------------------------------

    @cached_property
    def mapped(self) -> list[int]:
        """Numbers of the cases to map: one surface at a few levels, evenly spaced in Sq."""
        if self.curve is None:
            return []
        spaced = np.linspace(self.curve.sq[0], self.curve.sq[-1], MAX_MAPS)
        levels = {float(self.curve.sq[np.argmin(np.abs(self.curve.sq - sq))]) for sq in spaced}
        firsts = (
            self.used[self.used[SQ_KEY].isin(levels)].groupby(SQ_KEY, sort=True)["number"].first()
        )
        return [int(number) for number in firsts]

    @cached_property
    def runs(self) -> list[Run] | str:
        """The mapped cases, solved again with their seeds; or the reason why they cannot be."""
        runs = []
        for count, number in enumerate(self.mapped, 1):
            if self.progress is not None:
                self.progress(f"map {count} of {len(self.mapped)}")
            try:
                overrides = self.result.plan.cases[number].overrides
                case = case_at(self.result.plan.case, overrides)
                with threadpool_limits(1):  # as in the study, for bit-identical results
                    runs.append(solve_case(case, strict=False))
            except AsperityError as refusal:
                return f"No maps of surface and contact: {refusal}."
        return runs

    # Notes
    # ----------------------------------------------------------------------

    @cached_property
    def notes(self) -> list[str]:
        """Sentences that qualify the numbers."""
        notes = [*version_notes(self.result.versions), *self.result.remarks]
        if self.result.missing:
            share = f"{self.result.missing} of {len(self.result.plan.cases)} cases"
            notes.append(f"{share} have not been computed yet: run the study again.")
        if self.result.plan.realisations == 1:
            notes.append(
                "One surface per point: results vary with the seed; intervals need several seeds."
            )
        notes += [self.runs] if isinstance(self.runs, str) else self._changed_maps(self.runs)
        columns = {name: f"crf_{name}_hz" for name in BOTH_PRESETS if f"crf_{name}_hz" in self.used}
        missing = {name: self.used[column].isna().sum() for name, column in columns.items()}
        if self.curve is not None and not missing:
            notes.append("The case has no [vibration], so there is no contact resonance.")
        if any(missing.values()):
            counts = ", ".join(
                f"{count} with the vibration preset {name}" for name, count in missing.items()
            )
            notes.append(
                f"No contact resonance was found in some of the {len(self.used)} cases ({counts}); "
                "means of CRF and CRFA leave them out."
            )
        return notes

    def _changed_maps(self, runs: Sequence[Run]) -> list[str]:
        """Return a note for each map that differs from the contact in the table."""
        rows = self.used[self.used["number"].isin(self.mapped)]
        shares = rows["clr"] if len(rows) else ()
        share = quantity("clr")
        again = [float(run.scalars()["clr"] or 0.0) for run in runs]
        return [
            f"The contact mapped at Sq {run.state.sq * 1e6:.3g} µm has a CLR of "
            f"{share.text(solved)} when solved again, but {share.text(clr)} in the study's "
            "table, which other versions computed."
            for clr, solved, run in zip(shares, again, runs, strict=True)
            if abs(solved - clr) > VISIBLE_DIFFERENCE
        ]

    @cached_property
    def reasons(self) -> list[FailureReason]:
        """Reasons of failure, the most frequent first."""
        reasons = []
        for (status, text), rows in self.result.failures.groupby(["status", "reason"], sort=False):
            points = rows["point"].value_counts(sort=False)
            names = [
                self._point_in_words(int(str(point)), count)
                for point, count in points.head(MAX_NAMED).items()
            ]
            others = (
                f"; and {len(points) - len(names)} more points" if len(points) > len(names) else ""
            )
            reasons.append(FailureReason(f"{status}: {text}", len(rows), "; ".join(names) + others))
        reasons.sort(key=lambda reason: -reason.number)
        rest = reasons[MAX_REASONS:]
        if rest:
            number = sum(reason.number for reason in rest)
            return [
                *reasons[:MAX_REASONS],
                FailureReason(f"{len(rest)} other reasons", number, "in failures.csv"),
            ]
        return reasons

    def _point_in_words(self, point: int, cases: int) -> str:
        """Return the swept values of a point, and the number of its surfaces if it has several."""
        values = self.result.plan.points[point]
        text = (
            ", ".join(f"{key} {as_written(value)}" for key, value in values.items()) or "its case"
        )
        surfaces = self.result.plan.realisations
        return text if surfaces == 1 else f"{text} ({cases} of {surfaces} surfaces)"

    # Tables
    # ----------------------------------------------------------------------

    @cached_property
    def tables(self) -> dict[str, pandas.DataFrame]:
        """Tables by file name, in SI units except for columns whose name has another unit."""
        tables = {"cases": self.result.table, "failures": self.result.failures}
        if self.curve is None:
            return {**tables, "points": self._points()}
        tables["levels"] = self.curve.summary()
        if self.anchors:
            tables["anchors"] = compare_with_anchors(self.curve, self.anchors)
        if self.papers:
            tables |= {
                f"rig-{preset}": rig_prediction(self.curve, f"crf_{preset}_hz")
                for preset in self.curve.stages
            }
        return tables

    def _points(self) -> pandas.DataFrame:
        """Return one row per point: number of valid cases, mean and deviation of each output."""
        keys = [key for key in self.result.plan.axes if key in self.used]
        groups = self.used.groupby("point", sort=True)
        table = groups[keys].first() if keys else groups[["status"]].first()[[]]
        table["cases"] = groups.size()
        for column in self.outputs:
            table[column], table[f"{column}_std"] = groups[column].mean(), groups[column].std()
        return table.reset_index()
