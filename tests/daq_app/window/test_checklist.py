"""The checklist before a session: every card says at once, in one sentence, what Start would refuse."""

from dataclasses import replace
from pathlib import Path

import pytest

from daq_app.window.checklist import checklist, codes_in, headline, next_code
from daq_app.window.new_session import Bench, SessionForm
from sessions.plan.plan import Frame
from sessions.plan.protocols.planning import Body
from sessions.plan.protocols.protocol import protocol_file
from sessions.plan.study import create_study, enrol
from sessions.recording import storage

REAL = Bench(connected=True, frame=Frame("-z", "set", 20.0, "set"), rate=1000.0)


@pytest.fixture
def form(tmp_path):
    return SessionForm(subject="P07", folder=str(tmp_path))


def card(form, name, bench=REAL):
    return next(card for card in checklist(form, bench, "measured") if card.name == name)


def test_a_form_that_is_right_has_no_card_open_and_its_sentence_names_the_subject(form):
    cards = checklist(form, REAL, "measured")
    assert all(card.ready for card in cards)
    assert headline(cards, form.subject) == "Press Enter to start the session of P07."


def test_a_subject_that_is_not_enrolled_is_named_before_start_and_no_more_once_it_is(form, tmp_path):
    create_study(tmp_path / "pilot", protocol_file("sensotact-friction").read_text(encoding="utf-8"), 11, blinded=False)
    inside = replace(form, study="pilot")
    assert not card(inside, "Subject").ready
    assert "P07 is not enrolled" in card(inside, "Subject").text
    enrol(tmp_path / "pilot", "P07", Body())
    assert card(inside, "Subject").ready


def test_a_study_that_is_not_in_the_folder_is_named_with_those_that_are(form, tmp_path):
    create_study(tmp_path / "pilot", protocol_file("sensotact-friction").read_text(encoding="utf-8"), 11, blinded=False)
    words = card(replace(form, study="pilto"), "Study and protocol").text
    assert "“pilto” is no study" in words
    assert "pilot" in words.removeprefix("“pilto”")


def test_a_study_that_is_damaged_keeps_start_from_lighting(form, tmp_path):
    create_study(tmp_path / "pilot", protocol_file("sensotact-friction").read_text(encoding="utf-8"), 11, blinded=False)
    (tmp_path / "pilot" / "study.sqlite").write_bytes(b"not a database")
    study_card = card(replace(form, study="pilot"), "Study and protocol")
    assert not study_card.ready
    assert "cannot be read" in study_card.text


def test_a_broken_protocol_is_named_with_its_file_before_start(form, tmp_path):
    (tmp_path / "own.toml").write_text("name = [")
    protocol_card = card(replace(form, protocol=str(tmp_path / "own.toml")), "Study and protocol")
    assert not protocol_card.ready
    assert "own.toml" in protocol_card.text
    assert "\n" not in protocol_card.text


def test_a_disk_without_room_for_the_session_is_reported_before_start(form, monkeypatch, tmp_path):
    monkeypatch.setattr(storage.shutil, "disk_usage", lambda _: type("Usage", (), {"free": 10**6})())
    monkeypatch.chdir(tmp_path)
    full = card(replace(form, folder="recordings"), "Disk")
    assert not full.ready
    assert full.text.startswith(f"{Path('recordings').absolute()} has 1 MB of room")  # as it is spelled on the disk


def test_every_card_that_is_open_says_why_and_the_missing_transducer_comes_first(form):
    cards = checklist(replace(form, subject="", seed="x"), Bench(), "measured")
    assert all(card.text for card in cards if not card.ready)
    assert [card.name for card in cards if not card.ready] == ["Study and protocol", "Subject", "Transducer"]
    assert headline(cards, "") == "Connect a transducer, or choose scores only."


def test_a_code_that_was_used_before_asks_and_the_next_free_one_is_proposed(form, tmp_path):
    for name in ("P07_forces_20260301T143005", "P07_scores_20260302T143005", "P08_sensotact-friction_20260301T150000"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "session.sqlite").write_bytes(b"")
    assert codes_in(tmp_path) == ("P07", "P07", "P08")
    assert next_code(codes_in(tmp_path)) == "P09"
    assert "Sessions of P07 here already: 2." in card(form, "Subject").text
