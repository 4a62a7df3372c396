"""The windows can be read: contrast as it is painted, and no text cut off at any size of type."""

import re

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QFontMetricsF
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QLineEdit,
    QListWidget,
    QProgressBar,
    QRadioButton,
    QScrollArea,
    QStyleFactory,
    QTabBar,
    QTableWidget,
    QTableWidgetItem,
    QWidget,
)

from daq_app.analyst import state as m
from daq_app.analyst.frame import FIELD_CHOICES
from daq_app.analyst.state import selected_row
from daq_app.qt import tokens
from daq_app.qt.analyst_window import AnalystWindow
from daq_app.qt.finger_canvas import FingerCanvas
from daq_app.qt.live_panel import AXIS_PLOTS, PLOTS
from daq_app.qt.live_plot import LivePlot
from daq_app.qt.main_window import MainWindow
from daq_app.qt.plots import ZoomedPlot
from daq_app.qt.rooms import about_box
from daq_app.qt.subject_picture import SubjectPreview
from daq_app.qt.subject_window import SubjectWindow
from daq_app.qt.tokens import FY
from daq_app.window.course_state import Judged, Mark
from daq_app.window.live_model import ModelText
from daq_app.window.live_trace import CHANNELS, Columns
from daq_app.window.new_session import SessionForm
from daq_app.window.subject import preview, translator
from daq_app.window.view import derive_view
from sessions.plan.protocols.protocol import protocol, protocol_names
from tests.daq_app.qt.painted_text import contrast, cut_or_colliding, painted_texts
from tests.daq_app.qt.review.examples import SESSION, Nobody, film
from tests.daq_app.qt.written_text import ROUNDING, cut_off
from tests.daq_app.session_messages import BAD, CLOSING, MOUNT, PAUSED, SCORE, after
from tests.sessions.report_example import example

pytestmark = pytest.mark.qt
PACE = 1.0  # no test here waits for a session
SCREENS = [(1366, 768), (1920, 1080), (3840, 2160)]
SMALL_WINDOW = (900, 560)  # of the subject
SCALES = [1.0, 1.5, 2.0]
SLOW = pytest.mark.slow
DOCUMENT_MARGIN = 4  # around the name of an axis [px]
LONGEST_FIELD = max(range(len(FIELD_CHOICES)), key=lambda at: len(FIELD_CHOICES[at].axis))
MODEL_SAYS = (
    "PROVISIONAL  SED 12.34 kPa; mesh, model: no estimate · at the measured force, 2.1 mm deep · small strain",
    "No full solve at finite strain · shown live 11.98 kPa. The load path turns back before the force is reached. "
    "Shown is the last state that was followed, 2.1 mm deep; ⊗ marks its most squeezed tissue.",
)
QUICK_SIZES = [(SCREENS[0], SCALES[0]), (SCREENS[0], SCALES[-1])]
LANGUAGES = ["en", "de", "fr", "ja", "ar"]
# Where a page has least room in every language, and the smallest screen in the one with the longest words.
QUICK_PAGES = [(SMALL_WINDOW, SCALES[-1], language) for language in LANGUAGES] + [(SCREENS[0], SCALES[-1], "de")]
QUICK = [(SCREENS[0], SCALES[0], False), (SCREENS[0], SCALES[-1], True)]  # where a text has least room


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

    def show(widget, palette=tokens.palette):
        widget.setStyle(fusion)
        widget.setPalette(palette(request.param))
        widget.setStyleSheet(tokens.style_sheet(request.param))
        widget.show()
        application.processEvents()

    return show


@pytest.mark.parametrize("make", [lambda: _list("HHHH 12"), lambda: _cells("", "HHHH 12")], ids=["list", "table"])
def test_a_selected_row_can_be_read_in_both_themes(themed, make):
    widget = make()
    row = widget.model().index(0, 0)
    widget.setCurrentIndex(row)
    widget.resize(200, 120)
    themed(widget)
    assert painted_contrast(widget.viewport(), widget.visualRect(row)) >= 4.5


