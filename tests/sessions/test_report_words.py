"""A report's words say no more than its numbers do, and name what they are of."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from report_example import TABLES, example, experiments_of, tables
from study_example import study

from sessions.prediction.stored import Variant
from sessions.report import study_prose
from sessions.report.contents import Fact
from sessions.report.figures.relation import paths_panel, relation_panel
from sessions.report.pages import page
from sessions.report.prose import doubts, question, summary
from sessions.report.tables import estimate_cell
from sessions.report.tables import predictions as of_predictions
from sessions.report.tables.session import ground_truth_table, paths_sentence, relation_table
from sessions.report.tables.session import tables as session_tables
from sessions.report.tables.study import study_tables
from sessions.report.trials import omissions
from sessions.report.wording import correlation, ends_of

FORCE = Variant("small", "computed", "force")
DOUBT = "Tissue is turned inside out somewhere."


@pytest.fixture(scope="module")
def report():
    return replace(example(), model="small strain, settled sliding")


def under_force(report):
    """Return the sentence on the measured force."""
    (sentence,) = [doubt for doubt in doubts(report) if "measured normal force" in doubt]
    return sentence


@pytest.mark.parametrize(
    ("size", "end"),
    [("31 to 120 % of the SED", "may differ: the change is estimated at 31 to 120 % of the SED."),
     ("no estimate", "may differ.")],
)  # fmt: skip
def test_a_strain_that_was_not_tried_is_said_with_the_size_of_what_it_would_change(report, size, end):
    untried = tuple(replace(prediction, alternatives=()) for prediction in report.predictions)
    first, *_ = doubts(replace(report, predictions=untried, left_out=(Fact("finite strain", size, ""),)))
    assert first == f"At finite strain, which was not tried here, the sign of r {end}"


def test_a_stimulus_stroked_twice_is_one_point_of_a_correlation_and_not_two(report):
    twice = replace(report, predictions=(*report.predictions, *report.predictions))
    assert under_force(twice) == under_force(report)
    assert "n = 5 stimuli" in under_force(report)


def test_paths_that_all_agree_are_not_said_to_differ(report):
    alike = [replace(path, r=0.9) for path in report.experiments[0].paths]
    assert paths_sentence("stickiness", alike).endswith("all agree within 0.005.")
    paths = [
        replace(path, r=-path.r, within=None) if n else replace(path, within=None, usual=True)
        for n, path in enumerate(alike)
    ]
    sentence = paths_sentence("stickiness", paths)
    assert f", {len(alike) - 1} with another sign than the usual path; 2 of these differ" in sentence


def test_the_usual_path_has_the_strain_of_the_report_s_prediction():
    (usual,) = [path.path.kinematics for path in experiments_of(tables())[0].paths if path.usual]
    assert usual == "small"
    at_finite = experiments_of(tables(), kinematics="finite")[0].paths  # none of these paths was at finite strain
    assert not [path for path in at_finite if path.usual]


def test_an_r_of_three_surfaces_says_why_it_has_no_interval():
    three = [replace(each, scores=tuple(s for s in each.scores if s.index in (0, 20, 100))) for each in tables()]
    (sticky, _) = [one.score_relation for one in experiments_of(three)]
    assert ends_of(sticky) == ", no interval of r from 3 points"


def test_a_usual_path_without_a_correlation_is_told(report):
    """At finite strain the usual path may leave too few surfaces, while those at small strain do not."""
    first, *small_paths = [replace(path, within=None, usual=False) for path in report.experiments[0].paths]
    sentence = paths_sentence("stickiness", [replace(first, r=None, usual=True), *small_paths])
    assert ", none on the usual path; " in sentence


def test_paths_say_which_correlation_they_give(report):
    over_surfaces = [replace(path, within=None) for path in report.experiments[0].paths]
    assert " give a correlation over surfaces, from " in paths_sentence("stickiness", over_surfaces)
    within = [replace(path, within=0.5) for path in over_surfaces]
    assert " give a correlation within subjects, from +0.50 to +0.50" in paths_sentence("stickiness", within)


def test_trials_without_a_number_in_a_variant_are_no_points_of_its_correlation(report):
    def without(prediction):
        pairs = ((a, None if a.variant == FORCE else a.sed) for a in prediction.alternatives)
        return replace(prediction, alternatives=tuple(replace(a, sed=sed) for a, sed in pairs))

    predictions = tuple(without(p) if p.trial in (7, 8, 9) else p for p in report.predictions)
    assert "slipperiness 2 points are too few for a correlation, n = 2 stimuli" in under_force(
        replace(report, predictions=predictions)
    )


def test_how_far_the_ending_may_be_moved_with_the_same_sign_is_reported(report):
    signs = {-0.5: -1.0, -0.25: 1.0, 0.0: 1.0, 0.25: 1.0, 0.5: 1.0, 0.75: -1.0, 1.0: 1.0, 9.0: 1.0}
    rows = tuple(
        replace(p, row={arc: sign * p.sed for arc, sign in signs.items()}) for p in report.predictions
    )  # beyond where the sign turns it may turn back
    (sentence,) = [doubt for doubt in doubts(replace(report, predictions=rows)) if "the ending is moved" in doubt]
    assert sentence.endswith("in stickiness from −0.25 to 0.50 mm and in slipperiness from −0.25 to 0.50 mm.")
    assert any("is not known here" in doubt for doubt in doubts(report))


def test_the_summary_counts_predictions_in_doubt(report):
    first, *rest = report.predictions
    words = " ".join(summary(replace(report, predictions=(replace(first, doubt=DOUBT), *rest))))
    assert "1 trial is in a state that no finger can be in" in words


def test_what_got_no_prediction_is_a_trial_of_a_plan_or_a_stroke_without_one(report):
    without_sed = tuple(replace(p, sed=None) for p in report.predictions[:2])
    assert "2 trials without a prediction" in " ".join(summary(replace(report, predictions=without_sed)))
    unplanned = tuple(replace(p, trial=None) for p in without_sed)
    assert "2 strokes without a prediction" in " ".join(summary(replace(report, predictions=unplanned)))


def test_two_blocks_of_one_descriptor_are_one_kind_of_judgement_of_the_same_stimuli(report):
    sticky, _ = report.experiments
    again = replace(report, experiments=(sticky, replace(sticky, name="stickiness again")))
    assert question(again).startswith("People scale the stickiness of surfaces")
    assert "10 subjects scored 5 stimuli." in summary(again)


def test_the_question_is_of_the_quantity_that_is_held_against_scores(report):
    assert "strain-energy density (SED) that a finger model" in question(report)
    assert "Does the pressure that a finger model" in question(replace(report, response="pressure"))
    findings = study()
    assert "strain-energy density (SED) that a finger model" in study_prose.question(findings)
    assert "Does the pressure that a finger model" in study_prose.question(replace(findings, response="pressure"))


def test_the_scores_of_one_subject_are_no_means(report):
    alone = tuple(replace(e, answers={"P01": next(iter(e.answers.values()))}) for e in report.experiments)
    of_one = replace(report, experiments=alone)
    sentences = [sentence for sentence in (*summary(of_one), *doubts(of_one)) if "r = " in sentence]
    assert [sentence.count("the scores of P01") for sentence in sentences if "paths" not in sentence] == [1, 1, 1]
    assert not any("mean score" in sentence for sentence in sentences)
    names = {row[0].text for group in relation_table(of_one).groups for row in group.rows}
    assert names == {"score of P01", "index"}
    assert "against the mean scores r = " in " ".join(summary(report))


def test_where_nobody_gave_a_score_no_word_is_of_scores_or_of_r(report):
    experiments = tuple(
        replace(e, scale_ends=("", ""), scores=(), score_relation=None, answers={}) for e in report.experiments
    )
    choice_report = replace(report, experiments=experiments)
    assert doubts(choice_report) == ()
    words = "People judge the stickiness and slipperiness of surfaces they stroke. With what µ do they stroke them"
    assert question(choice_report) == (
        f"{words}, and what strain-energy density (SED) does a finger model predict at a receptor?"
    )
    assert question(replace(choice_report, predictions=())) == f"{words}?"
    text = page(choice_report, ())
    assert ">Prediction against index<" in text
    assert "to scores" not in text
    findings = study()
    unscored = replace(findings, descriptors=tuple(replace(d, scores=()) for d in findings.descriptors))
    assert "score" not in study_prose.question(unscored)


def test_a_visit_for_scores_alone_asks_about_no_friction_and_has_no_forces(report):
    alone = replace(report, course=None, strokes=(), predictions=(), excluded=(), flaws=())
    assert question(alone) == "How do people scale stickiness and slipperiness?"
    assert summary(alone)[-1] == "Excluded: nothing; flaws found: none."
    assert ">Further tables<" in page(alone, ())


def test_the_axis_of_many_paths_names_the_quantity_that_they_are_of(report):
    panel = paths_panel("stickiness", report.experiments[0].paths, "pressure")
    assert "correlation of pressure with score [–]" in panel.svg


def test_a_width_that_was_set_is_not_called_assumed(report):
    for origin in ("set", "assumed"):
        caption = of_predictions.force_table(replace(report, width_origin=origin)).caption
        assert f"times a width of 15 mm ({origin})" in caption


def test_a_depth_without_an_interval_says_whether_its_mesh_is_rough_or_no_interval_was_asked_for(report):
    """--intervals alone gives none to a depth that was not solved for: that takes --variants."""
    first, unasked = report.predictions[0], {"interval": None, "matching_depth_interval": None}
    by_force = tuple(
        replace(a, interval=None, indentation=first.matching_depth if a.variant == FORCE else a.indentation)
        for a in first.alternatives
    )
    for alternatives, why in (((), "computed on a coarse mesh"), (by_force, "none was asked for (--intervals)")):
        prediction = replace(first, alternatives=alternatives, **unasked)
        table = of_predictions.force_table(replace(report, predictions=(prediction,)))
        assert table.groups[0].rows[0][-1].note.startswith(f"no interval: {why}")


def test_a_table_whose_intervals_were_not_asked_for_says_so_once(report):
    unasked = tuple(
        replace(p, alternatives=tuple(replace(a, interval=None) for a in p.alternatives)) for p in report.predictions
    )
    for table in (of_predictions.variants_table, of_predictions.variant_forces_table):
        whole = table(replace(report, predictions=unasked))
        cells = [cell for row in whole.groups[0].rows for cell in row[2:]]
        assert {(cell.note, cell.mark) for cell in cells} == {("no interval: none was asked for (--intervals)", "")}
        assert whole.notes.count(("", "No interval: none was asked for (--intervals).")) == 1


def test_the_captions_of_predictions_explain_intervals_only_where_they_were_computed(report):
    def without(p):
        alternatives = tuple(replace(a, interval=None) for a in p.alternatives)
        intervals = {"interval": None, "opposite_interval": None, "matching_depth_interval": None}
        return replace(p, alternatives=alternatives, **intervals)

    unasked = replace(report, predictions=tuple(map(without, report.predictions)))
    for name in ("prediction", "afferent", "variants", "variant_forces", "force", "direction"):
        table = getattr(of_predictions, f"{name}_table")
        explained, bare = (
            " ".join((one.caption, *(note for mark, note in one.notes if not mark)))
            for one in map(table, (report, unasked))
        )
        assert "95 % interval" in explained, name
        assert "95 % interval" not in bare, name


def test_an_exact_p_below_a_thousandth_is_not_shown_as_zero(report):
    sticky = report.experiments[0]
    small = replace(sticky.score_relation, spearman_p=2.0 / 3_628_800)  # ten surfaces in perfect order: 2 of 10!
    table = relation_table(replace(report, experiments=(replace(sticky, score_relation=small),)))
    assert [row[6].text for row in table.groups[0].rows if row[0].text == "mean score"] == ["< 0.001"]


def test_a_trial_whose_stroke_was_not_found_stands_among_its_experiment_s(report):
    without = replace(
        report,
        strokes=report.strokes[1:],
        predictions=(replace(report.predictions[0], stroke=None), *report.predictions[1:]),
    )
    groups = {group.name: [row[:2] for row in group.rows] for group in ground_truth_table(without).groups}
    assert list(groups) == ["stickiness", "slipperiness"]
    assert [cell.text for cell in groups["stickiness"][0]] == ["1", "0"]


def test_the_error_bars_of_prediction_against_score_hold_what_the_uncertainty_of_friction_makes(report):
    own = [p for p in report.predictions if p.experiment == "stickiness"]
    panel = relation_panel(report.experiments[0], own)
    low, high = (panel.header.index(f"95 % interval of SED by friction, {end} [MPa]") for end in ("low", "high"))
    seds = np.array([row[3] for row in TABLES["stickiness"].values()])
    assert [row[low] for row in panel.rows] == pytest.approx(0.995 * seds)  # as the example's intervals are
    assert [row[high] for row in panel.rows] == pytest.approx(1.005 * seds)
    doubtful = relation_panel(report.experiments[0], [replace(p, doubt=DOUBT) for p in own])
    assert {row[low] for row in doubtful.rows} == {None}


@pytest.mark.parametrize(("value", "ends"), [(0.0042, (0.0038, 0.0046)), (-0.0014, (-0.0017, -0.0011))])
def test_a_number_is_written_as_finely_as_its_interval_and_never_outside_it(value, ends):
    cell = estimate_cell(value, correlation, None, ends)
    low, high = (float(end.replace("−", "-")) for end in cell.interval.split(" to "))
    assert low <= float(cell.text.replace("−", "-")) <= high


def test_one_session_of_a_study_is_no_each():
    findings = study()
    single_visit = replace(findings, visits=findings.visits[:1])
    assert study_prose.seal_sentence(single_visit) == findings.visits[0].sealed
    assert study_prose.seal_sentence(findings).startswith("In each of 10 sessions: The predictions")


def test_the_table_of_rivals_names_the_weights_of_mixed_models_only_where_there_are_some(report):
    session_table = session_tables(report)["rivals"][0]
    study_table = study_tables(study())["rivals"][0]
    for table, has_weights in ((session_table, False), (study_table, True)):
        assert ("AIC weight" in [column.name for column in table.columns]) == has_weights
        assert ("AIC" in table.caption + " ".join(words for _, words in table.notes)) == has_weights
        assert {len(row) for group in table.groups for row in group.rows} == {len(table.columns)}


def test_a_warning_of_several_trials_is_shown_with_its_greatest_numbers():
    warnings = ("Strains reach 54 % there.", "Strains reach 186 % there.", "Strains reach 99 % there.")
    trials = [SimpleNamespace(prediction=SimpleNamespace(model={}, warnings=(warning,))) for warning in warnings]
    assert omissions(SimpleNamespace(trials=trials)) == (
        Fact("warning", warnings[1], "the greatest numbers of 3 trials with this warning"),
    )
