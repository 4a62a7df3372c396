import errno
import os
import re
from dataclasses import dataclass, field
from datetime import date, time
from pathlib import Path
from typing import Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sessions import toml_file
from sessions.toml_file import NotAllowed, SettingsError, from_table, from_toml, load_toml, toml_text
from solver import Finger, Friction, Loading, Material, Materials, Relaxation, Scene
from solver.scene.published import STICKINESS
from solver.scene.published import scene as published

CONTRACT = Path(__file__).resolve().parents[3] / "shared" / "design" / "contract.md"


@dataclass(frozen=True, slots=True)
class Inner:
    depth: float
    pair: tuple[float, float] = (1.0, 2.0)

    def __post_init__(self):
        if self.depth > 10:
            raise NotAllowed("depth", self.depth, "it must not exceed 10 mm")


@dataclass(frozen=True, slots=True)
class Outer:
    count: int
    inner: Inner
    kind: Literal["one", "two"] = "one"
    note: str = ""
    limit: float | None = None
    many: tuple[Inner, ...] = field(default_factory=tuple)


GOOD = {"count": 3, "inner": {"depth": 2}}


def test_whole_numbers_stand_for_numbers_and_defaults_for_what_is_left_out():
    assert from_table(GOOD, Outer, "here") == Outer(3, Inner(2.0))


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"count": 2.5}, "here: count = 2.5 is not allowed: it must be a whole number"),
        ({"count": True}, "here: count = true is not allowed: it must be a whole number"),
        ({"inner": {"depth": True}}, "here: inner.depth = true is not allowed: it must be a number"),
        ({"inner": {"depth": "2"}}, 'here: inner.depth = "2" is not allowed: it must be a number'),
        ({"inner": {"depth": float("nan")}}, "here: inner.depth = nan is not allowed: it must be a finite number"),
        ({"limit": float("inf")}, "here: limit = inf is not allowed: it must be a finite number"),
        ({"inner": {"depth": 11}}, "here: inner.depth = 11.0 is not allowed: it must not exceed 10 mm"),
        (
            {"many": [{"depth": 1}, {"depth": 12}]},
            "here: many[1].depth = 12.0 is not allowed: it must not exceed 10 mm",
        ),
        ({"many": [{"depth": 1, "x": 1}]}, "here: many[0].x is not known; allowed here: depth, pair"),
        ({"inner": {}}, "here: inner.depth is missing; it must be a number"),
        (
            {"inner": {"depth": 1, "pair": [1]}},
            "here: inner.pair = [1] is not allowed: it must be a list of 2, each a number",
        ),
        ({"kind": "three"}, 'here: kind = "three" is not allowed: it must be "one" or "two"'),
        ({"note": 3}, "here: note = 3 is not allowed: it must be text in quotes"),
        ({"many": {"y": 1}}, "here: many = {y = 1} is not allowed: it must be a list, each a table"),
        ({"inner": 3}, "here: inner = 3 is not allowed: it must be a table"),
        ({"": 3}, 'here: "" is not known; allowed here: count, inner, kind, note, limit, many'),
        ({"a\x1b[2J": 3}, r'here: "a\u001b[2J" is not known; allowed here: count, inner, kind, note, limit, many'),
        ({"kind": "\x9b"}, r'here: kind = "\u009b" is not allowed: it must be "one" or "two"'),
        ({"count": date(2026, 1, 31)}, "here: count = 2026-01-31 is not allowed: it must be a whole number"),
        ({"note": [time(7, 32)]}, "here: note = [07:32:00] is not allowed: it must be text in quotes"),
        ({"colour": 3}, "here: colour is not known; allowed here: count, inner, kind, note, limit, many"),
    ],
)
def test_a_wrong_value_gives_one_sentence_with_its_key_its_value_and_what_is_allowed(change, sentence):
    with pytest.raises(SettingsError) as refusal:
        from_table({**GOOD, **change}, Outer, "here")
    assert str(refusal.value) == sentence


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5) | st.dates(),
    lambda inside: st.lists(inside, max_size=3) | st.dictionaries(st.sampled_from([*"abc", "depth", "pair"]), inside),
    max_leaves=8,
)


@given(table=st.dictionaries(st.sampled_from(["count", "inner", "kind", "note", "limit", "many", "odd"]), VALUES))
def test_any_table_gives_the_dataclass_or_one_sentence(table):
    try:
        outcome = from_table(table, Outer, "here")
    except SettingsError as error:
        outcome = error
    assert isinstance(outcome, Outer) or str(outcome).startswith("here: ")


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"none\.toml: there is no such file"):
        load_toml(tmp_path / "none.toml", Outer)


def test_a_file_that_cannot_be_read_is_no_wrong_value(tmp_path, monkeypatch):
    def refuse(path, _):
        raise PermissionError(errno.EACCES, "Permission denied", str(path))

    monkeypatch.setattr(toml_file, "read_within_limit", refuse)
    (tmp_path / "locked.toml").touch()
    with pytest.raises(OSError, match=r"locked\.toml cannot be read \(Permission denied\); permit reading"):
        load_toml(tmp_path / "locked.toml", Outer)


