import json
import random
from dataclasses import replace as replace_fields

import pytest
from recordings import change, rows
from simulated_session import once, resume
from stand_ins import INFO, Hands, ResumableClock, StandIn

from drivers.transducer import LinkLost, SetupError
from sessions.exchange.import_csv import import_csv
from sessions.plan.plan import Rests
from sessions.plan.protocols.planning import plan
from sessions.plan.protocols.protocol import protocol, protocol_names
from sessions.recording import Recording, SessionWriter, provenance
from sessions.recording.archive import seal
from sessions.recording.replay import ReplayTransducer
from sessions.recording.schema import event_crc, event_row
from sessions.run.replay import different_events, different_readings, replay
from sessions.run.runner import run_session
from sessions.run.steps import (
    Abort,
    AskMount,
    AskScore,
    AskStroke,
    Begin,
    MagnitudeEstimate,
    Note,
    Pause,
    Redo,
    Resume,
    Scored,
    Skip,
    StimulusMounted,
    StrokeDone,
)
from sessions.strokes import analyse

PAPER = protocol("sensotact-friction")


def record_session(
    folder,
    *,
    forces=True,
    instead=None,
    stop=lambda _: False,
    hands=Hands,
    protocol=PAPER,
    phases=None,
    most=1,
    **transducer,
):
    """Record a session in simulated time, `most` trials a block; `stop` is asked with the number of readings sent."""
    clock = ResumableClock()
    session_plan = plan(protocol, "S01", 3, forces=forces, phases=phases)
    session_plan = replace_fields(
        session_plan, blocks=tuple(replace_fields(b, trials=b.trials[:most]) for b in session_plan.blocks)
    )
    info = INFO if forces else None
    writer = SessionWriter.create(folder, session_plan, info, provenance(clock), subject_simulated=True, clock=clock)
    device = StandIn(clock, **transducer) if forces else None
    run_session(
        session_plan,
        writer,
        hands(clock, device, instead),
        device,
        stop=lambda: ("stopped", "stopped by the user") if stop(device and device.sent) else None,
    )
    return Recording.open(folder)


def replay_session(recording, tmp_path, speed=None):
    return replay(recording, tmp_path / "replayed", speed, lambda *_: None)


def differences(recording, replica):
    return [*different_readings(recording, replica), *different_events(recording, replica)]


def replay_identical(recording, tmp_path):
    replica = replay_session(recording, tmp_path)
    assert differences(recording, replica) == []
    assert json.dumps(analyse(replica).to_dict()) == json.dumps(analyse(recording).to_dict())
    return replica


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return record_session(tmp_path_factory.mktemp("replay") / "whole", most=5)


def test_a_whole_session_comes_out_identical_to_the_last_bit(whole, tmp_path):
    replica = replay_identical(whole, tmp_path)
    assert len(replica.events) > 90
    assert replica.simulated_sentence == whole.simulated_sentence


@pytest.mark.parametrize(
    "instead",
    [
        {AskStroke: once(Redo("the finger slipped"))},
        {AskStroke: once(Skip("the label fell off"))},
        {AskScore: once(Pause(), Resume())},
        {AskStroke: once(Pause(), Resume())},
        {AskMount: once(StimulusMounted("Z99"), Begin(), StimulusMounted("R29"))},
        {AskScore: once(Scored(120.5), Scored(None), Redo(""))},
        {
            AskScore: once(
                Scored(float("nan")), Note("cold hands"), Note(""), MagnitudeEstimate(3.0), Scored(5.0, ((1.0, 4.0),))
            )
        },
        {AskScore: once(Abort("fire alarm"))},
        {AskMount: once(Abort("fire alarm"))},
    ],
    ids=[
        "redo",
        "skip",
        "pause",
        "early pause",
        "wrong stimulus",
        "wrong score",
        "answers of other kinds",
        "abort",
        "early abort",
    ],
)
def test_whatever_people_did_or_were_refused_comes_out_identical(instead, tmp_path):
    replay_identical(record_session(tmp_path / "session", instead=instead), tmp_path)


