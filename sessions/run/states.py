"""The states of a session, and the position in the plan that each state holds."""

from dataclasses import dataclass, replace
from itertools import accumulate, chain, islice

from msgspec import Struct

from sessions.plan.orders import with_comparison
from sessions.plan.plan import Block, Choice, SessionPlan, Stimulus, Trial


@dataclass(frozen=True, slots=True)
class Progress:
    """Progress of one trial."""

    takes: int = 0  # begun so far
    take: int = 0  # number of the present or latest one
    kept: bool = False  # True when that take counts
    choice: Choice | None = None  # given in that take, of the two compared


@dataclass(frozen=True, slots=True)
class Position:
    """Which trial of the plan is in hand, and how far every trial is."""

    plan: SessionPlan
    index: int  # of the trial in hand
    progress: tuple[Progress, ...]  # one for each trial of the plan
    before_redo: "State | None" = None  # restored by undoing the last redo, until the next stroke

    @property
    def trial(self) -> Trial:
        """Return the trial in hand."""
        return next(islice(chain.from_iterable(block.trials for block in self.plan.blocks), self.index, None))

    @property
    def block(self) -> Block:
        """Return the block of the trial in hand."""
        ends = accumulate(len(block.trials) for block in self.plan.blocks)
        return next(block for block, end in zip(self.plan.blocks, ends, strict=True) if self.index < end)

    @property
    def take(self) -> int:
        """Return the number of the take of the trial in hand; 0 before the first."""
        return self.progress[self.index].take

    @property
    def is_last(self) -> bool:
        """Say whether the trial in hand is the last."""
        return self.index == len(self.progress) - 1

    @property
    def first_of_two(self) -> bool:
        """Say whether the trial in hand is the first of two that are compared."""
        return not self.is_last and self.plan.trials[self.index + 1].compared_with == self.trial.number

    @property
    def rest_due(self) -> bool:
        """Say whether the plan asks for a rest before the trial in hand."""
        rests, trial, block = self.plan.rests, self.trial, self.block
        if self.index == 0 or trial.compared_with is not None:
            return False
        position = block.trials.index(trial)
        if position == 0:
            return rests.between_blocks and self.at(self.index - 1).block.phase != "practice"
        # For the subject, two compared stimuli are one trial.
        number = sum(earlier.compared_with is None for earlier in block.trials[:position])
        return rests.after_trials is not None and number % rests.after_trials == 0

    def at(self, index: int) -> "Position":
        """Return the position with another trial in hand, not reached by a redo."""
        return replace(self, index=index, before_redo=None)

    def successor(self) -> "Position":
        """Return the position with the next trial in hand; in an adaptive block the answers choose its stimuli."""
        following = self.at(self.index + 1)
        return replace(following, plan=with_comparison(self.plan, following.trial.number, following.answers))

    @property
    def answers(self) -> tuple[tuple[Stimulus, bool], ...]:
        """Return each stimulus compared with this block's standard in a take that counts, and whether it was chosen."""
        trials = self.plan.trials
        block = trials[self.index].block
        stimuli: list[tuple[Stimulus, bool]] = []
        for i, (trial, progress) in enumerate(zip(trials, self.progress, strict=True)):
            if trial.block == block and progress.kept and progress.choice is not None:
                comparison = trials[i - 1] if trial.standard else trial
                stimuli.append((comparison.stimulus, (progress.choice == "second") == (comparison is trial)))
        return tuple(stimuli)

    def with_take(self, take: int) -> "Position":
        """Return the position with this take of the trial in hand, the latest or an earlier one; it is not kept."""
        return self.with_progress(Progress(max(take, self.progress[self.index].takes), take))

    def with_progress(self, progress: Progress) -> "Position":
        """Return the position with new progress of the trial in hand."""
        return replace(self, progress=(*self.progress[: self.index], progress, *self.progress[self.index + 1 :]))


class _State(Struct, frozen=True):
    """A state of a session that has not ended."""

    position: Position


class Idle(_State, frozen=True):
    """All is set up; the session has not begun."""


class Mounting(_State, frozen=True):
    """The experimenter puts the trial's stimulus on; no take is open."""


class Taring(_State, frozen=True):
    """A take has begun; the zero is measured with nothing touching."""


class Ready(_State, frozen=True):
    """The subject may stroke."""


class Stroking(_State, frozen=True):
    """The finger touches."""


class Scoring(_State, frozen=True):
    """The stroke is done and the subject judges."""

    touching: bool = False  # True during a further stroke
    strokes: int = 1  # begun in this take
    settled: bool = False  # the finger has been off long enough for the take to end


class Settling(_State, frozen=True):
    """The trial is done; the take continues until the finger has been off for a moment."""

    touching: bool = False


class Resting(_State, frozen=True):
    """A rest that the plan asks for, before the trial in hand; no take is open."""


class Paused(_State, frozen=True):
    """The session pauses. No take is open, except one whose stroke is done and waits for its answer."""

    scoring: bool
    strokes: int = 1  # begun in the take that waits


class Closing(_State, frozen=True):
    """Every trial is done; the last can still be repeated."""


class Ended(Struct, frozen=True):
    """The session is over."""

    reason: str
    complete: bool  # True when every trial was done or skipped


OpenTake = Taring | Ready | Stroking | Scoring | Settling  # the states with an open take
State = Idle | Mounting | Taring | Ready | Stroking | Scoring | Settling | Resting | Paused | Closing | Ended
