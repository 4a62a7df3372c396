import numpy as np
import pytest
from simulated_session import Session, once
from stand_ins import RATE, Hands

from sessions.recording.log import health_of
from sessions.run.runner import RunnerSettings, run_session
from sessions.run.steps import (
    AskMount,
    AskScore,
    AskStroke,
    MeasureZero,
    Pause,
    Redo,
    Refuse,
    Resume,
    Scored,
    Skip,
    StimulusMounted,
    Tell,
)


def kinds(recording, trial=None):
    return [event.kind for event in recording.events if trial is None or event.trial == trial]


# ---- a session as it should go


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    session = Session(tmp_path_factory.mktemp("runner") / "whole")
    return session, session.run()


def test_a_whole_session_ends_complete_with_every_trial_scored(whole):
    session, recording = whole
    assert (session.end.cause, session.end.complete, session.end.reason) == ("finished", True, "every trial is done")
    assert [record.score for record in recording.trials] == [t.stimulus.index for t in session.plan.trials]
    assert all(record.outcome == "scored" and not record.other_takes for record in recording.trials)
    assert recording.losses == ()
    assert recording.flaws == ()


def test_every_reading_from_start_to_end_is_recorded_and_accounted_for(whole):
    session, recording = whole
    block = recording.readings()
    assert block.sequence.tolist() == list(range(session.transducer.sent))
    end = recording.events[-1]
    assert (end.kind, end.readings, end.data["readings"]) == ("ended", len(block), len(block))
    assert end.data["health"]["received"] == len(block)


def test_a_take_holds_its_unloaded_stretch_its_stroke_and_what_follows_up_to_the_score(whole):
    session, recording = whole
    for record, (begin, end, _) in zip(recording.trials, session.transducer.touches, strict=True):
        assert record.start_ns + 500_000_000 <= begin
        assert end < record.stop_ns
        block = recording.readings(record.trial.number)
        touching = block.raw[:, 2] < -1e6
        assert touching.sum() == pytest.approx(0.6 * RATE, abs=1)
        assert not touching[: int(0.5 * RATE)].any()
        assert not touching[-5:].any()


def test_the_events_of_a_trial_come_in_their_order(whole):
    _, recording = whole
    assert kinds(recording, 1) == [
        "mount_asked",
        "stimulus_mounted",
        "take_started",
        "zeroed",
        "stroke_asked",
        "contact_onset",
        "finger_lifted",
        "score_asked",
        "scored",
        "settled",
        "take_kept",
    ]


def test_the_zero_is_recorded_with_mean_spread_and_duration_and_nothing_is_subtracted(whole):
    _, recording = whole
    zero = next(event.data for event in recording.events if event.kind == "zeroed")
    # Simulated: a bias of 0.1 N on Fz, hence -1e5 counts, with noise of 4e3 counts over 100 readings.
    assert zero["mean"][2] == pytest.approx(-1e5, abs=5 * 4e3 / 10)
    assert zero["spread"][2] == pytest.approx(4e3, rel=0.3)
    assert zero["normal_force"] == pytest.approx(0.1, abs=0.002)
    assert zero["duration"] == pytest.approx(0.5, abs=0.02)
    block = recording.readings()
    stretch = (block.sequence >= zero["first_sequence"]) & (block.sequence <= zero["last_sequence"])
    assert stretch.sum() == zero["readings"]
    assert block.raw[stretch, 2].mean() == pytest.approx(zero["mean"][2], abs=1e-6)
    untouched = block.raw[:, 2] > -1e6
    assert block.raw[untouched, 2].mean() == pytest.approx(-1e5, abs=1e3)


def test_onset_and_lift_are_seen_at_their_true_readings(whole):
    session, recording = whole
    onsets = [event.data["time"] for event in recording.events if event.kind == "contact_onset"]
    lifts = [event.data["time"] for event in recording.events if event.kind == "finger_lifted"]
    for onset, lift, (begin, end, _) in zip(onsets, lifts, session.transducer.touches, strict=True):
        assert onset == pytest.approx((begin - session.transducer.began_ns) * 1e-9, abs=2 / RATE)
        assert lift == pytest.approx((end - session.transducer.began_ns) * 1e-9, abs=2 / RATE)


def test_the_settings_in_force_are_logged_and_marked_as_default_or_set(tmp_path):
    recording = Session(tmp_path / "s").run(settings=RunnerSettings(zero_duration=0.4))
    settings = recording.events[0].data["settings"]
    assert settings["zero_duration"] == {"value": 0.4, "origin": "set"}
    assert settings["tick"]["origin"] == "default"


