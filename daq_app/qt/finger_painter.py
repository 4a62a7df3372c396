"""Paints a state of the model's finger: a field in colour, layers, and the contact with its tractions."""

import itertools
from dataclasses import dataclass

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPen, QPolygonF

from daq_app.analyst.frame import Box, FieldChoice, Frame, Line, Range, View, halve_triangles, visible
from daq_app.qt.painting import fill_faces, mark_failed_solve, sheer
from daq_app.qt.tokens import Tokens
from daq_app.wording import tr, tr_noop
from drivers.arrays import Array

_ARROWS, _LONGEST = 22, 1.5  # most traction arrows, and the longest of them [mm]
TRACTIONS = _LONGEST + 0.4  # room below the surface for the arrows and the line of contact states [mm]
_NEAR = (4.6, 4.4)  # half width and height above the surface of the close view [mm]
_COARSE = 40.0  # area of a triangle on the screen above which it is shaded in four, to hide its steps [pixel2]
STYLES = {"slip": Qt.PenStyle.SolidLine, "cap": Qt.PenStyle.DashLine, "stick": Qt.PenStyle.DotLine}
STATE_WORDS = {"slip": tr_noop("slips"), "cap": tr_noop("slips at the bound"), "stick": tr_noop("sticks")}


@dataclass(frozen=True, slots=True)
class Look:
    """Display options of a state."""

    field: FieldChoice
    range: Range  # of the colours, in the field's own unit
    near: bool = False  # the contact only
    mesh: bool = False
    lost: tuple[float, float] | None = None  # a marked point [mm]


def whole_box(frame: Frame, look: Look) -> Box:
    """Return left, right, below and above of the initial view [mm]."""
    if not look.near:
        x, y = frame.nodes[:, 0], frame.nodes[:, 1]
        return float(x.min()) - 0.5, float(x.max()) + 0.5, -TRACTIONS, float(y.max()) + 0.3
    positions: list[float] = frame.contact.x.tolist()
    touching = [x for x, state in zip(positions, frame.contact.state, strict=True) if state != "open"]
    middle = (min(touching) + max(touching)) / 2.0 if touching else 0.0
    half, above = _NEAR
    return middle - half, middle + half, -TRACTIONS, above


