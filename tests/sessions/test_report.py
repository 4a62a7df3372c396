import dataclasses
import math
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from recordings import PLAN, TRIAL
from report_session import record
from stand_ins import CALIBRATION, INFO

from drivers.clock import SimulatedClock
from drivers.readings import ReadingBlock
from sessions.plan.plan import Frame, SessionPlan
from sessions.prediction import PredictionOptions, predict
from sessions.recording import LoggedEvent, Recording, SessionWriter, provenance
from sessions.recording.log import trial_records
from sessions.report import Further, experiments, findings
from sessions.report.contents import GroundTruth
from sessions.report.facts import exclusion_sentences, people, remarks
from sessions.report.figures.relation import relation_panel
from sessions.report.pages import page
from sessions.report.prose import summary
from sessions.report.tables.session import relation_table
from sessions.report.trials import _extremes, course
from sessions.report.wording import shown_response
from sessions.statistics.scores import Score, ScoreTable, score_table
from sessions.statistics.visit import scores_of, visit_from
from sessions.strokes.analysis import analyse


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """A session on the simulated bench, its third trial stroked twice; recording, analysis, ground truth."""
    folder, strokes = record(tmp_path_factory.mktemp("bench") / "P01", discard=3)
    recording = Recording.open(folder)
    truth = [GroundTruth(trial, p.mu, p.tau_max, p.speed, p.direction) for trial, p in strokes]
    return recording, analyse(recording), truth


@pytest.fixture(scope="module")
def report(session):
    recording, analysis, truth = session
    return findings(recording, analysis, ground_truth=truth)


@pytest.fixture(scope="module")
def prediction_and_report(session):
    recording, analysis, truth = session
    prediction = predict(analysis, recording.plan)
    return prediction, findings(recording, analysis, prediction, ground_truth=truth)


def record_foreign(folder, *, press=2.0):
    """Record two strokes without a plan, as wrenches in N and N mm."""
    time = np.arange(0, 8, 0.005)
    normal = press * (((time > 2) & (time < 4)) | ((time > 5) & (time < 7)))
    noise = np.random.default_rng(1).normal(0, 0.003, (len(time), 6))
    wrench = np.column_stack([0.5 * normal, 0 * time, -normal, 0 * time, 20 * time % 40 * normal, 0 * time]) + noise
    plan = SessionPlan("import", "", 0, "none", (), True, Frame())
    info = dataclasses.replace(
        INFO,
        simulated=False,
        model="force plate",
        calibration=dataclasses.replace(CALIBRATION, raw_unit="N, N mm", matrix=np.eye(6)),
    )
    clock = SimulatedClock()
    writer = SessionWriter.create(folder, plan, info, provenance(clock), clock=clock)
    counter = np.arange(len(time))
    writer.readings(ReadingBlock(counter, counter, 0 * counter, time, (time * 1e9).astype(np.int64), wrench))
    writer.event("ended", data={})
    writer.close()
    return Recording.open(folder)


def visit(subject, value, *, simulated=False):
    return ScoreTable(f"visit of {subject}", subject, simulated, (Score(subject, "stickiness", 50, value),))


def test_every_stroke_is_within_two_per_cent_of_its_ground_truth(report):
    assert [s.trial for s in report.strokes] == [p.trial for p in report.ground_truth]
    for stroke, truth in zip(report.strokes, report.ground_truth, strict=True):
        assert stroke.mu_dynamic == pytest.approx(truth.mu, rel=0.02)
        assert stroke.tau_max == pytest.approx(truth.tau_max, rel=0.03)
        assert stroke.direction == truth.direction


def test_the_course_of_a_stroke_starts_at_its_onset(report):
    for stroke in report.strokes:
        assert stroke.trace.origin == stroke.onset
        assert 0 <= stroke.trace.time[0] < 0.01
        assert stroke.trace.time[-1] == pytest.approx(stroke.lift - stroke.onset, abs=0.01)