def test_the_same_plan_and_the_same_happenings_give_the_same_log(tmp_path, whole):
    _, first = whole
    assert Session(tmp_path / "again").run().events == first.events


def test_nothing_is_shown_before_it_is_safe(tmp_path):
    session = Session(tmp_path / "s")
    show = session.hands.show

    def show_checked(command):
        if not isinstance(command, MeasureZero):
            assert session.writer.acknowledged.readings == session.writer.reading_count
            assert session.writer.acknowledged.events == session.writer._event_count
        show(command)

    session.hands.show = show_checked
    assert session.run().events[-1].kind == "ended"


# ---- visits without forces


def test_a_visit_for_scores_only_asks_the_disk_every_second_while_nobody_does_anything(tmp_path):
    session = Session(tmp_path / "s", forces=False, instead={AskMount: lambda _: []})
    ages = []

    def note_age(status):
        ages.append((session.clock.now_ns() - status.safe.time_ns) * 1e-9)

    start_ns = session.clock.now_ns()
    session.run(progress=note_age, stop=lambda: ("aborted", "") if session.clock.now_ns() - start_ns > 20e9 else None)
    assert len(ages) > 15
    assert max(ages) < 1.5  # the lamp says NOT RECORDING after 3 s


def test_a_visit_for_scores_only_has_no_readings_and_no_zero(tmp_path):
    recording = Session(tmp_path / "s", forces=False).run()
    assert recording.info is None
    assert len(recording.readings()) == 0
    assert [record.outcome for record in recording.trials] == ["scored"] * 10
    assert kinds(recording, 1)[2:] == [
        "take_started",
        "stroke_asked",
        "stroke_done",
        "score_asked",
        "scored",
        "take_kept",
    ]


def test_a_visit_with_forces_is_not_run_without_a_transducer(tmp_path):
    session = Session(tmp_path / "s")
    with pytest.raises(ValueError, match="needs a transducer"):
        run_session(session.plan, session.writer, session.hands, None)
    session.writer.close()


# ---- redo, skip, pause, refusals, no answer


def test_a_discarded_take_stays_in_the_file_and_the_next_one_counts(tmp_path):
    recording = Session(tmp_path / "s", instead={AskScore: once(Redo("finger slipped"))}).run()
    record = recording.trials[0]
    assert record.outcome == "scored"
    assert (record.take.number, [take.number for take in record.other_takes]) == (2, [1])
    assert record.other_takes[0].discard_reason == "finger slipped"
    spoiled = recording.readings_between(record.other_takes[0].start_ns, record.other_takes[0].stop_ns)
    assert (spoiled.raw[:, 2] < -1e6).sum() == pytest.approx(0.6 * RATE, abs=1)
    assert [r.trial.number for r in recording.trials if r.outcome == "scored"] == list(range(1, 11))


def test_a_trial_done_again_after_its_score_has_only_its_new_score(tmp_path):
    answers = iter([[Scored(11.0)]])
    mounts = iter([None, [Redo("wrong hand")], None])
    instead = {AskScore: lambda _: next(answers, None), AskMount: lambda _: next(mounts, None)}
    session = Session(tmp_path / "s", instead=instead)
    recording = session.run()
    record = recording.trials[0]
    assert record.score == session.plan.trials[0].stimulus.index != 11.0
    assert (record.take.number, record.other_takes[0].discard_reason) == (2, "wrong hand")
    assert record.other_takes[0].stop_ns < record.start_ns


def test_a_skipped_trial_is_recorded_as_skipped(tmp_path):
    recording = Session(tmp_path / "s", instead={AskStroke: once(Skip("surface torn"))}).run()
    record = recording.trials[0]
    assert (record.outcome, record.take, record.score) == ("skipped", None, None)
    assert record.other_takes[0].discard_reason == "skipped: surface torn"
    assert len(recording.readings(1)) == 0
    assert recording.trials[1].outcome == "scored"


def test_not_answered_is_an_outcome_of_its_own_and_its_stroke_counts(tmp_path):
    recording = Session(tmp_path / "s", instead={AskScore: once(Scored(None))}).run()
    record = recording.trials[0]
    assert (record.outcome, record.score) == ("not answered", None)
    assert len(recording.readings(1)) > 0


def test_a_pause_and_its_end_are_recorded_and_the_trial_is_done_anew(tmp_path):
    recording = Session(tmp_path / "s", instead={AskStroke: once(Pause(), Resume())}).run()
    assert [kind for kind in kinds(recording, 1) if kind in ("pause", "resume")] == ["pause", "resume"]
    assert recording.trials[0].take.number == 2


