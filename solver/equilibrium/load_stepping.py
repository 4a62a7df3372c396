"""Bring a load on in steps, halving the step that fails (the only cut-back in the solver)."""

from collections.abc import Callable
from dataclasses import dataclass

from solver.failures import Cancelled, NotConverged


@dataclass(frozen=True, slots=True)
class StepControl:
    """How a load path is cut into steps; all are fractions of the path."""

    first: float = 1.0
    smallest: float = 2.0**-8  # a shorter step is refused
    growth: float = 1.0  # of the next step, after one that succeeded


Step = Callable[[float], None]
Refusal = Callable[[float, float, NotConverged], NotConverged]
WHOLE = StepControl()


def never() -> bool:
    """Return False: nothing asks the work to stop."""
    return False


def advance(
    step: Step,
    refusal: Refusal,
    control: StepControl = WHOLE,
    stop: Callable[[], bool] = never,
    exhausted: Callable[[], bool] = never,
) -> None:
    """Call `step` with growing fractions of the path up to 1, each the last that succeeded plus a step.

    `step` raises NotConverged where it fails, and leaves the state as it was. Where the next is too
    short, or the work is `exhausted`, this raises what `refusal` makes of the fraction reached, that step and the
    reason. Raises Cancelled where `stop` says so.
    """
    done, part = 0.0, control.first
    while done < 1.0:
        if stop():
            raise Cancelled
        aim = min(done + part, 1.0)
        try:
            step(aim)
        except NotConverged as reason:
            part /= 2.0
            if part < control.smallest or exhausted():
                raise refusal(done, part, reason) from reason
        else:
            done, part = aim, control.growth * part
