"""Parquet tables, by pyarrow: one channel per column; rate and unit in the metadata."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import UnreadableFile
from asperity.core.third_party import first_line
from asperity.recording.model import Channel, ChannelFacts, Contents
from asperity.recording.reader import REMEDY, reject_as, stated_facts
from asperity.recording.timing import Clock, GapFiller, fit_clock, is_time_column, rate_from_times
from asperity.recording.units import name_and_unit


def is_parquet(head: bytes) -> bool:
    """Return whether a file starts like parquet."""
    return head[:4] == b"PAR1"


def read(path: Path) -> Contents:
    """Read channels named by column; a column of times gives the rate."""
    import pyarrow.parquet

    notes: list[str] = []
    channels = []
    with reject_as(path, "not a readable parquet file"), pyarrow.parquet.ParquetFile(path) as file:
        schema = file.schema_arrow
        rows = file.metadata.num_rows
        table = _decoded(schema.metadata)
        numbers, dated = _numeric_columns(schema)
        labels = [(label, *name_and_unit(label)) for label in numbers]
        clock, name, unit = next(
            (label for label in labels if is_time_column(label[1]) or label[0] in dated),
            ("", "", None),
        )
        rate, grid = _clock(file, clock, name, "s" if clock in dated else unit)
        time_grid = None if grid is None else (clock, grid)
        for label, name, unit in labels:
            if label != clock and label not in dated and not label.startswith("__index"):
                facts = stated_facts(path.name, table | _decoded(schema.field(label).metadata))
                column_facts: ChannelFacts = {"unit": unit} if unit else {}
                blocks = partial(_column, path, label, time_grid, notes)
                channels.append(
                    Channel(name=name, blocks=blocks, samples=rows, **(column_facts | rate | facts))
                )
    return Contents(format="parquet", channels=channels, notes=notes)


def _numeric_columns(schema: Any) -> tuple[list[str], set[str]]:
    """Return the names of the columns of numbers or dates, and those of dates."""
    from pyarrow import types

    dated = {entry.name for entry in schema if types.is_timestamp(entry.type)}
    numbers = [
        entry.name
        for entry in schema
        if types.is_floating(entry.type) or types.is_integer(entry.type) or entry.name in dated
    ]
    return numbers, dated


def _clock(file: Any, label: str, name: str, unit: str | None) -> tuple[ChannelFacts, Clock | None]:
    """Return the rate by a column of times, and its grid if it is even; nothing for no label."""
    batch = next(file.iter_batches(batch_size=1 << 16, columns=[label]), None) if label else None
    if batch is None:
        return {}, None
    times = _values(batch)
    rate = rate_from_times(name, unit, times)
    grid = fit_clock(times) if "rate_hz" in rate else None
    return rate, grid if grid is not None and grid.even else None


def _values(batch: Any, column: int = 0) -> Field:
    """Return numbers; dates as seconds since 1970."""
    array = batch.column(column)
    values = array.to_numpy(zero_copy_only=False)
    if np.issubdtype(values.dtype, np.datetime64):
        nanoseconds = values.astype("datetime64[ns]").astype(np.int64)
        return np.asarray(nanoseconds // 10**9 + (nanoseconds % 10**9) * 1e-9)
    return np.asarray(values, dtype=np.float64)


def _column(
    path: Path, label: str, time_grid: tuple[str, Clock] | None, notes: list[str], size: int
) -> Iterator[Field]:
    """Yield a column in blocks, placed on the grid of the column of times if there is one."""
    import pyarrow.parquet

    done = 0
    filling = None if time_grid is None else GapFiller(time_grid[1])
    try:
        with pyarrow.parquet.ParquetFile(path) as file:
            for batch in file.iter_batches(
                batch_size=size, columns=[label] if time_grid is None else [label, time_grid[0]]
            ):
                values = _values(batch, batch.schema.get_field_index(label))
                done += values.size
                if filling is not None and time_grid is not None:
                    values = filling.fill(
                        _values(batch, batch.schema.get_field_index(time_grid[0])), values
                    )
                yield values
    except UnreadableFile:
        raise
    except Exception as error:
        if done == 0:
            raise UnreadableFile(
                f"{path.name} cannot be read ({first_line(error)}); {REMEDY}"
            ) from error
        notes.append(f"damaged after sample {done}; samples before that were read")
    if filling is not None and filling.note:
        notes.append(filling.note)


def _decoded(metadata: dict[bytes, bytes] | None) -> dict[str, str]:
    """Return what a file states besides its types."""
    return {
        k.decode("utf-8", "replace"): v.decode("utf-8", "replace")
        for k, v in (metadata or {}).items()
        if k not in (b"pandas", b"ARROW:schema")
    }
