"""Cells of the exported tables: what an analysis and a prediction hold stands in them, with its unit and its reason."""

import json

import pytest
from exported_sessions import source_of

from sessions.exchange import ExportSource, export
from sessions.exchange.csv_text import ImportRefused
from sessions.exchange.exported import read_export
from sessions.exchange.session_tables import tables


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    """Return a recording without trials, and its analysis."""
    return source_of("foreign", tmp_path_factory.mktemp("session") / "P01")


def column(source, table, name):
    columns = next(each.columns for each in tables(source) if each.name == table)
    return next(each for each in columns if each.name == name)


def test_why_numbers_of_a_stroke_are_missing_stands_in_one_cell(source):
    strokes = [{"trial": 1, "reasons": {"speed": "coarse", "tau_max": "lost_readings"}}, {"trial": 2, "reasons": {}}]
    analysis = {**source.analysis, "strokes": strokes}
    reasons = column(ExportSource(source.recording, analysis, None), "strokes", "reasons")
    assert reasons.values == ("speed: coarse; tau_max: lost_readings", None)


def test_an_interval_of_the_sed_is_two_cells_or_the_reason_why_there_is_none(source):
    interval = {"low": 0.008, "high": 0.01, "method": "derivatives", "reason": ""}
    refusal = {"low": None, "high": None, "method": "", "reason": "no stroke"}
    rows = [
        {"trial": 1, "sed": 0.009, "interval": interval, "opposite_sed": 0.006, "opposite_interval": refusal},
        {"trial": 2, "sed": None, "interval": refusal, "opposite_sed": 0.007, "opposite_interval": interval},
        {"trial": 3, "sed": 0.009, "interval": interval, "opposite_sed": 0.006, "opposite_interval": interval},
    ]
    with_prediction = ExportSource(source.recording, source.analysis, {"trials": rows})
    for name, missing in (("sed", 1), ("opposite_sed", 0)):
        expected = [0.008, 0.008, 0.008], [0.01, 0.01, 0.01], ["derivatives"] * 3
        for values, none, suffix in zip(expected, (None, None, "no stroke"), ("low", "high", "by"), strict=True):
            values[missing] = none
            cells = column(with_prediction, "predictions", f"{name}_interval_{suffix}")
            assert cells.values == tuple(values)
            assert cells.unit == ("" if suffix == "by" else "MPa")


def test_the_time_of_a_solve_has_its_unit_once(source):
    with_prediction = ExportSource(source.recording, source.analysis, {"trials": [{"trial": 1, "wall_s": 0.05}]})
    cells = column(with_prediction, "predictions", "wall_s")
    assert (cells.unit, cells.heading, cells.values) == ("s", "wall_s", (0.05,))


@pytest.mark.parametrize("later", [{"version": 99}, {"name": "of another program"}])
def test_an_export_of_another_format_or_a_later_version_is_refused(source, tmp_path, later):
    folder = export(source, "csv", tmp_path / "out")
    description = json.loads((folder / "session.json").read_text())
    description["format"].update(later)
    (folder / "session.json").write_text(json.dumps(description))
    with pytest.raises(ImportRefused, match=r"it holds .*; this program reads 'daq-app session' up to version \d"):
        read_export(folder)
