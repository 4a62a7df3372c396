"""A foreign recording becomes a session: what is kept, what is stated, what is refused and in which words."""

import hashlib
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sessions.exchange.import_csv import (
    ORIGINAL_FILE,
    ColumnsUnknown,
    ImportOptions,
    ImportRefused,
    columns,
    import_csv,
)
from sessions.recording.reader import Recording
from sessions.recording.schema import RecordingError
from sessions.strokes import ZERO_SETTING, ZERO_STATED
from sessions.toml_file import SettingsError

HEADER = "t_s,Fx_N,Fy_N,Fz_N,Tx_Nm,Ty_Nm,Tz_Nm"
BARE = "t,Fx,Fy,Fz,Tx,Ty,Tz"
ROWS = [f"{i / 100:.2f},0.1,{i},-2.5,0.01,0.02,-0.03" for i in range(20)]


def write_file(folder, header=HEADER, rows=ROWS, name="foreign.csv", end="\n"):
    path = folder / name
    path.write_text("\n".join(([header] if header else []) + list(rows)) + end)
    return path


def import_file(tmp_path, options=None, **file):
    path = write_file(tmp_path, **file)
    result = import_csv(path, tmp_path / "session", options)
    return result, Recording.open(tmp_path / "session")


def refusal(tmp_path, kind=ImportRefused, options=None, **file):
    path = write_file(tmp_path, **file)
    with pytest.raises(kind) as caught_error:
        import_csv(path, tmp_path / "session", options)
    sentence = str(caught_error.value)
    assert str(path) in sentence
    assert "\n" not in sentence
    assert not (tmp_path / "session").exists()  # nothing was written
    return sentence


# What is kept


def test_readings_stay_as_the_file_has_them_and_become_newton_millimetres_by_the_matrix(tmp_path):
    result, recording = import_file(tmp_path)
    block = recording.readings()
    assert result.readings == len(block) == 20
    assert block.raw[3].tolist() == [0.1, 3.0, -2.5, 0.01, 0.02, -0.03]
    calibration = recording.info.calibration
    assert calibration.raw_unit == "N, N mm"
    assert calibration.wrench(block.raw[3:4], np.zeros(6))[0].tolist() == pytest.approx([0.1, 3, -2.5, 10, 20, -30])


def test_the_file_itself_is_kept_with_its_hash(tmp_path):
    result, recording = import_file(tmp_path, rows=[row + ",0.5,left" for row in ROWS], header=HEADER + ",x_m,hand")
    original = (tmp_path / "foreign.csv").read_bytes()
    assert (tmp_path / "session" / ORIGINAL_FILE).read_bytes() == original
    source = recording.provenance["imported"]
    assert source["sha256"] == hashlib.sha256(original).hexdigest()
    assert source["extra_columns"] == ["x_m", "hand"]
    assert result.extra == ("x_m", "hand")


def test_a_column_that_axes_read_against_its_heading_is_named(tmp_path):
    header = HEADER.replace("Fy_", "F?_").replace("Fz_", "Fy_").replace("F?_", "Fz_")
    options = ImportOptions(axes=tuple(BARE.split(",")))
    result, recording = import_file(tmp_path, header=header, options=options)
    assert result.renamed == ("Fz_N as Fy", "Fy_N as Fz")
    assert recording.provenance["imported"]["renamed_columns"] == ["Fz_N as Fy", "Fy_N as Fz"]
    (tmp_path / "plain").mkdir()
    result, _ = import_file(tmp_path / "plain", options=options)
    assert result.renamed == ()


def test_times_count_from_the_first_reading_and_the_first_is_remembered(tmp_path):
    _, recording = import_file(tmp_path, rows=[f"{100 + i / 50:.2f},0,0,{i},0,0,0" for i in range(10)])
    assert recording.readings().time.tolist() == pytest.approx([i / 50 for i in range(10)])
    assert recording.provenance["imported"]["first_time_s"] == 100.0


def test_the_rate_is_that_of_the_file_and_says_so(tmp_path):
    result, recording = import_file(tmp_path)
    assert result.rate == pytest.approx(100.0)
    assert recording.provenance["settings"]["rate"]["origin"] == "measured"


