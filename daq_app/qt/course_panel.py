"""The course of a session: the plan with what is done, in hand and coming, and what else can be done now."""

from collections.abc import Callable

from PySide6.QtCore import Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import (
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QListWidget,
    QListWidgetItem,
    QPushButton,
    QStackedWidget,
    QVBoxLayout,
    QWidget,
)

from daq_app.qt.parts import EntryLine, bare, button, label, say
from daq_app.qt.subject_picture import Mirror
from daq_app.qt.tokens import GRID, TARGET
from daq_app.window.messages import Message
from daq_app.window.view_course import Button, CourseView, PlanRow
from daq_app.wording import tr
from sessions.run import steps

ROOMY = 560  # at which a picture of the subject's page has room beneath the plan, before the font's scale [px]


class CoursePanel(QFrame):
    """The left of the experimenter's window while a session is in hand."""

    def __init__(self, scale: float, send: Callable[[Message], None]) -> None:
        """Show no plan; `send` takes what is done."""
        super().__init__()
        self.setProperty("role", "panel")
        self.setAccessibleName(tr("course of the session"))
        self._send = send
        self._view: CourseView | None = None
        self._asking = ""
        self._asked_for = ""  # the question that stands over the line
        self.plan = QListWidget()
        self.plan.setAccessibleName(tr("plan: trials done, in hand and coming"))
        self.plan.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.redo = button(tr("Redo R"), tr("redo the trial, with a reason"), lambda: self.ask("redo"), "small")
        self.skip = button(tr("Skip S"), tr("skip the trial, with a reason"), lambda: self.ask("skip"), "small")
        self.pause = button(tr("Pause P"), tr("pause"), self._pause, "small")
        self.note = button(tr("Note N"), tr("write a note"), lambda: self.ask("note"), "small")
        self.no_answer = button(
            tr("No answer 0"), tr("the subject gives no answer"), lambda: self.ask("no answer"), "small"
        )
        self.end = button(tr("End Ctrl+E"), tr("end the session, with a reason"), self._end, "small")
        self._all = (self.skip, self.redo, self.pause, self.note, self.no_answer, self.end)
        self.line = EntryLine(self._keep, self.leave)
        self.line.setAccessibleName(tr("reason or note"))
        self._question = label("", wrap=True)
        self._bottom = QStackedWidget()
        self._bottom.addWidget(self._actions(3 if scale <= 1.0 else 2))
        self._bottom.addWidget(self._entry_row(scale))
        self._timer = label("", "quiet")
        self.mirror = Mirror(scale)
        self._roomy = round(ROOMY * min(scale, 1.4))
        head = QHBoxLayout()
        head.addWidget(label(tr("Plan"), "section"), 1)
        head.addWidget(self._timer)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(int(1.5 * GRID), GRID, int(1.5 * GRID), GRID)
        layout.setSpacing(GRID)
        layout.addLayout(head)
        layout.addWidget(self.plan, 1)
        layout.addWidget(self.mirror)
        layout.addWidget(self._bottom)

    @property
    def asking(self) -> bool:
        """Say whether a reason or note is being typed."""
        return self._bottom.currentIndex() == 1

    def show_view(self, view: CourseView) -> None:
        """Show the course."""
        before, self._view = self._view, view
        say(
            self._timer, tr("waiting {timer}", timer=view.timer) if view.timer else "", tr("Time since this was asked:")
        )
        if before is not None and before.rows == view.rows and _buttons(before) == _buttons(view):
            return
        if before is None or before.rows != view.rows:
            self._show_rows(view.rows)
        for widget, shown in zip(
            (self.redo, self.skip, self.pause, self.note, self.no_answer, self.end), _buttons(view), strict=True
        ):
            _show_button(widget, shown)

    def ask(self, what: str) -> None:
        """Ask for the reason of a redo or skip, or for a note; a redo whose reason is known is sent at once."""
        view = self._view
        if view is None:
            return
        shown = {
            "redo": view.redo,
            "skip": view.skip,
            "note": view.note,
            "no answer": view.no_answer,
            "end": view.end,
        }[what]
        if not shown.enabled:
            return
        if shown.sends is not None:
            self._send(shown.sends)
            return
        self._asking = what
        self._asked_for = shown.question
        say(self._question, shown.question)
        self.line.setAccessibleName(shown.question)
        self.line.clear()
        self._bottom.setCurrentIndex(1)
        self.line.setFocus()

    def leave(self) -> None:
        """Ask for nothing any more."""
        if self.asking:
            self.window().setFocus()
            self._bottom.setCurrentIndex(0)

    def _keep(self) -> None:
        text = self.line.text().strip()
        if not text:
            say(self._question, tr("{asked_for} A word is enough; Esc leaves it.", asked_for=self._asked_for))
            return
        messages: dict[str, Callable[[str], Message]] = {
            "redo": steps.Redo,
            "skip": steps.Skip,
            "note": steps.Note,
            "end": steps.Abort,
        }
        self.leave()
        self._send(messages[self._asking](text))

    def _pause(self) -> None:
        if self._view is not None and self._view.pause.enabled and self._view.pause.sends is not None:
            self._send(self._view.pause.sends)

    def _end(self) -> None:
        self.ask("end")

    def _actions(self, columns: int) -> QWidget:
        page = QWidget()
        grid = bare(QGridLayout(page), GRID)
        for at, widget in enumerate(self._all):
            grid.addWidget(widget, at // columns, at % columns)
        self.plan.setMinimumHeight(3 * TARGET // 2)
        return page

    def _entry_row(self, scale: float) -> QWidget:
        page = QWidget()
        layout = bare(QVBoxLayout(page), GRID)
        layout.addStretch(1)
        layout.addWidget(self._question)
        layout.addWidget(self.line)
        row = QHBoxLayout()
        row.addWidget(button(tr("Keep  Enter"), tr("keep what was typed"), self._keep))
        row.addWidget(button(tr("Leave  Esc"), tr("leave it"), self.leave))
        layout.addLayout(row)
        page.setMinimumHeight(round(88 * scale))
        return page

    def _show_rows(self, rows: tuple[PlanRow, ...]) -> None:
        while self.plan.count() > len(rows):
            self.plan.takeItem(self.plan.count() - 1)
        for at, row in enumerate(rows):
            item = self.plan.item(at)
            if item is None:  # pyright: ignore[reportUnnecessaryComparison]  Qt returns None beyond the last
                item = QListWidgetItem()
                self.plan.addItem(item)
            text = f"{row.name}   {row.outcome}" if row.kind == "block" else f"{row.mark}  {row.name}   {row.outcome}"
            if item.text() != text:
                item.setText(text)
            item.setData(Qt.ItemDataRole.AccessibleTextRole, f"{row.kind}: {row.name} {row.outcome}")
            typeface = self.plan.font()
            typeface.setBold(row.kind in ("block", "current"))
            item.setFont(typeface)
            if row.kind == "current":
                self.plan.scrollToItem(item, QListWidget.ScrollHint.EnsureVisible)

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802  Qt's name
        """Fold the picture of the subject's page where the plan needs the room."""
        super().resizeEvent(event)
        self.mirror.open.set_room(self.height() >= self._roomy)


def _buttons(view: CourseView) -> tuple[Button, ...]:
    return (view.redo, view.skip, view.pause, view.note, view.no_answer, view.end)


def _show_button(widget: QPushButton, shown: Button) -> None:
    widget.setText(f"{shown.label} {tr(shown.key)}".strip())
    widget.setEnabled(shown.enabled)
