"""The warm stepper finds depth and travel from the forces, reading by reading."""

import numpy as np
import pytest

from solver.march import march, press_and_slide
from solver.stepper import Stepper
from tests.solver.finite_examples import finger


@pytest.mark.parametrize(("depth", "mu", "direction"), [(1.5, 0.62, -1), (1.5, 0.24, -1), (2.0, 0.28, 1)])
def test_one_iteration_a_reading_keeps_the_response_within_two_per_cent_of_its_peak(depth, mu, direction):
    """The truth is a course driven by depth, 200 readings of pressing and 60 of sliding at 20 mm/s, on a finer mesh."""
    fine, seen, _ = finger(8)
    newton, probes, _ = finger(5)
    stepper = Stepper(newton, probes, mu)
    course = press_and_slide(depth, mu, np.inf, direction, press=200, slides=60, distance=6.0)
    truth, found = [], []
    for shape in march(fine, course, tolerance=1e-6):
        truth.append(seen.average(fine.body, shape.u)[0])
        found.append(stepper.step(shape.force[1], shape.force[0]))
    assert np.abs(np.subtract(found, truth)).max() < 0.02 * max(truth)


def test_a_lifted_finger_has_no_response_and_starts_afresh():
    newton, probes, _ = finger(5)
    stepper = Stepper(newton, probes, 0.4)
    assert stepper.step(0.01, 0.0, iterations=6) > 0.0
    assert stepper.step(0.0, 0.0) == 0.0
    assert not stepper.shape.touching.any()


def test_forces_held_still_are_met_exactly():
    newton, probes, _ = finger(5)
    stepper = Stepper(newton, probes, 0.6)
    for part in np.linspace(0.1, 1.0, 10):
        stepper.step(0.05 * part, 0.01 * part, iterations=3)
    stepper.step(0.05, 0.01, iterations=8)
    np.testing.assert_allclose(stepper.shape.force, [0.01, 0.05], rtol=1e-8)
