"""Every text that a widget paints by hand, with the room that it has."""

from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from runpy import run_path

import pytest
from PySide6.QtCore import QPointF, QRectF, QSizeF, Qt
from PySide6.QtGui import QFontMetricsF, QPainter, QPicture

from daq_app.qt.painting import PaintedWidget

contrast = run_path(str(Path(__file__).parents[3] / "docs" / "looks.py"))["contrast"]  # of two colours
ROUNDING = 2.0  # of a letter that leans over the edge of its advance [px]


@dataclass(frozen=True)
class PaintedText:
    words: str
    place: QRectF  # that the whole of it takes
    room: QRectF  # in which it is seen
    ink: QRectF  # of its letters: less high than its line

    @property
    def is_cut(self):
        return not self.room.adjusted(-ROUNDING, -ROUNDING, ROUNDING, ROUNDING).contains(self.place)

    def collides(self, other):
        overlap = self.ink.intersected(other.ink)
        return min(overlap.width(), overlap.height()) > ROUNDING


def painted_texts(widget):
    """Return every text that a widget paints, its ground painted anew."""
    if isinstance(widget, PaintedWidget):
        widget.redraw()
    with _noting() as texts:
        widget.grab()
    return [text for text in texts if text.words]


def cut_or_colliding(widget):
    """Return the painted texts that are not wholly seen, and pairs of them that lie on each other."""
    texts = painted_texts(widget)
    partial = [(text.words, text.place, text.room) for text in texts if text.is_cut]
    pairs = [(a.words, b.words) for at, a in enumerate(texts) for b in texts[at + 1 :] if a.collides(b)]
    return partial + pairs


def paints_by_hand(widget):
    """Say whether the project's own code paints a widget."""
    return any(
        name in vars(kind) and kind.__module__.startswith("daq_app")
        for kind in type(widget).__mro__
        for name in ("paintEvent", "drawForeground")
    )


@contextmanager
def _noting():
    texts = []

    def note_texts(draw):
        def note_and_draw(painter, *arguments):
            if not isinstance(painter.device(), QPicture):  # as pyqtgraph's axes, which are measured by themselves
                texts.append(_text(painter, arguments))
            draw(painter, *arguments)

        return note_and_draw

    with pytest.MonkeyPatch.context() as patch:
        for name in ("drawText", "drawStaticText"):
            patch.setattr(QPainter, name, note_texts(getattr(QPainter, name)))
        yield texts


def _text(painter, arguments):
    """Return a text by what `QPainter.drawText` or `drawStaticText` is given."""
    device = painter.device()
    room = QRectF(0.0, 0.0, device.width(), device.height())
    at, *flags, words = arguments
    if isinstance(at, QPointF):
        metrics = QFontMetricsF(painter.font())
        if isinstance(words, str):
            place = QRectF(at.x(), at.y() - metrics.ascent(), metrics.horizontalAdvance(words), metrics.height())
        else:
            place, words = QRectF(at, QSizeF(words.size())), words.text()
    else:
        box = QRectF(at)
        mode = int(flags[0]) if flags else int(Qt.TextFlag.TextWordWrap)
        place = painter.boundingRect(box, mode, words)
        if not mode & int(Qt.TextFlag.TextDontClip):
            room = room.intersected(painter.worldTransform().mapRect(box))
    if painter.hasClipping():
        room = room.intersected(painter.worldTransform().mapRect(painter.clipBoundingRect()))
    ink, metrics = place, QFontMetricsF(painter.font())
    if place.height() < 1.5 * metrics.height():
        ink = metrics.tightBoundingRect(words).translated(place.left(), place.top() + metrics.ascent())
    onto = painter.worldTransform()
    return PaintedText(words, onto.mapRect(place), room, onto.mapRect(ink))
