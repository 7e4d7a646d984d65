"""Swept axes of a study's table: values of each case, means at each value, varying outputs.

Swept quantities keep the unit of the case file.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas

from asperity.case import split_amount
from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.study.curve import interval_in_range, student_half_width
from asperity.study.plan import StudyPlan, as_written
from asperity.study.ranges import stated_value

MAX_VALUES = 12  # up to this many values of a swept quantity, each has a mean of its own
GROUPS = 8  # groups of a quantity with more values
ROUNDING = 1e-9  # relative difference attributed to rounding
CHOICES = ("law", "kind", "file")  # keys that name the choice made in a table
OUTPUTS = (  # columns of a study's table to show, in display order
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
    """A swept quantity over the rows of a table: numbers in `unit`, or indices into `names`."""

    key: str
    values: Field  # (rows,)
    unit: str = ""  # as in the case file
    names: tuple[str, ...] = ()  # of the values, where these are not numbers
    logarithmic: bool = False

    @property
    def distinct(self) -> Field:
        """The distinct values, in order."""
        return np.unique(self.values)

    @property
    def binned(self) -> bool:
        """True if means are taken over groups of neighbouring values, as for random samples."""
        return self.distinct.size > max(MAX_VALUES, 0.5 * self.values.size)


def swept_axis(plan: StudyPlan, table: pandas.DataFrame, key: str) -> SweptAxis:
    """Return a swept key over the rows of a study's table, in the unit of its first value."""
    case_value = stated_value(plan.case, key)
    case_value = "not set" if case_value is None else case_value
    written = [plan.cases[number].overrides.get(key, case_value) for number in table["number"]]
    try:
        numbers, unit = _numbers(written)
    except BadInput:
        texts = [as_written(value) for value in written]
        names = {text: _short(value) for text, value in zip(texts, written, strict=True)}
        if len(set(names.values())) < len(names):
            names = {text: text for text in names}
        values = np.array([list(names).index(text) for text in texts], dtype=float)
        return SweptAxis(key, values, names=tuple(names.values()))
    return SweptAxis(key, numbers, unit, logarithmic=_logarithmic(np.unique(numbers)))


def varying_outputs(table: pandas.DataFrame) -> list[str]:
    """Return the keys of `OUTPUTS` that vary in a study's table; CRF and CRFA by preset if any."""
    by_preset = ("crf_hz", "crfa") if "crf_sound_hz" in table else ()
    present = [key for key in OUTPUTS if key in table and key not in by_preset]
    return [key for key in present if _varies(table[key].to_numpy(dtype=float))]


def group_means(
    key: str, x: Field, values: Field, *, binned: bool
) -> tuple[Field, Field, Field, Field]:
    """Return x, mean and Student's interval (low, high) over cases of equal or neighbouring x.

    `values` are of the quantity `key`, in SI; the interval is clipped to its physical range.
    """
    group = np.unique(x, return_inverse=True)[1]
    if binned:
        group = np.searchsorted(
            np.quantile(x, np.linspace(0.0, 1.0, GROUPS + 1)[1:-1]), x, side="right"
        )
    rows = []
    for number in np.unique(group):
        members = values[group == number]
        mean = members.mean()
        half = student_half_width(members.std(ddof=1), members.size) if members.size > 1 else np.nan
        low, high = interval_in_range(key, np.array([mean]), np.array([half]))[0]
        rows.append((x[group == number].mean(), mean, low, high))
    centres, means, lower, upper = np.array(rows, dtype=float).reshape(-1, 4).T
    return centres, means, lower, upper


def pair_means(values: Field, across: SweptAxis, up: SweptAxis) -> Field:
    """Return means over the cases at each pair of values, shape (up, across); nan without cases."""
    rows, columns = up.distinct, across.distinct
    cells = np.full((rows.size, columns.size), np.nan)
    for j, row in enumerate(rows):
        for i, column in enumerate(columns):
            members = values[(across.values == column) & (up.values == row) & np.isfinite(values)]
            if members.size:
                cells[j, i] = members.mean()
    return cells


def _varies(values: Field) -> bool:
    """Return True if numbers differ by more than rounding."""
    finite = values[np.isfinite(values)]
    return finite.size > 0 and float(np.ptp(finite)) > ROUNDING * float(np.abs(finite).max())


def _short(value: object) -> str:
    """Return a short label: the choice of a table, the name of a file."""
    if isinstance(value, Mapping):
        value = next((value[key] for key in CHOICES if key in value), value)
    return as_written(value).rpartition("/")[2]


def _numbers(written: Sequence[object]) -> tuple[Field, str]:
    """Return values in the unit of the first; BadInput for a non-number or an uneven pair."""
    pairs = [list(value) if isinstance(value, list | tuple) else [value] for value in written]
    if any(entry != pair[0] for pair in pairs for entry in pair):
        raise BadInput("a pair of different values is not a single number")
    single = [pair[0] for pair in pairs]
    unit = split_amount(single[0])[1]
    return np.array([float(split_amount(value, unit)[0]) for value in single]), unit


def _logarithmic(values: Field) -> bool:
    """Return True if most values lie at the lower end, as on a logarithmic scale."""
    low = float(values[0])
    high = float(values[-1])
    return low > 0.0 and high >= 4.0 * low and float(np.median(values)) - low < 0.35 * (high - low)
