import numpy as np
import pytest

from daq_app.window.live_feed import Load, load_of

RATED = np.array([50.0, 50, 70, 500, 500, 500])


def test_the_load_of_each_axis_is_its_greatest_share_of_the_rated_range():
    wrench = np.array([[10.0, -25, 7, 50, 0, 0], [-20.0, 5, -35, 0, 100, -250]])
    assert load_of(wrench, RATED).shares[:6] == pytest.approx((0.4, 0.5, 0.5, 0.1, 0.2, 0.5))


def test_forces_and_torques_that_are_each_allowed_can_be_an_overload_together():
    # Fxy = hypot(0.6, 0.0) and Tz = 0.5: 1.1 of the rated load, though no axis is beyond 0.6.
    load = load_of(np.array([[30.0, 0, 0, 0, 0, 250.0]]), RATED)
    assert load.shares[6] == pytest.approx(1.1)
    assert load.over == ("combined",)


def test_a_latched_load_keeps_the_greatest_of_each():
    held = Load((0.1,) * 6 + (0.3,)).latch(Load((0.0, 0.2, 0.0, 0.0, 0.0, 1.2, 0.1)))
    assert held == Load((0.1, 0.2, 0.1, 0.1, 0.1, 1.2, 0.3))
    assert held.over == ("Tz",)


def test_a_transducer_that_states_no_rated_range_shows_no_load_instead_of_a_false_one():
    load = load_of(np.ones((3, 6)), np.full(6, np.nan))
    assert np.isnan(load.shares).all()
    assert load.over == ()
    assert np.isnan(Load().latch(load).shares).all()  # as a tenth of a second, or an acknowledgement, begins anew
