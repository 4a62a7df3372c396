"""The languages of subject and experimenter: the program's own texts, reading direction, missing glyphs."""

from collections.abc import Iterable
from unicodedata import category, normalize

from PySide6.QtCore import QLocale, Qt
from PySide6.QtGui import QFont, QFontMetrics

from daq_app.window.subject_texts import Translate
from daq_app.wording import SUBJECT, translations
from sessions.plan.protocols.languages import ENGLISH


def translator(language: str) -> Translate:
    """Return what makes a subject's language of the English texts; a text without a translation stays English."""
    texts = translations(SUBJECT, language)
    return lambda text: texts.get(text, str(text))


def direction(language: str) -> Qt.LayoutDirection:
    """Return which way a language is read."""
    return QLocale(language).textDirection()


def name_of(language: str) -> str:
    """Return what a language calls itself, with its code.

    >>> name_of("de")
    'Deutsch (de)'
    """
    own = "English" if language == ENGLISH else QLocale(language).nativeLanguageName()
    return f"{own[:1].upper()}{own[1:]} ({language})" if own else language


def missing_glyphs(texts: Iterable[str], font: QFont) -> str:
    """Return the characters of texts, each once, that neither the font nor one that stands in for it can draw."""
    drawn, characters = QFontMetrics(font), set(normalize("NFC", "".join(texts)))
    return "".join(
        sorted(c for c in characters if not (c.isspace() or category(c) == "Cf" or drawn.inFontUcs4(ord(c))))
    )
