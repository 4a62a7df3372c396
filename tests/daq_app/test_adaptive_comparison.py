"""Adaptive comparisons from protocol to psychometric function: answers choose what is compared next."""

import math
from functools import partial
from itertools import product

import pytest
from test_constant_stimuli import stroked_visit

from daq_app.console import Console
from daq_app.simulation.synthetic import conduct
from daq_app.simulation.wiring import SimulatedPeople, simulated_surface
from drivers.clock import SimulatedClock
from sessions.plan.orders import next_comparison
from sessions.plan.plan import Stimulus
from sessions.plan.protocols.planning import plan
from sessions.plan.protocols.protocol import FOLDER, protocol
from sessions.plan.study import StudyError, create_study
from sessions.recording import Recording
from sessions.recording.archive import problems
from sessions.report import experiments
from sessions.run.resuming import resumption
from sessions.run.states import Mounting
from sessions.statistics.psychometric import QUARTILE
from simulators.subject import SimulatedSubject, SubjectSettings

ADAPTIVE = protocol("adaptive-comparison")


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    folder, clock = tmp_path_factory.mktemp("adaptive") / "S03", SimulatedClock()
    people = SimulatedPeople(
        SimulatedSubject(3), clock, None, partial(simulated_surface, friction=ADAPTIVE.simulated_friction)
    )
    session_plan = plan(ADAPTIVE, "S03", 3, forces=False)
    conduct(session_plan, folder, people, Console(as_json=True), durable=False)
    return Recording.open(folder)


def comparisons(trials):
    """Index of what was compared with the standard in each pair, and whether it came first."""
    pairs = zip(trials[::2], trials[1::2], strict=True)
    return [(second if first.standard else first).stimulus.index for first, second in pairs]


def test_each_comparison_leaves_the_least_entropy_that_can_be_expected():
    # Watson's rule (2017, equations 5 to 12), written out over every subject that is held for possible.
    indices = (0, 10, 25, 40)
    candidates = [Stimulus("friction", index, f"K{index}") for index in indices]
    pses = [n for n in range(41)]
    spreads = [40.0 / 3.0 / 5.0 * 15.0 ** (n / 14.0) for n in range(15)]  # a fifth of the mean step, to the range
    possible = list(product(pses, spreads, (1.0, -1.0), (0.0, 0.05)))

    def chance(subject, index):
        pse, spread, sense, lapse = subject
        return lapse / 2 + (1 - lapse) * 0.5 * math.erfc(-sense * (index - pse) / spread / math.sqrt(2.0))

    def entropy(weights):
        return -sum(w * math.log(w) for w in weights if w > 0.0)

    answers, weights = [], [1.0 / len(possible)] * len(possible)
    for answer in (True, False, False, True):
        expected = []
        for index in indices:
            remaining = 0.0
            for yes in (True, False):
                joint = [
                    w * (p if yes else 1 - p)
                    for w, p in zip(weights, [chance(o, index) for o in possible], strict=True)
                ]
                total = sum(joint)
                remaining += total * entropy([w / total for w in joint])
            expected.append(remaining)
        stimulus = next_comparison(candidates, answers)
        assert expected[indices.index(stimulus.index)] == pytest.approx(min(expected), abs=1e-6)
        answers.append((stimulus, answer))
        likely = [chance(s, stimulus.index) if answer else 1 - chance(s, stimulus.index) for s in possible]
        total = sum(w * p for w, p in zip(weights, likely, strict=True))
        weights = [w * p / total for w, p in zip(weights, likely, strict=True)]


def test_a_session_compares_what_its_answers_ask_for_and_its_recording_says_so(recording):
    trials = [record.trial for record in recording.trials]
    codes = [event.data["code"] for event in recording.events if event.kind == "stimulus_mounted"]
    assert [trial.stimulus.code for trial in trials] == codes
    candidates, answers = recording.plan.blocks[0].candidates, []
    for first, second in zip(recording.trials[::2], recording.trials[1::2], strict=True):
        comparison = second if first.trial.standard else first
        assert comparison.trial.stimulus == next_comparison(candidates, answers)
        answers.append((comparison.trial.stimulus, second.choice == ("second" if comparison is second else "first")))
    assert sum(trial.standard for trial in trials[::2]) == 20  # half of the pairs begin with the standard
    assert len({*comparisons(trials)}) > 4
    assert problems(recording.folder) == ()


def test_the_intervals_of_an_adaptive_session_hold_the_subject_s_true_values(recording):
    (experiment,) = experiments(recording.plan, [], stroked_visit(recording, ADAPTIVE.simulated_friction))
    function, truth = experiment.psychometric, SubjectSettings()
    assert function.answers == 40
    assert function.pse.low < 0.0 < function.pse.high
    assert function.jnd.low < QUARTILE * truth.discrimination < (function.jnd.high or 9.0)


def test_a_session_that_was_cut_short_goes_on_with_the_comparison_its_answers_ask_for(recording):
    answered_at = [n for n, event in enumerate(recording.events) if event.kind == "chosen"]
    for answers in (1, 7, 23):
        next_part = resumption(plan(ADAPTIVE, "S03", 3, forces=False), recording.events[: answered_at[answers - 1] + 2])
        assert isinstance(next_part.state, Mounting)
        assert next_part.state.position.trial == recording.trials[2 * answers].trial


def test_a_recording_of_a_later_kind_of_plan_is_not_read_by_a_program_that_would_not_follow_the_answers(recording):
    assert recording.head["format"]["version"] == 3
    stood_for = [trial["stimulus"]["index"] for trial in recording.head["plan"]["blocks"][0]["trials"]]
    assert {*stood_for} == {50, comparisons([record.trial for record in recording.trials])[0]}


def test_a_blinded_study_refuses_an_adaptive_block(tmp_path):
    text = (FOLDER / "adaptive-comparison.toml").read_text()
    with pytest.raises(StudyError, match=r"friction is adaptive .* unblinded"):
        create_study(tmp_path / "s", text, 1, blinded=True)
    assert not (tmp_path / "s").exists()
