"""Storage of a study: a manifest, then one part per finished batch, each written atomically.

A part is a small parquet table written under a temporary name, flushed and renamed, so that a
crash leaves only complete parts. Cases of the manifest that are in no part are still to be
computed.
"""

import hashlib
import json
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import filelock
import pandas
import pyarrow

from asperity.case import load_case, relative_path, to_si
from asperity.core.arrays import Field
from asperity.core.errors import AsperityError, BadInput, UnreadableFile
from asperity.core.files import make_folder, require_file, require_writable, versions, write_bytes
from asperity.core.storage import (
    MANIFEST,
    read_manifest,
    read_table,
    require_same_version,
    write_json,
    write_table,
)
from asperity.results import Run, load_run
from asperity.study.evaluate import Evaluated, Row
from asperity.study.maps import MAPS, read_maps, write_maps
from asperity.study.plan import SEED_KEYS, StudyPlan, plan_points

FORMAT = 2  # increases when readers of the previous format cannot read the folder
PARTS, TABLE, RUNS = "parts", "table.parquet", "runs"
MAPPED = b"mapped"  # key of a part's metadata: cases whose maps were stored
STALE_S = 3600.0  # age from which on no other shard can still be writing a temporary file
_LEADING = ("case_id", "number", "point", "realisation", "status", "reason")


@dataclass(frozen=True)
class StudyFolder:
    """A study's folder. Opened for writing by `open_study_folder`, which locks it."""

    folder: Path
    plan: StudyPlan
    design: str  # as stored; may differ from the plan's if written by another version of asperity
    # parts by path, time and size: each is read in a subprocess
    _read: dict[tuple[Path, int, int], pyarrow.Table] = field(
        default_factory=dict, repr=False, compare=False
    )

    def finished(self) -> dict[str, tuple[str, int]]:
        """Return status and attempt of every stored case."""
        newest: dict[str, tuple[str, int]] = {}
        for path in self._parts():
            part = self._read_part(path).select(["case_id", "status", "attempt"]).to_pydict()
            for case_id, status, attempt in zip(*(part[name] for name in part), strict=True):
                if attempt >= newest.get(case_id, ("", 0))[1]:
                    newest[case_id] = status, attempt
        return newest

    def write_batch(self, rows: Sequence[Row], results: Sequence[Evaluated]) -> None:
        """Write a finished batch, fields first; `AsperityError` if the system refuses to write."""
        mapped = []
        for row, result in zip(rows, results, strict=True):
            case_id = row["case_id"]
            if result.maps:
                write_maps(self.folder, self.design, case_id, result.maps)
                mapped.append(case_id)
            if result.run is not None:
                make_folder(self.folder / RUNS)
                result.run.save(self.run_path(case_id))
        names = hashlib.sha256(
            "".join(f"{row['case_id']}{row['attempt']}" for row in rows).encode()
        ).hexdigest()
        table = rows_table(rows).replace_schema_metadata({MAPPED: json.dumps(mapped)})
        self._write(self.folder / PARTS / f"{names[:20]}.parquet", table)

    def maps(self, case_id: str) -> dict[str, Field]:
        """Read the maps of a case; UnreadableFile if there are none or they are damaged."""
        return read_maps(self.folder, self.design, case_id)

    def run(self, case_id: str) -> Run:
        """Load the run of a case; UnreadableFile if there is none or it is damaged."""
        path = self.run_path(case_id)
        if not path.exists():
            raise UnreadableFile(
                f"{self.folder} has no run of case {case_id}; run the study with --fields run in a "
                "new folder, because finished cases are not computed again"
            )
        return load_run(path)

    def run_path(self, case_id: str) -> Path:
        """Return the file of a case's run."""
        return self.folder / RUNS / f"{case_id}.nc"

    def remarks(self) -> tuple[str, ...]:
        """Return a remark on maps that were stored and are missing."""
        mapped: set[str] = set()
        for path in self._parts():
            metadata = self._read_part(path).schema.metadata or {}
            mapped |= {*json.loads(metadata.get(MAPPED, b"[]"))}
        lost = sum(not (self.folder / MAPS / case_id).is_dir() for case_id in mapped)
        cases = f"{lost} of {len(mapped)} cases"
        return (f"The stored maps of {cases} are missing in {self.folder}",) if lost else ()

    def merge(self) -> Path:
        """Write all finished cases as one table, in the order of the plan; return its path."""
        path = self.folder / TABLE
        table = pyarrow.Table.from_pandas(self.table(), preserve_index=False)
        metadata = {"asperity": version("asperity"), "case": self.plan.case.text}
        self._write(path, table.replace_schema_metadata({**table.schema.metadata, **metadata}))
        return path

    @property
    def merged(self) -> Path | None:
        """Path of the merged table, if it has been written."""
        path = self.folder / TABLE
        return path if path.exists() else None

    def table(self) -> pandas.DataFrame:
        """Return one row per finished case, in the order of the plan."""
        return ordered_table([self._read_part(path) for path in self._parts()], self.plan)

    def import_parts(self, other: Path) -> None:
        """Copy the parts of another folder of the same study, such as a shard."""
        for path in read_study_folder(other, self.plan)._parts():
            target = self.folder / PARTS / path.name
            if not target.exists():
                write_bytes(target, path.read_bytes())

    def _parts(self) -> list[Path]:
        return sorted((self.folder / PARTS).glob("*.parquet"))

    def _read_part(self, path: Path) -> pyarrow.Table:
        require_file(path)
        state = path.stat()
        key = (path, state.st_mtime_ns, state.st_size)
        if key not in self._read:
            remedy = "delete it; its cases are then computed again"
            self._read[key] = read_table(path, self.design, remedy)
        return self._read[key]

    def _write(self, path: Path, table: pyarrow.Table) -> None:
        try:
            write_table(path, table, self.design)
        except AsperityError as refused:
            raise type(refused)(
                f"{refused}; finished cases are kept, free space and run the study again"
            ) from refused


