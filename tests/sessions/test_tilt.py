"""How the face leans, told from presses: the lean is simulated by turning a whole bench in closed form."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from closed_form import INFO, SETTINGS, analyse, block, noisy, plan, slide, times, trapezium, trial, wrench
from scipy import stats

from sessions.recording import Recording
from sessions.report.facts import apparatus
from sessions.strokes.analysis import analyse as analyse_recording
from sessions.strokes.analysis import analyse_blocks
from sessions.strokes.bootstrap import SystematicDraws
from sessions.strokes.settings import BootstrapSettings
from sessions.strokes.trial_analysis import TrialContext, tilt_of

T = times(12.0)
LEAN = (2.0, -1.2)  # degrees, to +x and to +y


def lean_wrench(clean, lean=LEAN):
    """Return a wrench as a transducer feels it under a face that leans: turned about x, then about y, by hand."""
    a, b = np.arctan(np.tan(np.radians(lean)))
    about_y = np.array([[np.cos(a), 0, np.sin(a)], [0, 1, 0], [-np.sin(a), 0, np.cos(a)]])
    about_x = np.array([[1, 0, 0], [0, np.cos(-b), -np.sin(-b)], [0, np.sin(-b), np.cos(-b)]])
    turn = about_x @ about_y
    return np.hstack([clean[:, :3] @ turn.T, clean[:, 3:] @ turn.T])


def presses(pushes=(0.0, 0.0, 0.0)):
    """Three presses of 2 N, each with a push of its own sideways, as a share of N."""
    clean = np.zeros((len(T), 6))
    for at, push in zip((1.0, 5.0, 9.0), pushes, strict=True):
        n = trapezium(T, at, at + 2.0, 0.1, 2.0)
        clean += wrench(T, n, push * np.ones_like(T), np.zeros_like(T))
    return clean


def test_the_interval_of_a_lean_holds_the_true_one():
    tilt = analyse(block(T, noisy(lean_wrench(presses())))).tilt
    assert len(tilt.presses) == 3
    assert tilt.lean == pytest.approx(LEAN, abs=0.05)
    assert tilt.x_interval[0] <= LEAN[0] <= tilt.x_interval[1]
    assert tilt.y_interval[0] <= LEAN[1] <= tilt.y_interval[1]
    assert tilt.x_interval[1] - tilt.x_interval[0] < 0.2


def test_presses_that_push_sideways_differently_make_the_interval_wider_and_it_still_holds():
    tilt = analyse(block(T, noisy(lean_wrench(presses((0.03, -0.02, 0.0)))))).tilt
    assert tilt.x_interval[0] <= LEAN[0] <= tilt.x_interval[1]
    assert tilt.x_interval[1] - tilt.x_interval[0] > 3.0
    assert "3 presses" in tilt.kind


def test_the_interval_of_presses_holds_the_lean_as_often_as_it_says():
    draw = np.random.default_rng(5)
    inside = 0
    (press, *_), _ = analyse(block(T, noisy(lean_wrench(presses())))).tilt.presses, None
    for _ in range(400):
        leans = 2.0 + draw.standard_normal(4)
        tilt = tilt_of([replace(press, lean=(float(lean), 0.0)) for lean in leans], SETTINGS)
        inside += tilt.x_interval[0] <= 2.0 <= tilt.x_interval[1]
    assert 0.92 <= inside / 400 <= 0.98


def test_one_press_tells_a_lean_and_that_the_hand_is_not_in_its_interval():
    first_press = T < 4.0
    tilt = analyse(block(T[first_press], noisy(lean_wrench(presses()))[first_press])).tilt
    assert tilt.lean == pytest.approx(LEAN, abs=0.05)
    assert "what the hand itself pushed sideways is not in it" in tilt.kind


def test_a_stroke_tells_no_lean():
    assert analyse(block(T, noisy(lean_wrench(slide(T))))).tilt is None


def test_levelling_takes_the_error_of_the_lean_out_of_friction():
    """mu is off by about e (1 + mu^2) under a lean of e along the stroke; levelled it is the true one."""
    raw = noisy(lean_wrench(slide(T, mu=0.5)))
    (leant,) = analyse(block(T, raw)).strokes
    assert leant.mu_dynamic - 0.5 == pytest.approx(np.radians(-LEAN[0]) * 1.25, rel=0.1)
    (level,) = analyse(block(T, raw), settings=replace(SETTINGS, tilt=LEAN)).strokes
    assert level.mu_dynamic == pytest.approx(0.5, rel=2e-3)
    assert level.speed == pytest.approx(25.0, rel=0.01)


def test_a_lean_that_was_levelled_is_still_reported_as_that_of_the_face():
    tilt = analyse(block(T, noisy(lean_wrench(presses()))), settings=replace(SETTINGS, tilt=LEAN)).tilt
    assert tilt.lean == pytest.approx(LEAN, abs=0.05)


def test_presses_of_practice_count_and_its_strokes_do_not():
    practice = replace(trial(), phase="practice")
    parts = [(practice, block(T, noisy(lean_wrench(presses()))))]
    analysis = analyse_blocks(parts, TrialContext(plan([practice]), INFO, SETTINGS))
    assert [press.trial for press in analysis.presses] == [1, 1, 1]


def width(analysis):
    low, high = analysis.strokes[-1].mu_dynamic_interval
    return high - low


def test_three_presses_narrow_the_interval_of_mu_and_a_lean_that_nobody_levelled_moves_it_over_the_true_mu():
    clean = [lean_wrench(slide(T, mu=0.5)), lean_wrench(presses())]
    parts = [(trial(number=number), block(T, noisy(raw))) for number, raw in zip((1, 2), clean, strict=True)]
    analysis = analyse_blocks(parts, TrialContext(plan([of for of, _ in parts]), INFO, SETTINGS))
    alone = analyse_blocks(parts[:1], TrialContext(plan([parts[0][0]]), INFO, SETTINGS))
    (low, high), mu = analysis.strokes[0].mu_dynamic_interval, analysis.strokes[0].mu_dynamic
    assert low <= mu < 0.5 < high  # told is off by 2 degrees: 0.044
    assert width(alone) > 1.2 * (high - max(low, mu))


def test_a_recording_without_presses_names_the_lean_it_assumes_and_is_not_flawed_by_it():
    folder = Path(__file__).parents[1] / "data" / "sessions" / "version-1" / "sealed"
    analysis = analyse_recording(Recording.open(folder))
    assert [flaw.grade for flaw in analysis.flaws if flaw.name == "tilt_assumed"] == ["note"]
    assert "1°" in analysis.to_dict()["interval"]


def test_cross_talk_that_presses_show_is_not_drawn_a_second_time():
    """A press shows lean and cross-talk from N together: with an exact lean, nothing of the two is left in the drag."""
    draws = SystematicDraws(
        BootstrapSettings(4000, 3, cross_talk=0.01, tilt=(1.0, 1.0), tilt_error=(0.0, 0.0), tilt_presses=3)
    )
    normal, drag = draws.shares(np.array([1.0, 0.0]))
    assert normal == pytest.approx(np.radians(1.0), abs=1e-12)
    assert drag.std() == pytest.approx(0.01 * np.sqrt(2.0), rel=0.05)  # its own cross-talk, and the lean's


def test_a_lean_from_three_presses_is_drawn_from_students_law():
    draws = SystematicDraws(BootstrapSettings(200_000, 3, cross_talk=0.0, tilt_error=(1.0, 1.0), tilt_presses=3))
    ends = np.quantile(draws.shares(np.array([1.0, 0.0]))[0], (0.025, 0.975))
    assert np.degrees(ends) == pytest.approx([-4.303, 4.303], rel=0.03)  # of two degrees of freedom (Student 1908)


@pytest.mark.parametrize(("levelled", "sentence"), [((0.0, 0.0), "not levelled"), (LEAN, "levelled by 2° and −1.2°")])
def test_the_report_tells_the_lean_of_the_face_with_students_interval(levelled, sentence):
    settings = replace(SETTINGS, tilt=levelled)
    analysis = analyse(block(T, noisy(lean_wrench(presses((0.03, -0.02, 0.0))))), settings=settings)
    recording = SimpleNamespace(info=INFO, plan=plan(), provenance={})
    fact = next(fact for fact in apparatus(recording, analysis) if fact.name == "tilt of the face")
    leans = np.array([press.lean for press in analysis.tilt.presses])
    limits = np.transpose(stats.t.interval(0.95, 2, leans.mean(axis=0), stats.sem(leans)))
    x, y = (
        f"{lean:.2g}° ({low:.2g} to {high:.2g})" for lean, (low, high) in zip(leans.mean(axis=0), limits, strict=True)
    )
    assert fact.value == f"{x} to +x, {y} to +y".replace("-", "−")
    assert fact.remark == f"95 % t interval of the mean of 3 presses; {sentence}"


def test_the_report_tells_a_lean_that_a_person_gave():
    analysis = analyse(block(T, noisy(slide(T))), settings=replace(SETTINGS, tilt=LEAN))
    recording = SimpleNamespace(info=INFO, plan=plan(), provenance={})
    fact = next(fact for fact in apparatus(recording, analysis) if fact.name == "tilt of the face")
    assert (fact.value, fact.remark) == ("2° to +x and −1.2° to +y", "levelled by 2° and −1.2°")
