"""Reading of a recording from disk without altering it, whole or torn."""

import errno
import shutil
import sqlite3
import tempfile
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from drivers.readings import ReadingBlock
from drivers.transducer import TransducerInfo, flagged_words
from sessions.file_access import DATABASE_FAILURES, as_type, json_value, limit_values, name_failure
from sessions.plan.orders import with_mounted_stimuli
from sessions.plan.plan import SessionPlan
from sessions.recording import schema
from sessions.recording.head import Provenance, info_from_dict
from sessions.recording.log import LoggedEvent, TrialRecord, event_data, health_of, trial_records
from sessions.recording.recovery import torn_log
from sessions.recording.schema import RecordingError

# Kinds of events that sealing, resuming and restoring add, each with a sentence on what is missing.
TELL_LOSSES = frozenset({"log_torn", "not_restored"})
# The meaning of the counts in a "losses" event for users of the readings; dropping repeated ones does no harm.
LOSS_SENTENCES = {
    "lost": "{} readings never arrived",
    "malformed": "{} records were malformed and left out",
    "stalled": "{} readings came while the device's counter stood still",
    "restarted": "how often the device began to count anew: {}",
    "saturated": "the device called {} readings invalid, as when it is saturated",
    "doubtful": "the device reported a fault with {} readings: they are doubtful",
    "noted": "the status of {} readings says something, though nothing against their values",
    "off_units": "{} readings came when the device may have counted in other units already: they are doubtful",
    "off_rate": "how often the device's rate was found to be another than set, or than before: {}",
}


