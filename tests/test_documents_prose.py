"""The pages of the documentation keep the lengths that a reader gets through."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGES = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")),
    *(page for page in sorted((ROOT / "docs").rglob("*.md")) if not {"_build", "generated"} & {*page.parts}),
]
LONGEST_PAGE, LONGEST_CELL, LONGEST_SENTENCE = 1500, 25, 40  # words
HIDDEN = re.compile(r"\A---\n.*?\n---\n|^ *(```|~~~).*?^ *\1|<!--.*?-->", re.DOTALL | re.MULTILINE)
TARGET = re.compile(r"\]\([^)]*\)")  # where a link leads
BREAK = re.compile(r"^\s*(?:[-*+] |\d+\. |#+ |$)", re.MULTILINE)  # of a list item, a heading or a paragraph
STOP = re.compile(r"(?<=[.!?])[)*_\"]*\s+(?=[^a-z])")

by_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())


def visible(page: Path) -> str:
    """Return the text of a page without front matter, code blocks, comments and the targets of links."""
    return TARGET.sub("]", HIDDEN.sub("", page.read_text(encoding="utf-8")))


def words(text: str) -> int:
    """Return how many words a text has; marks of tables, lists and headings are none."""
    return len([word for word in text.replace("|", " ").split() if not re.fullmatch(r"[-:#*+]+", word)])


def cells(text: str) -> list[str]:
    """Return the cells of the tables of a text."""
    rows = [line.strip() for line in text.splitlines() if line.lstrip().startswith("|")]
    return [cell for row in rows for cell in re.split(r"(?<!\\)\|", row)]


def sentences(text: str) -> list[str]:
    """Return the sentences of a text outside tables."""
    prose = "\n".join("" if line.lstrip().startswith("|") else line for line in text.splitlines())
    return [sentence for part in BREAK.split(prose) for sentence in STOP.split(part)]


def longer(parts: list[str], most: int) -> list[str]:
    """Return the parts of more than `most` words, each with its number of words."""
    return [f"{words(part)} words: {' '.join(part.split())}" for part in parts if words(part) > most]


@by_page
def test_a_page_has_at_most_1500_words(page):
    assert words(visible(page)) <= LONGEST_PAGE


@by_page
def test_a_cell_of_a_table_has_at_most_25_words(page):
    assert longer(cells(visible(page)), LONGEST_CELL) == []


@by_page
def test_a_sentence_has_at_most_40_words(page):
    assert longer(sentences(visible(page)), LONGEST_SENTENCE) == []
