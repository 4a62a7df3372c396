"""Paints a state of the model's finger: SED in colour, layers, contact with its tractions, the row of receptors."""

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyqtgraph  # pyright: ignore[reportMissingTypeStubs]
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QBrush, QColor, QLinearGradient, QPainter, QPaintEvent, QPen, QPixmap, QPolygonF, QResizeEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from daq_app.analyst.frame import Frame, Parts, halved, seen, step_above
from daq_app.qt.indicators import paint_lost
from daq_app.qt.tokens import MODEL, SMALL, Tokens, font

pg: Any = pyqtgraph  # it has no types
Array = NDArray[np.float64]

Placed = Callable[[Array], list[QPointF]]  # where points (n, 2) [mm] are drawn
Box = tuple[float, float, float, float]  # left, right, below, above [mm]

NO_PARTS = Parts(np.empty((0, 3), np.int64), np.empty((0, 8), np.int64))
SHADES = 64
ARROWS, LONGEST = 22, 1.5  # tractions at most, and the longest of them [mm]
NEAR = (4.6, -2.6, 4.4)  # half width, below and above of the close view [mm]
ROW_PART = 0.24  # of the height that the row of receptors takes
STYLES = {"slip": Qt.PenStyle.SolidLine, "cap": Qt.PenStyle.DashLine, "stick": Qt.PenStyle.DotLine}
STATE_WORDS = {"slip": "slips", "cap": "slips at the bound", "stick": "sticks"}


@dataclass(frozen=True, slots=True)
class Look:
    """How a state is shown."""

    top: float  # end of the colours [kPa]
    near: bool = False  # the contact alone
    mesh: bool = False
    lost: tuple[float, float] | None = None  # a place that is marked [mm]