@dataclass(frozen=True, eq=False)
class Recording:
    """One session: head and event log in memory, readings read from the file on request."""

    folder: Path
    plan: SessionPlan
    info: TransducerInfo | None  # None for a scores-only visit
    simulated_sentence: str | None  # heads every file made from this recording when something was simulated
    provenance: Mapping[str, Any]
    events: tuple[LoggedEvent, ...]
    trials: tuple[TrialRecord, ...]  # every planned trial, in the plan's order
    head: Mapping[str, Any]  # plan and transducer as in the file, without additions of later versions
    log_is_whole: bool  # no event is damaged or missing
    _log_losses: tuple[str, ...]

    @staticmethod
    def open(folder: Path) -> "Recording":
        """Open a session folder, sealed or not, also while it is being written and after a crash.

        Raises RecordingError for a folder without a recording, a later format, or a damaged head.
        """
        path = folder / schema.LIVE_FILE
        with name_failure(RecordingError, f"{path} cannot be read"):  # in a folder without permission to read
            exists = path.is_file()
        if not exists:
            advice = f"give a session folder{_copy_of(folder)}"
            if folder.is_file() and (folder.parent / schema.LIVE_FILE).is_file():
                advice = f"give the folder that it lies in, {folder.parent}"
            raise RecordingError(f"{folder} holds no recording: there is no {schema.LIVE_FILE}; {advice}")
        damage: list[str] = []
        with name_failure(RecordingError, f"{path} cannot be read", _copy_of(folder), DATABASE_FAILURES):
            tail_losses = tuple(torn_log(path))
            with _connect(path) as connection:
                head = _head(path, connection)
                events = _events(connection, damage)
        losses = [*tail_losses, *damage]
        losses += [event.data["sentence"] for event in events if event.kind in TELL_LOSSES]
        if _end(events) is None:
            losses.append("the session has no end: it was cut short, or is still running")
        try:
            codes = {e.trial: e.data["code"] for e in events if e.kind == "stimulus_mounted"}  # last of each trial
            plan = with_mounted_stimuli(as_type(head["plan"], SessionPlan), codes)
            info = info_from_dict(head["transducer"]) if head["transducer"] else None
            as_type(head["provenance"], Provenance)
            simulated = None if head["simulated"] == "no" else head["simulated"]
        except (ValueError, KeyError, TypeError) as error:
            advice = f"restore it from a copy{_copy_of(folder)}"
            raise RecordingError(f"{path}: its head is damaged ({error}); {advice}") from error
        trials = trial_records(plan, events)
        provenance, log_is_whole = head["provenance"], not damage
        return Recording(folder, plan, info, simulated, provenance, events, trials, head, log_is_whole, tuple(losses))

    @property
    def simulated(self) -> bool:
        """Say whether transducer or subject were simulated."""
        return self.simulated_sentence is not None

    @property
    def mark(self) -> dict[str, Any]:
        """Return the mark at the top of a document made from this recording; empty without simulation."""
        return {"SIMULATED": self.simulated_sentence} if self.simulated_sentence else {}

    @property
    def end(self) -> Mapping[str, Any] | None:
        """Return the data of the session's end; None where it was cut short, or is still running."""
        return _end(self.events)

    @cached_property
    def losses(self) -> tuple[str, ...]:
        """Return a sentence for each loss or damage in the file; reads the whole file once."""
        problems = list(self._log_losses)
        for _ in self.blocks(problems):
            pass
        return tuple(problems)

    @property
    def flaws(self) -> tuple[str, ...]:
        """Return a sentence for each problem during recording, from the event log."""
        losses = [event for event in self.events if event.kind == "losses"]
        health = health_of(losses)
        counts = ((sentence, getattr(health, name)) for name, sentence in LOSS_SENTENCES.items())
        sentences = [sentence.format(count) for sentence, count in counts if count]
        sentences += [f"what their status said: {flagged_words(health.flagged)}"] if health.flagged else []
        rates = [event.data["rate_words"] for event in losses if "rate_words" in event.data]
        sentences += [f"the rate that was found: {text}" for text in dict.fromkeys(rates)]
        for record in self.trials:
            limit = self.plan.stroke_limit(record.trial)
            if record.take and record.take.strokes > limit:
                number = "one was" if limit == 1 else f"{limit} were"
                strokes = f"{record.take.strokes} strokes"
                sentences.append(f"trial {record.trial.number} holds {strokes} where {number} asked for")
        return tuple(sentences)

    def trial(self, number: int) -> TrialRecord:
        """Return the record of the trial with this number. Raises KeyError when the plan has none."""
        record = next((record for record in self.trials if record.trial.number == number), None)
        if record is None:
            raise KeyError(f"the plan of {self.folder} has no trial {number}")
        return record

    def readings(self, trial: int | None = None) -> ReadingBlock:
        """Return all readings, or those of the take of `trial` that counts (none where no take does)."""
        if trial is not None:
            start_ns, stop_ns = self.trial(trial).start_ns, self.trial(trial).stop_ns
            return ReadingBlock.empty() if start_ns is None else self.readings_between(start_ns, stop_ns)
        # Each block is copied straight to its place: joining blocks would hold all readings twice.
        path = self.folder / schema.LIVE_FILE
        bytes_held = _size(path) + _size(_side_file(path, "-wal"))
        capacity = min(bytes_held // schema.BYTES_A_READING, self._row_capacity())
        shapes = {name: (capacity, 6) if name == "raw" else (capacity,) for name in schema.COLUMNS}
        buffers = {name: np.empty(shapes[name], dtype) for name, dtype in schema.COLUMNS.items()}
        count = 0
        for block in self.blocks():
            if count + len(block) > capacity:  # committed after the count
                break
            for name, column in buffers.items():
                column[count : count + len(block)] = getattr(block, name)
            count += len(block)
        columns: Any = {name: column[:count] for name, column in buffers.items()}
        return ReadingBlock(**columns)

    def _row_capacity(self) -> int:
        """Return the number of readings from the sizes of the rows; a damaged row may claim too many."""
        try:
            with _connect(self.folder / schema.LIVE_FILE) as connection:
                (size,) = connection.execute("SELECT coalesce(sum(length(sequence)), 0) FROM blocks").fetchone()
        except DATABASE_FAILURES:
            return sum(len(block) for block in self.blocks())
        return size // np.dtype(schema.COLUMNS["sequence"]).itemsize

    def readings_between(self, start_ns: int, stop_ns: int | None) -> ReadingBlock:
        """Return the readings received from `start_ns` up to, not including, `stop_ns` (None: to the end) [ns]."""
        blocks: list[ReadingBlock] = []
        for block in self.blocks(span=(start_ns, stop_ns)):
            inside = block.received_ns >= start_ns
            if stop_ns is not None:
                inside &= block.received_ns < stop_ns
            blocks.append(block.where(inside))
        return ReadingBlock.concatenate(blocks)

    def last_block(self) -> ReadingBlock:
        """Return the last block of readings (an empty one where there is none). Raises RecordingError when damaged."""
        path = self.folder / schema.LIVE_FILE
        try:
            with _connect(path) as connection:
                (last_row,) = connection.execute("SELECT max(rowid) FROM blocks").fetchone()
                return ReadingBlock.empty() if last_row is None else _block(connection, last_row)
        except (ValueError, TypeError, OSError, sqlite3.DatabaseError) as error:
            raise RecordingError(f"{path}: the last block of readings is damaged ({error})") from error

    def blocks(
        self, losses: list[str] | None = None, span: tuple[int, int | None] | None = None
    ) -> Generator[ReadingBlock]:
        """Yield the readings block by block as they were committed; damaged blocks are left out and named in `losses`.

        `span` limits it to blocks that hold readings received in that span of the session clock [ns].
        """
        damage: list[str] = [] if losses is None else losses
        path = self.folder / schema.LIVE_FILE
        try:
            with _connect(path) as connection:
                yield from _blocks(connection, damage, span)
        except DATABASE_FAILURES as error:
            damage.append(f"{schema.LIVE_FILE} cannot be read to its end ({error})")

    def blocks_with_progress(self, progress: Callable[[float], None]) -> Iterator[ReadingBlock]:
        """Yield the readings block by block, and report the part done, 0 to 1, after each."""
        expected = max((event.readings for event in self.events), default=0) or 1
        count = 0
        for block in self.blocks():
            yield block
            count += len(block)
            progress(min(count / expected, 1.0))


def _copy_of(folder: Path) -> str:
    """Return advice to use the sealed copy, for a sentence on the live file; empty where it was not sealed."""
    copy = folder / schema.SEALED_FILE
    return f", or make it again of its sealed copy: 'daq-app import {copy}'" if copy.is_file() else ""


def _end(events: Sequence[LoggedEvent]) -> Mapping[str, Any] | None:
    """Return the data of the last `ended`, unless the session was resumed after it."""
    last_end = next((event for event in reversed(events) if event.kind in ("ended", "resumed")), None)
    return None if last_end is None or last_end.kind == "resumed" else last_end.data


def _blocks(
    connection: sqlite3.Connection, losses: list[str], span: tuple[int, int | None] | None
) -> Iterator[ReadingBlock]:
    condition, limits = "", ()
    if span is not None:
        condition = " WHERE received_last_ns >= ?" + ("" if span[1] is None else " AND received_first_ns < ?")
        limits = tuple(limit for limit in span if limit is not None)
    next_number = 1
    for (number,) in connection.execute("SELECT rowid FROM blocks" + condition + " ORDER BY rowid", limits).fetchall():
        if span is None and number != next_number:
            losses.append(f"blocks {next_number} to {number - 1} of the readings are missing")
        next_number = number + 1
        try:
            block = _block(connection, number)
        except (ValueError, TypeError, sqlite3.DatabaseError) as error:
            losses.append(f"block {number} of the readings is damaged and left out ({error})")
        else:
            yield block


def _block(connection: sqlite3.Connection, number: int) -> ReadingBlock:
    """Return one block. Raises ValueError when its check sum or summary differs."""
    names = ", ".join(schema.COLUMNS)
    query = f"SELECT crc32, {names}, {schema.SUMMARY} FROM blocks WHERE rowid=?"
    crc, *row = connection.execute(query, (number,)).fetchone()
    columns, summary = tuple(row[: len(schema.COLUMNS)]), tuple(row[len(schema.COLUMNS) :])
    if schema.blobs_crc(columns) != crc:
        raise ValueError("its bytes do not give the CRC-32 stored with them")
    block = schema.block_from_blobs(columns)
    if not len(block) or schema.summary(block) != summary:
        raise ValueError("its readings are not those that its row describes")
    return block


def _head(path: Path, connection: sqlite3.Connection) -> dict[str, Any]:
    """Return the head's values by name, JSON parsed. Raises RecordingError when it is not ours or damaged."""
    rows = connection.execute("SELECT name, value, crc32 FROM head ORDER BY number").fetchall()
    head: dict[str, Any] = {}
    for name, value, crc in rows:
        try:
            sound = schema.text_crc(value) == crc
            head[name] = value if name == "simulated" else json_value(value)
        except (ValueError, TypeError, AttributeError):
            sound = False
        if not sound:
            damage = f"{name} in its head is damaged (CRC-32 differs); restore it from a copy{_copy_of(path.parent)}"
            raise RecordingError(f"{path}: {damage}")
    try:
        schema.check_format(head.get("format"))
    except ValueError as error:
        raise RecordingError(f"{path}: {error}: use a later program") from error
    return head


def _events(connection: sqlite3.Connection, losses: list[str]) -> tuple[LoggedEvent, ...]:
    """Return the undamaged events, and add a sentence for each other one to `losses`."""
    events: list[LoggedEvent] = []
    next_number = 1
    # The rowid is the event's number even where the table's definition is damaged.
    rows = connection.execute("SELECT rowid, time_ns, kind, trial, readings, data, crc32 FROM events ORDER BY rowid")
    for number, *row in rows:
        if number != next_number:
            losses.append(f"events {next_number} to {number - 1} are missing")
        next_number = number + 1
        try:
            events.append(_event(number, row))
        except ValueError as error:
            losses.append(f"event {number} is damaged and left out ({error})")
    return tuple(events)


def _event(number: int, row: Sequence[object]) -> LoggedEvent:
    """Return an event from its row. Raises ValueError where it is damaged or does not fit its kind."""
    time_ns, kind, trial, readings, text, crc = as_type(row, tuple[int, str, int | None, int, str, int])
    if schema.event_crc(LoggedEvent(number, time_ns, kind, trial, readings, {}), text) != crc:
        raise ValueError("CRC-32 differs")
    return LoggedEvent(number, time_ns, kind, trial, readings, event_data(kind, text))


@contextmanager
def _connect(path: Path) -> Generator[sqlite3.Connection]:
    """Open the file for reading, in place where SQLite can do so without writing to it, else as a copy."""
    sides = (_side_file(path, "-wal"), _side_file(path, "-journal"))
    left_over = [side for side in sides if _size(side)]
    address = f"{path.resolve().as_uri()}?mode=ro"
    path.open("rb").close()  # raises the cause, which SQLite does not report
    if not left_over:
        with closing(limit_values(sqlite3.connect(address + "&immutable=1", uri=True))) as connection:
            yield connection
        return
    with closing(limit_values(sqlite3.connect(address, uri=True))) as connection:
        if _answers(connection):
            yield connection
            return
    with tempfile.TemporaryDirectory() as room:
        if sum(map(_size, (*left_over, path))) > shutil.disk_usage(room).free:
            raise OSError(errno.ENOSPC, f"the copy that is read has no room in {room}")
        for side in left_over:
            with suppress(FileNotFoundError):  # the database, copied last, then holds the content of that file
                shutil.copy(side, room)
        shutil.copy(path, room)
        with closing(limit_values(sqlite3.connect(Path(room) / path.name))) as connection:
            yield connection


def _answers(connection: sqlite3.Connection) -> bool:
    """Say whether SQLite can read in place; it cannot without side files, or where a rollback is due."""
    try:
        connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
    except sqlite3.OperationalError:
        return False
    return True


def _size(path: Path) -> int:
    """Return a file's size in bytes, 0 where it is missing: a session that ends removes its side files."""
    try:
        return path.stat().st_size
    except FileNotFoundError:
        return 0


def _side_file(path: Path, suffix: str) -> Path:
    return path.with_name(path.name + suffix)
