"""The live model says of measured forces what the full solve says of the settled stroke."""

import functools
import time
from dataclasses import replace

import numpy as np
import pytest
from desk import PLAN

from daq_app.recorder.messages import Live
from daq_app.window.live_follower import Follower, settled_scene
from daq_app.window.live_model import (
    Forces,
    ModelTrace,
    Provisional,
    Ready,
    Settle,
    SettledSolve,
    Use,
    forces_of,
    join_forces,
    model_text,
)
from daq_app.window.live_model_process import LiveModel
from sessions.plan.plan import Frame
from sessions.strokes import FrictionParameters
from solver import NoSteadyState, solve

MU, NORMAL, AREA = 0.6, 2.0, PLAN.contact_area
FRICTION = FrictionParameters(1, 0, MU, None, MU * NORMAL / AREA, AREA, 20.0, 1, "maximum", ())
NOTHING = (0.0,) * 6
FRAME = Frame("-z", "set", 20.0, "set")


def stroke(seconds=2.0, rate=200):
    """Return readings of a press to NORMAL within half a second, a pull within another, then sliding towards +x."""
    time_ = np.arange(int(seconds * rate)) / rate
    normal = NORMAL * np.minimum(time_ / 0.5, 1.0)
    tangential = MU * normal * np.clip((time_ - 0.5) / 0.5, 0.0, 1.0)
    wrench = np.zeros((len(time_), 6))
    wrench[:, 0], wrench[:, 2] = tangential, -normal
    return live(time_, wrench)


def live(time_, wrench, status=None, stream=1):
    number = np.arange(len(time_))
    status = np.zeros(len(time_), np.int64) if status is None else status
    return Live(stream, number, time_, number * 5_000_000, wrench, status, NOTHING)


@functools.cache
def solve_once(scene, **_):
    """Solve a scene once for all tests."""
    return solve(scene)


@pytest.fixture(scope="module")
def follower():
    return Follower(Use(PLAN, "small"))


def test_sliding_forces_lead_to_the_sed_of_the_full_solve(follower):
    provisional = follower.take(forces_of(stroke(), FRAME))
    solution = solve_once(settled_scene(PLAN, FRICTION, NORMAL))
    assert provisional.sed[-1] == pytest.approx(solution.sed_ending, rel=0.02)  # what the stepper's mesh is good to
    assert provisional.depth == pytest.approx(solution.indentation, rel=0.02)
    assert provisional.mu == pytest.approx(MU, rel=1e-9)
    assert np.nanmax(np.abs(provisional.row - solution.row.sed)) < 0.04 * np.nanmax(solution.row.sed)


def test_the_picture_holds_the_energy_that_the_row_tells(follower):
    provisional = follower.take(forces_of(stroke(), FRAME))
    middles = provisional.picture.nodes[provisional.picture.faces].mean(axis=1)
    here = np.argmin(np.hypot(*(middles - [0.5, 0.6]).T))
    assert 0.1 * provisional.sed[-1] < provisional.picture.sed[here] < 10 * provisional.sed[-1]
    assert provisional.picture.outline[:, 1].min() == pytest.approx(0.0, abs=1e-3)


def test_finite_strain_tells_within_its_reach_and_small_strain_is_marked_where_it_tells_instead(follower):
    finite = Follower(Use(PLAN, "finite"))
    within = finite.take(forces_of(stroke(rate=100), FRAME))
    assert not within.instead.any()
    solution = solve(settled_scene(PLAN, FRICTION, NORMAL, "finite"))
    assert within.sed[-1] == pytest.approx(solution.sed_ending, rel=0.03)  # what the stepper's mesh is good to
    assert within.depth == pytest.approx(solution.indentation, rel=0.01)
    assert model_text(within, None, "").state == "provisional"
    lift = Forces(np.array([5.0]), np.array([0.0]), np.array([0.0]), 0, 1)
    finite.take(lift)
    hard = forces_of(stroke(rate=100), FRAME)
    beyond = finite.take(Forces(5.0 + hard.time, 3.0 * hard.normal, 5.0 * hard.pull, 0, 1))
    first = int(np.argmax(beyond.instead))
    assert first > 0
    assert beyond.instead[first:].all()  # what it lost is not taken up again in the middle of a press
    follower.take(lift)
    small = follower.take(Forces(5.0 + hard.time, 3.0 * hard.normal, 5.0 * hard.pull, 0, 1))
    assert beyond.sed[first:].tolist() == small.sed[first:].tolist()
    assert model_text(beyond, None, "").state == "instead"
    trace = ModelTrace()
    trace.add_prediction(beyond)
    is_known = np.isfinite(trace.columns(5.0, 8.0, 2000).values)
    assert (is_known[0] != is_known[1]).all()
    finite.take(lift)
    assert not finite.take(forces_of(stroke(0.5), FRAME)).instead.any()