@pytest.mark.parametrize(
    ("header", "factor", "sentence"),
    [
        (HEADER.replace("t_s", "t_ms"), 0.5, "taken as ms, hold 200000 readings a second, more than"),
        (HEADER, 500.0, "taken as s, hold 0.2 readings a second, fewer than"),
        (HEADER, 1e-3, None),  # the highest rate of a supported device
        (HEADER.replace("t_s", "t_ms"), 1e5, None),  # and the lowest
    ],
)
def test_a_rate_that_no_supported_device_has_is_taken_and_doubted(tmp_path, header, factor, sentence):
    rows = [f"{factor * i / 100:.12g},0.1,{i},-2.5,0.01,0.02,-0.03" for i in range(20)]
    result, recording = import_file(tmp_path, header=header, rows=rows)
    assert len(recording.readings()) == result.readings == 20
    if sentence is None:
        assert result.doubt is None
    else:
        assert sentence in result.doubt
        assert result.doubt.endswith("if that is wrong, correct their unit in the header and import again")


def test_the_recording_ends_and_has_no_losses(tmp_path):
    _, recording = import_file(tmp_path)
    assert recording.losses == ()
    assert recording.trials == ()
    assert not recording.simulated
    assert [event.kind for event in recording.events] == ["started", "imported", "ended"]


def test_a_file_that_says_it_was_simulated_stays_simulated(tmp_path):
    path = tmp_path / "foreign.csv"
    path.write_text("\n".join(["# SIMULATED: the transducer is simulated", HEADER, *ROWS]))
    import_csv(path, tmp_path / "session")
    assert Recording.open(tmp_path / "session").simulated


# What is default, stated, or unknown


def test_normal_and_height_nobody_stated_are_defaults_marked_as_such(tmp_path):
    result, recording = import_file(tmp_path)
    frame = recording.plan.frame
    assert (frame.normal, frame.normal_origin, frame.height, frame.height_origin) == ("-z", "default", 0.0, "default")
    assert len(result.defaults) == 2


def test_what_was_stated_is_kept_as_stated(tmp_path):
    result, recording = import_file(tmp_path, ImportOptions(normal="+y", height=12.5, zeroed=True))
    frame = recording.plan.frame
    assert (frame.normal, frame.normal_origin, frame.height, frame.height_origin) == ("+y", "set", 12.5, "set")
    assert recording.info.settings[ZERO_SETTING] == ZERO_STATED
    assert result.defaults == ()


def test_units_and_axes_can_be_stated_for_a_file_without_a_header(tmp_path):
    options = ImportOptions(units=("N", "Nmm"), axes=tuple(BARE.split(",")))
    _, recording = import_file(tmp_path, options, header=None)
    assert recording.info.calibration.matrix.tolist() == np.eye(6).tolist()


def test_columns_may_stand_in_any_order(tmp_path):
    options = ImportOptions(units=("mN", "Ncm"), axes=("-", "Tz", "Ty", "Tx", "Fz", "Fy", "Fx"), rate=50.0)
    result, recording = import_file(tmp_path, options, header=None, rows=["9,1,2,3,4,5,6", "9,1.5,2,3,4,5,6"])
    block = recording.readings()
    assert block.raw[0].tolist() == [6, 5, 4, 3, 2, 1]
    assert np.diag(recording.info.calibration.matrix).tolist() == [1e-3] * 3 + [10.0] * 3
    assert block.time.tolist() == [0.0, 0.02]
    assert result.rate == 50.0


def test_a_header_without_units_needs_them_stated(tmp_path):
    assert "--units" in refusal(tmp_path, SettingsError, header=BARE)
    _, recording = import_file(tmp_path, ImportOptions(units=("N", "Nm")), header=BARE, name="again.csv")
    assert recording.info.calibration.matrix[3, 3] == 1000.0


def test_units_that_contradict_the_header_are_refused(tmp_path):
    sentence = refusal(tmp_path, SettingsError, ImportOptions(units=("N", "Nmm")))
    assert "Nm, but --units says Nmm" in sentence


@pytest.mark.parametrize(("heading", "units"), [("Fx_mN", '"N" and "mN"'), ("Fx", '"N" and no unit')])
def test_forces_in_more_than_one_unit_are_refused_by_the_names_of_the_units(tmp_path, heading, units):
    sentence = refusal(tmp_path, SettingsError, header=HEADER.replace("Fx_N", heading))
    assert f"the header has {units} for the forces" in sentence


