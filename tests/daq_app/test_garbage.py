"""Files of garbage, given to the command line: one sentence, an exit code that says it, and no other file changed."""

import hashlib
import json
import random
import shutil
import sqlite3
import zlib
from contextlib import closing

import pytest
from recordings import record_session

from daq_app.cli.main import run
from sessions.plan.protocols.protocol import protocol_file

SCENE = """
title = "a scene"
[finger]
tip_radius = 5.0
bone_centre = [-1.0, 0.75]
bone = "meshed"
[friction]
mu = 0.5
[loading]
indentation = 1.0
slide = "-x"
[solve]
tolerance = 0.02
"""
NONSENSE = [
    "",
    "nan",
    "-1e308",
    "[]",
    "{}",
    '"x"',
    "true",
    "1979-05-27",
    "10" * 3000,
    "[" * 3000,
    "\x00",
    "ü",
    "'''",
    "= =",
]
JSON = [None, True, -1, 1e300, 10**30, "", "x", [], [None], {}, {"a": {}}, [[[[]]]]]


def mutate_bytes(chance, content):
    """Return bytes of which a few were changed, cut out, doubled, or replaced by nonsense."""
    mutant = bytearray(content)
    for _ in range(chance.choice([1, 1, 2, 5, 40])):
        at = chance.randrange(len(mutant) + 1)
        length = chance.choice([1, 2, 8, 100, 4096])
        match chance.randrange(5):
            case 0:
                mutant[at : at + length] = chance.randbytes(min(length, len(mutant) - at))
            case 1:
                del mutant[at : at + length]
            case 2:
                mutant[at:at] = mutant[at : at + length]
            case 3:
                mutant[at : at + length] = bytes(length)
            case _:
                mutant[at:at] = chance.choice(NONSENSE).encode("latin-1")
    return bytes(mutant)


def mutate_toml(chance, content):
    """Return a TOML text of which lines were dropped, doubled, or given nonsense for a value; or changed bytes."""
    if chance.random() < 0.3:
        return mutate_bytes(chance, content)
    lines = content.decode().splitlines()
    for _ in range(chance.choice([1, 1, 3])):
        at = chance.randrange(len(lines))
        key, equals, _ = lines[at].partition("=")
        match chance.randrange(4):
            case 0:
                del lines[at]
            case 1:
                lines.insert(chance.randrange(len(lines)), lines[at])
            case _ if equals:
                lines[at] = f"{key}= {chance.choice(NONSENSE)}"
            case _:
                lines[at] = chance.choice(NONSENSE)
    return "\n".join(lines).encode()


def mutate_json(chance, value):
    """Return a JSON value with nonsense in one place of it."""
    if not isinstance(value, dict | list) or not value or chance.random() < 0.2:
        return chance.choice(JSON)
    names = list(value) if isinstance(value, dict) else range(len(value))
    name = chance.choice(list(names))
    copy = value.copy()
    if isinstance(value, dict) and chance.random() < 0.2:
        del copy[name]
    else:
        copy[name] = mutate_json(chance, copy[name])
    return copy


def mutate_rows(chance, path):
    """Put nonsense into a row of a database; its check sum, where it has one, is right."""
    with closing(sqlite3.connect(path)) as connection:
        tables = [name for (name,) in connection.execute("SELECT name FROM sqlite_master WHERE type='table'")]
        table = chance.choice(tables)
        rows = connection.execute(f"SELECT rowid, * FROM {table}").fetchall()
        names = [row[1] for row in connection.execute(f"PRAGMA table_info({table})")]
        rowid, *row = chance.choice(rows)
        fields = dict(zip(names, row, strict=True))
        text = next((name for name in ("data", "value") if name in fields), None)
        if text and str(fields[text]).startswith(("{", "[")) and chance.random() < 0.7:
            fields[text] = json.dumps(mutate_json(chance, json.loads(fields[text])))
        else:
            name = chance.choice([name for name in names if name != "crc32"])
            fields[name] = chance.choice([None, -1, 2**62, 0.5, "", "x", b"\xff\xfe", "[" * 3000, fields[name]])
        if "crc32" in fields and text and isinstance(fields[text], str):
            texts = [fields[name] for name in names[:-1]] if table == "events" else [fields[text]]
            fields["crc32"] = zlib.crc32("\n".join("" if value is None else str(value) for value in texts).encode())
        assignments = ", ".join(f"{name}=?" for name in names)
        try:
            connection.execute(f"UPDATE OR REPLACE {table} SET {assignments} WHERE rowid=?", (*fields.values(), rowid))
            connection.commit()
        except sqlite3.Error:  # what SQLite itself refuses is no file that can be met
            connection.rollback()


