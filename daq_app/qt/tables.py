"""Tables with Ctrl+C for ranges: texts, sorted by a click on a column heading, and raw readings."""

import re
from collections.abc import Iterable, Sequence
from typing import Any

from PySide6.QtCore import (
    QAbstractTableModel,
    QModelIndex,
    QPersistentModelIndex,
    QSignalBlocker,
    QSortFilterProxyModel,
    Qt,
    Signal,
)
from PySide6.QtGui import QFont, QGuiApplication, QKeyEvent, QKeySequence, QShowEvent, QStandardItem, QStandardItemModel
from PySide6.QtWidgets import QAbstractItemView, QTableView, QWidget

from daq_app.analyst.stroke import RawReadings
from daq_app.qt.layout import vbox
from daq_app.qt.parts import WrappedLabel
from daq_app.qt.tokens import GRID
from daq_app.wording import tr, tr_noop

_NUMBER = re.compile(r"[-−+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?", re.IGNORECASE)
Index = QModelIndex | QPersistentModelIndex
_COLUMNS = tr_noop(("window", "sequence", "counter", "status", "time [s]", "received [ns]"))


class CopyableTable(QTableView):
    """A read-only table; Ctrl+C copies the selected range as tab-separated values."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self.setTabKeyNavigation(False)
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.verticalHeader().hide()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.matches(QKeySequence.StandardKey.Copy):
            QGuiApplication.clipboard().setText(self.selected_text())
        else:
            super().keyPressEvent(event)

    def selected_text(self) -> str:
        """Return the bounding rectangle of the selected cells as text, with unselected cells empty."""
        cells = {(cell.row(), cell.column()): str(cell.data()) for cell in self.selectedIndexes()}
        if not cells:
            return ""
        rows, columns = ({position[axis] for position in cells} for axis in (0, 1))
        return as_tsv(
            [cells.get((row, column), "") for column in range(min(columns), max(columns) + 1)]
            for row in range(min(rows), max(rows) + 1)
        )


class _ByNumber(QSortFilterProxyModel):
    """Sorts numbers by their value, ignoring any text after them."""

    def lessThan(self, left: Index, right: Index) -> bool:
        return sort_key(str(left.data())) < sort_key(str(right.data()))


class TextTable(CopyableTable):
    """A table of texts: a click on a column heading sorts by it, and `row_chosen` carries the current line."""

    row_chosen = Signal(int)  # line number before sorting

    def __init__(self, name: str, columns: Sequence[str]) -> None:
        super().__init__(name)
        self._texts: tuple[tuple[str, ...], ...] = ()
        self._cells = QStandardItemModel(0, len(columns), self)
        self._cells.setHorizontalHeaderLabels(list(columns))
        self._sorter = _ByNumber(self)
        self._sorter.setSourceModel(self._cells)
        self.setModel(self._sorter)
        self.horizontalHeader().setSortIndicator(-1, Qt.SortOrder.AscendingOrder)  # the session's order
        self.setSortingEnabled(True)
        self.selectionModel().currentRowChanged.connect(self._row_changed)

    def show_lines(self, lines: tuple[tuple[str, ...], ...], current: int = -1) -> None:
        if lines != self._texts:
            self._texts = lines
            with QSignalBlocker(self.selectionModel()):
                self._cells.setRowCount(0)
                right = [_is_of_numbers(column) for column in zip(*lines, strict=True)]
                for cells in lines:
                    self._cells.appendRow([_item(*cell) for cell in zip(cells, right, strict=True)])
                self.resizeColumnsToContents()
        now = self._sorter.mapToSource(self.currentIndex())
        if 0 <= current < len(lines) and current != now.row():
            with QSignalBlocker(self):
                self.go_to(current, max(now.column(), 0))

    def go_to(self, line: int, column: int = 0) -> None:
        """Go to a cell of a line, which is numbered as before sorting."""
        self.setCurrentIndex(self._sorter.mapFromSource(self._cells.index(line, column)))

    def _row_changed(self, now: QModelIndex, _previous: QModelIndex) -> None:
        if now.isValid():
            self.row_chosen.emit(self._sorter.mapToSource(now).row())


def _is_of_numbers(column: Sequence[str]) -> bool:
    """Say whether a column has only numbers, to be right-aligned: among long texts that would put them out of sight."""
    return all(number_in(text) is not None or text in ("", "–") for text in column)


def _item(text: str, right: bool) -> QStandardItem:
    item = QStandardItem(text)
    if right:
        item.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
    return item


class ReadingsTable(QWidget):
    """A table of readings, with their location in the file above it."""

    def __init__(self) -> None:
        super().__init__()
        self.caption = WrappedLabel("quiet")
        self.table = CopyableTable(tr("raw readings"))  # in order of arrival
        self.table.setSelectionBehavior(QTableView.SelectionBehavior.SelectRows)
        self._model = _Model()
        self.table.setModel(self._model)
        vbox(self.caption, (self.table, 1), on=self, margins=GRID)

    def show_readings(self, readings: RawReadings | None, steady: tuple[float, float] | None) -> None:
        """Show readings, with those of the steady window marked by a word and by bold type."""
        self._model.show_readings(readings, steady)
        self._fit_columns()
        text = tr("Not read yet.")
        if readings is not None:
            text = tr(
                "{place}. raw 1 to 6 as the device sent them [{unit}]; N and T unfiltered, zero taken off: {zero}.",
                place=readings.location, unit=readings.unit, zero=readings.zero,
            )  # fmt: skip
        self.caption.show_text(text)

    def _fit_columns(self) -> None:
        """Fit each column to its heading and a few of its lines, of which there may be a hundred thousand."""
        model, count = self._model, self._model.rowCount()
        metrics, heads = self.table.fontMetrics(), self.table.horizontalHeader().fontMetrics()
        for column in range(model.columnCount()):
            title_width = heads.horizontalAdvance(str(model.headerData(column, Qt.Orientation.Horizontal)))
            texts = [model.index(row, column).data() for row in (0, count // 2, count - 1) if 0 <= row < count]
            widest = max(title_width, *(metrics.horizontalAdvance(str(text)) for text in texts), 0)
            self.table.setColumnWidth(column, round(1.15 * widest) + 2 * GRID)  # steady readings are bold

    def showEvent(self, event: QShowEvent) -> None:
        """Fit the columns to the font, which is set by now."""
        self._fit_columns()

    def go_to(self, row: int) -> None:
        if 0 <= row < self._model.rowCount():
            self.table.selectRow(row)
            self.table.scrollTo(self._model.index(row, 0), QTableView.ScrollHint.PositionAtCenter)


class _Model(QAbstractTableModel):
    """Readings as a table model, read only where visible."""

    def __init__(self) -> None:
        super().__init__()
        self._readings: RawReadings | None = None
        self._steady: tuple[float, float] | None = None
        self._bold = QFont()
        self._bold.setBold(True)

    def show_readings(self, readings: RawReadings | None, steady: tuple[float, float] | None) -> None:
        self.beginResetModel()
        self._readings, self._steady = readings, steady
        self.endResetModel()

    def rowCount(self, parent: Index | None = None) -> int:
        return 0 if self._readings is None else len(self._readings.block)

    def columnCount(self, parent: Index | None = None) -> int:
        return len(_COLUMNS) + 8

    def headerData(self, section: int, orientation: Qt.Orientation, role: int = 0) -> Any:  # noqa: ANN401
        if role != Qt.ItemDataRole.DisplayRole or orientation != Qt.Orientation.Horizontal:
            return None
        channel = section - len(_COLUMNS) + 1
        if channel < 1:
            return tr(_COLUMNS[section])
        return tr("raw {channel}", channel=channel) if channel <= 6 else ("N [N]", "T [N]")[channel - 7]

    def data(self, index: Index, role: int = 0) -> Any:  # noqa: ANN401  the type depends on the role
        readings = self._readings
        if readings is None:
            return None
        row, block = index.row(), readings.block
        inside = self._steady is not None and self._steady[0] <= block.time[row] <= self._steady[1]
        match role:
            case Qt.ItemDataRole.FontRole:
                return self._bold if inside else None
            case Qt.ItemDataRole.TextAlignmentRole:
                return int(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
            case Qt.ItemDataRole.DisplayRole:
                counts = (column[row] for column in (block.sequence, block.counter, block.status))
                times = (f"{block.time[row]:.6f}", block.received_ns[row])
                raw = (f"{number:.10g}" for number in block.raw[row])
                forces = (f"{readings.normal[row]:.4f}", f"{readings.tangential[row]:.4f}")
                return str((tr("steady") if inside else "", *counts, *times, *raw, *forces)[index.column()])
            case _:
                return None


def number_in(text: str) -> float | None:
    """Return the number at the beginning of a text, or None.

    >>> number_in("0.440 to 0.453"), number_in("−3.5 %"), number_in("–"), number_in("stroke 3")
    (0.44, -3.5, None, None)
    """
    match = _NUMBER.match(text.strip())
    return None if match is None else float(match[0].replace("−", "-"))


def sort_key(text: str) -> tuple[bool, float, str]:
    """Return the sort key of a cell: numbers by value, then words.

    >>> sorted(["10", "9.5", "–", "−1"], key=sort_key)
    ['−1', '9.5', '10', '–']
    """
    number = number_in(text)
    return number is None, 0.0 if number is None else number, text.casefold()


def as_tsv(lines: Iterable[Iterable[str]]) -> str:
    r"""Return cells as tab-separated values; a tab or a newline within a cell becomes a space.

    >>> as_tsv([["a", "b\tc"], ["1", "2"]])
    'a\tb c\n1\t2'
    """
    return "\n".join("\t".join(re.sub(r"[\t\r\n]+", " ", cell) for cell in line) for line in lines)