def test_a_lifted_finger_forgets_the_friction_of_the_touch_before(follower):
    follower.take(forces_of(stroke(), FRAME))
    after_lift = follower.take(Forces(np.array([5.0]), np.array([0.0]), np.array([0.0]), 0, 1))
    assert after_lift.sed[-1] == 0.0
    assert after_lift.mu < MU


def test_another_plan_with_the_same_finger_needs_no_other_mesh(follower):
    assert follower.follows(Use(replace(PLAN, subject="S02"), "small"))
    assert not follower.follows(Use(PLAN, "finite"))
    assert not follower.follows(Use(replace(PLAN, contact_area=2.0 * AREA), "small"))
    deeper = replace(PLAN.blocks[0], indentation=3.0)
    assert not follower.follows(Use(replace(PLAN, blocks=(deeper, *PLAN.blocks[1:])), "small"))


def test_forces_beyond_its_reach_are_marked_and_the_next_touch_is_followed_again(follower):
    far = follower.take(Forces(np.array([6.0]), np.array([500.0]), np.array([0.0]), 0, 1))
    assert far.beyond
    assert model_text(far, None, "").state == "beyond"
    assert not follower.take(Forces(np.array([7.0]), np.array([1.0]), np.array([0.0]), 0, 1)).beyond


def test_the_full_solve_is_reported_beside_the_mean_of_what_was_shown_over_the_steady_window(follower, monkeypatch):
    monkeypatch.setattr("daq_app.window.live_follower.solve", solve_once)
    shown_values = follower.take(forces_of(stroke(), FRAME))
    settled = follower.settled_solver(Settle(PLAN, FRICTION, NORMAL, (1.2, 2.0)))()
    steady = shown_values.sed[(shown_values.time >= 1.2) & (shown_values.time <= 2.0)]
    assert settled.provisional == pytest.approx(steady.mean())
    assert abs(settled.difference) < 0.02
    words = model_text(shown_values, settled, "").text
    assert f"{1000 * settled.sed:.2f} kPa" in words
    assert "at the measured force, small strain" in words
    assert f"± {100 * settled.error:.2g} % by the mesh; model: " in words
    provisional = model_text(shown_values, None, "").text
    assert "mesh, model: no estimate · at the measured force" in provisional
    assert f"{1000 * settled.provisional:.2f} kPa" in words


def test_a_full_solve_whose_nested_mesh_has_no_such_state_has_no_estimate_from_the_mesh(follower, monkeypatch):
    monkeypatch.setattr("daq_app.window.live_follower.solve", lambda scene: replace(solve_once(scene), nested=None))
    follower.take(forces_of(stroke(), FRAME))
    settled = follower.settled_solver(Settle(PLAN, FRICTION, NORMAL, (1.2, 2.0)))()
    assert settled.error is None
    assert f"SED {1000 * settled.sed:.2f} kPa; mesh: no estimate; model: " in model_text(None, settled, "").text


def test_a_full_solve_that_fails_says_why_and_keeps_what_was_shown(follower):
    follower.take(forces_of(stroke(), FRAME))
    settled = follower.settled_solver(Settle(PLAN, replace(FRICTION, mu=None), NORMAL, (1.2, 2.0)))()
    assert settled.sed is None
    assert settled.difference is None
    assert settled.provisional is not None
    assert settled.reason in model_text(None, settled, "").text
    assert settled.picture.sed.max() > 0.0  # the last good state stays to be seen
    assert settled.depth == pytest.approx(1.54, abs=0.02)
    assert settled.picture.lost is None


def test_a_solve_that_finds_nothing_is_marked_in_the_last_state_that_was_followed(follower, monkeypatch):
    def wedged(_scene, **_):
        raise NoSteadyState("at 1.5 mm of indentation the finger wedges")

    monkeypatch.setattr("daq_app.window.live_follower.solve", wedged)
    follower.take(forces_of(stroke(), FRAME))
    settled = follower.settled_solver(Settle(PLAN, FRICTION, NORMAL, (1.2, 2.0)))()
    x, y = settled.picture.lost  # squeezed most between bone and surface, above the contact
    assert abs(x) < 4.0
    assert 0.0 < y < 4.0
    words = model_text(None, settled, "")
    assert words.state == "failed"
    assert "At 1.5 mm of indentation the finger wedges." in words.text
    assert "⊗" in words.text


