"""Simulated people judge each stroke anew, as people do."""

from dataclasses import replace

from msgspec import structs

from daq_app.console import Console
from daq_app.simulation.synthetic import conduct
from daq_app.simulation.wiring import SimulatedPeople
from drivers.clock import SimulatedClock
from sessions.plan.protocols.planning import plan
from sessions.plan.protocols.protocol import protocol
from sessions.recording import Recording
from sessions.run import steps
from simulators.subject import SimulatedSubject

SURFACES = (0, 20, 50, 80, 100)
SPREAD = 4.0  # of judgements of one surface: the standard deviation in `SubjectSettings`


def plan_of_two_blocks(seed):
    """Return a plan in which two blocks hold the same surfaces, each of them twice."""
    whole = protocol("sensotact-friction")
    block = structs.replace(whole.blocks[0], repetitions=2)
    return plan(
        replace(whole, blocks=(block, structs.replace(block, name="again")), translations=()), "S01", seed, forces=False
    )


def scores(folder, seed):
    """Return the scores of each surface in the order of a visit, by index."""
    people = SimulatedPeople(SimulatedSubject(seed), SimulatedClock())
    conduct(plan_of_two_blocks(seed), folder, people, Console(as_json=True), durable=False)
    answers = {record.trial.number: record.score for record in Recording.open(folder).trials}
    trials = plan_of_two_blocks(seed).trials
    return {index: [answers[t.number] for t in trials if t.stimulus.known_index == index] for index in SURFACES}


def test_a_surface_is_scored_anew_in_every_block_and_repetition_and_alike_from_the_same_seed(tmp_path):
    visit = scores(tmp_path / "one", 4)
    assert visit == scores(tmp_path / "same seed", 4)
    for answers in (visit[20], visit[50], visit[80]):  # the ends of the line hold no scores beyond them
        assert len(set(answers)) == 4
        assert max(answers) - min(answers) < 6.0 * SPREAD


def test_a_person_of_a_resumed_session_goes_on_where_it_was_interrupted():
    trials = plan_of_two_blocks(3).trials
    whole, resumed = (SimulatedPeople(SimulatedSubject(3), SimulatedClock()) for _ in range(2))
    for trial in trials:
        whole.show(steps.AskStroke(trial, 1))
    for trial in trials[:12]:
        resumed.count_stroke(trial)
    for trial in trials[12:]:
        resumed.show(steps.AskStroke(trial, 1))
    assert [resumed.score(trial) for trial in trials] == [whole.score(trial) for trial in trials]
