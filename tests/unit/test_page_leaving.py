"""Disconnected sessions, and only those, expire soon after connection loss and are cleaned up."""

import gc
import weakref

import pytest

pytest.importorskip("panel", reason="the extra page is not installed")

from asperity.app.serving.session_cleanup import DISCONNECT_MS, SessionSweeper


class Session:
    """Stub of Bokeh's session."""

    def __init__(self, name, connections=1):
        self.id, self.connection_count = name, connections
        self.milliseconds_since_last_unsubscribe, self.expired = 1e6, False

    def request_expiration(self):
        self.expired = True


def test_only_disconnected_sessions_are_expired():
    connected, disconnected, connecting = (
        Session("connected"),
        Session("disconnected"),
        Session("connecting", connections=0),
    )
    sweeper = SessionSweeper(lambda: [connected, disconnected, connecting])
    sweeper.sweep()
    disconnected.connection_count = 0
    disconnected.milliseconds_since_last_unsubscribe = DISCONNECT_MS - 1.0
    sweeper.sweep()
    assert not disconnected.expired  # a browser reconnects after a second
    disconnected.milliseconds_since_last_unsubscribe = DISCONNECT_MS + 1.0
    sweeper.sweep()
    assert (connected.expired, disconnected.expired, connecting.expired) == (
        False,
        True,
        False,
    )


def test_resources_of_a_closed_session_are_freed_after_it():
    sessions = [Session("one"), Session("two")]
    sweeper = SessionSweeper(lambda: sessions)
    remainder = Session("remainder")
    remainder.cycle = remainder  # a reference cycle that only garbage collection frees
    reference = weakref.ref(remainder)
    del remainder
    gc.disable()
    try:
        sweeper.sweep()
        assert reference() is not None  # no session has ended
        sessions[1] = Session("three")
        sweeper.sweep()
        assert reference() is None
    finally:
        gc.enable()
