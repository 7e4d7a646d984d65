"""Series of recordings: listened to, put in order, judged, and watched as they grow."""

from asperity.tracking.track import Track, Tracked, track_recordings

__all__ = ["Track", "Tracked", "track_recordings"]
