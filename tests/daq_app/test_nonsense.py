"""Documents that are valid JSON and hold nonsense: named in one sentence with what makes them anew, or used."""

import copy
import json
import shutil

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from report_session import record
from study_example import study

from daq_app.batch.derived import ANALYSIS, PREDICTION, stored_document
from daq_app.cli.main import run
from sessions.exchange import ExportSource
from sessions.exchange.session_tables import tables
from sessions.prediction.sealed_predictions import SEAL, digest, sealed_sentence
from sessions.recording import Recording, RecordingError
from sessions.recording.derived import reveal
from sessions.statistics.findings import check_ground_truth, effect_recoveries, flaw_detections, friction_recovery

VERB = {ANALYSIS: "'daq-app analyse' computes it again", PREDICTION: "'daq-app predict' computes it again"}
NONSENSE = st.sampled_from([None, "x", "", -7, 0.5, True, [], {}, [None], {"a": 1}, [[1, 2, 3]], "delete"])


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """A session of two trials, analysed and predicted with all that can be asked for."""
    folder, _ = record(tmp_path_factory.mktemp("nonsense") / "P01", per_block=1)
    assert run(["analyse", str(folder)]) == 0
    assert run(["predict", str(folder), "--intervals", "--afferent"]) == 0
    return folder


@pytest.fixture(scope="module")
def documents(session):
    return {name: json.loads((session / name).read_text()) for name in (ANALYSIS, PREDICTION)}


def spoil(data, document):
    """Return a document with nonsense at one place of it, of those that are no long column of numbers."""
    spoilt_copy = copy.deepcopy(document)
    inside = spoilt_copy
    while True:
        names = list(inside) if isinstance(inside, dict) else list(range(min(len(inside), 3)))
        name = data.draw(st.sampled_from(names))
        deeper = inside[name]
        if not isinstance(deeper, dict | list) or not deeper or data.draw(st.integers(0, 3)) == 0:
            break
        inside = deeper
    nonsense = data.draw(NONSENSE)
    if nonsense == "delete":
        del inside[name]
    else:
        inside[name] = nonsense
    return spoilt_copy


@pytest.mark.parametrize("name", [ANALYSIS, PREDICTION])
@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_a_stored_document_with_nonsense_is_named_with_its_verb_or_makes_every_table(
    session, documents, tmp_path_factory, name, data
):
    room = tmp_path_factory.mktemp("room")
    (room / name).write_text(json.dumps(spoil(data, documents[name])))
    try:
        document = stored_document(room, name)
    except RecordingError as damaged:
        sentence = str(damaged)
        document = None
    if document is None:
        assert f"{name} is damaged" in sentence
        assert VERB[name] in sentence
        return
    source = {ANALYSIS: documents[ANALYSIS], PREDICTION: documents[PREDICTION], name: document}
    for table in tables(ExportSource(reveal(Recording.open(session)), source[ANALYSIS], source[PREDICTION])):
        assert all(isinstance(cell, str | int | float | None) for column in table.columns for cell in column.values)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        (ANALYSIS, '{"strokes": [null], "friction": [], "flaws": []}'),
        (ANALYSIS, "[" * 5000),
        (PREDICTION, '{"trials": [{"trial": "first"}]}'),
        (PREDICTION, '{"trials": [], "width": NaN}'),
    ],
)
@pytest.mark.parametrize("form", ["csv", "nwb"])
def test_an_export_of_nonsense_ends_in_one_sentence(session, tmp_path, capsys, name, content, form):
    folder = shutil.copytree(session, tmp_path / "P01")
    (folder / name).write_text(content)
    assert run(["export", str(folder), "--format", form, "--out", str(tmp_path / "out")]) == 1
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert f"{name} is damaged" in lines[0]
    assert VERB[name] in lines[0]


@pytest.mark.parametrize("name", [ANALYSIS, PREDICTION])
def test_a_document_comes_back_as_it_was_stored_but_for_the_former_names_of_options(session, documents, name):
    expected = copy.deepcopy(documents[name])
    for part in ("options", "options_origin") if name == PREDICTION else ():
        del expected[part]["beside"], expected[part]["beside_intervals"]
    assert stored_document(session, name) == expected


@pytest.mark.parametrize(
    ("name", "path"),
    [
        (ANALYSIS, ("bootstrap", "settings", "confidence")),
        (ANALYSIS, ("strokes", 0, "mu_max")),
        (ANALYSIS, ("strokes", 0, "kept")),
        (PREDICTION, ("trials", 0, "solver")),
    ],
)
def test_a_document_that_lacks_a_number_is_damaged_and_the_sentence_names_it(documents, tmp_path, name, path):
    document = copy.deepcopy(documents[name])
    *inside, last = path
    holder = document
    for part in inside:
        holder = holder[part]
    del holder[last]
    (tmp_path / name).write_text(json.dumps(document))
    with pytest.raises(RecordingError, match=f"{name} is damaged .*{last}.*{VERB[name]}"):
        stored_document(tmp_path, name)


@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_a_seal_with_nonsense_proves_nothing_and_stands_in_nobodys_way(session, data):
    numbers = [{"trial": 1, "mu": 0.3, "tau_max": 0.01, "indentation": 2.0, "direction": 1, "sed": 0.008}]
    seal = {"sealed_utc": "2026-01-01", "blinded": False, "sha256": digest(numbers), "numbers": numbers}
    (session / SEAL).write_text(json.dumps(spoil(data, seal)))
    try:
        assert sealed_sentence(Recording.open(session), numbers).endswith(".")
    finally:
        (session / SEAL).unlink()


TRUTH = {
    "score": {"gain": 0.8, "drift": 0.4, "carry_over": 0.0, "friction": {"stickiness": 52.0}},
    "people": {"gain_spread": 0.05, "offset_spread": 3.0, "judgement_noise": 4.0, "moisture": 0.08},
    "calibration_sd": 0.01,
    "relation": {"stickiness": {"r": 0.9, "slope": 6.0}},
    "spoilt": {"S02": {"lost": 3, "expected": "trial 3: lost_readings"}, "S03": {"unanswered": 9, "expected": "none"}},
    "strokes": [{"subject": "S01", "trial": 1, "mu": 0.44}],
}


@pytest.fixture(scope="module")
def pooled_study():
    return study()


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_a_ground_truth_is_refused_as_a_whole_or_held_against_the_estimates(pooled_study, data):
    truth = spoil(data, TRUTH)
    try:
        valid = check_ground_truth(truth)
    except ValueError:
        return
    effect_recoveries(pooled_study.descriptors, valid)
    friction_recovery(pooled_study.visits, valid["strokes"])
    assert len(flaw_detections(pooled_study.visits, {}, valid.get("spoilt", {}))) == len(valid.get("spoilt", {}))
