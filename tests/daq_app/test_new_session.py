from dataclasses import replace
from datetime import datetime

import pytest

from daq_app.new_session import Bench, Refused, SessionForm, checked
from daq_app.recorder.messages import People, StartSession
from sessions.plan import Frame

NOW = datetime(2026, 3, 1, 14, 30, 5)
SIMULATED = Bench(connected=True, simulated=True, frame=Frame("-z", "set", 20.0, "set"))
REAL = Bench(connected=True)
FORM = SessionForm(subject="P07", folder="kept")


def test_a_form_that_is_right_begins_a_session_in_a_folder_of_its_own():
    made = checked(replace(FORM, study="pilot", seed="7"), SIMULATED, NOW, 99)
    assert isinstance(made, StartSession)
    assert made.folder == "kept/pilot/P07_sensotact-friction_20260301T143005"
    assert made.plan.subject == "P07"
    assert made.plan.seed == 7
    assert made.plan.frame == SIMULATED.frame
    assert {s.name: (s.value, s.origin) for s in made.settings} == {"seed": (7, "set"), "study": ("pilot", "set")}


def test_an_empty_seed_is_a_new_one_and_is_marked_as_nobodys_choice():
    made = checked(FORM, REAL, NOW, 99)
    assert made.plan.seed == 99
    assert made.settings[0].origin == "default"


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
    assert checked(replace(form, seed="3"), bench, NOW, 0).people == People(kind, 3)


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
        (FORM, Bench(), "forces", "No transducer is connected"),
        (replace(FORM, simulated=True), REAL, "simulated", "Only the simulated bench"),
    ],
)
def test_what_is_wrong_is_said_beside_its_field(form, bench, field, words):
    made = checked(form, bench, NOW, 0)
    assert isinstance(made, Refused)
    assert list(made.sentences) == [field]
    assert words in made.sentences[field]
    assert made.sentences[field].endswith(".")


def test_a_folder_that_is_a_file_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    made = checked(replace(FORM, folder=str(tmp_path / "file")), REAL, NOW, 0)
    assert "is a file" in made.sentences["folder"]


def test_a_height_that_was_measured_is_recorded_as_measured_and_one_that_nobody_stated_as_a_default():
    assert checked(replace(FORM, height="12,5"), REAL, NOW, 0).plan.frame == Frame("-z", "default", 12.5, "measured")
    assert checked(FORM, REAL, NOW, 0).plan.frame.height_origin == "default"
