"""Recordings: read from files, with facts, and checked."""

from asperity.recording.check import Quality, check_recording
from asperity.recording.model import Fact, OpenRecording, Recording
from asperity.recording.read import open_channels, open_recording, read_recording

__all__ = [
    "Fact",
    "OpenRecording",
    "Quality",
    "Recording",
    "check_recording",
    "open_channels",
    "open_recording",
    "read_recording",
]
