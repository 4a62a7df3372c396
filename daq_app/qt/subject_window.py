"""The subject's window: instructions, then the answer. It never reveals the mounted stimulus."""

from collections.abc import Callable

from PySide6.QtCore import QEvent, QLocale, Qt, Signal
from PySide6.QtGui import QCloseEvent, QKeyEvent, QResizeEvent, QScreen, QShowEvent
from PySide6.QtWidgets import QApplication, QBoxLayout, QLabel, QVBoxLayout, QWidget

from daq_app.qt.answer_fields import ChoiceOfTwo, NumberField, PressBar, ScoreLine
from daq_app.qt.layout import hbox, stack_pages, vbox
from daq_app.qt.parts import button, entry, label, set_text
from daq_app.qt.preferences import LEAST, MOST, millimetres, store_ruler_length
from daq_app.qt.tokens import GRID, font, px
from daq_app.window.subject import Kind, SubjectView, translator
from daq_app.window.subject import SubjectText as Text
from daq_app.wording import tr, typed_number
from sessions.plan.plan import Hand
from sessions.plan.protocols.protocol import ENGLISH

_LARGE, LARGER = 24, 36  # type that is legible with a hand on the transducer
SHRINKING = (1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4)  # factors of the type, until the texts fit the page
_WIDEST = 1100  # row of the button
GIVING = (Qt.Key.Key_Return, Qt.Key.Key_Enter)
TEXT_WIDTH = 900  # largest width of an easily read text, before the scale of the fonts


NO_PAGE = SubjectView("read", "")  # before the first page, and after an answer


