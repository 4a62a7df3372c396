"""Colours, sizes and type of the window: a set of tokens each for light and dark, and their style sheet."""

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from math import inf
from pathlib import Path
from string import Template
from unicodedata import category, normalize

from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QFont, QFontMetrics, QGuiApplication, QPalette
from PySide6.QtWidgets import QWidget

from daq_app.qt.preferences import theme, type_scale

GRID = 8  # sizes are multiples of it [device-independent pixels]
TARGET = 40  # least height of clickable parts
SMALL, TEXT, TITLE, HEADLINE = 13, 15, 20, 32  # type, before its scale
STYLE = Path(__file__).with_name("style.qss")  # refers to tokens and sizes by $name

# Okabe and Ito's palette, distinguishable with all common colour blindnesses.
FX, FY, N, T, MU, MODEL = "#0072B2", "#E69F00", "#56B4E9", "#D55E00", "#CC79A7", "#009E73"


@dataclass(frozen=True, slots=True)
class Tokens:
    """One theme."""

    ground: str  # of the window
    surface: str  # of panels
    raised: str  # of pressable parts
    line: str
    text: str
    quiet: str  # labels, axes
    act: str  # the primary button, the focus ring
    on_act: str
    wrong: str  # data are being lost or are wrong
    look: str  # attention
    record: str  # the recording lamp


LIGHT = Tokens(
    ground="#eceeef", surface="#f8f9f9", raised="#ffffff", line="#c3c8cb", text="#14181a", quiet="#535c61",
    act="#0b5a8a", on_act="#ffffff", wrong="#b3261e", look="#8a5a00", record="#c5221f",
)  # fmt: skip
DARK = Tokens(
    ground="#16191b", surface="#1e2224", raised="#2a2f32", line="#454c50", text="#eef1f2", quiet="#a4adb2",
    act="#7cc4f0", on_act="#0b1a24", wrong="#ff8a80", look="#f3c15c", record="#ff5a52",
)  # fmt: skip


def preferred_tokens() -> Tokens:
    """Return the tokens of the chosen theme, or of the system's."""
    if (name := theme()) != "system":
        return DARK if name == "dark" else LIGHT
    scheme = QGuiApplication.styleHints().colorScheme()
    if scheme == Qt.ColorScheme.Unknown:
        return DARK if QGuiApplication.palette().window().color().lightness() < 128 else LIGHT
    return DARK if scheme == Qt.ColorScheme.Dark else LIGHT


def theme_of(widget: QWidget) -> Tokens:
    """Return the theme of a widget: light text means the dark theme."""
    return DARK if widget.palette().windowText().color().lightness() > 127 else LIGHT


def px(length: float, most: float = inf) -> int:
    """Return a length scaled with the type, at most `most` times [px]."""
    return round(length * min(type_scale(), most))


def font(size: float, *, bold: bool = False) -> QFont:
    """Return the window's font at a size, with figures of equal width."""
    typeface = QFont(QGuiApplication.font())
    typeface.setPixelSize(px(size))
    typeface.setFeature(QFont.Tag.fromString("tnum"), 1)
    if bold:
        typeface.setWeight(QFont.Weight.DemiBold)
    return typeface


def palette(t: Tokens) -> QPalette:
    """Return the palette for parts that the style draws itself: radio buttons, arrows of lists, focus."""
    colours = QPalette()
    role = QPalette.ColorRole
    for colour, *names in (
        (t.ground, role.Window),
        (t.surface, role.AlternateBase),
        (t.raised, role.Base, role.Button, role.ToolTipBase),
        (t.text, role.WindowText, role.Text, role.ButtonText, role.ToolTipText),
        (t.quiet, role.PlaceholderText),
        (t.line, role.Mid),
        (t.act, role.Highlight, role.Accent),
        (t.on_act, role.HighlightedText),
    ):
        for name in names:
            colours.setColor(name, QColor(colour))
    for name in (role.Text, role.ButtonText, role.WindowText):
        colours.setColor(QPalette.ColorGroup.Disabled, name, QColor(t.quiet))
    return colours


def tick_palette(t: Tokens) -> QPalette:
    """Return the palette of check boxes: the style draws their outline in a darker shade of the background."""
    colours = palette(t)
    colours.setColor(QPalette.ColorRole.Window, QColor(t.quiet))
    return colours


def style_sheet(t: Tokens) -> str:
    """Return the style sheet of the window; a button is at least as high as a line of its type."""
    sizes = {"small": SMALL, "text": TEXT, "title": TITLE, "headline": HEADLINE}
    lengths = {f"px_{name}": px(size) for name, size in sizes.items()}
    tall = (("button", TEXT, TARGET - 10), ("primary", TITLE, TARGET))
    lengths |= {f"tall_{name}": max(least, QFontMetrics(font(size)).height()) for name, size, least in tall}
    pixels = {name: f"{length}px" for name, length in (lengths | {"tall_field": TARGET - 12}).items()}
    return Template(STYLE.read_text(encoding="utf-8")).substitute(asdict(t) | pixels)


def missing_glyphs(texts: Iterable[str], font: QFont) -> str:
    """Return the characters of texts, each once, that neither the font nor a fallback font has."""
    metrics, characters = QFontMetrics(font), set(normalize("NFC", "".join(texts)))
    printed = (letter for letter in sorted(characters) if not letter.isspace() and category(letter) != "Cf")
    return "".join(letter for letter in printed if not metrics.inFontUcs4(ord(letter)))
