"""Constant stimuli from protocol to report: simulated people compare, and what was planted in them comes back."""

from collections import Counter
from types import SimpleNamespace

import pytest

from daq_app.console import Console
from daq_app.simulation.synthetic import conduct
from daq_app.simulation.wiring import SimulatedPeople, planted_surface
from drivers.clock import SimulatedClock
from sessions.plan.protocols import plan, protocol
from sessions.recording import Recording
from sessions.report import experiments, with_psychometric
from sessions.report.tables.scales import (
    psychometric_sentences,
    psychometric_table,
    session_functions,
    study_functions,
)
from sessions.statistics.pooled import constant_stimuli
from sessions.statistics.psychometric import QUARTILE
from sessions.statistics.visit import VisitOptions, visit_of
from sessions.strokes.stroke import FIXED
from simulators.subject import SimulatedSubject, SubjectSettings


def session(folder, seed):
    """Return a visit that only compares, run and read again."""
    clock = SimulatedClock()
    people = SimulatedPeople(SimulatedSubject(seed), clock)
    planned = plan(protocol("constant-stimuli"), f"S{seed:02d}", seed, forces=False)
    conduct(planned, folder, people, Console(as_json=True), durable=False)
    return Recording.open(folder)


def felt(recording, planted=()):
    """Return as an analysis the friction that the simulated bench plants in every stroke."""
    surfaces = {record.trial.number: planted_surface(record.trial, planted) for record in recording.trials}
    return SimpleNamespace(friction=[SimpleNamespace(trial=n, mu=surface.mu) for n, surface in surfaces.items()])


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return session(tmp_path_factory.mktemp("constant") / "S03", 3)


def test_the_function_of_a_session_holds_what_was_planted_in_the_subject(recording):
    judged = experiments(recording.plan, [], {}, None, FIXED)
    found = with_psychometric(judged, recording, felt(recording))
    planted = SubjectSettings()
    for one in found:
        function = one.psychometric
        assert function.answers == 40
        assert function.pse.low < 0.0 < function.pse.high
        assert function.jnd.low < QUARTILE * planted.discrimination < (function.jnd.high or 9.0)
        assert function.lapse.low <= planted.lapse <= function.lapse.high
    report = SimpleNamespace(experiments=found)
    shown = psychometric_table(session_functions(report))
    assert [group.name for group in shown.groups] == ["friction, pushed", "friction, pulled"]
    assert shown.groups[0].rows[0][1].text == "40"
    said = psychometric_sentences(session_functions(report)[0])
    assert said[0].startswith("Friction, pushed: by 40 answers the surface felt equal to the standard has ")


def test_without_forces_a_study_has_no_function_and_says_why(recording):
    visit = visit_of(recording, VisitOptions(), {})
    assert Counter(row.standard for row in visit.rows) == {50: 80, 55: 80}
    found = constant_stimuli([(visit, row) for row in visit.rows if row.descriptor == "stickiness"])
    assert "no friction was measured" in found.functions["S03"].reason
    study = SimpleNamespace(descriptors=[SimpleNamespace(descriptor="stickiness", constant_stimuli=found)])
    assert "no friction was measured" in psychometric_sentences(study_functions(study)[0])[0]
    (row,) = psychometric_table(study_functions(study)).groups[0].rows
    assert [cell.text for cell in row[2:]] == ["–"] * 5


def test_a_study_has_the_geometric_means_of_its_subjects(recording, tmp_path):
    trials = []
    for number, one in enumerate([recording, session(tmp_path / "4", 4), session(tmp_path / "5", 5)]):
        visit = visit_of(one, VisitOptions(), {})
        mu = {friction.trial: friction.mu for friction in felt(one).friction}
        visit = SimpleNamespace(session=str(number), subject=visit.subject, rows=visit.rows)
        for row in visit.rows:
            if row.descriptor == "stickiness":
                copy = SimpleNamespace(
                    index=row.index, before=row.before, choice=row.choice, standard=row.standard, mu=mu[row.trial]
                )
                trials.append((visit, copy))
    found = constant_stimuli(trials)
    assert list(found.functions) == ["S03", "S04", "S05"]
    assert found.pse.n == 3
    assert found.pse.mean == pytest.approx(sum(one.pse.value for one in found.functions.values()) / 3)
    study = SimpleNamespace(descriptors=[SimpleNamespace(descriptor="stickiness", constant_stimuli=found)])
    shown = psychometric_table(study_functions(study))
    assert [row[0].text for row in shown.groups[0].rows] == ["S03", "S04", "S05", "geometric mean"]
    (said,) = psychometric_sentences(study_functions(study)[0])
    assert said.startswith("Stickiness: over 3 of 3 subjects the surface felt equal to the standard has ")
