"""Visits pooled: who counts, what is compared with what, and the table of trials as others read it."""

import csv
import io
from dataclasses import asdict, replace

import msgspec
import numpy as np
import pytest
from study_example import INDICES, study, visit

from sessions.prediction import BY_NAME, PredictionOptions
from sessions.report.pages import study_page, trials_csv
from sessions.report.study_prose import command, exclusion_sentences, remarks, summary
from sessions.report.tables.study import study_tables
from sessions.report.tables.study_models import missing_scores
from sessions.statistics.findings import CARRY_OVER, DRIFT, FRICTION, INDEX, SED_TERM, WITHIN
from sessions.statistics.multiverse import PATHS
from sessions.statistics.pooled import pool_visits
from sessions.statistics.visit import Exclusion, Visit, VisitOptions, exclusions_in
from sessions.strokes.stroke import HERTZ_EXPONENT, AreaLaw
from sessions.toml_file import SettingsError

VISITS = [visit(number) for number in range(1, 11)]


@pytest.fixture
def words_alone(monkeypatch):
    """Draw nothing for a page of which the words are read."""
    monkeypatch.setattr("sessions.report.pages.study_plates", lambda _: ())


def test_the_order_in_which_visits_come_changes_no_bit():
    assert pool_visits(VISITS) == pool_visits(VISITS[::-1])


def test_a_visit_survives_its_way_through_plain_data():
    assert msgspec.convert(asdict(VISITS[0]), Visit) == VISITS[0]


def test_a_study_says_what_to_type_for_its_numbers():
    model = PredictionOptions("as-printed", course="steady", kinematics="finite", intervals=True)
    visit_options = VisitOptions(model, AreaLaw("hertz", HERTZ_EXPONENT, 1.234567891), "finite", 0.003)
    options = "--kinematics finite --tau as-printed --area hertz --area-force 1.234567891 --calibration-error 0.3"
    expected = f"daq-app study 'my study' {options} --intervals --paths finite"
    assert command(pool_visits(VISITS, options=visit_options), "my study") == expected
    truth = {"score": {"gain": 0.8, "drift": 0.4, "carry_over": 0.0}, "strokes": [], "seed": 21}
    assert command(pool_visits(VISITS, ground_truth=truth), "syn") == "daq-app study --synthetic 21 --out syn"


def test_true_gain_drift_and_carry_over_stand_beside_their_estimates():
    truth = {"score": {"gain": 0.8, "drift": 0.4, "carry_over": 0.0}, "strokes": []}
    effects = {effect.effect: effect for effect in pool_visits(VISITS, ground_truth=truth).effects}
    assert set(effects) == {INDEX, FRICTION, DRIFT, CARRY_OVER}
    assert effects[INDEX].estimate == pytest.approx(0.8, abs=0.05)
    assert effects[INDEX].covered


def test_the_true_relation_of_people_at_large_stands_beside_the_intervals_for_them():
    score = {"gain": 0.0, "drift": 0.0, "carry_over": 0.0}
    truth = {"score": score, "strokes": [], "relation": {"stickiness": {"r": 0.9, "slope": 60.0}}}
    findings = pool_visits(VISITS, ground_truth=truth)
    effects = {effect.effect: effect for effect in findings.effects}
    finding = findings.descriptors[0]
    assert (effects[WITHIN].true_value, effects[WITHIN].low, effects[WITHIN].high) == (0.9, *finding.repeated.people)
    assert (effects[SED_TERM].true_value, effects[SED_TERM].low) == (60.0, finding.on_response.term(SED_TERM).low)


@pytest.mark.usefixtures("words_alone")
def test_a_decision_leaves_a_subject_out_of_every_number_and_is_reported():
    out = (Exclusion("S03", "asked to", "the experimenter"),)
    findings, without = pool_visits(VISITS, exclusions=out), pool_visits([v for v in VISITS if v.subject != "S03"])
    assert findings.descriptors == without.descriptors
    assert len(findings.visits) == 10
    assert "asked to" in study_page(findings, "x")


