"""What a crash left in the log beside a live file, folded into it."""

import sqlite3
from contextlib import closing

from sessions.recording.errors import RecordingError
from sessions.recording.log import LoggedEvent
from sessions.recording.reader import Recording, torn_log
from sessions.recording.schema import LIVE_FILE, event_row


def fold_log(crashed: Recording) -> None:
    """Fold a log that a crash left into the live file. Raises RecordingError while somebody still writes.

    Folding loses sight of a torn tail, so that an event is added to tell of it.
    """
    live = crashed.folder / LIVE_FILE
    if not live.with_name(f"{live.name}-wal").exists():
        return
    number, time_ns, readings = (
        (last.number, last.time_ns, last.readings) if (last := next(reversed(crashed.events), None)) else (0, 0, 0)
    )
    torn = [
        LoggedEvent(number + i, time_ns, "log_torn", None, readings, {"sentence": sentence})
        for i, sentence in enumerate(torn_log(live), 1)
    ]
    try:
        with closing(sqlite3.connect(live, timeout=0.5, isolation_level=None)) as connection:
            for event in torn:
                connection.execute("INSERT INTO events VALUES (?,?,?,?,?,?,?)", event_row(event))
            connection.execute("PRAGMA journal_mode=DELETE")
    except sqlite3.Error as error:
        raise RecordingError(
            f"{live} is in use ({error}); end the program that still writes it, or reads it"
        ) from error
