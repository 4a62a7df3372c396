"""The deforming finger with its SED in colour, true to scale, and the SED along the skin at the receptor's depth."""

from typing import Any

import numpy as np
import pyqtgraph  # pyright: ignore[reportMissingTypeStubs]
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QSizePolicy, QWidget

from daq_app.live_model import Picture
from daq_app.plot_scale import PlotScale
from daq_app.qt.tokens import MODEL, SMALL, Tokens, font
from daq_app.view_model import ModelWords
from solver.receptor import ROW

pg: Any = pyqtgraph  # it has no types
Array = NDArray[np.float64]

SHOWN = (-9.0, 9.0, -1.0, 13.0)  # left, right, below, above of what is drawn [mm]
PART = 0.62  # of the height that the finger takes; the row has the rest
SHADES = 128
TOP = 0.97  # of the faces' SED lies below the end of the colour scale


class FingerView(QWidget):
    """A picture of the last state of a model."""

    def __init__(self, tokens: Tokens, scale: float) -> None:
        """Show nothing yet."""
        super().__init__()
        self._tokens, self._scale = tokens, scale
        self._picture: Picture | None = None
        self._row: Array = np.empty(0)
        self._words = ModelWords("", "none")
        self._colours = PlotScale(0.0, 5.0, 5.0)  # [kPa]
        self._heights = PlotScale(0.0, 5.0, 5.0)  # [kPa]
        shades: Any = pg.colormap.get("magma")
        table = shades.map(np.linspace(1.0, 0.2, SHADES), mode="byte")
        self._shades = [QColor(int(r), int(g), int(b)) for r, g, b, *_ in table]
        self.setMinimumSize(100, 1)  # it is folded where it is low
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setAccessibleName("finger as the model sees it")

    def set_tokens(self, tokens: Tokens) -> None:
        """Follow another theme."""
        self._tokens = tokens
        self.update()

    def show_model(self, picture: Picture | None, row: Array, words: ModelWords, clock: float) -> None:
        """Show a state; `row` (r,) [MPa] at `solver.receptor.ROW`, `clock` [s] is for the scales' patience."""
        if picture is self._picture and words == self._words:
            return
        self._picture, self._row, self._words = picture, 1000.0 * row, words
        if picture is not None and len(picture.sed):
            self._colours = self._colours.following(0.0, 1000.0 * float(np.quantile(picture.sed, TOP)), clock)
        known = self._row[np.isfinite(self._row)]
        if len(known):
            self._heights = self._heights.following(0.0, float(known.max()), clock)
        self.setAccessibleName(f"finger as the model sees it: {words.words}")
        self.setToolTip(words.words)
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:  # noqa: ARG002, N802  Qt's name
        """Paint words, finger and row."""
        painter = QPainter(self)
        painter.setFont(font(SMALL, self._scale, bold=self._words.state in ("settled", "beyond")))
        painter.setPen(QColor(self._tokens.look if self._words.state == "beyond" else self._tokens.quiet))
        line = painter.fontMetrics().height()
        box = QRectF(4, 0, self.width() - 8, 2 * line)
        painter.drawText(box, int(Qt.TextFlag.TextWordWrap | Qt.AlignmentFlag.AlignTop), self._words.words)
        painter.setFont(font(SMALL, self._scale))
        top = 2.0 * line + 4
        room = self.height() - top
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        self._paint_finger(painter, QRectF(0, top, self.width(), room * PART))
        self._paint_row(painter, QRectF(0, top + room * PART, self.width(), room * (1.0 - PART)))

    def _paint_finger(self, painter: QPainter, box: QRectF) -> None:
        left, right, below, above = SHOWN
        per_mm = min(box.width() / (right - left), box.height() / (above - below))
        if per_mm < 1.0:
            return
        origin = QPointF(box.center().x() - per_mm * (left + right) / 2.0, box.bottom() + per_mm * below)

        def placed(points: Array) -> list[QPointF]:
            x, y = origin.x() + per_mm * points[:, 0], origin.y() - per_mm * points[:, 1]
            return [QPointF(a, b) for a, b in zip(x.tolist(), y.tolist(), strict=True)]

        painter.save()
        painter.setClipRect(box)
        painter.setPen(QPen(QColor(self._tokens.quiet), 2))
        painter.drawLine(QPointF(box.left(), origin.y()), QPointF(box.right(), origin.y()))
        picture = self._picture
        if picture is not None:
            if len(picture.faces):
                painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
                painter.setPen(Qt.PenStyle.NoPen)
                points = placed(picture.nodes)
                part = 1000.0 * picture.sed / self._colours.high
                shades: list[int] = (np.clip(np.nan_to_num(part), 0.0, 1.0) * (SHADES - 1)).astype(int).tolist()
                faces: list[list[int]] = picture.faces.tolist()
                for face, shade in zip(faces, shades, strict=True):
                    painter.setBrush(self._shades[shade])
                    painter.drawPolygon(QPolygonF([points[node] for node in face]))
                painter.setRenderHint(QPainter.RenderHint.Antialiasing, True)
            style = Qt.PenStyle.SolidLine if self._words.state == "settled" else Qt.PenStyle.DashLine
            painter.setPen(QPen(QColor(self._tokens.text), 1.5, style))
            painter.drawPolyline(QPolygonF(placed(picture.outline)))
        painter.restore()
        painter.setPen(QColor(self._tokens.quiet))
        painter.drawText(
            box.adjusted(4, 0, -4, -2),
            Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignTop,
            f"0 to {self._colours.high:g} kPa",
        )

    def _paint_row(self, painter: QPainter, box: QRectF) -> None:
        line = painter.fontMetrics().height()
        plot = box.adjusted(6, line, -6, -line)
        painter.setPen(QColor(self._tokens.quiet))
        painter.drawText(box, Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop, "  SED along the skin [kPa]")
        painter.drawText(
            box.adjusted(0, 0, -6, 0),
            Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignTop,
            f"{self._heights.high:g}",
        )
        ends = (f"  {ROW[0]:g} mm proximal".replace("-", ""), f"{ROW[-1]:g} mm distal")
        painter.drawText(box, Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignBottom, ends[0])
        painter.drawText(box.adjusted(0, 0, -6, 0), Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignBottom, ends[1])
        if plot.height() < 10:
            return
        painter.setPen(QPen(QColor(self._tokens.line), 1))
        painter.drawLine(plot.bottomLeft(), plot.bottomRight())
        across = (ROW - ROW[0]) / (ROW[-1] - ROW[0])
        here = plot.left() + plot.width() * float(-ROW[0] / (ROW[-1] - ROW[0]))
        painter.setPen(QPen(QColor(self._tokens.quiet), 1, Qt.PenStyle.DotLine))
        painter.drawLine(QPointF(here, plot.top()), QPointF(here, plot.bottom()))
        if len(self._row) != len(ROW):
            return
        known = np.isfinite(self._row)
        x = plot.left() + plot.width() * across[known]
        y = plot.bottom() - plot.height() * self._row[known] / self._heights.high
        style = Qt.PenStyle.SolidLine if self._words.state == "settled" else Qt.PenStyle.DashLine
        painter.setPen(QPen(QColor(MODEL), 2, style))
        painter.drawPolyline(QPolygonF([QPointF(a, b) for a, b in zip(x.tolist(), y.tolist(), strict=True)]))
