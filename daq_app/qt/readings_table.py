"""The readings of a stroke's trial as they were recorded, a line each."""

from typing import Any

from PySide6.QtCore import QAbstractTableModel, QModelIndex, QPersistentModelIndex, Qt
from PySide6.QtGui import QFont, QShowEvent
from PySide6.QtWidgets import QHeaderView, QTableView, QVBoxLayout, QWidget

from daq_app.analyst.raw import RawReadings
from daq_app.qt.parts import Wrapped, bare
from daq_app.qt.text_table import CopiedTable
from daq_app.qt.tokens import GRID
from daq_app.wording import tr, tr_noop

HEAD = (
    tr_noop("window"),
    tr_noop("sequence"),
    tr_noop("counter"),
    tr_noop("status"),
    tr_noop("time [s]"),
    tr_noop("received [ns]"),
)
Index = QModelIndex | QPersistentModelIndex


class ReadingsTable(QWidget):
    """A table with the place of its numbers above it."""

    def __init__(self) -> None:
        """Show nothing yet."""
        super().__init__()
        self.place = Wrapped("quiet")
        self.table = CopiedTable(tr("raw readings"))  # in the order in which they came
        self.table.setSelectionBehavior(QTableView.SelectionBehavior.SelectRows)
        self.table.horizontalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Interactive)
        self._model = _Model()
        self.table.setModel(self._model)
        layout = bare(QVBoxLayout(self))
        layout.addWidget(self.place)
        layout.addWidget(self.table, 1)

    def show_readings(self, readings: RawReadings | None, steady: tuple[float, float] | None) -> None:
        """Show readings, those of the steady window marked by a word and by bold type."""
        self._model.show_readings(readings, steady)
        if readings is None:
            self.place.show_text(tr("Not read yet."))
            self._fit_columns()
            return
        self.place.show_text(
            tr(
                ("{place}. raw 1 to 6 as the device sent them [{unit}]; N and T unfiltered, zero taken off: {zero}."),
                place=readings.place,
                unit=readings.unit,
                zero=readings.zero,
            )
        )
        self._fit_columns()

    def _fit_columns(self) -> None:
        """Make each column as wide as its head and a few of its lines need: there may be a hundred thousand."""
        model, count = self._model, self._model.rowCount()
        metrics, heads = self.table.fontMetrics(), self.table.horizontalHeader().fontMetrics()
        for column in range(model.columnCount()):
            head = heads.horizontalAdvance(str(model.headerData(column, Qt.Orientation.Horizontal)))
            texts = [model.index(row, column).data() for row in (0, count // 2, count - 1) if 0 <= row < count]
            widest = max(head, *(metrics.horizontalAdvance(str(text)) for text in texts), 0)
            self.table.setColumnWidth(column, round(1.15 * widest) + 2 * GRID)  # steady ones are bold

    def showEvent(self, event: QShowEvent) -> None:  # noqa: N802  Qt's name
        """Fit the columns to the type, which is known by now."""
        super().showEvent(event)
        self._fit_columns()

    def go_to(self, row: int) -> None:
        """Show one reading."""
        if 0 <= row < self._model.rowCount():
            self.table.selectRow(row)
            self.table.scrollTo(self._model.index(row, 0), QTableView.ScrollHint.PositionAtCenter)


class _Model(QAbstractTableModel):
    """Readings as a table, read only where they are shown."""

    def __init__(self) -> None:
        super().__init__()
        self._readings: RawReadings | None = None
        self._steady: tuple[float, float] | None = None
        self._bold = QFont()
        self._bold.setBold(True)

    def show_readings(self, readings: RawReadings | None, steady: tuple[float, float] | None) -> None:
        """Take other readings."""
        self.beginResetModel()
        self._readings, self._steady = readings, steady
        self.endResetModel()

    def rowCount(self, parent: Index | None = None) -> int:  # noqa: ARG002, N802  Qt's name
        """Return the number of readings."""
        return 0 if self._readings is None else len(self._readings)

    def columnCount(self, parent: Index | None = None) -> int:  # noqa: ARG002, N802  Qt's name
        """Return the number of columns."""
        return len(HEAD) + 8

    def headerData(self, section: int, orientation: Qt.Orientation, role: int = 0) -> Any:  # noqa: ANN401, N802
        """Return the name of a column."""
        if role != Qt.ItemDataRole.DisplayRole or orientation != Qt.Orientation.Horizontal:
            return None
        return (*map(tr, HEAD), *(tr("raw {channel}", channel=n) for n in range(1, 7)), "N [N]", "T [N]")[section]

    def data(self, index: Index, role: int = 0) -> Any:  # noqa: ANN401  whatever a role asks for
        """Return a number as text."""
        r = self._readings
        if r is None:
            return None
        at, column = index.row(), index.column()
        inside = self._steady is not None and self._steady[0] <= r.time[at] <= self._steady[1]
        if role == Qt.ItemDataRole.FontRole:
            return self._bold if inside else None
        if role == Qt.ItemDataRole.TextAlignmentRole:
            return int(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        if role != Qt.ItemDataRole.DisplayRole:
            return None
        match column:
            case 0:
                return tr("steady") if inside else ""
            case 1 | 2 | 3:
                return str((r.sequence, r.counter, r.status)[column - 1][at])
            case 5:
                return str(r.received_ns[at])
            case 4:
                return f"{r.time[at]:.6f}"
            case 12 | 13:
                return f"{(r.normal, r.tangential)[column - 12][at]:.4f}"
            case _:
                return f"{r.raw[at, column - 6]:.10g}"
