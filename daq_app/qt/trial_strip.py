"""The strip of tiles above the signals: every trial of the session, each to be inspected."""

from collections.abc import Callable

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QHBoxLayout, QPushButton, QScrollArea, QWidget

from daq_app.qt.parts import bare, button, regrade
from daq_app.qt.tokens import GRID, SMALL, TARGET
from daq_app.window.view_trials import MARKS, Tile
from daq_app.wording import tr

GRADES = {"flawed": "wrong", "current": "current", "coming": "coming"}  # of the style sheet


class TrialStrip(QScrollArea):
    """One row of tiles, which moves sideways where it is longer than its room; the trial in hand stays in sight."""

    def __init__(self, scale: float, inspect: Callable[[int], None]) -> None:
        """Show no trials; `inspect` is called with the number of the trial whose tile is pressed."""
        super().__init__()
        self._inspect = inspect
        self._scale = scale
        self._shown: tuple[Tile, ...] = ()
        self.horizontalScrollBar().rangeChanged.connect(self._keep_in_sight)  # new tiles have their places then
        self.tiles: list[QPushButton] = []
        inside = QWidget()
        inside.setObjectName("inside")
        self._row = bare(QHBoxLayout(inside), GRID // 2)
        self._row.addStretch(1)
        self.setWidget(inside)
        self.setWidgetResizable(True)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setAccessibleName(tr("trials of the session"))
        self.setStyleSheet("QScrollArea, QWidget#inside { background: transparent; border: none; }")
        lines = round((2 * SMALL + 2 * GRID) * scale)
        self.setFixedHeight(max(lines, TARGET) + 12 + GRID // 2)  # with the scroll bar

    def show_tiles(self, tiles: tuple[Tile, ...]) -> None:
        """Show the trials."""
        if tiles == self._shown:
            return
        while len(self.tiles) > len(tiles):
            gone = self.tiles.pop()
            gone.hide()  # until it is deleted nobody can press it
            gone.deleteLater()
        while len(self.tiles) < len(tiles):
            self._add()
        for tile_button, tile in zip(self.tiles, tiles, strict=True):
            text = f"{MARKS[tile.kind]} {tile.number}\n{tile.code}"
            if tile_button.text() != text:
                tile_button.setText(text)
            tile_button.setAccessibleName(tile.words)
            tile_button.setToolTip(tile.words)
            regrade(tile_button, GRADES.get(tile.kind, ""))
        self._shown = tiles
        self._keep_in_sight()

    def show_inspected(self, number: int | None) -> None:
        """Show which trial is inspected; None: none is."""
        for tile_button, tile in zip(self.tiles, self._shown, strict=True):
            tile_button.setChecked(tile.number == number)

    def _keep_in_sight(self) -> None:
        current = next((at for at, tile in enumerate(self._shown) if tile.kind == "current"), None)
        if current is not None:
            self.ensureWidgetVisible(self.tiles[current], 8 * GRID, 0)

    def _add(self) -> None:
        at = len(self.tiles)
        tile_button = button("", tr("trial"), lambda: self._inspect(self._shown[at].number), "tile")
        tile_button.setCheckable(True)
        tile_button.setFocusPolicy(Qt.FocusPolicy.TabFocus)  # a click leaves Space to the primary button
        self.tiles.append(tile_button)
        self._row.insertWidget(at, tile_button)
