"""The record of a session on disk: written as it happens, sealed when it ends, readable ever after."""

from sessions.recording.head import Setting, provenance
from sessions.recording.log import LoggedEvent, Take, TrialRecord
from sessions.recording.reader import Recording
from sessions.recording.schema import RecordingError
from sessions.recording.writer import Acknowledged, FleetingWriter, SessionWriter

__all__ = [
    "Acknowledged",
    "FleetingWriter",
    "LoggedEvent",
    "Recording",
    "RecordingError",
    "SessionWriter",
    "Setting",
    "Take",
    "TrialRecord",
    "provenance",
]