def test_a_discarded_take_is_named_among_what_was_excluded(report):
    assert any("Take 1 of trial 3" in sentence and "slipped off" in sentence for sentence in report.excluded)


def test_scores_of_other_visits_are_joined_by_subject(session):
    recording, analysis, _ = session
    own = score_table(recording)
    visits = [visit("P02", 40.0), visit("P03", 60.0), visit("P01", 0.0), own]
    report = findings(recording, analysis, scores=visits)
    (mean,) = [m for m in report.experiments[0].scores if m.index == 50]
    own_score = next(s.score for s in own.scores if (s.descriptor, s.index) == ("stickiness", 50))
    assert mean.n == 3
    assert mean.mean == pytest.approx((own_score / 2 + 40 + 60) / 3)
    assert list(report.experiments[0].answers) == ["P01", "P02", "P03"]


def test_two_blocks_on_one_descriptor_have_their_own_scores_each(session):
    recording, analysis, _ = session
    first = recording.plan.blocks[0]
    back = dataclasses.replace(
        first, name="back", trials=tuple(dataclasses.replace(t, block="back") for t in first.trials)
    )
    own = visit_from(recording, analysis, None, {}, {})
    rows = [row for row in own.rows if row.block == first.name]
    backwards = [dataclasses.replace(row, block="back", score=100.0 - row.score, sed=row.index) for row in rows]
    session_visit = dataclasses.replace(own, rows=(*rows, *backwards))
    elsewhere = visit("P02", 40.0)  # by a protocol without such blocks
    tables = (scores_of(session_visit, session_visit.rows), elsewhere)
    there, again = experiments(dataclasses.replace(recording.plan, blocks=(first, back)), tables, session_visit)
    for experiment, block_rows in ((there, rows), (again, backwards)):
        assert experiment.own_scores == {row.index: row.score for row in block_rows}
        assert experiment.answers["P02"][experiment.indices.index(50)] == 40.0
    scores, seds = zip(*((again.own_scores[row.index], row.sed) for row in backwards), strict=True)
    assert again.own_relation.pearson == pytest.approx(np.corrcoef(scores, seds)[0, 1])


def test_the_scores_of_whoever_made_the_strokes_stand_beside_the_mean_of_all(session, prediction_and_report):
    recording, analysis, _ = session
    own = score_table(recording)
    own_alone = findings(recording, analysis, prediction_and_report[0], scores=[own]).experiments[0]
    assert (own_alone.own_relation, own_alone.own_scores) == (None, {})  # the mean is the own one
    report = findings(recording, analysis, prediction_and_report[0], scores=[own, visit("P02", 40.0)])
    experiment = report.experiments[0]
    own_by_index = {s.index: s.score for s in own.scores if s.descriptor == "stickiness"}
    seds = {p.index: p.sed for p in report.predictions if p.experiment == experiment.name}
    pairs = [(own_by_index[index], seds[index]) for index in own_by_index]
    assert experiment.own_scores == own_by_index
    assert experiment.own_relation.pearson == pytest.approx(np.corrcoef(np.transpose(pairs))[0, 1])
    rows = [row[0].text for row in relation_table(report).groups[0].rows]
    assert rows == ["mean score", "own score", "index"]
    panel = relation_panel(experiment, [p for p in report.predictions if p.experiment == experiment.name])
    assert {row[0]: row[panel.header.index("own score [points, 0 to 100]")] for row in panel.rows} == own_by_index


def test_a_simulated_session_says_so_in_its_first_line(report):
    assert report.simulated
    assert report.head.startswith("SIMULATED: the transducer and the subject")


def test_one_simulated_visit_among_the_scores_makes_the_report_simulated(tmp_path):
    recording = record_foreign(tmp_path / "real")
    real = findings(recording, analyse(recording), scores=[visit("P02", 40.0)])
    with_simulated = findings(
        recording, analyse(recording), scores=[visit("P02", 40.0), visit("P03", 50.0, simulated=True)]
    )
    assert (real.simulated, real.head) == (False, "")
    assert with_simulated.simulated
    assert with_simulated.head == "SIMULATED: 1 of the sessions whose scores are used here is simulated"


