"""Tables whose ranges are copied with Ctrl+C, and one of texts that sorts and says which line was chosen."""

from collections.abc import Sequence

from PySide6.QtCore import QModelIndex, QPersistentModelIndex, QSortFilterProxyModel, Qt, Signal
from PySide6.QtGui import QGuiApplication, QKeyEvent, QKeySequence, QStandardItem, QStandardItemModel
from PySide6.QtWidgets import QAbstractItemView, QTableView

from daq_app.analyst.table_text import as_tsv, number_in, sort_key

Index = QModelIndex | QPersistentModelIndex


class CopiedTable(QTableView):
    """A table that is read; Ctrl+C copies the selected range as tab-separated values."""

    def __init__(self, name: str) -> None:
        """Show no line yet; screen readers say `name`."""
        super().__init__()
        self.setAccessibleName(name)
        self.setTabKeyNavigation(False)
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setSelectionMode(QAbstractItemView.SelectionMode.ExtendedSelection)
        self.verticalHeader().hide()

    def keyPressEvent(self, event: QKeyEvent) -> None:  # noqa: N802  Qt's name
        """Copy; leave every other key to the table."""
        if event.matches(QKeySequence.StandardKey.Copy):
            QGuiApplication.clipboard().setText(self.selected_text())
        else:
            super().keyPressEvent(event)

    def selected_text(self) -> str:
        """Return the least rectangle of cells that holds the selection; empty where a cell in it is not selected."""
        chosen = {(at.row(), at.column()): str(at.data()) for at in self.selectedIndexes()}
        if not chosen:
            return ""
        rows, columns = ({place[part] for place in chosen} for part in (0, 1))
        return as_tsv(
            [chosen.get((row, column), "") for column in range(min(columns), max(columns) + 1)]
            for row in range(min(rows), max(rows) + 1)
        )


class _ByNumber(QSortFilterProxyModel):
    """Sorts numbers by their value, whatever stands after them."""

    def lessThan(self, left: Index, right: Index) -> bool:  # noqa: N802  Qt's name
        """Say which of two cells comes first."""
        return sort_key(str(left.data())) < sort_key(str(right.data()))


class TextTable(CopiedTable):
    """Lines of cells under a head; a click on the head sorts, and a line is told when somebody goes to it."""

    chosen = Signal(int)  # its number before any sorting

    def __init__(self, name: str, head: Sequence[str]) -> None:
        """Show no line yet; screen readers say `name`."""
        super().__init__(name)
        self._shown: tuple[tuple[str, ...], ...] = ()
        self._cells = QStandardItemModel(0, len(head), self)
        self._cells.setHorizontalHeaderLabels(list(head))
        self._sorted = _ByNumber(self)
        self._sorted.setSourceModel(self._cells)
        self.setModel(self._sorted)
        self.horizontalHeader().setSortIndicator(-1, Qt.SortOrder.AscendingOrder)  # as the session has them
        self.setSortingEnabled(True)
        self.selectionModel().currentRowChanged.connect(self._went)

    def show_lines(self, lines: tuple[tuple[str, ...], ...], at: int = -1) -> None:
        """Show lines, and stand at one of them."""
        self.selectionModel().blockSignals(True)
        if lines != self._shown:
            self._shown = lines
            self._cells.setRowCount(0)
            for cells in lines:
                self._cells.appendRow([_item(words) for words in cells])
            self.resizeColumnsToContents()
        self.selectionModel().blockSignals(False)
        now = self._sorted.mapToSource(self.currentIndex())
        if 0 <= at < len(lines) and at != now.row():
            self.blockSignals(True)
            self.go_to(at, max(now.column(), 0))
            self.blockSignals(False)

    def go_to(self, line: int, column: int = 0) -> None:
        """Stand at a cell of a line, which is numbered as before any sorting."""
        self.setCurrentIndex(self._sorted.mapFromSource(self._cells.index(line, column)))

    def texts(self) -> list[tuple[str, ...]]:
        """Return the lines as they are sorted now."""
        model = self._sorted
        return [
            tuple(str(model.index(row, column).data()) for column in range(model.columnCount()))
            for row in range(model.rowCount())
        ]

    def _went(self, now: QModelIndex, _before: QModelIndex) -> None:
        if now.isValid():
            self.chosen.emit(self._sorted.mapToSource(now).row())


def _item(words: str) -> QStandardItem:
    item = QStandardItem(words)
    if number_in(words) is not None or words == "–":
        item.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
    return item
