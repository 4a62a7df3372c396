"""How a recording fails."""


class RecordingError(Exception):
    """A session folder cannot be written or read; the message says which, why, and what is safe."""
