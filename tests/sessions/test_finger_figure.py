"""The figure of the finger is drawn whatever its SEDs are, and no colour is invented where there is none."""

from dataclasses import replace

import numpy as np
import pytest
from report_example import example

from sessions.report.figures.finger import NO_SED, common_levels, finger_panels
from sessions.report.figures.style import look

FIELD = example().fields[0]
SED = FIELD.finger.sed


def with_sed(values):
    return replace(FIELD, finger=replace(FIELD.finger, values={"sed": values}))


def test_a_node_without_an_sed_moves_no_border_of_the_colours():
    longer_field = with_sed(np.append(SED, np.nan))
    assert common_levels((longer_field,)) == common_levels((FIELD,))


@pytest.mark.parametrize("sed", [0.0, float("nan")])
def test_fields_without_any_sed_have_colours_up_to_a_kilopascal(sed):
    levels = common_levels((with_sed(np.full_like(SED, sed)),))
    assert levels[0] == 0.0
    assert levels[-1] == 1.0


def test_a_finger_with_a_node_without_an_sed_is_drawn():
    incomplete_field = with_sed(np.append(np.nan, SED[1:]))
    with look():
        panels = finger_panels(incomplete_field, common_levels((incomplete_field,)))
    assert all(panel.svg for panel in panels)


def test_a_finger_that_touches_and_does_not_press_is_drawn_without_arrows():
    none = np.zeros_like(FIELD.skin.pressure)
    first_touch = replace(FIELD, skin=replace(FIELD.skin, pressure=none, traction=none))
    with look():
        _, close = finger_panels(first_touch, common_levels((FIELD,)))
    assert "Contact and receptor" in close.svg
    assert "traction 0.0 kPa" not in close.svg


def test_a_finger_without_any_sed_is_drawn_without_colours_and_says_so_in_one_sentence():
    incomplete_field = with_sed(np.full_like(SED, np.nan))
    with look():
        panels = finger_panels(incomplete_field, common_levels((incomplete_field,)))
        usual = finger_panels(FIELD, common_levels((FIELD,)))
    assert all(NO_SED in panel.svg and "SED [kPa]" not in panel.svg for panel in panels)
    assert not any(NO_SED in panel.svg for panel in usual)
