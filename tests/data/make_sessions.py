"""Makes the sessions of this format version that later versions must still read.

Made once, when a version is released: `PYTHONPATH=tests/sessions python tests/data/make_sessions.py`. Two trials in
simulated time, pressing 2 N, dragging 1 N, sliding at 20 mm/s. `sealed` ended as it should; `live` was left by a crash
in its second trial, write-ahead log and all.
"""

import shutil
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from stand_ins import Hands, ResumableClock, StandIn

from sessions.plan.protocols.planning import plan
from sessions.plan.protocols.protocol import protocol
from sessions.recording import SessionWriter, provenance
from sessions.recording.archive import seal
from sessions.recording.schema import FORMAT_VERSION
from sessions.run.runner import run_session
from sessions.run.steps import AskStroke

HERE = Path(__file__).parent
NORMAL, TANGENTIAL, SPEED = 2.0, 1.0, 20.0  # N, N, mm/s: the ground truth


class Slider(StandIn):
    """A transducer on which a finger presses, drags and slides wherever it touches."""

    def read(self, timeout):
        block = super().read(timeout)
        raw = np.round(block.raw + self._noise.normal(0.0, [4e3, 4e3, 0.0, 40.0, 40.0, 40.0], block.raw.shape))
        for begin, end, newtons in self.touches:
            on = (block.received_ns >= begin) & (block.received_ns < end)
            x = SPEED * (block.received_ns[on] - begin) * 1e-9  # [mm]
            raw[on, 0] += np.round(TANGENTIAL * 1e6)
            raw[on, 4] += np.round((x * newtons + self.height * TANGENTIAL) * 1e3)
        return replace(block, raw=raw)


def record(folder, in_second_stroke):
    """Run one session of two trials, and call `in_second_stroke` when the second stroke is asked for."""
    clock = ResumableClock()
    whole = plan(protocol("sensotact-friction"), "G01", 3)
    short = replace(whole, blocks=tuple(replace(block, trials=block.trials[:1]) for block in whole.blocks))
    transducer = Slider(clock, lost=(40, 41))
    transducer.height = short.frame.height
    machine = {"system": "Linux", "release": "", "processor": "x86_64", "cores": 2}
    head = {**provenance(clock), "machine": machine}
    writer = SessionWriter.create(folder, short, transducer.info, head, subject_simulated=True, clock=clock)

    def stroke(_):
        if transducer.touches:
            in_second_stroke()
        transducer.touches.append((clock.at_ns + 300_000_000, clock.at_ns + 1_300_000_000, NORMAL))
        return ()

    run_session(short, writer, Hands(clock, transducer, {AskStroke: stroke}), transducer)


def main():
    """Write both sessions of this version; what is there is never written over."""
    base = HERE / "sessions" / f"version-{FORMAT_VERSION}"
    if base.exists():
        raise SystemExit(f"{base} is there: it stays as it is; raise FORMAT_VERSION first")
    record(base / "sealed", lambda: None)
    seal(base / "sealed")
    with tempfile.TemporaryDirectory() as room:
        folder = Path(room) / "s"
        # What lies on the disk at this instant, the log among it, is what a crash leaves.
        record(folder, lambda: shutil.copytree(folder, base / "live", ignore=shutil.ignore_patterns("*-shm")))
    for path in sorted(base.rglob("*.*")):
        print(path.relative_to(HERE), path.stat().st_size)  # noqa: T201


if __name__ == "__main__":
    main()
