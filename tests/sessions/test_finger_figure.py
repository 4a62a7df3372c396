"""The figure of the finger is drawn whatever its SEDs are, and no colour is invented where there is none."""

from dataclasses import replace

import pytest
from report_example import example

from sessions.report.figures.finger import NO_SED, common_levels, finger_panels
from sessions.report.figures.style import look

FIELD = example().fields[0]
UNKNOWN = (float("nan"),)


def test_a_node_without_an_sed_moves_no_border_of_the_colours():
    more = replace(FIELD, sed=FIELD.sed + UNKNOWN)
    assert common_levels((more,)) == common_levels((FIELD,))


@pytest.mark.parametrize("sed", [0.0, float("nan")])
def test_fields_without_any_sed_have_colours_up_to_a_kilopascal(sed):
    levels = common_levels((replace(FIELD, sed=(sed,) * len(FIELD.sed)),))
    assert levels[0] == 0.0
    assert levels[-1] == 1.0


def test_a_finger_with_a_node_without_an_sed_is_drawn():
    gone = replace(FIELD, sed=UNKNOWN + FIELD.sed[1:])
    with look():
        panels = finger_panels(gone, common_levels((gone,)), simulated=True)
    assert all(panel.svg for panel in panels)


def test_a_finger_without_any_sed_is_drawn_without_colours_and_says_so_in_one_sentence():
    gone = replace(FIELD, sed=UNKNOWN * len(FIELD.sed))
    with look():
        panels = finger_panels(gone, common_levels((gone,)), simulated=True)
        usual = finger_panels(FIELD, common_levels((FIELD,)), simulated=True)
    assert all(NO_SED in panel.svg and "SED [kPa]" not in panel.svg for panel in panels)
    assert not any(NO_SED in panel.svg for panel in usual)
