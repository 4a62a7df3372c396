"""Files that `daq-app import` refuses: one sentence, and no folder is left."""

import os

import pytest

from daq_app.cli.main import run


@pytest.mark.parametrize(
    ("text", "code", "sentence"),
    [
        ("t_s,Fx_N,Fy_N,Fz_N,Tx_Nm,Ty_Nm,Tz_Nm\n0,1,2,3,4,5,6\n0.1,1,2\n", 1, "line 3"),
        ("t_s,Fx_N,Fy_N,Fz_N,Tx_Nm,Ty_Nm,Tz_Nm\n0,1,2,3,4,5,6\n0.1,1,2,nan,4,5,6\n", 1, "line 3"),
        ("t_s,Fx_N,Fy_N,Fz_N,Tx_Nm,Ty_Nm,Tz_Nm\n0,1,2,3,4,5,6\n0.1,1,2,1e300,4,5,6\n", 1, "no number that a device"),
        ("t_s;Fx_N;Fy_N;Fz_N;Tx_Nm;Ty_Nm;Tz_Nm\n0;1,5;2;3;4;5;6\n", 1, "; save the file with decimal points"),
        ("", 1, "empty"),
    ],
)
def test_a_csv_that_cannot_be_taken_is_one_sentence_and_leaves_no_folder(text, code, sentence, tmp_path, capsys):
    file = tmp_path / "a.csv"
    file.write_text(text)
    assert run(["import", str(file), "--out", str(tmp_path / "a")]) == code
    output = capsys.readouterr().err
    assert sentence in output
    assert output.count("\n") == 1
    assert not (tmp_path / "a").exists()


@pytest.mark.skipif(os.name != "posix", reason="names are text there")
def test_a_file_whose_name_is_no_utf8_is_one_sentence_and_leaves_no_folder(tmp_path, capsys):
    csv = tmp_path / os.fsdecode(b"m\xfcde.csv")
    csv.write_text("t_s,Fx_N,Fy_N,Fz_N,Tx_Nm,Ty_Nm,Tz_Nm\n0,1,2,3,4,5,6\n0.1,1,2,3,4,5,6\n")
    assert run(["import", str(csv), "--out", str(tmp_path / "a")]) == 1
    output = capsys.readouterr().err
    assert "a name is not UTF-8" in output
    assert "rename the file or folder" in output
    assert not (tmp_path / "a").exists()


@pytest.mark.parametrize("name", ["nwb", "nwb/session.nwb"])
def test_an_export_that_does_not_come_back_is_said_to_be_one(tmp_path, capsys, name):
    (tmp_path / "nwb").mkdir()
    (tmp_path / "nwb" / "session.nwb").write_bytes(b"\x89HDF")
    assert run(["import", str(tmp_path / name), "--out", str(tmp_path / "again")]) == 1
    assert "is an export for other programs alone; give one of csv, bids, hdf5" in capsys.readouterr().err
