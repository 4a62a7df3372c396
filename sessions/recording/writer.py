"""The one writer of a session: a commit every second, and immediately for every event and score."""

import sqlite3
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn, Self

from msgspec import to_builtins

from drivers.clock import Clock, RealClock
from drivers.readings import ReadingBlock
from drivers.transducer import TransducerInfo
from sessions.file_access import name_failure, remedy, sync_folder
from sessions.plan.plan import SessionPlan
from sessions.recording import schema
from sessions.recording.head import compact_json, info_to_dict, simulated_sentence, without_home
from sessions.recording.log import LoggedEvent
from sessions.recording.manifest import is_sealed
from sessions.recording.reader import Recording
from sessions.recording.recovery import fold_log, identities, rescue
from sessions.recording.schema import RecordingError
from sessions.recording.storage import RESERVE_FILE, release_reserve, take_reserve

COMMIT_EVERY_NS = 1_000_000_000
LARGEST_BLOCK = 65_536  # readings: about 6 MB, far below SQLite's limit for a row


@dataclass(frozen=True, slots=True)
class Acknowledged:
    """Amount of data safe on the disk: they survive a crash of the program and a power cut."""

    readings: int = 0
    events: int = 0
    time_ns: int = 0  # session clock at that commit


class SessionWriter:
    """Writes one session into its own folder. Data not yet counted in `acknowledged` are in memory only."""

    durable = True  # a commit waits until the data are on the disk

    def __init__(self, connection: sqlite3.Connection, path: Path, clock: Clock) -> None:
        """Use `SessionWriter.create`."""
        self._connection = connection
        self._path = path
        self._identities = identities(path)
        self.clock = clock
        self._blocks: list[ReadingBlock] = []  # handed over, not yet safe
        self._events: list[LoggedEvent] = []
        self._block_rows = 0
        self.reading_count = 0  # handed over since the beginning of the recording
        self._event_count = 0
        self.acknowledged = Acknowledged(time_ns=clock.now_ns())  # at the last commit
        self._failure: str | None = None
        self.safe: Callable[[Sequence[LoggedEvent]], None] = lambda _: None  # called with events once they are safe
        self.must_end: str | None = None  # reason to end the session now

    @classmethod
    def create(
        cls,
        folder: Path,
        plan: SessionPlan,
        info: TransducerInfo | None,
        provenance: Mapping[str, Any],
        *,
        subject_simulated: bool = False,
        clock: Clock | None = None,
        reserve: int = 0,
    ) -> Self:
        """Begin a recording in `folder`, new or empty: nothing is ever overwritten.

        `info` is None for a scores-only visit. `clock` times events and commits (the machine's when None). `reserve`
        bytes are reserved so that the end can be written on a full disk. Raises RecordingError when the folder is not
        empty or cannot be written.
        """
        simulated = simulated_sentence(info, subject_simulated)
        head = {
            "simulated": simulated or "no",
            "format": compact_json({"name": schema.FORMAT, "version": schema.FORMAT_VERSION}),
            "plan": compact_json(to_builtins(plan)),
            "transducer": compact_json(info_to_dict(info) if info else None),
            "provenance": compact_json(dict(provenance)),
        }
        path = folder / schema.LIVE_FILE
        try:
            new_folders = [parent for parent in (folder, *folder.parents) if not parent.exists()]
            folder.mkdir(parents=True, exist_ok=True)
            for parent in new_folders:
                sync_folder(parent.parent)
            if any(folder.iterdir()):
                raise schema.NotEmpty(folder)
            if reserve:
                take_reserve(folder, reserve)
            path.touch(exist_ok=False)
        except OSError as error:
            _leave(folder)
            if path.exists():  # made by another program after the check
                raise schema.NotEmpty(folder) from error
            raise RecordingError(
                f"{folder} cannot hold a recording ({error.strerror}); "
                f"{remedy(error, new=True)}, or give another folder"
            ) from error
        connection = sqlite3.connect(path, isolation_level=None)
        try:
            _prepare(connection, head, durable=cls.durable)
        except sqlite3.Error as error:
            connection.close()
            for file in folder.glob(f"{schema.LIVE_FILE}*"):  # nothing is recorded yet
                file.unlink()
            _leave(folder)
            raise RecordingError(
                f"{path} cannot be begun ({error}); {remedy(error)}, or give a folder on a local disk"
            ) from error
        sync_folder(folder)
        return cls(connection, path, clock or RealClock())

    @classmethod
    def open(cls, folder: Path, clock: Clock, *, reserve: int = 0) -> Self:
        """Continue the interrupted recording in `folder`: numbers of blocks and events continue.

        Raises RecordingError when it is sealed, while another program uses it, or when it cannot be written.
        """
        if is_sealed(folder):
            raise RecordingError(f"{folder} is sealed: nothing is added to it; begin a new session")
        fold_log(folder, Recording.open(folder).events)
        path = folder / schema.LIVE_FILE
        with name_failure(RecordingError, f"the recording in {folder} cannot be continued"):
            if reserve:
                take_reserve(folder, reserve)
        connection = sqlite3.connect(path, isolation_level=None, timeout=0.5)
        try:
            _make_durable(connection)
            writer = cls(connection, path, clock)
            (writer._block_rows, writer.reading_count) = connection.execute(
                "SELECT coalesce(max(rowid), 0), coalesce(sum(readings), 0) FROM blocks"
            ).fetchone()
            (writer._event_count,) = connection.execute("SELECT coalesce(max(rowid), 0) FROM events").fetchone()
        except sqlite3.Error as error:
            connection.close()
            release_reserve(folder)
            raise RecordingError(f"the recording in {folder} cannot be continued ({error}); {remedy(error)}") from error
        writer.acknowledged = Acknowledged(writer.reading_count, writer._event_count, clock.now_ns())
        return writer

    @property
    def folder(self) -> Path:
        """Return the session's folder."""
        return self._path.parent

    @property
    def pending_count(self) -> int:
        """Return the number of readings handed over that are not safe yet."""
        return self.reading_count - self.acknowledged.readings

    def limit(self, size: int) -> None:
        """Limit the file to `size` bytes, as on a full disk."""
        (page,) = self._connection.execute("PRAGMA page_size").fetchone()
        self._connection.execute(f"PRAGMA max_page_count={size // page}")

    def readings(self, block: ReadingBlock) -> None:
        """Take readings over; commit a second after the last commit. Raises RecordingError when writing fails."""
        self._check()
        if len(block):
            self._blocks.append(block)
            self.reading_count += len(block)
        if self.clock.now_ns() - self.acknowledged.time_ns >= COMMIT_EVERY_NS or self.pending_count >= LARGEST_BLOCK:
            self.commit()

    def event(
        self,
        kind: str,
        trial: int | None = None,
        data: Mapping[str, Any] | None = None,
        *,
        time_ns: int | None = None,
        commit: bool = True,
    ) -> LoggedEvent:
        """Write an event after all readings handed over before it; on return both are safe.

        Without `commit` both wait for the next one. `time_ns` [session clock] is now by default. Raises RecordingError.
        """
        self._check()
        instant_ns = self.instant_ns(kind, trial) if time_ns is None else time_ns
        event = LoggedEvent(self._event_count + 1, instant_ns, kind, trial, self.reading_count, dict(data or {}))
        schema.event_row(event)  # data that JSON or UTF-8 cannot hold fail here, not in a commit
        self._events.append(event)
        self._event_count += 1
        if commit:
            self.commit()
        return event

    def instant_ns(self, _kind: str, _trial: int | None, /) -> int:
        """Return the instant of an event given without one [ns, session clock]."""
        return self.clock.now_ns()

    def commit(self) -> Acknowledged:
        """Commit everything handed over, and return how much is safe.

        Data are safe only in a file that can be found again. Where its name is gone or belongs to another file,
        everything is written to a new folder, the new `folder`, and `must_end` is set. Raises RecordingError.
        """
        self._check()
        now_ns = self.clock.now_ns()
        try:
            rows = self._write_waiting()
        except sqlite3.Error as error:
            rows = self._written_again(error)
        if self._lost_sight():
            self._rescue()
        self._block_rows = rows
        self._blocks.clear()
        safe, self._events = self._events, []
        self.acknowledged = Acknowledged(self.reading_count, self._event_count, now_ns)
        if safe:
            self.safe(safe)
        return self.acknowledged

    def close(self) -> None:
        """Commit, fold the write-ahead log into the file and close it. Harmless when repeated."""
        try:
            if self._failure is None:
                self.commit()
                self._failure = "it was closed"
                # Readers then need a single file. Where folding the log fails, the log stays.
                with suppress(sqlite3.Error):
                    self._connection.execute("PRAGMA journal_mode=DELETE")
        finally:
            self._connection.close()
            release_reserve(self.folder)

    def _write_waiting(self) -> int:
        """Write pending data in one transaction, and return the number of the last row of readings."""
        if not self._blocks and not self._events:
            return self._block_rows
        self._connection.execute("BEGIN IMMEDIATE")
        try:
            rows = self._insert_blocks()
            for event in self._events:
                self._connection.execute("INSERT INTO events VALUES (?,?,?,?,?,?,?)", schema.event_row(event))
            self._connection.execute("COMMIT")
        except BaseException:
            with suppress(sqlite3.Error):
                self._connection.execute("ROLLBACK")
            raise
        return rows

    def _written_again(self, error: sqlite3.Error) -> int:
        """Retry a failed commit: in another folder, or in the reserved space."""
        if self._lost_sight():
            self._rescue()
        elif self.must_end is not None or not (self.folder / RESERVE_FILE).exists():
            self._fail(error)
        else:
            self.must_end = (
                f"the disk took no more ({error}); all that was measured is safe: {remedy(error)}, and resume"
            )
            self.give_back_reserve()
        try:
            return self._write_waiting()
        except sqlite3.Error as failure:
            self._fail(failure)

    def _lost_sight(self) -> bool:
        """Say whether the names of the live file and its log are gone, or name other files than the open ones."""
        return identities(self._path) != self._identities

    def _rescue(self) -> None:
        """Continue in a new folder with a copy of the open file. Raises RecordingError where this fails."""
        path, self._failure = self._path, "it was removed, renamed or replaced"
        self._path = rescue(self._connection, path)
        self._connection.close()
        self._connection = sqlite3.connect(self._path, isolation_level=None)
        try:
            _make_durable(self._connection)
        except sqlite3.Error as error:
            self._fail(error)
        self._identities, self._failure = identities(self._path), None
        self.must_end = (
            f"{without_home(str(path))} was removed, renamed or replaced; all that was measured is safe in"
            f" {without_home(str(self.folder))}: resume the session there"
        )

    def give_back_reserve(self) -> None:
        """Release the reserve."""
        release_reserve(self.folder)

    def _insert_blocks(self) -> int:
        """Insert the pending readings in rows of at most LARGEST_BLOCK, and return the number of the last row."""
        rows = self._block_rows
        pending = ReadingBlock.concatenate(self._blocks)
        for start in range(0, len(pending), LARGEST_BLOCK):
            block = pending.between(start, start + LARGEST_BLOCK)
            rows += 1
            columns = schema.blobs(block)
            values = (rows, *schema.summary(block), *columns, schema.blobs_crc(columns))
            self._connection.execute(f"INSERT INTO blocks VALUES ({','.join('?' * len(values))})", values)
        return rows

    def _fail(self, error: sqlite3.Error) -> NoReturn:
        safe = self.acknowledged
        self._failure = (
            f"the disk took no more ({error}): the first {safe.readings} readings and {safe.events} events are safe; "
            f"{remedy(error)} and resume"
        )
        raise schema.DiskRefused(f"{self._path}: {self._failure}", f"({error}); {remedy(error)}") from error

    def _check(self) -> None:
        """Raise RecordingError when the writer has failed or is closed."""
        if self._failure is not None:
            raise RecordingError(f"{self._path}: {self._failure}")


