"""Every text of a window with the room that it has and that it needs: written by Qt's widgets, or painted by hand."""

from PySide6.QtCore import QRect, QSize, Qt
from PySide6.QtWidgets import (
    QAbstractSpinBox,
    QCheckBox,
    QComboBox,
    QHeaderView,
    QLabel,
    QLineEdit,
    QListView,
    QMenuBar,
    QProgressBar,
    QPushButton,
    QRadioButton,
    QStyle,
    QStyleOptionButton,
    QStyleOptionComboBox,
    QStyleOptionFrame,
    QTabBar,
    QTableView,
    QWidget,
)

from tests.daq_app.qt.painted_text import cut_or_colliding, paints_by_hand

ROUNDING = 2  # by which Qt's own size of a button may fall short of its text; its padding is wider [px]
CELL_MARGIN = 3  # that Qt keeps on both sides of the text of a cell [px]
ENTRY_MARGIN = 2  # that `QLineEdit` keeps on both sides of its text [px]
HIGHEST = 10_000  # beyond any text [px]
WRAPPED = Qt.TextFlag.TextWordWrap
ELEMENTS = {
    QPushButton: QStyle.SubElement.SE_PushButtonContents,
    QCheckBox: QStyle.SubElement.SE_CheckBoxContents,
    QRadioButton: QStyle.SubElement.SE_RadioButtonContents,
}


def cut_off(window):
    """Return every text that has less room than it needs, or lies on another."""
    found = []
    for shown in window.findChildren(QWidget):
        if shown.isVisible():
            found += [one for one in texts_of(shown) if one[0] and is_less(*one[1:])]
            found += cut_or_colliding(shown) if paints_by_hand(shown) else []
    return found


def is_less(room, needed):
    return any(has + ROUNDING < needs for has, needs in zip(room, needed, strict=True))


def texts_of(shown):
    """Return what is written in a widget: each text with the room that it has and that it needs [px]."""
    return next((texts(shown) for kind, texts in KINDS.items() if isinstance(shown, kind)), [])


def size_of(shown, text, width=None, font=None):
    """Return the width and height of a text as a widget writes it, broken into lines where a `width` is given."""
    metrics = shown.fontMetrics() if font is None else QWidget.fontMetrics(_in(font))
    if width is not None:
        return metrics.boundingRect(QRect(0, 0, max(width, 1), HIGHEST), WRAPPED, text).size().toTuple()
    lines = text.split("\n")
    return max(metrics.horizontalAdvance(line) for line in lines), metrics.height() * len(lines)


def _in(font):
    made = QWidget()
    made.setFont(font)
    return made


def _label(shown):
    needed = shown.sizeHint().width() if not shown.wordWrap() else 0
    high = shown.heightForWidth(shown.width()) if shown.wordWrap() else shown.sizeHint().height()
    return [(shown.text(), shown.size().toTuple(), (needed, high))]


def _button(shown):
    option = QStyleOptionButton()
    shown.initStyleOption(option)
    element = next(element for kind, element in ELEMENTS.items() if isinstance(shown, kind))
    room = shown.style().subElementRect(element, option, shown).size().toTuple()
    return [(shown.text(), room, size_of(shown, shown.text().replace("&", "")))]


def _list_to_choose_from(shown):
    if shown.isEditable():  # its field is a `QLineEdit`
        return []
    option = QStyleOptionComboBox()
    shown.initStyleOption(option)
    field = QStyle.SubControl.SC_ComboBoxEditField
    room = shown.style().subControlRect(QStyle.ComplexControl.CC_ComboBox, option, field, shown).size().toTuple()
    return [(shown.currentText(), room, size_of(shown, shown.currentText()))]


def _field(shown):
    """Return what stands in a field that nobody types in, and the example in one that is empty."""
    option = QStyleOptionFrame()
    shown.initStyleOption(option)
    room = shown.style().subElementRect(QStyle.SubElement.SE_LineEditContents, option, shown).size()
    typed = not isinstance(shown.parentWidget(), QAbstractSpinBox)  # what is typed moves along
    text = shown.placeholderText() if typed else shown.text()
    return [(text, (room - QSize(2 * ENTRY_MARGIN, 0)).toTuple(), size_of(shown, text))]


def _heads(shown):
    """Return the names of columns, and of rows."""
    model, across = shown.model(), shown.orientation() == Qt.Orientation.Horizontal
    told = [at for at in range(shown.count()) if not shown.isSectionHidden(at)]
    found = []
    for at in told:
        text = str(model.headerData(at, shown.orientation()) or "")
        room = (shown.sectionSize(at), shown.height()) if across else (shown.width(), shown.sectionSize(at))
        found.append((text, room, size_of(shown, text)))
    return found


def _rows(shown):
    """Return the rows of a list: one that is wider than the list is cut, for nobody scrolls a list to the right."""
    wide = shown.viewport().width()
    return [
        (str(at.data()), (wide, shown.visualRect(at).height()), shown.sizeHintForIndex(at).toTuple())
        for at in (shown.model().index(row, 0) for row in range(shown.model().rowCount()))
        if not shown.isRowHidden(at.row())
    ]


def _cells(shown):
    """Return the cells of a table; one that wraps its words is as wide as its column."""
    model, found = shown.model(), []
    for at in (model.index(row, column) for row in range(model.rowCount()) for column in range(model.columnCount())):
        text, font = str(at.data() or ""), at.data(Qt.ItemDataRole.FontRole)
        room = shown.columnWidth(at.column()) - 2 * CELL_MARGIN, shown.rowHeight(at.row())
        if not shown.isColumnHidden(at.column()) and not shown.isRowHidden(at.row()):
            found.append((text, room, size_of(shown, text, room[0] if shown.wordWrap() else None, font)))
    return found


def _tabs(shown):
    return [
        (shown.tabText(at), shown.tabRect(at).intersected(shown.rect()).size().toTuple(), size_of(shown, text))
        for at in range(shown.count())
        for text in [shown.tabText(at).replace("&", "")]
    ]


def _menus(shown):
    return [
        (text, shown.actionGeometry(act).intersected(shown.rect()).size().toTuple(), size_of(shown, text))
        for act in shown.actions()
        for text in [act.text().replace("&", "")]
    ]


def _bar(shown):
    text = shown.text() if shown.isTextVisible() else ""
    return [(text, shown.size().toTuple(), size_of(shown, text))]


KINDS = {
    QLabel: _label,
    QPushButton: _button,
    QCheckBox: _button,
    QRadioButton: _button,
    QComboBox: _list_to_choose_from,
    QLineEdit: _field,
    QHeaderView: _heads,
    QListView: _rows,
    QTableView: _cells,
    QTabBar: _tabs,
    QMenuBar: _menus,
    QProgressBar: _bar,
}
