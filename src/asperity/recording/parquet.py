"""Parquet tables, by pyarrow: a channel a column; rate and unit in the metadata of the table or of its column."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from asperity.arrays import Field
from asperity.errors import UnreadableFile
from asperity.quiet import first_line
from asperity.recording.common import REMEDY, facts_in, refused_as
from asperity.recording.model import Channel, Contents
from asperity.recording.timing import is_time, timed
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
        table = {k: v for k, v in _decoded(schema.metadata).items() if k not in ("pandas", "ARROW:schema")}
        types = pyarrow.types
        numbers = [entry.name for entry in schema if types.is_floating(entry.type) or types.is_integer(entry.type)]
        labels = [(label, *name_and_unit(label)) for label in numbers]
        clock, name, unit = next((label for label in labels if is_time(label[1])), ("", "", None))
        first = next(file.iter_batches(batch_size=1 << 16, columns=[clock]), None) if clock else None
        rate = {} if first is None else timed(name, unit, _values(first))
        for label, name, unit in labels:
            facts = facts_in(path.name, table | _decoded(schema.field(label).metadata))
            facts = ({"unit": unit} if unit else {}) | rate | facts
            if label != clock and not label.startswith("__index"):
                channels.append(Channel(name=name, blocks=partial(_column, path, label, notes), samples=rows, **facts))
    return Contents(format="parquet", channels=channels, notes=notes)


def _values(batch: Any) -> Field:
    return np.asarray(batch.column(0).to_numpy(zero_copy_only=False), dtype=np.float64)


def _column(path: Path, label: str, notes: list[str], size: int) -> Iterator[Field]:
    import pyarrow.parquet

    done = 0
    try:
        with pyarrow.parquet.ParquetFile(path) as file:
            for batch in file.iter_batches(batch_size=size, columns=[label]):
                values = _values(batch)
                done += values.size
                yield values
    except Exception as error:
        if done == 0:
            raise UnreadableFile(f"{path.name} cannot be read ({first_line(error)}); {REMEDY}") from error
        notes.append(f"damaged after sample {done}; what comes before was read")


def _decoded(metadata: dict[bytes, bytes] | None) -> dict[str, str]:
    return {k.decode("utf-8", "replace"): v.decode("utf-8", "replace") for k, v in (metadata or {}).items()}
