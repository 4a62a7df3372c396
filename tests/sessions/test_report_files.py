"""A report replaces an older one whole or not at all, and nothing that is no report."""

import pytest
from report_example import bare

from sessions.file_access import NotOurs
from sessions.report.pages import ReportError, write_report


def test_writing_replaces_an_older_page_and_leaves_nothing_beside_it(tmp_path):
    path = tmp_path / "deep" / "report.html"
    write_report(bare(title="older"), path)
    write_report(bare(), path)
    assert "older" not in path.read_text(encoding="utf-8")
    assert [file.name for file in path.parent.iterdir()] == ["report.html"]


def test_a_file_that_is_no_report_is_left_alone(tmp_path):
    path = tmp_path / "session.sqlite"
    path.write_bytes(b"SQLite format 3\x00")
    with pytest.raises(NotOurs, match="holds something else"):
        write_report(bare(), path)
    assert path.read_bytes() == b"SQLite format 3\x00"


def test_a_page_that_cannot_be_written_is_refused_in_one_sentence_and_the_old_one_stays(tmp_path, monkeypatch):
    path = tmp_path / "report.html"
    write_report(bare(title="older"), path)

    def full(_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(ReportError, match=r"cannot be written \(No space left on device\)"):
        write_report(bare(), path)
    assert "older" in path.read_text(encoding="utf-8")
    assert [file.name for file in tmp_path.iterdir()] == ["report.html"]


def test_a_place_that_is_no_folder_is_refused_in_one_sentence(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ReportError, match="cannot be"):
        write_report(bare(), tmp_path / "file" / "report.html")
