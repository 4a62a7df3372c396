import os
import time
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import pytest
from killed_process import fork, kill, lines_of
from recordings import INFO, PLAN, TRIAL, new_writer

from daq_app.recorder.messages import People, SessionBegun, StartSession
from daq_app.window.course_state import begin_session
from daq_app.window.new_session import (
    Bench,
    Refusal,
    SessionForm,
    check_form,
    enrol_subject,
    enrolment,
    optional_phases,
    pilot_form,
    refusals,
    unfinished_sessions,
)
from daq_app.window.state import BenchState
from daq_app.window.view_course import course_view
from sessions.plan.plan import Frame
from sessions.plan.protocols.planning import Body
from sessions.plan.protocols.protocol import protocol_file, protocol_names
from sessions.plan.study import create_study, enrol, study_key, withdraw

NOW = datetime(2026, 3, 1, 14, 30, 5)
SIMULATED = Bench(connected=True, simulated=True, frame=Frame("-z", "set", 20.0, "set"))
REAL = Bench(connected=True)
FORM = SessionForm(subject="P07", folder="kept")


def test_a_form_that_is_right_begins_a_session_in_a_folder_of_its_own():
    request = check_form(replace(FORM, study="pilot", seed="7"), SIMULATED, NOW, 99)
    assert isinstance(request, StartSession)
    assert request.folder == "kept/pilot/P07_sensotact-friction_20260301T143005"
    assert request.plan.subject == "P07"
    assert request.plan.seed == 7
    assert request.plan.frame == SIMULATED.frame
    assert {s.name: (s.value, s.origin) for s in request.settings} == {"seed": (7, "set"), "study": ("pilot", "set")}


def test_an_empty_seed_is_a_new_one_and_is_marked_as_nobodys_choice():
    request = check_form(FORM, REAL, NOW, 99)
    assert request.plan.seed == 99
    assert request.settings[0].origin == "default"


@pytest.mark.parametrize(
    ("form", "bench", "kind"),
    [
        (FORM, REAL, "people"),
        (FORM, SIMULATED, "simulated hand"),
        (replace(FORM, simulated=True), SIMULATED, "simulated people"),
        (replace(FORM, forces=False), Bench(), "people"),
        (replace(FORM, forces=False, simulated=True), Bench(), "simulated people"),
    ],
)
def test_who_strokes_and_scores_follows_from_bench_and_choice(form, bench, kind):
    assert check_form(replace(form, seed="3"), bench, NOW, 0).people == People(kind, 3)


@pytest.mark.parametrize(
    ("form", "bench", "field", "words"),
    [
        (replace(FORM, subject=""), REAL, "subject", "never a name"),
        (replace(FORM, subject="Ada Lovelace"), REAL, "subject", "never a name"),
        (replace(FORM, seed="x"), REAL, "seed", "whole number"),
        (replace(FORM, seed=str(2**31)), REAL, "seed", "whole number"),
        (replace(FORM, study="../x"), REAL, "study", "slash"),
        (replace(FORM, protocol="nowhere"), REAL, "protocol", "nowhere"),
        (replace(FORM, protocol="nowhere.toml"), REAL, "protocol", "nowhere.toml"),
        (replace(FORM, height="high"), REAL, "height", "millimetres"),
        (replace(FORM, height="900"), REAL, "height", "millimetres"),
        (replace(FORM, area="0"), REAL, "area", "mm²"),
        (replace(FORM, area="much"), REAL, "area", "mm²"),
        (replace(FORM, area="1,250"), REAL, "area", "Type 1250 or 1.250."),
        (replace(FORM, height="-1,250"), REAL, "height", "Type 1250 or 1.250."),
        (FORM, Bench(), "forces", "No transducer is connected"),
        (replace(FORM, simulated=True), REAL, "simulated", "Only the simulated bench"),
    ],
)
def test_what_is_wrong_is_said_beside_its_field(form, bench, field, words):
    request = check_form(form, bench, NOW, 0)
    assert isinstance(request, Refusal)
    assert list(request) == [field]
    assert words in request[field]
    assert request[field].endswith(".")


def test_a_folder_that_is_a_file_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    request = check_form(replace(FORM, folder=str(tmp_path / "file")), REAL, NOW, 0)
    assert "is a file" in request["folder"]


def test_a_folder_below_the_home_of_nobody_or_that_no_file_system_can_hold_is_refused_beside_its_field(tmp_path):
    for folder_name in ("~nobody-of-that-name/recordings", str(tmp_path / ("x" * 300))):
        form = replace(FORM, folder=folder_name, study="pilot")
        assert "folder" in refusals(form, REAL, enrolment(form))


