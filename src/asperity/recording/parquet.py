"""Parquet tables, by pyarrow: a channel a column; rate and unit in the metadata of the table or of its column."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from asperity.arrays import Field
from asperity.errors import UnreadableFile
from asperity.quiet import first_line
from asperity.recording.common import REMEDY, facts_in, required
from asperity.recording.model import Channel, Contents
from asperity.recording.timing import Clock, is_time
from asperity.recording.units import name_and_unit


def is_parquet(head: bytes) -> bool:
    """Whether a file begins like parquet."""
    return head[:4] == b"PAR1"


def read(path: Path) -> Contents:
    """Channels named by column; a column of times gives the rate."""
    import pyarrow
    import pyarrow.parquet

    notes: list[str] = []
    try:
        with pyarrow.parquet.ParquetFile(path) as file:
            schema, rows = file.schema_arrow, file.metadata.num_rows
            table = {str(k): v for k, v in _decoded(schema.metadata).items() if k not in ("pandas", "ARROW:schema")}
            numbers = [
                entry
                for entry in schema
                if pyarrow.types.is_floating(entry.type) or pyarrow.types.is_integer(entry.type)
            ]
            labels = [(entry.name, *name_and_unit(entry.name)) for entry in numbers]
            clock = next((label for label in labels if is_time(label[1])), None)
            timed = {} if clock is None else _timed(path, file, clock)
            facts = [
                ({"unit": unit} if unit else {})
                | timed
                | facts_in(path.name, table | _decoded(schema.field(label).metadata))
                for label, _, unit in labels
            ]
    except UnreadableFile:
        raise
    except Exception as error:
        raise UnreadableFile(f"{path.name} is no readable parquet file ({first_line(error)}); {REMEDY}") from error
    channels = (
        Channel(name=name, blocks=_column(path, label, notes), samples=rows, **known)
        for (label, name, _), known in zip(labels, facts, strict=True)
        if (label != (clock or ("",))[0]) and not label.startswith("__index")
    )
    return Contents(format="parquet", channels=required(channels, path.name), notes=notes)


def _timed(path: Path, file: Any, column: tuple[str, str, str | None]) -> dict[str, Any]:
    clock = Clock(path.name, column[1], column[2])
    for batch in file.iter_batches(batch_size=1 << 16, columns=[column[0]]):
        clock.tick(np.asarray(batch.column(0).to_numpy(zero_copy_only=False), dtype=np.float64))
        break
    return clock.facts()


def _column(path: Path, label: str, notes: list[str]) -> Callable[[int], Iterator[Field]]:
    def blocks(size: int) -> Iterator[Field]:
        import pyarrow.parquet

        done = 0
        try:
            with pyarrow.parquet.ParquetFile(path) as file:
                for batch in file.iter_batches(batch_size=size, columns=[label]):
                    values = np.asarray(batch.column(0).to_numpy(zero_copy_only=False), dtype=np.float64)
                    done += values.size
                    yield values
        except Exception as error:
            if done == 0:
                raise UnreadableFile(f"{path.name} cannot be read ({first_line(error)}); {REMEDY}") from error
            notes.append(f"damaged after sample {done}; what comes before was read")

    return blocks


def _decoded(metadata: dict[bytes, bytes] | None) -> dict[str, str]:
    return {k.decode("utf-8", "replace"): v.decode("utf-8", "replace") for k, v in (metadata or {}).items()}
