"""Cells, columns and notes: what every table is made of."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

from sessions.exports.wording import NONE
from sessions.report import Report

Thing = TypeVar("Thing")


@dataclass(frozen=True, slots=True)
class Cell:
    """What stands in one cell, and the mark of the note that explains it."""

    text: str
    mark: str = ""
    hover: str = ""


@dataclass(frozen=True, slots=True)
class Column:
    """The head of a column."""

    name: str
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Group:
    """Rows under a heading of their own, "" for none."""

    name: str
    rows: tuple[tuple[Cell, ...], ...]


@dataclass(frozen=True, slots=True)
class Table:
    """One table, with what must be read beside it."""

    name: str  # its anchor on the page
    caption: str
    columns: tuple[Column, ...]
    groups: tuple[Group, ...]
    notes: tuple[tuple[str, str], ...]  # mark, sentence


@dataclass(slots=True)
class Notes:
    """The reasons met so far, each with a letter."""

    marks: dict[str, str] = field(default_factory=dict[str, str])

    def mark(self, sentence: str) -> str:
        """Return the letter of a note, a new one where it was not met before."""
        n = len(self.marks)
        letters = (chr(ord("a") + n // 26 - 1) if n >= 26 else "") + chr(ord("a") + n % 26)
        return self.marks.setdefault(sentence, letters)

    def number(self, value: float | None, shown: Callable[[float], str], reason: str | None) -> Cell:
        """Return the number, or a dash with its reason."""
        if value is not None:
            return Cell(shown(value))
        why = reason or "not determined"
        return Cell(NONE, self.mark(why), why)

    def listed(self) -> tuple[tuple[str, str], ...]:
        """Return every note with its letter."""
        return tuple((mark, sentence) for sentence, mark in self.marks.items())


def grouped(
    report: Report,
    things: Sequence[Thing],
    experiment: Callable[[Thing], str],
    row: Callable[[Thing], tuple[Cell, ...]],
) -> tuple[Group, ...]:
    """Return the rows of all things under the names of their experiments."""
    names = [e.name for e in report.experiments]
    groups = [Group(name, tuple(row(t) for t in things if experiment(t) == name)) for name in names]
    groups.append(Group("", tuple(row(t) for t in things if experiment(t) not in names)))
    return tuple(group for group in groups if group.rows)