def test_readings_become_200_steps_a_second_and_unhealthy_ones_are_left_out():
    time_ = np.arange(7000) / 7000.0
    wrench = np.tile([0.3, 0.4, -1.0, 0.0, 0.0, 0.0], (7000, 1))
    wrench[10, 2] = -1e6
    status = np.zeros(7000, np.int64)
    status[10] = 1
    forces = forces_of(live(time_, wrench, status), FRAME)
    assert len(forces.time) == 200
    assert forces.normal == pytest.approx(np.ones(200))
    assert forces.pull == pytest.approx(np.full(200, -0.5))  # against the push of the finger, all of hypot(Fx, Fy)
    assert forces_of(live(time_[:3], wrench[:3], np.ones(3, np.int64)), FRAME) is None


def test_joined_batches_are_one_batch():
    first, second = (forces_of(live(t, np.zeros((4, 6))), FRAME) for t in (np.arange(4) / 200, 1 + np.arange(4) / 200))
    assert join_forces([first, second]).time.tolist() == [*first.time, *second.time]


@pytest.mark.parametrize(
    ("provisional", "settled", "problem", "state"),
    [
        (None, None, "", "none"),
        (None, None, "no finger", "none"),
        (None, SettledSolve((1.2, 2.0), 0.004, 0.01, 0.0041, np.empty(0), None, 2.0, "small"), "", "settled"),
        (None, SettledSolve((1.2, 2.0), 0.004, None, None, np.empty(0), None, 2.0, "finite"), "", "settled"),
        (
            None,
            SettledSolve((1.2, 2.0), None, None, None, np.empty(0), None, None, "finite", "it wedges"),
            "",
            "failed",
        ),
    ],
)
def test_every_state_of_the_model_has_words(provisional, settled, problem, state):
    words = model_text(provisional, settled, problem)
    assert words.state == state
    assert words.text


def test_a_gap_in_the_readings_is_a_gap_in_the_curve(follower):
    trace = ModelTrace()
    for start in (0.0, 1.0):
        trace.add_prediction(follower.take(forces_of(live(start + np.arange(20) / 200, np.zeros((20, 6))), FRAME)))
    columns = trace.columns(0.0, 2.0, 600)
    assert np.isnan(columns.values[0]).sum() == 1
    assert np.flatnonzero(np.isnan(columns.values[0])).tolist() == [20]


def until(condition):
    end = time.monotonic() + 60.0  # of a machine that hangs, not of a slow one
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.005)


def test_a_process_of_its_own_answers_batches_and_the_full_solve_beside_them():
    model = LiveModel()
    model.prepare()
    news: list[Provisional] = []
    try:
        model.add(stroke(1.5), FRAME)
        until(lambda: news.extend(model.poll()) or news)
        model.settle(Settle(PLAN, FRICTION, NORMAL, (1.2, 1.5)))
        model.add(live(2.0 + np.arange(20) / 200, np.zeros((20, 6))), FRAME)
        count = model.predictions
        until(lambda: (model.poll(), model.settled is not None and model.predictions > count)[1])
        assert abs(model.settled.difference) < 0.02
        model._child.process.terminate()
        until(lambda: model.poll() or model.problem)
        assert "next session" in model.problem
    finally:
        model.close()


class SlowChild:
    """A live model's process whose answers the test gives, in its order."""

    def __init__(self, *_, **__):
        self.requests, self.answers = [], []

    def send(self, request):
        self.requests.append(request)

    def receive(self):
        return self.answers.pop(0) if self.answers else None

    def close(self):
        pass


def test_a_slow_full_solve_is_never_shown_beside_another_stroke(follower, monkeypatch):
    monkeypatch.setattr("daq_app.window.live_model_process.Child", SlowChild)
    model = LiveModel()
    model.prepare()
    child = model._child
    model.poll()
    child.answers.append(Ready())
    windows = ((1.0, 1.5), (6.0, 6.5))
    for number, window in enumerate(windows):
        model.add(live(5.0 * number + np.arange(20) / 200, np.tile([0.0, 0, -NORMAL, 0, 0, 0], (20, 1))), FRAME)
        model.settle(Settle(PLAN, FRICTION, NORMAL, window))
        model.poll()
        assert isinstance(child.requests[-1], Forces)  # what was measured of a stroke is followed before it is solved
        child.answers.append(follower.take(child.requests[-1]))
        model.poll()
        assert child.requests[-1].steady == window
    first, second = (SettledSolve(window, 0.004, 0.01, None, np.empty(0), None, 2.0, "small") for window in windows)
    child.answers += [second, first]
    model.poll()
    assert model.settled is second
    model.add(live(12.0 + np.arange(20) / 200, np.tile([0.0, 0, -500.0, 0, 0, 0], (20, 1))), FRAME)
    model.poll()
    child.answers.append(follower.take(child.requests[-1]))
    model.poll()
    assert model.provisional.beyond
    assert model.settled is None
