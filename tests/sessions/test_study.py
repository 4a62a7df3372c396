"""Enrolment, blinding and visits of a study."""

import errno
import json
import multiprocessing
import shutil
import sqlite3
from collections import Counter
from contextlib import closing
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st
from stand_ins import Hands, ResumableClock

from sessions.plan import study
from sessions.plan.plan import Blinded, Finger
from sessions.plan.protocols.planning import Body, design_rows, plan
from sessions.plan.protocols.protocol import FOLDER
from sessions.plan.study import (
    KEY_FILE,
    Key,
    Member,
    StudyError,
    create_study,
    enrol,
    free_slot,
    note,
    open_study,
    study_key,
    withdraw,
)
from sessions.recording import Recording, RecordingError, SessionWriter, provenance
from sessions.recording.archive import problems, seal
from sessions.recording.derived import UNBLINDING, reveal, sessions_of, store_derived
from sessions.run.replay import different_events, different_readings, replay
from sessions.run.runner import run_session
from sessions.run.steps import AskScore, Scored
from sessions.statistics.scores import score_table
from sessions.toml_file import SettingsError

TEXT = (FOLDER / "sensotact-friction.toml").read_text()
WILLIAMS = TEXT.replace('rule = "shuffled"', 'rule = "williams"')


@pytest.fixture
def folder(tmp_path):
    create_study(tmp_path / "study", WILLIAMS, 5, blinded=False)
    return tmp_path / "study"


@pytest.fixture
def blind(tmp_path):
    create_study(tmp_path / "blind", TEXT, 5, blinded=True)
    return tmp_path / "blind"


def plan_of(folder, subject, **options):
    study = open_study(folder)
    member = study.member(subject)
    place = study.place(member, study_key(folder))
    return plan(study.protocol, subject, study.session_seed(member.slot), body=member.body, place=place, **options)


# ---- rows


def test_ten_subjects_take_the_ten_rows_of_the_design_in_an_order_by_chance(folder):
    for number in range(20):
        enrol(folder, f"P{number:02d}", Body())
    rows = [plan_of(folder, f"P{number:02d}").order_row for number in range(20)]
    assert sorted(rows[:10]) == sorted(rows[10:]) == list(range(1, 11))
    assert rows[:10] != sorted(rows[:10])
    assert rows[:10] != rows[10:]
    indices = [[t.stimulus.index for t in plan_of(folder, f"P{n:02d}").blocks[0].trials] for n in range(10)]
    assert set(Counter(pair for row in indices for pair in pairwise(row)).values()) == {2}


def test_a_row_is_given_back_when_a_subject_drops_out_and_taken_by_the_next(folder):
    for subject in ("P01", "P02", "P03"):
        enrol(folder, subject, Body())
    row = plan_of(folder, "P02").order_row
    withdraw(folder, "P02", "moved away")
    with pytest.raises(StudyError, match="was withdrawn"):
        plan_of(folder, "P02")
    assert enrol(folder, "P04", Body()).slot == 1
    assert plan_of(folder, "P04").order_row == row
    assert enrol(folder, "P05", Body()).slot == 3
    with pytest.raises(StudyError, match="was enrolled in study before"):
        enrol(folder, "P02", Body())


@given(walk=st.lists(st.tuples(st.booleans(), st.integers(0, 6)), max_size=60))
def test_no_two_enrolled_subjects_ever_hold_the_same_place_and_no_place_stays_empty(walk):
    members = {}
    for joins, number in walk:
        subject = f"P{number}"
        if joins and subject not in members:
            members[subject] = Member(subject, free_slot(list(members.values())), Body())
        elif not joins and subject in members:
            place = members.pop(subject)
            members[f"{subject} gone {len(members)}"] = Member(place.subject, place.slot, place.body, "left")
    slots = [member.slot for member in members.values() if member.withdrawn is None]
    assert len(set(slots)) == len(slots)
    assert free_slot(list(members.values())) == min(set(range(len(slots) + 1)) - set(slots))


def test_an_enrolment_that_was_cut_short_is_undone_and_the_study_goes_on(folder, tmp_path):
    enrol(folder, "P01", Body())
    with closing(sqlite3.connect(folder / "study.sqlite", isolation_level=None)) as connection:
        connection.execute("PRAGMA cache_size=1")  # changes go to the file before the commit
        connection.execute("BEGIN IMMEDIATE")
        connection.executemany(
            "INSERT INTO events VALUES (?, 'now', 'enrolled', 'P02', ?)", [(9 + n, "x" * 5000) for n in range(50)]
        )
        killed = shutil.copytree(folder, tmp_path / "killed" / "study")
    assert (killed / "study.sqlite-journal").exists()
    assert list(open_study(killed).members) == ["P01"]
    assert enrol(killed, "P02", Body()).slot == 1


