"""Every flaw there is fires on the fault it is named after, simulated in closed form, and costs what it says."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from closed_form import (
    CALIBRATION,
    HEIGHT,
    INFO,
    PLAIN,
    SETTINGS,
    N,
    T,
    block,
    noisy,
    plan,
    slide,
    times,
    to_and_fro,
    trapezium,
    trial,
)
from closed_form import wrench as made
from recordings import record_session

from drivers.readings import ReadingBlock
from drivers.transducer import StatusTable, bit
from sessions.plan.plan import Frame
from sessions.recording import Recording
from sessions.strokes.analysis import analyse as analyse_recording
from sessions.strokes.analysis import analyse_blocks
from sessions.strokes.decisions import Decision, Decisions
from sessions.strokes.stroke import FlawName
from sessions.strokes.trial_analysis import TrialContext

ALONG = 25.0 * (T - 2.0)
HALF = 0.5 * np.ones_like(T)


@dataclass(frozen=True)
class Case:
    readings: ReadingBlock
    withheld: tuple[str, ...] = ()  # numbers of the first stroke that must be withheld
    given_numbers: tuple[str, ...] = ("mu_dynamic",)  # and those that must not
    also: frozenset[str] = frozenset()  # flaws that come with it by necessity
    extra: dict = field(default_factory=dict)  # further arguments


def leave_out(keep):
    return block(T[keep], noisy(PLAIN)[keep], sequence=np.flatnonzero(keep))


def without(start, stop):
    keep = np.ones(len(T), bool)
    keep[start:stop] = False
    return leave_out(keep)


def with_rows(rows, values):
    raw = noisy(PLAIN)
    raw[rows] = raw[values] if isinstance(values, int) else values
    return block(T, raw)


def with_columns(**columns):
    """A plain stroke with columns of its readings changed."""
    raw = noisy(PLAIN)
    for name, change in columns.items():
        at = ("fx", "fy", "fz", "tx", "ty", "tz").index(name)
        raw[:, at] = change(raw[:, at])
    return block(T, raw)


def turning():
    angle = np.pi * np.clip(T - 1.0, 0, 2)
    raw = made(T, N, np.zeros_like(T), 10.0 * (T - 2.0))
    raw[:, 0], raw[:, 1] = 0.5 * N * np.cos(angle), 0.5 * N * np.sin(angle)
    return raw


def sideways(share):
    """A stroke along x with a constant push along y, its centre of pressure still moving along x."""
    raw = made(T, N, HALF, ALONG)
    push = share * N
    raw[:, 1] += push
    raw[:, 3] -= HEIGHT * push
    raw[:, 5] += ALONG * push
    return raw


def creeping():
    n = np.where((T > 1.0) & (T < 3.0), 2.0 * np.clip((T - 1.8) / 0.1, 0.1, 1.0), 0.0)
    return made(T, n, HALF, ALONG)


LONG = times(8.0)
DIP = trapezium(LONG, 1.0, 7.0, 0.1) * (3.0 - 2.8 * trapezium(LONG, 3.6, 4.4, 0.2))
TWO_SLIDES = noisy(slide(LONG, begin=1.0, end=3.0) + slide(LONG, begin=5.0, end=7.0))
TAPS = sum(made(LONG, trapezium(LONG, at, at + 0.12, 0.02, 2.0), 0 * LONG, 0 * LONG) for at in (1.0, 3.0, 5.0))
BRUSH = noisy(slide(LONG) + made(LONG, trapezium(LONG, 6.0, 7.0, 0.1, 0.2), 0.1 + 0 * LONG, 0 * LONG))
INSIDE = (T > 1.3) & (T < 2.8)
SWAYING = 2.0 + 0.5 * np.sin(2 * np.pi * 2.0 * T)
FRICTION = ("mu_dynamic", "mu_max", "tau_max")

SAW = 0.5 * (1.0 - 0.25 * (1.0 - 8.0 * T % 1.0) * INSIDE)

CASES = {
    "stick_slip": Case(block(T, noisy(made(T, N, SAW, ALONG)))),
    "lost_readings": Case(without(400, 430), ("tau_max", "mu_max")),
    "saturated": Case(
        block(T, noisy(PLAIN), status=np.where((T > 1.9) & (T < 2.0), 1 << 17, 0)), ("tau_max", "peak_normal")
    ),
    "device_fault": Case(
        block(T, noisy(PLAIN), status=np.where((T > 1.9) & (T < 2.0), 0x80000100, 0)),
        ("tau_max", "peak_normal"),
        also=frozenset({"saturated"}),
        extra={"info": replace(INFO, status=StatusTable((bit(8, "gauge excitation", "doubtful"),), 1 << 31))},
    ),
    "frozen_sensor": Case(with_rows(slice(420, 460), 419), ("tau_max",)),
    "dead_sensor": Case(with_columns(ty=lambda t: 0 * t), ("speed", *FRICTION), (), frozenset({"no_steady_sliding"})),
    "wild_reading": Case(with_rows(slice(420, 421), np.array([20.0, 0, 0, 0, 0, 0])), given_numbers=FRICTION),
    "irregular_time": Case(block(T + np.random.default_rng(3).uniform(0, 0.002, len(T)), noisy(PLAIN))),
    "unknown_rate": Case(block(0 * T, noisy(PLAIN)), (), ()),
    "no_unloaded_stretch": Case(
        block(T[INSIDE], noisy(made(T, SWAYING, HALF, ALONG))[INSIDE]),
        (*FRICTION, "speed", "direction", "onset", "lift"),
        (),
        frozenset({"begins_in_contact", "ends_in_contact"}),
    ),
    "zero_after_contact": Case(leave_out(T >= 1.5), also=frozenset({"begins_in_contact"})),
    "drift": Case(block(T, noisy(PLAIN + 0.3 * (T > 2.0)[:, None] * np.eye(6)[0])), (*FRICTION, "normal_force"), ()),
    "normal_axis_implausible": Case(
        block(T, noisy(made(T, N * (1.0 + 0.2 * np.sin(2 * np.pi * 1.7 * T)), HALF, ALONG))),
        given_numbers=(),
        extra={"frame": Frame("+z", "set", HEIGHT, "set")},
    ),
    "units_implausible": Case(
        with_columns(tx=lambda t: 1e3 * t, ty=lambda t: 1e3 * t, tz=lambda t: 1e3 * t),
        ("speed", *FRICTION),
        (),
        extra={"info": replace(INFO, calibration=replace(CALIBRATION, rated=np.full(6, np.nan)))},
    ),
    "no_stroke": Case(block(T, noisy(0 * PLAIN)), (), ()),
    "second_stroke": Case(block(LONG, TWO_SLIDES)),
    "light_touch": Case(block(LONG, BRUSH)),
    "tap": Case(block(LONG, noisy(TAPS)), (), (), frozenset({"no_stroke"})),
    "not_lifted_between": Case(
        block(LONG, noisy(made(LONG, DIP, 0.5 + 0 * LONG, 10.0 * (LONG - 4.0)))),
        given_numbers=("lift",),
        also=frozenset({"second_stroke", "drift"}),  # 0.2 N are left in the valley
    ),
    "turned_without_lift": Case(
        block(LONG, noisy(to_and_fro(LONG))),
        given_numbers=("mu_dynamic", "speed", "direction"),
        also=frozenset({"second_stroke", "wrong_direction"}),
    ),
    "begins_in_contact": Case(leave_out(T >= 1.5), ("onset",), also=frozenset({"zero_after_contact"})),
    "ends_in_contact": Case(leave_out(T <= 2.5), ("lift",)),
    "slow_onset": Case(block(T, noisy(creeping()))),
    "too_little_force": Case(
        block(T, noisy(slide(T, newtons=0.2))), (*FRICTION, "speed"), (), frozenset({"no_steady_sliding", "drift"})
    ),
    "ratio_above_one_at_low_force": Case(
        block(T, noisy(made(T, trapezium(T, 1.0, 3.0, 0.4, 3.0), np.where(T < 1.12, 1.6, 0.5), ALONG))), ("mu_static",)
    ),
    "ratio_above_one": Case(block(T, noisy(slide(T, mu=1.4))), given_numbers=("mu_max", "mu_dynamic")),
    "side_load": Case(block(T, noisy(sideways(0.3)))),
    "no_steady_sliding": Case(block(T, noisy(made(T, N, 0.3 + 0 * T, 0 * T))), (*FRICTION, "speed", "direction"), ()),
    "speed_not_measurable": Case(
        block(T, noisy(made(T, N, HALF, ALONG + 10.0 * np.sin(2 * np.pi * 1.5 * T)))), ("speed", "speed_error")
    ),
    "may_only_roll": Case(
        block(T, noisy(made(T, N, 0.1 + 0 * T, 3.0 * (T - 2.0)))), (*FRICTION, "speed", "direction"), ()
    ),
    "height_unknown": Case(
        block(T, noisy(made(T, N, 0.5 + 0.04 * (T - 2.0), 7.0 * (T - 2.0)))),
        ("speed",),
        extra={"frame": Frame("-z", "default", HEIGHT, "default")},
    ),
    "direction_turns": Case(
        block(T, noisy(turning())), ("speed", "direction"), also=frozenset({"speed_not_measurable"})
    ),
    "direction_disagrees": Case(block(T, noisy(made(T, N, -HALF, ALONG))), ("speed", "direction")),
    "wrong_direction": Case(block(T, noisy(slide(T, direction=-1)))),
    "decision": Case(
        block(T, noisy(PLAIN)),
        extra={"decisions": Decisions((Decision("E02", "w", "lift", 1, 7, None, 2.0, number=1),))},
    ),
}
"""The fault by the flaw it must raise; trials ask for one stroke from proximal to distal."""


def analyse_case(case, of):
    setting = {"frame": None, "info": INFO, "decisions": Decisions(), **case.extra}
    context = TrialContext(plan([of], setting["frame"]), setting["info"], SETTINGS, setting["decisions"])
    return analyse_blocks([(of, case.readings)], context)


def test_every_flaw_there_is_has_a_fault_here():
    # That the lean is assumed is a flaw of a whole recording: see test_tilt.py. So are its losses: see below.
    assert {*CASES, "tilt_assumed", "recording"} == {str(name) for name in FlawName}


def test_what_a_recording_lost_is_a_flaw_of_its_analysis(tmp_path):
    whole = Recording.open(record_session(tmp_path / "S01"))
    flaw = analyse_recording(replace(whole, _log_losses=("Readings are lost.",))).flaws[0]
    assert (flaw.name, flaw.sentence, flaw.grade) == (FlawName.RECORDING, "Readings are lost.", "doubtful")


@pytest.mark.parametrize("name", CASES)
def test_a_fault_raises_its_flaw_and_no_other(name):
    case = CASES[name]
    raised = {str(flaw.name) for flaw in analyse_case(case, trial()).flaws}
    assert name in raised
    assert raised - {name} <= case.also


@pytest.mark.parametrize("name", CASES)
def test_a_flaw_withholds_what_it_says_and_leaves_the_rest(name):
    case = CASES[name]
    analysis = analyse_case(case, trial())
    for number in case.withheld:
        assert getattr(analysis.strokes[0], number) is None, number
    for number in case.given_numbers:
        assert getattr(analysis.strokes[0], number) is not None, number
    assert all(not flaw.sentence[0].islower() and flaw.sentence.endswith(".") for flaw in analysis.flaws)


def test_a_trial_of_which_no_reading_can_be_used_has_no_stroke_and_says_so():
    analysis = analyse_case(Case(block(T, noisy(PLAIN) + 100.0)), trial())  # the rated force is 36 N
    assert analysis.strokes == ()
    assert {str(flaw.name) for flaw in analysis.flaws} == {"saturated", "no_stroke"}
    assert "Only 0 of 800 readings can be used" in analysis.flaws[-1].sentence


@pytest.mark.parametrize(("share", "fires"), [(0.10, False), (0.3, True)])
def test_a_push_from_the_side_is_named_by_its_share_of_the_drag(share, fires):
    """A tenth of N beside a drag of half of N is 20 % of the tangential force; three tenths are 51 %."""
    names = {str(flaw.name) for flaw in analyse_case(Case(block(T, noisy(sideways(share)))), trial()).flaws}
    assert ("side_load" in names) == fires
