"""Who decides about a stroke's windows and why, and the way back."""

from PySide6.QtCore import QSettings, Signal
from PySide6.QtWidgets import QHBoxLayout, QLineEdit, QVBoxLayout, QWidget

from daq_app.analyst import messages as m
from daq_app.qt.parts import Wrapped, button, label
from daq_app.qt.remembered import type_scale
from daq_app.qt.tokens import GRID
from daq_app.wording import tr

BY = "analyst/by"  # where the code is remembered
NOBODY = "analyst"  # who decided, where nobody gave a code
DRAGGED = "dragged by hand"


class DecisionsBar(QWidget):
    """A code, a reason, undo and redo; under them what was decided about the chosen stroke."""

    asked = Signal(object)

    def __init__(self) -> None:
        """Remember who decided last."""
        super().__init__()
        self.by = QLineEdit(str(QSettings().value(BY, "")))
        self.by.setPlaceholderText(NOBODY)
        self.by.setAccessibleName(tr("code of who decides; never a name"))
        self.by.setMaximumWidth(round(110 * type_scale()))
        self.by.editingFinished.connect(lambda: QSettings().setValue(BY, self.by.text()))
        self.why = QLineEdit()
        self.why.setPlaceholderText(DRAGGED)
        self.why.setAccessibleName(tr("why an edge is moved"))
        self.undo = button(
            tr("Undo"), tr("undo the last decision, Ctrl+Z"), lambda: self.take_back(again=False), "small"
        )
        self.redo = button(
            tr("Redo"), tr("redo what was undone, Ctrl+Shift+Z"), lambda: self.take_back(again=True), "small"
        )
        self.told = Wrapped("value", "look")
        line = QHBoxLayout()
        line.setSpacing(GRID // 2)
        line.addWidget(label(tr("by"), "quiet"))
        line.addWidget(self.by)
        line.addWidget(label(tr("why"), "quiet"))
        line.addWidget(self.why, 1)
        line.addWidget(self.undo)
        line.addWidget(self.redo)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(GRID // 2)
        layout.addLayout(line)
        layout.addWidget(self.told)

    def who(self) -> str:
        """Return the code of who decides."""
        return self.by.text().strip() or NOBODY

    def reason(self) -> str:
        """Return why."""
        return self.why.text().strip() or DRAGGED

    def take_back(self, *, again: bool) -> None:
        """Undo the last decision, or redo the last that was undone."""
        self.asked.emit(m.Undo(self.who(), again))

    def show_decided(self, sentences: tuple[str, ...]) -> None:
        """Show what was decided about a stroke."""
        self.told.show_text("\n".join(f"✎ {sentence}" for sentence in sentences))
