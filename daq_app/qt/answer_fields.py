"""Fields for the subject's answer (a line from 0 to 100, a number, one of two), and the bar of the force."""

from collections.abc import Callable

import numpy as np
from PySide6.QtCore import QEvent, QObject, QPointF, QRectF, QRegularExpression, QSize, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QInputDevice,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QRegularExpressionValidator,
    QTouchEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QAbstractSlider, QHBoxLayout, QPushButton, QSizePolicy, QWidget

from daq_app.qt.layout import fill
from daq_app.qt.parts import button, entry
from daq_app.qt.tokens import GRID, px, theme_of
from daq_app.window.live_trace import CHANNELS, LiveTrace
from daq_app.window.subject import LEAP, LENGTH, STEP, Answer, Choice, Device, Translate, Which
from daq_app.window.subject import SubjectText as Text
from daq_app.wording import POINTS, two_meanings, typed_number
from sessions.plan.plan import Hand
from sessions.run.steps import Event, Scored

_REACH = 12.0  # above and below the line, within which a touch counts [mm]
MARK = 10.0  # height of the mark [mm]

_KEYS = {
    Qt.Key.Key_Left: -STEP, Qt.Key.Key_Down: -STEP, Qt.Key.Key_Right: STEP, Qt.Key.Key_Up: STEP,
    Qt.Key.Key_PageDown: -LEAP, Qt.Key.Key_PageUp: LEAP, Qt.Key.Key_Home: -100.0, Qt.Key.Key_End: 100.0,
}  # fmt: skip
_NUMBER = QRegularExpression(rf"\p{{Nd}}{{0,9}}([{POINTS}]\p{{Nd}}{{0,9}})?")  # typed text, in digits of any script
_LARGE = 36  # type of the number [device-independent pixels]
_BUTTON_TYPE = 24  # type of the buttons
_WIDE, HIGH = 220, 96  # a button, at least
FULL = 5.0  # force at the end of the bar [N]
AVERAGING_TIME = 0.1  # of the force shown: short enough to follow, long enough to suppress noise [s]