@pytest.mark.parametrize(
    ("name", "phases", "forces", "outcomes"),
    [
        ("sensotact-friction", ("pre-evaluation", "practice", "main"), False, {"scored"}),
        ("magnitude-estimation", ("practice", "main"), False, {"numbered"}),
        ("paired-comparison", ("main",), False, {"presented", "chosen"}),
        ("paired-comparison", ("practice",), True, {"presented", "chosen"}),
    ],
)
def test_every_built_in_protocol_is_carried_to_its_end_with_its_rests_and_comes_out_identical(
    name, phases, forces, outcomes, tmp_path
):
    assert name in protocol_names()
    session = record_session(tmp_path / "session", protocol=protocol(name), phases=phases, forces=forces, most=99)
    assert session.end["complete"]
    assert {record.outcome for record in session.trials} == outcomes
    kinds = [event.kind for event in session.events]
    timed = protocol(name).rests.duration is not None
    assert kinds.count("rest_over") == (kinds.count("rest_asked") if timed else 0)
    assert ("rest_asked" in kinds) == ("main" in phases and name != "sensotact-friction")
    replay_identical(session, tmp_path)


def test_a_rest_that_ends_by_the_clock_comes_out_at_the_same_reading(tmp_path):
    often = replace_fields(PAPER, rests=Rests(after_trials=2, duration=1.5))
    session = record_session(tmp_path / "session", protocol=often, most=99)
    assert [event.kind for event in session.events].count("rest_over") == 4
    replay_identical(session, tmp_path)


@pytest.mark.parametrize("seed", range(4))
def test_a_session_in_which_people_do_anything_at_any_moment_comes_out_identical(seed, tmp_path):
    chance = random.Random(seed)

    class Restless(Hands):
        def poll(self):
            acts = super().poll()
            if chance.random() < 0.02:
                acts.append(
                    chance.choice(
                        [
                            Redo("again"),
                            Redo(""),
                            Pause(),
                            Resume(),
                            Resume(),
                            Resume(),
                            Skip("no"),
                            Scored(chance.choice([None, 7.25, -1.0, 130.0])),
                            StrokeDone(),
                            StimulusMounted("Q00"),
                        ]
                    )
                )
            return acts

    losses = {chance.randrange(4000) for _ in range(40)}
    recording = record_session(tmp_path / "session", hands=Restless, lost=losses, stop=lambda sent: sent > 4000)
    assert any(event.kind == "refused" for event in recording.events)
    replay_identical(recording, tmp_path)


def test_lost_readings_are_reported_at_the_same_moments(tmp_path):
    recording = record_session(tmp_path / "session", lost=range(100, 1500, 7))
    assert sum(event.kind == "losses" for event in recording.events) > 3
    replay_identical(recording, tmp_path)


def test_a_zero_that_could_not_be_measured_is_reported_at_the_same_moments(tmp_path):
    class LeaningHands(Hands):
        def show(self, command):
            if isinstance(command, AskMount) and not self.transducer.touches:
                for i in range(48):  # a hand that leans on it now and then, for 14 s
                    at = self.clock.at_ns + i * 300_000_000
                    self.transducer.touches.append((at, at + 100_000_000, 1.0))
            super().show(command)

    recording = record_session(tmp_path / "session", hands=LeaningHands)
    assert sum(event.kind == "told" for event in recording.events) > 1
    replay_identical(recording, tmp_path)


def test_a_session_that_lost_its_transducer_ends_so_again(tmp_path):
    recording = record_session(tmp_path / "session", most=3, link_lost_after=1234)
    assert recording.events[-1].data["cause"] == "device"
    replay_identical(recording, tmp_path)


def test_a_session_that_was_stopped_ends_so_again(tmp_path):
    recording = record_session(tmp_path / "session", stop=lambda sent: sent > 777)
    assert recording.events[-1].data["cause"] == "stopped"
    replay_identical(recording, tmp_path)


