"""Every text of a window with the room that it has and that it needs: written by Qt's widgets, or painted by hand."""

from PySide6.QtCore import QRect, QSize, Qt
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractScrollArea,
    QAbstractSpinBox,
    QCheckBox,
    QComboBox,
    QHeaderView,
    QLabel,
    QLineEdit,
    QListView,
    QListWidget,
    QMenuBar,
    QProgressBar,
    QPushButton,
    QRadioButton,
    QSlider,
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
CONTROLS = (QAbstractButton, QComboBox, QLineEdit, QListWidget, QSlider)
WRAPPED = Qt.TextFlag.TextWordWrap
ELEMENTS = {
    QPushButton: QStyle.SubElement.SE_PushButtonContents,
    QCheckBox: QStyle.SubElement.SE_CheckBoxContents,
    QRadioButton: QStyle.SubElement.SE_RadioButtonContents,
}


def cut_off(window):
    """Return every text that has less room than it needs, or lies on another."""
    texts = []
    for widget in window.findChildren(QWidget):
        if widget.isVisible():
            texts += [text for text in texts_of(widget) if text[0] and is_less(*text[1:])]
            texts += cut_or_colliding(widget) if paints_by_hand(widget) else []
    return texts


def laid_over(window, parts):
    """Return the visible ones of some parts that reach beyond their window, or lie on another."""
    visible = [part for part in parts if part.isVisible()]
    boxes = [part.rect().translated(part.mapTo(window, part.rect().topLeft())) for part in visible]
    alone = [window.rect().contains(a) and sum(a.intersects(b) for b in boxes) == 1 for a in boxes]
    return [part for part, is_alone in zip(visible, alone, strict=True) if not is_alone]


def controls(window):
    """Return everything in a window that is used, without what Qt's own controls are made of."""
    widgets = [w for kind in CONTROLS for w in window.findChildren(kind)]
    inner = [w for w in widgets if isinstance(w.parent(), QComboBox | QAbstractScrollArea | QTabBar)]
    return [w for w in widgets if w not in inner]


def unreached_controls(window, reached):
    """Return the names of the controls to which Tab should have led and did not.

    Radio buttons of a group are one stop; arrows go on within it.
    """
    groups = [w.group() for w in reached if isinstance(w, QAbstractButton) and w.group() is not None]
    usable = [w for w in controls(window) if w.isVisible() and w.isEnabled()]
    stops = [w for w in usable if w.focusPolicy() & Qt.FocusPolicy.TabFocus and w not in reached]
    return [w.accessibleName() for w in stops if not (isinstance(w, QAbstractButton) and w.group() in groups)]


def is_less(room, need):
    return any(has + ROUNDING < needs for has, needs in zip(room, need, strict=True))


def texts_of(widget):
    """Return what is written in a widget: each text with the room that it has and that it needs [px]."""
    return next((texts(widget) for kind, texts in KINDS.items() if isinstance(widget, kind)), [])


def size_of(widget, text, width=None, font=None):
    """Return the width and height of a text as a widget writes it, broken into lines where a `width` is given."""
    metrics = widget.fontMetrics() if font is None else QWidget.fontMetrics(_in(font))
    if width is not None:
        return metrics.boundingRect(QRect(0, 0, max(width, 1), HIGHEST), WRAPPED, text).size().toTuple()
    lines = text.split("\n")
    return max(metrics.horizontalAdvance(line) for line in lines), metrics.height() * len(lines)


def _in(font):
    widget = QWidget()
    widget.setFont(font)
    return widget


def _label(widget):
    width = widget.sizeHint().width() if not widget.wordWrap() else 0
    high = widget.heightForWidth(widget.width()) if widget.wordWrap() else widget.sizeHint().height()
    return [(widget.text(), widget.size().toTuple(), (width, high))]


def _button(widget):
    option = QStyleOptionButton()
    widget.initStyleOption(option)
    element = next(element for kind, element in ELEMENTS.items() if isinstance(widget, kind))
    room = widget.style().subElementRect(element, option, widget).size().toTuple()
    return [(widget.text(), room, size_of(widget, widget.text().replace("&", "")))]


def _list_to_choose_from(widget):
    if widget.isEditable():  # its field is a `QLineEdit`
        return []
    option = QStyleOptionComboBox()
    widget.initStyleOption(option)
    field = QStyle.SubControl.SC_ComboBoxEditField
    room = widget.style().subControlRect(QStyle.ComplexControl.CC_ComboBox, option, field, widget).size().toTuple()
    return [(widget.currentText(), room, size_of(widget, widget.currentText()))]


def _field(widget):
    """Return what stands in a field that nobody types in, and the example in one that is empty."""
    option = QStyleOptionFrame()
    widget.initStyleOption(option)
    room = widget.style().subElementRect(QStyle.SubElement.SE_LineEditContents, option, widget).size()
    is_empty_example = not isinstance(widget.parentWidget(), QAbstractSpinBox)  # what is typed moves along
    text = widget.placeholderText() if is_empty_example else widget.text()
    return [(text, (room - QSize(2 * ENTRY_MARGIN, 0)).toTuple(), size_of(widget, text))]


def _heads(widget):
    """Return the names of columns, and of rows."""
    model, across = widget.model(), widget.orientation() == Qt.Orientation.Horizontal
    sections = [at for at in range(widget.count()) if not widget.isSectionHidden(at)]
    texts = []
    for at in sections:
        text = str(model.headerData(at, widget.orientation()) or "")
        room = (widget.sectionSize(at), widget.height()) if across else (widget.width(), widget.sectionSize(at))
        texts.append((text, room, size_of(widget, text)))
    return texts


def _rows(widget):
    """Return the rows of a list: one that is wider than the list is cut, for nobody scrolls a list to the right."""
    wide = widget.viewport().width()
    return [
        (str(at.data()), (wide, widget.visualRect(at).height()), widget.sizeHintForIndex(at).toTuple())
        for at in (widget.model().index(row, 0) for row in range(widget.model().rowCount()))
        if not widget.isRowHidden(at.row())
    ]


def _cells(widget):
    """Return the cells of a table; one that wraps its words is as wide as its column."""
    model, texts = widget.model(), []
    for at in (model.index(row, column) for row in range(model.rowCount()) for column in range(model.columnCount())):
        text, font = str(at.data() or ""), at.data(Qt.ItemDataRole.FontRole)
        room = widget.columnWidth(at.column()) - 2 * CELL_MARGIN, widget.rowHeight(at.row())
        if not widget.isColumnHidden(at.column()) and not widget.isRowHidden(at.row()):
            texts.append((text, room, size_of(widget, text, room[0] if widget.wordWrap() else None, font)))
    return texts


def _tabs(widget):
    return [
        (widget.tabText(at), widget.tabRect(at).intersected(widget.rect()).size().toTuple(), size_of(widget, text))
        for at in range(widget.count())
        for text in [widget.tabText(at).replace("&", "")]
    ]


def _menus(widget):
    return [
        (text, widget.actionGeometry(act).intersected(widget.rect()).size().toTuple(), size_of(widget, text))
        for act in widget.actions()
        for text in [act.text().replace("&", "")]
    ]


def _bar(widget):
    text = widget.text() if widget.isTextVisible() else ""
    return [(text, widget.size().toTuple(), size_of(widget, text))]


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
