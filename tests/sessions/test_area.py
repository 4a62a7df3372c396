"""The contact area behind tau_max: fixed, or growing with the normal force by a stated law."""

from dataclasses import replace

import numpy as np
import pytest
from closed_form import GAINS_ALONE, SETTINGS, T, analyse, block, noisy, slide, trial

from sessions.strokes.bootstrap import stroke_intervals
from sessions.strokes.stroke import FIXED, HERTZ_EXPONENT, AreaLaw

PRESS = 6.0  # N, with a mu of 0.5: 3 N sideways


def analysis_with(law):
    readings = block(T, noisy(slide(T, newtons=PRESS)))
    return analyse(readings, of=trial(), settings=replace(SETTINGS, area=law))


@pytest.mark.parametrize(
    ("law", "area"),
    [
        (FIXED, 100.0),
        (AreaLaw("hertz", HERTZ_EXPONENT), 100.0 * 3.0 ** (2.0 / 3.0)),  # three times the 2 N of the planned area
        (AreaLaw("power", 0.5, 1.5), 200.0),  # four times the 1.5 N: the root is two
        (AreaLaw("power", 0.0, 1.5), 100.0),
    ],
)
def test_tau_max_is_the_force_over_the_area_of_the_law(law, area):
    (stroke,), friction = analysis_with(law).strokes, analysis_with(law).friction[0]
    assert stroke.contact_area == pytest.approx(area, rel=0.01)
    assert stroke.tau_max == pytest.approx(3.0 / area, rel=0.01)
    assert (friction.tau_max, friction.contact_area) == (stroke.tau_max, stroke.contact_area)


def test_the_law_stands_in_the_settings_and_says_what_was_assumed():
    area_document = analysis_with(AreaLaw("hertz", HERTZ_EXPONENT)).to_dict()["settings"]["area"]
    assert area_document == {"law": "hertz", "exponent": HERTZ_EXPONENT, "force": 2.0}
    assert AreaLaw("hertz", HERTZ_EXPONENT).sentence.count("assumed") == 2
    assert "set" in AreaLaw("power", 0.4, 1.0).sentence


def test_an_error_of_calibration_reaches_tau_max_through_the_area_too():
    # T over N^m: relative errors of 2 % of each make 2 % sqrt(1 + m^2).
    (stroke,) = analysis_with(AreaLaw("hertz", HERTZ_EXPONENT)).strokes
    low, high = stroke_intervals(stroke, 0, GAINS_ALONE).tau_max
    assert (high - low) / stroke.tau_max == pytest.approx(2 * 1.95996 * 0.02 * np.hypot(1.0, HERTZ_EXPONENT), rel=0.04)


def test_nothing_else_changes_with_the_area():
    first, second = (analysis_with(law).strokes[0].to_dict() for law in (FIXED, AreaLaw("hertz", HERTZ_EXPONENT)))
    assert {name for name in first if first[name] != second[name]} == {"tau_max", "contact_area", "area_exponent"}