def test_a_session_that_our_own_error_ended_ends_so_again(tmp_path):
    class BrokenHands(Hands):
        def poll(self):
            if self.transducer.sent > 500:
                raise ZeroDivisionError("an error: of ours")
            return super().poll()

    with pytest.raises(ZeroDivisionError):
        record_session(tmp_path / "session", hands=BrokenHands)
    recording = Recording.open(tmp_path / "session")
    assert recording.events[-1].data["reason"] == "ZeroDivisionError: an error: of ours"
    replay_identical(recording, tmp_path)


@pytest.mark.parametrize("last", [1, 4, 6, 7, 8, 9, 11, 13, 40])
def test_a_session_cut_short_anywhere_is_replayed_to_where_it_was_cut(last, tmp_path):
    record_session(tmp_path / "session", most=3)
    cut_short(tmp_path / "session", last)
    recording = Recording.open(tmp_path / "session")
    assert "cut short" in recording.losses[-1]
    replica = replay_identical(recording, tmp_path)
    assert replica.losses == recording.losses


def test_a_sealed_session_replays_as_the_live_one(tmp_path):
    recording = record_session(tmp_path / "session")
    seal(recording.folder)
    replay_identical(Recording.open(recording.folder), tmp_path)


def test_a_visit_that_only_scored_comes_out_identical(tmp_path):
    replay_identical(
        record_session(tmp_path / "session", forces=False, instead={AskStroke: once(Redo("again"))}), tmp_path
    )


def test_an_imported_recording_comes_out_identical(tmp_path):
    file = tmp_path / "a.csv"
    force = [0.0] * 200 + [2.0] * 200 + [0.0] * 100
    lines = [f"{i / 200},{0.5 * n},0,{-n},0,0,0" for i, n in enumerate(force)]
    file.write_text("\n".join(["t_s,Fx_N,Fy_N,Fz_N,Tx_Nm,Ty_Nm,Tz_Nm", *lines]))
    imported = import_csv(file, tmp_path / "imported")
    replica = replay_identical(Recording.open(imported.folder), tmp_path)
    assert len(replica.readings()) == 500
    change(imported.folder, "DELETE FROM events")  # the import was cut short before its last line
    assert len(replay_identical(Recording.open(imported.folder), tmp_path / "again").readings()) == 500


def test_an_onset_that_was_stored_otherwise_is_named_with_both_values(tmp_path):
    recording = record_session(tmp_path / "session")
    onset = next(event for event in recording.events if event.kind == "contact_onset")
    data = json.dumps({**onset.data, "time": onset.data["time"] + 0.5})
    change(
        recording.folder,
        "UPDATE events SET data = ?, crc32 = ? WHERE number = ?",
        (data, event_crc(onset, data), onset.number),
    )
    altered = Recording.open(recording.folder)
    (difference,) = differences(altered, replay_session(altered, tmp_path))
    assert difference.startswith(f"event {onset.number} (contact_onset in trial 1).data.time was stored as")
    assert str(onset.data["time"]) in difference


def test_an_onset_that_the_readings_do_not_show_comes_no_more(tmp_path):
    recording = record_session(tmp_path / "session", most=99)
    change(recording.folder, "DELETE FROM blocks WHERE number > 3")
    damaged = Recording.open(recording.folder)
    difference = differences(damaged, replay_session(damaged, tmp_path))
    assert any("(contact_onset in trial 10) came no more" in sentence for sentence in difference)


def test_at_a_chosen_speed_the_outcome_is_the_same(whole, tmp_path):
    assert differences(whole, replay_session(whole, tmp_path, speed=200.0)) == []


def cut_short(folder, last):
    """Leave of a session what a crash leaves: the events up to number `last`, and the blocks committed by then."""
    keep = rows(folder, f"SELECT readings FROM events WHERE number = {last}")[0][0]
    change(folder, "DELETE FROM events WHERE number > ?", (last,))
    total = 0
    for number, count in rows(folder, "SELECT number, readings FROM blocks ORDER BY number"):
        if total >= keep:
            change(folder, "DELETE FROM blocks WHERE number >= ?", (number,))
            break
        total += count


