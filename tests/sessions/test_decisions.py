"""What people decided about strokes: kept in a file that only grows, and what it does to the numbers."""

import json
import tempfile
import zlib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest
from closed_form import INFO, SETTINGS, T, block, noisy, plan, slide, times, trapezium, trial, wrench
from hypothesis import given, settings
from hypothesis import strategies as st
from recordings import record_session

from sessions.plan.plan import Frame
from sessions.recording import Recording
from sessions.recording.archive import problems, seal
from sessions.strokes.analysis import analyse_blocks, with_present
from sessions.strokes.bootstrap import stroke_intervals
from sessions.strokes.decisions import DECISIONS, Decision, DecisionError, Decisions, append, parse, read
from sessions.strokes.trial_analysis import TrialContext

WINDOW = Decision("E02", "the ramp was in it", "steady", 1, 1, (1.1, 2.9), (1.5, 2.5))


@pytest.fixture(scope="module")
def sealed_recording(tmp_path_factory):
    """A sealed recording, for tests that write to its decisions alone."""
    folder = record_session(tmp_path_factory.mktemp("decided") / "S01")
    seal(folder)
    return Recording.open(folder)


@pytest.fixture
def recording(sealed_recording):
    (sealed_recording.folder / DECISIONS).unlink(missing_ok=True)
    return sealed_recording


def lines(recording):
    return (recording.folder / DECISIONS).read_bytes()


def test_a_decision_is_a_line_with_who_when_why_and_what_stood_before(recording):
    decision = append(recording, WINDOW)
    document = json.loads(lines(recording))
    expected = {"by": "E02", "why": "the ramp was in it", "what": "steady", "trial": 1, "stroke": 1}
    assert expected.items() <= document.items()
    assert (document["old"], document["new"], document["number"]) == ([1.1, 2.9], [1.5, 2.5], 1)
    assert document["made_utc"] == decision.made_utc > "2026"
    assert read(recording.folder).in_force == (decision,)


def test_everybody_who_decides_at_once_gets_a_line_and_a_number_of_its_own(recording):
    with ThreadPoolExecutor(8) as people:
        decisions = list(people.map(lambda _: append(recording, WINDOW), range(40)))
    stored = read(recording.folder)
    assert stored.problems == ()
    assert (
        sorted(decision.number for decision in decisions) == [line.number for line in stored.lines] == [*range(1, 41)]
    )


@pytest.mark.parametrize(
    ("what", "old", "new", "words"),
    [
        ("lift", 3.0, 2.5, "lift of stroke 1 of trial 1 is 2.500 s (it was 3.000 s): why"),
        ("stick", None, (1.0, 1.25), "stick of stroke 1 of trial 1 is 1.000 to 1.250 s (it was not known): why"),
        ("direction", 1, -1, "direction of stroke 1 of trial 1 is -1 (it was 1): why"),
    ],
)
def test_what_was_decided_is_reported_with_its_unit(what, old, new, words):
    assert Decision("E02", "why", what, 1, 1, old, new, number=1).sentence == f"decision 1 by E02: {words}"


def test_the_tilt_decided_is_reported_in_degrees():
    tilt = Decision("E02", "why", "tilt", old=(0.0, 0.0), new=(1.0, -0.5), number=1)
    words = "tilt of the recording is 1 and -0.5 degrees (it was 0 and 0 degrees)"
    assert tilt.sentence == f"decision 1 by E02: {words}: why"


def test_the_check_sum_is_that_of_the_text_before_it(recording):
    append(recording, WINDOW)
    text, crc = lines(recording).decode().rstrip("\n").split(',"crc32":')
    assert zlib.crc32(f"{text}}}".encode()) == int(crc.rstrip("}"))


def test_deciding_leaves_a_sealed_session_as_it_was(recording):
    before = {path.name: path.read_bytes() for path in recording.folder.iterdir()}
    append(recording, WINDOW)
    after = {path.name: path.read_bytes() for path in recording.folder.iterdir()}
    assert {name: after[name] for name in before} == before
    assert set(after) - set(before) == {DECISIONS}
    assert problems(recording.folder) == ()