def test_a_recording_without_a_plan_gives_a_report_of_its_strokes(tmp_path):
    recording = record_foreign(tmp_path / "wipes")
    report = findings(recording, analyse(recording))
    assert [s.number for s in report.strokes] == [1, 2]
    assert report.experiments == ()
    text = page(report)
    assert "Forces and friction" in text
    assert "SIMULATED" not in text


def test_a_visit_for_scores_only_gives_a_report_of_its_scores(tmp_path):
    folder, _ = record(tmp_path / "P04", subject="P04", forces=False)
    recording = Recording.open(folder)
    report = findings(recording, analyse(recording))
    assert report.course is None
    assert report.strokes == ()
    assert sum(len(e.scores) for e in report.experiments) == 10
    assert "none: a visit for scores only" in page(report, ())


def test_a_value_that_nobody_set_is_marked(report):
    remarks = {fact.name: fact.remark for fact in report.apparatus}
    assert remarks["contact area"].startswith("default")
    assert remarks["height of the face"] == "measured"


def test_a_number_withheld_carries_the_sentence_of_its_flaw(tmp_path):
    recording = record_foreign(tmp_path / "light", press=0.2)
    report = findings(recording, analyse(recording))
    sentences = {fact.name: fact.value for fact in report.flaws}
    assert report.strokes
    for stroke in report.strokes:
        assert stroke.mu_dynamic is None
        assert stroke.reasons["mu_dynamic"] == sentences["too little force"]


def test_predictions_enter_with_their_forces_times_the_width_beside_the_measured_ones(prediction_and_report):
    prediction, report = prediction_and_report
    assert report.width == 15.0
    for row, source in zip(report.predictions, prediction.trials, strict=True):
        assert (row.trial, row.sed, row.matching_depth) == (source.trial, source.sed, source.matching_depth)
        assert row.normal_force == pytest.approx(row.normal_per_mm * 15.0)
        stroke = next(s for s in report.strokes if s.trial == row.trial)
        assert row.measured_normal == stroke.normal_force


def test_the_published_finding_comes_out_of_its_own_numbers(prediction_and_report):
    _, report = prediction_and_report
    sticky, slippery = report.experiments
    assert sticky.index_relation.pearson >= 0.95
    assert slippery.index_relation.pearson <= -0.85
    sed = {(p.experiment, p.index): p.sed for p in report.predictions}
    assert sed["slipperiness", 55] < sed["slipperiness", 75]  # because its measured mu is lower


def test_another_quantity_than_the_sed_is_held_against_scores_in_figure_table_and_words(session):
    recording, analysis, _ = session
    prediction = predict(analysis, recording.plan)
    report = findings(recording, analysis, prediction, further=Further(response="shear_along_skin"))
    # The published friction alone fixes the sign: the shear along the skin rises with stickiness, and it falls with
    # slipperiness (docs/explanation/which-response.md, from another mesh).
    sticky, slippery = report.experiments
    assert sticky.index_relation.pearson >= 0.95
    assert slippery.index_relation.pearson <= -0.8
    shear = {row.trial: row.prediction.responses["shear_along_skin"].value for row in prediction.trials}
    response = shown_response("shear_along_skin")
    assert [response.numbers(p)[0] for p in report.predictions] == [shear[p.trial] for p in report.predictions]
    assert any("shear along the skin predicted" in sentence for sentence in summary(report))
    assert "shear along the skin" in relation_table(report).caption
    assert any("--quantity shear_along_skin" in line for line in report.commands)
    panel = relation_panel(sticky, [p for p in report.predictions if p.experiment == sticky.name])
    assert "shear along the skin [-]" in panel.header


