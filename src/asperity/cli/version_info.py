"""Details of this installation for bug reports, without user names or paths."""

from collections.abc import Iterator


def about() -> Iterator[str]:
    """Return lines: platform, processors, threads of numerical libraries, and package versions."""
    import os
    import platform
    import re
    from importlib.metadata import PackageNotFoundError, requires, version

    from asperity.core import processes

    yield f"Python {platform.python_version()} ({platform.python_implementation()})"
    libc = platform.libc_ver()[0] or "no libc"
    yield f"{platform.system()} {platform.release()}, {platform.machine()}, {libc}"
    yield f"{os.cpu_count()} processors, {processes.cores()} of them for asperity"
    yield from _threads()
    for requirement in requires("asperity") or ():
        name = re.split(r"[^\w.-]", requirement, maxsplit=1)[0]
        extra = re.search(r"extra == ['\"](\w+)['\"]", requirement)
        try:
            installed = version(name)
        except PackageNotFoundError:
            installed = "not installed"
        yield f"{name} {installed}{f' (extra {extra[1]})' if extra else ''}"


def _threads() -> Iterator[str]:
    """Return a line per thread pool that numpy loads."""
    import numpy as np  # noqa: F401 - loads its thread pools
    from threadpoolctl import threadpool_info

    for pool in threadpool_info():
        pool_version = pool["version"] or "of unknown version"
        yield f"{pool['internal_api']} {pool_version}, {pool['num_threads']} threads"
