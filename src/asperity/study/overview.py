"""What a study shows: rows that may be used, its curve or axes, contacts to map, tables, and why cases failed."""

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
from asperity.study.curve import SQ_KEY, WearCurve, curve_of, is_wear_study
from asperity.study.evaluate import BOTH_PRESETS, DONE
from asperity.study.execute import StudyResult
from asperity.study.plan import SEED_KEYS, as_written

MOST_MAPS = 8  # the paper's Figs 5 and 6 have eight
MOST_REASONS = 10
MOST_NAMED = 5  # failed cases named for one reason
SHOWS = 5e-4  # a difference between shares that a map's percentages would show


class FailureReason(NamedTuple):
    """Why cases failed, how many, and which."""

    text: str
    number: int
    cases: str


@dataclass(frozen=True)
class StudyOverview:
    """What a study shows; what is missing, failed or did not converge is left out of every mean.

    Parameters
    ----------
    result : with at least one computed case; BadInput otherwise
    stated_anchors : what a study of Sq should meet; None: the paper's printed numbers, if the case is its contact
    progress : called with what is being solved
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
        """The rows that may be used."""
        rows: pandas.DataFrame = self.result.table[self.result.table["status"] == DONE]
        return rows

    @cached_property
    def curve(self) -> WearCurve | None:
        """The wear curve of a study of Sq alone."""
        return curve_of(self.result) if len(self.used) and is_wear_study(self.result) else None

    @property
    def papers(self) -> bool:
        """Whether the paper's printed numbers stand beside the study's."""
        return (
            self.stated_anchors is None
            and self.curve is not None
            and is_papers_contact(self.result.plan.case)
        )

    @cached_property
    def anchors(self) -> tuple[Anchor, ...]:
        """What the curve should meet."""
        if self.stated_anchors is not None:
            return tuple(self.stated_anchors)
        known = (
            {SPLIT_ANCHOR, *self.used}
            if self.curve is not None and self.curve.stages
            else set(self.used)
        )
        return tuple(anchor for anchor in PAPER_ANCHORS if self.papers and anchor.quantity in known)

    @cached_property
    def axes(self) -> list[SweptAxis]:
        """The swept quantities over the rows that may be used; those with one value are none."""
        keys = [key for key in self.result.plan.axes if key not in SEED_KEYS]
        swept = [swept_axis(self.result.plan, self.used, key) for key in keys]
        return [axis for axis in swept if axis.places.size > 1]

    @cached_property
    def outputs(self) -> list[str]:
        """The columns that are shown of the rows."""
        return varying_outputs(self.used)

    def verdict(self) -> str:
        """One sentence: where the study's outputs go."""
        if self.curve is not None:
            return self.curve.verdict()
        failed, total = self.result.failed, len(self.result.table)
        sentence = f"{total} cases over {', '.join(self.result.plan.axes) or 'seeds'}"
        for key in self.outputs:
            if key in ("clr", "crf_sound_hz", "crf_hz"):
                entry = quantity(key)
                values = self.used[key] * entry.factor
                sentence += f"; {entry.symbol} from {values.min():.4g} to {values.max():.4g} {entry.display}"
        return (
            f"{failed} OF {total} CASES FAILED and are left out: {sentence}."
            if failed
            else f"{sentence}."
        )

    # Maps
    # ------------------------------------------------------------------------------------------------------------

    @cached_property
    def mapped(self) -> list[int]:
        """The numbers of the cases whose maps are shown: one surface of a few levels, evenly over Sq."""
        if self.curve is None:
            return []
        wanted = np.linspace(self.curve.sq[0], self.curve.sq[-1], MOST_MAPS)
        levels = {float(self.curve.sq[np.argmin(np.abs(self.curve.sq - sq))]) for sq in wanted}
        firsts = (
            self.used[self.used[SQ_KEY].isin(levels)].groupby(SQ_KEY, sort=True)["number"].first()
        )
        return [int(number) for number in firsts]

    @cached_property
    def runs(self) -> list[Run] | str:
        """The mapped cases, solved anew with the seeds they had; or why they cannot be."""
        runs = []
        for place, number in enumerate(self.mapped, 1):
            if self.progress is not None:
                self.progress(f"map {place} of {len(self.mapped)}")
            try:
                case = self.result.plan.case.with_overrides(
                    self.result.plan.cases[number].overrides
                )
                with threadpool_limits(
                    1
                ):  # as in the study, so that it is the same to the last bit
                    runs.append(solve_case(case, strict=False))
            except AsperityError as refusal:
                return f"No maps of surface and contact: {refusal}."
        return runs

    # What to read before the numbers
    # ---------------------------------------------------------------------------------

    @cached_property
    def notes(self) -> list[str]:
        """Sentences to read before the numbers."""
        notes = list(version_notes(self.result.versions))
        if self.result.missing:
            share = f"{self.result.missing} of {len(self.result.plan.cases)} cases"
            notes.append(f"{share} have not been computed yet: run the study again.")
        if self.result.plan.realisations == 1:
            notes.append(
                "One surface a point: other seeds give other numbers, and there is no interval of them."
            )
        notes += [self.runs] if isinstance(self.runs, str) else self._changed_maps(self.runs)
        columns = {name: f"crf_{name}_hz" for name in BOTH_PRESETS if f"crf_{name}_hz" in self.used}
        silent = {name: self.used[column].isna().sum() for name, column in columns.items()}
        if self.curve is not None and not silent:
            notes.append("The case has no [vibration]: there is no contact resonance to show.")
        if any(silent.values()):
            counts = ", ".join(
                f"{count} with the vibration preset {name}" for name, count in silent.items()
            )
            notes.append(
                f"No contact resonance was found in some of the {len(self.used)} cases ({counts}); means of CRF and "
                "CRFA leave them out."
            )
        return notes

    def _changed_maps(self, runs: Sequence[Run]) -> list[str]:
        """Which maps are not of the contacts in the table."""
        mapped = self.used[self.used["number"].isin(self.mapped)]
        shares, share = (mapped["clr"] if len(mapped) else ()), quantity("clr")
        return [
            f"The contact mapped at Sq {run.state.sq * 1e6:.3g} µm, solved anew, has a CLR of "
            f"{share.text(run.state.clr)} and {share.text(clr)} in the study's table: other versions made that."
            for clr, run in zip(shares, runs, strict=True)
            if abs(run.state.clr - clr) > SHOWS
        ]

    @cached_property
    def reasons(self) -> list[FailureReason]:
        """Why cases failed, the commonest first."""
        reasons = []
        for (status, text), rows in self.result.failures.groupby(["status", "reason"], sort=False):
            points = rows["point"].value_counts(sort=False)
            names = [
                self._point_in_words(int(str(point)), count)
                for point, count in points.head(MOST_NAMED).items()
            ]
            more = (
                f"; and {len(points) - len(names)} more points" if len(points) > len(names) else ""
            )
            reasons.append(FailureReason(f"{status}: {text}", len(rows), "; ".join(names) + more))
        reasons.sort(key=lambda reason: -reason.number)
        rest = reasons[MOST_REASONS:]
        if rest:
            number = sum(reason.number for reason in rest)
            return [
                *reasons[:MOST_REASONS],
                FailureReason(f"{len(rest)} other reasons", number, "in failures.csv"),
            ]
        return reasons

    def _point_in_words(self, point: int, cases: int) -> str:
        """The swept values of a point, and how many of its surfaces are meant where it has several."""
        values = self.result.plan.points[point]
        words = (
            ", ".join(f"{key} {as_written(value)}" for key, value in values.items()) or "its case"
        )
        several = self.result.plan.realisations
        return words if several == 1 else f"{words} ({cases} of {several} surfaces)"

    # Tables
    # ----------------------------------------------------------------------------------------------------------

    @cached_property
    def tables(self) -> dict[str, pandas.DataFrame]:
        """Every table by its file's name, in SI but for columns whose name has another unit."""
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
        """A row a point: how many cases may be used, mean and standard deviation of each output."""
        keys = [key for key in self.result.plan.axes if key in self.used]
        groups = self.used.groupby("point", sort=True)
        table = groups[keys].first() if keys else groups[["status"]].first()[[]]
        table["cases"] = groups.size()
        for column in self.outputs:
            table[column], table[f"{column}_std"] = groups[column].mean(), groups[column].std()
        return table.reset_index()