@pytest.mark.usefixtures("words_alone")
def test_the_same_recording_in_two_folders_counts_once_and_is_named():
    first, again = (replace(VISITS[0], session=name, content_sha256="a" * 64) for name in ("S01", "S01-backup"))
    findings = pool_visits([*VISITS[1:], again, first])
    assert findings.descriptors == pool_visits([*VISITS[1:], first]).descriptors
    assert "Session S01-backup holds the same recording as S01" in study_page(findings, "x")
    assert trials_csv(findings).count("the same recording as S01") == 5


def test_scores_that_fall_with_the_index_are_doubted_and_kept():
    findings = pool_visits([*VISITS[:9], visit(10, gain=-0.8)])
    assert [(subject, descriptor) for subject, descriptor, _ in findings.reversed] == [("S10", "stickiness")]
    assert findings.descriptors[0].scores[0].n == 10
    assert (
        summary(findings)[2]
        == "The stickiness scores of 1 of 10 subjects fall as the index rises; the appendix names each."
    )
    assert not [sentence for sentence in summary(pool_visits(VISITS)) if "fall as" in sentence]


def test_visits_that_only_scored_give_means_and_no_relation():
    finding = pool_visits([visit(number, sed=None) for number in range(1, 5)]).descriptors[0]
    assert finding.mean_relation is None
    assert finding.repeated is None
    assert "three subjects with scores and a predicted SED, and there are none" in finding.on_response
    assert [mean.n for mean in finding.scores] == [4] * 5


def test_choices_of_one_of_two_stand_in_the_table_and_are_told_to_count_for_no_mean():
    chooser = visit(2)
    rows = tuple(replace(row, outcome="chosen", score=None, choice="first") for row in chooser.rows)
    findings = pool_visits([visit(1), replace(chooser, rows=rows)])
    assert [r for r in remarks(findings) if "S02" in r and f"{len(rows)} choices of one of two" in r]
    table = list(csv.DictReader(io.StringIO(trials_csv(findings))))
    assert {row["choice"] for row in table if row["session"] == "S02"} == {"first"}
    (trials,) = study_tables(findings)["trials"]
    assert {row[2].text for row in trials.groups[1].rows} == {"first"}


def test_numbers_and_choices_are_answers_of_a_visit_as_scores_are():
    def answered(v, **answer):
        return replace(v, rows=tuple(replace(row, score=None, **answer) for row in v.rows))

    visits = [VISITS[0], answered(VISITS[1], estimate=7.0), answered(VISITS[2], choice="second"), answered(VISITS[3])]
    (table,) = study_tables(pool_visits(visits))["visits"]
    assert [row[2].text for row in table.groups[0].rows] == ["5 of 5", "5 of 5", "5 of 5", "0 of 5"]


def test_every_heading_of_a_table_has_its_brackets_in_pairs():
    tables = [table for section in study_tables(study()).values() for table in section]
    assert not [column for table in tables for column in table.columns if set("[]") & set(column.name + column.unit)]


def test_who_missed_a_surface_does_not_make_it_look_scored_low():
    level = {"S01": 10.0, "S02": 50.0, "S03": 90.0}
    visits = [visit(number, gain=0.0, noise=0.0) for number in (1, 2, 3)]
    flat = [replace(v, rows=tuple(replace(row, score=level[v.subject]) for row in v.rows)) for v in visits]
    flat[2] = replace(flat[2], rows=flat[2].rows[1:])
    (finding,) = pool_visits(flat).descriptors
    assert finding.mean_relation.pearson is None  # nothing within anybody varies


def test_repeats_of_one_subject_are_averaged_and_make_no_subjects():
    again = replace(visit(1), session="S01-again")
    assert all(mean.n == 1 for mean in pool_visits([visit(1), again]).descriptors[0].scores)


