"""The plan of a session with finished, current and coming trials, and further actions."""

from collections.abc import Callable
from functools import partial

from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QGridLayout, QListWidget, QWidget

from daq_app.qt.keys import KEYS
from daq_app.qt.layout import hbox, stack_pages, vbox
from daq_app.qt.parts import EntryLine, Panel, RowList, button, label, set_text, whole_facts
from daq_app.qt.preferences import type_scale
from daq_app.qt.subject_picture import Mirror
from daq_app.qt.tokens import GRID, TARGET, px
from daq_app.window.state import Message
from daq_app.window.view_course import Button, CourseView, PlanRow
from daq_app.wording import tr
from sessions.run import steps

MESSAGES = {"redo": steps.Redo, "skip": steps.Skip, "note": steps.Note, "end": steps.Abort}  # messages with a text
ACTS = ("skip", "redo", "pause", "note", "no answer", "end")  # actions with a button
_DESCRIPTIONS = {name: key.description for key in KEYS for name in (key.key, key.act)}
_ROOMY = 560  # height from which a picture of the subject's page fits below the plan, before the font's scale [px]


class CoursePanel(Panel):
    """The left of the experimenter's window during a session."""

    def __init__(self, send: Callable[[Message], None]) -> None:
        super().__init__(tr("course of the session"))
        self._send = send
        self._view: CourseView | None = None
        self._act = ""
        self._question_text = ""  # the question above the line
        self.plan = RowList(tr("plan: trials done, current and to come"))
        self.buttons = {act: button("", tr(_DESCRIPTIONS[act]), partial(self.ask, act), "small") for act in ACTS}
        self.line = EntryLine(self._keep, self.leave)
        self.line.setAccessibleName(tr("reason or note"))
        self._question = label("", wrap=True)
        self._question.setMinimumHeight(2 * self._question.fontMetrics().lineSpacing())  # room for a long question
        acts, columns = QWidget(), 3 if type_scale() <= 1.0 else 2
        grid = QGridLayout(acts)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setSpacing(GRID)
        for index, widget in enumerate(self.buttons.values()):
            grid.addWidget(widget, index // columns, index % columns)
        self.plan.setMinimumHeight(3 * TARGET // 2)
        entry, self._do = QWidget(), button("", tr("do it"), self._keep)
        row = hbox((self._do, 1), (button(tr("Back  Esc"), tr("go back, and do nothing"), self.leave), 1))
        vbox(1, self._question, self.line, row, on=entry, spacing=GRID)
        self._bottom = stack_pages(acts, entry)
        self._timer = label("", "quiet")
        self.mirror = Mirror()
        header = hbox((label(tr("Plan"), "section"), 1), self._timer)
        margins = (int(1.5 * GRID), GRID, int(1.5 * GRID), GRID)
        vbox(header, (self.plan, 1), self.mirror, self._bottom, on=self, margins=margins, spacing=GRID)

    @property
    def asking(self) -> bool:
        return self._bottom.currentIndex() == 1

    def show_view(self, view: CourseView) -> None:
        previous, self._view = self._view, view
        wait = tr("waiting {timer}", timer=view.timer) if view.timer else ""
        set_text(self._timer, wait, tr("Time since this was asked:"))
        if previous is None or previous.rows != view.rows:
            self._show_rows(view.rows)
        for name, widget in self.buttons.items():
            entry = view.buttons[name]
            if previous is None or entry != previous.buttons[name]:
                widget.setText(f"{entry.label} {tr(entry.key)}".strip())
                meaning = tr(_DESCRIPTIONS.get(entry.key, _DESCRIPTIONS["no answer"]))
                widget.setAccessibleName(f"{entry.label}: {meaning}")
                widget.setEnabled(entry.enabled)

    def ask(self, act: str) -> None:
        """Ask for the reason of a redo or skip, or for a note; a redo with a known reason is sent immediately."""
        if self._view is None or not (entry := self._view.buttons[act]).enabled:
            return
        if entry.sends is not None:
            self._send(entry.sends)
            return
        self._act = act
        self._name_question(entry, entry.question)
        self.line.setAccessibleName(entry.question)
        self.line.setText("")  # unlike clear, it leaves nothing of the last text to Ctrl+Z
        self._bottom.setCurrentIndex(1)
        self.line.setFocus()

    def _name_question(self, entry: Button, text: str) -> None:
        """Show the question above the line, and the action of Enter on its button."""
        self._question_text = entry.question
        set_text(self._question, text)
        self._do.setText(f"{entry.label}  {tr('Enter')}")
        self._do.setAccessibleName(entry.label)

    def leave(self) -> None:
        if self.asking:
            self.window().setFocus()
            self._bottom.setCurrentIndex(0)

    def _keep(self) -> None:
        text = self.line.text().strip()
        if not text:
            set_text(self._question, tr("{asked_for} A word is enough; Esc leaves it.", asked_for=self._question_text))
            return
        entry = None if self._view is None else self._view.buttons[self._act]
        if entry and entry.question and entry.question != self._question_text:  # it would discard another trial
            self._name_question(entry, tr("The session has moved on. {question}", question=entry.question))
            return
        self.leave()
        self._send(MESSAGES[self._act](text))

    def _show_rows(self, rows: tuple[PlanRow, ...]) -> None:
        if self.plan.count() != len(rows):  # another session
            self.plan.clear()
            self.plan.addItems([""] * len(rows))
        for index, row in enumerate(rows):
            item = self.plan.item(index)
            facts = f"{row.mark}  {row.name}   {row.outcome}"
            item.setText(f"{row.name} {row.outcome}" if row.kind == "block" else whole_facts(facts))
            item.setData(Qt.ItemDataRole.AccessibleTextRole, f"{row.kind}: {row.name} {row.outcome}")
            typeface = self.plan.font()
            typeface.setBold(row.kind in ("block", "current"))
            item.setFont(typeface)
        self._keep_in_sight()

    def _keep_in_sight(self) -> None:
        """Scroll to the current trial."""
        kinds = [] if self._view is None else [row.kind for row in self._view.rows]
        if "current" in kinds and self.plan.count() == len(kinds):
            self.plan.scrollToItem(self.plan.item(kinds.index("current")), QListWidget.ScrollHint.EnsureVisible)

    def resizeEvent(self, event: QResizeEvent) -> None:
        self.mirror.open.set_room(self.height() >= px(_ROOMY, most=1.4))
        QTimer.singleShot(0, self, self._keep_in_sight)  # after the plan has its new height
