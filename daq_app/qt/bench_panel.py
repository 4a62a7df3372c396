"""The bench: transducer, health and loads; or, if space is short, its lamps."""

from collections.abc import Callable

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QComboBox, QPushButton, QSizePolicy, QWidget

from daq_app.qt.layout import hbox, scroll_area, vbox
from daq_app.qt.painting import Lamp
from daq_app.qt.parts import EntryLine, Panel, WrappedLabel, button, choice, label, label_grid, set_text
from daq_app.qt.tokens import GRID, px, theme_of
from daq_app.recorder.messages import AcknowledgeOverloads, Connect, Tare
from daq_app.window.live_feed import LOADS
from daq_app.window.state import Message
from daq_app.window.view_bench import HEALTH_NAMES, Bar, BenchView
from daq_app.wording import tr, tr_noop

SHOWN_COUNTERS = tr_noop(
    ("lost", "repeated", "late", "malformed", "stalled", "restarted", "saturated", "doubtful", "lag")
)

_FIELDS = tr_noop(("serial", "calibration", "rate", "tare", "drift"))
SPOKEN_NAMES = {"tare": tr_noop("mean of the zero"), "drift": tr_noop("drift of the zero")}  # full captions


class BenchPanel(Panel):
    """The right of the experimenter's window."""

    def __init__(self, send: Callable[[Message], None], search: Callable[[], None]) -> None:
        super().__init__(tr("bench"))
        self._send = send
        self._view: BenchView | None = None
        self._lamp = Lamp(tr("transducer"))
        self._lamp_label = label(tr("not connected"), wrap=True)
        self._fields = {name: label("–", wrap=True) for name in _FIELDS}
        self._fields["tare"].setProperty("role", "quiet")  # three lines that need not be read from afar
        self._life = {name: label("–", wrap=True) for name in HEALTH_NAMES}
        self._name = label("", "title", wrap=True)
        self._counters = {name: label("0") for name in SHOWN_COUNTERS}
        for count in self._counters.values():
            count.setAlignment(Qt.AlignmentFlag.AlignRight)
        self._bars = {name: LoadBar(name) for name in LOADS}
        self._choice = choice(tr("transducer to connect: choose one, or type its address"))
        self._choice.setEditable(True)
        self._choice.setLineEdit(EntryLine(lambda: self._leave(connecting=True), self._leave))
        self._choice.setInsertPolicy(QComboBox.InsertPolicy.NoInsert)  # only an address that answers is a device
        self._choice.setCompleter(None)  # pyrefly: ignore[bad-argument-type]  no completion
        self.search = button(tr("Search"), tr("search for transducers"), search)
        self.connect_button = button(tr("Connect"), tr("connect the chosen transducer"), self.connect_choice)
        self.tare = button(tr("Zero T"), tr("measure the zero of the bench"), lambda: send(Tare()))
        name = tr("acknowledge overloads, and watch for new ones")
        self.acknowledge = button(tr("Acknowledge A"), name, lambda: send(AcknowledgeOverloads()))
        self._search_label = label("", "quiet", wrap=True)
        vbox(self._build(), on=self, margins=2)

    def show_view(self, view: BenchView) -> None:
        previous, self._view = self._view, view
        if view == previous:
            return
        self._lamp.show_grade(view.lamp, view.lamp_text)
        set_text(self._lamp_label, view.lamp_text, grade=view.lamp if view.lamp in ("wrong", "look") else "")
        set_text(self._name, view.name)
        for name, widget in self._fields.items():
            set_text(widget, getattr(view, name), tr(SPOKEN_NAMES.get(name, name)))
        for name, text in view.life:
            set_text(self._life[name], text, tr(name))
        for name, text in view.counters:
            if name in self._counters:
                grade = "look" if name != "lag" and text != "0" else ""
                set_text(self._counters[name], text, tr(name), grade)
        for bar in view.bars:
            self._bars[bar.name].show_bar(bar)
        if previous is None or (previous.devices, previous.uri) != (view.devices, view.uri):
            self._show_devices(view)
        self.search.setText(tr("Searching") if view.searching else tr("Search"))
        self.search.setEnabled(not view.searching)
        set_text(self._search_label, view.search_text)
        self._search_label.setVisible(bool(view.search_text))
        show_connecting(self.connect_button, view)
        self._choice.setEnabled(view.lamp == "off")
        self.tare.setEnabled(view.can_tare)
        self.acknowledge.setEnabled(view.can_acknowledge)

    def connect_choice(self) -> None:
        """Connect the chosen or typed address, or disconnect the transducer."""
        view = self._view
        if view is not None and view.connect is not None:
            self._send(view.connect)
        elif uri := self._selected_uri():
            self._send(Connect(uri))
            self._show_begin()

    def _leave(self, *, connecting: bool = False) -> None:
        if connecting:
            self.connect_choice()
        self.window().setFocus()

    def _selected_uri(self) -> str:
        text = self._choice.currentText().strip()
        index = self._choice.findText(text)
        return text if index < 0 else str(self._choice.itemData(index))

    def _show_devices(self, view: BenchView) -> None:
        typed = self._selected_uri()
        self._choice.clear()
        for uri, description in view.devices:
            self._choice.addItem(description, uri)
        address = view.uri or typed or "sim:"
        index = self._choice.findData(address)
        self._choice.setCurrentIndex(index)
        if index < 0:
            self._choice.setEditText(address)
        self._show_begin()

    def _show_begin(self) -> None:
        if (typed_in := self._choice.lineEdit()) is not None:
            typed_in.setCursorPosition(0)  # the beginning of a long address shows the kind of transducer

    def _build(self) -> QWidget:
        inside, fields = QWidget(), self._fields
        vbox(
            self._name,
            hbox(vbox(self._lamp, 1), (self._lamp_label, 1)),
            self._choice,
            hbox((self.connect_button, 1), (self.search, 1)),
            self._search_label,
            label_grid((tr(name), fields[name]) for name in ("serial", "calibration", "rate")),
            label(tr("Load: share of the rated range, most since acknowledged, noise"), "section", wrap=True),
            vbox(*self._bars.values(), spacing=0),
            hbox((self.tare, 2), (self.acknowledge, 3)),
            label(tr("Readings since the stream began"), "section", wrap=True),
            label_grid(((tr(name), value) for name, value in self._counters.items()), 2),
            label(tr("Zero"), "section"),
            label_grid(((tr("mean"), fields["tare"]), (tr("drift"), fields["drift"]))),
            label(tr("This serial number, over its life here"), "section", wrap=True),
            label_grid((tr(name), value) for name, value in self._life.items()),
            1,
            on=inside,
            margins=(int(1.5 * GRID), GRID, int(1.5 * GRID), GRID),
            spacing=GRID,
        )
        return scroll_area(inside)