def test_the_table_has_one_line_of_heads_and_numbers_to_the_last_bit():
    rows = list(csv.DictReader(io.StringIO(trials_csv(pool_visits(VISITS)))))
    assert len(rows) == 50
    assert float(rows[0]["sed_MPa"]) == VISITS[0].rows[0].sed
    assert rows[0]["speed_mm_per_s"] == ""
    assert trials_csv(pool_visits([visit(1, simulated="SIMULATED: s")])).startswith("SIMULATED,")


@pytest.mark.usefixtures("words_alone")
def test_a_simulated_study_says_so_at_the_head_of_its_page():
    page = study_page(pool_visits([*VISITS[:2], visit(3, simulated="SIMULATED: s")]), "x")
    assert page.splitlines()[1].startswith("<!-- SIMULATED: 1 of the 3 sessions")


def test_decisions_are_read_from_their_file_and_a_wrong_one_is_named(tmp_path):
    assert exclusions_in(tmp_path) == ()
    path = tmp_path / "exclusions.toml"
    path.write_text('[[exclude]]\nsubject = "S1"\nwhy = "ill"\nwho = "me"\n')
    assert exclusions_in(tmp_path) == (Exclusion("S1", "ill", "me"),)
    for wrong in ('why = "ill"', 'why = "ill"\nwho = " "', 'why = ""\nwho = "me"'):
        path.write_text(f'[[exclude]]\nsubject = "S1"\n{wrong}\n')
        with pytest.raises(SettingsError, match="why" if '""' in wrong else "who"):
            exclusions_in(tmp_path)


def test_a_decision_that_fits_no_trial_is_told_as_such():
    exclusions = (Exclusion("S99", "ill", "E1"), Exclusion("S01", "bad", "E1", "sticky"), Exclusion("S02", "ill", "E1"))
    findings = pool_visits(VISITS[:3], exclusions=exclusions)
    assert [sentence.split(":")[0] for sentence in exclusion_sentences(findings)] == ["Subject S02"]
    assert [sentence.split("(")[0] for sentence in remarks(findings)] == [
        "A decision of E1 leaves out every trial of subject S99 ",
        "A decision of E1 leaves out trials on sticky of subject S01 ",
    ]


@pytest.mark.usefixtures("words_alone")
def test_scores_that_are_all_the_same_leave_a_reason_and_no_model():
    flat = [replace(v, rows=tuple(replace(row, score=50.0) for row in v.rows)) for v in VISITS]
    findings = pool_visits(flat)
    assert "no residuals remain to estimate an error" in findings.descriptors[0].on_index
    page = study_page(findings, "x")
    assert "No mixed model of stickiness on SED, stickiness on index" in page


def test_means_that_are_related_are_those_of_subjects_with_both():
    # The one subject whose stroke gives no SED scores far off: it must not move the other half of the comparison.
    odd = replace(VISITS[0], rows=tuple(replace(row, sed=None, score=99.0 - 0.9 * row.index) for row in VISITS[0].rows))
    relation = pool_visits([odd, *VISITS[1:]]).descriptors[0].mean_relation
    without = pool_visits(VISITS[1:]).descriptors[0].mean_relation
    assert relation.pearson == pytest.approx(without.pearson, rel=1e-12)


def test_scores_stand_raw_and_standardised_side_by_side():
    finding = pool_visits([*VISITS[:9], visit(10, gain=0.2)]).descriptors[0]
    # The tenth subject uses a quarter of the scale: standardised it agrees with the others.
    spread = [finding.normalised.means[index].sd for index in (0, 100)]
    assert all(sd < 0.15 for sd in spread)
    assert [mean.sd for mean in finding.scores if mean.index in (0, 100)] > [10.0, 10.0]
    assert finding.normalised.repeated.r > finding.repeated.r