def state(folder):
    return {
        path.relative_to(folder): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def run_checked(capsys, room, arguments):
    """Run a command line and hold what it said against what may be said; files in `room` stay as they are."""
    before = state(room)
    code = run(arguments)
    output = capsys.readouterr()
    where = f"{arguments}: {code} {output.err[:2000]}"
    assert code in {0, 1, 2, 3}, where
    assert "unexpected" not in output.err, where
    assert "Traceback" not in output.err, where
    assert code not in {1, 2} or len(output.err.splitlines()) == 1, where
    assert len(output.err) < 2000, where
    after = state(room)
    assert {path: after.get(path) for path in before} == before, where


@pytest.fixture(scope="module")
def originals(tmp_path_factory):
    """A session, and a study with a subject."""
    folder = tmp_path_factory.mktemp("originals")
    record_session(folder / "session")
    protocol = "magnitude-estimation"
    assert run(["enrol", str(folder / "study"), "--protocol", protocol, "--seed", "1", "--subject", "P1"]) == 0
    assert run(["enrol", str(folder / "study"), "--subject", "P2", "--finger", "tip_radius=6"]) == 0
    assert run(["enrol", str(folder / "study"), "--subject", "P1", "--withdraw", "ill"]) == 0
    return folder


def garbage_session(chance, originals, room, capsys):
    folder = shutil.copytree(originals / "session", room / "s")
    spoil_database(chance, folder / "session.sqlite")
    run_checked(capsys, folder, ["verify", str(folder)])
    run_checked(capsys, folder, ["export", str(folder), "--format", "csv", "--out", str(room / "out")])


def garbage_study(chance, originals, room, capsys):
    folder = shutil.copytree(originals / "study", room / "study")
    spoil_database(chance, folder / "study.sqlite")
    run_checked(capsys, folder, ["enrol", str(folder)])


def spoil_database(chance, path):
    if chance.random() < 0.5:
        mutate_rows(chance, path)
    else:
        path.write_bytes(mutate_bytes(chance, path.read_bytes()))


def garbage_protocol(chance, _, room, capsys):
    path = room / "p.toml"
    path.write_bytes(mutate_toml(chance, protocol_file("sensotact-friction").read_bytes()))
    run_checked(capsys, room, ["enrol", str(room / "new"), "--protocol", str(path), "--seed", "1"])


def garbage_scene(chance, _, room, capsys):
    path = room / "s.toml"
    path.write_bytes(mutate_toml(chance, SCENE.encode()))
    run_checked(capsys, room, ["solve", str(path)])


def garbage_exclusions(chance, originals, room, capsys):
    folder = room / "sessions"
    shutil.copytree(originals / "session", folder / "s")
    text = '[[exclude]]\nsubject = "S01"\nwhy = "ill"\nwho = "A"\n'
    (folder / "exclusions.toml").write_bytes(mutate_toml(chance, text.encode()))
    run_checked(capsys, folder, ["study", str(folder), "--out", str(room / "out")])


KINDS = [garbage_session, garbage_study, garbage_protocol, garbage_scene, garbage_exclusions]


@pytest.fixture(autouse=True)
def _nothing_is_computed(monkeypatch):
    """Reading is what is tried: a scene that is taken is not solved, and a study that is taken is not pooled."""
    from daq_app.cli.verbs import study
    from sessions.recording import RecordingError
    from solver import SolveFailure
    from solver.response import solution

    def failing(kind):
        def refuse(*_, **__):
            raise kind("this is not computed here")

        return refuse

    monkeypatch.setattr(solution, "solve", failing(SolveFailure))
    monkeypatch.setattr(study, "visits", failing(RecordingError))


def try_seeds(kind, seeds, originals, tmp_path, capsys):
    for seed in seeds:
        room = tmp_path / str(seed)
        room.mkdir()
        kind(random.Random(seed), originals, room, capsys)
        shutil.rmtree(room)


@pytest.mark.parametrize("kind", KINDS)
def test_garbage_ends_in_one_sentence_and_changes_no_other_file(originals, tmp_path, capsys, kind):
    try_seeds(kind, range(10), originals, tmp_path, capsys)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_much_garbage_ends_in_one_sentence_and_changes_no_other_file(originals, tmp_path, capsys, kind):
    try_seeds(kind, range(1000, 1400), originals, tmp_path, capsys)
