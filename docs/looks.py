"""The page of the window's looks, made from its tokens: type, spacing, colours with their contrasts, and pictures."""

import dataclasses
import os
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

from PySide6.QtGui import QColor
from PySide6.QtWidgets import QApplication, QGridLayout, QLineEdit, QListWidget, QStyleFactory, QWidget

from daq_app.qt import tokens
from daq_app.qt.parts import button, label

THEMES = {"light": tokens.LIGHT, "dark": tokens.DARK}
PAIRS = (  # what is written on what
    *((text, ground) for text in ("text", "quiet", "wrong", "look") for ground in ("ground", "surface", "raised")),
    ("on_act", "act"),
    ("surface", "wrong"),
)


def page() -> str:
    """Return the page."""
    sizes = {"small": tokens.SMALL, "text": tokens.TEXT, "title": tokens.TITLE, "headline": tokens.HEADLINE}
    about = "Made from `daq_app/qt/tokens.py`. Sizes are in device-independent pixels."
    lines = ["# Looks of the window", "", about, ""]
    lines += table(("type", "size at 100 %", "at 200 %"), [(n, f"{size}", f"{2 * size}") for n, size in sizes.items()])
    lines += [f"Everything keeps to a grid of {tokens.GRID}. What is pressed is at least {tokens.TARGET} high.", ""]
    fields = [field.name for field in dataclasses.fields(tokens.Tokens)]
    rows = [(name, *(f"`{getattr(theme, name)}`" for theme in THEMES.values())) for name in fields]
    lines += ["## Colours", "", *table(("token", *THEMES), rows)]
    about = "Ratios as WCAG 2.1 has them. Text needs 4.5. A selected row is `on_act` on `act`."
    lines += ["## Contrast", "", about, ""]
    contrasts = [
        (f"{ink} on {ground}", *(f"{contrast(getattr(t, ink), getattr(t, ground)):.1f}" for t in THEMES.values()))
        for ink, ground in PAIRS
    ]
    lines += table(("written on", *THEMES), contrasts)
    lines += ["## Pictures", "", *(f"![{name} theme](looks-{name}.png)\n" for name in THEMES)]
    return "\n".join(lines)


def contrast(first: str, second: str) -> float:
    """Return the contrast ratio of two colours (WCAG 2.1), from 1 to 21.

    >>> round(contrast("#000000", "#ffffff"), 6)
    21.0
    """
    bright, dim = sorted((_luminance(first), _luminance(second)), reverse=True)
    return (bright + 0.05) / (dim + 0.05)


def write_pictures(folder: Path) -> None:
    """Write a picture of the window's parts in each theme, made by the program's own style."""
    application = QApplication.instance() or QApplication([])
    for name, theme in THEMES.items():
        widget = _sample_widget()
        widget.setStyle(QStyleFactory.create("Fusion"))
        widget.setPalette(tokens.palette(theme))
        widget.setStyleSheet(tokens.style_sheet(theme))
        widget.resize(640, 260)
        widget.grab().save(str(folder / f"looks-{name}.png"))
    del application


def _sample_widget() -> QWidget:
    widget = QWidget()
    widget.setObjectName("window")
    grid = QGridLayout(widget)
    for index, role in enumerate(("headline", "title", "value", "quiet")):
        grid.addWidget(label(f"{role.capitalize()} 0123", role), index, 0)
    grid.addWidget(button("Primary", "primary", lambda: None, "primary"), 0, 1)
    grid.addWidget(button("Secondary", "secondary", lambda: None), 1, 1)
    grid.addWidget(QLineEdit("typed"), 2, 1)
    rows = QListWidget()
    rows.addItems(["a row", "a selected row"])
    rows.setCurrentRow(1)
    grid.addWidget(rows, 3, 1)
    for index, grade in enumerate(("wrong", "look")):
        sample = label(f"This is {grade}.", "value")
        sample.setProperty("grade", grade)
        grid.addWidget(sample, index + 1, 2)
    return widget


def _luminance(name: str) -> float:
    channels = QColor(name).getRgbF()[:3]
    red, green, blue = (share / 12.92 if share <= 0.03928 else ((share + 0.055) / 1.055) ** 2.4 for share in channels)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def table(header: tuple[str, ...], rows: list[tuple[str, ...]]) -> list[str]:
    """Return the lines of a table in Markdown."""
    return [*(f"| {' | '.join(row)} |" for row in (header, ("---",) * len(header), *rows)), ""]
