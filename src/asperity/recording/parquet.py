"""Parquet tables, by pyarrow: a channel a column; rate and unit in the metadata of the table or of its column."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from asperity.core.arrays import Field
from asperity.core.errors import UnreadableFile
from asperity.core.third_party import first_line
from asperity.recording.model import Channel, Contents
from asperity.recording.reader import REMEDY, facts_in, refused_as
from asperity.recording.timing import Clock, Filling, clock_of, is_time, timed
from asperity.recording.units import name_and_unit


def is_parquet(head: bytes) -> bool:
    """Whether a file begins like parquet."""
    return head[:4] == b"PAR1"


def read(path: Path) -> Contents:
    """Channels named by column; a column of times gives the rate."""
    import pyarrow
    import pyarrow.parquet

    notes: list[str] = []
    channels = []
    with refused_as(path, "no readable parquet file"), pyarrow.parquet.ParquetFile(path) as file:
        schema, rows = file.schema_arrow, file.metadata.num_rows
        table = {
            k: v
            for k, v in _decoded(schema.metadata).items()
            if k not in ("pandas", "ARROW:schema")
        }
        types = pyarrow.types
        numbers = [
            entry.name
            for entry in schema
            if types.is_floating(entry.type)
            or types.is_integer(entry.type)
            or types.is_timestamp(entry.type)
        ]
        labels = [(label, *name_and_unit(label)) for label in numbers]
        dated = {entry.name for entry in schema if types.is_timestamp(entry.type)}
        clock, name, unit = next(
            (label for label in labels if is_time(label[1]) or label[0] in dated), ("", "", None)
        )
        first = (
            next(file.iter_batches(batch_size=1 << 16, columns=[clock]), None) if clock else None
        )
        times = None if first is None else _values(first)
        rate = {} if times is None else timed(name, "s" if clock in dated else unit, times)
        grid = None if times is None or "rate_hz" not in rate else clock_of(times)
        on = (clock, grid) if grid is not None and grid.even else None
        for label, name, unit in labels:
            facts = facts_in(path.name, table | _decoded(schema.field(label).metadata))
            facts = ({"unit": unit} if unit else {}) | rate | facts
            if label != clock and label not in dated and not label.startswith("__index"):
                blocks = partial(_column, path, label, on, notes)
                channels.append(Channel(name=name, blocks=blocks, samples=rows, **facts))
    return Contents(format="parquet", channels=channels, notes=notes)


def _values(batch: Any, column: int = 0) -> Field:
    """Numbers; dates as seconds since 1970."""
    array = batch.column(column)
    values = array.to_numpy(zero_copy_only=False)
    if np.issubdtype(values.dtype, np.datetime64):
        nanoseconds = values.astype("datetime64[ns]").astype(np.int64)
        return np.asarray(nanoseconds // 10**9 + (nanoseconds % 10**9) * 1e-9)
    return np.asarray(values, dtype=np.float64)


def _column(
    path: Path, label: str, on: tuple[str, Clock] | None, notes: list[str], size: int
) -> Iterator[Field]:
    """A column, block by block, on the grid of the column of times where that is one."""
    import pyarrow.parquet

    done = 0
    filling = None if on is None else Filling(on[1])
    try:
        with pyarrow.parquet.ParquetFile(path) as file:
            for batch in file.iter_batches(
                batch_size=size, columns=[label] if on is None else [label, on[0]]
            ):
                values = _values(batch, batch.schema.get_field_index(label))
                done += values.size
                if filling is not None and on is not None:
                    values = filling.spread(
                        _values(batch, batch.schema.get_field_index(on[0])), values
                    )
                yield values
    except UnreadableFile:
        raise
    except Exception as error:
        if done == 0:
            raise UnreadableFile(
                f"{path.name} cannot be read ({first_line(error)}); {REMEDY}"
            ) from error
        notes.append(f"damaged after sample {done}; what comes before was read")
    if filling is not None and filling.note:
        notes.append(filling.note)


def _decoded(metadata: dict[bytes, bytes] | None) -> dict[str, str]:
    return {
        k.decode("utf-8", "replace"): v.decode("utf-8", "replace")
        for k, v in (metadata or {}).items()
    }
