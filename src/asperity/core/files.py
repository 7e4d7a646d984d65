"""What all that writes files and folders shares: whole or not at all, refused before the work, versions beside it."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from platform import python_version
from typing import TYPE_CHECKING, Any

from asperity.core.errors import AsperityError, BadInput, UnreadableFile

if TYPE_CHECKING:
    import pandas

FORMULAS = ("=", "+", "-", "@", "\t", "\r")  # what begins one in a spreadsheet


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Yield a temporary path in the same folder, renamed to `path` when all went well and removed when not.

    Raises BadInput as `require_writable`, AsperityError if the system refuses to write, as on a
    full disk.
    """
    require_writable(path)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        yield part
        with part.open("rb+") as written:
            os.fsync(written.fileno())
        part.replace(path)
    except OSError as error:
        reason = error.strerror or error
        raise AsperityError(
            f"{path} could not be written: {reason}; nothing was left behind"
        ) from error
    finally:
        part.unlink(missing_ok=True)


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file, whole or not at all; raises as `whole_file`."""
    with whole_file(path) as part:
        part.write_bytes(content)


def write_text(path: Path, text: str) -> None:
    """Write a text file, whole or not at all; raises as `whole_file`."""
    write_bytes(path, text.encode())


def write_csv(path: Path, table: "pandas.DataFrame") -> None:
    """Write a table as csv, whole or not at all; raises as `whole_file`.

    Text that a spreadsheet would take for a formula begins with an apostrophe: names and units are
    other people's.
    """
    told = table.select_dtypes(exclude=["number", "bool"]).columns
    safe = table.assign(**{name: table[name].map(_no_formula) for name in told})
    write_text(path, safe.to_csv(index=False, lineterminator="\n"))


def _no_formula(value: Any) -> Any:
    return f"'{value}" if isinstance(value, str) and value.startswith(FORMULAS) else value


def require_file(path: Path) -> None:
    """Raise UnreadableFile for what is no file to be read to its end: nothing, a folder, a pipe or a device."""
    if path.is_file():
        return
    if path.is_dir():
        raise UnreadableFile(f"{path} is a folder; name a file")
    if path.exists():
        raise UnreadableFile(
            f"{path} is a pipe or a device; write what it gives to a file, and name that"
        )
    raise UnreadableFile(f"{path} does not exist; check its name")


def require_writable(path: Path) -> None:
    """Raise BadInput for a path that could not be written, before the work that would be lost."""
    folder = path.parent
    if not folder.is_dir():
        raise BadInput(f"cannot write {path}: the folder {folder} does not exist; make it first")
    if path.is_dir():
        raise BadInput(f"cannot write {path}: it is a folder; name a file")
    if not os.access(folder, os.W_OK):
        raise BadInput(f"cannot write {path}: the folder {folder} is not writable; choose another")


def make_folder(path: Path) -> None:
    """Make a folder to write into, if it is not there; raises BadInput where that cannot be."""
    if path.exists() and not path.is_dir():
        raise BadInput(f"cannot write into {path}: it is a file; name a folder")
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(f"cannot make the folder {path}: {error.strerror}; choose another") from None


def user_cache() -> Path:
    """Where is kept for a user what takes long to work out, and may be deleted."""
    base = os.environ.get("XDG_CACHE_HOME") or (
        os.environ.get("LOCALAPPDATA") if os.name == "nt" else None
    )
    return (Path(base) if base else Path.home() / ".cache") / "asperity"


def versions() -> dict[str, str]:
    """Versions of what decides numbers, to stand beside them."""
    from importlib.metadata import (
        version,
    )  # here: it takes longer to load than the rest of the room

    return {
        **{name: version(name) for name in ("asperity", "numpy", "scipy", "numba")},
        "python": python_version(),
    }
