"""Constant stimuli from protocol to report: simulated people compare, and intervals hold their true values."""

from collections import Counter
from dataclasses import replace
from types import SimpleNamespace

import pytest

from daq_app.console import Console
from daq_app.simulation.synthetic import conduct
from daq_app.simulation.wiring import SimulatedPeople, simulated_surface
from drivers.clock import SimulatedClock
from sessions.plan.protocols.planning import plan
from sessions.plan.protocols.protocol import protocol
from sessions.recording import Recording
from sessions.report import experiments
from sessions.report.tables.scales import (
    psychometric_sentences,
    psychometric_table,
    session_functions,
    study_functions,
)
from sessions.statistics.pooled import constant_stimuli
from sessions.statistics.psychometric import QUARTILE
from sessions.statistics.visit import VisitOptions, visit_of
from simulators.subject import SimulatedSubject, SubjectSettings


def session(folder, seed):
    """Return a visit that only compares, run and read again."""
    clock = SimulatedClock()
    people = SimulatedPeople(SimulatedSubject(seed), clock)
    session_plan = plan(protocol("constant-stimuli"), f"S{seed:02d}", seed, forces=False)
    conduct(session_plan, folder, people, Console(as_json=True), durable=False)
    return Recording.open(folder)


def stroked_visit(recording, friction=()):
    """Return the visit with the friction that the simulated bench has in every stroke."""
    visit = visit_of(recording, VisitOptions(), {})
    mu = {record.trial.number: simulated_surface(record.trial, friction).mu for record in recording.trials}
    return replace(visit, rows=tuple(replace(row, mu=mu[row.trial]) for row in visit.rows))


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return session(tmp_path_factory.mktemp("constant") / "S03", 3)


def test_the_intervals_of_a_session_hold_the_subject_s_true_values(recording):
    outcomes = experiments(recording.plan, [], stroked_visit(recording))
    truth = SubjectSettings()
    for outcome in outcomes:
        function = outcome.psychometric
        assert function.answers == 40
        assert function.pse.low < 0.0 < function.pse.high
        assert function.jnd.low < QUARTILE * truth.discrimination < (function.jnd.high or 9.0)
        assert function.lapse.low <= truth.lapse <= function.lapse.high
    report = SimpleNamespace(experiments=outcomes)
    table = psychometric_table(session_functions(report))
    assert [group.name for group in table.groups] == ["friction, pushed", "friction, pulled"]
    assert table.groups[0].rows[0][1].text == "40"
    sentences = psychometric_sentences(session_functions(report)[0])
    assert sentences[0].startswith("Friction, pushed: by 40 answers the surface felt equal to the standard has ")


def test_without_forces_a_study_has_no_function_and_says_why(recording):
    visit = visit_of(recording, VisitOptions(), {})
    assert Counter(row.standard for row in visit.rows) == {50: 80, 55: 80}
    stimuli = constant_stimuli([(visit, row) for row in visit.rows if row.descriptor == "stickiness"])
    assert "no comparison has a measured friction" in stimuli.functions["S03"].reason
    study = SimpleNamespace(descriptors=[SimpleNamespace(descriptor="stickiness", constant_stimuli=stimuli)])
    assert "no comparison has a measured friction" in psychometric_sentences(study_functions(study)[0])[0]
    (row,) = psychometric_table(study_functions(study)).groups[0].rows
    assert [cell.text for cell in row[2:]] == ["–"] * 5


def test_a_study_has_the_geometric_means_of_its_subjects(recording, tmp_path):
    trials = []
    for session_recording in (recording, session(tmp_path / "4", 4), session(tmp_path / "5", 5)):
        visit = stroked_visit(session_recording)
        trials += [(visit, row) for row in visit.rows if row.descriptor == "stickiness"]
    stimuli = constant_stimuli(trials)
    assert list(stimuli.functions) == ["S03", "S04", "S05"]
    assert stimuli.pse.n == 3
    assert stimuli.pse.mean == pytest.approx(sum(s.pse.value for s in stimuli.functions.values()) / 3)
    study = SimpleNamespace(descriptors=[SimpleNamespace(descriptor="stickiness", constant_stimuli=stimuli)])
    table = psychometric_table(study_functions(study))
    assert [row[0].text for row in table.groups[0].rows] == ["S03", "S04", "S05", "geometric mean"]
    (sentence,) = psychometric_sentences(study_functions(study)[0])
    assert sentence.startswith("Stickiness: over 3 of 3 subjects the surface felt equal to the standard has ")