def test_sessions_that_were_cut_short_are_listed_whatever_else_lies_in_the_folder(tmp_path):
    new_writer(tmp_path / "P01").close()
    (tmp_path / "gone").mkdir()
    (tmp_path / "gone" / "session.sqlite").symlink_to(tmp_path / "nowhere")
    assert [session.folder for session in unfinished_sessions(tmp_path)] == [tmp_path / "P01"]
    assert unfinished_sessions(tmp_path / ("x" * 300)) == ()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="another program would have to be started otherwise")
def test_a_session_that_another_window_records_is_not_said_to_be_cut_short(tmp_path):
    def record(report):
        writer = new_writer(tmp_path / "P01")
        writer.event("begin")
        report("begun")
        time.sleep(60.0)

    process, reports = fork(record)
    assert lines_of(reports, 1)
    (session,) = unfinished_sessions(tmp_path)
    assert session.in_use
    assert session.uri == INFO.uri
    kill(process)
    assert [(session.folder, session.in_use) for session in unfinished_sessions(tmp_path)] == [
        (tmp_path / "P01", False)
    ]


def test_a_height_that_was_measured_is_recorded_as_measured_and_one_that_nobody_stated_as_a_default():
    for typed, height in (("-12.25", -12.25), ("−12,25", -12.25), ("+3", 3.0), (" 0,125 ", 0.125)):
        assert check_form(replace(FORM, height=typed), REAL, NOW, 0).plan.frame.height == height
    assert check_form(replace(FORM, height="12,5"), REAL, NOW, 0).plan.frame == Frame("-z", "default", 12.5, "measured")
    assert check_form(FORM, REAL, NOW, 0).plan.frame.height_origin == "default"


def test_the_axis_of_pressing_and_the_contact_area_are_recorded_as_they_were_set():
    request = check_form(replace(FORM, normal="+x", area="85"), REAL, NOW, 0).plan
    assert (request.frame.normal, request.frame.normal_origin) == ("+x", "set")
    assert (request.contact_area, request.contact_area_origin) == (85.0, "set")
    assert check_form(FORM, REAL, NOW, 0).plan.frame.normal_origin == "default"


@pytest.fixture
def study(tmp_path):
    text = protocol_file("sensotact-friction").read_text(encoding="utf-8")
    create_study(tmp_path / "pilot", text, 11, blinded=True)
    return tmp_path / "pilot"


def in_study(study, subject):
    return SessionForm(subject=subject, folder=str(study.parent), study="pilot", protocol="nowhere", seed="7")


def test_a_session_of_a_study_is_the_one_decided_at_enrolment_whatever_the_page_says(study):
    member = enrol(study, "P07", Body(contact_angle=40.0))
    request = check_form(in_study(study, "P07"), SIMULATED, NOW, 99)
    again = check_form(replace(in_study(study, "P07"), forces=False), SIMULATED, NOW, 98)
    assert request.plan.protocol == "sensotact-friction"
    assert request.plan.contact_angle == 40.0
    assert request.plan.seed == again.plan.seed not in (7, 98, 99)
    assert {s.name: s.origin for s in request.settings}["seed"] == "default"
    codes = {trial.stimulus.code for block in request.plan.blocks for trial in block.trials}
    assert codes == set(study_key(study).stimuli)
    assert (member.slot, request.folder) == (0, str(study / "P07_forces_20260301T143005"))


def test_who_is_not_enrolled_is_enrolled_at_a_button_and_who_was_withdrawn_is_refused(study):
    form = in_study(study, "P08")
    assert enrolment(form).may_enrol
    assert "not enrolled" in check_form(form, SIMULATED, NOW, 0)["subject"]
    assert enrol_subject(form) == ""
    assert "P08 is enrolled" in enrolment(form).sentence
    assert "blinded" in enrolment(form).sentence
    assert "enrolled in pilot before" in enrol_subject(form)
    withdraw(study, "P08", "moved away")
    assert not enrolment(form).may_enrol
    assert "moved away" in enrolment(form).sentence
    assert "moved away" in check_form(form, SIMULATED, NOW, 0)["subject"]


def test_a_folder_that_is_no_study_leaves_protocol_and_seed_to_the_page(tmp_path):
    assert enrolment(SessionForm(subject="P07", folder=str(tmp_path), study="pilot")) is None