class ScoreLine(QAbstractSlider):
    """Accepts mouse, touch, pen and keyboard; keeps every position with its time.

    In a right-to-left language 0 is at the right end; arrows move in their direction. A slider to assistive technology.
    """

    changed = Signal()

    def __init__(self, now: Callable[[], float]) -> None:
        """Show an empty line; `now` returns the session clock [s]."""
        super().__init__()
        self._now = now
        self._pixels_per_mm = 96 / 25.4
        self.answer = Answer()
        self._end_labels = ("", "")
        self._ticks = 0
        self.setRange(0, 100)
        self._translate: Translate = str
        self._name()
        self.valueChanged.connect(self._move)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAttribute(Qt.WidgetAttribute.WA_AcceptTouchEvents)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self._resize()

    def speak(self, translate: Translate) -> None:
        """Set the language of the name for screen readers."""
        self._translate = translate
        self._name()

    def set_pixels_per_mm(self, pixels: float) -> None:
        """Set the length to `LENGTH` on a screen with `pixels` device-independent pixels per millimetre."""
        if pixels != self._pixels_per_mm:
            self._pixels_per_mm = pixels
            self._resize()

    @property
    def answered(self) -> bool:
        return self.answer.score is not None

    def begin(self, end_labels: tuple[str, str], ticks: int = 0) -> None:
        """Begin a new answer, with an empty line between these ends, and the protocol's ticks."""
        self._end_labels, self._ticks = end_labels, ticks
        self._take(Answer())

    def answer_event(self, hand: Hand | None) -> Scored:
        return self.answer.release().judgement(hand)

    def point_at(self, position: float) -> QPointF:
        """Return the point in the widget of a position from 0 to 100."""
        line, along = self._line(), position / 100.0
        return QPointF(line.left() + (1.0 - along if self.isRightToLeft() else along) * line.width(), line.center().y())

    def sizeHint(self) -> QSize:
        scale = self._pixels_per_mm
        return QSize(round((LENGTH + MARK) * scale), round(2 * _REACH * scale))

    def event(self, event: QEvent) -> bool:
        """Accept touches; Qt converts only unaccepted ones to mouse events."""
        if isinstance(event, QTouchEvent) and event.points():
            self._touch(event, event.points()[0].position())
            event.accept()
            return True
        return super().event(event)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton:
            self._take(self.answer.press(self._now(), self._position(event.position()), _device(event)))

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        self._take(self.answer.drag(self._now(), self._position(event.position()), _device(event)))

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        self._take(self.answer.release())

    def keyPressEvent(self, event: QKeyEvent) -> None:
        step = _KEYS.get(Qt.Key(event.key()))
        if step is None:
            super().keyPressEvent(event)
            return
        if self.isRightToLeft() and event.key() in (Qt.Key.Key_Left, Qt.Key.Key_Right):
            step = -step
        self._take(self.answer.step(self._now(), step))

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Ignore the wheel, which is turned by mistake."""
        event.ignore()

    def paintEvent(self, event: QPaintEvent) -> None:
        t, mm, line = theme_of(self), self._pixels_per_mm, self._line()
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        if self.hasFocus():
            painter.setPen(QPen(QColor(t.act), 2))
            painter.drawRoundedRect(QRectF(self.rect()).adjusted(1, 1, -1, -1), 6, 6)
        painter.setPen(QPen(QColor(t.text), max(0.5 * mm, 2.0), Qt.PenStyle.SolidLine, Qt.PenCapStyle.FlatCap))
        middle = line.center().y()
        painter.drawLine(QPointF(line.left(), middle), QPointF(line.right(), middle))
        for x in (line.left(), line.right()):
            painter.drawLine(QPointF(x, middle - 2 * mm), QPointF(x, middle + 2 * mm))
        for number in range(1, self._ticks + 1):
            point = self.point_at(100.0 * number / (self._ticks + 1))
            painter.drawLine(point - QPointF(0, mm), point + QPointF(0, mm))
        score = self.answer.positions[-1][1] if self.answer.positions else None
        if score is not None:
            point = self.point_at(score)
            painter.setPen(QPen(QColor(t.act), max(1.0 * mm, 3.0), Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap))
            painter.drawLine(point - QPointF(0, MARK / 2 * mm), point + QPointF(0, MARK / 2 * mm))

    def _touch(self, event: QTouchEvent, point: QPointF) -> None:
        now, position = self._now(), self._position(point)
        match event.type():
            case QEvent.Type.TouchBegin:
                self._take(self.answer.press(now, position, "touch"))
            case QEvent.Type.TouchUpdate:
                self._take(self.answer.drag(now, position, "touch"))
            case _:
                self._take(self.answer.release())

    def _move(self, value: int) -> None:
        """Take a value set by assistive technology."""
        if value != round(self.answer.score or 0.0):
            self._take(self.answer.press(self._now(), float(value), "keyboard").release())

    def _take(self, answer: Answer) -> None:
        if answer is self.answer:
            return
        self.answer = answer
        self.setValue(round(answer.score or 0.0))
        self._name()
        self.update()
        self.changed.emit()

    def _name(self) -> None:
        """Update the name and the position of the answer for screen readers."""
        (low, high), score = self._end_labels, self.answer.score
        self.setAccessibleName(self._translate(Text.LINE).format(low=low, high=high))
        state = self._translate(Text.UNANSWERED if score is None else Text.ANSWERED)
        self.setAccessibleDescription(state if score is None else state.format(score=f"{score:.0f}"))

    def _line(self) -> QRectF:
        width = LENGTH * self._pixels_per_mm
        return QRectF((self.width() - width) / 2, 0, width, self.height())

    def _position(self, point: QPointF) -> float:
        line = self._line()
        along = 100.0 * (point.x() - line.left()) / line.width()
        return 100.0 - along if self.isRightToLeft() else along

    def _resize(self) -> None:
        self.setFixedSize(self.sizeHint())
        self.updateGeometry()
        self.update()


def _device(event: QMouseEvent) -> Device:
    device_type = event.pointingDevice().type()
    if device_type == QInputDevice.DeviceType.Stylus:
        return "pen"
    return "touch" if device_type == QInputDevice.DeviceType.TouchScreen else "mouse"


class _Field(QWidget):
    changed = Signal()

    def __init__(self, now: Callable[[], float]) -> None:
        super().__init__()
        self.now = now
        self.answer = Choice()

    @property
    def answered(self) -> bool:
        return self.answer.value is not None

    def answer_event(self, hand: Hand | None) -> Event:
        return self.answer.judgement(hand)

    def begin(self) -> None:
        self.take(Choice())

    def take(self, answer: Choice) -> None:
        self.answer = answer
        self.changed.emit()


class NumberField(_Field):
    """Takes a number above 0; a comma is a decimal mark unless it may group thousands."""

    def __init__(self, now: Callable[[], float]) -> None:
        super().__init__(now)
        self.point = "."  # of the subject's language
        self.field = entry(Text.OWN_NUMBER)
        self.field.setFixedWidth(px(260))
        self.field.setContextMenuPolicy(Qt.ContextMenuPolicy.NoContextMenu)  # its words are not the subject's language
        self.field.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.field.setStyleSheet(f"font-size: {px(_LARGE)}px;")
        self.field.setValidator(QRegularExpressionValidator(_NUMBER, self.field))
        self.field.textEdited.connect(self._type)
        fill(QHBoxLayout(self), 1, self.field, 1)
        self.setFocusProxy(self.field)

    def begin(self) -> None:
        self.field.setText("")  # unlike clear, it leaves nothing of the last answer to Ctrl+Z
        super().begin()

    @property
    def two_meanings(self) -> tuple[str, str] | None:
        """Return both readings of a number whose mark may group thousands, without and with a fraction; else None."""
        return two_meanings(self.field.text(), self.point)

    def _type(self, text: str) -> None:
        self.take(self.answer.type_number(self.now(), typed_number(text, self.point)))


class ChoiceOfTwo(_Field):
    """Two buttons of the same size; the chosen one stays pressed."""

    def __init__(self, now: Callable[[], float]) -> None:
        super().__init__(now)
        self._pointer: Device = "mouse"  # of the last press
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAccessibleName(Text.OF_TWO)
        self.first = self._button(Text.FIRST, "first")
        self.second = self._button(Text.SECOND, "second")
        layout = QHBoxLayout(self)
        layout.setSpacing(4 * GRID)
        fill(layout, 1, self.first, self.second, 1)

    def set_texts(self, first: str, second: str) -> None:
        for choice, text in ((self.first, first), (self.second, second)):
            choice.setText(text)
            choice.setAccessibleName(text)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Choose with 1 and 2, or the arrows: the first is on the side where reading begins."""
        backward, forward = Qt.Key.Key_Left, Qt.Key.Key_Right
        if self.isRightToLeft():
            backward, forward = forward, backward
        keys: dict[int, Which] = {Qt.Key.Key_1: "first", backward: "first", Qt.Key.Key_2: "second", forward: "second"}
        if event.key() in keys:
            self.take(self.answer.choose(self.now(), keys[event.key()], "keyboard"))
        else:
            super().keyPressEvent(event)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Note the device that presses a button, which a click does not report."""
        if event.type() == QEvent.Type.MouseButtonPress and isinstance(event, QMouseEvent):
            self._pointer = _device(event)
        return False

    def _button(self, text: str, value: Which) -> QPushButton:
        choice = button(text, text, lambda: self.take(self.answer.choose(self.now(), value, self._pointer)), "choice")
        choice.installEventFilter(self)
        choice.setCheckable(True)
        choice.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        # In a style sheet of its own, because the window's sets the height of every button.
        size = f"min-width: {px(_WIDE)}px; min-height: {px(HIGH)}px;"
        choice.setStyleSheet(f"font-size: {px(_BUTTON_TYPE)}px; {size}")
        return choice

    def take(self, answer: Choice) -> None:
        self.first.setChecked(answer.value == "first")
        self.second.setChecked(answer.value == "second")
        super().take(answer)


def newest_force(trace: LiveTrace) -> float:
    """Return the present normal force [N]; 0 if it is unknown."""
    newest = trace.newest
    if newest is None:
        return 0.0
    _, values = trace.between(newest - AVERAGING_TIME, np.nextafter(newest, np.inf))
    normal = values[CHANNELS.index("N")]
    finite = normal[np.isfinite(normal)]
    return float(finite.mean()) if len(finite) else 0.0


class PressBar(QWidget):
    """A bar from no force, on the side where reading begins, to `FULL`; no number, so that nobody aims at one."""

    def __init__(self) -> None:
        super().__init__()
        self._force = 0.0
        self.setAccessibleName(Text.PRESSING)
        self.setFixedHeight(px(6 * GRID))

    def show_force(self, trace: LiveTrace) -> None:
        """Show the present normal force; an empty bar if it is unknown."""
        force = newest_force(trace)
        if abs(force - self._force) * self.width() > FULL:  # more than a pixel
            self._force = force
            self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        box = QRectF(self.rect()).adjusted(1, 1, -1, -1)
        bar = QRectF(box)
        bar.setWidth(box.width() * min(max(self._force / FULL, 0.0), 1.0))
        if self.isRightToLeft():
            bar.moveRight(box.right())
        painter.fillRect(bar, QColor(theme_of(self).act))
        painter.setPen(QPen(QColor(theme_of(self).quiet), 2))
        painter.drawRect(box)