@pytest.mark.parametrize(
    ("stored", "flipped"),
    [(b"strokes_allowed", b"strokes_allowee"), (b"6.5", b"6.7"), (b"P01", b"Q01"), (b"+00:00", b"+01:00")],
)
def test_a_bit_that_flips_in_what_was_stored_is_named(folder, stored, flipped):
    enrol(folder, "P01", Body(Finger(6.5)))
    content = (folder / "study.sqlite").read_bytes()
    assert stored in content
    (folder / "study.sqlite").write_bytes(content.replace(stored, flipped))
    with pytest.raises(StudyError, match=r"is damaged .*restore it from a copy"):
        open_study(folder)


def test_a_study_of_before_there_were_check_sums_is_opened_and_gets_them_with_its_next_event(folder):
    enrol(folder, "P01", Body())
    with closing(sqlite3.connect(folder / "study.sqlite")) as connection, connection:
        connection.execute("DELETE FROM head WHERE name = 'crc32'")
        connection.execute("UPDATE events SET data = json_remove(data, '$.crc32')")
    assert enrol(folder, "P02", Body()).slot == 1
    with closing(sqlite3.connect(folder / "study.sqlite")) as connection:
        texts = [text for (text,) in connection.execute("SELECT data FROM events ORDER BY number")]
    assert ["crc32" in text for text in texts] == [False, False, True]


def test_of_two_programs_that_make_one_study_at_once_one_is_refused_and_takes_nothing_away(tmp_path, monkeypatch):
    new_key = study._new_key

    def another_is_faster(protocol):
        monkeypatch.setattr(study, "_new_key", new_key)
        create_study(tmp_path / "study", TEXT, 5, blinded=True)
        return new_key(protocol)

    monkeypatch.setattr(study, "_new_key", another_is_faster)
    with pytest.raises(StudyError, match="is a study already"):
        create_study(tmp_path / "study", TEXT, 7, blinded=True)
    assert open_study(tmp_path / "study").seed == 5
    assert study_key(tmp_path / "study") is not None


def _enrol_many(folder, first):
    for number in range(first, first + 10):
        enrol(folder, f"P{number}", Body())


def test_two_experimenters_who_enrol_at_once_never_reserve_the_same_row(folder):
    context = multiprocessing.get_context("fork")
    processes = [context.Process(target=_enrol_many, args=(folder, first)) for first in (0, 100)]
    for process in processes:
        process.start()
    for process in processes:
        process.join()
        assert process.exitcode == 0
    members = open_study(folder).members
    assert sorted(member.slot for member in members.values()) == list(range(20))
    assert [event.number for event in open_study(folder).events] == list(range(1, 22))


def test_both_visits_of_a_subject_have_the_same_order_and_the_same_finger(folder):
    enrol(folder, "P01", Body(Finger(6.5), 40.0, {"stickiness": 1.7}))
    scores, forces = plan_of(folder, "P01", forces=False), plan_of(folder, "P01")
    assert scores.trials == forces.trials
    assert (forces.finger.tip_radius, forces.contact_angle, forces.blocks[0].indentation) == (6.5, 40.0, 1.7)
    assert forces.study == "study"


def test_a_study_keeps_the_protocol_it_was_made_with(folder):
    assert design_rows(open_study(folder).protocol) == 10
    with pytest.raises(StudyError, match="a study already"):
        create_study(folder, TEXT, 1, blinded=False)


