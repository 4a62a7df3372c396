"""What becomes of a live file: written anew where its name is gone, and the log that a crash left folded into it."""

import itertools
import sqlite3
import tempfile
from collections.abc import Iterator
from contextlib import closing, suppress
from pathlib import Path

from sessions.file_access import sync_folder
from sessions.recording.log import LoggedEvent
from sessions.recording.reader import Recording, torn_log
from sessions.recording.schema import LIVE_FILE, RecordingError, event_row

Identity = tuple[int, int] | None  # device and inode, as `os.stat` tells; None where there is no such file
SIDES = ("", "-wal")  # the live file, and its log, which holds the newest commits


def identities(path: Path) -> tuple[Identity, ...]:
    """Return which files lie at the names of a live file and of its write-ahead log."""
    return tuple(_identity(path.with_name(path.name + side)) for side in SIDES)


def rescued(source: sqlite3.Connection, path: Path) -> Path:
    """Write all that an open live file holds into a new folder, and return the path of the file there.

    SQLite reads by the files it holds open, so that names which are gone or name other files do not matter. The folder
    is made beside that of `path`, in the user's home or in the system's temporary folder, the first that takes it.
    Raises RecordingError where none does.
    """
    why: list[str] = []
    for folder in _new_folders(path.absolute().parent):
        new = folder / path.name
        try:
            folder.mkdir(parents=True)
            with closing(sqlite3.connect(new, isolation_level=None)) as target:
                source.backup(target)
            for place in (folder, folder.parent):
                sync_folder(place)
        except (OSError, sqlite3.Error) as error:
            why.append(f"{folder}: {error}")
            with suppress(OSError):
                new.unlink(missing_ok=True)
                folder.rmdir()
        else:
            return new
    raise RecordingError(
        f"{path} was removed, renamed or replaced, and what it held could be written nowhere else ({'; '.join(why)});"
        " the session has ended: look for the folder under another name or in the trash"
    )


def _identity(path: Path) -> Identity:
    try:
        there = path.stat()
    except OSError:
        return None
    return there.st_dev, there.st_ino


def _new_folders(session: Path) -> Iterator[Path]:
    """Yield a folder that is not there yet in each place, the best place first."""
    for place in (session.parent, Path.home(), Path(tempfile.gettempdir())):
        numbers = itertools.chain([""], (f"-{number}" for number in itertools.count(2)))
        names = (place / f"{session.name}-rescued{number}" for number in numbers)
        yield next(folder for folder in names if not folder.exists())


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
