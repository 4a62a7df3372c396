"""A finger that goes to and fro without lifting makes a stroke of each way."""

import numpy as np
import pytest
from closed_form import analyse, block, names, noisy, times, to_and_fro, trapezium, wrench

T = times(8.0)


def test_three_turns_make_four_strokes_each_with_its_direction_friction_and_speed():
    analysis = analyse(block(T, noisy(to_and_fro(T))))
    assert [stroke.direction for stroke in analysis.strokes] == [1, -1, 1, -1]
    assert [stroke.mu_dynamic for stroke in analysis.strokes] == pytest.approx([0.5] * 4, rel=0.01)
    assert [stroke.speed for stroke in analysis.strokes] == pytest.approx([25.0] * 4, rel=0.03)
    assert all(stroke.flaws == ("turned_without_lift",) for stroke in analysis.strokes)


def test_a_way_begins_where_the_drag_changes_its_sign():
    """Simulated: T goes through zero 0.05 s after each turn, at 2.5, 4 and 5.5 s."""
    strokes = analyse(block(T, noisy(to_and_fro(T)))).strokes
    assert [stroke.onset for stroke in strokes[1:]] == pytest.approx([2.55, 4.05, 5.55], abs=0.01)
    assert [stroke.lift for stroke in strokes[:-1]] == [stroke.onset for stroke in strokes[1:]]
    assert strokes[0].onset == pytest.approx(1.0, abs=0.01)
    assert strokes[-1].lift == pytest.approx(7.0, abs=0.01)


@pytest.mark.parametrize("slant", [0.6, 2.5])
def test_the_line_of_rubbing_may_lie_anyhow(slant):
    raw = to_and_fro(T)
    c, s = np.cos(slant), np.sin(slant)
    for axes in ([0, 1], [3, 4]):
        raw[:, axes] = raw[:, axes] @ np.array([[c, s], [-s, c]])
    strokes = analyse(block(T, noisy(raw))).strokes
    assert [stroke.speed for stroke in strokes] == pytest.approx([25.0] * 4, rel=0.03)
    headings = np.degrees(slant) + np.array([0.0, 180.0, 0.0, 180.0])
    errors = [stroke.heading - heading for stroke, heading in zip(strokes, headings, strict=True)]
    assert [(error + 180.0) % 360.0 - 180.0 for error in errors] == pytest.approx([0.0] * 4, abs=1.0)


def test_a_short_pull_back_at_the_touch_is_no_way():
    n = trapezium(T, 1.0, 5.0, 0.1, 2.0)
    ratio = np.where(T < 1.25, -0.4, 0.5)
    analysis = analyse(block(T, noisy(wrench(T, n, ratio, 15.0 * (T - 3.0)))))
    assert len(analysis.strokes) == 1
    assert "turned_without_lift" not in names(analysis)
    assert analysis.strokes[0].direction == 1


def test_circles_are_not_cut():
    angle = np.pi * np.clip(T - 1.0, 0.0, 6.0)
    n = trapezium(T, 1.0, 7.0, 0.1, 2.0)
    raw = wrench(T, n, np.zeros_like(T), 10.0 * (T - 4.0))
    raw[:, 0], raw[:, 1] = 0.5 * n * np.cos(angle), 0.5 * n * np.sin(angle)
    analysis = analyse(block(T, noisy(raw)))
    assert len(analysis.strokes) == 1
    assert "direction_turns" in names(analysis)
