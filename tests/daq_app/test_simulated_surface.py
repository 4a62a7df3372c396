"""Surfaces of one's own on the simulated bench: as slippery as their protocol says, or else the nearest of ten."""

from daq_app.simulation.wiring import simulated_surface
from sessions.plan.plan import Stimulus, Trial


def trial(descriptor, index):
    return Trial(1, "block", Stimulus(descriptor, index, "K1"), 1, 1)


def test_a_surface_of_one_s_own_has_its_friction_and_is_pressed_as_hard_as_the_one_that_stands_in():
    nearest = simulated_surface(trial("softness", 3))
    own = simulated_surface(trial("softness", 3), (("softness", 3, 0.9), ("softness", 70, 0.2)))
    assert own.mu == 0.9
    assert own.index == 3
    assert abs(own.peak_normal_force - nearest.peak_normal_force) < 1e-12
    other = simulated_surface(trial("stickiness", 3), (("softness", 3, 0.9),))
    assert other == simulated_surface(trial("stickiness", 3))