def test_a_study_that_cannot_be_read_says_so(study):
    (study / "study.sqlite").write_bytes(b"not a database")
    assert "cannot be read" in enrolment(in_study(study, "P07")).sentence
    assert isinstance(check_form(in_study(study, "P07"), SIMULATED, NOW, 0), Refusal)


def test_pre_evaluation_and_practice_are_offered_where_the_protocol_has_them_and_come_before_what_counts(tmp_path):
    assert optional_phases(FORM) == ("pre-evaluation", "practice")
    request = check_form(replace(FORM, pre_evaluation=True, practice=True), REAL, NOW, 0).plan
    phases = list(dict.fromkeys(trial.phase for trial in request.trials))
    assert phases == ["pre-evaluation", "practice", "main"]
    rows = course_view(begin_session(SessionBegun("", request, "people", None, 0), 0.0), BenchState(), 0.0).rows
    assert [row.name for row in rows if row.kind == "block"] == [
        "stickiness, pre-evaluation",
        "slipperiness, pre-evaluation",
        "stickiness, practice",
        "stickiness",
        "slipperiness, practice",
        "slipperiness",
    ]
    bare = tmp_path / "bare.toml"
    lines = protocol_file("sensotact-friction").read_text(encoding="utf-8").splitlines()
    bare.write_text("\n".join(line for line in lines if not line.startswith("practice")), encoding="utf-8")
    assert optional_phases(replace(FORM, protocol=str(bare))) == ("pre-evaluation",)
    assert "practice" in check_form(replace(FORM, protocol=str(bare), practice=True), REAL, NOW, 0)["protocol"]
    assert optional_phases(replace(FORM, protocol="nowhere")) == ()


@pytest.mark.parametrize("name", protocol_names())
def test_any_protocol_is_piloted_on_the_simulated_bench_and_without_it(name, tmp_path):
    form = SessionForm(protocol=name, folder=str(tmp_path), subject="Ada Lovelace", height="tall")
    for bench, forces in ((Bench(True, True, Frame()), True), (Bench(True), False), (Bench(), False)):
        request = check_form(pilot_form(form, bench), bench, NOW, 5)
        assert request.people.kind == "simulated people"
        assert request.plan.subject == "PILOT"
        assert request.plan.forces is forces
        assert Path(request.folder).parent == tmp_path / "pilots"


def test_a_pilot_in_a_study_runs_the_studys_protocol_and_leaves_nothing_in_it(tmp_path):
    text = protocol_file("paired-comparison").read_text(encoding="utf-8")
    create_study(tmp_path / "study", text, 11, blinded=True)
    form = SessionForm(study="study", folder=str(tmp_path))
    request = check_form(pilot_form(form, Bench()), Bench(), NOW, 5)
    assert request.plan.protocol == "paired-comparison"
    assert Path(request.folder).parent == tmp_path / "pilots"
    assert not any(setting.name == "study" for setting in request.settings)


def test_a_skipped_trial_of_a_session_that_was_cut_short_is_not_done(tmp_path):
    trials = tuple(replace(TRIAL, number=number) for number in (1, 2, 3))
    writer = new_writer(tmp_path / "cut", plan=replace(PLAN, blocks=(replace(PLAN.blocks[0], trials=trials),)))
    writer.event("take_started", 1, {"take": 1})
    writer.event("scored", 1, {"score": 50.0})
    writer.event("take_kept", 1, {"take": 1})
    writer.event("skip", 2)
    writer.close()
    (session,) = unfinished_sessions(tmp_path)
    assert session.description.endswith(": trials done 1 of 3")


def test_sessions_of_one_subject_that_were_cut_short_are_told_apart_by_when_they_began(tmp_path, monkeypatch):
    class Clock(datetime):
        @classmethod
        def now(cls, tz=None):
            return cls(2026, 11, 26, hour, 51, 33, tzinfo=tz)

    monkeypatch.setenv("TZ", "Asia/Tokyo")  # nine hours ahead of UTC, all year
    time.tzset()
    monkeypatch.setattr("sessions.recording.head.datetime", Clock)
    for hour in (8, 11):
        new_writer(tmp_path / f"at-{hour}", plan=PLAN).close()
    words = {one.folder.name: one.description[: len("S01, 2026-11-26 17:51")] for one in unfinished_sessions(tmp_path)}
    assert words == {"at-8": "S01, 2026-11-26 17:51", "at-11": "S01, 2026-11-26 20:51"}
    monkeypatch.undo()
    time.tzset()
