"""What the docs name is there: files, headings, and in README every verb."""

import importlib
import re
import tomllib
from importlib import metadata
from pathlib import Path

import msgspec
import pytest
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

from daq_app.accuracy_page.page import PAGES as TABLES
from daq_app.accuracy_page.page import fill_marks
from daq_app.cli.main import VERBS
from drivers.catalog import DRIVERS
from sessions.exchange import FORMATS
from sessions.plan.protocols.protocol import Protocol, protocol_names
from sessions.strokes.stroke import FlawName
from solver import Scene

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
PRESENT = [page for page in PAGES if page.parent.name != "decisions" and page.name != "changed-names.md"]
PLACES = ("daq_app", "drivers", "sessions", "simulators", "solver", "tests", "benchmarks", "docs")
CODE = [path.as_posix() for place in PLACES for path in (ROOT / place).rglob("*.py")]
SOURCES = [Path(path).read_text(encoding="utf-8") for path in CODE]


def anchors(page):
    """Return the names that links can use for the headings of a page."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_link_of_a_page_leads_to_a_file_and_heading_that_is_there(page):
    for link in re.findall(r"\]\(([^)]+)\)", page.read_text(encoding="utf-8")):
        if link.startswith("http"):
            continue
        path, _, heading = link.partition("#")
        target = page if not path else page.parent / path
        assert target.exists(), link
        on_site = target.is_file() and target.resolve().is_relative_to(ROOT / "docs")
        assert on_site or page.name == "README.md", f"{link} is no page of the site"
        assert not heading or heading in anchors(target), link


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_file_of_code_that_a_page_names_is_there(page):
    for name in re.findall(r"`([\w/]+\.py)`", page.read_text(encoding="utf-8")):
        assert "NAME" in name or any(path.endswith(f"/{name}") for path in CODE), name


@pytest.mark.parametrize("page", PRESENT, ids=lambda page: page.name)
def test_every_member_of_a_class_that_a_page_names_is_there(page):
    for name, member in re.findall(r"`([A-Z]\w+)\.([a-z]\w*)[`(]", page.read_text(encoding="utf-8")):
        files = [text for text in SOURCES if re.search(rf"^class {name}\b", text, re.MULTILINE)]
        assert not files or any(re.search(rf"\b{member}\b", text) for text in files), f"{name}.{member}"


def test_a_name_that_a_page_places_in_a_file_is_defined_there():
    missing = []
    for page in [path for path in (ROOT / "docs").rglob("*.md") if "decisions" not in path.parts]:
        for name, place in re.findall(r"`(\w+)`\s+\(`([\w/]+\.py)`\)", page.read_text(encoding="utf-8")):
            files = [*ROOT.glob(place), *ROOT.glob(f"*/{place}")]
            definition = re.compile(rf"^ *(?:(?:def|class) {name}\b|{name}\s*[:=])", re.MULTILINE)
            if not any(definition.search(file.read_text(encoding="utf-8")) for file in files):
                missing.append((page.name, name, place))
    assert missing == []


def test_every_number_of_a_study_has_a_meaning_in_the_reference(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "docs")
    pages = importlib.import_module("record_keys").pages()
    page = pages["study-keys"]
    rows = [row for row in page.splitlines() if re.match(r"\| `\w+` \| `[^`]*\b(float|int)\b", row)]
    assert len(rows) > 100
    assert [row for row in rows if row.endswith("|  |")] == []
    assert "`left_out_error`" in page
    assert "[points]" in next(row for row in rows if "left_out_error" in row)
    assert "| `tau_max` | `float \\| None = None` | traction bound [MPa]" in pages["scene-keys"]
    assert "| `repetitions` | `int = 1` |" in pages["protocol-keys"]  # of a block


def test_readme_names_every_verb():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert [verb for verb in VERBS if not re.search(rf"`(\w+`, `)*{verb}\b", readme)] == []


def test_every_pinned_package_runs_on_the_first_release_of_the_python_that_readme_asks_for():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    oldest = project["requires-python"].removeprefix(">=")
    assert f"Python {oldest} or later" in (ROOT / "README.md").read_text(encoding="utf-8")
    pins = [Requirement(line) for line in (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()]
    installed = {d.metadata["Name"].lower().replace("_", "-"): d for d in metadata.distributions()}
    here = [(pin, installed[pin.name]) for pin in pins if pin.name in installed]
    pythons = {str(pin): d.metadata["Requires-Python"] or "" for pin, d in here if pin.specifier.contains(d.version)}
    assert len(pythons) > 50
    assert [pin for pin, python in pythons.items() if not SpecifierSet(python).contains(f"{oldest}.0")] == []


def test_readme_names_an_address_of_every_driver():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    without = [driver.name for driver in DRIVERS if f"| `{driver.name}://" not in readme]
    assert not without, "README.md has no row in its table of devices for these"


def test_every_export_is_named_on_the_page_of_exports_to_which_the_readme_leads():
    (readme_row,) = re.findall(r"\| `export SESSION.*", (ROOT / "README.md").read_text(encoding="utf-8"))
    (page,) = re.findall(r"\]\((.*?)\)", readme_row)
    page = (ROOT / page).read_text(encoding="utf-8")
    for name in FORMATS:
        assert f"| `{name}` |" in page, f"docs/how-to/export-and-import.md: the table has no row for {name}"


def test_the_page_on_protocols_names_every_built_in_one():
    page = (ROOT / "docs" / "how-to" / "add-a-protocol.md").read_text(encoding="utf-8")
    assert [name for name in protocol_names() if f"\n- `{name}`" not in page] == []


@pytest.mark.parametrize(("page", "kind"), [("how-to/add-a-protocol.md", Protocol), ("scene-file.md", Scene)])
def test_the_page_of_a_kind_of_file_names_every_key_of_it(page, kind):
    _, tables = msgspec.json.schema_components([kind])
    keys = {key for table in tables.values() for key in table.get("properties", ())}
    words = re.findall(r"`([^`\n]+)`", (ROOT / "docs" / page).read_text(encoding="utf-8"))
    assert keys - set(re.findall(r"\w+", " ".join(words))) == set()


def test_the_page_of_flaws_names_every_flaw():
    page = (ROOT / "docs" / "reference" / "flaws.md").read_text(encoding="utf-8")
    assert [name for name in FlawName if f"`{name}`" not in page] == []


def test_every_table_that_the_accuracy_run_writes_has_its_place_on_one_page():
    marks = [
        mark for page in PAGES for mark in re.findall(r"<!-- ([\w-]+): begin -->", page.read_text(encoding="utf-8"))
    ]
    survey_marks = ["judged"]  # which fills its own table
    assert sorted(marks) == sorted([*survey_marks, *(name for names in TABLES.values() for name in names)])
    for page, names in TABLES.items():
        text = (ROOT / "docs" / page).read_text(encoding="utf-8")
        assert all("new" in fill_marks(text, name, "new") for name in names), page
