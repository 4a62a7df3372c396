"""Readings of a transducer that streams, for tests."""

from drivers.readings import ReadingBlock


def read_until(transducer, enough):
    """Return all readings up to when `enough()` says so, and the rest after a stop."""
    blocks = []
    while not enough():
        blocks.append(transducer.read(0.05))
    transducer.stop()
    return ReadingBlock.concatenate([*blocks, transducer.read(0.0)])
