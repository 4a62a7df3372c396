"""One contract for every export in the list: whole, marked where simulated, the same session when imported again."""

import builtins
import csv
import gzip
import importlib
import json
import shutil
import subprocess
import sys
import tracemalloc
from dataclasses import asdict, replace
from datetime import datetime
from pathlib import Path

import h5py
import numpy as np
import pytest
from exported_sessions import MAKERS, Exports, source_of
from recordings import read_plainly, with_a_long_answer

from drivers.readings import ReadingBlock
from sessions.exchange import FORMATS, ExportError, ExportSource, export
from sessions.exchange.exported import import_session, read_export, side_files
from sessions.exchange.import_csv import ImportRefused
from sessions.exchange.session_tables import tables
from sessions.recording import Recording, RecordingError
from sessions.recording.archive import problems, seal
from sessions.recording.derived import gain_error_set
from sessions.recording.manifest import content_sha256, file_sha256
from sessions.recording.schema import LIVE_FILE
from sessions.strokes import analyse

READABLE = [name for name, module in FORMATS.items() if hasattr(importlib.import_module(module), "read")]


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    room = tmp_path_factory.mktemp("sessions")
    return {name: source_of(name, room / name) for name in MAKERS}


@pytest.fixture(scope="module")
def exports(sources, tmp_path_factory):
    return Exports(sources, tmp_path_factory.mktemp("exports"))


def files(folder):
    return sorted(path for path in folder.rglob("*") if path.is_file())


@pytest.mark.parametrize("form", FORMATS)
def test_every_file_of_a_simulated_session_says_so(exports, form):
    for path in files(exports[form, "whole"]):
        content = path.read_bytes()
        if form == "bids" and path.suffix == ".tsv":
            header, *rows = content.decode().splitlines()
            assert header.split("\t")[-1] == "simulated"
            assert all(row.split("\t")[-1] == "1" for row in rows)
        elif form == "bids" and path.suffix == ".gz":
            assert all(row.split("\t")[-1] == "1" for row in gzip.decompress(content).decode().splitlines())
        else:
            assert b"SIMULATED" in content, path
    assert files(exports[form, "whole"])


@pytest.mark.parametrize("form", FORMATS)
def test_no_file_of_a_real_session_says_that_it_was_simulated(exports, form):
    for path in files(exports[form, "torn"]):
        content = gzip.decompress(path.read_bytes()) if path.suffix == ".gz" else path.read_bytes()
        assert b"SIMULATED" not in content
        assert b"simulated\t" not in content


@pytest.mark.parametrize("form", READABLE)
@pytest.mark.parametrize("name", ["whole", "scores_only"])
def test_an_import_has_the_content_of_its_session_in_another_file(sources, exports, tmp_path, form, name):
    original = sources[name].recording
    import_session(read_export(exports[form, name]), tmp_path / "s")
    copy = Recording.open(tmp_path / "s")
    assert content_sha256(copy) == content_sha256(original)
    assert file_sha256(copy.folder / LIVE_FILE) != file_sha256(original.folder / LIVE_FILE)


@pytest.mark.parametrize("form", READABLE)
@pytest.mark.parametrize("name", MAKERS)
def test_an_exported_session_comes_back_whole(sources, exports, tmp_path, form, name):
    original = sources[name].recording
    result = import_session(read_export(exports[form, name]), tmp_path / "s")
    copy = Recording.open(tmp_path / "s")
    for column in ("sequence", "counter", "status", "time", "received_ns", "raw"):
        assert getattr(copy.readings(), column).tobytes() == getattr(original.readings(), column).tobytes()
    events = [event for event in copy.events if event.kind != "not_restored"]
    assert [(e.time_ns, e.kind, e.trial, e.data) for e in events] == [
        (e.time_ns, e.kind, e.trial, e.data) for e in original.events
    ]
    assert copy.plan == original.plan
    assert copy.trials == original.trials
    assert copy.simulated_sentence == original.simulated_sentence
    assert copy.flaws == original.flaws
    assert {k: v for k, v in copy.provenance.items() if k != "restored_from"} == original.provenance
    if original.info is not None:
        np.testing.assert_equal(asdict(copy.info), asdict(original.info))  # an unknown number is nan in both
    assert set(original.losses) <= set(copy.losses)
    assert result.readings == len(original.readings())
    assert side_files(copy.folder) == side_files(original.folder)
    assert gain_error_set(copy.folder) == gain_error_set(original.folder)
    assert [analyse(copy).to_dict()[part] for part in ("strokes", "friction")] == [
        analyse(original).to_dict()[part] for part in ("strokes", "friction")
    ]


