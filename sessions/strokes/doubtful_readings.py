"""Which recorded readings the device itself made doubtful, over a whole recording."""

from collections.abc import Iterator

from drivers.status import StatusCount, flagged_words
from sessions.recording.reader import Recording
from sessions.strokes.flaws import FlawName


def doubtful_readings(recording: Recording) -> Iterator[str]:
    """Yield a sentence, the flaw's name first, for each cause that makes recorded readings doubtful."""
    if recording.info is None:
        return
    count = StatusCount(recording.info.status)
    for block in recording.blocks():
        count.take(block.status)
    words = flagged_words(count.flagged)
    if faulty := count.verdicts["doubtful"]:
        yield f"{FlawName.DEVICE_FAULT}: {faulty} readings are doubtful, the device reported a fault: {words}"
    if saturated := count.verdicts["saturated"]:
        yield f"{FlawName.SATURATED}: {saturated} readings are invalid, as the device reported: {words}"
    if unsure := sum(event.data.get("off_units", 0) for event in recording.events if event.kind == "losses"):
        yield (
            f"{FlawName.RECORDING}: the last {unsure} readings of a stream are doubtful, the device was found to "
            "count in other units; leave them out"
        )