class FleetingWriter(SessionWriter):
    """Writes a simulated or replayed session without waiting for the disk: a power cut may lose all of it."""

    durable = False


def _leave(folder: Path) -> None:
    """Remove the reserve and empty folder of a recording that could not be begun."""
    release_reserve(folder)
    with suppress(OSError):  # where it is not empty
        folder.rmdir()


def _prepare(connection: sqlite3.Connection, head: Mapping[str, str], *, durable: bool) -> None:
    connection.execute(f"PRAGMA application_id={schema.APPLICATION_ID}")
    _make_durable(connection)
    connection.execute("BEGIN IMMEDIATE")
    for table in schema.TABLES:
        connection.execute(table)
    for number, (name, value) in enumerate(head.items(), 1):
        connection.execute("INSERT INTO head VALUES (?,?,?,?)", (number, name, value, schema.text_crc(value)))
    connection.execute(f"PRAGMA user_version={schema.FORMAT_VERSION}")
    connection.execute("COMMIT")
    if not durable:
        connection.execute("PRAGMA synchronous=OFF")


def _make_durable(connection: sqlite3.Connection) -> None:
    """Make every commit survive a crash of the program and a power cut."""
    (mode,) = connection.execute("PRAGMA journal_mode=WAL").fetchone()
    if mode != "wal":
        raise sqlite3.OperationalError(f"the disk allows no write-ahead log, journal mode is {mode}")
    connection.execute("PRAGMA synchronous=FULL")
    connection.execute("SELECT count(*) FROM sqlite_master").fetchone()  # the log is there from the first reading on
