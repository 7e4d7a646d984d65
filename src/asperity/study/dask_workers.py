"""Executor on the workers of a dask scheduler."""

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from typing import Any

from asperity.core.errors import BadInput, install_text

DASK_WAIT_S = 10.0


@contextmanager
def dask_executor(address: str) -> Iterator[Executor]:
    """Provide the workers of a dask scheduler, such as tcp://10.0.0.1:8786.

    Raises
    ------
    BadInput
        if dask.distributed is not installed, or no scheduler answers at the address.
    """
    try:
        from distributed import Client
    except ModuleNotFoundError:
        raise BadInput(f"a dask executor needs dask.distributed; {install_text('study')}") from None
    try:
        client: Any = Client(address, timeout=DASK_WAIT_S)  # type: ignore[no-untyped-call]
    except (OSError, ValueError, TypeError) as error:
        raise BadInput(
            f"no dask scheduler answers at {address} ({type(error).__name__}); check the address"
        ) from None
    with client:
        try:
            client.wait_for_workers(1, timeout=DASK_WAIT_S)
        except TimeoutError:
            raise BadInput(
                f"the dask scheduler at {address} has no workers; start some with dask worker"
            ) from None
        yield client.get_executor(pure=False)