def test_the_finger_of_each_experiment_lies_on_the_surface_and_is_pressed_where_it_touches(prediction_and_report):
    _, report = prediction_and_report
    assert [(f.experiment, f.index) for f in report.fields] == [("stickiness", 100), ("slipperiness", 100)]
    for field in report.fields:
        touching = [i for i, state in enumerate(field.skin.state) if state != "open"]
        assert field.finger.nodes[:, 1].min() == pytest.approx(0.0, abs=1e-6)
        assert field.skin.gap[touching] == pytest.approx(0.0, abs=1e-6)
        assert (field.skin.pressure[touching] >= 0).all()
        way = {"stickiness": -1, "slipperiness": 1}[field.experiment]  # friction opposes the stroke
        assert (way * field.skin.traction[touching] >= 0).all()


def test_the_page_says_what_was_left_out_and_how_much_it_may_matter(prediction_and_report):
    _, report = prediction_and_report
    omissions = {fact.name: fact for fact in report.left_out}
    assert {"finite strain", "viscosity", "bone compliance", "inertia"} <= set(omissions)
    assert "% of the SED" in omissions["viscosity"].value
    warnings = [fact.value for fact in report.left_out if fact.name == "warning"]
    assert len({re.sub(r"[\d.]+", "#", sentence) for sentence in warnings}) == len(warnings)
    (checks,) = [fact.value for fact in report.modelled if fact.name == "audits"]
    assert "smallest volume ratio: 0." in checks
    assert "det F" not in checks
    assert "What was modelled, and what was left out" in page(report, ())  # its words alone


def test_a_trial_without_friction_keeps_its_row_with_a_dash_and_the_reason(tmp_path):
    recording = record_foreign(tmp_path / "light", press=0.2)
    analysis = analyse(recording)
    report = findings(
        recording, analysis, predict(analysis, recording.plan, PredictionOptions(indentation=1.0, course="steady"))
    )
    assert [p.sed for p in report.predictions] == [None, None]
    for row in report.predictions:
        assert "too_little_force" in row.reasons["sed"]
        assert row.reasons["error_estimate"] == row.reasons["sed"]
    assert "The stroke gives no coefficient of friction" in page(report, ())


def test_strokes_without_a_plan_are_predicted_at_the_depth_given_for_them(tmp_path):
    recording = record_foreign(tmp_path / "wipes")
    analysis = analyse(recording)
    report = findings(
        recording, analysis, predict(analysis, recording.plan, PredictionOptions(indentation=1.0, course="steady"))
    )
    assert [p.stroke for p in report.predictions] == [1, 2]
    assert "Predicted responses" in page(report, ())


def test_the_forces_of_the_whole_recording_are_broken_where_readings_are_missing(tmp_path):
    record_foreign(tmp_path / "whole")
    recording = Recording.open(tmp_path / "whole")
    assert not np.isnan(course(recording).normal).any()
    before, after = 500, 700  # 1 s is missing in the middle of the first stroke

    class Cut:
        info, plan = recording.info, recording.plan

        def readings(self):
            block = recording.readings()
            return ReadingBlock.concatenate([block.between(0, before), block.between(after, len(block))])

    forces = course(Cut())
    (gaps,) = np.flatnonzero(np.isnan(forces.normal))
    assert np.flatnonzero(np.isnan(forces.tangential)) == [gaps]
    ends = forces.time[gaps - 1], forces.time[gaps + 1]
    assert ends == pytest.approx([(before - 1) * 0.005, after * 0.005], abs=1e-9)


def test_a_short_pull_sideways_is_in_the_picture_of_the_whole_recording_though_the_normal_force_stays(tmp_path):
    record_foreign(tmp_path / "whole")
    recording = Recording.open(tmp_path / "whole")

    class Pulled:
        info, plan = recording.info, recording.plan

        def readings(self):
            time = np.arange(20_000) / 200.0
            raw = np.zeros((len(time), 6))
            raw[:, 2] = -2.0 + 0.1 * np.sin(7.0 * time)
            raw[12_345, 0] = 5.0
            count = np.arange(len(time))
            return ReadingBlock(count, count, 0 * count, time, (time * 1e9).astype(np.int64), raw)

    assert max(course(Pulled()).tangential) == 5.0