def test_a_study_that_could_not_be_made_is_none(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(study, "write_whole", full)  # of the sealed key
        with pytest.raises(OSError, match="No space"):
            create_study(tmp_path / "friction", TEXT, 1, blinded=True)
    assert not (tmp_path / "friction").exists()
    create_study(tmp_path / "friction", TEXT, 1, blinded=True)


@pytest.mark.parametrize(
    ("act", "pattern"),
    [
        (lambda f: enrol(f, "Jane Doe", Body()), "never a name"),
        (lambda f: enrol(f, "P01", Body(contact_angle=200.0)), "between 10 and 90 degrees"),
        (lambda f: withdraw(f, "P01", "left"), "not enrolled in study"),
        (lambda f: withdraw(f, "P01", " "), "say why"),
        (lambda f: enrol(f / "elsewhere", "P01", Body()), "is no study"),
    ],
)
def test_what_a_study_does_not_allow_is_refused_in_a_sentence_and_changes_nothing(folder, act, pattern):
    before = open_study(folder)
    with pytest.raises((StudyError, SettingsError), match=pattern):
        act(folder)
    assert open_study(folder) == before


# ---- blinding


def scored_visit(folder, subject, *, sealed=True):
    clock = ResumableClock()
    session_plan = plan_of(folder, subject, forces=False)
    key = study_key(folder)

    def judge(command):
        return [Scored(float(key.reveal(command.trial).stimulus.index))]

    path = folder / f"{subject}_scores"
    writer = SessionWriter.create(path, session_plan, None, provenance(clock), subject_simulated=True, clock=clock)
    run_session(session_plan, writer, Hands(clock, None, {AskScore: judge}), None)
    if sealed:
        seal(path)
    return path


def open_key(folder, session):
    store_derived(session, UNBLINDING, {"by": "E01", "key": study_key(folder).to_dict()})


def test_a_blinded_session_names_no_index_in_any_of_its_files(blind):
    enrol(blind, "P01", Body())
    session = scored_visit(blind, "P01")
    document = json.loads((session / "session.json").read_text())
    assert {trial["index"] for trial in document["trials"]} == {None}
    assert {t["stimulus"]["index"] for block in document["plan"]["blocks"] for t in block["trials"]} == {None}
    assert document["plan"]["key_sha256"] == study_key(blind).sha256
    # Nor does the study's folder tell it to whoever looks into its files by chance.
    assert b"stickiness" not in (blind / KEY_FILE).read_bytes()


def test_labels_of_a_blinded_study_are_dealt_anew_and_hold_throughout_it(blind, tmp_path):
    create_study(tmp_path / "other", TEXT, 5, blinded=True)
    assert study_key(blind).stimuli != study_key(tmp_path / "other").stimuli
    for subject in ("P01", "P02"):
        enrol(blind, subject, Body())
    codes = [{t.stimulus.code for t in plan_of(blind, subject).trials} for subject in ("P01", "P02")]
    assert codes[0] == codes[1] == set(study_key(blind).stimuli)


def test_scores_by_index_say_that_they_are_sealed_and_come_out_when_the_key_is_opened(blind):
    enrol(blind, "P01", Body())
    session = scored_visit(blind, "P01")
    assert reveal(Recording.open(session)).plan.blinded
    with pytest.raises(Blinded, match="daq-app unblind"):
        score_table(reveal(Recording.open(session)))
    open_key(blind, session)
    scores = score_table(reveal(Recording.open(session))).scores
    assert len(scores) == 10
    assert all(score.score == score.index for score in scores)  # the subject knew the key


def test_an_unblinded_session_is_as_it_was_recorded_still_whole_and_replays(blind, tmp_path):
    enrol(blind, "P01", Body())
    session = scored_visit(blind, "P01")
    before = Recording.open(session)
    open_key(blind, session)
    after = Recording.open(session)
    assert after.plan == before.plan
    assert problems(session) == ()
    again = replay(after, tmp_path / "again", None, lambda *_: None)
    assert [*different_readings(after, again), *different_events(after, again)] == []


def test_a_key_that_was_changed_is_found(blind):
    enrol(blind, "P01", Body())
    session = scored_visit(blind, "P01")
    key = study_key(blind)
    (first, first_stimulus), (second, second_stimulus), *rest = key.stimuli.items()
    other_key = Key(key.salt, {first: second_stimulus, second: first_stimulus, **dict(rest)})
    store_derived(session, UNBLINDING, {"by": "E01", "key": other_key.to_dict()})
    with pytest.raises(RecordingError, match="not the key that was sealed"):
        reveal(Recording.open(session))
    (blind / KEY_FILE).write_text(json.dumps({"sealed": other_key.seal()}))
    with pytest.raises(StudyError, match="its SHA-256 differs"):
        study_key(blind)


def test_a_lost_or_damaged_key_is_named_in_a_sentence(blind):
    (blind / KEY_FILE).write_text('{"sealed": "%%%"}')
    with pytest.raises(StudyError, match="cannot be read"):
        study_key(blind)
    (blind / KEY_FILE).unlink()
    with pytest.raises(StudyError, match="restore it from a copy"):
        study_key(blind)


def test_after_a_study_was_unblinded_its_later_sessions_are_open(blind):
    enrol(blind, "P01", Body())
    assert plan_of(blind, "P01").blinded
    note(blind, "unblinded", {"by": "E01", "session": "P01_scores"})
    assert plan_of(blind, "P01").blinded  # that was one session of it
    note(blind, "unblinded", {"by": "E01", "session": None})
    assert not plan_of(blind, "P01").blinded
    assert {t.stimulus.code for t in plan_of(blind, "P01").trials} == set(study_key(blind).stimuli)


# ---- visits


def test_a_session_that_lost_its_recording_or_whose_disk_is_not_there_is_named_and_other_folders_are_not(tmp_path):
    for name, file in (("S02", "MANIFEST.json"), ("to-csv", "session.json"), ("to-hdf5", "session.h5")):
        (tmp_path / name).mkdir()
        (tmp_path / name / file).touch()
    (tmp_path / "S01").mkdir()
    (tmp_path / "S01" / "session.sqlite").symlink_to("session.sqlite")
    (tmp_path / "S03" / "session.sqlite").mkdir(parents=True)
    (tmp_path / "S04").symlink_to(tmp_path / "disk" / "S04")
    (tmp_path / ".#notes").symlink_to("somebody@elsewhere")
    names = [sentence.split(" holds no recording")[0][-3:] for sentence in sessions_of(tmp_path)[1]]
    assert names == ["S01", "S02", "S03", "S04"]


def test_the_sessions_of_a_study_come_by_name_each_with_its_subject(blind):
    for subject in ("P01", "P02"):
        enrol(blind, subject, Body())
        scored_visit(blind, subject)
    shutil.copytree(blind / "P01_scores", blind / "P01_scores_again")
    assert [(r.folder.name, r.plan.subject) for r in sessions_of(blind)[0]] == [
        ("P01_scores", "P01"),
        ("P01_scores_again", "P01"),
        ("P02_scores", "P02"),
    ]
