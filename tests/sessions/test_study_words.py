"""Words of a study that hold for one subject, for subjects who reverse the scale, and for unlike settings."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.axes import Axes
from report_example import example, experiments_of, tables
from study_example import visit

from daq_app.analyst.finger_words import MEAN_PANELS, compare_reports
from sessions.report import prose
from sessions.report.figures.relation import comparison_panel, relation_panel, score_panel, study_plates
from sessions.report.pages import study_page
from sessions.report.study_prose import distinctions, remarks, summary
from sessions.report.tables.session import answer_tables
from sessions.report.tables.study import study_tables
from sessions.statistics.pooled import pool_visits
from sessions.statistics.scores import Score, ScoreTable
from sessions.statistics.visit import Exclusion


def texts_of(study):
    """Return the page's words without captions, which speak of any study."""
    tables = (table for section in study_tables(study).values() for table in section)
    cells = [cell.text for table in tables for group in table.groups for row in group.rows for cell in row]
    return " ".join([*summary(study), *distinctions(study), *cells])


def test_a_study_of_one_subject_names_it_and_speaks_of_no_others():
    study = pool_visits([visit(1)])
    words = texts_of(study)
    assert "over 5 trials of S01 on 5 surfaces, no interval for other people from one subject;" in words
    assert "On stickiness, scores of S01, the scores" in words or "Stickiness, scores of S01" in words
    for phrase in ("within subjects", "over subjects", "1 subject with", "AIC"):
        assert phrase not in words.replace("No intervals within subjects", "")
    several = texts_of(pool_visits([visit(number) for number in range(1, 5)]))
    assert "within subjects" in several


def test_the_page_of_one_subject_counts_no_complete_subjects_as_none():
    page = study_page(pool_visits([visit(1)]), "x")
    assert "who scored every surface (fewer than two)" in page
    assert "over the trials of S01 r" in page.replace("\n", " ")


@pytest.mark.parametrize(("falling", "end"), [(1, "of 1 of 3 subjects"), (2, "of 2 of 3 subjects")])
def test_a_session_says_in_short_whose_scores_fall(falling, end):
    reversed_tables = [
        ScoreTable(
            t.session,
            t.subject,
            t.simulated,
            tuple(Score(s.subject, s.descriptor, s.index, 100.0 - s.score) for s in t.scores),
        )
        if number < falling
        else t
        for number, t in enumerate(tables(3))
    ]
    sentences = prose.summary(example(experiments=experiments_of(reversed_tables)))
    for descriptor in ("stickiness", "slipperiness"):
        assert f"The {descriptor} scores {end} fall as the index rises; the appendix names each." in sentences
    assert not [text for text in prose.summary(example()) if "fall as" in text]


def test_a_session_of_one_reversed_subject_says_so_without_a_count():
    (table,) = tables(1)
    scores = tuple(Score(s.subject, s.descriptor, s.index, 100.0 - s.score) for s in table.scores)
    alone = prose.summary(example(experiments=experiments_of([replace(table, scores=scores)])))
    assert "The stickiness scores fall as the index rises; the appendix says more." in alone


def test_a_study_without_scores_does_not_count_too_few_of_them():
    rows = [replace(row, score=None, estimate=3.0 + row.place, outcome="numbered") for row in visit(1).rows]
    sentences = summary(pool_visits([replace(visit(1), rows=tuple(rows))]))
    assert "Stickiness: there are no scores to compare the SED with." in sentences
    assert not [sentence for sentence in sentences if "too few trials" in sentence]


def pressed(number, depth, **changes):
    """Return a visit whose model was pressed to a depth."""
    bare = visit(number)
    values = {"indentation": depth, "contact_area": 100.0, "rule": "maximum", **changes}
    return replace(bare, rows=tuple(replace(row, **values) for row in bare.rows))


