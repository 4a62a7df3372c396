"""The clock of a simulated bench, which runs faster than the machine's."""

import time

import pytest

from drivers.clock import LONGEST_STEP, PacedClock


@pytest.fixture
def machine(monkeypatch):
    """A machine whose time passes only when somebody sleeps, or where the test moves it."""

    class Machine:
        now_ns = 5_000_000_000

        def sleep(self, seconds):
            self.now_ns += round(seconds * 1e9)

    simulated_machine = Machine()
    monkeypatch.setattr(time, "monotonic_ns", lambda: simulated_machine.now_ns)
    monkeypatch.setattr(time, "sleep", simulated_machine.sleep)
    return simulated_machine


def test_fifty_seconds_pass_in_one_of_the_machine(machine):
    clock = PacedClock(50.0)
    began = clock.now_ns()
    machine.sleep(1.0)
    assert clock.now_ns() - began == 50_000_000_000


def test_a_machine_that_halts_for_a_second_takes_the_bench_a_tenth_of_a_second(machine):
    clock = PacedClock(50.0, LONGEST_STEP)
    began = clock.now_ns()
    machine.sleep(1.0)
    assert clock.now_ns() - began == 100_000_000


@pytest.mark.parametrize("longest_step", [LONGEST_STEP, 1e9])
def test_a_wait_is_as_long_as_was_asked_for_whatever_the_longest_step(machine, longest_step):
    clock = PacedClock(20.0, longest_step)
    began, machine_began = clock.now_ns(), machine.now_ns
    clock.sleep(3.0)
    assert clock.now_ns() - began == pytest.approx(3_000_000_000, abs=100)
    assert machine.now_ns - machine_began == pytest.approx(150_000_000, abs=100)