@pytest.mark.parametrize("unit", ["V", "lbf", "Nm", "counts"])
def test_forces_in_an_unknown_unit_are_refused(tmp_path, unit):
    header = HEADER.replace("_N,", f"_{unit},")
    assert f'"{unit}"' in refusal(tmp_path, SettingsError, header=header)


@pytest.mark.parametrize(
    ("header", "torque"),
    [
        ("time (s),Fx (N),Fy (N),Fz (N),Tx (N·mm),Ty (N·mm),Tz (N·mm)", "Nmm"),
        ("t [s],Fx [N],Fy [N],Fz [N],Mx [N m],My [N m],Mz [N m]", "Nm"),
        ("Time_s,fx_N,fy_N,fz_N,tx_mNm,ty_mNm,tz_mNm", "mNm"),
    ],
)
def test_headers_are_understood_in_the_usual_spellings(header, torque):
    layout = columns(header.split(","), None, None, 7)
    assert layout.axes == (1, 2, 3, 4, 5, 6)
    assert layout.time == 0
    assert layout.units == ("N", torque)


def test_headers_of_other_things_are_no_axes():
    with pytest.raises(ColumnsUnknown, match="no column for Fx"):
        columns(["t_s", "force_x", "torque", "vx_m_s", "x_m", "qi", "temperature"], None, None, 7)


def test_two_columns_for_one_axis_are_refused():
    with pytest.raises(ColumnsUnknown, match="two columns are headed Fx"):
        columns([*HEADER.split(","), "Fx_N"], None, None, 8)


# Rates


def test_a_rate_the_file_does_not_hold_is_refused(tmp_path):
    assert "hold 100 readings a second" in refusal(tmp_path, SettingsError, ImportOptions(rate=200.0))
    header, rows = HEADER.replace("t_s", "t_ms"), [f"{i / 200},0.1,{i},-2.5,0,0,0" for i in range(20)]
    sentence = refusal(tmp_path, SettingsError, ImportOptions(rate=200.0), header=header, rows=rows)
    assert "taken as ms, hold 200000 readings a second" in sentence
    assert "correct their unit in the header" in sentence


def test_a_rate_the_file_does_hold_is_taken(tmp_path):
    result, _ = import_file(tmp_path, ImportOptions(rate=100.0))
    assert result.rate == pytest.approx(100.0)


def test_a_rate_for_uneven_times_is_refused(tmp_path):
    rows = [f"{i / 100 + (0.004 if i % 2 else 0):.4f},0,0,{i},0,0,0" for i in range(40)]
    assert "uneven" in refusal(tmp_path, SettingsError, ImportOptions(rate=100.0), rows=rows)


def test_a_file_without_times_needs_a_rate(tmp_path):
    rows = [row.partition(",")[2] for row in ROWS]
    sentence = refusal(tmp_path, SettingsError, header=HEADER.partition(",")[2], rows=rows)
    assert "--rate" in sentence


@pytest.mark.parametrize(
    "options",
    [
        {"rate": -1.0},
        {"rate": float("nan")},
        {"rate": 1e300},
        {"normal": "z"},
        {"height": float("inf")},
        {"subject": "Ada Lovelace"},
    ],
)
def test_options_that_mean_nothing_are_refused(options):
    with pytest.raises(SettingsError, match="not allowed"):
        ImportOptions(**options)


# Damaged files: one sentence that names file and line


def test_half_a_row_is_refused_with_its_line(tmp_path):
    assert "line 22 has 3 columns and not 7" in refusal(tmp_path, rows=[*ROWS, "0.20,0.1,20"], end="")


def test_a_row_too_long_is_refused_with_its_line(tmp_path):
    assert "line 5 has 8 columns" in refusal(tmp_path, rows=[*ROWS[:3], ROWS[3] + ",1", *ROWS[4:]])


@pytest.mark.parametrize("cell", ["nan", "NaN", "inf", "-inf", "", "1,5x", "abc", "1_000", "--"])
def test_what_is_no_number_is_refused_with_its_line(tmp_path, cell):
    cells = ROWS[6].split(",")
    cells[3] = f'"{cell}"'
    sentence = refusal(tmp_path, rows=[*ROWS[:6], ",".join(cells), *ROWS[7:]])
    assert "line 8" in sentence
    assert "Fz_N" in sentence


def test_no_number_in_a_column_that_is_not_used_is_kept_as_it_is(tmp_path):
    result, _ = import_file(tmp_path, header=HEADER + ",note", rows=[row + ",nan" for row in ROWS])
    assert result.readings == 20