def test_one_stroke_without_friction_is_one_stroke_and_several_are_strokes(tmp_path):
    recording = record_foreign(tmp_path / "light", press=0.2)
    excluded = findings(recording, analyse(recording)).excluded
    assert any(sentence.startswith("No dynamic friction is given for strokes 1, 2:") for sentence in excluded)


def test_what_became_of_each_trial_that_does_not_count_is_reported():
    line, choice = TRIAL, replace(TRIAL, answer="choice")
    trials = tuple(replace(trial, number=n) for n, trial in enumerate((line, line, choice, line, line), 1))
    plan = replace(PLAN, blocks=(replace(PLAN.blocks[0], trials=trials),))
    log = [
        *(("take_started", 1, {"take": 1}), ("take_discarded", 1, {"take": 1, "reason": "the finger slipped off"})),
        *(("take_started", 1, {"take": 2}), ("scored", 1, {"score": 40.0}), ("take_kept", 1, {"take": 2})),
        *(("take_started", 2, {"take": 1}), ("scored", 2, {"score": None}), ("take_kept", 2, {"take": 1})),
        *(("take_started", 3, {"take": 1}), ("chosen", 3, {"choice": None}), ("take_kept", 3, {"take": 1})),
        *(("skip", 4, {}), ("take_started", 5, {"take": 1})),
    ]
    events = [LoggedEvent(n, n, kind, trial, 0, data) for n, (kind, trial, data) in enumerate(log, 1)]
    recording = SimpleNamespace(trials=trial_records(plan, events), losses=("block 4 is damaged",))
    analysis = SimpleNamespace(decisions=())
    assert exclusion_sentences(recording, analysis, ()) == (
        "Take 1 of trial 1 does not count (discarded: the finger slipped off); its readings are kept.",
        "Trial 4 was skipped.",
        "Take 1 of trial 5 does not count (the recording ended in it); its readings are kept.",
    )
    assert remarks(recording, analysis, ()) == (
        "Lost: block 4 is damaged.",
        "Trial 2 has no score: the subject did not answer.",
        "Trial 3 has no answer: the subject did not answer.",
        "Trial 5 was not done: the session ended before.",
    )


def test_who_took_part_and_what_of_the_finger_was_measured_is_reported():
    finger = replace(PLAN.finger, tip_radius=6.5, width=None)
    plan = replace(PLAN, finger=finger, contact_angle=30.0, contact_angle_origin="measured", masking="pink noise")
    tables = [SimpleNamespace(subject=subject, scores=scores) for subject, scores in (("S02", (1,)), ("S01", (2,)))]
    facts = people(
        SimpleNamespace(plan=plan, trials=()), [*tables, *tables[:1], SimpleNamespace(subject="S9", scores=())]
    )
    by_name = {fact.name: (fact.value, fact.remark) for fact in facts}
    assert by_name["subject"][0] == "S01"
    assert by_name["subjects who scored"] == ("2: S01, S02", "in 3 sessions")
    assert by_name["protocol"][0] == "made-up"
    assert by_name["stimulus order"] == ("shuffled", "seed 7")
    assert by_name["stickiness"][0].endswith("; scale: 0 “not at all”, 100 “äußerst”.")
    assert "Stimulus 20, stroked proximal to distal" in by_name["stickiness"][0]
    assert by_name["the subject's finger: tip radius"] == ("6.5 mm", "measured")
    assert "the subject's finger: width" not in by_name
    assert by_name["contact angle"] == ("30°", "measured")
    assert by_name["masking of sounds"][0] == "pink noise"


@given(st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=5000))
def test_thinning_keeps_both_ends_and_the_greatest_and_least_force(values):
    array = np.array(values)
    indices = _extremes(array)
    assert (indices[0], indices[-1]) == (0, len(values) - 1)
    assert (array[indices].min(), array[indices].max()) == (array.min(), array.max())
    assert math.isfinite(array[indices].sum())