def test_an_event_that_is_not_meant_is_refused_shown_and_logged(tmp_path):
    session = Session(tmp_path / "s", instead={AskMount: once(StimulusMounted("A00"), StimulusMounted("X"))})
    calls = []

    def poll():
        calls.append(1)
        if len(calls) == 60:  # nobody mounts the right one otherwise
            return [StimulusMounted(session.plan.trials[0].stimulus.code)]
        return Hands.poll(session.hands)

    session.hands.poll = poll
    recording = session.run()
    code = session.plan.trials[0].stimulus.code
    assert [event.data["sentence"] for event in recording.events if event.kind == "refused"] == [
        f"trial 1 needs the stimulus {code}, not A00",
        f"trial 1 needs the stimulus {code}, not X",
    ]
    assert sum(isinstance(command, Refuse) for command in session.hands.display) == 2


def test_a_further_stroke_before_the_score_is_recorded_and_flagged(tmp_path):
    session = Session(tmp_path / "s")
    untouched = [True]

    def answer_late(_):
        if untouched:
            untouched.pop()
            now = session.clock.at_ns
            session.hands.stroke(now)
            session.hands.events.append((now + 1_500_000_000, Scored(50.0)))
            return []
        return None

    session.hands.instead[AskScore] = answer_late
    recording = session.run()
    assert recording.trials[0].take.strokes == 2
    assert recording.flaws == ("trial 1 holds 2 strokes where one was asked for",)


def test_no_zero_is_taken_while_something_touches_and_somebody_is_informed(tmp_path):
    session = Session(tmp_path / "s")

    def lean(_):
        if not session.transducer.touches:  # a hand that comes and goes for 8 s
            at = session.clock.at_ns
            for i in range(20):
                begin = at + i * 400_000_000
                session.transducer.touches.append((begin, begin + 200_000_000, 1.0))
            session.leaning_until = session.transducer.touches[-1][1]

    session.hands.instead[MeasureZero] = lean
    recording = session.run()
    zeroed = next(event for event in recording.events if event.kind == "zeroed")
    assert zeroed.time_ns > session.leaning_until
    assert any(isinstance(command, Tell) and "take hands off" in command.sentence for command in session.hands.display)


# ---- losses and status


def test_lost_readings_and_a_rate_not_as_set_are_logged_and_named_as_flaws(tmp_path):
    words = "readings come at 100 Hz, not at 200 Hz"
    recording = Session(tmp_path / "s", lost=range(300, 307), rate_words=words).run()
    losses = [event.data for event in recording.events if event.kind == "losses"]
    assert sum(data["lost"] for data in losses) == 7
    assert [data["rate_words"] for data in losses if data["off_rate"]] == [words]
    assert words in next(data["sentence"] for data in losses if data["off_rate"])
    assert recording.flaws == (
        "7 readings never arrived",
        "how often the device's rate was found to be another than set, or than before: 1",
        f"the rate that was found: {words}",
    )
    assert health_of(event for event in recording.events if event.kind == "losses").rate_words == words
    assert not np.isin(np.arange(300, 307), recording.readings().sequence).any()


def test_losses_are_reported_at_most_once_a_second(tmp_path):
    recording = Session(tmp_path / "s", lost=range(100, 1000, 3)).run()
    times = [event.time_ns for event in recording.events if event.kind == "losses"]
    assert len(times) >= 3
    assert min(np.diff(times[:-1])) >= 1e9
    assert sum(event.data["lost"] for event in recording.events if event.kind == "losses") == 300


def test_progress_tells_what_the_recording_has_acknowledged(tmp_path):
    reports = []
    session = Session(tmp_path / "s")
    session.run(progress=reports.append)
    assert {status.state for status in reports} >= {"mounting", "taring", "ready", "stroking", "scoring"}
    assert all(status.safe.readings <= status.readings for status in reports)
    # A commit a second: never more than one second and one look are not yet safe.
    assert max(status.readings - status.safe.readings for status in reports) <= 1.1 * RATE


def test_a_clock_that_jumps_ahead_while_the_computer_slept_costs_nothing_and_the_session_goes_on(tmp_path):
    session = Session(tmp_path / "s")

    def asleep(_):
        if session.clock.at_ns < 100e9:
            session.clock.at_ns += 100_000_000_000

    session.hands.instead[AskScore] = asleep
    recording = session.run()
    assert session.end.complete
    sequence = recording.readings().sequence
    assert sequence.tolist() == list(range(session.transducer.sent))
    assert len(sequence) > 100 * RATE
    assert recording.losses == recording.flaws == ()
    times = [event.time_ns for event in recording.events]
    assert times == sorted(times)
