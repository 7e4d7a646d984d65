"""Visits that have gone give their memory back: soon, as their models are large, and while nobody waits for it."""

import ctypes
import gc
from collections.abc import Callable, Iterable
from typing import Any
from weakref import WeakSet

LOOK_MS = 1000  # between two looks at who is there
# after which one whose connection was lost is not waited for: a browser tries anew after a second
GONE_MS = 4000.0


def settle() -> None:
    """Take all there is now for good, so that looking for what can go is looking at what visits brought."""
    gc.collect()
    gc.freeze()


class Sweeper:
    """Sends sessions away whose visitor has gone, and hands on what they leave.

    Parameters
    ----------
    sessions : those that there are, as Bokeh's server has them
    """

    def __init__(self, sessions: Callable[[], Iterable[Any]]) -> None:
        self._sessions = sessions
        self._met: WeakSet[Any] = (
            WeakSet()
        )  # those whose visitor has come; the others' may still be on the way
        self._here: set[str] = set()

    def look(self) -> None:
        """See who has gone, and sweep where somebody has."""
        here = list(self._sessions())
        for session in here:
            if session.connection_count > 0:
                self._met.add(session)
            elif session in self._met and session.milliseconds_since_last_unsubscribe > GONE_MS:
                session.request_expiration()
        names = {str(session.id) for session in here}
        if self._here - names:
            gc.collect()
            _trim()
        self._here = names


def _trim() -> None:
    """Let the C library give freed memory back to the system, where it is one that can be asked to."""
    try:
        trim = ctypes.CDLL(None).malloc_trim
    except (AttributeError, OSError, TypeError):
        return
    trim(0)
