"""What the card of the transducer begins with: connect, zero, and what is known of the device."""

from collections.abc import Callable

from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout, QWidget

from daq_app.qt.parts import bare, button, label, say
from daq_app.qt.tokens import GRID
from daq_app.window.view_bench import BenchView, bench_summary
from daq_app.wording import tr


class TransducerRow(QWidget):
    """Two buttons and a few lines of words; `act` does what a button stands for."""

    def __init__(self, act: Callable[[str], None]) -> None:
        """Show no transducer."""
        super().__init__()
        self.connect_button = button(tr("Connect"), tr("connect the transducer"), lambda: act("connect"))
        self.zero = button(tr("Zero  T"), tr("measure the zero of the transducer"), lambda: act("tare"))
        self.words = label("", "quiet", wrap=True)
        buttons = QHBoxLayout()
        buttons.addWidget(self.connect_button, 1)
        buttons.addWidget(self.zero, 1)
        layout = bare(QVBoxLayout(self), GRID // 2)
        layout.addLayout(buttons)
        layout.addWidget(self.words)

    def show_view(self, view: BenchView) -> None:
        """Show which transducer it is, its zero, noise and life, and what can be done with it."""
        connected = view.lamp != "off"
        act = tr("Disconnect") if connected else tr("Connect")
        say(self.words, bench_summary(view))
        self.connect_button.setText(act)
        self.connect_button.setAccessibleName(tr("{act} the transducer", act=act))
        self.connect_button.setEnabled(not connected or view.connect is not None)
        self.zero.setEnabled(view.can_tare)
