"""Colours, sizes and type of the window: one set of tokens for light and dark, and the style sheet made of it."""

from collections.abc import Iterable
from dataclasses import dataclass
from unicodedata import category, normalize

from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QFont, QFontInfo, QFontMetrics, QGuiApplication, QPalette
from PySide6.QtWidgets import QWidget

GRID = 8  # everything keeps to multiples of it [device-independent pixels]
TARGET = 40  # least height of what is clicked or touched
SMALL, TEXT, TITLE, HEADLINE = 13, 15, 20, 32  # type, before the system's font scale
USUAL_POINTS = 10.0  # size of a system's interface font that asks for no scaling

# Okabe and Ito's palette, distinct with every common colour blindness.
FX, FY, N, T, MU, MODEL = "#0072B2", "#E69F00", "#56B4E9", "#D55E00", "#CC79A7", "#009E73"


@dataclass(frozen=True, slots=True)
class Tokens:
    """One theme."""

    dark: bool
    ground: str  # of the window
    surface: str  # of panels
    raised: str  # of what can be pressed
    line: str
    text: str
    quiet: str  # labels, axes
    act: str  # the primary button, the focus ring
    on_act: str
    wrong: str  # data are being lost or are wrong
    look: str  # look here
    record: str  # the recording lamp


_COLOURS = {  # of the light and of the dark theme
    "ground": ("#eceeef", "#16191b"),
    "surface": ("#f8f9f9", "#1e2224"),
    "raised": ("#ffffff", "#2a2f32"),
    "line": ("#c3c8cb", "#454c50"),
    "text": ("#14181a", "#eef1f2"),
    "quiet": ("#535c61", "#a4adb2"),
    "act": ("#0b5a8a", "#7cc4f0"),
    "on_act": ("#ffffff", "#0b1a24"),
    "wrong": ("#b3261e", "#ff8a80"),
    "look": ("#8a5a00", "#f3c15c"),
    "record": ("#c5221f", "#ff5a52"),
}
LIGHT, DARK = (Tokens(dark=bool(at), **{name: pair[at] for name, pair in _COLOURS.items()}) for at in (0, 1))


def current_tokens() -> Tokens:
    """Return the theme the system asks for."""
    hints = QGuiApplication.styleHints()
    scheme = hints.colorScheme()
    if scheme == Qt.ColorScheme.Unknown:
        window = QGuiApplication.palette().color(QPalette.ColorRole.Window)
        return DARK if window.lightness() < 128 else LIGHT
    return DARK if scheme == Qt.ColorScheme.Dark else LIGHT


def theme_of(widget: QWidget) -> Tokens:
    """Return the theme in which a widget is shown: light text stands on dark grounds."""
    return DARK if widget.palette().windowText().color().lightness() > 127 else LIGHT


def font_scale() -> float:
    """Return how much larger than usual the system wants its type [-], from 1 to 2."""
    points = QFontInfo(QGuiApplication.font()).pointSizeF()
    return min(max(points / USUAL_POINTS, 1.0), 2.0) if points > 0 else 1.0


def font(size: int, scale: float, *, bold: bool = False) -> QFont:
    """Return the window's type at a size, with figures that all have the same width."""
    typeface = QFont(QGuiApplication.font())
    typeface.setPixelSize(round(size * scale))
    typeface.setFeature(QFont.Tag.fromString("tnum"), 1)
    if bold:
        typeface.setWeight(QFont.Weight.DemiBold)
    return typeface


def palette(t: Tokens) -> QPalette:
    """Return the palette for what the style draws by itself: radio buttons, arrows of lists, focus."""
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


def style_sheet(t: Tokens, scale: float) -> str:
    """Return the style sheet of every widget of the window."""
    return _panels(t, scale) + _buttons(t, scale) + _fields(t)


def _px(size: float, scale: float) -> str:
    return f"{round(size * scale)}px"


def _tall(size: int, scale: float, least: int) -> str:
    """Return the least height of a button: that of a line of its type."""
    return f"{max(least, QFontMetrics(font(size, scale)).height())}px"


def _panels(t: Tokens, scale: float) -> str:
    return f"""
* {{ font-size: {_px(TEXT, scale)}; color: {t.text}; }}
QWidget#window, QMainWindow {{ background: {t.ground}; border: none; }}
QFrame[role="panel"] {{ background: {t.surface}; border: 1px solid {t.line}; border-radius: 6px; }}
QFrame[role="strip"] {{ background: {t.surface}; border: 1px solid {t.line}; border-radius: 6px; }}
QFrame[role="card"] {{ border: 1px solid {t.line}; border-radius: 6px; }}
QLabel {{ background: transparent; }}
QLabel[role="quiet"] {{ color: {t.quiet}; font-size: {_px(SMALL, scale)}; }}
QLabel[role="tight"] {{ font-size: {_px(SMALL, scale)}; }}
QLabel[role="value"] {{ font-size: {_px(TEXT, scale)}; }}
QLabel[role="title"] {{ font-size: {_px(TITLE, scale)}; font-weight: 600; }}
QLabel[role="section"] {{ color: {t.quiet}; font-size: {_px(SMALL, scale)}; font-weight: 600; }}
QLabel[role="name"] {{ font-size: {_px(TEXT, scale)}; font-weight: 600; }}
QLabel[role="headline"] {{ font-size: {_px(HEADLINE, scale)}; font-weight: 600; }}
QLabel[role="simulated"] {{ color: {t.look}; font-weight: 700; border: 2px solid {t.look}; border-radius: 4px;
  padding: 2px 8px; }}
QLabel[grade="wrong"] {{ color: {t.wrong}; font-weight: 600; }}
QLabel[grade="look"] {{ color: {t.look}; font-weight: 600; }}
QFrame[role="banner"][grade="wrong"] {{ background: {t.wrong}; border-radius: 6px; }}
QFrame[role="banner"][grade="wrong"] QLabel {{ color: {t.surface}; font-weight: 600; }}
QFrame[role="banner"][grade="look"] {{ background: {t.surface}; border: 2px solid {t.look}; border-radius: 6px; }}
"""