def test_the_chosen_row_of_an_open_list_can_be_read_in_both_themes(themed, application):
    widget = QComboBox()
    widget.addItems(["HHHH 12", "HHHH 34"])
    themed(widget)
    widget.showPopup()
    application.processEvents()
    rows = widget.view()
    box = rows.visualRect(rows.model().index(0, 0))
    assert painted_contrast(rows.viewport(), box.adjusted(1, 1, -1, -1)) >= 4.5
    widget.hidePopup()


@pytest.mark.parametrize("kind", [QCheckBox, QRadioButton])
def test_the_outline_of_what_can_be_ticked_stands_out_in_both_themes(themed, kind):
    widget = kind()
    widget.resize(60, 30)
    themed(widget, tokens.tick_palette)
    assert painted_contrast(widget, widget.rect()) >= 3.0  # WCAG 2.1, 1.4.11


@pytest.mark.usefixtures("application")
def test_review_can_be_read_after_the_theme_was_changed_while_a_session_is_open(themed):
    window = AnalystWindow(SESSION, tokens.LIGHT, Nobody())
    window.take(m.ReportReady("predicted", example()))
    words = window.stroke.stroke._plots[0].readout
    words.setText("HHHH 12")
    words.adjustSize()
    themed(window)
    words.show()
    assert painted_contrast(words, words.rect()) >= 4.5
    ground = window.grab().toImage().pixelColor(2, 2).name()
    assert {contrast(colour, ground) >= 4.5 for colour in re.findall("#[0-9a-f]{6}", window.lineage.text())} == {True}
    window.close()


@pytest.mark.parametrize("part", [0, 100])
def test_the_progress_bar_can_be_read_empty_and_full(themed, part):
    bar = QProgressBar()
    bar.resize(140, 30)
    bar.setValue(part)
    themed(bar)
    assert painted_contrast(bar, bar.rect().adjusted(4, 4, -4, -4)) >= 4.5


LONG = "a text that is longer than its room"


def _tabs():
    bar = QTabBar()
    bar.setUsesScrollButtons(False)
    bar.setElideMode(Qt.TextElideMode.ElideRight)
    bar.addTab(LONG)
    bar.addTab(LONG)
    return bar


def _cells(head, cell):
    table = QTableWidget(1, 1)
    table.setHorizontalHeaderLabels([head])
    table.setItem(0, 0, QTableWidgetItem(cell))
    table.setColumnWidth(0, 60)
    return table


def _list(text):
    widget = QListWidget()
    widget.addItem(text)
    return widget


def _field():
    field = QLineEdit()
    field.setPlaceholderText(LONG)
    return field


@pytest.mark.parametrize(
    ("make", "room"),
    [
        (lambda: _list(LONG), 300),
        (_field, 300),
        (_tabs, 600),
        (lambda: _cells(LONG, ""), 0),
        (lambda: _cells("", LONG), 0),
    ],
    ids=["row", "example", "tab", "head", "cell"],
)
@pytest.mark.usefixtures("application")
def test_a_row_an_example_a_tab_a_head_and_a_cell_are_noticed_where_they_are_cut(make, room):
    window = QWidget()
    widget = make()
    widget.setParent(window)
    window.resize(800, 200)
    widget.resize(100, 100)
    window.show()
    assert [text for text, *_ in cut_off(window)].count(LONG) >= 1
    widget.resize(room or 700, 100)
    if isinstance(widget, QTableWidget):
        widget.setColumnWidth(0, 600)
    assert [text for text, *_ in cut_off(window) if text == LONG] == []


