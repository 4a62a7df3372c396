"""The experimenter's window: places the panels, and sends the messages of buttons and keys."""

import secrets
from collections.abc import Callable
from datetime import datetime
from functools import partial
from pathlib import Path

from PySide6.QtCore import QSize, Qt, QTimer, Signal
from PySide6.QtGui import QCloseEvent, QGuiApplication, QKeyEvent, QResizeEvent
from PySide6.QtWidgets import QAbstractButton, QHBoxLayout, QMainWindow, QScrollArea, QWidget

from daq_app.qt.bench_panel import BenchPanel, BenchStrip
from daq_app.qt.bridge import Bridge
from daq_app.qt.course_panel import ACTS, CoursePanel
from daq_app.qt.header import Header, Notice, ToDo
from daq_app.qt.keys import KeysPage
from daq_app.qt.layout import fill, hbox, scroll_area, stack_pages, vbox
from daq_app.qt.middle import Middle
from daq_app.qt.new_session_page import NewSessionPage
from daq_app.qt.preferences import LANGUAGE, SCALE, THEME, millimetres, restore_place, save_place, type_scale
from daq_app.qt.rooms import ROOMS, Menus, Rail, Room, Rooms
from daq_app.qt.subject_picture import open_preview
from daq_app.qt.subject_side import SubjectSide, TabletScreen
from daq_app.qt.subject_window import SubjectWindow
from daq_app.qt.tokens import GRID, px
from daq_app.recorder.messages import AcknowledgeOverloads, Tare
from daq_app.window.checklist import first_missing, headline
from daq_app.window.new_session import Bench, Refusal, SessionForm, bench_of, check_form, pilot_form
from daq_app.window.view import View
from daq_app.window.view_course import Button
from daq_app.wording import tr

_COURSE = frozenset({"primary", *ACTS})  # of the session in hand
# Before the scale of the fonts [px]:
_WIDE = 1366  # below it the bench folds to a strip of lamps
_STACKED = 800  # below it the two buttons of the current step are stacked, and the strip of lamps is hidden
_ROOMY = 1100  # below it the six axes and the sample fold away
TALL = 620  # below it the type of the headline is smaller
LOW = 540  # up to it an empty notice is hidden
CARDS, _PLAN = 600, 316  # widths of the checklist and of the plan
LEAST_CARDS = 260  # least width without a truncated field of the checklist


