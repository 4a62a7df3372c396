"""A session folder as a simulated bench fills it, written by the session writer: strokes, scores, a discarded take."""

import math

import numpy as np

from drivers.calibration import Calibration
from drivers.readings import ReadingBlock
from drivers.transducer import TransducerInfo
from sessions.plan.plan import Block, Frame, SessionPlan, Stimulus, Trial
from sessions.recording import SessionWriter
from sessions.recording.head import software_versions
from simulators.bench import Bench
from simulators.stroke import paper_surfaces
from simulators.subject import SimulatedSubject

RATE = 200.0
TRIAL_SECONDS = 6.0
PER_NEWTON = 1e6
CALIBRATION = Calibration(
    "FT00001", "counts", np.diag([1 / PER_NEWTON] * 3 + [1e-3] * 3), np.full(6, math.nan), "the simulated bench"
)
INFO = TransducerInfo(
    "net-ft://127.0.0.1", "net-ft", "SIMULATED Net F/T", "FT00001", True, RATE, 7000.0, CALIBRATION, {"filter": "off"}
)
PROVENANCE = {
    "created_utc": "2026-01-01T00:00:00+00:00",
    "software": software_versions(),
    "clock": {"factor": 1.0, "now_ns": 0},
}
DEPTH = {"stickiness": 2.0, "slipperiness": 1.5}


class SimulatedClock:
    factor = 1.0

    def __init__(self):
        self.ns = 0

    def now_ns(self):
        return self.ns

    def sleep(self, seconds):
        self.ns += round(seconds * 1e9)


def plan(subject="P01", *, forces=True, per_block=5):
    surfaces = list(paper_surfaces().items())
    blocks, number = [], 0
    for descriptor, depth in DEPTH.items():
        trials = []
        for (name, index), surface in surfaces:
            if name == descriptor and len(trials) < per_block:
                number += 1
                stimulus = Stimulus(descriptor, index, f"K{number}")
                trials.append(Trial(number, descriptor, stimulus, surface.direction, 1))
        blocks.append(
            Block(
                descriptor,
                f"Stroke the surface once, then say how much {descriptor} you felt.",
                trials[0].direction,
                depth,
                ("not at all", "as much as I can imagine"),
                tuple(trials),
            )
        )
    return SessionPlan(
        protocol="sensotact-friction",
        subject=subject,
        seed=7,
        order_rule="shuffled",
        blocks=tuple(blocks),
        forces=forces,
        frame=Frame("-z", "set", 20.0, "measured"),
    )


def record(folder, *, seed=1, subject="P01", forces=True, per_block=5, discard=None):
    """Write a session; return the folder and what was planted, a list of (trial, PlantedStroke)."""
    clock = SimulatedClock()
    session_plan = plan(subject, forces=forces, per_block=per_block)
    writer = SessionWriter.create(
        folder, session_plan, INFO if forces else None, PROVENANCE, subject_simulated=True, clock=clock
    )
    bench, hand, surfaces = Bench(seed), SimulatedSubject(seed), paper_surfaces()
    truth = []
    for trial in session_plan.trials:
        surface = surfaces[trial.stimulus.descriptor, trial.stimulus.index]
        for take in (1, 2) if trial.number == discard else (1,):
            begin = clock.ns
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
    wrench = bench.wrench(times)
    raw = np.round(wrench * np.array([PER_NEWTON] * 3 + [1e3] * 3))
    return ReadingBlock(ticks, ticks * 35, np.zeros(len(times), np.int64), times, (times * 1e9).astype(np.int64), raw)
