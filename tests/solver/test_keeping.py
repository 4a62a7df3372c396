"""Machine code of the loops is kept, linked without numba, and never where anything about it is in doubt."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from solver import _kernels as kernels
from solver._kernels import keeping
from solver._kernels.compiling import compiled
from solver._kernels.keeping import Place
from solver.progress import listening, tell


@pytest.fixture
def kept(tmp_path, monkeypatch):
    """The place, folder and contents of some kept code whose sources nobody else has."""
    x, at, out = np.linspace(0.0, 1.0, 3), np.array([0, 1, 0], np.int32), np.zeros(3)
    kernels.tributary(x, at, out)
    loop, types = kernels.tributary, ("float64[::1]", "int32[::1]", "float64[::1]")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    own = Place("skin.tributary", types, loop.sources())
    found = [folder / own.file for folder in own.folders() if (folder / own.file).exists()]
    source = tmp_path / "skin.py"
    source.write_text("another source", encoding="utf-8")
    other = Place("skin.tributary", types, frozenset({str(source)}))
    return other, tmp_path, found[0].read_bytes()


def test_a_process_that_finds_kept_code_does_without_numba():
    code = """
import sys
import numpy as np
from solver import _kernels as kernels
out = np.zeros(3)
kernels.tributary(np.linspace(0.0, 3.0, 3), np.array([0, 1, 0], np.int32), out)
print("numba" in sys.modules, *out)
"""
    for _ in range(2):  # the first may compile
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "0.5", "2.0", "0.5"]


def test_code_of_one_layout_is_not_called_with_another():
    x, at = np.repeat(np.linspace(0.0, 3.0, 3), 2), np.array([0, 1, 0], np.int32)
    out = np.zeros(3)
    kernels.tributary(x[::2], at, out)
    np.testing.assert_allclose(out, [0.5, 2.0, 0.5], rtol=1e-15)  # Simpson's rule
    with pytest.raises(TypeError, match="argument 2 of tributary is a str"):
        kernels.tributary(x[::2], at, "no array")


def fails(*_):
    raise AttributeError("what a later numba may have done away with")


@pytest.mark.parametrize("change", [("KNOWN", ()), ("linked", fails)], ids=["unknown numba", "linking fails"])
def test_where_code_cannot_be_linked_numba_does_it_its_own_way(monkeypatch, change):
    monkeypatch.setattr(keeping, *change)
    loop, out = compiled(kernels.tributary.function), np.zeros(3)
    loop(np.linspace(0.0, 3.0, 3), np.array([0, 1, 0], np.int32), out)
    np.testing.assert_allclose(out, [0.5, 2.0, 0.5], rtol=1e-15)
    assert type(loop.entry((out, np.zeros(3, np.int32), out))).__module__ == "numba.core.registry"


def test_what_is_kept_is_found_again_until_its_sources_change(kept):
    place, folder, data = kept
    assert keeping.linked(place) is None
    (folder / place.file).write_bytes(data)
    again = keeping.linked(place)
    assert again is not None
    out = np.zeros(3)
    again(np.linspace(0.0, 3.0, 3), np.array([0, 1, 0], np.int32), out)
    np.testing.assert_allclose(out, [0.5, 2.0, 0.5], rtol=1e-15)
    changed = folder / "changed.py"
    changed.write_text("other sources", encoding="utf-8")
    assert keeping.linked(Place(place.name, place.types, frozenset({str(changed)}))) is None


def test_damaged_code_and_code_that_asks_for_what_is_not_there_is_not_linked(kept):
    place, folder, data = kept
    file = folder / place.file
    file.write_bytes(data[:-1] + bytes([data[-1] ^ 1]))
    assert keeping.linked(place) is None
    file.write_bytes(data[: len(data) // 2])
    assert keeping.linked(place) is None
    file.write_bytes(data.replace(b'"outside": [', b'"outside": ["no_such_helper", ', 1))
    assert keeping.linked(place) is None


@pytest.mark.parametrize("content", [b"", b"\0" * 64, b"[]\n", b"{}\n", b"\xff\xfe\n", b"no JSON\n"])
def test_a_file_that_is_no_kept_code_is_replaced_by_what_is_compiled(kept, monkeypatch, content):
    place, folder, _ = kept
    file = folder / place.file
    file.write_bytes(content)
    loop, made = compiled(kernels.tributary.function), []
    monkeypatch.setattr(loop, "_place", lambda _: place)
    monkeypatch.setattr(
        loop, "_made", lambda _: made.append(1) or (loop.function, (b"code", "wrapper", "environment", []))
    )
    loop(np.linspace(0.0, 3.0, 3), np.array([0, 1, 0], np.int32), np.zeros(3))
    assert made == [1]
    assert file.read_bytes().endswith(b"\ncode")


def test_where_code_cannot_be_put_no_part_of_it_is_left(kept, monkeypatch):
    place, folder, _ = kept
    (folder / place.file).mkdir()
    monkeypatch.setattr(Place, "folders", lambda _: iter([folder]))
    keeping.keep(place, b"code", "wrapper", "environment", [])
    assert {one.name for one in folder.iterdir()} == {"skin.py", place.file}


def test_without_numba_the_package_that_is_missing_is_named(monkeypatch):
    monkeypatch.setattr("solver.extension.find_spec", lambda _: None)
    loop, out = compiled(kernels.tributary.function), np.zeros(3)
    with pytest.raises(ModuleNotFoundError, match="numba is not installed") as caught:
        loop(np.linspace(0.0, 3.0, 3), np.array([0, 1, 0], np.int32), out)
    assert caught.value.name == "numba"


def test_new_code_takes_the_place_of_that_of_earlier_sources(kept):
    place, folder, _ = kept
    keeping.keep(place, b"early", "wrapper", "environment", [])
    early = place.file
    later = folder / "later.py"
    later.write_text("later", encoding="utf-8")
    after = Place(place.name, place.types, frozenset({str(later)}))
    keeping.keep(after, b"late", "wrapper", "environment", [])
    assert [file.name for file in folder.glob("*.loop")] == [after.file] != [early]
    assert not Path(folder / early).exists()


def test_progress_says_which_loop_is_being_compiled_and_then_again_what_it_was(monkeypatch):
    monkeypatch.setattr(keeping, "linked", lambda _: None)
    monkeypatch.setattr(keeping, "keep", lambda *_: None)
    loop, heard = compiled(kernels.tributary.function), []
    monkeypatch.setattr(loop, "_made", lambda _: (loop.function, ()))
    with listening(lambda doing, _: heard.append(doing)):
        tell("solving")
        loop(np.linspace(0.0, 3.0, 3), np.array([0, 1, 0], np.int32), np.zeros(3))
    assert re.fullmatch(r"compiling tributary, loop \d+ of \d+ at most, once on this machine", heard[1])
    assert heard == ["solving", heard[1], "solving"]
