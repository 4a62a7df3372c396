"""Work in a process of its own that reports down a pipe, and is killed."""

import json
import os
import signal
import time

from simulated_session import Session


def whole_session(folder, report):
    """Run a session, and report its beginning, then how many readings and events are safe."""
    session = Session(folder)
    report("begun")
    session.run(progress=lambda status: report(status.safe.readings, status.safe.events))


def fork(work):
    """Start `work(report)` in a process of its own; what it reports comes down the pipe that is returned."""
    reading, writing = os.pipe()
    process = os.fork()
    if process == 0:
        try:
            os.close(reading)
            work(lambda *numbers: os.write(writing, (json.dumps(numbers) + "\n").encode()))
        finally:
            os._exit(0)
    os.close(writing)
    return process, reading


def kill_later(process, reading, events, later):
    """Kill a process `later` seconds after it said that so many events are safe, or ended; return all it reported."""
    report = b""
    while (part := os.read(reading, 65536)) and _safe_events(report := report + part) < events:
        pass
    time.sleep(later)
    kill(process)
    with os.fdopen(reading, "rb") as pipe:
        return _lines(report + pipe.read())


def kill(process):
    os.kill(process, signal.SIGKILL)
    os.waitpid(process, 0)


def read_reports(reading):
    """Return everything reported in whole lines."""
    with os.fdopen(reading, "rb") as pipe:
        return _lines(pipe.read())


def _lines(report):
    return [json.loads(line) for line in report.split(b"\n")[:-1]]


def _safe_events(report):
    return max((line[1] for line in _lines(report) if len(line) == 2), default=-1)


def lines_of(reading, count):
    """Return so many lines of what is reported, or as many as there are."""
    report = b""
    while report.count(b"\n") < count and (part := os.read(reading, 1)):
        report += part
    return [json.loads(line) for line in report.splitlines()]
