"""A sealed prediction says when it was sealed and how blind, and is found where it was changed or came too late."""

import json

import pytest
from stand_ins import Hands, ResumableClock

from daq_app.cli.main import run
from sessions.plan.protocols.planning import Body, plan
from sessions.plan.protocols.protocol import FOLDER
from sessions.plan.study import create_study, enrol, open_study, study_key
from sessions.prediction.sealed_predictions import SEAL, digest, seal_prediction, sealed_sentence
from sessions.recording import Recording, RecordingError, SessionWriter, provenance
from sessions.recording.archive import seal
from sessions.recording.derived import store_derived
from sessions.run.runner import run_session
from sessions.run.steps import AskScore, Scored

TEXT = (FOLDER / "sensotact-friction.toml").read_text()
ROW = {"trial": 1, "mu": 0.3, "tau_max": 0.01, "indentation": 2.0, "direction": 1, "sed": 0.0085}
PREDICTION = {"trials": [{**ROW, "wall_s": 0.1}], "options": {}}


@pytest.fixture(params=[True])
def session(request, tmp_path):
    """Return a recorded session of a study, blinded or not."""
    folder = tmp_path / "study"
    create_study(folder, TEXT, 5, blinded=request.param)
    member = enrol(folder, "P01", Body())
    study = open_study(folder)
    place = study.place(member, study_key(folder))
    session_plan = plan(study.protocol, "P01", study.session_seed(member.slot), place=place, forces=False)
    clock = ResumableClock()
    writer = SessionWriter.create(
        folder / "P01", session_plan, None, provenance(clock), subject_simulated=True, clock=clock
    )
    hands = Hands(clock, None, {AskScore: lambda _: [Scored(50.0)]})
    run_session(session_plan, writer, hands, None)
    seal(folder / "P01")
    return folder / "P01"


def sentence_of(session, **changes):
    return sealed_sentence(Recording.open(session), [{**ROW, **changes}])


def test_without_a_seal_the_report_says_so(session):
    assert "had not been sealed" in sentence_of(session)


def test_a_prediction_sealed_while_the_key_was_closed_is_shown_to_be(session):
    sha256 = seal_prediction(Recording.open(session), PREDICTION)
    assert sha256 == digest([ROW])
    assert "while the key of the stimuli was sealed, as it still is; the predictions shown are those" in sentence_of(
        session
    )
    assert run(["unblind", str(session.parent), "--by", "E01"]) == 0
    assert "while the key of the stimuli was sealed; it was opened on" in sentence_of(session)
    assert sha256[:16] in sentence_of(session)


def test_a_seal_made_after_the_key_was_opened_does_not_pass_for_an_earlier_one(session):
    assert run(["unblind", str(session.parent), "--by", "E01"]) == 0
    seal_prediction(Recording.open(session), PREDICTION)
    assert "when nothing hid which score" in sentence_of(session)
    forged = {**json.loads((session / SEAL).read_bytes()), "blinded": True}
    store_derived(session, SEAL, forged)
    assert "the record of unblinding does not hold this seal" in sentence_of(session)


def test_other_numbers_than_the_sealed_ones_are_reported(session):
    seal_prediction(Recording.open(session), PREDICTION)
    assert "shown are those" in sentence_of(session, sed=0.0085 * (1 + 1e-15))
    assert "were made later and differ" in sentence_of(session, sed=0.0086)


def test_a_seal_that_was_changed_is_found_and_none_replaces_another(session):
    seal_prediction(Recording.open(session), PREDICTION)
    with pytest.raises(RecordingError, match="none is sealed over it"):
        seal_prediction(Recording.open(session), PREDICTION)
    document = json.loads((session / SEAL).read_bytes())
    document["numbers"][0]["sed"] = 0.01
    store_derived(session, SEAL, document)
    assert "was changed" in sentence_of(session)


@pytest.mark.parametrize("session", [False], indirect=True)
def test_without_blinding_a_seal_says_that_nothing_hid_the_scores(session):
    seal_prediction(Recording.open(session), PREDICTION)
    assert "when nothing hid which score" in sentence_of(session)


def test_a_damaged_seal_is_reported_and_stops_no_report(session):
    seal_prediction(Recording.open(session), PREDICTION)
    whole = (session / SEAL).read_bytes()
    for damaged in (whole[:-20], whole.replace(b'"numbers"', b'"numberz"')):
        (session / SEAL).write_bytes(damaged)
        assert "is damaged and proves nothing" in sentence_of(session)
