"""Compiled loops are loaded from a folder that nobody but the user may write in."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from solver import _kernels as compiling

CODE = "import solver._kernels, os; print(os.environ['NUMBA_CACHE_DIR'])"


def cache_folder_of(folder, umask=-1):
    """Return the folder that a process with a `umask` uses whose environment names `folder`."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder)}
    process = subprocess.run(
        [sys.executable, "-c", CODE], env=environment, capture_output=True, text=True, check=True, umask=umask
    )
    return Path(process.stdout.strip())


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="files have no owners here")
@pytest.mark.parametrize("mode", [0o777, 0o775, 0o1777])
def test_machine_code_in_a_folder_that_others_may_write_is_not_loaded(tmp_path, mode):
    folder = tmp_path / "shared"
    folder.mkdir()
    folder.chmod(mode)
    assert folder not in cache_folder_of(folder).parents


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="files have no owners here")
def test_machine_code_is_kept_where_new_folders_are_open_to_the_users_group(tmp_path):
    folder = tmp_path / "caches" / "new"
    assert cache_folder_of(folder, 0o002).parent == folder


@pytest.mark.skipif(sys.platform != "linux", reason="the user's caches lie elsewhere here")
def test_the_users_own_cache_that_is_open_to_a_group_is_closed_and_used(tmp_path, monkeypatch):
    sources, cache = tmp_path / "sources", tmp_path / "daq-app"
    for folder in (sources, cache):
        folder.mkdir()
        folder.chmod(0o775)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    monkeypatch.setattr(compiling, "_FOLDER", sources)
    assert compiling._cache_folder().parent == cache
    assert cache.stat().st_mode & 0o777 == 0o700


def test_machine_code_in_a_folder_of_ones_own_is_kept_there(tmp_path):
    folder = tmp_path / "mine"
    folder.mkdir(mode=0o700)
    assert cache_folder_of(folder).parent == folder


@pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() != 0, reason="only root can give files away")
def test_machine_code_in_a_folder_of_somebody_else_is_not_loaded(tmp_path):
    folder = tmp_path / "theirs"
    folder.mkdir(mode=0o700)
    os.chown(folder, 12345, 12345)
    assert folder not in cache_folder_of(folder).parents