def show_connecting(push: QPushButton, view: BenchView) -> None:
    """Label the button Connect or Disconnect, and enable it if that is possible."""
    push.setText(tr("Connect") if view.lamp == "off" else tr("Disconnect"))
    push.setAccessibleName(tr("{act} the transducer", act=push.text()))
    push.setEnabled(view.lamp == "off" or view.connect is not None)


class BenchStrip(Panel):
    """The bench folded: a lamp, and a short bar for each axis."""

    def __init__(self, expand: Callable[[], None]) -> None:
        super().__init__(tr("bench, folded"), "strip")
        self._lamp = Lamp(tr("transducer"))
        self._bars = {name: LoadBar(name) for name in LOADS}
        self.setFixedWidth(px(150))
        self._status_label = WrappedLabel("quiet")
        lamp = hbox(self._lamp, (self._status_label, 1))
        vbox(button(tr("Bench  B"), tr("show the bench"), expand), lamp, *self._bars.values(), 1, on=self, margins=GRID)

    def show_view(self, view: BenchView) -> None:
        self._lamp.show_grade(view.lamp, view.lamp_text)
        self._status_label.show_text(view.lamp_text)
        for bar in view.bars:
            self._bars[bar.name].show_bar(bar)


class LoadBar(QWidget):
    """The present load of one axis, and its maximum since somebody acknowledged it."""

    NAME, NOISE = 86, 104  # widths of the words next to the bar, before the font's scale

    def __init__(self, name: str) -> None:
        super().__init__()
        self._bar = Bar(name, 0.0, 0.0, overloaded=False, noise="")
        self.setAccessibleName(tr("load on {name}", name=tr(name)))
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setFixedHeight(px(2.75 * GRID))

    def sizeHint(self) -> QSize:
        return QSize(px(200), self.height())

    def show_bar(self, bar: Bar) -> None:
        if bar == self._bar:
            return
        self._bar = bar
        now = tr("not known") if bar.share is None else tr("{share:.0f} % of the rated load", share=100 * bar.share)
        peak = "" if bar.peak is None else tr(", at most {peak:.0f} %", peak=100 * bar.peak)
        state = tr(", OVERLOAD") if bar.overloaded else ""
        noise = tr(", noise {noise}", noise=bar.noise) if bar.noise else ""
        self.setAccessibleName(tr("load on {name}: {words}", name=tr(bar.name), words=f"{now}{peak}{state}{noise}"))
        self.setToolTip(self.accessibleName())
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        t, bar = theme_of(self), self._bar
        painter = QPainter(self)
        left, right = px(self.NAME), px(self.NOISE)
        if self.width() < left + right + 40:
            right = 0
        colour = QColor(t.wrong if bar.overloaded else t.text)
        painter.setPen(colour)
        name = QRectF(0, 0, left - 4, self.height())
        painter.drawText(name, Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignLeft, tr(bar.name))
        track = QRectF(left, self.height() / 2 - 5, max(self.width() - left - right - 4, 8), 10)
        painter.setPen(QPen(QColor(t.line), 1))
        painter.setBrush(QColor(t.raised))
        painter.drawRect(track)
        if bar.share is not None:
            level = track.adjusted(1, 1, -1, -1)
            level.setWidth(level.width() * min(bar.share, 1.0))
            painter.fillRect(level, QColor(t.wrong if bar.share >= 1 else t.quiet))
        if bar.peak is not None:
            x = track.left() + track.width() * min(bar.peak, 1.0)
            painter.fillRect(QRectF(x - 1.5, track.top() - 3, 3, track.height() + 6), colour)
        if right:
            painter.setPen(QColor(t.wrong if bar.overloaded else t.quiet))
            text = tr("OVERLOAD") if bar.overloaded else bar.noise
            box = QRectF(self.width() - right + 4, 0, right - 4, self.height())
            painter.drawText(box, Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignRight, text)