@pytest.mark.parametrize(("second", "word"), [("0.01", "repeats"), ("0.005", "lies before")])
def test_times_that_do_not_rise_are_refused_with_their_line(tmp_path, second, word):
    rows = [*ROWS[:2], second + ROWS[2][4:], *ROWS[3:]]
    sentence = refusal(tmp_path, rows=rows)
    assert "line 4" in sentence
    assert word in sentence


def test_an_empty_row_in_the_middle_is_refused_and_at_the_end_is_not(tmp_path):
    assert "line 7 is empty" in refusal(tmp_path, rows=[*ROWS[:5], "", *ROWS[5:]])
    result, _ = import_file(tmp_path, rows=ROWS, end="\n\n\n", name="again.csv")
    assert result.readings == 20


@pytest.mark.parametrize("content", [b"", b"\n\n", b"\xff\xfe\x00P", b"PK\x03\x04\x00\x00\xff"])
def test_what_is_no_csv_is_refused(tmp_path, content):
    path = tmp_path / "foreign.csv"
    path.write_bytes(content)
    with pytest.raises((ImportRefused, SettingsError), match=r"foreign\.csv"):
        import_csv(path, tmp_path / "session")


def test_a_separator_that_ends_no_line_of_a_file_ends_none_here(tmp_path):
    result, _ = import_file(
        tmp_path, header=f"{HEADER},note", rows=[f"{row},one\u2028two\x0bthree\x85four" for row in ROWS]
    )
    assert result.readings == len(ROWS)


@pytest.mark.parametrize(("header", "rate"), [(HEADER, None), (HEADER.replace("t_s", "n"), 1e-12)])
def test_readings_over_more_years_than_a_session_s_clock_counts_are_refused(tmp_path, header, rate):
    rows = [f"{1e10 * i!r},0,0,-1,0,0,0" for i in range(3)]
    assert "more than a session can" in refusal(tmp_path, options=ImportOptions(rate=rate), header=header, rows=rows)


def test_times_closer_than_any_device_reads_are_refused_with_what_may_be_wrong(tmp_path):
    rows = [f"{1e-9 * i!r},0,0,-1,0,0,0" for i in range(3)]
    assert "1e+09 readings a second, more than any device gives" in refusal(tmp_path, rows=rows)


def test_a_header_alone_is_refused(tmp_path):
    assert "holds fewer than 2 readings" in refusal(tmp_path, rows=[])


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(ImportRefused, match="cannot be read"):
        import_csv(tmp_path / "none.csv", tmp_path / "session")


def test_a_column_that_is_missing_is_named(tmp_path):
    header = "t_s,Fx_N,Fy_N,Tx_Nm,Ty_Nm,Tz_Nm"
    rows = [",".join(row.split(",")[:6]) for row in ROWS]
    assert "no column for Fz" in refusal(tmp_path, SettingsError, header=header, rows=rows)


def test_nothing_is_written_over(tmp_path):
    folder = tmp_path / "session"
    folder.mkdir()
    (folder / "note.txt").write_text("mine")
    with pytest.raises(RecordingError, match="not empty"):
        import_csv(write_file(tmp_path), folder)
    assert [path.name for path in folder.iterdir()] == ["note.txt"]


@settings(deadline=None, max_examples=60)
@given(st.binary(max_size=400))
def test_whatever_bytes_come_they_are_taken_or_refused_in_one_sentence(tmp_path_factory, junk):
    folder = tmp_path_factory.mktemp("junk")
    path = folder / "foreign.csv"
    path.write_bytes(junk)
    with pytest.raises((ImportRefused, SettingsError)) as caught_error:
        import_csv(path, folder / "session")
    assert "\n" not in str(caught_error.value)


@settings(deadline=None, max_examples=25)
@given(st.lists(st.lists(st.floats(-1e6, 1e6), min_size=6, max_size=6), min_size=2, max_size=20))
def test_every_number_survives_to_the_last_bit(tmp_path_factory, rows):
    folder = tmp_path_factory.mktemp("bits")
    text = [f"{i},{','.join(map(repr, row))}" for i, row in enumerate(rows)]
    _, recording = import_file(folder, rows=text)
    assert recording.readings().raw.tolist() == rows


def test_the_provenance_is_plain_json(tmp_path):
    _, recording = import_file(tmp_path)
    json.dumps(recording.provenance, allow_nan=False)
