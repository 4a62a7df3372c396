"""Exports of sessions with an infinite reading or without their key, and a packed table without end."""

import gzip
import importlib
import json
import math
from dataclasses import replace

import pytest
from recordings import PLAN, TRIAL, new_writer, readings, record_session
from stand_ins import INFO

from sessions.exchange import FORMATS, ExportSource, export
from sessions.exchange.exported import import_session, read_export
from sessions.file_access import gzip_lines
from sessions.recording import Recording

BARE = {"made_by": {}, "strokes": [], "friction": [], "flaws": []}  # an analysis of nothing


def test_an_infinite_number_which_bids_does_not_know_is_named_when_it_comes_back(tmp_path):
    writer = new_writer(tmp_path / "s")
    block = readings(0, 20)
    raw = block.raw.copy()
    raw[7, 2] = math.inf
    writer.readings(replace(block, raw=raw))
    writer.event("ended", data={"reason": "done"})
    writer.close()
    source = ExportSource(Recording.open(tmp_path / "s"), BARE, None)
    for form, differences in (
        ("csv", ()),
        ("hdf5", ()),
        ("bids", ("since it was exported: raw of the readings is not what it was",)),
    ):
        result = import_session(read_export(export(source, form, tmp_path / form)), tmp_path / f"{form}-again")
        assert result.differences == differences


def test_a_rate_that_the_device_does_not_state_is_that_of_the_readings_in_bids_and_nwb(tmp_path):
    writer = new_writer(tmp_path / "s", info=replace(INFO, rate=math.nan))
    writer.readings(readings(0, 200))
    writer.event("ended", data={"reason": "done"})
    writer.close()
    source = ExportSource(Recording.open(tmp_path / "s"), BARE, None)
    rate = pytest.approx(1.0 / (source.recording.readings().time[1]))
    (sidecar,) = export(source, "bids", tmp_path / "bids").rglob("*_physio.json")
    assert json.loads(sidecar.read_text(encoding="utf-8"))["SamplingFrequency"] == rate
    pynwb = pytest.importorskip("pynwb")
    with pynwb.NWBHDF5IO(str(next(export(source, "nwb", tmp_path / "nwb").rglob("*.nwb"))), "r") as file:
        assert file.read().acquisition["raw"].rate == rate


@pytest.mark.parametrize("form", ["csv", "bids", "hdf5"])
def test_a_remark_with_a_line_separator_in_it_comes_back_as_it_was_typed(tmp_path, form):
    remark = "one\u2028two\x85three\u2029four"  # each ends a line for Python's splitlines, and none ends one in a file
    writer = new_writer(tmp_path / "s")
    writer.event("told", data={"sentence": remark})
    writer.event("ended", data={"reason": "done"})
    writer.close()
    out = export(ExportSource(Recording.open(tmp_path / "s"), BARE, None), form, tmp_path / "out")
    assert import_session(read_export(out), tmp_path / "again").differences == ()
    (event,) = [event for event in Recording.open(tmp_path / "again").events if event.kind == "told"]
    assert event.data == {"sentence": remark}


@pytest.mark.parametrize("form", FORMATS)
def test_a_blinded_session_is_exported_without_the_indices_and_comes_back_blinded(tmp_path, form):
    hidden = replace(TRIAL, stimulus=replace(TRIAL.stimulus, index=None))
    plan = replace(PLAN, blocks=(replace(PLAN.blocks[0], trials=(hidden,)),), key_sha256="0" * 64)
    record_session(tmp_path / "s", plan=plan)
    recording = Recording.open(tmp_path / "s")
    source = ExportSource(recording, BARE, None)
    out = export(source, form, tmp_path / "out")
    if hasattr(importlib.import_module(FORMATS[form]), "read"):
        import_session(read_export(out), tmp_path / "again")
        assert Recording.open(tmp_path / "again").plan == plan


@pytest.mark.parametrize("line", [b"0" * 2**20, b"n/a\n" * 2**18])
def test_a_packed_table_that_unpacks_without_end_is_refused(tmp_path, line):
    path = tmp_path / "x_physio.tsv.gz"
    with gzip.open(path, "wb") as file:
        for _ in range(40):
            file.write(line)
    with pytest.raises(ValueError, match="unpacks to more than readings can"):
        for _ in gzip_lines(path):
            pass