@pytest.mark.parametrize("form", READABLE)
def test_what_was_lost_before_an_export_is_named_after_it_comes_back(exports, tmp_path, form):
    result = import_session(read_export(exports[form, "torn"]), tmp_path / "s")
    assert result.differences == (
        "block 4 of the readings is damaged and left out (its bytes do not give the CRC-32 stored with them)",
    )
    assert result.differences[0] in Recording.open(tmp_path / "s").losses
    seal(tmp_path / "s")
    assert result.differences[0] in problems(tmp_path / "s")


@pytest.mark.parametrize("name", ["whole", "torn"])
def test_the_csv_holds_every_number_of_the_live_file_to_the_last_bit(sources, exports, name):
    readings = read_plainly(sources[name].recording.folder)
    lines = (exports["csv", name] / "readings.csv").read_text().splitlines()
    first = 1 if name == "whole" else 0  # after the column that says SIMULATED
    rows = [line.split(",")[first:] for line in lines]
    assert rows[0][:6] == ["sequence", "counter", "status", "time_s", "received_ns", "raw_1_counts"]
    assert rows[0][11:] == ["Fx_N", "Fy_N", "Fz_N", "Tx_Nmm", "Ty_Nmm", "Tz_Nmm"]
    intact = readings if name == "whole" else readings[:300]  # the damaged block is left out
    assert len(rows) - 1 == len(intact)
    for row, reading in zip(rows[1:], intact, strict=True):
        cells = (*map(int, row[:3]), float(row[3]), int(row[4]), *map(float, row[5:11]))
        assert repr(cells) == repr(reading)  # as text NaN is equal to itself
    # 1e-6 N and 1e-3 N mm a count: the calibration of the stand-in.
    wrench = [float(number) for number in rows[1][11:]]
    assert wrench == pytest.approx([r * s for r, s in zip(intact[0][5:], [1e-6] * 3 + [1e-3] * 3, strict=True)])


@pytest.mark.parametrize("form", [pytest.param(form, marks=[pytest.mark.slow] * (form != "csv")) for form in FORMATS])
def test_one_long_answer_takes_room_and_memory_once_in_every_export(exports, tmp_path, form):
    assert exports[form, "whole"].exists()  # so that its libraries are loaded
    recording = Recording.open(with_a_long_answer(tmp_path / "s", 12_000, 100))
    source = ExportSource(recording, {"made_by": {}, **analyse(recording).to_dict()}, None)
    tracemalloc.start()
    folder = export(source, form, tmp_path / "out")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    file_size = (tmp_path / "s" / "session.sqlite").stat().st_size  # [bytes]
    assert sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()) < 6 * file_size
    assert peak < 60 * file_size  # as Python holds it, more than once; padding takes it 120 times or more


@pytest.mark.parametrize("form", READABLE)
def test_a_number_changed_after_the_export_is_named_when_it_is_imported(exports, tmp_path, form):
    folder = shutil.copytree(exports[form, "whole"], tmp_path / "export")
    if form == "csv":
        path = folder / "readings.csv"
        lines = path.read_text().splitlines(keepends=True)
        cells = lines[500].split(",")
        lines[500] = ",".join([*cells[:7], repr(float(cells[7]) + 1.0), *cells[8:]])
        path.write_text("".join(lines))
        difference = "since it was exported: raw of the readings is not what it was"
    elif form == "bids":
        (path,) = folder.glob("sub-*/beh/*_events.tsv")
        path.write_text(path.read_text().replace('"score":', '"score":1', 1))
        difference = "since it was exported: the event log is not what it was"
    else:
        with h5py.File(folder / "session.h5", "r") as file:
            chunk = file["readings/raw"].id.get_chunk_info(0)
        content = bytearray((folder / "session.h5").read_bytes())
        content[chunk.byte_offset + 100] ^= 1
        (folder / "session.h5").write_bytes(content)
        with pytest.raises(ImportRefused, match=r"session.h5 is damaged .*export the session anew"):
            import_session(read_export(folder), tmp_path / "s")
        assert not (tmp_path / "s").exists()
        return
    result = import_session(read_export(folder), tmp_path / "s")
    assert result.differences == (difference,)
    assert difference in Recording.open(tmp_path / "s").losses


@pytest.mark.parametrize("form", ["csv", "bids"])
def test_a_row_taken_out_of_an_export_is_named(exports, tmp_path, form):
    folder = shutil.copytree(exports[form, "foreign"], tmp_path / "export")
    (path,) = folder.glob("readings.csv" if form == "csv" else "sub-*/beh/*_physio.tsv.gz")
    text = path.read_text() if form == "csv" else gzip.decompress(path.read_bytes()).decode()
    lines = text.splitlines(keepends=True)
    text = "".join(lines[:200] + lines[201:])
    path.write_bytes(text.encode() if form == "csv" else gzip.compress(text.encode()))
    result = import_session(read_export(folder), tmp_path / "s")
    assert result.differences[0] == "since it was exported: there were 400 readings and there are 399"


