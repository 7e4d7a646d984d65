"""Cleanup of sessions whose visitor has left, soon, because their models are large."""

import ctypes
import gc
from collections.abc import Callable, Iterable
from typing import Any
from weakref import WeakSet

CLEANUP_MS = 1000  # interval of the cleanup
DISCONNECT_MS = 4000.0  # time for reconnecting; a browser retries after one second


def freeze_objects() -> None:
    """Exclude all current objects from garbage collection, so that it only examines sessions."""
    gc.collect()
    gc.freeze()


class SessionSweeper:
    """Expires sessions whose visitor has left, and frees their memory.

    Parameters
    ----------
    sessions : returns the current sessions of Bokeh's server
    """

    def __init__(self, sessions: Callable[[], Iterable[Any]]) -> None:
        self._sessions = sessions
        self._connected: WeakSet[Any] = WeakSet()  # sessions that have had a connection
        self._names: set[str] = set()

    def sweep(self) -> None:
        """Expire disconnected sessions; collect garbage if a session has ended."""
        sessions = list(self._sessions())
        for session in sessions:
            if session.connection_count > 0:
                self._connected.add(session)
            elif (
                session in self._connected
                and session.milliseconds_since_last_unsubscribe > DISCONNECT_MS
            ):
                session.request_expiration()
        names = {str(session.id) for session in sessions}
        if self._names - names:
            gc.collect()
            _trim()
        self._names = names


def _trim() -> None:
    """Return freed memory to the system, if the C library supports it."""
    try:
        trim = ctypes.CDLL(None).malloc_trim
    except (AttributeError, OSError, TypeError):
        return
    trim(0)
