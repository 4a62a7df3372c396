"""What does not slide gives no friction: a finger that rolls, a sign that is wrong, a hand that grips."""

from pathlib import Path

import numpy as np
import pytest
from closed_form import analyse, block, names, noisy, slide, times, trapezium, wrench

from sessions.exchange.import_csv import ImportOptions, import_csv
from sessions.recording.reader import Recording
from sessions.strokes import analyse as analyse_recording

T = times(4.0)
GRIP = Path(__file__).resolve().parents[3] / "shared" / "data" / "grip_giver_release.csv"
FRICTION = ("mu_static", "mu_dynamic", "mu_max", "tau_max", "speed")
FLIPPED = np.array([1.0, 1.0, -1.0, 1.0, 1.0, 1.0])


def rolling_press(millimetres, seed):
    """Return a press of 2 N that leans by a tenth while its centre of pressure rolls along x within 2 s."""
    along = millimetres * (np.clip((T - 1.0) / 2.0, 0.0, 1.0) - 0.5)
    return noisy(wrench(T, trapezium(T, 1.0, 3.0, 0.1, 2.0), np.full_like(T, 0.1), along), seed)


def without_friction(analysis):
    return all(getattr(stroke, name) is None for stroke in analysis.strokes for name in FRICTION)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("millimetres", [4.0, 6.0, 10.0])
def test_a_finger_that_rolls_without_slip_gives_no_friction_and_says_so(millimetres, seed):
    analysis = analyse(block(T, rolling_press(millimetres, seed)))
    assert names(analysis, "refused") == {"may_only_roll"}
    assert without_friction(analysis)


@pytest.mark.parametrize("millimetres", [16.0, 40.0])
def test_a_way_that_no_finger_rolls_is_a_slide(millimetres):
    (stroke,) = analyse(block(T, rolling_press(millimetres, 0))).strokes
    assert stroke.mu_dynamic == pytest.approx(0.1, rel=0.02)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize(("first", "second"), [((1.0, 3.5), (5.0, 7.5)), ((-1.0, 3.0), (5.0, 10.0))])
def test_the_air_between_two_strokes_is_no_stroke_where_the_sign_of_fz_is_wrong(first, second, seed):
    t = times(9.0)
    clean = sum(slide(t, mu=0.42, begin=begin, end=end) for begin, end in (first, second))
    analysis = analyse(block(t, noisy(clean, seed) * FLIPPED))
    assert names(analysis, "refused") & {"normal_axis_implausible", "no_unloaded_stretch"}
    assert without_friction(analysis)


@pytest.mark.skipif(not GRIP.exists(), reason="the real recordings do not lie beside this repository")
@pytest.mark.parametrize("zeroed", [False, True])
@pytest.mark.parametrize("height", [-100.0, -50.0, -20.0, 0.0, 20.0, 50.0, 100.0])
def test_a_hand_that_grips_gives_no_friction_whatever_height_is_stated(tmp_path, height, zeroed):
    import_csv(GRIP, tmp_path / "grip", ImportOptions(height=height, zeroed=zeroed))
    analysis = analyse_recording(Recording.open(tmp_path / "grip"))
    assert names(analysis, "refused")
    assert without_friction(analysis)
