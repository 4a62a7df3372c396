"""Runs that take minutes: `make test-long`. Their last figures stand in docs/endurance.md."""

import os
import random
from collections import Counter

import numpy as np
import pytest
from kills import STATES, VICTIMS, Killing

from daq_app.simulation.wiring import connect
from drivers.clock import RealClock

pytestmark = pytest.mark.slow

KILLS = int(os.environ.get("KILLS", "300"))
SLACK = 0.2  # a commit under way, and what was measured during it [s, session clock]
FULL_RATE = 7000  # [Hz]
DURATION = 60.0  # [s]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="kill -9 needs POSIX")
def test_recorder_client_or_both_killed_at_any_moment_lose_nothing_acknowledged(tmp_path):
    chance = random.Random(11)
    reached, losses = Counter(), []
    for number in range(KILLS):
        state, victim = STATES[number % len(STATES)], chance.choice(VICTIMS)
        killing = Killing(tmp_path / "s", state, victim, chance)
        killing.check()
        reached[state, victim] += killing.reached
        losses.append(killing.lost)
    states = {state: sum(reached[state, victim] for victim in VICTIMS) for state in STATES}
    print(f"\n{KILLS} kills, {sum(states.values())} in the state aimed at: {states}")
    print(f"shown and not in the file: median {np.median(losses):.2f} s, most {max(losses):.2f} s of the session clock")
    assert min(states.values()) > 0.6 * KILLS / len(STATES)
    assert max(losses) <= 1.0 + SLACK


def test_the_box_at_its_full_rate_loses_nothing_for_a_minute():
    clock = RealClock()
    with connect(f"sim:?rate={FULL_RATE}", clock) as bench:
        bench.transducer.start()
        began, numbers, lags = clock.now_ns(), [], []
        while clock.now_ns() - began < DURATION * 1e9:
            numbers.append(bench.transducer.read(0.02).sequence)
            lags.append(bench.transducer.health.lag_ms)
        bench.transducer.stop()
        health = bench.transducer.health
    sequence = np.concatenate(numbers)
    assert health.lost == health.malformed == health.late == health.repeated == 0
    assert np.all(np.diff(sequence) == 1)
    assert len(sequence) > 0.98 * FULL_RATE * DURATION
    print(f"\n{len(sequence)} readings, 0 lost; lag p50 {np.median(lags):.2f} ms, p99 {np.percentile(lags, 99):.2f} ms")
