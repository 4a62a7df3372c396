"""Words of a study that hold for one subject, for subjects who reverse the scale, and for unlike settings."""

from dataclasses import replace

import pytest
from report_example import example, experiments_of, tables
from study_example import visit

from sessions.report import prose
from sessions.report.pages import study_page
from sessions.report.study_prose import distinctions, remarks, summary
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
    assert "over 5 trials of S01, no interval for other people from one subject;" in words
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


def pressed(number, depth, **changes):
    """Return a visit whose model was pressed to a depth."""
    bare = visit(number)
    values = {"indentation": depth, "contact_area": 100.0, "rule": "maximum", **changes}
    return replace(bare, rows=tuple(replace(row, **values) for row in bare.rows))


def test_sessions_pooled_with_unlike_settings_are_named_with_what_differs():
    study = pool_visits([pressed(1, 2.0), pressed(2, 2.0), pressed(3, 1.5)])
    (sentence,) = [text for text in remarks(study) if "different settings" in text]
    assert "depth of the model (2 mm: S01, S02; 1.5 mm: S03)" in sentence
    assert "area" not in sentence
    unlike = pool_visits([pressed(1, 2.0), pressed(2, 2.0, contact_area=80.0, direction=-1)])
    (sentence,) = [text for text in remarks(unlike) if "different settings" in text]
    assert "contact area (100 mm²: S01; 80 mm²: S02)" in sentence
    assert "direction (proximal to distal: S01; distal to proximal: S02)" in sentence


def test_like_settings_and_sessions_left_out_get_no_remark():
    deep = [replace(pressed(1, 2.0).rows[0], indentation=1.5), *pressed(1, 2.0).rows[1:]]
    both = [replace(visit(number), rows=tuple(deep)) for number in (1, 2)]
    left_out = (Exclusion("S03", "pressed less deeply", "E01"),)
    for study in (pool_visits(both), pool_visits([pressed(1, 2.0), pressed(3, 1.5)], exclusions=left_out)):
        assert not [text for text in remarks(study) if "different settings" in text]