@pytest.mark.parametrize("content", [b"count = = 1", b"count = 1\ncount = 2", b"\xff\xfe"])
def test_what_is_not_toml_is_refused_with_the_files_name(tmp_path, content):
    path = tmp_path / "broken.toml"
    path.write_bytes(content)
    with pytest.raises(SettingsError, match=r"broken\.toml: "):
        load_toml(path, Outer)


@pytest.mark.parametrize(
    ("value", "sentence"),
    [
        ("[" * 2000 + "]" * 2000, "lists or tables are nested too deep"),
        ("1" * 5000, "a whole number has thousands of digits"),
        (f"0x{'f' * 5000}", "limit = 0xfff"),  # more decimal digits than Python shows
    ],
    ids=["brackets", "digits", "hexadecimal digits"],
)
def test_a_value_beyond_all_measure_is_refused_in_a_sentence(value, sentence):
    with pytest.raises(SettingsError, match=f"^here(, line 3)?: {re.escape(sentence)}"):
        from_toml(f"count = 3\ninner = {{depth = 2}}\nlimit = {value}", Outer, "here")


def test_the_mark_that_some_editors_begin_a_file_with_is_no_part_of_it(tmp_path):
    path = tmp_path / "marked.toml"
    path.write_bytes(b"\xef\xbb\xbf" + SCENE.encode())
    assert load_toml(path, Scene).friction.mu == 0.67


@pytest.mark.skipif(not Path("/dev/fd").exists(), reason="no pipe has a path here")
def test_a_file_may_be_a_pipe():
    out, into = os.pipe()
    os.write(into, SCENE.encode())
    os.close(into)
    try:
        assert load_toml(Path(f"/dev/fd/{out}"), Scene).friction.mu == 0.67
    finally:
        os.close(out)


SCENE = "[finger]\ntip_radius = 5.0\n\n[friction]\nmu = 0.67\n\n[loading]\nindentation = 2.0\n"


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("mu = 0.67", "mu = -1", "line 5: friction.mu = -1.0 is not allowed: "),
        ("mu = 0.67", 'mu = "a lot"', 'line 5: friction.mu = "a lot" is not allowed: it must be a number'),
        ("tip_radius = 5.0", "tip_radius = 5.0\nnail = 1", "line 3: finger.nail is not known; "),
        (
            "[finger]",
            "[materials.fat]\nE = 0.03\nnu = 0.5\n[finger]",
            "line 3: materials.fat.nu = 0.5 is not allowed: ",
        ),
        ("indentation = 2.0", "indentation = 15", "line 8: loading.indentation = 15.0 is not allowed: "),
    ],
)
def test_a_wrong_scene_file_is_refused_with_its_line(tmp_path, old, new, sentence):
    path = tmp_path / "scene.toml"
    path.write_text(SCENE.replace(old, new))
    with pytest.raises(SettingsError) as refusal:
        load_toml(path, Scene)
    assert str(refusal.value).startswith(f"{path}, {sentence}")


@pytest.mark.parametrize(
    ("old", "new", "hint"),
    [
        ("mu = 0.67", "mu = 0,67", "; use a decimal point in 0,67"),
        ("mu = 0.67", "mu = 0,67  # of the sample", "; use a decimal point in 0,67"),
        ("mu = 0.67", "mu = 0.67\nmu = 0.67 # not 0,67", ""),
        ("[friction]", "title = '0,67\n[friction]", ""),
    ],
)
def test_a_comma_before_a_fraction_is_named(tmp_path, old, new, hint):
    path = tmp_path / "scene.toml"
    path.write_text(SCENE.replace(old, new))
    with pytest.raises(SettingsError, match="this is not TOML") as refusal:
        load_toml(path, Scene)
    assert str(refusal.value).endswith(hint)
    assert ("point" in str(refusal.value)) == bool(hint)


def test_a_right_scene_file_gives_the_scene(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(SCENE)
    assert load_toml(path, Scene).friction.mu == 0.67


@pytest.mark.skipif(not CONTRACT.exists(), reason="the contract is not beside the project")
def test_the_scene_file_that_the_contract_shows_is_read_as_it_stands(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(re.search(r"```toml\n(title.*?)```", CONTRACT.read_text(encoding="utf-8"), re.DOTALL)[1])
    scene = load_toml(path, Scene)
    assert scene.finger == published(STICKINESS[4]).finger
    assert (scene.friction, scene.loading.indentation) == (published(STICKINESS[4]).friction, 2.0)
    assert scene.solve.tolerance == 0.01


@given(
    title=st.text(st.characters(exclude_categories=["Cs"])),
    stiffness=st.floats(0.01, 1.0),
    prony=st.lists(st.builds(Relaxation, st.floats(0.01, 0.2), st.floats(0.01, 100.0)), max_size=3),
    slide=st.sampled_from(["+x", "none", ("+x", "-x")]),
)
def test_a_scene_written_as_toml_is_the_same_scene_when_it_is_read(title, stiffness, prony, slide):
    fat = Material(stiffness, 0.48, prony=tuple(prony))
    scene = Scene(
        title=title,
        finger=Finger(bone_centre=(-1.0, 1e-05)),
        materials=Materials(fat=fat),
        friction=Friction(0.3),
        loading=Loading(1.0, slide),
    )
    assert from_toml(toml_text(scene), Scene, "text") == scene