def test_leaving_out_the_one_subject_who_differs_raises_the_correlation_most():
    finding = pool_visits([*VISITS[:9], visit(10, gain=-0.8)]).descriptors[0]
    assert max(finding.without_subject, key=lambda pair: pair[1])[0] == "S10"
    assert len(finding.without_subject) == 10


def test_magnitude_estimates_of_any_modulus_come_to_the_same_means_at_one_modulus():
    def estimate_visit(number, modulus):
        visit_with_scores = visit(number)
        rows = [replace(row, score=None, estimate=modulus * 2.0 ** (row.index / 50)) for row in visit_with_scores.rows]
        return replace(visit_with_scores, rows=tuple(rows))

    finding = pool_visits([estimate_visit(1, 1.0), estimate_visit(2, 100.0), estimate_visit(3, 10.0)]).descriptors[0]
    means = finding.estimates.equal_moduli
    assert [np.exp(means[i].mean) for i in (0, 50, 100)] == pytest.approx([10.0, 20.0, 40.0])
    assert all(mean.sd == pytest.approx(0.0, abs=1e-9) for mean in means.values())
    assert finding.estimates.geometric[0].sd > 2.0  # of the logarithms, as they were given
    assert finding.estimates.repeated.r > 0.9
    zero_visit = replace(VISITS[3], rows=tuple(replace(r, score=None, estimate=0.0) for r in VISITS[3].rows))
    assert pool_visits([estimate_visit(1, 1.0), zero_visit]).descriptors[0].estimates.left_out == ("S04",)


def test_a_simulated_flaw_that_nobody_names_is_not_detected():
    faults = {
        "S01": {"lost": 2, "expected": "trial 2: lost_readings"},
        "S02": {"unanswered": 3, "expected": "trial 3 has no score"},
        "S03": {"reversed": True, "expected": "backwards"},
        "S99": {"expected": "damaged"},
    }
    truth = {"score": {"gain": 0.8, "drift": 0.4, "carry_over": 0.0}, "strokes": [], "spoilt": faults}
    visits = [*VISITS[:2], visit(3, gain=-0.8)]
    assert [flaw.detected for flaw in pool_visits(visits, ground_truth=truth).flaws] == [False, False, True, False]
    lossy = replace(
        visits[0], rows=tuple(replace(r, flaws=("lost_readings",)) if r.trial == 2 else r for r in visits[0].rows)
    )
    flaws = pool_visits([lossy, *visits[1:]], [("S99", "damaged")], ground_truth=truth).flaws
    assert [flaw.detected for flaw in flaws] == [True, False, True, True]


def test_what_was_excluded_is_reported_with_who_and_why_and_trials_alike_together():
    study_findings = study()
    sentences = " ".join(exclusion_sentences(study_findings))
    assert "Subject S03: every trial left out by E02: used the scale backwards" in sentences
    decision_remark = "Session S04: decision 1 by E02: stroke 1 of trial 2 is kept: it was good."
    assert decision_remark in remarks(study_findings)
    assert decision_remark not in sentences
    rows = [replace(row, sed=None, why=f"No settled sliding at mu = 0.{row.trial}.") for row in VISITS[0].rows]
    (sentence,) = exclusion_sentences(pool_visits([replace(VISITS[0], rows=tuple(rows))]))
    assert sentence.startswith("The model gives no SED for 5 trials (S01 trial 1, S01 trial 2,")
    assert sentence.endswith("of the first: No settled sliding at mu = 0.1.")


def test_trials_that_the_session_did_not_come_to_are_not_done_and_nothing_was_excluded():
    rows = [replace(row, outcome="open", score=None, sed=None, why="The trial was not done.") for row in VISITS[0].rows]
    findings = pool_visits([replace(VISITS[0], rows=tuple(rows), complete=False), *VISITS[1:]])
    assert exclusion_sentences(findings) == []
    sentences = remarks(findings)
    assert "Session S01 ended before its last trial; what it holds counts." in sentences
    assert any(sentence.startswith("Not done: S01 trial 1, S01 trial 2") for sentence in sentences)