@pytest.mark.parametrize("form", READABLE)
def test_an_export_that_is_no_longer_whole_is_refused_and_leaves_nothing(exports, tmp_path, form):
    folder = shutil.copytree(exports[form, "whole"], tmp_path / "export")
    victims = [path for path in files(folder) if path.name.endswith(("readings.csv", "physio.tsv.gz", "session.h5"))]
    content = victims[0].read_bytes()
    in_a_row = content.index(b"\n", len(content) // 2) + 5  # a text cut between two numbers is a shorter text
    victims[0].write_bytes(content[:in_a_row])
    with pytest.raises(ImportRefused, match="export the session anew") as refusal:
        import_session(read_export(folder), tmp_path / "s")
    assert "\n" not in str(refusal.value)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["export"]


def test_a_session_folder_is_not_imported_over_again(sources):
    with pytest.raises(ImportRefused, match="is a session folder already"):
        read_export(sources["whole"].recording.folder)


@pytest.mark.parametrize("form", FORMATS)
def test_nothing_is_written_over(sources, tmp_path, form):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(ExportError, match="not empty"):
        export(sources["whole"], form, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


@pytest.mark.parametrize("form", FORMATS)
def test_an_export_that_was_stopped_leaves_nothing(sources, tmp_path, form):
    def stop(_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        export(sources["whole"], form, tmp_path / "out", stop)
    assert list(tmp_path.iterdir()) == []


def test_every_float_column_has_a_unit_or_is_known_to_have_none(sources):
    bare = {"score", "corrections", "position", "error_estimate"}
    for table in tables(sources["whole"]):
        for column in table.columns:
            if any(isinstance(value, float) for value in column.values) and not column.unit:
                assert column.name in bare or column.name.startswith("mu"), (table.name, column.name)


def test_every_csv_of_a_simulated_session_says_so_in_a_column_and_opens_as_it_is(exports):
    for path in exports["csv", "whole"].glob("*.csv"):
        with path.open(newline="") as file:
            rows = list(csv.reader(file))
        assert rows[0][0] == "SIMULATED"
        assert {row[0] for row in rows[1:]} <= {"yes"}
        assert {len(row) for row in rows} == {len(rows[0])}


def test_the_readme_tells_every_column_of_every_csv(exports):
    folder = exports["csv", "whole"]
    page = (folder / "README.md").read_text()
    for path in folder.glob("*.csv"):
        header = path.read_text().splitlines()[0]
        assert f"## {path.name}" in page
        for name in header.split(","):
            assert f"| `{name}` |" in page


# ---- BIDS


@pytest.mark.parametrize(
    "name", ["whole", "torn", *(pytest.param(name, marks=pytest.mark.slow) for name in ("scores_only", "foreign"))]
)
def test_the_official_validator_finds_no_error_in_a_bids_export(exports, name):
    validator = Path(sys.executable).with_name("bids-validator-deno")
    if not validator.exists():
        pytest.skip("bids-validator-deno is not installed")
    process = subprocess.run(
        [validator, "-r", "--format", "json", "--max-rows", "-1", exports["bids", name]],
        capture_output=True,
        text=True,
        check=False,
        encoding="utf-8",
    )
    document = json.loads(process.stdout)
    issues = [
        *document["issues"]["issues"],
        *(i for d in document.get("derivativesSummary", {}).values() for i in d["issues"]["issues"]),
    ]
    assert [issue for issue in issues if issue["severity"] == "error"] == []
    assert document["summary"]["totalFiles"] > 0
    assert any("daq-app" in name for name in document["derivativesSummary"])
    assert process.returncode == 0


def test_a_reading_that_never_arrived_is_a_row_of_its_own_and_a_silence_begins_a_new_file(exports):
    beh = exports["bids", "torn"] / "sub-S01" / "beh"
    first, second = (
        gzip.decompress((beh / f"sub-S01_task-madeup_recording-{part}_physio.tsv.gz").read_bytes())
        .decode()
        .splitlines()
        for part in (1, 2)
    )
    gap_rows = [row for row in first if row.startswith("n/a")]
    assert len(first) == 210  # 0 to 99, ten that never arrived, 110 to 209
    assert len(gap_rows) == 10
    assert set(gap_rows[0].split("\t")) == {"n/a"}
    assert [int(row.split("\t")[0]) for row in second] == list(range(210, 310))
    starts = [
        json.loads((beh / f"sub-S01_task-madeup_recording-{part}_physio.json").read_text())["StartTime"]
        for part in (1, 2)
    ]
    assert starts == pytest.approx([50e-9, 250e-9])  # received at 100 and 300 ns, the first event at 50


def test_the_derivatives_tell_what_made_them(exports):
    document = json.loads((exports["bids", "whole"] / "derivatives/daq-app/dataset_description.json").read_text())
    assert document["DatasetType"] == "derivative"
    assert document["GeneratedBy"][0]["Name"] == "daq-app"
    assert f"numpy {np.__version__}" in document["GeneratedBy"][0]["Description"]
    folder = exports["bids", "whole"] / "derivatives/daq-app/sub-S01/beh"
    assert (folder / "sub-S01_task-sensotactfriction_desc-friction_beh.tsv").is_file()
    assert (folder / "sub-S01_task-sensotactfriction_desc-predictions_beh.tsv").is_file()


# ---- HDF5


def test_the_hdf5_export_opens_in_hdf5_1_8_and_holds_the_strokes_with_units(sources, exports):
    path = exports["hdf5", "whole"] / "session.h5"
    assert path.read_bytes()[8] == 2  # superblock version; 1.8 reads up to 2
    strokes = sources["whole"].analysis["strokes"]
    with h5py.File(path) as file:
        assert file["strokes/mu_dynamic"][...].tolist() == [stroke["mu_dynamic"] for stroke in strokes]
        assert file["strokes/tau_max"].attrs["unit"] == b"MPa"
        assert json.loads(file["derived/analysis"][0]) == json.loads(json.dumps(sources["whole"].analysis))


# ---- NWB


def test_nwb_holds_what_was_recorded(sources, exports):
    pynwb = pytest.importorskip("pynwb")
    for name in ("whole", "torn"):
        recording = sources[name].recording
        block: ReadingBlock = recording.readings()
        with pynwb.NWBHDF5IO(exports["nwb", name] / "session.nwb", "r") as io:
            file = io.read()
            assert file.acquisition["raw"].data[...].tobytes() == block.raw.tobytes()
            assert file.acquisition["received_ns"].data[...].tolist() == block.received_ns.tolist()
            assert file.acquisition["raw"].timestamps is not None  # readings are missing in both: there is no one rate
            assert file.acquisition["forces"].data[5, 0] == pytest.approx(block.raw[5, 0] * 1e-6)
            assert file.acquisition["events"]["kind"][...].tolist() == [event.kind for event in recording.events]
            if name == "whole":
                assert file.trials["score"][...].tolist() == [trial.score for trial in recording.trials]
            assert json.loads(file.notes)["plan"]["subject"] == "S01"


def test_nwb_tells_the_error_of_calibration_that_the_intervals_hold(sources, tmp_path):
    pynwb = pytest.importorskip("pynwb")
    bootstrap_settings = {"gain_error": 0.003, "gain_error_origin": "set"}
    source = sources["whole"]
    analysis = {**source.analysis, "bootstrap": {"settings": bootstrap_settings, "strokes": []}}
    export(replace(source, analysis=analysis), "nwb", tmp_path / "out")
    with pynwb.NWBHDF5IO(tmp_path / "out" / "session.nwb", "r") as io:
        assert json.loads(io.read().notes)["calibration_error"] == bootstrap_settings


def test_a_session_in_told_time_that_moves_when_waited_on_opens_as_nwb(sources, tmp_path):
    pynwb = pytest.importorskip("pynwb")
    recording = sources["whole"].recording
    provenance = {**recording.provenance, "clock": {**recording.provenance["clock"], "factor": 0.0}}
    source = replace(sources["whole"], recording=replace(recording, provenance=provenance))
    export(source, "nwb", tmp_path / "out")
    with pynwb.NWBHDF5IO(tmp_path / "out" / "session.nwb", "r") as io:
        begun_s = (recording.events[0].time_ns - provenance["clock"]["now_ns"]) * 1e-9
        elapsed = io.read().session_start_time - datetime.fromisoformat(provenance["created_utc"])
        assert elapsed.total_seconds() == pytest.approx(begun_s, abs=1e-5)


@pytest.mark.parametrize("name", ["whole", pytest.param("scores_only", marks=pytest.mark.slow)])
def test_the_nwb_inspector_finds_no_violation(exports, name):
    inspector = pytest.importorskip("nwbinspector")
    messages = list(inspector.inspect_nwbfile(nwbfile_path=exports["nwb", name] / "session.nwb"))
    violations = [message for message in messages if message.importance.name != "BEST_PRACTICE_SUGGESTION"]
    assert violations == []


def test_without_pynwb_one_sentence_says_what_to_install(sources, tmp_path, monkeypatch):
    load = builtins.__import__

    def refuse(name, *rest, **more):
        if name.startswith("pynwb"):
            raise ImportError(name)
        return load(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", refuse)
    with pytest.raises(ExportError, match=r"pip install daq-app\[nwb\]"):
        export(sources["whole"], "nwb", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_full_folder_for_an_import_is_refused(exports, tmp_path):
    (tmp_path / "mine").write_text("")
    with pytest.raises(RecordingError, match="not empty"):
        import_session(read_export(exports["csv", "whole"]), tmp_path)
