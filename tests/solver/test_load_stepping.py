"""The one cut-back: steps that fail are halved, and what cannot be stepped over is refused with where it began."""

import pytest

from solver import Cancelled, NotConverged
from solver.equilibrium.load_stepping import StepControl, advance
from solver.progress import interruptible


def advance_up_to(longest, control, wall=2.0):
    """Bring on a load that takes steps up to `longest` and does not go beyond `wall`; return where it went."""
    positions, failures = [0.0], []

    def step(part):
        if part - positions[-1] > longest or part > wall:
            failures.append(part)
            raise NotConverged("too far")
        positions.append(part)

    advance(step, lambda position, part, reason: NotConverged(f"{position} {part} {reason}"), control)
    return positions[1:], failures


def test_a_path_that_goes_at_once_is_one_step():
    assert advance_up_to(1.0, StepControl()) == ([1.0], [])


def test_a_step_that_fails_is_halved_and_the_rest_goes_in_steps_of_that_size():
    assert advance_up_to(0.3, StepControl()) == ([0.25, 0.5, 0.75, 1.0], [1.0, 0.5])


def test_steps_grow_again_where_they_are_asked_to():
    assert advance_up_to(0.3, StepControl(step_growth=2.0)) == ([0.25, 0.5, 0.75, 1.0], [1.0, 0.5, 0.75, 1.0])


def test_what_the_smallest_step_does_not_pass_is_refused_with_where_it_began():
    with pytest.raises(NotConverged, match=r"0\.5 0\.125 too far"):
        advance_up_to(1.0, StepControl(min_step=0.25), wall=0.6)


def test_a_path_stops_between_two_steps():
    steps = []
    with pytest.raises(Cancelled), interruptible(lambda _: len(steps) < 2):
        advance(steps.append, lambda *_: NotConverged(""), StepControl(first_step=0.25))
    assert steps == [0.25, 0.5]
