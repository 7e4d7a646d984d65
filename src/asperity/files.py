"""What all that writes files and folders shares: whole or not at all, refused before the work, versions beside it."""

import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from platform import python_version
from typing import Any

import asperity
from asperity.errors import AsperityError, BadInput, UnreadableFile

MANIFEST = "manifest.json"


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Yield a temporary path in the same folder, renamed to `path` when all went well and removed when not.

    Raises BadInput as `require_writable`, AsperityError if the system refuses to write, as on a full disk.
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
        raise AsperityError(f"{path} could not be written: {reason}; nothing was left behind") from error
    finally:
        part.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a text file, whole or not at all; raises as `whole_file`."""
    with whole_file(path) as part:
        part.write_text(text, "utf-8")


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


def versions() -> dict[str, str]:
    """Versions of what decides numbers, to stand beside them."""
    from importlib.metadata import version  # here: it takes longer to load than the rest of the room

    return {**{name: version(name) for name in ("asperity", "numpy", "scipy", "numba")}, "python": python_version()}


def require_same_version(manifest: Mapping[str, Any], folder: Path) -> None:
    """Refuse to go on in a folder that another asperity began: its numbers would stand beside ours."""
    theirs, ours = manifest.get("versions", {}).get("asperity"), asperity.__version__
    if theirs != ours:
        raise BadInput(f"{folder} was computed by asperity {theirs}, this is {ours}; choose another folder")


def read_manifest(folder: Path, *, of: str, layout: int) -> dict[str, Any]:
    """What a folder that holds a study or a history (`of`) in a layout of that number says about itself.

    Raises UnreadableFile where it says nothing that can be read.
    """
    path = folder / MANIFEST
    try:
        manifest = json.loads(path.read_text("utf-8"))
    except FileNotFoundError:
        raise UnreadableFile(f"{folder} holds no {of}: it has no {MANIFEST}; check its name") from None
    except (OSError, ValueError):
        raise UnreadableFile(f"{path} is damaged; compute the {of} into another folder") from None
    if not isinstance(manifest, dict) or manifest.get("format") != layout or manifest.get("of") != of:
        raise UnreadableFile(f"{path} is not a {of}'s manifest that this asperity can read; choose another folder")
    return manifest
