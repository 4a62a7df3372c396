"""Small recordings for tests, and an independent reader of the live file: sqlite3 and struct alone."""

import shutil
import sqlite3
import struct
from contextlib import closing

import numpy as np
from stand_ins import INFO, ResumableClock

from drivers.readings import ReadingBlock
from sessions.plan.plan import Block, Frame, SessionPlan, Stimulus, Trial
from sessions.recording import SessionWriter, provenance

TRIAL = Trial(1, "stickiness", Stimulus("stickiness", 20, "K07"), 1, 1)
PLAN = SessionPlan(
    protocol="made-up",
    subject="S01",
    seed=7,
    order_rule="shuffled",
    blocks=(Block("stickiness", "Stroke °once°.", 1, 2.0, ("not at all", "äußerst"), (TRIAL,)),),
    forces=True,
    frame=Frame("-z", "set", 12.5, "measured"),
)


def new_writer(folder, *, info=INFO, plan=PLAN, clock=None, subject_simulated=False):
    clock = clock or ResumableClock()
    return SessionWriter.create(folder, plan, info, provenance(clock), subject_simulated=subject_simulated, clock=clock)


def readings(first, count, received_ns=0):
    """Readings whose numbers all follow from their sequence number."""
    i = np.arange(first, first + count)
    raw = np.column_stack([i * (axis + 1) for axis in range(6)]).astype(float)
    return ReadingBlock(i, i * 35 + 2**33, i % 3, i / 200.0, np.full(count, received_ns, np.int64), raw)


def record_crash(folder, commits):
    """The files of a recording whose writer never closed: commits of 100 readings each, in the log alone."""
    live = folder.with_name("live")
    writer = new_writer(live)
    for i in range(commits):
        writer.readings(readings(100 * i, 100, received_ns=i))
        writer.commit()
    folder.mkdir()
    for name in ("session.sqlite", "session.sqlite-wal", "session.sqlite-shm"):
        shutil.copy(live / name, folder)
    writer.close()
    return folder


def record_session(folder, *, blocks=3, **options):
    """A recording of 100 readings a block, with one scored trial, ended as it should."""
    writer = new_writer(folder, **options)
    writer.event("started")
    writer.event("take_started", 1, {"take": 1}, time_ns=50)
    for i in range(blocks):
        writer.readings(readings(100 * i, 100, received_ns=100 * (i + 1)))
        writer.commit()
    writer.event("scored", 1, {"score": 42.5})
    writer.event("take_kept", 1, {"take": 1}, time_ns=100 * blocks)
    writer.event("ended", data={"reason": "every trial is done"})
    writer.close()
    return folder


def with_a_long_answer(folder, positions, count=0):
    """A recording of `count` readings whose one answer has so many positions, followed by 118 notes."""
    writer = new_writer(folder)
    if count:
        writer.readings(readings(0, count))
    answer = {"score": 42.5, "positions": [[1000.0 + i / 60, i % 101 * 0.99] for i in range(positions)]}
    writer.event("scored", 1, answer, commit=False)
    for i in range(118):
        writer.event("note", data={"text": f"{i}"}, commit=False)
    writer.event("ended", data={"reason": "every trial is done"})
    writer.close()
    return folder


def rows(folder, query):
    with closing(sqlite3.connect(folder / "session.sqlite")) as connection:
        return connection.execute(query).fetchall()


def change(folder, query, values=()):
    (folder / "session.sqlite").chmod(0o644)
    with closing(sqlite3.connect(folder / "session.sqlite")) as connection:
        connection.execute(query, values)
        connection.commit()


def read_plainly(folder):
    """Every (sequence, counter, status, time, received_ns, raw 1..6), read with nothing of ours."""
    readings_list = []
    for n, *columns in rows(
        folder, "SELECT readings, sequence, counter, status, time, received_ns, raw FROM blocks ORDER BY number"
    ):
        kinds = ("q", "q", "q", "d", "q")
        plain = [struct.unpack(f"<{n}{kind}", column) for kind, column in zip(kinds, columns, strict=False)]
        raw = list(struct.iter_unpack("<6d", columns[5]))
        readings_list += [(*(column[i] for column in plain), *raw[i]) for i in range(n)]
    return readings_list