class SubjectWindow(QWidget):
    """A separate window, for a second screen."""

    answered = Signal(object)  # Scored, MagnitudeEstimate or PairedChoice
    screen_changed = Signal()
    closed = Signal()  # by a person, not by the program

    def __init__(self, now: Callable[[], float]) -> None:
        super().__init__()
        self.setObjectName("window")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self.setWindowTitle("daq-app · subject")
        self.setAccessibleName("subject's window")
        self._view = NO_PAGE
        self._answered: SubjectView | None = None  # views repeat the question until the recorder has the answer
        self._stated_hand: Hand | None = None
        self._language = ENGLISH
        self._title, self._text = label(role="title", wrap=True), label(wrap=True)
        self.press = PressBar()
        self.press.hide()
        self._question, self._hint = label(role="title", wrap=True), label(wrap=True)
        self.line = ScoreLine(now)
        self._scale = _Scale(self.line)
        self.number = NumberField(now)
        self.choice = ChoiceOfTwo(now)
        self._answer_fields = stack_pages(self._scale, self.number, self.choice)
        self.next = button(Text.NEXT, Text.NEXT, self._give, "primary")
        self.next.setMinimumSize(px(180), px(64))
        self.ruler = RulerCheck()
        self.ruler.setLayoutDirection(Qt.LayoutDirection.LeftToRight)  # its texts are the experimenter's
        self.ruler.finished.connect(self._screen_changed)
        self.ruler.finished.connect(self._turn)
        self._pages = stack_pages(self._message_page(), self._scale_page(), self.ruler)
        vbox(self._pages, on=self)
        for answer_field in (self.line, self.number, self.choice):
            answer_field.changed.connect(self._answer_changed)
        self.setMinimumSize(px(560, most=1.25), 340)
        self.resize(1000, 640)
        self.fit_screen()

    @property
    def scoring(self) -> bool:
        return self._view.asks

    @property
    def asks(self) -> Kind:
        return self._view.kind

    @property
    def measuring(self) -> bool:
        """Say whether the line is being measured with a ruler."""
        return self._pages.currentWidget() is self.ruler

    @property
    def _answer_field(self) -> ScoreLine | NumberField | ChoiceOfTwo:
        return self.number if self.asks == "number" else self.choice if self.asks == "choice" else self.line

    def show_view(self, view: SubjectView, hand: Hand | None) -> None:
        """Show a page; `hand` is the answering one, if stated."""
        if view == self._answered:
            return
        previous, self._view, self._stated_hand, self._answered = self._view, view, hand, None
        if previous == view:
            return
        if view.language != self._language:
            self._speak(view.language)
        directions = QBoxLayout.Direction
        self._next_row.setDirection(directions.LeftToRight if view.hand == "right" else directions.RightToLeft)
        self.press.setVisible(view.force)
        if view.asks:
            if _question_of(previous) != _question_of(view):
                self._begin(view)
            set_text(self._question, view.title)
            self._answer_changed()
        else:
            set_text(self._title, view.title)
            set_text(self._text, view.text)
        if not self.measuring:
            self._turn()
        self._fit_type()

    def _fit_type(self) -> None:
        """Set the type to its normal size, or smaller until the whole page fits."""
        layout = self._answer_layout if self.scoring else self._message_layout
        for factor in SHRINKING:
            for widget in (self._title, self._question):
                _set_type(widget, LARGER * factor, bold=True)
            for widget in (self._text, self._hint):
                _set_type(widget, _LARGE * factor)
            self._scale.set_type(_LARGE * factor)
            layout.invalidate()
            layout.activate()  # a hidden page has not yet processed its new texts
            if layout.totalHeightForWidth(self.width()) <= self.height():
                return

    def resizeEvent(self, event: QResizeEvent) -> None:
        self._fit_type()

    def _speak(self, language: str) -> None:
        self._language = language
        translate = translator(language)
        self.setLayoutDirection(QLocale(language).textDirection())
        self.next.setText(translate(Text.NEXT))
        self.next.setAccessibleName(translate(Text.NEXT))
        self.line.speak(translate)
        self.number.field.setAccessibleName(translate(Text.OWN_NUMBER))
        self.number.point = QLocale(language).decimalPoint()
        self.choice.setAccessibleName(translate(Text.OF_TWO))
        self.press.setAccessibleName(translate(Text.PRESSING))
        self.choice.set_texts(translate(Text.FIRST), translate(Text.SECOND))

    def _begin(self, view: SubjectView) -> None:
        answer_field = self._answer_field
        if isinstance(answer_field, ScoreLine):
            answer_field.begin(view.ends, view.ticks)
            self._scale.show_texts(view.ends)
        else:
            answer_field.begin()
        self._answer_fields.setCurrentWidget(self._scale if answer_field is self.line else answer_field)

    def check_ruler(self) -> None:
        self.ruler.begin(self.screen())
        self._pages.setCurrentWidget(self.ruler)
        self.raise_()
        self.activateWindow()

    def fit_screen(self) -> None:
        """Set the line's length for the window's screen."""
        self.line.set_pixels_per_mm(millimetres(self.screen()).pixels)
        self._scale.fit()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Treat Enter as Next, and F11 as the switch of the full screen."""
        if self.scoring and not self.measuring and event.key() in GIVING:
            self.take_key(event)
        elif event.key() == Qt.Key.Key_F11:
            self.setWindowState(self.windowState() ^ Qt.WindowState.WindowFullScreen)
        else:
            super().keyPressEvent(event)

    def take_key(self, event: QKeyEvent) -> None:
        """Take a key of the answer, pressed in either window."""
        if event.key() in GIVING:
            self._give()
        else:
            QApplication.sendEvent(self._answer_field.focusProxy() or self._answer_field, event)

    def showEvent(self, event: QShowEvent) -> None:
        """Follow the window to screens of another size from now on."""
        # Not on a move event, which comes before the change of screen.
        self.windowHandle().screenChanged.connect(self._screen_changed, Qt.ConnectionType.UniqueConnection)
        self._screen_changed()

    def _screen_changed(self) -> None:
        self.fit_screen()
        self.screen_changed.emit()

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.DevicePixelRatioChange:
            self.fit_screen()

    def closeEvent(self, event: QCloseEvent) -> None:
        """Only hide, to keep an answer that is being given."""
        event.ignore()
        self.hide()
        self.closed.emit()

    def _message_page(self) -> QWidget:
        page = QWidget()
        self._message_layout = layout = QVBoxLayout(page)
        layout.setContentsMargins(6 * GRID, 6 * GRID, 6 * GRID, 6 * GRID)
        layout.addStretch(1)
        for widget in (self._title, self._text, self.press):
            widget.setMaximumWidth(px(TEXT_WIDTH))
            layout.addLayout(hbox(1, (widget, 100), 1))
            layout.addSpacing(3 * GRID)
        layout.addStretch(2)
        return page

    def _scale_page(self) -> QWidget:
        page = QWidget()
        for text_label in (self._question, self._hint):
            text_label.setAlignment(Qt.AlignmentFlag.AlignHCenter)
        button_place = QWidget()  # keeps the button's room while it is hidden
        self._next_row = hbox(1, self.next, on=button_place, margins=(4 * GRID, 0, 4 * GRID, 0))
        button_place.setLayoutDirection(Qt.LayoutDirection.LeftToRight)  # Next lies at a hand in every script
        button_place.setFixedHeight(self.next.minimumHeight() + 2 * GRID)
        button_place.setMaximumWidth(_WIDEST)
        row, margins = hbox(1, (button_place, 1000), 1), (2 * GRID, 4 * GRID, 2 * GRID, 4 * GRID)
        self._answer_layout = vbox(self._question, 2, self._hint, self._answer_fields, 2, row, on=page, margins=margins)
        return page

    def _turn(self) -> None:
        self._pages.setCurrentIndex(1 if self.scoring else 0)
        if self.scoring:
            self._answer_field.setFocus()

    def _answer_changed(self) -> None:
        self.next.setVisible(self._answer_field.answered)
        hint, meanings = self._view.text, self.number.two_meanings
        if self.asks == "number" and meanings is not None:
            hint = translator(self._language)(Text.TWO_MEANINGS).format(whole=meanings[0], fraction=meanings[1])
        if self._hint.text() != hint:
            set_text(self._hint, hint)
            self._fit_type()

    def _give(self) -> None:
        if not self.scoring or not self._answer_field.answered:
            return
        answer_event = self._answer_field.answer_event(self._stated_hand)
        self.next.hide()  # an answer is given only once
        self._view, self._answered = NO_PAGE, self._view
        set_text(self._title, translator(self._language)(Text.THANKS))
        set_text(self._text, "")
        self._fit_type()
        self._pages.setCurrentIndex(0)
        self.answered.emit(answer_event)


class _Scale(QWidget):
    """The line with the labels of its two ends below them."""

    def __init__(self, line: ScoreLine) -> None:
        super().__init__()
        self._line = line
        line.setParent(self)
        self._labels = [label(wrap=True) for _ in range(2)]
        for text_label in self._labels:
            text_label.setParent(self)
            text_label.setAlignment(Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignTop)
            text_label.setMargin(GRID)  # separates texts; Arabic letters extend beyond the height of the label's font

    def show_texts(self, texts: tuple[str, str]) -> None:
        for widget, text in zip(self._labels, texts, strict=True):
            set_text(widget, text)
        self.fit()

    def set_type(self, size: float) -> None:
        for text_label in self._labels:
            _set_type(text_label, size)
        self.fit()

    def fit(self) -> None:
        """Place the two labels in a row without contact, as wide as possible."""
        line = self._line
        line.move((self.width() - line.width()) // 2, 0)
        positions = [line.x() + line.point_at(position).x() for position in (0.0, 100.0)]
        width = int(min(abs(positions[1] - positions[0]), 2 * min(positions)))
        tallest = 0
        for widget, x in zip(self._labels, positions, strict=True):
            tallest = max(tallest, widget.heightForWidth(width))
            widget.setGeometry(int(x - width / 2), line.height(), width, widget.heightForWidth(width))
        self.setFixedHeight(line.height() + tallest + GRID)
        self.setMinimumWidth(line.width())

    def resizeEvent(self, event: QResizeEvent) -> None:
        self.fit()


class RulerCheck(QWidget):
    """Shows a line, and takes its length as measured with a ruler."""

    finished = Signal()

    def __init__(self) -> None:
        super().__init__()
        self._screen: QScreen | None = None
        self._line = ScoreLine(lambda: 0.0)  # the same widget as for answers
        self._line.setEnabled(False)
        self._line.setAccessibleName(tr("line of 100 millimetres to be measured"))
        sentence = label(tr("Hold a ruler to the line. How long is it?"), "title", wrap=True)
        self._length = entry(tr("length of the line in millimetres, as the ruler says"))
        self._length.setFixedWidth(px(100))
        self._length.returnPressed.connect(self._keep)
        self._wrong = label("", "quiet", wrap=True)
        keep = button(tr("Keep"), tr("keep the measured length"), self._keep)
        leave = button(tr("Leave as it is"), tr("leave the line as it is"), self.finished.emit)
        row = hbox(self._length, label("mm"), keep, leave, 1)
        vbox(sentence, 1, hbox(1, self._line, 1), 1, row, self._wrong, on=self, margins=4 * GRID)

    def begin(self, screen: QScreen) -> None:
        self._screen = screen
        self._line.set_pixels_per_mm(millimetres(screen).pixels)
        self._length.setText("100")
        self._length.selectAll()
        self._length.setFocus(Qt.FocusReason.OtherFocusReason)
        screen_name = screen.name() or tr("without a name")
        set_text(self._wrong, tr("Screen: {name}, {words}.", name=screen_name, words=millimetres(screen).origin))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Consume the Enter that stores a length, which the page behind would take."""
        if event.key() not in GIVING:
            super().keyPressEvent(event)

    def _keep(self) -> None:
        length = typed_number(self._length.text())
        if self._screen is not None and length is not None and store_ruler_length(self._screen, length) is not None:
            self.finished.emit()
            return
        refusal = tr(
            "Give the length in millimetres, from {least:.0f} to {most:.0f}: '{it}' is not one.",
            least=LEAST, most=MOST, it=self._length.text().strip(),
        )  # fmt: skip
        set_text(self._wrong, refusal)


def _question_of(view: SubjectView) -> tuple[object, ...]:
    """Return the identity of a question; a change restarts the answer."""
    return view.kind, view.key, view.ends, view.ticks


def _set_type(widget: QLabel, size: float, *, bold: bool = False) -> None:
    """Set a label in large type; the style sheet's sizes are for the experimenter's window."""
    widget.setStyleSheet(f"font-size: {px(size)}px; font-weight: {600 if bold else 400};")
    widget.setFont(font(round(size), bold=bold))
