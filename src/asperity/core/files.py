"""Files and folders: atomic writing, checks before long computations, and version records."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from platform import python_version
from stat import S_IMODE
from typing import TYPE_CHECKING

from asperity.core.errors import AsperityError, BadInput, UnreadableFile

if TYPE_CHECKING:
    import pandas

MAX_NAME = 50  # characters of a file's name in that of its temporary file
FORMULAS = ("=", "+", "-", "@", "\t", "\r")  # first characters of a spreadsheet formula


@contextmanager
def atomic_write(path: Path) -> Iterator[Path]:
    """Yield a temporary path in the same folder; rename it to `path` on success, else remove it.

    An existing file keeps its permissions. Raises BadInput as `require_writable`, AsperityError if
    the system cannot write, as on a full disk.
    """
    require_writable(path)
    try:
        with new_part(path) as part:
            yield part
            with part.open("rb+") as written:
                os.fsync(written.fileno())
            part.replace(path)
    except OSError as error:
        reason = error.strerror or error
        raise AsperityError(
            f"{path} could not be written: {reason}; nothing was left behind"
        ) from error


@contextmanager
def new_part(path: Path) -> Iterator[Path]:
    """Yield a new, empty file beside `path`, with its permissions; remove it if it is still there.

    Its name cannot be predicted, and a link of that name is not followed.
    """
    part = path.with_name(f".{path.name[:MAX_NAME]}.{os.urandom(8).hex()}.part")
    os.close(os.open(part, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
    try:
        with suppress(FileNotFoundError):
            part.chmod(S_IMODE(path.stat().st_mode))
        yield part
    finally:
        part.unlink(missing_ok=True)


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file atomically; raises as `atomic_write`."""
    with atomic_write(path) as part:
        part.write_bytes(content)


def write_text(path: Path, text: str) -> None:
    """Write a text file atomically; raises as `atomic_write`."""
    write_bytes(path, text.encode())


def write_csv(path: Path, table: "pandas.DataFrame") -> None:
    """Write a table as csv atomically; raises as `atomic_write`.

    Text that a spreadsheet would evaluate as a formula gets a leading apostrophe, because names and
    units come from untrusted files.
    """
    text_columns = table.select_dtypes(exclude=["number", "bool"]).columns
    safe = table.assign(**{name: table[name].map(_escape_formula) for name in text_columns})
    write_text(path, safe.to_csv(index=False, lineterminator="\n"))


def save_csv(path: str | Path, table: "pandas.DataFrame", content: str) -> Path:
    """Write a table to a .csv file by `write_csv`; `content` names it in the message.

    Raises
    ------
    BadInput
        for another suffix, or a path that is not writable.
    """
    path = Path(path)
    if path.suffix.lower() != ".csv":
        raise BadInput(f"{content} is saved as .csv, got {path.name}; change the suffix")
    write_csv(path, table)
    return path


def _escape_formula(value: object) -> object:
    return f"'{value}" if isinstance(value, str) and value.startswith(FORMULAS) else value


def require_file(path: Path) -> None:
    """Raise UnreadableFile unless `path` is a regular file (no folder, pipe or device)."""
    if path.is_file():
        return
    if path.is_dir():
        raise UnreadableFile(f"{path} is a folder; name a file")
    if path.exists():
        raise UnreadableFile(
            f"{path} is a pipe or a device; save its content to a file and name that file"
        )
    raise UnreadableFile(f"{path} does not exist; check its name")


def require_writable(path: Path) -> None:
    """Raise BadInput for a path that cannot be written; call it before a long computation."""
    folder = path.parent
    if not folder.is_dir():
        raise BadInput(f"cannot write {path}: the folder {folder} does not exist; make it first")
    if path.is_dir():
        raise BadInput(f"cannot write {path}: it is a folder; name a file")
    if not os.access(folder, os.W_OK):
        raise BadInput(f"cannot write {path}: the folder {folder} is not writable; choose another")


def make_folder(path: Path) -> None:
    """Create a folder if it is missing; raise BadInput if that is impossible."""
    if path.exists() and not path.is_dir():
        raise BadInput(f"cannot write into {path}: it is a file; name a folder")
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(f"cannot make the folder {path}: {error.strerror}; choose another") from None


def user_cache() -> Path:
    """Return the user's cache folder; its content can be deleted and computed again."""
    base = os.environ.get("XDG_CACHE_HOME") or (
        os.environ.get("LOCALAPPDATA") if os.name == "nt" else None
    )
    return (Path(base) if base else Path.home() / ".cache") / "asperity"


def versions() -> dict[str, str]:
    """Return the versions of the packages that affect numerical results."""
    from importlib.metadata import version  # slow import

    return {
        **{name: version(name) for name in ("asperity", "numpy", "scipy", "numba")},
        "python": python_version(),
    }
