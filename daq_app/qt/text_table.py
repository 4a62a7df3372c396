"""A table of texts: choosing a line tells which."""

from collections.abc import Sequence

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QAbstractItemView, QTableWidget, QTableWidgetItem


class TextTable(QTableWidget):
    """Lines of cells under a head; a line is told when somebody goes to it."""

    told = Signal(int)

    def __init__(self, name: str, head: Sequence[str]) -> None:
        """Show no line yet; screen readers say `name`."""
        super().__init__(0, len(head))
        self._shown: tuple[tuple[str, ...], ...] = ()
        self.setAccessibleName(name)
        self.setTabKeyNavigation(False)
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.setHorizontalHeaderLabels(list(head))
        self.verticalHeader().hide()
        self.currentCellChanged.connect(self._went)

    def show_lines(self, lines: tuple[tuple[str, ...], ...], at: int = -1) -> None:
        """Show lines, and stand at one of them."""
        self.blockSignals(True)
        if lines != self._shown:
            self._shown = lines
            self.setRowCount(len(lines))
            for row, cells in enumerate(lines):
                for column, words in enumerate(cells):
                    self.setItem(row, column, QTableWidgetItem(words))
            self.resizeColumnsToContents()
        if 0 <= at < len(lines) and at != self.currentRow():
            self.setCurrentCell(at, max(self.currentColumn(), 0))
        self.blockSignals(False)

    def _went(self, row: int, _column: int, before: int, _before: int) -> None:
        if row >= 0 and row != before:
            self.told.emit(row)