def test_a_subject_who_scored_in_two_sessions_is_named_for_it_may_be_two_people_under_one_code():
    again = replace(VISITS[0], session="again")
    (sentence,) = (one for one in remarks(pool_visits([*VISITS, again])) if "more than one session" in one)
    assert f"{again.subject} in {VISITS[0].session}, again." in sentence
    assert not any("more than one session" in one for one in remarks(pool_visits(VISITS)))


def test_a_recording_without_trials_is_told_to_count_nothing_and_not_to_have_ended_early():
    foreign = replace(VISITS[0], session="foreign", rows=(), complete=False)
    (sentence,) = (one for one in remarks(pool_visits([foreign, *VISITS[1:]])) if "foreign" in one)
    assert sentence.startswith("Session foreign has no trial of an experiment")
    assert sentence.endswith("is not counted.")


SENSE = {"small": 1.0, "finite": -1.0}  # of the SED along a path


def test_the_headline_says_whether_the_other_strain_was_tried_and_what_it_gave():
    plain = pool_visits(VISITS[:4])
    untried = summary(plain)[1]
    assert "at small strain go together by r = " in untried
    assert untried.endswith("at finite strain, which was not tried here, the sign may differ.")
    sentence = summary(pool_visits([opposite(v) for v in VISITS[:4]]))[1]
    assert f"at finite strain r = −{plain.descriptors[0].repeated.r:.2f}" in sentence
    assert "over the 20 trials with a prediction there" in sentence


def test_the_headline_states_the_range_of_the_mean_sed_over_the_surfaces():
    visits = [replace(v, rows=tuple(replace(row, sed=5.0 + row.index / 1000) for row in v.rows)) for v in VISITS[:4]]
    assert "over the surfaces the mean SED has a range of 2.0 %;" in summary(pool_visits(visits))[1]  # 5.0 to 5.1


def opposite(v):
    """Return a visit whose SEDs have the other sense at finite strain."""
    rows = (replace(row, rule="maximum", paths=tuple(SENSE[p.kinematics] * row.sed for p in PATHS)) for row in v.rows)
    return replace(v, rows=tuple(rows))


@pytest.mark.parametrize("subjects", [1, 2])
def test_the_headline_of_one_or_two_subjects_gives_the_r_of_the_other_strain_without_an_interval(subjects):
    """Between two subjects, or within one, r is the plain correlation of what is left of each subject's means."""
    visits = [opposite(v) for v in VISITS[:subjects]]
    left = np.hstack(
        [
            np.array([[row.sed, row.score] for row in v.rows]).T
            - np.mean([[r.sed, r.score] for r in v.rows], 0)[:, None]
            for v in visits
        ]
    )
    r = np.corrcoef(left)[0, 1]
    finite = f"{r:.4f}" if subjects == 1 else f"{r:.2f}"
    sentence = summary(pool_visits(visits))[1]
    assert f"at finite strain r = −{finite} (no interval) over the {5 * subjects} trials" in sentence


def test_the_headline_counts_the_trials_of_its_correlations_alone():
    visits = [
        replace(v, rows=tuple(replace(r, score=None, outcome="not answered") if r.trial == 2 else r for r in v.rows))
        for v in map(opposite, VISITS[:4])
    ]
    sentence = summary(pool_visits(visits))[1]
    assert " over 16 trials of 4 subjects on 5 surfaces, 95 % interval" in sentence
    assert sentence.endswith("over the 16 trials with a prediction there.")


def test_scored_strokes_without_a_prediction_are_not_said_to_be_missing():
    """At finite strain many sticky surfaces have no full slip, although each was stroked and scored."""
    one_each = [replace(v, rows=tuple(r if r.index == 0 else replace(r, sed=None) for r in v.rows)) for v in VISITS]
    assert summary(pool_visits(one_each))[1] == (
        "Stickiness: too few trials have both a score and a predicted SED to correlate them within subjects."
    )