def test_every_line_of_a_simulated_session_says_so(recording):
    append(replace(recording, simulated_sentence="SIMULATED: all"), WINDOW)
    assert lines(recording).startswith(b'{"SIMULATED":"SIMULATED: all"')
    assert read(recording.folder).in_force[0].new == WINDOW.new


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"by": " "}, "says who decides and why"),
        ({"why": ""}, "says who decides and why"),
        ({"what": "mood"}, "give one of onset, lift"),
        ({"new": (2.0, 1.0)}, "cannot be"),
        ({"new": (1.0, float("nan"))}, "cannot be"),
        ({"what": "direction", "new": 2}, "cannot be"),
        ({"what": "kept", "new": 1}, "cannot be"),
        ({"what": "choice", "stroke": None, "new": 0}, "cannot be"),
        ({"trial": None, "stroke": None}, "give one of tilt"),
        ({"what": "tilt", "trial": None, "stroke": None, "new": (30.0, 0.0)}, "two angles of at most 20°"),
        ({"undoes": 1}, "nothing to undo"),
    ],
)
def test_what_cannot_be_decided_is_refused_in_a_sentence_and_leaves_no_line(recording, changes, sentence):
    with pytest.raises(DecisionError, match=sentence):
        append(recording, replace(WINDOW, **changes))
    assert not (recording.folder / DECISIONS).exists()


def test_a_torn_last_line_is_named_and_what_came_before_holds(recording):
    first = append(recording, WINDOW)
    append(recording, replace(WINDOW, new=(1.6, 2.6)))
    whole = lines(recording)
    (recording.folder / DECISIONS).write_bytes(whole[:-9])
    decisions = read(recording.folder)
    assert decisions.in_force == (first,)
    assert "torn" in decisions.problems[0]
    third = append(recording, replace(WINDOW, new=(1.7, 2.7)))
    assert third.number == 3  # the torn line keeps its place
    assert read(recording.folder).in_force == (third,)
    assert "line 2" in read(recording.folder).problems[0]


def test_a_line_that_was_changed_or_taken_away_is_named(recording):
    for end in (2.5, 2.6, 2.7):
        append(recording, replace(WINDOW, new=(1.5, end)))
    whole = lines(recording)
    decisions = parse(whole.replace(b"2.6]", b"2.4]"))
    assert "CRC-32" in decisions.problems[0]
    assert [line.number for line in decisions.lines] == [1, 3]
    first, _, third = whole.splitlines(keepends=True)
    assert "lacks decision 2" in parse(first + third).problems[0]
    assert "comes before" in parse(third + first).problems[0]


# Undoing: every step is either a decision about one of two strokes, or undoes one of the lines before it.
STEPS = st.lists(
    st.one_of(
        st.tuples(st.just("set"), st.integers(1, 2), st.integers(1, 9)),
        st.tuples(st.just("undo"), st.integers(1, 12), st.just(0)),
    ),
    max_size=12,
)


def in_force(steps):
    """What is in force of each stroke, by asking of each line anew: who undoes it, and who undoes that?"""

    def alive(number):
        return not any(kind == "undo" and target == number and alive(n) for n, (kind, target, _) in all_lines[number:])

    all_lines = list(enumerate(steps, 1))
    standing = {}
    for number, (kind, target, value) in all_lines:
        if kind == "set" and alive(number):
            standing[target] = float(value)
    return standing


@settings(max_examples=30, deadline=None)
@given(steps=STEPS, cut=st.integers(0, 10_000))
def test_what_is_in_force_follows_from_the_lines_whatever_the_order_of_deciding_undoing_and_a_crash(
    sealed_recording, steps, cut
):
    with tempfile.TemporaryDirectory() as room:
        recording = replace(sealed_recording, folder=Path(room))
        path = Path(room) / DECISIONS
        history, content = [], b""
        for kind, target, value in steps:
            undo = Decision("E02", "w", undoes=target)
            decision = undo if kind == "undo" else Decision("E02", "w", "onset", 1, target, None, float(value))
            try:
                append(recording, decision)
            except DecisionError:
                assert path.is_file() == bool(content)
                continue  # what is not in force cannot be undone
            history.append((kind, target, value))
            longer = path.read_bytes()
            assert longer.startswith(content)  # nothing that was written is altered
            content = longer
            assert {line.stroke: line.new for line in read(Path(room)).in_force} == in_force(history)
        part = content[: cut % (len(content) + 1)]
        decisions = parse(part)
        assert {line.stroke: line.new for line in decisions.in_force} == in_force(history[: part.count(b"\n")])
        assert bool(decisions.problems) == (part != b"" and not part.endswith(b"\n"))


# What decisions do


SLOW = slide(T, mu=0.5)  # touches at 1 s, lifts at 3 s, 25 mm/s, 2 N


