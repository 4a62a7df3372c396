"""Two sessions side by side: a table of their numbers, and a picture of them."""

from collections.abc import Callable, Sequence

from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout, QWidget

from daq_app.analyst.compared import NAMES, ComparedRow
from daq_app.qt.parts import bare, button, label, say
from daq_app.qt.picture_view import PictureView, Save
from daq_app.qt.text_table import TextTable
from daq_app.wording import tr

PICTURE = "compared"  # its name


class ComparedView(QWidget):
    """Offers to open a second session, and shows what came of it."""

    def __init__(self, choose: Callable[[], object], save: Save) -> None:
        """Show nothing yet."""
        super().__init__()
        self.words = label("", "quiet", wrap=True)
        self.choose = button(tr("Compare with…"), tr("compare with another session"), choose)
        head = (tr("stimulus"), *(f"{tr(name)} {part}" for name in NAMES for part in ("A", "B", "B − A")))
        self.table = TextTable(tr("two sessions compared"), head)
        self.table.setMinimumHeight(130)
        self.picture = PictureView(tr("the picture of both sessions"), save)
        top = QHBoxLayout()
        top.addWidget(self.words, 1)
        top.addWidget(self.choose)
        layout = bare(QVBoxLayout(self))
        layout.addLayout(top)
        layout.addWidget(self.table, 1)
        layout.addWidget(self.picture, 2)
        self.show_rows((), ("", ""))

    def show_rows(self, rows: Sequence[ComparedRow], sessions: tuple[str, str]) -> None:
        """Show the stimuli of two sessions, by their names."""
        there = bool(sessions[1])
        named = "\n".join(f"{name}: {session}" for name, session in zip("AB", sessions, strict=True))
        say(self.words, named if there else tr("No second session is open."))
        self.table.setVisible(there)
        self.picture.setVisible(there)
        lines: list[tuple[str, ...]] = []
        for row in rows:
            cells = [f"{row.experiment} {row.index}"]
            for name, pair in zip(NAMES, row.pairs, strict=True):
                digits = 1 if name == "score" else 3
                cells += [_number(value, digits) for value in (pair.first, pair.second)]
                cells.append(_number(pair.difference, digits, sign=True))
            lines.append(tuple(cells))
        self.table.show_lines(tuple(lines))


def _number(value: float | None, digits: int, *, sign: bool = False) -> str:
    if value is None:
        return "–"
    return f"{value:+.{digits}f}".replace("-", "−") if sign else f"{value:.{digits}f}"
