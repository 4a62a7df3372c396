"""An export to a disk that fills up leaves nothing, and one sentence says so."""

import gc

import pytest
from exported_sessions import source_of

from sessions.exchange import FORMATS, ExportError, export

resource = pytest.importorskip("resource")


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    return source_of("whole", tmp_path_factory.mktemp("sessions") / "whole")


@pytest.fixture
def no_large_file():
    """No file may grow beyond 500 bytes, as where a disk is full: the system says so at the write that crosses it."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (500, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.usefixtures("no_large_file")
@pytest.mark.parametrize("form", [pytest.param(form, marks=[pytest.mark.slow] * (form == "nwb")) for form in FORMATS])
def test_a_disk_that_takes_no_more_leaves_nothing_of_an_export_and_is_reported_in_a_sentence(source, tmp_path, form):
    with pytest.raises(ExportError, match=r"cannot be written \(File too large"):
        export(source, form, tmp_path / "out")
    gc.collect()  # a file that HDF5 could not close would bring the process down by now
    assert list(tmp_path.iterdir()) == []
