"""The top of the experimenter's window: subject, recording lamp, banner, and the current step."""

from collections.abc import Callable
from time import monotonic

from PySide6.QtCore import QElapsedTimer, QPointF, Qt
from PySide6.QtGui import QColor, QFontMetrics, QPainter, QPaintEvent, QPen, QResizeEvent
from PySide6.QtWidgets import QApplication, QBoxLayout, QSizePolicy, QWidget

from daq_app.qt.layout import hbox, set_horizontal
from daq_app.qt.painting import Lamp, paint_arrow
from daq_app.qt.parts import Panel, button, label, regrade, set_text
from daq_app.qt.preferences import name_of
from daq_app.qt.tokens import GRID, HEADLINE, SMALL, TARGET, font, px, theme_of
from daq_app.window.state import Message
from daq_app.window.view import Banner, View
from daq_app.window.view_course import Button
from daq_app.wording import tr, tr_noop

_ONE_ROW = 1100  # width from which subject and lamp are in a row, before the font's scale [px]
TWO_LINES = 4 * GRID  # of small type, before the font's scale [px]
_ROOM = TARGET + 4  # height of the notice's line, a button and its margins, before the font's scale [px]
_LEAST = 2 * GRID  # height of the current step without text, where space is short [px]
LEGIBLE = 4.0  # to read some twenty words, at five a second [s]
_STROKES = tr_noop({1: "stroke away from the subject", -1: "stroke towards the subject", 0: "no stroke requested"})
_MARKS = {"wrong": "■", "look": "▲"}  # before the sentence of a banner


class Header(QWidget):
    """Shows subject, device, language, and whether the session is simulated and being recorded."""

    def __init__(self) -> None:
        super().__init__()
        self._heading, self._device = label("", "title", wrap=True), label("", "quiet", wrap=True)
        self._language = label("", "quiet")
        for wrapped in (self._heading, self._device):
            # They share the available width.
            wrapped.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self._device.setMinimumHeight(px(TWO_LINES))  # parts below stay in place when the device's text grows
        self._simulated = label(tr("SIMULATED"), "simulated")
        self._lamp = Lamp(tr("recording"))
        self._recording_label = label(tr("not recording"), "title")
        self._age = label("", "quiet")
        self._age.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        subject = hbox((self._heading, 3), (self._device, 2), self._language, spacing=GRID)
        lamp = hbox(1, self._simulated, self._lamp, self._recording_label, self._age, spacing=GRID)
        self._rows = hbox((subject, 1), lamp, on=self, margins=(GRID, 0, GRID, 0), spacing=GRID)
        longest = tr("saved {age:.1f} s ago", age=99.9)
        self._age.setFixedWidth(QFontMetrics(font(SMALL)).horizontalAdvance(f"{longest} "))

    def show_view(self, view: View) -> None:
        set_text(self._heading, view.heading)
        # A line may break only after the name: the parts below stay in place. The bench has the whole text.
        lamp_text = view.bench.lamp_text.replace(" ", "\u00a0")
        width = self._device.contentsRect().width()
        lamp_text = self._device.fontMetrics().elidedText(lamp_text, Qt.TextElideMode.ElideRight, width)
        set_text(self._device, f"{view.bench.name}: {lamp_text}")
        self._device.setAccessibleName(f"{view.bench.name}: {view.bench.lamp_text}")
        self._device.setToolTip(self._device.accessibleName())
        set_text(self._language, name_of(view.subject.language), tr("language that the subject reads"))
        self._simulated.setVisible(view.simulated is not None)
        self._simulated.setToolTip(view.simulated or "")
        self._simulated.setAccessibleName(view.simulated or tr("nothing is simulated"))
        self._lamp.show_grade(view.lamp.grade, view.lamp.text)
        set_text(self._recording_label, view.lamp.text, grade="wrong" if view.lamp.grade == "wrong" else "")
        # All figures have the same width, but some extend beyond it, which a label allows for.
        self._recording_label.setMinimumWidth(self._recording_label.fontMetrics().horizontalAdvance(view.lamp.text) + 2)
        set_text(self._age, view.lamp.age)

    def resizeEvent(self, event: QResizeEvent) -> None:
        set_horizontal(self._rows, self.width() >= px(_ONE_ROW))


