"""Times in the exports for other programs: seconds since the first event, by which they lay readings on trials."""

import csv
import json

import pytest
from recordings import new_writer, readings

from sessions.exchange import ExportSource, export
from sessions.recording import Recording
from sessions.strokes import analyse


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    """One trial from 2 to 5 s of the session clock, whose readings at 200 Hz begin to arrive at 2.5 s."""
    writer = new_writer(tmp_path_factory.mktemp("timed") / "s")
    writer.event("take_started", 1, {"take": 1}, time_ns=2_000_000_000)
    writer.readings(readings(7, 100, received_ns=2_500_000_000))
    writer.event("scored", 1, {"score": 42.5, "positions": [[3.25, 40.0], [3.5, 42.5]]}, time_ns=4_000_000_000)
    writer.event("take_kept", 1, {"take": 1}, time_ns=5_000_000_000)
    writer.close()
    recording = Recording.open(writer.folder)
    return ExportSource(recording, {"made_by": {}, **analyse(recording).to_dict()}, None)


def test_nwb_lays_readings_events_and_trials_on_one_clock(source, tmp_path):
    pynwb = pytest.importorskip("pynwb")
    with pynwb.NWBHDF5IO(export(source, "nwb", tmp_path / "out") / "session.nwb", "r") as io:
        file = io.read()
        raw, forces, torques = (file.acquisition[name] for name in ("raw", "forces", "torques"))
        for series in (raw, forces, torques):
            assert (series.starting_time, series.rate) == (pytest.approx(0.5), 200.0)
        numbers = raw.data[...]
        assert forces.data[...] == pytest.approx(numbers[:, :3] * 1e-6)  # by the calibration of the stand-in
        assert torques.data[...] == pytest.approx(numbers[:, 3:] * 1e-3)
        assert file.acquisition["events"]["timestamp"][...].tolist() == pytest.approx([0.0, 2.0, 3.0])
        trials = file.trials
        assert (trials["start_time"][0], trials["stop_time"][0]) == (0.0, pytest.approx(3.0))
        assert (trials["number"][0], trials["index"][0], trials["score"][0]) == (1, 20, 42.5)


def test_bids_lays_readings_and_events_on_one_clock(source, tmp_path):
    folder = export(source, "bids", tmp_path / "out") / "sub-S01" / "beh"
    (physio,) = folder.glob("*_physio.json")
    sidecar = json.loads(physio.read_text())
    assert (sidecar["StartTime"], sidecar["SamplingFrequency"]) == (pytest.approx(0.5), 200.0)
    (events,) = folder.glob("*_events.tsv")
    with events.open(newline="") as file:
        rows = list(csv.DictReader(file, delimiter="\t"))
    assert [float(row["onset"]) for row in rows] == pytest.approx([0.0, 2.0, 3.0])
    assert {row["duration"] for row in rows} == {"n/a"}
    assert [row["trial_type"] for row in rows] == ["take_started", "scored", "take_kept"]
    assert [row["readings"] for row in rows] == ["0", "100", "100"]


def test_every_position_of_the_mark_stands_in_the_tables_with_its_instant(source, tmp_path):
    with (export(source, "csv", tmp_path / "out") / "positions.csv").open(newline="") as file:
        header, *rows = csv.reader(file)
    assert [name for name in header if name != "SIMULATED"] == ["trial", "instant_s", "position"]
    assert [[float(cell) for cell in row[-3:]] for row in rows] == [[1.0, 3.25, 40.0], [1.0, 3.5, 42.5]]
