"""What is said of a stroke while its stimulus is still mounted: worst first, and what to do about it."""

from types import SimpleNamespace

import numpy as np
import pytest

from daq_app.window import stroke_quality
from daq_app.window.view_course import verdict
from drivers.readings import ReadingBlock
from sessions.strokes import FlawName
from sessions.strokes.stroke import Flaw
from tests.daq_app.session_messages import INFO, PLAN


@pytest.fixture
def judge_stroke(monkeypatch):
    """Return a function that judges a stroke whose N goes linearly from 2 N to `last`, with flaws beside it."""

    def judge(last, *flaws):
        time = np.linspace(0.0, 2.0, 801)
        normal = np.linspace(2.0, last, time.size)
        curve = SimpleNamespace(time=time, normal=normal, tangential=normal, ratio=normal, speed=normal)
        stroke = SimpleNamespace(curve=curve, steady=(0.0, 2.0), mu_dynamic=0.4, mu_dynamic_interval=None, speed=20.0)
        stroke.normal_force = stroke.tangential_force = 1.0
        stroke.onset = stroke.lift = None
        named_flaws = [Flaw(name, f"{name} at length.", grade) for name, grade in flaws]
        analysis = SimpleNamespace(strokes=[stroke], flaws=named_flaws, friction=[None])
        monkeypatch.setattr(stroke_quality, "analyse_blocks", lambda *_: analysis)
        return stroke_quality.stroke_quality(ReadingBlock.__new__(ReadingBlock), PLAN, INFO, PLAN.trials[0])

    return judge


def test_a_force_that_falls_by_half_asks_for_another_stroke(judge_stroke):
    # The medians of the first and the last quarter of a line from 2 to 0.4 lie at 1/8 and 7/8 of it: 1.8 and 0.6.
    quality = judge_stroke(0.4)
    assert quality.fell == pytest.approx(1 - 0.6 / 1.8, abs=2e-3)
    assert quality.grade == "doubtful"
    assert verdict(quality) == "Redo: pressed less than half as hard at the end. Keep pressing until the end."
    assert judge_stroke(1.6).texts == ()
    assert verdict(judge_stroke(1.6)) == "Good"


def test_the_worst_comes_first_and_says_what_to_do(judge_stroke):
    refusal = judge_stroke(0.4, (FlawName.STICK_SLIP, "doubtful"), (FlawName.TOO_LITTLE_FORCE, "refused"))
    assert verdict(refusal) == "Redo: pressed too lightly. Press harder."
    assert refusal.texts[1:] == (stroke_quality.LEAVING, "stick slip")
    doubtful = judge_stroke(0.4, (FlawName.STICK_SLIP, "doubtful"))
    assert verdict(doubtful).startswith("Redo: pressed less than half as hard")


def test_what_no_further_stroke_mends_is_doubted_alone(judge_stroke):
    assert verdict(judge_stroke(2.0, (FlawName.HEIGHT_UNKNOWN, "doubtful"))).startswith("Doubtful: height unknown")
    assert verdict(judge_stroke(2.0, (FlawName.LOST_READINGS, "note"))).startswith("Doubtful: readings were lost")


@pytest.mark.parametrize("flaws", [[], [Flaw(FlawName.NO_STROKE, "No stroke at length.", "refused")]])
def test_a_take_without_a_stroke_asks_for_one(monkeypatch, flaws):
    analysis = SimpleNamespace(strokes=[], flaws=flaws, friction=[])
    monkeypatch.setattr(stroke_quality, "analyse_blocks", lambda *_: analysis)
    quality = stroke_quality.stroke_quality(ReadingBlock.__new__(ReadingBlock), PLAN, INFO, PLAN.trials[0])
    assert verdict(quality) == "Redo: no stroke was found. Stroke once, firmly, and lift."
    assert quality.grade == "refused"
    assert quality.stroke is None