@contextmanager
def open_study_folder(
    folder: Path, plan: StudyPlan, shard: tuple[int, int]
) -> Iterator[StudyFolder]:
    """Create or open a study's folder for writing, write its manifest and lock it.

    `BadInput` for a folder that cannot be written to, holds another study, or is in use by another
    process; `AsperityError` if the system refuses to write, as on a full disk.
    """
    make_folder(folder)
    manifest = folder / MANIFEST
    if manifest.exists():
        _require_same(plan, folder)
    elif any((folder / PARTS).glob("*.parquet")):
        raise BadInput(
            f"{folder} holds parts of a study without its manifest; choose another folder"
        )
    make_folder(folder / PARTS)
    require_writable(manifest)
    with ExitStack() as locks:
        _lock(folder, shard, locks)
        for stale in (folder / PARTS).glob(".*.part"):
            if shard == (1, 1) or time.time() - stale.stat().st_mtime > STALE_S:
                stale.unlink(missing_ok=True)
        write_json(manifest, _manifest(plan, folder))
        yield StudyFolder(folder, plan, plan.design)


def read_study_folder(folder: Path, plan: StudyPlan) -> StudyFolder:
    """Open a study's folder for reading; BadInput if it holds another study than `plan`."""
    _require_same(plan, folder)
    return StudyFolder(folder, plan, plan.design)


def _lock(folder: Path, shard: tuple[int, int], locks: ExitStack) -> None:
    """Lock the folder: a whole study exclusively, a shard against itself and a whole study."""
    study_lock = folder / ".whole.lock"
    shard_lock = folder / f".shard-{shard[0]}-of-{shard[1]}.lock"
    try:
        if shard == (1, 1):
            for lock in (study_lock, *folder.glob(".shard-*.lock")):
                locks.enter_context(filelock.FileLock(lock, timeout=0))
        else:
            with filelock.FileLock(study_lock, timeout=1):
                locks.enter_context(filelock.FileLock(shard_lock, timeout=0))
    except filelock.Timeout:
        raise BadInput(
            f"another process computes this study in {folder}; wait for it or stop it"
        ) from None
    except OSError as error:
        raise BadInput(f"cannot write into {folder}: {error.strerror}; choose another") from None


def load_study_folder(folder: Path) -> StudyFolder:
    """Load a study's folder; `UnreadableFile` if it holds no study or its manifest is damaged."""
    manifest = study_manifest(folder)
    try:
        home = (folder / manifest["case_folder"]).resolve()
        case = load_case(manifest["case"], folder=home, name=manifest["source"])
        plan = plan_points(
            case,
            manifest["points"],
            axes=manifest["axes"],
            seeds=manifest["seeds"] or manifest["realisations"],
            kind=manifest["kind"],
            seeding=manifest["seeding"],
        )
        ids = tuple(manifest["ids"])
        if len(ids) != len(plan.points) * plan.realisations:
            raise KeyError("ids")
        with suppress(UnreadableFile):  # the measured surface need not be available
            # a different design comes from a version of asperity with other case keys
            if plan.design == manifest["design"] and ids != tuple(case.id for case in plan.cases):
                raise KeyError("ids")
        return StudyFolder(folder, replace(plan, ids=ids), manifest["design"])
    except KeyError:
        raise UnreadableFile(
            f"{folder / MANIFEST} is damaged; compute the study into another folder"
        ) from None