def analyse_with(*decisions, raw=None, t=T, of=True):
    lines = tuple(replace(decision, number=at) for at, decision in enumerate(decisions, 1))
    of_trial = trial() if of else None
    frame = Frame("-z", "set", 12.0, "set")
    readings = block(t, noisy(SLOW) if raw is None else raw)
    parts = [(of_trial, readings)]
    of_plan = plan([of_trial] if of_trial else [], frame)
    return analyse_blocks(parts, TrialContext(of_plan, INFO, SETTINGS, Decisions(lines)))


def rising():
    """A stroke whose T/N is 0.4 until 2 s and 0.5 after it."""
    n = trapezium(T, 1.0, 3.0, 0.1, 2.0)
    return noisy(wrench(T, n, 0.4 + 0.1 * (T > 2.0), 25.0 * (T - 2.0)))


@pytest.mark.parametrize(("window", "mu"), [((1.3, 1.9), 0.4), ((2.1, 2.8), 0.5)])
def test_mu_and_speed_are_those_of_the_window_decided(window, mu):
    analysis = analyse_with(replace(WINDOW, new=window), raw=rising())
    (stroke,) = analysis.strokes
    assert stroke.mu_dynamic == pytest.approx(mu, rel=0.005)
    assert stroke.speed == pytest.approx(25.0, rel=0.03)
    assert stroke.steady == pytest.approx(window, abs=0.006)
    assert analysis.friction[0].mu == stroke.mu_dynamic
    assert "the ramp was in it" in stroke.decided["steady"]


def test_a_window_decided_where_nothing_slides_gives_its_numbers_with_the_flaw():
    sticking = noisy(wrench(T, trapezium(T, 1.0, 3.0, 0.1, 2.0), 0.3 + 0.0 * T, 0.0 * T))
    assert analyse_with(raw=sticking).strokes[0].mu_dynamic is None
    analysis = analyse_with(WINDOW, raw=sticking)
    assert analysis.strokes[0].mu_dynamic == pytest.approx(0.3, rel=0.01)
    doubts = [flaw for flaw in analysis.flaws if flaw.name == "no_steady_sliding"]
    assert [flaw.grade for flaw in doubts] == ["doubtful"]


def test_a_window_decided_where_nothing_touches_gives_no_number_and_says_so():
    analysis = analyse_with(replace(WINDOW, new=(3.2, 3.6)))
    assert analysis.strokes[0].mu_dynamic is None
    assert analysis.strokes[0].reasons["mu_dynamic"] == "decision"


def test_an_onset_decided_later_leaves_the_intervals_what_they_are():
    usual, later = (
        analysis.strokes[0]
        for analysis in (analyse_with(), analyse_with(Decision("E02", "seen", "onset", 1, 1, None, 1.3)))
    )
    plain, late = stroke_intervals(usual, 0).mu_dynamic, stroke_intervals(later, 0).mu_dynamic
    assert later.onset == 1.3
    assert late[1] - late[0] == pytest.approx(plain[1] - plain[0], rel=0.2)


def test_the_stick_phase_decided_gives_static_friction_and_break_away():
    n = trapezium(T, 1.0, 3.0, 0.1, 2.0)
    bump = 0.5 + 0.03 * (abs(T - 1.4) < 0.1)  # too low to stand out by itself
    raw = noisy(wrench(T, n, bump, 25.0 * (T - 2.0)))
    analysis = analyse_with(Decision("E02", "seen", "stick", 1, 1, None, (1.1, 1.6)), raw=raw)
    (stroke,) = analysis.strokes
    assert stroke.mu_static == pytest.approx(0.53, rel=0.01)
    assert stroke.break_away == 1.6
    assert "mu_static" not in stroke.reasons


def test_a_slide_onset_decided_is_that_of_the_stroke_and_ends_the_search_for_a_static_peak():
    n = trapezium(T, 1.0, 3.0, 0.1, 2.0)
    late = 0.5 + 0.2 * (abs(T - 2.0) < 0.05)  # a bump in the slide, no static peak
    raw = noisy(wrench(T, n, late, 25.0 * (T - 2.0)))
    early, at_bump = (Decision("E02", "seen", "slide_onset", 1, 1, None, at) for at in (1.3, 2.0))
    assert analyse_with(early, raw=raw).strokes[0].mu_static is None
    (stroke,) = analyse_with(at_bump, raw=raw).strokes
    assert stroke.slide_onset == 2.0
    assert stroke.mu_static == pytest.approx(0.7, rel=0.05)


