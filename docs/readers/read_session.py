"""Reads a session folder with Python alone: the live file session.sqlite, whole or left by a crash.

Use: python read_session.py FOLDER, or `session = read(folder)` in a program of yours. Nothing else is needed; the file
session.h5 is for programs that have a library for HDF5. docs/session-format.md tells every table and byte.
"""

import json
import operator
import sqlite3
import struct
import sys
import zlib
from pathlib import Path


def read(folder):
    """Return a dict: simulated, plan, transducer, readings (a list of tuples), events (a list of dicts), damaged."""
    file = sqlite3.connect(Path(folder, "session.sqlite").resolve().as_uri() + "?mode=ro", uri=True)
    header = dict(file.execute("SELECT name, value FROM head"))
    transducer = json.loads(header["transducer"])
    matrix = transducer["calibration"]["matrix"] if transducer else None
    readings, damaged = [], []
    for number, n, crc, *blobs in file.execute(
        "SELECT number, readings, crc32, sequence, counter, status, time, received_ns, raw FROM blocks ORDER BY number"
    ):
        if zlib.crc32(b"".join(blobs)) != crc:
            damaged.append(f"block {number}")
            continue
        columns = [struct.unpack(f"<{n}{code}", blob) for code, blob in zip("qqqdq", blobs)]
        for *integers, raw in zip(*columns, struct.iter_unpack("<6d", blobs[5])):
            wrench = tuple(sum(map(operator.mul, row, raw)) for row in matrix)  # nothing subtracted
            readings.append((*integers, raw, wrench))
    events = []
    for number, time_ns, kind, trial, count, data, crc in file.execute("SELECT * FROM events ORDER BY number"):
        line = "\n".join(map(str, (number, time_ns, kind, "" if trial is None else trial, count, data)))
        if zlib.crc32(line.encode()) != crc:
            damaged.append(f"event {number}")
            continue
        events.append({"time_ns": time_ns, "kind": kind, "trial": trial, **json.loads(data)})
    file.close()
    return {
        "simulated": None if header["simulated"] == "no" else header["simulated"],
        "plan": json.loads(header["plan"]),
        "transducer": transducer,
        "readings": readings,  # sequence, counter, status, time [s], received_ns, raw (6), wrench (6) [N, N mm]
        "events": events,
        "damaged": damaged,
    }


if __name__ == "__main__":
    if not Path(sys.argv[-1], "session.sqlite").is_file():
        sys.exit(f"{sys.argv[-1]} has no session.sqlite; give the folder of a session")
    session = read(sys.argv[1])
    if session["simulated"]:
        print(session["simulated"])
    print("subject", session["plan"]["subject"], "protocol", session["plan"]["protocol"])
    print(len(session["readings"]), "readings", len(session["events"]), "events")
    for name in session["damaged"]:
        print(name, "is damaged and left out")
    for sequence, _, _, time, _, _, wrench in session["readings"][:3]:
        print(f"reading {sequence} at {time:.6f} s:", " ".join(f"{number:.9g}" for number in wrench))
    for event in session["events"]:
        if event["kind"] == "scored":
            print("trial", event["trial"], "score", event["score"])