def study_manifest(folder: Path) -> dict[str, Any]:
    """Read the manifest of a study's folder."""
    return read_manifest(folder, of="study", layout=FORMAT)


def _manifest(plan: StudyPlan, folder: Path) -> dict[str, object]:
    names = ("surface_digest", "kind", "seeding", "seeds", "realisations", "axes", "points")
    return {
        "of": "study",
        "format": FORMAT,
        "design": plan.design,
        "versions": versions(),
        "source": plan.case.source,
        "case": plan.case.text,
        "case_folder": relative_path(plan.case.folder.resolve(), folder.resolve()),
        **{name: getattr(plan, name) for name in names},
        "ids": [case.id for case in plan.cases],
    }


def _require_same(plan: StudyPlan, folder: Path) -> None:
    """Raise BadInput if the folder's study shares another case; points and seeds may be added."""
    manifest = study_manifest(folder)
    require_same_version(manifest, folder)
    if manifest.get("design") != plan.design:
        remedy = "choose another folder, or restore the case"
        raise BadInput(f"{folder} holds a study of another case than {plan.case.source}; {remedy}")


# Tables
# ----------------------------------------------------------------------


def rows_table(rows: Iterable[Row]) -> pyarrow.Table:
    """Return rows as a table; missing entries become null."""
    rows = list(rows)
    names = dict.fromkeys(name for row in sorted(rows, key=len, reverse=True) for name in row)
    return pyarrow.Table.from_pydict({name: [row.get(name) for row in rows] for name in names})


def ordered_table(parts: Sequence[pyarrow.Table], plan: StudyPlan) -> pandas.DataFrame:
    """Return finished rows by case number, the plan's columns first; the last attempt counts."""
    if parts:
        finished = _last_attempts(parts)
    else:
        finished = pandas.DataFrame({"case_id": [], "status": [], "reason": []}, dtype=str)
    merged = _planned_table(plan).merge(finished, on="case_id", how="inner")
    merged = merged.sort_values("number", ignore_index=True)
    rest = [name for name in merged.columns if name not in _LEADING]
    return merged[[*_LEADING, *rest]]


def _planned_table(plan: StudyPlan) -> pandas.DataFrame:
    """Return the numbers, swept quantities and seeds of all cases of a plan."""
    planned = pandas.DataFrame(
        [(case.id, case.number, case.point, case.realisation) for case in plan.cases],
        columns=list(_LEADING[:4]),
    )
    for key in (*plan.axes, *(seed for seed in SEED_KEYS if seed not in plan.axes)):
        values = [to_si(case.overrides.get(key)) for case in plan.cases]
        if any(value is not None for value in values):
            planned[key] = _uniform_type(values)
    for seed in SEED_KEYS:
        if seed in planned:
            planned[seed] = planned[seed].astype(
                "int64" if planned[seed].notna().all() else "Int64"
            )
    return planned


def _last_attempts(parts: Sequence[pyarrow.Table]) -> pandas.DataFrame:
    """Return the last attempt at each finished case."""
    fewest_last = sorted(parts, key=lambda part: part.num_columns, reverse=True)
    table = pyarrow.concat_tables(fewest_last, promote_options="permissive")
    for index, column in enumerate(table.schema):
        if pyarrow.types.is_null(column.type):  # no case has this number
            table = table.set_column(index, column.name, table.column(index).cast("float64"))
    runs = table.select(["case_id", "attempt"]).to_pandas()
    last = runs.sort_values("attempt", kind="stable").drop_duplicates("case_id", keep="last").index
    finished = table.take(sorted(last)).drop_columns("attempt").to_pandas()
    if "converged" in finished:  # a case that failed before the solver did not converge
        finished["converged"] = finished["converged"].eq(True)
    return pandas.DataFrame(finished)


def _uniform_type(values: Sequence[object]) -> list[Any]:
    """Return a swept quantity as numbers, or as text (JSON for pairs and tables) if any is not."""
    if any(isinstance(value, list) for value in values):  # a pair of equal values became one number
        values = [[value, value] if isinstance(value, int | float) else value for value in values]
    if all(value is None or isinstance(value, int | float) for value in values):
        return list(values)
    return [
        value if value is None or isinstance(value, str) else json.dumps(value) for value in values
    ]
