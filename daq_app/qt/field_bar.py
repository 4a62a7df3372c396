"""Which field is drawn over the finger, and where its colours begin and end."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QDoubleSpinBox, QHBoxLayout, QWidget

from daq_app.analyst.field_list import FIELD_CHOICES, FieldChoice, Range
from daq_app.qt.parts import bare, choice
from daq_app.qt.tokens import GRID, TARGET
from daq_app.wording import tr

ALL_TRIALS, OWN, FIXED = range(3)
LARGEST = 1e6  # in a number field: far beyond any stress or strain of tissue


class FieldBar(QWidget):
    """Two lists and two numbers."""

    changed = Signal()

    def __init__(self) -> None:
        """Offer the SED, with one range for all trials."""
        super().__init__()
        self._automatic: Range = (0.0, 1.0)
        self.which = choice(tr("field that is drawn"))
        self.which.addItems([tr(field.label) for field in FIELD_CHOICES])
        self.ranges = choice(tr("range of the colours"))
        self.ranges.addItems([tr("All trials"), tr("Own scale"), tr("Fixed")])
        self.low, self.high = _number(tr("colours begin at")), _number(tr("colours end at"))
        layout = bare(QHBoxLayout(self), GRID // 2)
        layout.addWidget(self.which, 3)
        layout.addWidget(self.ranges, 2)
        for number in (self.low, self.high):
            number.setVisible(False)
            number.valueChanged.connect(lambda: self.changed.emit())
            layout.addWidget(number)
        self.which.currentIndexChanged.connect(self._free)
        self.ranges.currentIndexChanged.connect(self._fix)

    @property
    def field(self) -> FieldChoice:
        """The field that is drawn."""
        return FIELD_CHOICES[max(self.which.currentIndex(), 0)]

    @property
    def mode(self) -> int:
        """`ALL_TRIALS`, `OWN` or `FIXED`."""
        return self.ranges.currentIndex()

    def range(self, automatic: Range) -> Range:
        """Return where colours begin and end: as given, or as somebody fixed them, the lesser number first."""
        self._automatic = automatic
        ends = sorted((self.low.value(), self.high.value()))
        return (ends[0], ends[1]) if self.mode == FIXED and ends[0] < ends[1] else automatic

    def fix(self, ends: Range) -> None:
        """Fix the colours at these ends."""
        self._automatic = ends
        self.ranges.setCurrentIndex(FIXED)
        self._fix()

    def _free(self) -> None:
        """Fit the colours to another field: numbers that were fixed are of another unit."""
        if self.mode == FIXED:
            self.ranges.setCurrentIndex(ALL_TRIALS)
        else:
            self.changed.emit()

    def _fix(self) -> None:
        """Begin fixed colours with those that were shown."""
        for number, end in zip((self.low, self.high), self._automatic, strict=True):
            number.setVisible(self.mode == FIXED)
            number.blockSignals(True)
            number.setSuffix(f" {self.field.unit}".removesuffix(" -"))
            number.setSingleStep((self._automatic[1] - self._automatic[0]) / 20.0)
            number.setValue(end)
            number.blockSignals(False)
        self.changed.emit()


def _number(name: str) -> QDoubleSpinBox:
    box = QDoubleSpinBox()
    box.setAccessibleName(name)
    box.lineEdit().setAccessibleName(name)
    box.setMinimumHeight(TARGET)
    box.setRange(-LARGEST, LARGEST)
    box.setDecimals(3)
    return box
