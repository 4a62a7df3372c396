"""What the pages of the format describe is what is written."""

import re
from pathlib import Path
from typing import get_args

import h5py
import pytest
from msgspec.inspect import type_info
from recordings import rows
from simulated_session import Session

from drivers.transducer import COUNTS
from sessions.plan.plan import Rests, Visibility
from sessions.plan.protocols.planning import plan
from sessions.plan.protocols.protocol import (
    BlockOutline,
    Face,
    OrderRules,
    PreEvaluation,
    Protocol,
    Scale,
    protocol,
)
from sessions.recording.archive import seal
from sessions.run import event_log
from sessions.run.steps import Event
from sessions.toml_file import SettingsError

DOCS = Path(__file__).parents[2] / "docs"
PAGES = [DOCS / "session-format.md", *sorted((DOCS / "session-format").glob("*.md"))]
PAGE = "\n".join(page.read_text(encoding="utf-8") for page in PAGES)
NAMES = set(re.findall(r"`([\w./-]+)`", PAGE))


@pytest.fixture(scope="module")
def session_folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("format") / "s"
    Session(folder).run()
    seal(folder)
    return folder


@pytest.mark.parametrize("table", ["head", "blocks", "events"])
def test_every_column_of_the_live_file_is_documented(session_folder, table):
    assert f"## Table `{table}`" in PAGE
    columns = {name for _, name, *_ in rows(session_folder, f"PRAGMA table_info({table})")}
    assert columns <= NAMES


def test_the_live_file_has_no_other_table(session_folder):
    assert {name for (name,) in rows(session_folder, "SELECT name FROM sqlite_master WHERE type='table'")} == {
        "head",
        "blocks",
        "events",
    }


def test_every_data_set_of_the_copy_is_documented(session_folder):
    data_sets = []
    with h5py.File(session_folder / "session.h5") as copy:
        copy.visititems(lambda name, item: data_sets.append(name) if isinstance(item, h5py.Dataset) else None)
        assert set(copy.attrs) <= NAMES
    assert set(data_sets) <= NAMES


def test_every_kind_of_event_is_documented(session_folder):
    kinds = {kind for (kind,) in rows(session_folder, "SELECT kind FROM events")}
    possible = {event_log.kind_of(kind) for kind in get_args(Event)}
    assert kinds | possible | set(COUNTS) <= NAMES


def test_every_key_of_a_protocol_is_documented():
    page = (DOCS / "how-to" / "add-a-protocol.md").read_text(encoding="utf-8")
    tables = {
        "": Protocol,
        "order.": OrderRules,
        "scale.": Scale,
        "rests.": Rests,
        "shown.": Visibility,
        "pre_evaluation.": PreEvaluation,
        "face.": Face,
        "blocks.": BlockOutline,
    }
    for prefix, kind in tables.items():
        for field in type_info(kind).fields:
            assert f"`{prefix}{field.encode_name}`" in page or f"[{field.encode_name}]" in page


def test_the_least_protocol_of_the_page_needs_every_line_that_may_not_be_left_out(tmp_path):
    page = (DOCS / "how-to" / "add-a-protocol.md").read_text(encoding="utf-8")
    lines = re.search(r"```toml\n(.*?)```", page, re.DOTALL).group(1).splitlines()
    path = tmp_path / "least.toml"
    path.write_text("\n".join(lines))
    (block,) = plan(protocol(path), "S01", 1).blocks
    assert sorted(trial.stimulus.index for trial in block.trials) == [0, 0, 50, 50, 100, 100]
    for at, line in enumerate(lines):
        path.write_text("\n".join(lines[:at] + lines[at + 1 :]))
        if "may be left out" in line or " = " not in line:
            continue
        with pytest.raises(SettingsError, match=line.split(" = ")[0]):
            protocol(path)