def test_a_perfect_r_of_many_subjects_has_no_interval_for_that_reason():
    exact = [replace(v, rows=tuple(replace(r, score=1e4 * (r.sed - 0.004)) for r in v.rows)) for v in VISITS]
    assert (
        "r = +1.00 over 50 trials of 10 subjects on 5 surfaces, no interval, since subjects are alike or r is perfect;"
        in summary(pool_visits(exact))[1]
    )


def test_a_study_of_one_subject_says_why_tables_are_missing():
    order, within, differences = missing_scores(pool_visits(VISITS[:1]))
    assert order.startswith("No agreement on the order: it takes two subjects")
    assert order.endswith("stickiness has 1 such subject and 5 surfaces.")
    assert within.startswith("No intervals within subjects: they take two subjects")
    assert differences.startswith("No differences of surfaces of stickiness: it takes three subjects")
    assert missing_scores(pool_visits(VISITS[:3])) == []


def test_a_pair_of_surfaces_that_has_no_test_is_named():
    alike = [
        replace(v, rows=tuple(replace(r, score=float(r.index)) if r.index < 30 else r for r in v.rows))
        for v in VISITS[:4]
    ]
    (text,) = missing_scores(pool_visits(alike))
    assert text.startswith("No difference of surfaces 20 − 0 of stickiness: it takes three subjects who scored both")


def test_any_quantity_of_the_model_takes_the_place_of_the_sed_in_everything_that_a_study_finds():
    """Where it is a line in the SED, it finds the same; its unit and its rivals are its own."""

    def with_shear(row):
        return row if row.sed is None else replace(row, responses={"shear_along_skin": 10.0 * row.sed - 0.02})

    visits = [replace(visit, rows=tuple(map(with_shear, visit.rows))) for visit in VISITS]
    by_sed, by_shear = pool_visits(visits), pool_visits(visits, quantity=BY_NAME["shear_along_skin"])
    for finding, shear in zip(by_sed.descriptors, by_shear.descriptors, strict=True):
        assert shear.repeated.r == pytest.approx(finding.repeated.r)
        assert shear.mean_relation.pearson == pytest.approx(finding.mean_relation.pearson)
        slopes = (
            finding.on_response.term(SED_TERM).estimate,
            shear.on_response.term("shear along the skin [1]").estimate,
        )
        assert slopes[1] == pytest.approx(100.0 * slopes[0], rel=1e-6)  # points per kPa, and per unit of 10 / MPa
        assert [s.response.mean for s in shear.surfaces] == pytest.approx(
            [10.0 * s.response.mean - 0.02 for s in finding.surfaces]
        )
        assert shear.rivals[0].name == "shear along the skin"
        assert next(rival for rival in shear.rivals if rival.name == "SED").contrast.difference == pytest.approx(
            0.0, abs=1e-9
        )
    page = study_page(by_shear, "made")
    assert "predicted shear along the skin [1]" in page
    assert "--quantity shear_along_skin" in page


def test_the_table_of_standardised_scores_has_the_scores_as_given_beside_them():
    (normalised,) = [table for table in study_tables(pool_visits(VISITS))["scores"] if table.name == "table-normalised"]
    scores = np.array([[{row.index: row.score for row in visit.rows}[index] for index in INDICES] for visit in VISITS])
    standardised = (scores - scores.mean(axis=1, keepdims=True)) / scores.std(axis=1, ddof=1, keepdims=True)
    cells = [[float(row[n].text.replace("−", "-")) for n in (2, 5)] for row in normalised.groups[0].rows]
    expected = np.column_stack([scores.mean(axis=0), standardised.mean(axis=0)])
    assert (np.abs(np.array(cells) - expected) <= (0.0501, 0.00501)).all()  # printed to one and two decimals
