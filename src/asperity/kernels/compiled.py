"""numba compilation with a verified on-disk cache; kernels recompile if it is damaged or absent.

numba executes the machine code in its cache unchecked and raises on malformed files. Here a digest
is appended to every file, and a file that does not match it is deleted. This is no protection
against an attacker with write access to the folder.

A kernel inlines the kernels that it calls and the constants of their modules, so it is stale when
any module of the folder has changed. numba numbers its data files, and two processes may use one
number for two signatures: every entry therefore stores its source stamp and its key. The cache is
next to the package, in the user's cache, or in the folder NUMBA_CACHE_DIR.
"""

import pickle
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache
from hashlib import sha256
from operator import methodcaller
from pathlib import Path
from typing import Any, TypeVar

from asperity.core.errors import BadInput

try:
    import numba
    from numba.core.caching import FunctionCache, IndexDataCacheFile
    from numba.core.runtime.nrt import rtsys
except ValueError as error:  # such as NUMBA_NUM_THREADS=0
    raise BadInput(
        f"numba cannot be loaded ({error}); correct the environment variables NUMBA_..."
    ) from None

Kernel = TypeVar("Kernel", bound=Callable[..., object])

_DIGEST = 32  # bytes appended to each file; pickle ignores trailing bytes


class _CheckedFile(IndexDataCacheFile):
    """Disk cache of one function."""

    def save(self, key: object, data: object) -> None:
        """Store compiled code with its source stamp and its key."""
        super().save(key, (self._source_stamp, key, data))

    def load(self, key: object) -> object:
        """Return the compiled code of a key; None where the entry is missing or another one."""
        stamp, known, data = super().load(key) or (None, None, None)
        return data if (stamp, known) == (self._source_stamp, key) else None

    def _dump(self, obj: object) -> bytes:
        body: bytes = super()._dump(obj)
        return body + sha256(body).digest()

    def _load_index(self) -> dict[object, str]:
        index: dict[object, str] = (
            self._checked(Path(self._index_path), super()._load_index, versioned=True) or {}
        )
        return index

    def _load_data(self, name: str) -> object:
        return self._checked(
            Path(self._data_path(name)), lambda: super(_CheckedFile, self)._load_data(name)
        )

    def _checked(self, path: Path, load: Callable[[], Any], *, versioned: bool = False) -> Any:
        """Load a cache file; delete it and return None if its digest does not match."""
        try:
            with path.open("rb") as file:
                if versioned:
                    pickle.load(file)
                content = file.read()
            if sha256(content[:-_DIGEST]).digest() == content[-_DIGEST:]:
                return load()
        except FileNotFoundError:
            return None
        except Exception:  # noqa: BLE001 - a damaged pickle can raise anything
            pass
        with suppress(OSError):
            path.unlink()
        return None


@lru_cache
def _sources(folder: Path) -> str:
    """Return a digest of all modules in a folder."""
    digest = sha256()
    for path in sorted(folder.glob("*.py")):
        digest.update(path.name.encode() + b"\0" + sha256(path.read_bytes()).digest())
    return digest.hexdigest()


class _Cache(FunctionCache):
    """Cache of one function; disabled where the folder is not writable."""

    def __init__(self, function: Callable[..., object]) -> None:
        super().__init__(function)
        default = self._cache_file
        stamp = (default._source_stamp, _sources(Path(function.__code__.co_filename).parent))
        self._cache_file = _CheckedFile(default._cache_path, self._impl.filename_base, stamp)

    def load_overload(self, sig: object, target_context: object) -> object:
        """Load compiled code without importing the compiler.

        numba loads the whole compiler first, which takes longer than a solve.
        """
        rtsys.initialize(target_context)  # cached machine code calls the runtime
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)

    def save_overload(self, sig: object, data: object) -> None:
        """Store compiled code if the disk allows it."""
        with suppress(OSError):
            super().save_overload(sig, data)


def njit(*, cache: bool, **options: Any) -> Callable[[Kernel], Kernel]:
    """Compile like njit of numba, with a verified cache, and divide like NumPy.

    A division by zero gives inf or nan, which ends a search as not converged, and raises nothing.
    The kernel is compiled without a cache where no folder for it is writable.
    """

    def compiled(function: Kernel) -> Kernel:
        kernel: Any = numba.njit(error_model="numpy", **options)(function)
        if cache:
            with suppress(RuntimeError):  # no writable folder: every process compiles anew
                kernel._cache = _Cache(function)
        typed: Kernel = kernel
        return typed

    return compiled


def compile_for(kernel: Callable[..., object], arguments: tuple[object, ...]) -> None:
    """Compile a kernel for the types of arguments, or load it from the cache."""
    methodcaller("compile", tuple(map(numba.typeof, arguments)))(kernel)


def is_cached(kernel: object) -> bool:
    """Return True if compiled code of a kernel is stored for other processes."""
    return isinstance(getattr(kernel, "_cache", None), _Cache)


def is_compiled(kernel: object) -> bool:
    """Return True if a process has stored compiled code of a kernel in this version."""
    cache = getattr(kernel, "_cache", None)
    return isinstance(cache, _Cache) and bool(cache._cache_file._load_index())