@pytest.fixture
def windows(driver, type_size):
    """Return a function that makes the experimenter's window in a theme and at a size of type."""
    open_windows, bridge = [], driver.window.bridge

    def make(size, scale, theme):
        type_size(scale)
        window = MainWindow(bridge)
        open_windows.append(window)
        window.setStyleSheet(tokens.style_sheet(theme))
        window.resize(*size)
        window.show()
        settle(driver.application)
        assert (window.width(), window.height()) == size
        return window

    yield make
    bridge.blockSignals(False)
    for window in open_windows:
        bridge.changed.disconnect(window.show_view)
        bridge.frame.disconnect(window._draw)
        for widget in (window.subject, window):
            widget.hide()
            widget.deleteLater()


def settle(application):
    for _ in range(5):
        application.processEvents()


@pytest.mark.parametrize(
    ("size", "scale", "theme"),
    [
        pytest.param(size, scale, theme, marks=[] if (size, scale, theme is tokens.DARK) in QUICK else SLOW)
        for size in SCREENS
        for scale in SCALES
        for theme in (tokens.LIGHT, tokens.DARK)
    ],
)
def test_no_text_of_prepare_run_keys_and_preview_is_cut_off(driver, windows, size, scale, theme):
    window = windows(size, scale, theme)
    assert all(value.isVisible() for value in window.live.bar.values.values())
    for panel in (window.page, window.bench):
        (area,) = panel.findChildren(QScrollArea)
        assert not panel.isVisible() or area.horizontalScrollBar().maximum() == 0
    assert cut_off(window) == []
    window.act("keys")
    settle(driver.application)
    assert cut_off(window.keys) == []
    window.act("keys")
    window.act("preview")
    (subject_preview,) = window.findChildren(SubjectPreview)
    for row in range(subject_preview.list.count()):
        subject_preview.list.setCurrentRow(row)
        settle(driver.application)
        assert cut_off(subject_preview) == []
    subject_preview.close()
    window.bridge.blockSignals(True)
    window.live.bar.hold.click()
    for messages in (MOUNT, (*SCORE, Judged(1, 1, BAD)), PAUSED, CLOSING):
        window.show_view(derive_view(after(*messages)))
        for words in MODEL_SAYS:
            window.live.finger.show_model(None, np.empty(0), ModelText(words, "failed"), 0.0)
            window.live.toggle_drawer()
            settle(driver.application)
            assert cut_off(window) == []
            assert (window.width(), window.height()) == size


@pytest.mark.parametrize(
    ("size", "scale"),
    [
        pytest.param(size, scale, marks=[] if (size, scale) in QUICK_SIZES else SLOW)
        for size in SCREENS
        for scale in SCALES
    ],
)
def test_no_text_of_review_and_about_is_cut_off(application, type_size, size, scale):
    type_size(scale)
    window = AnalystWindow(SESSION, tokens.LIGHT, Nobody())
    window.setStyleSheet(tokens.style_sheet(tokens.LIGHT))
    window.resize(*size)
    window.show()
    window.take(m.ReportReady("predicted", example()))
    window.take(m.FingerHistory(selected_row(window.state).key, film()))
    window.take(m.OtherSession(example()))
    about = about_box(window)
    about.show()
    for column in range(3):
        window._go_to(column)
        for at in range(4 if column == 2 else 3 if column == 1 else 1):
            tabs = {1: window.stroke.tabs, 2: window.model.tabs}.get(column)
            if tabs is not None:
                tabs.setCurrentIndex(at)
            window.model.fields.field_choice.setCurrentIndex(LONGEST_FIELD)
            settle(application)
            assert cut_off(window) == []
            assert cut_axes(window) == []
            assert [scrolled.width() for scrolled in window._areas if is_too_narrow(scrolled)] == []
    assert cut_off(about) == []
    about.close()
    window.close()


def is_too_narrow(scrolled):
    """Say whether a column that is seen is wider than what is seen of it."""
    return scrolled.isVisible() and scrolled.horizontalScrollBar().maximum() > 0