class Notice(Panel):
    """One permanent line: empty, a sentence, or a banner that stays until its cause is gone."""

    def __init__(self, send: Callable[[Message], None]) -> None:
        super().__init__("", "banner")
        self._send, self._collapsible = send, False
        self._banner: Banner | None = None
        self.warning = ""  # reply to an act, until the session advances or has its own message
        self._legible_until = 0.0  # of the monotonic clock
        self._topic: object = None
        self._step = ""
        self._label = label("", wrap=True)
        self._button = button("", tr("what the notice offers"), self._do)
        self._button.setVisible(False)
        self.setMinimumHeight(px(_ROOM))
        hbox((self._label, 1), self._button, on=self, margins=(2 * GRID, 2, GRID, 2))

    def show_view(self, banner: Banner | None, notice: str, step: str = "") -> None:
        """Show a banner and a warning of this step, or else the last message."""
        topic = (banner is None, notice)
        if topic != self._topic or (step != self._step and monotonic() >= self._legible_until):
            self.warning, self._topic, self._step = "", topic, step
        self._show(banner, notice)

    def _show(self, banner: Banner | None, notice: str) -> None:
        previous, self._banner = self._banner, banner
        grade = "" if banner is None else banner.grade
        if grade == "wrong" and (previous is None or previous.grade != "wrong"):
            QApplication.beep()  # nobody looks at the window all the time
        message = self.warning or notice
        text = f"{_MARKS[grade]} {banner.sentence} {self.warning}" if banner else message[:1].upper() + message[1:]
        set_text(self._label, text.strip(), tr("Notice:"))
        regrade(self, grade)
        self._button.setVisible(banner is not None and banner.sends is not None)
        self._button.setText("" if banner is None else banner.action)
        self._button.setAccessibleName(self._button.text() or tr("what the notice offers"))
        if self._collapsible:
            self.setVisible(bool(text))

    def set_collapsible(self, collapsible: bool) -> None:
        """Hide the empty line if `collapsible`, to save space; else keep its room."""
        self._collapsible = collapsible
        self.setMinimumHeight(0 if collapsible else px(_ROOM))
        self.setVisible(not collapsible or bool(self._label.text()))

    def warn(self, sentence: str) -> None:
        """Show a reply long enough to be read, even if a simulated subject continues immediately."""
        self.warning = sentence
        self._legible_until = monotonic() + LEGIBLE if sentence else 0.0
        self._show(self._banner, sentence)

    def _do(self) -> None:
        if self._banner is not None and self._banner.sends is not None:
            self._send(self._banner.sends)


class ToDo(Panel):
    """The current step, and its button."""

    def __init__(self, primary: Callable[[], None], review: Callable[[], None]) -> None:
        super().__init__(tr("what to do now"))
        self._small = False
        self._sends: object = None  # what the button sends in the current step
        self._since_shown = QElapsedTimer()  # or since painted
        self._painted = False
        self._arrow = Arrow()
        self.sentence = label("", "headline", wrap=True)
        self._reserve_lines()
        self.primary = button("", tr("do it"), primary, "primary")
        self.second = button(tr("Review  F4"), tr("look at the session that has ended"), review)
        policy = self.primary.sizePolicy()
        policy.setRetainSizeWhenHidden(True)
        self.primary.setSizePolicy(policy)
        self.primary.setMinimumWidth(220)
        self._buttons = hbox(self.second, self.primary, spacing=GRID)
        room = (2 * GRID, GRID, 2 * GRID, GRID)
        hbox(self._arrow, (self.sentence, 1), self._buttons, on=self, margins=room, spacing=2 * GRID)

    @property
    def perceived(self) -> bool:
        """Say whether people had time to see the step: what they press sooner was meant for another one."""
        return self._since_shown.isValid() and self._since_shown.elapsed() >= QApplication.doubleClickInterval()

    def show_what(self, sentence: str, primary: Button | None, direction: int) -> None:
        sends = None if primary is None else primary.sends
        if sends != self._sends:
            self._sends, self._painted = sends, False
            self._since_shown.start()
            self.update()
        set_text(self.sentence, sentence)
        self._arrow.show_direction(direction)
        self._arrow.setVisible(direction != 0 or not self._small)
        if primary is not None:
            self.primary.setText(f"{primary.label}   {tr(primary.key)}")
            self.primary.setAccessibleName(f"{primary.label}: {sentence}")
            self.primary.setEnabled(primary.enabled)
        self.primary.setVisible(primary is not None)
        if self.isVisible() and not self._small:  # parts below stay in place when the sentence gets shorter
            tallest = max(self.sentence.minimumHeight(), self.sentence.heightForWidth(self.sentence.width()))
            self.sentence.setMinimumHeight(tallest)

    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        if not self._painted:
            self._painted = True
            self._since_shown.start()

    def resizeEvent(self, event: QResizeEvent) -> None:
        if event.size().width() != event.oldSize().width():
            self._reserve_lines()

    def _reserve_lines(self) -> None:
        """Keep room for two lines, except where space is short: the steps differ in one or two."""
        two_lines = 2 * QFontMetrics(font(HEADLINE)).lineSpacing()
        self.sentence.setMinimumHeight(_LEAST if self._small else two_lines)

    def show_small(self, small: bool, *, stacked: bool) -> None:
        """Use smaller type if space is short, and put one button below the other if `stacked`."""
        directions = QBoxLayout.Direction
        self._buttons.setDirection(directions.BottomToTop if stacked else directions.LeftToRight)
        if small != self._small:
            self._small = small
            regrade(self.sentence, "title" if small else "headline", "role")
            self.setMinimumHeight(0)
            self._reserve_lines()


class Arrow(QWidget):
    """The direction of the stroke, as seen from behind the subject's finger: up is away."""

    def __init__(self) -> None:
        super().__init__()
        self._direction = 0
        self.setFixedSize(5 * GRID, 7 * GRID)
        self.setAccessibleName(tr(_STROKES[0]))

    def show_direction(self, direction: int) -> None:
        """Show +1 away from the subject (up), -1 towards the subject (down), 0 nothing."""
        if direction != self._direction:
            self._direction = direction
            self.setAccessibleName(tr(_STROKES[direction]))
            self.setToolTip(self.accessibleName())
            self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        if not self._direction:
            return
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QPen(QColor(theme_of(self).text), 4, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap))
        middle, half = self.height() / 2, self._direction * (self.height() / 2 - 6)
        paint_arrow(painter, self.width() / 2, middle + half, middle - half, QPointF(12, 14))