@pytest.mark.parametrize("lasts", [(9,), (20, 31), (24, 26, 60)])
def test_a_session_that_was_cut_short_and_resumed_comes_out_identical(lasts, tmp_path):
    folder = tmp_path / "session"
    record_session(folder, most=3)
    for last in lasts:
        cut_short(folder, last)
        resume(folder, seed=last)
    recording = Recording.open(folder)
    assert recording.end["complete"]
    assert [event.kind for event in recording.events].count("resumed") == len(lasts)
    replica = replay_identical(recording, tmp_path)
    assert len(replica.readings()) == len(recording.readings()) > 2000


def test_a_session_whose_transducer_was_lost_and_that_was_resumed_comes_out_identical(tmp_path):
    folder = tmp_path / "session"
    record_session(folder, most=3, link_lost_after=1100)
    resume(folder, link_lost_after=700)
    resume(folder)
    recording = Recording.open(folder)
    assert [event.data["cause"] for event in recording.events if event.kind == "ended"] == ["device"] * 2 + ["finished"]
    replay_identical(recording, tmp_path)


def test_a_resumed_session_that_was_altered_is_found(tmp_path):
    folder = tmp_path / "session"
    record_session(folder)
    cut_short(folder, 20)
    resume(folder)
    (number,) = rows(folder, "SELECT max(number) FROM events WHERE kind = 'contact_onset'")[0]
    event = Recording.open(folder).events[number - 1]
    other = replace_fields(event, data={**event.data, "time": event.data["time"] + 0.5})
    change(folder, "DELETE FROM events WHERE number = ?", (number,))
    change(folder, "INSERT INTO events VALUES (?,?,?,?,?,?,?)", event_row(other))
    recording = Recording.open(folder)
    (difference,) = differences(recording, replay_session(recording, tmp_path))
    assert "time was stored as" in difference


# ---- the transducer of a recording, for anybody


def test_a_replaying_transducer_gives_each_reading_as_long_after_the_start_as_it_came(whole):
    clock = ResumableClock(5_000_000_000_000)
    transducer = ReplayTransducer(whole, clock, "replay:whole")
    transducer.start()
    start_ns = clock.at_ns
    expected = whole.readings()
    blocks = []
    while transducer.health.received < len(expected):
        block = transducer.read(0.02)
        assert not len(block) or block.received_ns[-1] <= clock.at_ns
        blocks.append(block)
    with pytest.raises(LinkLost, match="ends here"):
        transducer.read(0.02)
    for name in ("sequence", "counter", "status", "time", "raw"):
        columns = [getattr(block, name).tobytes() for block in blocks]
        assert b"".join(columns) == getattr(expected, name).tobytes()
    received = [instant - start_ns for block in blocks for instant in block.received_ns.tolist()]
    assert received == (expected.received_ns - expected.received_ns[0]).tolist()
    assert transducer.health.received == len(expected)
    assert transducer.info.simulated


def test_a_recording_without_readings_is_no_transducer(tmp_path):
    recording = record_session(tmp_path / "session", forces=False)
    with pytest.raises(SetupError, match="holds no readings"):
        ReplayTransducer(recording, ResumableClock(), "replay:x")


def test_a_replayed_transducer_records_a_session_of_its_own(whole, tmp_path):
    clock = ResumableClock(9_000_000_000_000)
    device = ReplayTransducer(whole, clock, "replay:whole")
    session_plan = plan(PAPER, "S02", 4)
    writer = SessionWriter.create(tmp_path / "new", session_plan, device.info, provenance(clock), clock=clock)

    class Asking(Hands):
        def stroke(self, now, newtons=2.0):
            """Leave the stroking to the recording."""

    end = run_session(session_plan, writer, Asking(clock, device), device)
    replica = Recording.open(tmp_path / "new")
    raw = whole.readings().raw
    assert end.readings > 0.9 * len(raw)
    assert replica.readings().raw.tobytes() == raw[: end.readings].tobytes()
    assert any(event.kind == "contact_onset" for event in replica.events)