def test_sessions_pooled_with_unlike_settings_are_named_with_what_differs():
    study = pool_visits([pressed(1, 2.0), pressed(2, 2.0), pressed(3, 1.5)])
    (sentence,) = [text for text in summary(study) if "different settings" in text]
    assert "depth of the model (2 mm: S01, S02; 1.5 mm: S03)" in sentence
    assert "area" not in sentence
    unlike = pool_visits([pressed(1, 2.0), pressed(2, 2.0, contact_area=80.0, direction=-1)])
    (sentence,) = [text for text in summary(unlike) if "different settings" in text]
    assert "contact area (100 mm²: S01; 80 mm²: S02)" in sentence
    assert "direction (proximal to distal: S01; distal to proximal: S02)" in sentence


def test_like_settings_and_sessions_left_out_get_no_remark():
    left_out = (Exclusion("S03", "pressed less deeply", "E01"),)
    alike = pool_visits([pressed(1, 2.0), pressed(2, 2.0)])
    for study in (alike, pool_visits([pressed(1, 2.0), pressed(3, 1.5)], exclusions=left_out)):
        assert not [text for text in summary(study) if "different settings" in text]


def test_trials_in_a_state_that_no_finger_can_be_in_are_counted_and_named():
    doubt = "Tissue is turned inside out somewhere"
    study = pool_visits([pressed(1, 2.0, doubt=doubt), pressed(2, 2.0)])
    (sentence,) = [text for text in remarks(study) if "no finger can be in" in text]
    opening = (
        "Predictions of 5 trials are, on their meshes, of a state that no finger can be in, and count nevertheless"
    )
    assert sentence.startswith(opening)
    assert "(S01 trial 1, S01 trial 2, S01 trial 3, S01 trial 4, S01 trial 5)" in sentence
    assert sentence.endswith(f"Of the first: {doubt}.")
    assert not [text for text in remarks(pool_visits([pressed(2, 2.0)])) if "no finger can be in" in text]


def test_two_depths_within_each_session_are_named_too():
    mixed = [(replace(v.rows[0], indentation=1.5), *v.rows[1:]) for v in (pressed(1, 2.0), pressed(2, 2.0))]
    study = pool_visits([replace(visit(number), rows=rows) for number, rows in enumerate(mixed, 1)])
    (sentence,) = [text for text in summary(study) if "different settings" in text]
    assert "different settings: depth of the model (1.5 mm and 2 mm in each session)." in sentence


def test_an_interval_of_r_in_short_comes_with_its_assumption():
    assumption = "Intervals of r hold as if the stimuli had been drawn at random."
    assert assumption in prose.summary(example())
    stickiness, _ = experiments_of(tables(1))
    none = replace(stickiness.score_relation, low=None, high=None, reason="no interval of r from 3 points")
    assert assumption not in prose.summary(example(experiments=(replace(stickiness, score_relation=none),)))


def test_tables_of_answers_and_pictures_of_the_relation_name_their_blocks():
    (stickiness, _) = experiments_of(tables(2))
    blocks = (stickiness, replace(stickiness, name="back"))
    captions = [table.caption for table in answer_tables(example(experiments=blocks))]
    assert [caption.partition(" [")[0] for caption in captions] == ["Every score of stickiness", "Every score of back"]
    predictions = [p for p in example().predictions if p.experiment == "stickiness"]
    assert "mean score of back [0–100]" in relation_panel(blocks[1], predictions).svg


def test_every_column_of_scores_beside_a_picture_names_its_unit():
    report, study = example(), pool_visits([visit(number) for number in (1, 2)])
    panels = [score_panel(report.experiments[0]), relation_panel(report.experiments[0], report.predictions)]
    panels += [panel for plate in study_plates(study) for panel in plate.panels if "paths" not in panel.name]
    panels.append(comparison_panel(MEAN_PANELS, ("one", "other"), compare_reports(report, report)))
    headings = [heading for panel in panels for heading in panel.header if "score" in heading]
    assert {"mean score", "own score", "score of S01", "score"} <= {text.partition(" [")[0] for text in headings}
    assert all("[points, 0 to 100]" in heading for heading in headings)


