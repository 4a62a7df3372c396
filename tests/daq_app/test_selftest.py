import json
from types import SimpleNamespace

import pytest
from recordings import record_session

from daq_app.cli.main import run
from daq_app.cli.verbs import selftest
from sessions.recording import LoggedEvent, Recording
from sessions.recording.head import certificate_for, write_certificate
from sessions.run.runner import Status

kill = selftest.Recorder.kill


def test_the_selftest_kills_cuts_fills_stops_and_later_sessions_carry_its_certificate(tmp_path, capsys, monkeypatch):
    for name, value in {"KILLS": 2, "STOPS": 1, "CUTS": 4, "RUNNING": (0.1, 0.4)}.items():
        monkeypatch.setattr(selftest, name, value)
    assert run(["selftest", "--out", str(tmp_path), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["passed"]
    assert "was killed 2 times, the end of its log was cut off 4 times" in document["sentence"]
    assert document["quota"]["readings"] > 4 * 2**20 / 88 * 0.9  # as many as the room holds, by 88 bytes each
    assert [path.name for path in tmp_path.iterdir()] == ["daq-app-selftest.json"]
    folder = tmp_path / "P08"
    words = ["run", "sensotact-friction", "--scores-only", "--subject", "P08", "--simulate-subject", "1"]
    assert run([*words, "--pace", "20", "--out", str(folder)]) == 0
    certificate = Recording.open(folder).provenance["selftest"]
    assert certificate["same_program"]
    assert certificate["sentence"] == document["sentence"]


def test_a_selftest_that_is_stopped_leaves_nothing_however_long_its_recorder_has_run(tmp_path, monkeypatch):
    def press_ctrl_c(witness, _):
        witness.until(Status)
        raise KeyboardInterrupt

    monkeypatch.setattr(selftest._WatchedRecorder, "hear", press_ctrl_c)
    kills = []
    monkeypatch.setattr(selftest.Recorder, "kill", lambda recorder: kills.append(recorder) or kill(recorder))
    assert run(["selftest", "--out", str(tmp_path)]) == 130
    assert [recorder._process.wait(0) for recorder in kills] == [-9]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("what", ["readings", "event", "trial"])
def test_the_selftest_fails_where_anything_acknowledged_is_missing(tmp_path, what):
    recording = Recording.open(record_session(tmp_path / "s"))
    events = list(recording.events)
    witness = SimpleNamespace(events=events, safe=300)
    selftest._check_recording(recording, witness, 1)
    if what == "readings":
        witness.safe = 301
    if what == "event":
        witness.events = [*events, LoggedEvent(len(events) + 1, 0, "scored", 1, 300, {"score": 1.0})]
    with pytest.raises(selftest.SelfTestFailed):
        selftest._check_recording(recording, witness, 2 if what == "trial" else 1)


def test_a_certificate_of_other_versions_says_so_and_a_damaged_one_counts_for_nothing(tmp_path):
    folder = tmp_path / "lab" / "P07"
    assert certificate_for(folder) is None
    certificate = {"format": {"name": "daq-app selftest", "version": 1}, "software": {"daq-app": "0.0.1"}}
    path = write_certificate(tmp_path, certificate)
    assert certificate_for(folder) == {**certificate, "same_program": False}
    path.write_text("{")
    assert certificate_for(folder) is None
