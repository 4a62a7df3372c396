"""Cells, columns and notes: what every table is made of."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

from sessions.report import Report
from sessions.report.wording import NONE, between

Thing = TypeVar("Thing")


@dataclass(frozen=True, slots=True)
class Cell:
    """What stands in one cell, the mark of the note that explains it, and under it the interval of its number."""

    text: str
    mark: str = ""
    hover: str = ""
    interval: str = ""


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

    def estimate(
        self,
        value: float | None,
        shown: Callable[[float], str],
        reason: str | None,
        ends: tuple[float, float] | None,
        without: str | None = None,
        *,
        told: Callable[[float], str] | None = None,
        unit: float = 1.0,
        star: bool = False,
    ) -> Cell:
        """Return the number over its interval, `without` which it has a note that says why; or a dash with its reason.

        `told` shows an end of the interval where `shown` shows more than a number; `unit` as for `wording.between`.
        `star` marks an interval that was found otherwise than the others of its table.
        """
        if value is None:
            return self.number(None, shown, reason)
        if ends is None:
            why = f"no interval: {without or 'not computed'}"
            return Cell(shown(value), self.mark(why), why)
        return Cell(shown(value), interval=between(*ends, told or shown, unit) + ("*" if star else ""))

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