def _buttons(t: Tokens, scale: float) -> str:
    return f"""
QPushButton {{ background: {t.raised}; border: 1px solid {t.line}; border-radius: 6px;
  min-height: {_tall(TEXT, scale, TARGET - 10)}; padding: 4px 14px; }}
QPushButton:hover {{ border-color: {t.quiet}; }}
QPushButton:pressed {{ background: {t.line}; }}
QComboBox:disabled {{ color: {t.quiet}; }}
QLineEdit:disabled, QPushButton:disabled {{ color: {t.quiet}; background: {t.ground}; border-style: dashed; }}
QPushButton:focus, QLineEdit:focus, QPlainTextEdit:focus, QListWidget:focus, QTreeWidget:focus {{
  border: 2px solid {t.act}; }}
QPushButton[role="primary"] {{ background: {t.act}; color: {t.on_act}; border: 2px solid {t.act}; font-weight: 600;
  font-size: {_px(TITLE, scale)}; min-height: {_tall(TITLE, scale, TARGET)}; padding: 8px 28px; }}
QPushButton[role="primary"]:focus {{ border: 3px solid {t.text}; }}
QPushButton[role="primary"]:disabled {{ background: {t.ground}; color: {t.quiet}; border: 2px dashed {t.line}; }}
QPushButton:checked {{ border: 2px solid {t.act}; }}
QPushButton[role="rail"] {{ padding: 6px 2px; font-size: {_px(SMALL, scale)}; background: transparent; border: none; }}
QPushButton[role="rail"]:checked {{ background: {t.raised}; border: 2px solid {t.act}; }}
QPushButton[role="small"] {{ padding: 4px 4px; }}
QPushButton[role="tile"] {{ padding: 2px 6px; font-size: {_px(SMALL, scale)}; font-weight: 600; }}
QPushButton[role="tile"][grade="wrong"] {{ color: {t.look}; border: 2px solid {t.look}; }}
QPushButton[role="tile"][grade="current"] {{ border: 2px solid {t.text}; }}
QPushButton[role="tile"][grade="coming"] {{ color: {t.quiet}; border-style: dashed; }}
QPushButton[role="tile"]:checked {{ background: {t.act}; color: {t.on_act}; border: 2px solid {t.act}; }}
QPushButton[role="tile"]:focus {{ border: 2px solid {t.act}; }}
QPushButton[role="handle"] {{ padding: 4px 2px; font-size: {_px(SMALL, scale)}; }}
"""


def _fields(t: Tokens) -> str:
    return f"""
QMenuBar, QMenu {{ background: {t.surface}; }}
QMenuBar::item:selected, QMenu::item:selected {{ background: {t.act}; color: {t.on_act}; }}
QMenu::item:disabled {{ color: {t.quiet}; }}
QLineEdit, QPlainTextEdit {{ background: {t.raised}; border: 1px solid {t.line};
  border-radius: 4px; padding: 4px 8px; min-height: {TARGET - 12}px; selection-background-color: {t.act};
  selection-color: {t.on_act}; }}
QAbstractItemView {{ selection-background-color: {t.act}; selection-color: {t.on_act};
  background: {t.surface}; alternate-background-color: {t.raised}; }}
QListView::item:selected, QTreeView::item:selected, QTableView::item:selected {{ background: {t.act};
  color: {t.on_act}; }}
QComboBox QLineEdit {{ border: none; min-height: 0; padding: 0 6px; }}
QComboBox QAbstractItemView {{ background: {t.raised}; }}
QHeaderView::section {{ background: {t.ground}; color: {t.quiet}; border: 1px solid {t.line}; padding: 3px 6px; }}
QProgressBar {{ background: {t.raised}; border: 1px solid {t.line}; border-radius: 4px; text-align: center; }}
QProgressBar::chunk {{ background: {t.line}; }}
QListWidget, QTreeWidget {{ background: {t.surface}; border: 2px solid transparent; }}
QListWidget::item {{ padding: 3px 2px; }}
QScrollBar:vertical {{ background: transparent; width: 12px; }}
QScrollBar::handle:vertical {{ background: {t.line}; border-radius: 4px; min-height: 24px; margin: 2px; }}
QScrollBar::add-line:vertical, QScrollBar::sub-line:vertical {{ height: 0; }}
QScrollBar:horizontal {{ background: transparent; height: 12px; }}
QScrollBar::handle:horizontal {{ background: {t.line}; border-radius: 4px; min-width: 24px; margin: 2px; }}
QScrollBar::add-line:horizontal, QScrollBar::sub-line:horizontal {{ width: 0; }}
QToolTip {{ background: {t.raised}; color: {t.text}; border: 1px solid {t.line}; padding: 4px; }}
"""


def missing_glyphs(texts: Iterable[str], font: QFont) -> str:
    """Return the characters of texts, each once, that neither the font nor one that stands in for it can draw."""
    drawn, characters = QFontMetrics(font), set(normalize("NFC", "".join(texts)))
    return "".join(
        sorted(c for c in characters if not (c.isspace() or category(c) == "Cf" or drawn.inFontUcs4(ord(c))))
    )