class MainWindow(QMainWindow):
    """The experimenter's window. It shows the latest `View`."""

    theme_chosen = Signal()

    def __init__(self, bridge: Bridge, tablet: TabletScreen | None = None) -> None:
        """Place the panels, and follow `bridge`; with a `tablet` the subject answers there."""
        super().__init__()
        self.setWindowTitle("daq-app")
        self.setAccessibleName(tr("experimenter's window"))
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.bridge = bridge
        self._bench_shown: bool | None = None  # by choice; None: depends on the width
        self.header = Header()
        self.notice = Notice(bridge.send)
        self.to_do = ToDo(self._primary, lambda: self.act("go to review"))
        self.rail = Rail(lambda room: self.act(f"go to {room}"))
        self.page = NewSessionPage(bridge.send, self.act)
        self.course = CoursePanel(bridge.send)
        self.middle = Middle(bridge, self.act)
        self.live = self.middle.live
        self.bench = BenchPanel(bridge.send, bridge.search)
        self.strip = BenchStrip(self._fold_bench)
        self.subject = SubjectWindow(bridge.session_now)
        self.tablet = tablet
        self.side = SubjectSide(self, bridge, self.subject, tablet, self.course, self.act)
        self.side.line_changed.connect(self._line_changed)
        self.subject.closed.connect(self._subject_closed)
        self.keyboard = self.side.keyboard
        self.keyboard.nothing_to_give.connect(self._point_to_space)
        self.keyboard.typing.connect(self._scroll_to)
        self.rooms = Rooms(bridge, self.rail, Menus(self, self.act))
        self.keys = KeysPage(self)
        self._refused_uri = ""  # address of the transducer whose holder was looked for
        self._acts = self._table()
        self._left = stack_pages(self.page, self.course)
        self.setCentralWidget(self._lay_out())
        self.page.changed.connect(self._form_changed)
        bridge.changed.connect(self.show_view)
        bridge.frame.connect(self._draw)
        self.show_view(bridge.view)
        self.page.look_for_unfinished_sessions()
        restore_place(self)
        for widget in self.findChildren(QAbstractButton):
            widget.setFocusPolicy(Qt.FocusPolicy.TabFocus)  # a click leaves Space to the primary button
        self.page.subject.setFocus()
        for area in self.findChildren(QScrollArea):
            area.verticalScrollBar().rangeChanged.connect(self._keep_in_sight)
        self._line_changed()
        self._fit()

    def sizeHint(self) -> QSize:
        return QSize(1440, 860)

    def show_view(self, view: View) -> None:
        course = view.course
        self.header.show_view(view)
        if (uri := self.bridge.state.bench.refused_uri) != self._refused_uri:
            self._refused_uri = uri
            self.page.look_for_unfinished_sessions()  # one of them may hold it
        notice, step = ("", "") if course is None else (course.notice, course.headline)
        self.notice.show_view(view.banner, notice, step)
        self._warn_of_tablet()
        self.bench.show_view(view.bench)
        self.strip.show_view(view.bench)
        self.middle.show_view(course)
        self._turn(0 if course is None else 1)
        if course is None:
            self._form_changed()
        else:
            self.course.show_view(course)
            self.to_do.show_what(course.headline, course.primary, course.direction)
        self.to_do.second.setVisible(self.rooms.session_over)
        self.rooms.show_state()
        self.side.show_view(view)

    def act(self, act: str) -> None:
        """Carry out the action of a key, a button or a menu entry."""
        if act in _COURSE and self.rooms.room == "review":
            self.go_to("run" if self.bridge.view.course is not None else "prepare")
        elif act.startswith("open "):
            self.rooms.open(Path(act.removeprefix("open ")))
        elif act in self._acts:
            self._acts[act]()
        elif act in _COURSE and self.course.isVisible():
            self.course.ask(act)
            if self.course.asking:
                self.side.come_back()

    def _table(self) -> dict[str, Callable[[], object]]:
        return {
            "primary": self._primary,
            "undo": lambda: self.rooms.room == "run" and self.course.ask("undo"),
            "new": lambda: self.rooms.session_over and self.go_to("prepare"),
            "tare": self._tare,
            "connect": self.bench.connect_choice,
            "acknowledge": lambda: self.bridge.view.bench.can_acknowledge and self.bridge.send(AcknowledgeOverloads()),
            "hold": self.live.bar.hold.click,
            "model": self.live.bar.finite.click,
            "longer": lambda: self.live.change_length(1),
            "shorter": lambda: self.live.change_length(-1),
            "bench": self._fold_bench,
            "drawer": self.middle.toggle_drawer,
            "mirror": self.course.mirror.open.toggle,
            "inspect": self.middle.toggle_inspection,
            "pilot": self._pilot,
            "preview": self._preview,
            "tablet": lambda: self.tablet and self.tablet.server.renew(),
            "subject": lambda: (self.side.show(), self.notice.warn("")),  # removes the message that it is closed
            "ruler": lambda: (self.side.show(), self.subject.check_ruler()),
            "open": self.rooms.choose,
            "report": lambda: (analyst := self.rooms.analyst) and analyst.write_report(),
            "export": lambda: (analyst := self.rooms.analyst) and analyst.write_export(),
            "keys": self.keys.toggle,
            "leave": self._leave,
            **{f"go to {room}": partial(self.go_to, room) for room in ROOMS},
            THEME: self.theme_chosen.emit,
            SCALE: lambda: self.notice.warn(tr("The chosen type size applies from the next start on.")),
            LANGUAGE: lambda: self.notice.warn(tr("The chosen language applies from the next start on.")),
            "quit": self.close,
        }

    def go_to(self, room: Room) -> None:
        self.rooms.go_to(room)
        if room != "review":
            (self.page.subject if self.rooms.room == "prepare" else self).setFocus()

    def _leave(self) -> None:
        self.keys.hide()
        if self.course.asking:
            self.course.leave()
        else:
            self.middle.leave()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        analyst = self.rooms.analyst
        if not ((analyst is not None and analyst.press(event)) or self.keyboard.press(event)):
            super().keyPressEvent(event)

    def resizeEvent(self, event: QResizeEvent) -> None:
        self._fit()

    def closeEvent(self, event: QCloseEvent) -> None:
        """Close; a session being recorded needs a second request, and can then be resumed."""
        warning = tr("A session is being recorded: end it with Ctrl+E, or close again to leave it for later.")
        if self.bridge.recording and self.notice.warning != warning:
            self.notice.warn(warning)
            event.ignore()
            return
        save_place(self)
        self.bridge.end()
        self.rooms.review.leave()
        if self.tablet is not None:
            self.tablet.server.close()
        self.subject.hide()
        QGuiApplication.quit()

    def _primary(self) -> None:
        course = self.bridge.view.course
        if course is None:
            self._start_session()
        elif course.primary is not None and course.primary.sends is not None and self.to_do.perceived:
            self.bridge.send(course.primary.sends)

    def _point_to_space(self) -> None:
        course = self.bridge.view.course
        if course is not None and course.primary is not None:
            self.notice.warn(tr("Enter only gives answers while people answer at this computer. Space goes on."))

    def _start_session(self) -> None:
        bench = bench_of(self.bridge.state.bench)
        gap = first_missing(self.page.check(bench, anew=True))
        if gap is None:
            self._begin(self.page.form(), bench)
        elif gap.field == "forces" and self.bridge.view.bench.lamp == "off":
            self.bench.connect_choice()
        else:
            self._form_changed()
            self.page.go_to_missing()

    def _tare(self) -> None:
        if self.bridge.view.bench.can_tare:
            self.bridge.send(Tare())
        elif self.bridge.recording:
            self.notice.warn(tr("Each trial measures its own zero; the bench is zeroed outside of a session."))

    def _pilot(self) -> None:
        if self.bridge.view.course is None and self.rooms.room == "prepare":
            bench = bench_of(self.bridge.state.bench)
            self._begin(pilot_form(self.page.form(), bench), bench)
        else:
            self.notice.warn(tr("A protocol is piloted in Prepare, while no session is running."))

    def _preview(self) -> None:
        if refusal := open_preview(self.page.form(), self.subject.size(), self):
            self.notice.warn(refusal)

    def _begin(self, form: SessionForm, bench: Bench) -> None:
        session = check_form(form, bench, datetime.now(), secrets.randbelow(2**31), self.side.line_settings())
        if isinstance(session, Refusal):
            self.notice.warn(" ".join(session.values()))
            return
        if session.people.kind == "simulated people":
            self.subject.hide()
        self.bridge.send(session)

    def _form_changed(self) -> None:
        bench = bench_of(self.bridge.state.bench)
        self.page.show_bench(bench)
        cards = self.page.check(bench)
        ready = all(card.ready for card in cards)
        view, gap = self.bridge.view.bench, first_missing(cards)
        self.page.transducer.show_view(view)
        connects = gap is not None and gap.field == "forces" and view.lamp == "off"
        primary = Button(tr("Connect"), "Enter") if connects else Button(tr("Start"), "Enter", ready)
        self.to_do.show_what(headline(cards, self.page.subject.text()), primary, 0)

    def _turn(self, page: int) -> None:
        """Show the page of a new session (0) or the running session (1), with the matching focus."""
        if page != self._left.currentIndex():
            self._left.setCurrentIndex(page)
            self._below.ensureVisible(0, 0)
            self._fit()
            (self.page.subject if page == 0 else self).setFocus()
            if page == 1:
                self.side.begin()
            else:
                self.page.subject.clear()  # the next session must not start with the previous subject
                self.page.look_for_unfinished_sessions()

    def _line_changed(self) -> None:
        if self.tablet is None:
            self.page.screen_fields.show_line(millimetres(self.subject.screen()), self.subject.size())
        else:
            self.page.screen_fields.show_tablet(self.tablet.status, self.tablet.problem, self.tablet.picture())
            self._warn_of_tablet()
        if self.bridge.view.course is None:
            self._form_changed()

    def _subject_closed(self) -> None:
        if self.bridge.recording:
            self.notice.warn(tr("The subject's window was closed; F6 opens it again."))

    def _warn_of_tablet(self) -> None:
        warning = tr("The tablet does not answer. It keeps its answers; F6 shows the subject's page here.")
        silent = self.tablet is not None and self.bridge.recording and not self.tablet.server.connected
        if silent and not self.notice.warning:
            self.notice.warn(warning)
        elif not silent and self.notice.warning == warning:
            self.notice.warn("")

    def _draw(self) -> None:
        session = self.bridge.state.session
        try:
            self.live.model_says()
            self.side.show_force()
            marks = () if session is None else session.marks
            self.live.draw(marks, self.bridge.state.now, silent=self.bridge.view.bench.silent)
        except Exception as error:  # noqa: BLE001  a drawing error never stops a recording
            self.bridge.report_drawing_failure(error)

    def _fold_bench(self) -> None:
        self._bench_shown = not self.bench.isVisible()
        self._fit()

    def _fit(self) -> None:
        width, height = self.width() / type_scale(), self.height() / type_scale()
        wide = width >= _WIDE
        visible = wide if self._bench_shown is None else self._bench_shown
        self.bench.setVisible(visible)
        cards = self._left.currentIndex() == 0 and width >= _WIDE
        scale = type_scale() if wide else min(type_scale(), 1.4)
        least = LEAST_CARDS * type_scale() if self._left.currentIndex() == 0 and (wide or not visible) else 0.0
        self._left.setMaximumWidth(round((CARDS if cards else max(_PLAN, least / scale)) * scale))
        self._left.setMinimumWidth(round(max(_PLAN * scale, least)))
        self.bench.setFixedWidth(px(290))
        self.strip.setVisible(not visible and width >= _STACKED)
        self.live.set_room(width >= _ROOMY + (CARDS if cards else 0) and not (visible and not wide))
        self.to_do.show_small(height < TALL or width < _ROOMY, stacked=width < _STACKED)
        self.notice.set_collapsible(height <= LOW)
        self.keys.fit()

    def _scroll_to(self, field: QWidget) -> None:
        """Scroll to a text field, once it has its place: the innermost area around it first."""
        for area in reversed(self.findChildren(QScrollArea)):
            if area.isAncestorOf(field):
                QTimer.singleShot(0, field, partial(area.ensureWidgetVisible, field))

    def _keep_in_sight(self) -> None:
        """Scroll back to the text field in use after a page around it has changed its height."""
        if (field := self.keyboard.focused_field()) is not None:
            self._scroll_to(field)

    def _lay_out(self) -> QWidget:
        window = QWidget()
        window.setObjectName("window")
        panels = QWidget()
        for panel in (self.bench, self.strip):
            panel.hide()  # until the available room is known
        body = fill(_Panels(panels), (self._left, 4), (self.middle, 3), self.bench, self.strip)
        body.setContentsMargins(0, 0, 0, 0)
        body.setSpacing(GRID)
        page = QWidget()
        self._below = scroll_area(panels)
        self._below.setMinimumHeight(1)  # the current step is complete even in a low window
        vbox(self.notice, self.to_do, (self._below, 1), on=page, spacing=GRID)
        self.rooms.addWidget(page)
        room = vbox(self.header, (self.rooms, 1), spacing=GRID)
        hbox(self.rail, (room, 1), on=window, margins=(GRID, GRID // 2, GRID, GRID), spacing=GRID)
        return window


class _Panels(QHBoxLayout):
    """The panels in a row, scrolled only if the window is lower than their least heights."""

    def hasHeightForWidth(self) -> bool:
        """Return False: a scroll area would give panels with wrapped text their preferred height."""
        return False
