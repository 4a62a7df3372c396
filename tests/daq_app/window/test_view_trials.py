"""The tiles of a session's trials and what an inspected trial says, message by message, without Qt."""

from dataclasses import replace

import numpy as np
import pytest
from session_messages import (
    BAD,
    BEGINNING,
    FIRST,
    FLAW,
    GOOD,
    PLAN,
    READY,
    SCORE,
    SECOND,
    TARE,
    TOUCH,
    after,
    log,
    stroke_at,
)

from daq_app.recorder import messages as m
from daq_app.window.course_state import Judged, Quality
from daq_app.window.state import BenchState
from daq_app.window.view_course import TILES, course_view, inspection, tiles, verdict
from sessions.plan.plan import Visibility
from sessions.run import steps

STROKE = stroke_at(np.arange(3.0))
TAKE_KEPT = (log("scored", 1, score=40.0), log("take_kept", 1), steps.AskMount(SECOND))


def kinds(*messages):
    return [tile.kind for tile in tiles(after(*messages).session)][:3]


def test_each_trial_is_one_tile_with_a_state_of_its_own():
    assert kinds(*BEGINNING) == ["coming"] * 3
    assert kinds(*SCORE) == ["current", "coming", "coming"]
    assert kinds(*SCORE, Judged(1, 1, GOOD), *TAKE_KEPT) == ["done", "current", "coming"]
    assert kinds(*SCORE, Judged(1, 1, BAD), *TAKE_KEPT) == ["flawed", "current", "coming"]
    assert kinds(*SCORE, log("skip", 1, reason="torn"), steps.AskMount(SECOND)) == ["skipped", "current", "coming"]
    again = (*SCORE, log("take_discarded", 1, reason="a slip"), steps.StartTake(1, 2), Judged(1, 2, GOOD), *TAKE_KEPT)
    assert kinds(*again) == ["redone", "current", "coming"]


def test_no_two_states_share_a_shape_or_words():
    assert len({mark for mark, _ in TILES.values()}) == len(TILES)
    view = tiles(after(*SCORE, Judged(1, 1, GOOD), *TAKE_KEPT).session)
    assert [tile.description for tile in view[:3]] == [
        f"trial 1, {FIRST.stimulus.code}: done",
        f"trial 2, {SECOND.stimulus.code}: in hand",
        f"trial 3, {PLAN.trials[2].stimulus.code}: still to come",
    ]


def test_an_inspected_trial_says_its_verdict_its_means_and_its_score():
    quality = replace(GOOD, stroke=STROKE)
    view = inspection(after(*SCORE, Judged(1, 1, quality), *TAKE_KEPT).session, 1)
    assert view.heading == f"Trial 1, {FIRST.stimulus.code}: done, score 40"
    assert view.verdict == "Good"
    assert view.cells == (("N", "1.23 N"), ("T", "0.50 N"), ("mu", "0.41"), ("speed", "21 mm/s"))
    assert view.stroke is STROKE


def test_a_flawed_stroke_says_redo_its_worst_flaw_and_what_to_do():
    flaw = FLAW._replace(advice="Slide further, at one speed.")
    assert verdict(Quality((flaw,))) == "Redo: no steady window. Slide further, at one speed."
    assert verdict(Quality((FLAW._replace(grade="doubtful"),))) == "Doubtful: no steady window."
    assert verdict(Quality((flaw._replace(grade="note"),))).startswith("Doubtful: no steady window")
    assert verdict(Quality((flaw._replace(grade="doubtful"),))).startswith("Redo: no steady window. Slide")


@pytest.mark.parametrize(
    ("messages", "number", "why"),
    [
        (SCORE, 2, "Its stroke is still to come."),
        ((*SCORE, log("skip", 1, reason="torn")), 1, "It was left out: no stroke of it counts."),
        ((*SCORE, *TAKE_KEPT), 1, "Its stroke was recorded, but this window has not examined it"),
    ],
)
def test_a_trial_without_a_stroke_says_why(messages, number, why):
    view = inspection(after(*messages).session, number)
    assert view.verdict.startswith(why)
    assert view.stroke is None
    assert {text for _, text in view.cells} == {"–"}


def test_a_protocol_that_keeps_forces_from_the_experimenter_shows_no_stroke():
    blind = replace(PLAN, shown=Visibility(experimenter=()))
    beginning = m.SessionBegun("recordings/P07", blind, "people", None, 0)
    quality = Judged(1, 1, replace(GOOD, stroke=STROKE))
    view = inspection(after(BEGINNING[0], beginning, *TARE[2:], quality, *TAKE_KEPT).session, 1)
    assert view.verdict == "Forces are not shown in this protocol."
    assert view.stroke is None
    assert "score" not in view.heading


def test_a_take_that_was_discarded_keeps_its_reason():
    again = (*SCORE, log("take_discarded", 1, reason="the finger slipped"), steps.StartTake(1, 2))
    assert "discarded: the finger slipped." in inspection(after(*again).session, 1).details


def test_a_redo_that_is_undone_brings_back_stroke_and_score_until_the_next_onset():
    first_take = (*SCORE, Judged(1, 1, replace(GOOD, stroke=STROKE)), *TAKE_KEPT)
    again = (
        log("redo", 2, reason="mistaken"),
        log("take_discarded", 1, take=1, reason="mistaken"),
        steps.AskMount(FIRST),
        steps.StartTake(1, 2),
        steps.MeasureZero(),
    )
    session = after(*first_take, *again).session
    view = course_view(session, BenchState(), 0.0)
    undo = view.buttons["undo"]
    assert (undo.label, undo.key, undo.enabled) == ("Undo redo 1", "Ctrl+Z", True)
    assert view.notice.startswith(f"To be done again: trial 1 ({FIRST.stimulus.code}). Ctrl+Z undoes that")
    undone = (
        log("undo_redo", 1),
        log("take_discarded", 1, take=2, reason="the redo was undone"),
        log("take_restored", 1, take=1),
        log("take_kept", 1, take=1),
        steps.AskMount(SECOND),
    )
    before, now = after(*first_take).session, after(*first_take, *again, *undone).session
    assert tiles(now) == tiles(before)
    assert inspection(now, 1).verdict == "Good"
    assert "score 40" in inspection(now, 1).heading
    assert not course_view(now, BenchState(), 0.0).buttons["undo"].enabled
    later = after(*first_take, *again, steps.AskStroke(FIRST), log("contact_onset", 1, time=9.0, noticed=9.0)).session
    assert not course_view(later, BenchState(), 0.0).buttons["undo"].enabled


def test_a_redo_before_the_stroke_or_in_the_middle_of_it_offers_no_undo():
    for so_far in (READY, TOUCH):
        session = after(*so_far, log("redo", 1, reason="sneezed"), steps.StartTake(1, 2), steps.MeasureZero()).session
        assert not course_view(session, BenchState(), 0.0).buttons["undo"].enabled
