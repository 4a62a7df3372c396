"""A session folder as a simulated bench fills it, written by the session writer: strokes, scores, a discarded take."""

from dataclasses import replace

import numpy as np
from msgspec import structs
from stand_ins import CALIBRATION, INFO, RATE

from drivers.clock import SimulatedClock
from drivers.readings import ReadingBlock
from sessions.plan.plan import Frame
from sessions.plan.protocols.planning import VisitSetting
from sessions.plan.protocols.planning import plan as plan_of
from sessions.plan.protocols.protocol import protocol
from sessions.recording import SessionWriter, provenance
from simulators.bench import Bench
from simulators.stroke import paper_surfaces
from simulators.subject import SimulatedSubject

TRIAL_SECONDS = 6.0
FRAME = Frame("-z", "set", 20.0, "measured")


def plan(subject="P01", *, forces=True, per_block=5):
    """Return the paper's experiment on the first surfaces of each block."""
    paper = protocol("sensotact-friction")
    blocks = tuple(structs.replace(block, indices=block.indices[:per_block], practice=()) for block in paper.blocks)
    return plan_of(replace(paper, blocks=blocks), subject, 7, forces=forces, setting=VisitSetting(frame=FRAME))


def record(folder, *, seed=1, subject="P01", forces=True, per_block=5, discard=None):
    """Write a session; return the folder and the ground truth, a list of (trial, StrokeGroundTruth)."""
    clock = SimulatedClock()
    session_plan = plan(subject, forces=forces, per_block=per_block)
    writer = SessionWriter.create(
        folder, session_plan, INFO if forces else None, provenance(clock), subject_simulated=True, clock=clock
    )
    bench, hand, surfaces = Bench(seed), SimulatedSubject(seed), paper_surfaces()
    truth = []
    for trial in session_plan.trials:
        surface = surfaces[trial.stimulus.descriptor, trial.stimulus.index]
        for take in (1, 2) if trial.number == discard else (1,):
            begin = clock.now_ns()
            writer.event("take_started", trial=trial.number, data={"take": take})
            if forces:
                bench.mount(surface)
                stroke = bench.begin_stroke(hand.stroke(surface), begin / 1e9 + 0.2)
                times = begin / 1e9 + np.arange(round(TRIAL_SECONDS * RATE)) / RATE
                writer.readings(_block(bench, times))
            clock.sleep(TRIAL_SECONDS)
            if take == 1 and trial.number == discard:
                writer.event("take_discarded", trial=trial.number, data={"take": take, "reason": "slipped off"})
                continue
            if forces:
                truth.append((trial.number, stroke))
            writer.event("scored", trial=trial.number, data={"score": hand.score(surface)})
            writer.event("take_kept", trial=trial.number, data={"take": take})
    writer.event("ended", data={})
    writer.close()
    return folder, truth


def _block(bench, times):
    ticks = np.round(times * RATE).astype(np.int64)
    raw = np.round(bench.wrench(times) / np.diag(CALIBRATION.matrix))
    return ReadingBlock(ticks, ticks * 35, np.zeros(len(times), np.int64), times, (times * 1e9).astype(np.int64), raw)