class FingerCanvas(QWidget):
    """A picture of one frame."""

    def __init__(self, tokens: Tokens, scale: float) -> None:
        """Show nothing yet."""
        super().__init__()
        self._tokens, self._scale = tokens, scale
        self._frame: Frame | None = None
        self._parts = NO_PARTS
        self._arcs: Array = np.empty(0)
        self._look = Look(1.0)
        self._words = ""
        self._kept: QPixmap | None = None
        shades: Any = pg.colormap.get("magma")
        table = shades.map(np.linspace(1.0, 0.2, SHADES), mode="byte")
        self._shades = [QColor(int(r), int(g), int(b)) for r, g, b, *_ in table]
        self.setMinimumSize(160, 260)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setAccessibleName("finger of the model: none")

    def show_frame(
        self,
        frame: Frame | None,
        parts: Parts,
        arcs: Array,
        words: str,
        look: Look,
    ) -> None:
        """Show a state, and how."""
        if frame is self._frame and (words, look) == (self._words, self._look):
            return
        self._frame, self._parts, self._arcs, self._words, self._look = frame, parts, arcs, words, look
        self._kept = None
        self.setAccessibleName(words or "finger of the model: none")
        self.update()

    def resizeEvent(self, event: QResizeEvent) -> None:  # noqa: N802  Qt's name
        """Paint anew at another size."""
        self._kept = None
        super().resizeEvent(event)

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: ARG002, N802  Qt's name
        """Paint the picture, or what was painted before."""
        if self._kept is None:
            ratio = self.devicePixelRatioF()
            self._kept = QPixmap(round(self.width() * ratio), round(self.height() * ratio))
            self._kept.setDevicePixelRatio(ratio)
            self._kept.fill(Qt.GlobalColor.transparent)
            painter = QPainter(self._kept)
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            painter.setFont(font(SMALL, self._scale))
            self._paint(painter)
            painter.end()
        QPainter(self).drawPixmap(0, 0, self._kept)

    def _paint(self, painter: QPainter) -> None:
        frame, line = self._frame, painter.fontMetrics().height()
        painter.setPen(QColor(self._tokens.quiet))
        words = QRectF(0, 0, self.width(), 2.2 * line)
        painter.drawText(words, int(Qt.AlignmentFlag.AlignLeft | Qt.TextFlag.TextWordWrap), self._words)
        if frame is None:
            return
        row = QRectF(0, self.height() * (1.0 - ROW_PART), self.width(), self.height() * ROW_PART)
        bar = QRectF(6, row.top() - 1.5 * line, self.width() - 12, line)
        self._paint_finger(painter, QRectF(0, words.bottom(), self.width(), bar.top() - words.bottom() - 4), frame)
        self._paint_bar(painter, bar)
        self._paint_row(painter, row, frame)

    def _paint_finger(self, painter: QPainter, box: QRectF, frame: Frame) -> None:
        left, right, below, above = self._shown(frame)
        per_mm = min(box.width() / (right - left), box.height() / (above - below))
        if per_mm < 1.0:
            return
        across, up = (box.width() / per_mm - (right - left)) / 2.0, box.height() / per_mm - (above - below)
        visible = (left - across, right + across, below, above + up)
        origin = QPointF(box.center().x() - per_mm * (left + right) / 2.0, box.bottom() + per_mm * below)

        def placed(points: Array) -> list[QPointF]:
            x, y = origin.x() + per_mm * points[:, 0], origin.y() - per_mm * points[:, 1]
            return [QPointF(a, b) for a, b in zip(x.tolist(), y.tolist(), strict=True)]

        painter.save()
        painter.setClipRect(box)
        ink = QColor(self._tokens.text)
        painter.fillRect(QRectF(box.left(), origin.y(), box.width(), box.bottom() - origin.y()), self._ground())
        self._paint_tissue(painter, placed, frame, visible)
        if self._look.mesh:
            self._paint_mesh(painter, placed(frame.nodes), box)
        for name, outline in frame.outlines.items():
            # what lies on the tissue's colours is black in both themes: they are pale where most lines are
            painter.setPen(QPen(ink if name in ("skin", "bone") else QColor("black"), 1.4 if name == "skin" else 0.7))
            painter.setBrush(QColor(self._tokens.surface) if name == "bone" else Qt.BrushStyle.NoBrush)
            if name == "bone":
                painter.drawPolygon(QPolygonF(placed(outline)))
                painter.drawText(placed(outline.mean(axis=0)[None])[0], "bone")
            else:
                painter.drawPolyline(QPolygonF(placed(outline)))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        for colour, width in ((QColor("white"), 3.2), (QColor("black"), 1.4)):
            painter.setPen(QPen(colour, width))
            painter.drawPolygon(QPolygonF(placed(frame.patch)))
        painter.setPen(QPen(ink, 1.4))
        painter.drawLine(QPointF(box.left(), origin.y()), QPointF(box.right(), origin.y()))
        self._paint_contact(painter, frame, origin, per_mm)
        if self._look.lost is not None:
            paint_lost(painter, placed(np.array([self._look.lost]))[0], self._tokens)
        painter.restore()

    def _shown(self, frame: Frame) -> Box:
        """Return left, right, below and above of what is drawn [mm]."""
        if not self._look.near:
            x, y = frame.nodes[:, 0], frame.nodes[:, 1]
            return float(x.min()) - 0.5, float(x.max()) + 0.5, -3.2, float(y.max()) + 0.3
        places: list[float] = frame.contact.x.tolist()
        touching = [x for x, state in zip(places, frame.contact.state, strict=True) if state != "open"]
        middle = (min(touching) + max(touching)) / 2.0 if touching else 0.0
        half, below, above = NEAR
        return middle - half, middle + half, below, above

    def _ground(self) -> QColor:
        made = QColor(self._tokens.quiet)
        made.setAlpha(40)
        return made

    def _paint_tissue(self, painter: QPainter, placed: Placed, frame: Frame, shown: Box) -> None:
        nodes, sed, triangles = seen(frame.nodes, frame.sed, self._parts.triangles, shown)
        if self._look.near:
            nodes, sed, triangles = halved(nodes, sed, triangles)
        points = placed(nodes)
        part = 1000.0 * sed[triangles].mean(axis=1) / self._look.top
        wanted = (np.clip(np.nan_to_num(part), 0.0, 1.0) * (SHADES - 1)).astype(np.int64)
        order = np.argsort(wanted, kind="stable")
        shades: list[int] = wanted[order].tolist()
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
        corners: list[list[int]] = triangles[order].tolist()
        last = -1
        for shade, (a, b, c) in zip(shades, corners, strict=True):
            if shade != last:
                painter.setPen(QPen(self._shades[shade], 0))
                painter.setBrush(self._shades[shade])
                last = shade
            painter.drawPolygon([points[a], points[b], points[c]])
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, True)

    def _paint_mesh(self, painter: QPainter, points: list[QPointF], box: QRectF) -> None:
        ink = QColor("black")
        ink.setAlpha(110)
        painter.setPen(QPen(ink, 0.6))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        around: list[list[int]] = self._parts.elements.tolist()
        for element in around:
            if box.contains(points[element[0]]) or box.contains(points[element[4]]):
                painter.drawPolygon([points[node] for node in element])

    def _paint_contact(self, painter: QPainter, frame: Frame, origin: QPointF, per_mm: float) -> None:
        """Draw tractions as arrows that end where they act, and under them what each stretch of skin does."""
        contact, ink = frame.contact, QColor(self._tokens.text)
        touching = [i for i, state in enumerate(contact.state) if state != "open"]
        if not touching:
            return
        strongest = float(np.hypot(contact.pressure, contact.traction)[touching].max())
        painter.setPen(QPen(ink, 1.0))
        for i in touching[:: max(1, -(-len(touching) // ARROWS))] if strongest > 0.0 else ():
            reach = per_mm * LONGEST / strongest
            tip = QPointF(origin.x() + per_mm * contact.x[i], origin.y() + 2.0)
            tail = QPointF(tip.x() - reach * contact.traction[i], tip.y() + reach * contact.pressure[i])
            painter.drawLine(tail, tip)
            painter.drawLine(tip, QPointF(tip.x() - 2.5, tip.y() + 4.0))
            painter.drawLine(tip, QPointF(tip.x() + 2.5, tip.y() + 4.0))
        level = origin.y() + per_mm * (LONGEST + 0.3)
        places: list[float] = (origin.x() + per_mm * contact.x).tolist()
        for state, run in itertools.groupby(zip(contact.state, places, strict=True), key=lambda one: one[0]):
            if state == "open":
                continue
            ends = [place for _, place in run]
            painter.setPen(QPen(ink, 3.0, STYLES[state], Qt.PenCapStyle.FlatCap))
            painter.drawLine(QPointF(ends[0] - 1.5, level), QPointF(ends[-1] + 1.5, level))
            words = STATE_WORDS[state]
            if ends[-1] - ends[0] > painter.fontMetrics().horizontalAdvance(words):
                box = QRectF(ends[0], level + 2, ends[-1] - ends[0], painter.fontMetrics().height())
                painter.drawText(box, Qt.AlignmentFlag.AlignHCenter, words)

    def _paint_bar(self, painter: QPainter, box: QRectF) -> None:
        words = f"SED 0 to {self._look.top:g} kPa"
        width = painter.fontMetrics().horizontalAdvance(words) + 8
        strip = QRectF(box.left(), box.top() + 3, max(box.width() - width, 1.0), box.height() - 6)
        gradient = QLinearGradient(strip.topLeft(), strip.topRight())
        for step in range(9):
            gradient.setColorAt(step / 8, self._shades[round(step / 8 * (SHADES - 1))])
        painter.fillRect(strip, QBrush(gradient))
        painter.setPen(QColor(self._tokens.quiet))
        painter.drawText(box, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter, words)

    def _paint_row(self, painter: QPainter, box: QRectF, frame: Frame) -> None:
        """Draw the SED of every receptor of the row; the one whose ending is outlined above is ringed."""
        line = painter.fontMetrics().height()
        plot = box.adjusted(8, line + 2, -8, -line)
        if plot.height() < 8 or len(frame.row) != len(self._arcs) or not len(self._arcs):
            return
        arcs, quiet = self._arcs, QColor(self._tokens.quiet)
        known = np.isfinite(frame.row)
        high = step_above(1000.0 * float(np.nanmax(frame.row[known], initial=0.0)))
        x = plot.left() + plot.width() * (arcs - arcs[0]) / (arcs[-1] - arcs[0])
        y = plot.bottom() - plot.height() * np.clip(1000.0 * frame.row / high, 0.0, 1.0)
        painter.setPen(quiet)
        painter.drawText(box, Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop, " receptors along the skin")
        painter.drawText(
            box.adjusted(0, 0, -8, 0), Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignTop, f"{high:g} kPa"
        )
        ends = (f" {-arcs[0]:g} mm proximal", f"{arcs[-1]:g} mm distal ")
        painter.drawText(box, Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignBottom, ends[0])
        painter.drawText(box, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignBottom, ends[1])
        painter.setPen(QPen(QColor(self._tokens.line), 1))
        painter.drawLine(plot.bottomLeft(), plot.bottomRight())
        painter.setPen(QPen(QColor(MODEL), 1.5))
        places = [QPointF(a, b) for a, b in zip(x[known].tolist(), y[known].tolist(), strict=True)]
        painter.drawPolyline(QPolygonF(places))
        for place in places:
            painter.drawEllipse(place, 1.8, 1.8)
        here = int(np.argmin(np.abs(arcs)))
        if known[here]:
            painter.setPen(QPen(QColor(self._tokens.text), 1.5))
            painter.drawEllipse(QPointF(float(x[here]), float(y[here])), 5.0, 5.0)
