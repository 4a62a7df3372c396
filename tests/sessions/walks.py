"""Plans of all kinds, and random walks through them: events of which at least half lead on."""

from dataclasses import replace

from hypothesis import strategies as st

from sessions.plan.plan import Block, Frame, Rests, SessionPlan, Stimulus, Trial
from sessions.plan.protocols.planning import plan
from sessions.plan.protocols.protocol import protocol
from sessions.run.machine import advance, start
from sessions.run.states import Closing, Mounting, Paused, Ready, Resting, Scoring, Settling, Stroking, Taring
from sessions.run.steps import (
    Begin,
    ContactOnset,
    FingerLifted,
    Finish,
    MagnitudeEstimate,
    Note,
    PairedChoice,
    Pause,
    Redo,
    RestOver,
    Resume,
    Scored,
    Settled,
    Skip,
    StimulusMounted,
    StrokeDone,
    UndoRedo,
    Zeroed,
)

FORCES = plan(protocol("sensotact-friction"), "S01", 3)
SCORES = plan(protocol("sensotact-friction"), "S01", 3, forces=False)
CODES = [trial.stimulus.code for trial in FORCES.trials]
FIRST = FORCES.trials[0]


def plan_of(answers, *, forces=True, phase="main", strokes_allowed=1, **options):
    """A plan of one block whose trials ask for `answers`; "choice" compares with the trial before."""
    trials = tuple(
        Trial(n, "b", Stimulus("d", n, f"K{n:02d}"), 1, 1, phase, answer, n - 1 if answer == "choice" else None)
        for n, answer in enumerate(answers, 1)
    )
    block = Block("b", "Stroke.", 1, 2.0, ("", ""), trials, phase, "Which?", strokes_allowed)
    return SessionPlan("made", "S01", 0, "none", (block,), forces, Frame(), **options)


PAIRS = plan_of(["none", "choice"] * 3)
PAIRS_UNSEEN = plan_of(["none", "choice"] * 3, forces=False)
NUMBERS = plan_of(["number"] * 4, forces=False)
RESTFUL = plan_of(["line"] * 5, forces=False, rests=Rests(after_trials=2, duration=30.0))
_WHOLE = plan(protocol("adaptive-comparison"), "S01", 3, forces=False)
ADAPTIVE = replace(_WHOLE, blocks=tuple(replace(block, trials=block.trials[:10]) for block in _WHOLE.blocks))
PLANS_OF_ALL_KINDS = [FORCES, SCORES, PAIRS, PAIRS_UNSEEN, NUMBERS, RESTFUL, ADAPTIVE]

EVENTS = st.one_of(
    st.sampled_from(
        [
            Begin(),
            Zeroed(),
            ContactOnset(),
            FingerLifted(),
            Settled(),
            StrokeDone(),
            Pause(),
            Resume(),
            RestOver(),
            Finish(),
            UndoRedo(),
        ]
    ),
    st.builds(StimulusMounted, st.sampled_from([*CODES, "K01", "K02", "K03"])),
    st.builds(Scored, st.none() | st.floats(-10, 110)),
    st.builds(MagnitudeEstimate, st.none() | st.floats(-1, 1e6)),
    st.builds(PairedChoice, st.sampled_from([None, "first", "second"])),
    st.builds(Note, st.sampled_from(["", "yawned"])),
    st.builds(Redo, st.sampled_from(["", "sneezed", "coughed"])),
    st.builds(Skip, st.sampled_from(["", "dirty"])),
)
PLANS = st.sampled_from(PLANS_OF_ALL_KINDS)
# None stands for the event that leads on. Drawn in two steps: in one of many kinds it would come once in ten times,
# and hardly a walk would leave its beginning.
CHANCES = st.booleans().flatmap(lambda on: st.none() if on else EVENTS)


def next_event(state):
    """The event that leads on from `state`."""
    match state:
        case Mounting(position):
            return StimulusMounted(position.trial.stimulus.code)
        case Taring():
            return Zeroed()
        case Ready(position):
            return ContactOnset() if position.plan.forces else StrokeDone()
        case Stroking():
            return FingerLifted()
        case Scoring(position):
            return {"line": Scored(40.0), "number": MagnitudeEstimate(4.0), "choice": PairedChoice("first")}[
                position.trial.answer
            ]
        case Settling(touching=touching):
            return FingerLifted() if touching else Settled()
        case Paused() | Resting():
            return Resume()
        case Closing():
            return Finish()
        case _:
            return Begin()


@st.composite
def walks(draw):
    """A plan and events, about half of which lead on."""
    plan = draw(PLANS)
    state, _ = start(plan)
    events = []
    for chance in draw(st.lists(CHANCES, max_size=80)):
        event = next_event(state) if chance is None else chance
        events.append(event)
        state, _ = advance(state, event)
    return plan, events


def steps(plan, events):
    """Every (state before, event, state after, commands) of a walk."""
    state, _ = start(plan)
    walk = []
    for event in events:
        before = state
        state, commands = advance(state, event)
        walk.append((before, event, state, commands))
    return walk
