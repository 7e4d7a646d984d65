"""Column of times of a table: dates, separate dates and times of day, seconds since 1970."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas

from asperity.core.arrays import Field
from asperity.core.errors import BadInput
from asperity.monitoring.overalls.number_text import Column, column_numbers
from asperity.recording import is_time_column, name_and_unit

SAMPLE_ROWS = 50  # that decide between formats
MOSTLY = 0.5  # share of the rows
SMALLEST_EPOCH = 1e8  # smaller numbers are hours or row numbers, no seconds since 1970
EPOCHS = ((1e11, 1.0), (1e14, 1e3), (1e17, 1e6), (np.inf, 1e9))  # median, ticks per second
LARGEST_TICKS = 9.2e18  # nanoseconds since 1970 that a date can hold
DATE_NAMES = ("date", "datum", "day", "tag")
CALENDAR = {8: "%Y%m%d", 12: "%Y%m%d%H%M", 14: "%Y%m%d%H%M%S"}  # dates as a number, by digits
_TIME_OF_DAY = r"\d{1,2}:\d{2}(?::\d{2}(?:[.,]\d+)?)?(?:\s?[AaPp][Mm])?"
_DAY_OR_MONTH = r"\s*(\d{1,2})[./-](\d{1,2})[./-](?:\d{4}|\d{2}(?:\s|$))"
_ZONE = r":\d{2}.*(?:Z|UTC|GMT|[+-]\d{2}(?::?\d{2})?)$"


class TimeAxis(NamedTuple):
    """Times of the rows.

    `x` in `unit` is in hours since the first time for dates; `times` are time stamps in ISO 8601,
    empty without dates; `stamps` are those of the file; `columns` are the columns used.
    """

    x: Field
    unit: str
    times: Sequence[str]
    stamps: Sequence[str]
    columns: Sequence[str]


def time_axis(table: pandas.DataFrame, marks: dict[str, str], path: Path) -> tuple[TimeAxis, str]:
    """Return the times of the rows, and a note on how they were read.

    Raises
    ------
    BadInput
        for a table without times, or times of day without a date.
    """
    names = _time_columns(table, path)
    if len(names) == 1 and _are_numbers(table[names[0]]):
        return _numeric_axis(table[names[0]], names[0], marks[names[0]], path)
    stamps = table[names[0]]
    if len(names) == 2:
        stamps = stamps.astype("str").str.strip() + " " + table[names[1]].astype("str").str.strip()
    dates, note = _dates(stamps)
    dated = pandas.api.types.is_datetime64_any_dtype(stamps)
    texts = [] if dated else [*stamps.astype("str")]
    return _date_axis(dates, names, texts, path), note


def _time_columns(table: pandas.DataFrame, path: Path) -> list[str]:
    """Return the column of times, or those of dates and of times of day."""
    name = _time_column(table, path)
    if not _are_times_of_day(table[name]):
        days = table[name]
        clock = next(
            (
                other
                for other in table.columns
                if other != name and _is_clock(other) and _are_times_of_day(table[other])
            ),
            None,
        )
        return [name] if clock is None or _have_times(days) else [name, clock]
    for other in table.columns:
        if other != name and (
            other.strip().lower() in DATE_NAMES or _are_dates(table[other].head(SAMPLE_ROWS))
        ):
            return [other, name]
    raise BadInput(
        f"column {name} of {path.name} has times of day without a date; add a column date"
    )


def _time_column(table: pandas.DataFrame, path: Path) -> str:
    """Return the column of times: by its name, or else the first that holds dates."""
    for column in table.columns:
        if is_time_column(name_and_unit(column)[0]):
            return str(column)
    for column in table.columns:
        if _are_dates(table[column].head(SAMPLE_ROWS)):
            return str(column)
    raise BadInput(f"{path.name} has no column of times; name one of its columns time")


def _is_clock(name: str) -> bool:
    return is_time_column(name) or name.strip().lower() in ("uhrzeit", "clock", "hour")


def _are_times_of_day(column: Column) -> bool:
    text = column.head(SAMPLE_ROWS).dropna().astype("str").str.strip()
    return bool(len(text)) and bool(text.str.fullmatch(_TIME_OF_DAY).mean() > MOSTLY)


def _have_times(column: Column) -> bool:
    """Return whether dates state times of day too."""
    if pandas.api.types.is_datetime64_any_dtype(column):
        return True
    return bool(column.head(SAMPLE_ROWS).astype("str").str.contains(r"\d:\d").mean() > MOSTLY)


def _are_dates(column: Column) -> bool:
    if pandas.api.types.is_datetime64_any_dtype(column):
        return True
    if _are_numbers(column) or pandas.api.types.is_numeric_dtype(column):
        return False
    text = column.astype("str")
    dates = pandas.to_datetime(text, errors="coerce", format="mixed", utc=True)
    return bool((dates.notna() & text.str.contains(r"\d[./:-]\d")).mean() > MOSTLY)


def _are_numbers(column: Column) -> bool:
    """Return whether most entries are plain numbers."""
    if pandas.api.types.is_datetime64_any_dtype(column):
        return False
    values = [column_numbers(column.head(SAMPLE_ROWS), mark).values for mark in (".", ",")]
    return max(float(np.isfinite(part).mean()) for part in values) > MOSTLY


def _numeric_axis(stamps: Column, name: str, mark: str, path: Path) -> tuple[TimeAxis, str]:
    """Return the times of a column of numbers: dates if they are large, otherwise as they are."""
    numbers = column_numbers(stamps, mark).values
    texts = [] if pandas.api.types.is_float_dtype(stamps) else [*stamps.astype("str")]
    finite = numbers[np.isfinite(numbers)]
    if not finite.size:
        raise BadInput(f"{path.name}: no time in column {name} can be read; write ISO 8601")
    dates = _calendar_dates(numbers)
    if dates is not None:
        example = f"{finite[0]:.0f}"
        form = "YYYYMMDDhhmmss"[: len(example)]
        note = f"Times such as {example} are read as {form}."
        return _date_axis(dates, [name], texts, path), note
    if float(np.median(np.abs(finite))) < SMALLEST_EPOCH:
        return TimeAxis(numbers, name_and_unit(name)[1] or "", [], texts, [name]), ""
    return _date_axis(_epoch_dates(numbers, name, path), [name], texts, path), ""


def _epoch_dates(numbers: Field, name: str, path: Path) -> Column:
    """Return the dates of seconds, milliseconds, microseconds or nanoseconds since 1970."""
    known = np.isfinite(numbers)
    middle = float(np.median(np.abs(numbers[known])))
    per_second = next(per_second for limit, per_second in EPOCHS if middle < limit)
    ticks = np.where(known, numbers, 0.0) * (1e9 / per_second)
    if np.abs(ticks).max() > LARGEST_TICKS:
        raise BadInput(
            f"column {name} of {path.name} has times up to {np.abs(numbers[known]).max():.3g}, "
            "which are no seconds since 1970; write ISO 8601"
        )
    return pandas.Series(np.rint(ticks).astype("M8[ns]")).where(known)


def _calendar_dates(numbers: Field) -> "Column | None":
    """Return the dates of numbers such as 20240131120000; None for other numbers."""
    finite = numbers[np.isfinite(numbers)]
    form = CALENDAR.get(len(f"{finite[0]:.0f}"))
    if form is None or (finite % 1.0 != 0.0).any() or finite.min() < 0.0:
        return None
    text = pandas.Series(np.where(np.isfinite(numbers), numbers, 0.0).astype("int64").astype("U"))
    dates = pandas.to_datetime(text, format=form, errors="coerce")
    known = dates.notna()
    if known.sum() < finite.size or not dates[known].dt.year.between(1970, 2100).all():
        return None
    return dates


def _date_axis(dates: Column, names: list[str], stamps: list[str], path: Path) -> TimeAxis:
    """Return the axis of dates; those with a zone in UTC with "Z"."""
    if not dates.notna().any():
        raise BadInput(
            f"{path.name}: no time in column {' and '.join(names)} can be read; write ISO 8601"
        )
    zone = "Z" if dates.dt.tz is not None else ""
    plain = dates.dt.tz_convert("UTC").dt.tz_localize(None) if zone else dates
    instants = plain.to_numpy(dtype="M8[us]")
    known = ~np.isnat(instants)
    seconds = (instants - instants[known].min()) / np.timedelta64(1, "s")
    whole = (instants[known].astype("int64") % 1_000_000 == 0).all()
    texts = np.datetime_as_string(instants, unit="s" if whole else "us").tolist()
    times = [
        (text if whole else text.rstrip("0").rstrip(".")) + zone if read else ""
        for text, read in zip(texts, known, strict=True)
    ]
    return TimeAxis(np.where(known, seconds / 3600.0, np.nan), "h", times, stamps, names)


def _dates(stamps: Column) -> tuple[Column, str]:
    """Return dates, in UTC if they state a zone; of 03/04/2024 the order with the evener steps."""
    if pandas.api.types.is_datetime64_any_dtype(stamps):
        return stamps, ""
    text = stamps.astype("str").str.strip()
    zoned = np.asarray(text.str.contains(_ZONE).fillna(False), dtype=bool)
    without = int((~zoned & (text.str.len() > 0)).sum())
    note = f"{without} times without an offset are read as UTC." if without and zoned.any() else ""
    dates, order_note = _read_dates(text)
    if not zoned.any():
        dates = dates.dt.tz_localize(None)
    return dates, " ".join(filter(None, [order_note, note]))


def _read_dates(text: Column) -> tuple[Column, str]:
    """Return dates in UTC, and a note if the order of day and month is a guess."""
    if text.head(SAMPLE_ROWS).str.match(_DAY_OR_MONTH).mean() < MOSTLY:
        return pandas.to_datetime(text, errors="coerce", format="mixed", utc=True), ""
    numbers = text.str.extract(_DAY_OR_MONTH).astype(float)
    day_first, guess = bool((numbers[0] > 12).any()), False
    read = {}
    if not day_first and not (numbers[1] > 12).any():
        read = {first: _in_order(text, day_first=first) for first in (True, False)}
        unevenness = {first: _unevenness(dates) for first, dates in read.items()}
        day_first, guess = unevenness[True] <= unevenness[False], True
    dates = read.get(day_first)
    note = (
        f"Dates such as {text[text.str.len() > 0].iloc[0].split()[0]} are read with the "
        f"{'day' if day_first else 'month'} first; write ISO 8601 if that is wrong."
    )
    return _in_order(text, day_first=day_first) if dates is None else dates, note if guess else ""


def _in_order(text: Column, *, day_first: bool) -> Column:
    return pandas.to_datetime(text, errors="coerce", format="mixed", dayfirst=day_first, utc=True)


def _unevenness(dates: Column) -> float:
    """Return the standard deviation of the steps over their mean; infinite if times fall."""
    steps = np.diff(dates.dt.tz_localize(None).to_numpy(dtype="M8[s]").astype(float))
    if steps.size == 0 or (steps < 0.0).any() or not steps.any():
        return np.inf
    return float(np.std(steps) / np.mean(steps))