@pytest.mark.parametrize("outside", [0.5, 3.5, -5.0, 1000.0])
def test_a_slide_onset_decided_outside_of_the_contact_is_named_and_changes_nothing(outside):
    analysis = analyse_with(Decision("E02", "seen", "slide_onset", 1, 1, None, outside))
    assert analysis.strokes[0].slide_onset == analyse_with().strokes[0].slide_onset
    assert [flaw.sentence for flaw in analysis.flaws if flaw.name == "decision"] == [
        "The slide onset that was decided lies outside of the contact: it stays as it was found."
    ]


@pytest.mark.parametrize(("end", "instant"), [("onset", -1.0), ("lift", 90.0)])
def test_an_onset_or_lift_decided_where_nothing_was_read_is_named_and_changes_nothing(end, instant):
    analysis = analyse_with(Decision("E02", "seen", end, 1, 1, None, instant))
    assert getattr(analysis.strokes[0], end) == getattr(analyse_with().strokes[0], end)
    (sentence,) = (flaw.sentence for flaw in analysis.flaws if flaw.name == "decision")
    assert sentence.startswith(f"The {end} that was decided lies outside of the readings around the stroke")


def test_onset_lift_and_direction_are_those_decided():
    ends = [Decision("E02", "w", "onset", 1, 1, None, 0.9), Decision("E02", "w", "lift", 1, 1, None, 2.7)]
    (stroke,) = analyse_with(*ends, Decision("E02", "w", "direction", 1, 1, 1, -1)).strokes
    assert (stroke.onset, stroke.lift, stroke.direction, stroke.direction_from) == (0.9, 2.7, -1, "decision")
    assert stroke.mu_dynamic == pytest.approx(0.5, rel=0.005)
    assert stroke.steady[1] < 2.7


def test_a_stroke_left_out_is_shown_with_its_numbers_and_the_model_gets_none():
    analysis = analyse_with(Decision("E02", "talked", "kept", 1, 1, True, new=False))
    (stroke,) = analysis.strokes
    assert stroke.mu_dynamic == pytest.approx(0.5, rel=0.005)
    assert not stroke.kept
    assert analysis.friction == ()
    again = analyse_with(Decision("E02", "talked", "kept", 1, 1, True, new=False), Decision("E03", "fine", undoes=1))
    assert len(again.friction) == 1


def test_the_model_gets_the_stroke_decided_and_never_one_that_was_left_out():
    t = times(8.0)
    two_strokes = noisy(slide(t, mu=0.4, begin=1.0, end=3.0) + slide(t, mu=0.6, begin=5.0, end=7.0))
    choose = Decision("E02", "w", "choice", 1, None, 1, 2)
    drop = Decision("E02", "w", "kept", 1, 2, True, new=False)
    assert analyse_with(raw=two_strokes, t=t).friction[0].mu == pytest.approx(0.4, rel=0.01)
    second = analyse_with(choose, raw=two_strokes, t=t)
    assert second.friction[0].mu == pytest.approx(0.6, rel=0.01)
    assert second.friction[0].stroke == 1
    assert any("uses the one numbered 2" in flaw.sentence for flaw in second.flaws)
    without_second = analyse_with(choose, drop, raw=two_strokes, t=t)
    assert without_second.friction[0].mu == pytest.approx(0.4, rel=0.01)
    assert any(flaw.name == "decision" and "left out" in flaw.sentence for flaw in without_second.flaws)


def test_a_decision_about_no_stroke_that_is_there_is_named():
    analysis = analyse_with(replace(WINDOW, stroke=4), Decision("E02", "w", "lift", 9, 1, None, 2.0))
    assert [flaw.name for flaw in analysis.flaws] == ["decision", "decision"]
    with pytest.raises(DecisionError, match="there is no stroke 4 of trial 1: it has 1"):
        with_present(analysis, replace(WINDOW, stroke=4))


def test_a_decision_is_told_what_stands_before_it():
    analysis = analyse_with()
    (stroke,) = analysis.strokes
    assert with_present(analysis, replace(WINDOW, old=None)).old == stroke.steady
    assert with_present(analysis, Decision("E02", "w", "choice", 1, None, None, 1)).old == 1
    assert with_present(analysis, Decision("E02", "w", "kept", 1, 1, None, new=False)).old is True
