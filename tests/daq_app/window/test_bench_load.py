import numpy as np

from daq_app.window.live_feed import Load


def test_forces_and_torques_that_are_each_allowed_can_be_an_overload_together():
    assert Load((0.6, 0.0, 0.0, 0.0, 0.0, 0.5, 1.1)).overloads == ("combined",)


def test_a_load_near_the_rated_one_is_named():
    assert Load((0.1, 0.2, 0.1, 0.1, 0.1, 0.9, 1.0)).near_limits == ("Tz", "combined")


def test_a_transducer_that_states_no_rated_range_is_not_overloaded():
    assert Load((np.nan,) * 7).overloads == Load().near_limits == ()
