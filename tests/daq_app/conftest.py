"""Sessions that several tests of the verbs read or change."""

import shutil

import pytest
from report_session import record

from sessions.recording.archive import seal


@pytest.fixture(scope="session")
def two_trials(tmp_path_factory):
    """A sealed session of two trials; tests that change it take a copy."""
    folder, _ = record(tmp_path_factory.mktemp("two") / "P01", per_block=1)
    seal(folder)
    return folder


@pytest.fixture
def small(two_trials, tmp_path):
    return shutil.copytree(two_trials, tmp_path / "P01")
