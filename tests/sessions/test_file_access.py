"""Files of any size and kind: read within bounds, written over no link, and a failure names what mends it."""

import errno
import os
import sqlite3
from contextlib import ExitStack
from pathlib import Path

import pytest
from recordings import record_session

from daq_app.cli.main import run
from sessions.file_access import read_within_limit, remedy, whole_folder, write_whole
from sessions.recording import RecordingError, archive
from sessions.recording.archive import seal
from sessions.recording.derived import bytes_of, store_derived
from sessions.recording.storage import release_reserve, take_reserve

HUGE = 20 * 2**30  # [bytes]


def test_a_failing_disk_a_denied_permission_and_a_full_disk_have_each_their_own_advice():
    assert "free space" not in remedy(OSError(errno.EIO, "Input/output error"))
    assert remedy(OSError(errno.EIO, "")) == "check the disk and its cable"
    assert remedy(PermissionError(errno.EACCES, "")) == "permit reading and writing there"
    assert remedy(OSError(errno.ENOSPC, "")) == "free space on the disk"
    assert remedy(OSError("Can't write data (file write failed: errno = 28, error message = 'x')")) == remedy(
        OSError(errno.ENOSPC, "")
    )


def test_a_new_file_in_a_folder_that_is_not_there_is_named_as_it_was_asked_for_and_nothing_is_to_be_restored(tmp_path):
    with pytest.raises(FileNotFoundError) as caught_error:
        write_whole(tmp_path / "none" / "labels.txt", b"K1")
    assert caught_error.value.filename == str(tmp_path / "none" / "labels.txt")
    assert remedy(caught_error.value, new=True) == "check its name"
    assert "copy" in remedy(caught_error.value)


@pytest.mark.parametrize(
    ("code", "advice"),
    [
        (sqlite3.SQLITE_FULL, "free space on the disk"),
        (sqlite3.SQLITE_IOERR | 3 << 8, "check the disk and its cable"),
        (sqlite3.SQLITE_READONLY, "permit reading and writing there"),
        (sqlite3.SQLITE_CORRUPT, "restore it from a copy"),
    ],
)
def test_a_failure_of_the_database_is_advised_by_its_code(code, advice):
    error = sqlite3.OperationalError("x")
    error.sqlite_errorcode = code
    assert remedy(error) == advice


def test_a_link_at_the_place_of_the_unfinished_file_is_not_followed(tmp_path):
    folder = record_session(tmp_path / "s")
    mine = tmp_path / "thesis.tex"
    mine.write_text("years of work")
    own = os.getpid()
    for name in (f".analysis.json.{own}.part", ".session.h5.part", f".MANIFEST.json.{own}.part", "session.reserve"):
        (folder / name).symlink_to(mine)
    store_derived(folder, "analysis.json", {"a": 1})
    take_reserve(folder, 4096)
    release_reserve(folder)
    seal(folder)
    assert mine.read_text() == "years of work"
    assert not (folder / "analysis.json").is_symlink()


def test_a_sealing_that_failed_names_the_verb_that_seals_again(tmp_path, monkeypatch):
    folder = record_session(tmp_path / "s")

    def failing(*_):
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(archive, "write_copy", failing)
    with pytest.raises(RecordingError, match=r"check the disk and its cable.*'daq-app resume --end'") as caught_error:
        seal(folder)
    assert "free space" not in str(caught_error.value)


def test_a_file_of_twenty_gigabytes_is_refused_in_one_sentence_before_it_is_read(tmp_path):
    path = tmp_path / "decisions.jsonl"
    with path.open("wb") as file:
        file.truncate(HUGE)
    with pytest.raises(RecordingError, match="it holds more than 256 MB"):
        bytes_of(path)
    with pytest.raises(OSError, match="more than 1 MB"):
        read_within_limit(path, 2**20)


def test_a_file_without_end_is_refused():

    with pytest.raises(OSError, match="more than 1 MB"):
        read_within_limit(Path("/dev/zero"), 2**20)


def test_a_latin_1_protocol_is_named_when_a_study_is_made_of_it(tmp_path, capsys):
    path = tmp_path / "p.toml"
    path.write_bytes('name = "Stärke"'.encode("latin-1"))
    assert run(["enrol", str(tmp_path / "study"), "--protocol", str(path)]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert "byte 10 is no UTF-8 text; save the file as UTF-8" in lines[0]
    assert not (tmp_path / "study").exists()


def test_a_file_written_whole_leaves_the_permissions_of_new_files(tmp_path):
    write_whole(tmp_path / "a", b"x")
    (tmp_path / "b").write_bytes(b"x")
    assert (tmp_path / "a").stat().st_mode == (tmp_path / "b").stat().st_mode


@pytest.mark.skipif(os.name != "posix", reason="there are no pipes among files on this system")
def test_a_pipe_or_a_device_is_written_to_and_stays(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    write_whole(pipe, b"K1")
    assert os.read(reader, 100) == b"K1"
    os.close(reader)
    assert pipe.is_fifo()


@pytest.mark.parametrize("place", ["", ".."])
def test_a_folder_is_never_written_over(tmp_path, monkeypatch, place):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(OSError, match="directory"):
        write_whole(Path(place), b"K1")


def test_of_two_who_write_one_folder_at_once_the_first_to_end_has_it_and_nothing_is_mixed(tmp_path):
    folder = tmp_path / "export"
    slow = ExitStack()
    (slow.enter_context(whole_folder(folder)) / "slow.csv").touch()
    with whole_folder(folder) as quick:
        (quick / "quick.csv").touch()
    with pytest.raises(FileExistsError):
        slow.close()
    assert [path.relative_to(tmp_path).as_posix() for path in sorted(tmp_path.rglob("*"))] == [
        "export",
        "export/quick.csv",
    ]
