"""What a bug report needs to know of this installation, and nothing of who or where: `asperity --version --verbose`."""

from collections.abc import Iterator


def about() -> Iterator[str]:
    """Lines: platform, processors, threads of libraries that compute, versions of what asperity needs and can use."""
    import os
    import platform
    import re
    from importlib.metadata import PackageNotFoundError, requires, version

    from asperity.core import processes

    yield f"Python {platform.python_version()} ({platform.python_implementation()})"
    yield f"{platform.system()} {platform.release()}, {platform.machine()}, {platform.libc_ver()[0] or 'no libc'}"
    yield f"{os.cpu_count()} processors, {processes.cores()} of them for asperity"
    yield from _threads()
    for requirement in requires("asperity") or ():
        name = re.split(r"[^\w.-]", requirement, maxsplit=1)[0]
        extra = re.search(r"extra == ['\"](\w+)['\"]", requirement)
        try:
            found = version(name)
        except PackageNotFoundError:
            found = "not installed"
        yield f"{name} {found}{f' (extra {extra[1]})' if extra else ''}"


def _threads() -> Iterator[str]:
    """A line for each pool of threads that numpy brings."""
    import numpy as np  # noqa: F401 - so that its library is there to be asked
    from threadpoolctl import threadpool_info

    for pool in threadpool_info():
        yield f"{pool['internal_api']} {pool['version'] or 'of unknown version'}, {pool['num_threads']} threads"
