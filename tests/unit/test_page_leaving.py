"""Visits that have gone: sent away soon after their connection was lost, swept after, and no
others.
"""

import gc
import weakref

import pytest

pytest.importorskip("panel", reason="the extra page is not installed")

from asperity.app.session_cleanup import DISCONNECT_MS, SessionSweeper


class Session:
    """Stands in for Bokeh's."""

    def __init__(self, name, connections=1):
        self.id, self.connection_count = name, connections
        self.milliseconds_since_last_unsubscribe, self.sent_away = 1e6, False

    def request_expiration(self):
        self.sent_away = True


def test_who_has_gone_is_sent_away_and_who_is_there_or_on_the_way_is_not():
    there, gone, coming = Session("there"), Session("gone"), Session("coming", connections=0)
    sweeper = SessionSweeper(lambda: [there, gone, coming])
    sweeper.sweep()
    gone.connection_count = 0
    gone.milliseconds_since_last_unsubscribe = DISCONNECT_MS - 1.0
    sweeper.sweep()
    assert not gone.sent_away  # a browser tries anew after a second
    gone.milliseconds_since_last_unsubscribe = DISCONNECT_MS + 1.0
    sweeper.sweep()
    assert (there.sent_away, gone.sent_away, coming.sent_away) == (False, True, False)


def test_what_a_session_leaves_is_swept_when_it_has_left():
    sessions = [Session("one"), Session("two")]
    sweeper = SessionSweeper(lambda: sessions)
    left = Session("what is left")
    left.itself = left  # which only a sweep frees
    watched = weakref.ref(left)
    del left
    gc.disable()
    try:
        sweeper.sweep()
        assert watched() is not None  # nobody has left
        sessions[1] = Session("three")
        sweeper.sweep()
        assert watched() is None
    finally:
        gc.enable()
