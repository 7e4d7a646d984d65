"""A study's rows over what was swept: each case's place on an axis, means at each place, outputs that vary.

Swept quantities are in the unit that they were written in.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas

from asperity.case import split_amount
from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.study.curve import student_reach
from asperity.study.plan import StudyPlan, as_written
from asperity.study.ranges import stated_value

MOST_VALUES = 12  # of a swept quantity that has a mean each, however few cases share one
GROUPS = 8  # of one with more
SAME = 1e-9  # relative difference that is rounding
CHOICES = ("law", "kind", "file")  # keys that say what a table is
OUTPUTS = (  # columns of a study's table that are looked at, in the order in which they are shown
    "clr",
    "car",
    "car_domain",
    "h_central_m",
    "p_max_pa",
    "friction_coefficient",
    "flash_temperature_max_k",
    "von_mises_core_pa",
    "crf_sound_hz",
    "crf_paper_hz",
    "crf_hz",
    "contact_damping_ratio",
    "contact_stiffness_n_m",
    "crfa_sound",
    "crfa_paper",
    "crfa",
    "expected_crfa",
    "dynamic_load",
)


@dataclass(frozen=True)
class SweptAxis:
    """A swept quantity over the rows of a table: numbers in `unit`, or the places of names."""

    key: str
    values: Field  # (rows,)
    unit: str = ""  # as the case file writes it
    names: tuple[str, ...] = ()  # of the places, where it is no number
    logarithmic: bool = False

    @property
    def places(self) -> Field:
        """The different values, in order."""
        return np.unique(self.values)

    @property
    def binned(self) -> bool:
        """Whether means are those of groups of neighbours: of samples no two are alike."""
        return self.places.size > max(MOST_VALUES, 0.5 * self.values.size)


def swept_axis(plan: StudyPlan, table: pandas.DataFrame, key: str) -> SweptAxis:
    """A swept key over the rows of a study's table, in the unit that its first value was written in."""
    own = stated_value(plan.case, key)
    own = "not set" if own is None else own
    written = [plan.cases[number].overrides.get(key, own) for number in table["number"]]
    try:
        numbers, unit = _numbers(written)
    except BadInput:
        texts = [as_written(value) for value in written]
        names = {text: _short(value) for text, value in zip(texts, written, strict=True)}
        if len(set(names.values())) < len(names):
            names = {text: text for text in names}
        values = np.array([list(names).index(text) for text in texts], dtype=float)
        return SweptAxis(key, values, names=tuple(names.values()))
    return SweptAxis(key, numbers, unit, logarithmic=_crowds_low(np.unique(numbers)))


def varying_outputs(table: pandas.DataFrame) -> list[str]:
    """Which of `OUTPUTS` a study's table holds and vary in it; CRF and CRFA once where the presets have theirs."""
    by_preset = ("crf_hz", "crfa") if "crf_sound_hz" in table else ()
    there = [key for key in OUTPUTS if key in table and key not in by_preset]
    return [key for key in there if _varies(table[key].to_numpy(dtype=float))]


def group_means(x: Field, values: Field, *, binned: bool) -> tuple[Field, Field, Field, Field]:
    """Means over cases with one x, or over near ones, and Student's interval of each mean: x, mean, low, high."""
    group = np.unique(x, return_inverse=True)[1]
    if binned:
        group = np.searchsorted(
            np.quantile(x, np.linspace(0.0, 1.0, GROUPS + 1)[1:-1]), x, side="right"
        )
    rows = []
    for number in np.unique(group):
        members = values[group == number]
        mean = members.mean()
        reach = student_reach(members.std(ddof=1), members.size) if members.size > 1 else np.nan
        rows.append((x[group == number].mean(), mean, mean - reach, mean + reach))
    places, means, low, high = np.array(rows, dtype=float).reshape(-1, 4).T
    return places, means, low, high


def pair_means(values: Field, across: SweptAxis, up: SweptAxis) -> Field:
    """Means over the cases at each pair of places, shape (places up, places across); nan where there is none."""
    rows, columns = up.places, across.places
    cells = np.full((rows.size, columns.size), np.nan)
    for j, row in enumerate(rows):
        for i, column in enumerate(columns):
            here = values[(across.values == column) & (up.values == row) & np.isfinite(values)]
            if here.size:
                cells[j, i] = here.mean()
    return cells


def _varies(values: Field) -> bool:
    """Whether numbers differ by more than their last digits."""
    known = values[np.isfinite(values)]
    return known.size > 0 and float(np.ptp(known)) > SAME * float(np.abs(known).max())


def _short(value: Any) -> str:
    """A table by what it chooses, a file by its name."""
    if isinstance(value, Mapping):
        value = next((value[key] for key in CHOICES if key in value), value)
    return as_written(value).rpartition("/")[2]


def _numbers(written: Sequence[Any]) -> tuple[Field, str]:
    """Values in the first one's unit; BadInput where one is no number or an uneven pair."""
    pairs = [list(value) if isinstance(value, list | tuple) else [value] for value in written]
    if any(entry != pair[0] for pair in pairs for entry in pair):
        raise BadInput("uneven pairs are no single numbers")
    single = [pair[0] for pair in pairs]
    unit = split_amount(single[0])[1]
    return np.array([float(split_amount(value, unit)[0]) for value in single]), unit


def _crowds_low(places: Field) -> bool:
    """Whether most values stand near the lower end, as on a logarithmic scale."""
    low, high = float(places[0]), float(places[-1])
    return low > 0.0 and high >= 4.0 * low and float(np.median(places)) - low < 0.35 * (high - low)
