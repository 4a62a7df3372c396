"""The windows can be read: contrast as it is painted, and no text cut off at any size of type."""

import pytest
from PySide6.QtGui import QColor
from PySide6.QtWidgets import (
    QLabel,
    QListWidget,
    QProgressBar,
    QStyleFactory,
    QTableWidget,
    QTableWidgetItem,
    QTreeWidget,
)

from daq_app.qt import tokens
from daq_app.qt.main_window import MainWindow
from daq_app.qt.parts import Shortened
from tests.daq_app.qt.test_window_for_everybody import contrast

pytestmark = pytest.mark.qt
PACE = 1.0  # no test here waits for a session
SCREENS = [(1366, 768), (1920, 1080), (3840, 2160)]
SCALES = [1.0, 1.5, 2.0]
TIGHTEST = [(SCREENS[0], SCALES[0]), (SCREENS[0], SCALES[-1])]  # where a label has least room


def painted_contrast(widget, box):
    """Contrast of what is written in a part of a widget: of its commonest colour and that which stands out most."""
    image = widget.grab().toImage()
    counts = {}
    for x in range(box.left() + 2, box.right() - 1):
        for y in range(box.top() + 2, box.bottom() - 1):
            name = image.pixelColor(x, y).name()
            counts[name] = counts.get(name, 0) + 1
    ground = max(counts, key=lambda name: counts[name])
    return max(contrast(ground, name) for name in counts)


@pytest.fixture(params=[tokens.LIGHT, tokens.DARK], ids=["light", "dark"])
def themed(application, request):
    """Return a function that shows a widget in a theme; the other windows of this process keep theirs."""
    fusion = QStyleFactory.create("Fusion")

    def shown(widget):
        widget.setStyle(fusion)
        widget.setPalette(tokens.palette(request.param))
        widget.setStyleSheet(tokens.style_sheet(request.param, 1.0))
        widget.show()
        application.processEvents()

    return shown


@pytest.mark.parametrize("kind", [QListWidget, QTableWidget, QTreeWidget])
def test_a_selected_row_can_be_read_in_both_themes(themed, kind):
    widget = kind()
    if kind is QListWidget:
        widget.addItem("HHHH 12")
        widget.setCurrentRow(0)
    elif kind is QTableWidget:
        widget.setRowCount(1)
        widget.setColumnCount(1)
        widget.setItem(0, 0, QTableWidgetItem("HHHH 12"))
        widget.selectRow(0)
    else:
        from PySide6.QtWidgets import QTreeWidgetItem

        widget.setHeaderHidden(True)
        widget.addTopLevelItem(QTreeWidgetItem(["HHHH 12"]))
        widget.setCurrentItem(widget.topLevelItem(0))
    widget.resize(200, 120)
    themed(widget)
    box = widget.visualItemRect(widget.item(0, 0) if kind is QTableWidget else widget.itemAt(30, 10))
    box = box.translated(widget.viewport().mapTo(widget, box.topLeft() * 0))
    assert painted_contrast(widget, box) >= 4.5


@pytest.mark.parametrize("part", [0, 100])
def test_the_progress_bar_can_be_read_empty_and_full(themed, part):
    bar = QProgressBar()
    bar.resize(140, 30)
    bar.setValue(part)
    themed(bar)
    assert painted_contrast(bar, bar.rect().adjusted(4, 4, -4, -4)) >= 4.5


def cut_off(window):
    """Return the texts of labels that are shown smaller than their text needs."""
    found = []
    for shown in window.findChildren(QLabel):
        if not shown.isVisible() or not shown.text() or isinstance(shown, Shortened):
            continue
        needed = shown.sizeHint().width() if not shown.wordWrap() else 0
        high = shown.heightForWidth(shown.width()) if shown.wordWrap() else shown.sizeHint().height()
        if shown.width() < needed or shown.height() < high:
            found.append((shown.text(), shown.size().toTuple(), (needed, high)))
    return found


@pytest.mark.parametrize(
    ("size", "scale"),
    [
        pytest.param(size, scale, marks=[] if (size, scale) in TIGHTEST else pytest.mark.slow)
        for size in SCREENS
        for scale in SCALES
    ],
)
def test_no_label_is_cut_off_and_every_live_number_is_there(driver, size, scale):
    application = driver.application
    window = MainWindow(driver.window.bridge, tokens.LIGHT, scale)
    window.setStyleSheet(tokens.style_sheet(tokens.LIGHT, scale))
    try:
        window.resize(*size)
        window.show()
        for _ in range(3):
            application.processEvents()
        assert (window.width(), window.height()) == size
        assert all(value.isVisible() for value in window.live.bar.values.values())
        assert cut_off(window) == []
    finally:
        driver.window.bridge.changed.disconnect(window.show_view)
        driver.window.bridge.frame.disconnect(window._draw)
        window.hide()
        window.deleteLater()
        assert QColor(tokens.LIGHT.text).isValid()