@dataclass(frozen=True, slots=True)
class FingerPainter:
    """Paints one frame in a view."""

    painter: QPainter
    tokens: Tokens
    view: View
    box: QRectF
    frame: Frame

    def paint(self, look: Look, shades: list[QColor], line: Line | None) -> None:
        painter, ink, box = self.painter, QColor(self.tokens.text), self.box
        ground = self._to_screen(np.array([[0.0, 0.0]]))[0].y()
        painter.save()
        painter.setClipRect(box)
        below = QRectF(box.left(), max(ground, box.top()), box.width(), box.bottom() - max(ground, box.top()))
        painter.fillRect(below, sheer(self.tokens.quiet, 40))
        self._paint_tissue(look, shades)
        if look.mesh:
            self._paint_mesh()
        self._paint_outlines()
        painter.setPen(QPen(ink, 1.4))
        painter.drawLine(QPointF(box.left(), ground), QPointF(box.right(), ground))
        self._paint_contact(ground)
        if look.lost is not None:
            mark_failed_solve(painter, self._to_screen(np.array([look.lost]))[0], self.tokens)
        if line is not None:
            self._paint_line(line)
        painter.restore()

    def _to_screen(self, points: Array) -> list[QPointF]:
        rows: list[list[float]] = self.view.to_screen(points).tolist()
        return [QPointF(x, y) for x, y in rows]

    def _paint_tissue(self, look: Look, shades: list[QColor]) -> None:
        frame, box = self.frame, self.box
        region = self.view.visible(box.left(), box.top(), box.width(), box.height())
        nodes, values = frame.nodes, look.field.values_of(frame)
        triangles = visible(nodes, frame.mesh.triangles, region)
        if len(triangles) and box.width() * box.height() / len(triangles) > _COARSE:
            nodes, values, triangles = halve_triangles(nodes, values, triangles)
        low, high = look.range
        fraction = (values[triangles].mean(axis=1) - low) / (high - low)
        fill_faces(self.painter, self.view.to_screen(nodes)[triangles], fraction, shades, edges=True)

    def _paint_mesh(self) -> None:
        self.painter.setPen(QPen(sheer("black", 110), 0.6))
        points = self._to_screen(self.frame.nodes)
        around: list[list[int]] = self.frame.mesh.elements.tolist()
        for element in around:
            if any(self.box.contains(points[node]) for node in element):
                self.painter.drawPolygon([points[node] for node in element])

    def _paint_outlines(self) -> None:
        painter, ink = self.painter, QColor(self.tokens.text)
        for name, outline in self.frame.outlines.items():
            # lines on the tissue's colours are black in both themes, since the colours there are mostly pale
            painter.setPen(QPen(ink if name in ("skin", "bone") else QColor("black"), 1.4 if name == "skin" else 0.7))
            if name == "bone":
                painter.setBrush(QColor(self.tokens.surface))
                bone = QPolygonF(self._to_screen(outline))
                painter.drawPolygon(bone)
                painter.setBrush(Qt.BrushStyle.NoBrush)
                self._name_bone(bone, self._to_screen(outline.mean(axis=0)[None])[0])
            else:
                painter.drawPolyline(QPolygonF(self._to_screen(outline)))
        self._in_two(QPolygonF(self._to_screen(self.frame.patch)))

    def _name_bone(self, bone: QPolygonF, middle: QPointF) -> None:
        """Write the bone's name only if it fits into the bone: it would be illegible on the colours around."""
        name = tr("bone")
        box = self.painter.fontMetrics().boundingRect(name).toRectF()
        box.moveCenter(middle)
        corners = (box.topLeft(), box.topRight(), box.bottomLeft(), box.bottomRight())
        if all(bone.containsPoint(corner, Qt.FillRule.OddEvenFill) for corner in corners):
            self.painter.drawText(box, Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextDontClip, name)

    def _paint_line(self, line: Line) -> None:
        points = self._to_screen(np.array(line))
        self._in_two(QPolygonF(points))
        for name, point in zip("AB", points, strict=True):
            self.painter.setBrush(QColor("white"))
            self.painter.drawEllipse(point, 8.0, 8.0)
            self.painter.setBrush(Qt.BrushStyle.NoBrush)
            self.painter.drawText(QRectF(point.x() - 9, point.y() - 9, 18, 18), Qt.AlignmentFlag.AlignCenter, name)

    def _in_two(self, polygon: QPolygonF) -> None:
        """Draw a line black on white, visible on every colour."""
        for colour, width in ((QColor("white"), 3.2), (QColor("black"), 1.4)):
            self.painter.setPen(QPen(colour, width))
            self.painter.drawPolyline(polygon)

    def _paint_contact(self, ground: float) -> None:
        """Draw tractions as arrows that end at their points of action, and below them the skin's contact states."""
        painter, contact, ink = self.painter, self.frame.contact, QColor(self.tokens.text)
        touching = [i for i, state in enumerate(contact.state) if state != "open"]
        if not touching:
            return
        points = np.column_stack([contact.x, np.zeros(len(contact.x))])
        positions: list[float] = self.view.to_screen(points)[:, 0].tolist()
        strongest = float(np.hypot(contact.pressure, contact.traction)[touching].max())
        painter.setPen(QPen(ink, 1.0))
        for i in touching[:: max(1, -(-len(touching) // _ARROWS))] if strongest > 0.0 else ():
            reach = self.view.per_mm * _LONGEST / strongest
            tip = QPointF(positions[i], ground + 2.0)
            tail = QPointF(tip.x() - reach * contact.traction[i], tip.y() + reach * contact.pressure[i])
            painter.drawLine(tail, tip)
            painter.drawLine(tip, QPointF(tip.x() - 2.5, tip.y() + 4.0))
            painter.drawLine(tip, QPointF(tip.x() + 2.5, tip.y() + 4.0))
        level = ground + self.view.per_mm * (_LONGEST + 0.3)
        for state, run in itertools.groupby(zip(contact.state, positions, strict=True), key=lambda entry: entry[0]):
            if state == "open":
                continue
            stretch = [position for _, position in run]
            painter.setPen(QPen(ink, 3.0, STYLES[state], Qt.PenCapStyle.FlatCap))
            painter.drawLine(QPointF(stretch[0] - 1.5, level), QPointF(stretch[-1] + 1.5, level))
            text = tr(STATE_WORDS[state])
            box = QRectF(stretch[0], level + 2, stretch[-1] - stretch[0], painter.fontMetrics().height())
            if box.width() > painter.fontMetrics().horizontalAdvance(text) and self.box.contains(box):
                painter.drawText(box, Qt.AlignmentFlag.AlignHCenter, text)