def cut_axes(window):
    """Return every name of an axis that is longer than its axis, or lies on its numbers."""
    faults = []
    for plot in window.findChildren(ZoomedPlot):
        across = plot.getPlotItem().getAxis("bottom")
        numbers = across.style["tickTextOffset"][1] + QFontMetricsF(across.style["tickFont"]).ascent()
        if plot.isVisible() and across.label.isVisible() and across.label.y() + DOCUMENT_MARGIN < numbers:
            faults.append((across.labelText, across.label.y(), numbers))
        for side in ("left", "bottom") if plot.isVisible() else ():
            axis = plot.getPlotItem().getAxis(side)
            room = axis.size().height() if side == "left" else axis.size().width()
            if axis.label.isVisible() and axis.label.boundingRect().width() > room + ROUNDING:
                faults.append((axis.labelText, axis.label.boundingRect().width(), room))
    for canvas in window.findChildren(FingerCanvas):
        axis = canvas._bar.getAxis("bottom")
        place = axis.label.mapRectToParent(axis.label.boundingRect())
        if canvas.isVisible() and (
            place.left() < -DOCUMENT_MARGIN or place.right() > axis.size().width() + DOCUMENT_MARGIN
        ):
            faults.append((axis.labelText, place, axis.size()))
    return faults


@pytest.mark.parametrize(
    ("size", "scale", "language"),
    [
        pytest.param(size, scale, language, marks=[] if (size, scale, language) in QUICK_PAGES else SLOW)
        for size in (SMALL_WINDOW, *SCREENS)
        for scale in SCALES
        for language in LANGUAGES
    ],
)
def test_no_text_that_the_subject_sees_is_cut_off(application, type_size, size, scale, language):
    type_size(scale)
    window = SubjectWindow(lambda: 0.0)
    window.setStyleSheet(tokens.style_sheet(tokens.LIGHT))
    window.resize(*size)
    window.show()
    for name in protocol_names():
        form = SessionForm(protocol=name, language=language if language in protocol(name).languages else "")
        for page in preview(form, translator(form.language or "en")):
            window.show_view(page.view, None)
            window.next.setVisible(page.view.asks)
            settle(application)
            assert cut_off(window) == [], page.name
    window.hide()
    window.deleteLater()


@pytest.mark.usefixtures("application")
def test_the_words_of_a_lift_and_of_the_next_onset_never_lie_on_each_other():
    plot = LivePlot(*PLOTS[0])
    plot.resize(220, 160)
    time = np.linspace(0.0, 10.0, 50)
    for gap in np.linspace(0.1, 4.0, 40):
        marks = [Mark("onset", 2.5, 2.5), Mark("lift", 4.0, 4.0), Mark("onset", 4.0 + gap, 4.0 + gap)]
        plot.show_columns(Columns(time, np.zeros((len(CHANNELS), 50))), 10.0, marks, 0.0)
        assert not cut_or_colliding(plot)
    assert [text.words for text in painted_texts(plot)].count("onset") == 2


@pytest.mark.usefixtures("application")
@pytest.mark.parametrize("height", [90, 160])
def test_the_names_of_a_plot_hide_nothing_of_its_curves(height):
    plot = LivePlot(*AXIS_PLOTS[1])  # three dashed torques, named at the left end
    plot.resize(240, height)
    time = np.linspace(0.0, 10.0, 200)
    values = np.zeros((len(CHANNELS), 200))
    values[CHANNELS.index("Ty")] = 50.0  # along the upper edge
    plot.show_columns(Columns(time, values), 10.0, [], 0.0)
    names = [text.place for text in painted_texts(plot) if text.words in ("Tx", "Ty", "Tz")]
    picture, colour = plot.grab().toImage(), QColor(FY)
    rows = [
        y
        for y in range(picture.height())
        for x in range(picture.width() - 40, picture.width())  # right of the names
        if picture.pixelColor(x, y) == colour
    ]
    assert len(names) == 3
    assert rows
    assert min(rows) >= max(place.bottom() for place in names) - 1
