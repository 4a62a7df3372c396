"""The contact area by which tau_max is told: fixed, or growing with the normal force by a stated law."""

from dataclasses import replace

import numpy as np
import pytest
from made_strokes import SETTINGS, T, analysed, block, felt, stroke, trial

from sessions.strokes.bootstrap import BootstrapSettings, stroke_intervals
from sessions.strokes.stroke import FIXED, HERTZ, AreaLaw

PRESSED = 6.0  # N, with a mu of 0.5: 3 N sideways
GAINS_ALONE = BootstrapSettings(repeats=20000, gain_error=0.02, cross_talk=0.0, tilt_error=(0.0, 0.0))


def found(law):
    readings = block(T, felt(stroke(T, newtons=PRESSED)))
    return analysed(readings, of=trial(), settings=replace(SETTINGS, area=law))


@pytest.mark.parametrize(
    ("law", "area"),
    [
        (FIXED, 100.0),
        (AreaLaw("hertz", HERTZ), 100.0 * 3.0 ** (2.0 / 3.0)),  # three times the 2 N of the planned area
        (AreaLaw("power", 0.5, 1.5), 200.0),  # four times the 1.5 N: the root is two
        (AreaLaw("power", 0.0, 1.5), 100.0),
    ],
)
def test_tau_max_is_the_force_over_the_area_of_the_law(law, area):
    (one,), friction = found(law).strokes, found(law).friction[0]
    assert one.contact_area == pytest.approx(area, rel=0.01)
    assert one.tau_max == pytest.approx(3.0 / area, rel=0.01)
    assert (friction.tau_max, friction.contact_area) == (one.tau_max, one.contact_area)


def test_the_law_stands_in_the_settings_and_says_what_was_assumed():
    told = found(AreaLaw("hertz", HERTZ)).to_dict()["settings"]["area"]
    assert told == {"law": "hertz", "exponent": HERTZ, "force": 2.0}
    assert AreaLaw("hertz", HERTZ).sentence.count("assumed") == 2
    assert "set" in AreaLaw("power", 0.4, 1.0).sentence


def test_an_error_of_calibration_reaches_tau_max_through_the_area_too():
    # T over N^m: relative errors of 2 % of each make 2 % sqrt(1 + m^2).
    (one,) = found(AreaLaw("hertz", HERTZ)).strokes
    low, high = stroke_intervals(one, 0, GAINS_ALONE).tau_max
    assert (high - low) / one.tau_max == pytest.approx(2 * 1.95996 * 0.02 * np.hypot(1.0, HERTZ), rel=0.04)


def test_nothing_else_changes_with_the_area():
    first, second = found(FIXED).strokes[0].to_dict(), found(AreaLaw("hertz", HERTZ)).strokes[0].to_dict()
    assert {name for name in first if first[name] != second[name]} == {"tau_max", "contact_area", "area_exponent"}
