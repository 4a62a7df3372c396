"""Two programs that import into one folder at once: the first has it, and loses nothing to the other."""

import pytest
from recordings import record_session

from daq_app.cli.main import run
from sessions.exchange import exported, import_csv
from sessions.recording.archive import seal

HEAD = "t_s,Fx_N,Fy_N,Fz_N,Tx_Nm,Ty_Nm,Tz_Nm"


@pytest.mark.parametrize(
    ("of", "step"), [(import_csv, "provenance"), (exported, "restore")], ids=["foreign table", "export"]
)
def test_what_another_program_puts_into_the_new_folder_meanwhile_stays(tmp_path, capsys, monkeypatch, of, step):
    folder, usual = tmp_path / "again", getattr(of, step)
    source = tmp_path / "strokes.csv"
    source.write_text(f"{HEAD}\n0,1,2,3,4,5,6\n0.1,1,2,3,4,5,6\n")
    if of is exported:
        source = record_session(tmp_path / "S01") / "session.h5"
        seal(source.parent)

    def with_another_program(*arguments):
        folder.mkdir()
        (folder / "session.sqlite").write_text("of another program")
        return usual(*arguments)

    monkeypatch.setattr(of, step, with_another_program)
    assert run(["import", str(source), "--out", str(folder)]) == 1
    assert f"{folder} is not empty; give a new folder" in capsys.readouterr().err
    assert [path.name for path in folder.iterdir()] == ["session.sqlite"]
    assert (folder / "session.sqlite").read_text() == "of another program"
