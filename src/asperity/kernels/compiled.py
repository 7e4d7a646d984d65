"""numba's compilation with a cache that can be damaged, emptied or nowhere to be kept: then kernels compile anew.

numba loads what its cache holds as it stands, machine code included, and raises where it holds
nothing sensible. Here a digest follows everything in it; what does not fit is thrown away. Against
others who may write there it is no guard.

A kernel holds what it calls and constants of modules beside its own: it is stale when any of them
has changed. numba numbers what it keeps, and two processes may take one number for two signatures:
so all of it says what it is.
"""

import pickle
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import numba
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.runtime.nrt import rtsys

_DIGEST = 32  # bytes behind what is kept; pickle passes over them


class _CheckedFile(IndexDataCacheFile):
    """The cache of one function on disk."""

    def save(self, key: Any, data: Any) -> None:
        """Keep what was compiled, with what it was compiled from and for."""
        super().save(key, (self._source_stamp, key, data))

    def load(self, key: Any) -> Any:
        """What was kept for a key; None where there is nothing, or something else."""
        stamp, known, data = super().load(key) or (None, None, None)
        return data if (stamp, known) == (self._source_stamp, key) else None

    def _dump(self, obj: Any) -> bytes:
        body: bytes = super()._dump(obj)
        return body + sha256(body).digest()

    def _load_index(self) -> dict[Any, str]:
        kept: dict[Any, str] = (
            self._checked(Path(self._index_path), super()._load_index, versioned=True) or {}
        )
        return kept

    def _load_data(self, name: str) -> Any:
        return self._checked(
            Path(self._data_path(name)), lambda: super(_CheckedFile, self)._load_data(name)
        )

    def _checked(self, path: Path, load: Callable[[], Any], *, versioned: bool = False) -> Any:
        """What a file of the cache gives; None, and no file, where it is not what was written."""
        try:
            with path.open("rb") as file:
                if versioned:
                    pickle.load(file)
                content = file.read()
            if sha256(content[:-_DIGEST]).digest() == content[-_DIGEST:]:
                return load()
        except FileNotFoundError:
            return None
        except Exception:  # noqa: BLE001 - whatever damage makes of a pickle
            pass
        with suppress(OSError):
            path.unlink()
        return None


@lru_cache
def _sources(folder: Path) -> str:
    """A digest of all modules in a folder."""
    told = sha256()
    for path in sorted(folder.glob("*.py")):
        told.update(path.name.encode() + b"\0" + sha256(path.read_bytes()).digest())
    return told.hexdigest()


class _Cache(FunctionCache):
    """The cache of one function; where nothing can be written, nothing is kept."""

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        kept = self._cache_file
        stamp = (kept._source_stamp, _sources(Path(function.__code__.co_filename).parent))
        self._cache_file = _CheckedFile(kept._cache_path, self._impl.filename_base, stamp)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """What was compiled before; numba loads all that compiling needs first, which takes longer than a solve."""
        rtsys.initialize(target_context)  # kept machine code calls it
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what was compiled, if the disk lets us."""
        with suppress(OSError):
            super().save_overload(sig, data)


def njit(*, cache: bool, **options: Any) -> Callable[[Callable[..., Any]], Any]:
    """As numba's, with a cache that is checked; without one where no folder for it can be written."""

    def compiled(function: Callable[..., Any]) -> Any:
        kernel = numba.njit(**options)(function)
        if cache:
            with suppress(RuntimeError):  # no folder: every process compiles for itself
                kernel._cache = _Cache(function)
        return kernel

    return compiled