def deep_block(v, *, doubt=""):
    """Return a visit whose surfaces come again in a block of twice the SED, judged alike."""
    again = [replace(row, block="deep", trial=row.trial + 5, sed=2.0 * row.sed, doubt=doubt) for row in v.rows]
    return replace(v, rows=(*v.rows, *again))


def test_blocks_of_other_depths_do_not_hide_how_scores_follow_within_each():
    plain = [visit(number) for number in range(1, 6)]
    (findings,) = pool_visits([deep_block(v) for v in plain]).descriptors
    rows = [(v.subject, row.block, row.sed, row.score) for v in map(deep_block, plain) for row in v.rows]
    names, blocks, *columns = zip(*rows, strict=True)
    groups = [f"{name} {block}" for name, block in zip(names, blocks, strict=True)]
    x, y = (np.array(c) - [np.mean(np.array(c)[np.array(groups) == g]) for g in groups] for c in columns)
    in_blocks = findings.repeated_in_blocks
    assert in_blocks.r == pytest.approx(x @ y / np.sqrt(x @ x * (y @ y)))
    assert (in_blocks.dof, in_blocks.subjects) == (50 - 10 - 1, 5)
    assert findings.repeated.r < 0.3 < 0.9 < in_blocks.people[0] < in_blocks.r
    text = " ".join(summary(pool_visits([deep_block(v) for v in plain])))
    assert f"Stickiness, within each block of a subject: r = +{in_blocks.r:.2f} (" in text
    assert pool_visits(plain).descriptors[0].repeated_in_blocks is None
    assert "within each block" not in " ".join(summary(pool_visits(plain)))


def test_no_line_of_the_picture_leads_from_one_block_to_another(monkeypatch):
    lines = []
    monkeypatch.setattr(Axes, "plot", lambda _, *line, **__: lines.append(line) if "-" in line else None)
    panel = next(p for plate in study_plates(pool_visits([deep_block(visit(1)), visit(2)])) for p in plate.panels)
    assert panel.name == "study-relation-stickiness"
    assert [len(x) for x, _, mark in lines if mark == "-"] == [5, 5, 5]


def test_a_study_says_what_r_is_without_states_that_no_finger_can_be_in():
    plain = [visit(number) for number in range(1, 6)]
    study = pool_visits([deep_block(v, doubt="Tissue is turned inside out.") for v in plain])
    (findings,), (alone,) = study.descriptors, pool_visits(plain).descriptors
    assert findings.repeated_possible == alone.repeated
    assert findings.doubtful == 25
    sentence = f"Stickiness, without 25 trials in a state that no finger can be in: r = +{alone.repeated.r:.2f} ("
    assert sentence in " ".join(summary(study))
    assert "no finger can be in" not in " ".join(summary(pool_visits(plain)))


def test_a_session_says_what_r_is_without_states_that_no_finger_can_be_in():
    report = example()
    predictions = [replace(p, doubt="inside out") if p.index == 100 else p for p in report.predictions]
    (stickiness, _) = report.experiments
    means = {mean.index: mean.mean for mean in stickiness.scores}
    possible = [p for p in report.predictions if p.experiment == "stickiness" and p.index != 100]
    r = np.corrcoef([p.sed for p in possible], [means[p.index] for p in possible])[0, 1]
    sentence = next(s for s in prose.doubts(replace(report, predictions=tuple(predictions))) if "no finger" in s)
    assert sentence.startswith(f"Without trials in a state that no finger can be in: stickiness r = +{r:.2f}")
    assert "n = 4 stimuli; slipperiness r = " in sentence
    assert not [text for text in prose.doubts(report) if "no finger" in text]


def test_without_a_correlation_nothing_would_change_its_sign():
    (stickiness, _) = experiments_of(tables(1))
    alone = replace(stickiness.score_relation, pearson=None)
    assert prose.doubts(example())
    assert prose.doubts(example(experiments=(replace(stickiness, score_relation=alone),))) == ()
