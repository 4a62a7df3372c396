"""The experimenter's windows in another language: no text that is seen or read out is left in English."""

import re
import subprocess
import sys
from xml.sax.saxutils import escape

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QAbstractButton,
    QComboBox,
    QLabel,
    QLineEdit,
    QListWidget,
    QMenu,
    QTableView,
    QTabWidget,
    QWidget,
)

from daq_app import wording
from daq_app.cli.verbs.translate import window_texts
from daq_app.qt import preferences
from daq_app.wording import EXPERIMENTER, VARIABLE, languages, tr, translations
from sessions.exchange import FORMATS
from sessions.plan.protocols.protocol import protocol_names
from tests.daq_app.qt.painted_text import painted_texts, paints_by_hand

pytestmark = pytest.mark.qt

# What no translator is given: what was recorded, named or typed, units, formats of files, names of keys.
DATA = re.compile(
    "|".join((*protocol_names(), *FORMATS)) + r"|SIMULATED Net F/T[^:]*|SIM00000|three"
    r"|stickiness|slipperiness|/\S*|English \(en\)|kPa|SED|SVG|PNG|CSV|analyst|dragged by hand"
    r"|counts(?: per unit read from)?|Ctrl|P01_\S*|<[^>]*>|&\w+;|finite strain \d+ to \d+\s% of the SED"
    # The process that reads a recording has the program's own translations:
    r"|data sets readings/\S*, rows \d+ to \d+|mean before contact, readings: \d+"
)
# Sentences of a recording, which the report has too; and what the subject reads, whose language is another.
SESSIONS_OWN = ("SIMULATED: the transducer and", "⟦the subject's page: ⟧")
FOLDERS = "recent sessions"  # a list of names of folders
MODELS_OWN = "scene and model"  # a table whose words are the report's


def mark(text):
    """Return a text with marks around all of it but what is put in for its braces."""
    pieces = re.split(r"(\{[^}]*\})", text)
    return "".join(piece if piece.startswith("{") else f"⟦{piece}⟧" for piece in pieces if piece)


def english_rest(text):
    """Return what of a text is neither within the marks of a translation nor data."""
    rest = DATA.sub(" ", re.sub(r"⟦[^⟦⟧]*⟧", " ", text))
    return rest if re.search("[A-Za-z]{3}", rest) and not text.startswith(SESSIONS_OWN) else ""


def texts_of(widget):
    """Return every text of a widget that is seen or read out."""
    yield from (widget.accessibleName(), widget.accessibleDescription(), widget.toolTip())
    match widget:
        case QLabel() | QAbstractButton():
            yield widget.text()
        case QLineEdit():
            yield widget.placeholderText()
        case QComboBox():
            yield from (widget.itemText(at) for at in range(widget.count()))
        case QTabWidget():
            yield from (widget.tabText(at) for at in range(widget.count()))
        case QMenu():
            yield from (action.text() for action in widget.actions())
        case QListWidget() if widget.accessibleName() != mark(FOLDERS):
            yield from (widget.item(at).text() for at in range(widget.count()))
        case QTableView() if widget.accessibleName() != mark(MODELS_OWN):
            model = widget.model()
            yield from (str(model.headerData(at, Qt.Orientation.Horizontal, 0)) for at in range(model.columnCount()))
        case _:
            pass


def english_in(window):
    english = set()
    for widget in (window, *window.findChildren(QWidget)):
        if not type(widget).__module__.startswith("PySide6") or not widget.objectName().startswith("qt_"):
            paints = painted_texts(widget) if widget.isVisible() and paints_by_hand(widget) else []
            texts = (*texts_of(widget), *(text.words for text in paints))
            english.update(text for text in texts if english_rest(text))
    return {text for text in english if not text.startswith("Scroll ")}  # Qt's own


@pytest.fixture(scope="module", autouse=True)
def marked_language(tmp_path_factory):
    """A language that puts marks around each English text."""
    folder = tmp_path_factory.mktemp("translations")
    units = (
        f"<trans-unit><source>{escape(text)}</source><target>{escape(mark(text))}</target></trans-unit>"
        for text in window_texts()
    )
    (folder / "experimenter_xx.xlf").write_text(f"<xliff><file>{''.join(units)}</file></xliff>", "utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(wording, "_FOLDER", folder)
        patch.setenv(VARIABLE, "xx")
        translations.cache_clear()
        yield
    translations.cache_clear()


def test_nothing_is_left_in_english_before_a_session(application, driver):
    window = driver.window
    window.page.subject.setText("P01")
    window.resize(1920, 1080)  # in which the finger has a place
    window.act("keys")
    window.act("preview")
    application.processEvents()
    preview = next(w for w in application.topLevelWidgets() if w.windowTitle().startswith("⟦daq-app · preview"))
    assert english_in(window) == set()
    assert english_in(preview) == set()
    preview.close()
    window.act("keys")


@pytest.mark.slow
def test_nothing_is_left_in_english_in_a_session_and_in_its_review(driver):
    window = driver.window
    window.page.subject.setText("P01")
    window.page.simulated.setChecked(True)
    english = set()

    def check(condition):
        english.update(english_in(window))
        return condition()

    window.act("primary")
    driver.until(lambda: driver.session is not None, "the session")
    driver.until(lambda: check(lambda: driver.session.sealing == "sealed"))
    window.go_to("review")
    analyst = window.rooms.analyst
    driver.until(lambda: check(lambda: analyst.state.stage == "predicted" and analyst.state.step is None))
    assert english == set()


def test_a_translation_with_other_braces_leaves_its_text_in_english(monkeypatch):
    for wrong in ("Stich {zahl}", "Stich {0}", "Stich {number:q}", "Stich {number", "Stich {number.nothing}"):
        monkeypatch.setattr(wording, "translations", lambda _context, _language, wrong=wrong: {"Take {number}": wrong})
        assert tr("Take {number}", number=3) == "Take 3"


def test_a_file_that_cannot_be_read_leaves_the_window_in_english(tmp_path, monkeypatch):
    monkeypatch.setattr(wording, "_FOLDER", tmp_path)
    (tmp_path / "experimenter_yy.xlf").write_text("<xliff><file>")
    assert translations(EXPERIMENTER, "yy") == {}


def test_the_language_chosen_in_the_menu_is_that_of_the_next_start(driver):
    window = driver.window
    menu = window.rooms._menus.languages
    names = [action.text() for action in menu.actions()]
    assert names == ["English (en)", "Xx"] or len(names) == len(languages(EXPERIMENTER))
    assert menu.checkedAction() is menu.actions()[-1]
    menu.actions()[0].trigger()
    assert preferences.language() == "en"
    menu.actions()[-1].trigger()
    assert preferences.language() == "xx"


def test_a_process_that_is_started_speaks_the_language_of_the_environment(tmp_path):
    (tmp_path / "experimenter_zz.xlf").write_text(
        "<xliff><trans-unit><source>predicting</source><target>voorspellen</target></trans-unit></xliff>"
    )
    code = (
        "from pathlib import Path; from daq_app import wording;"
        f"wording._FOLDER = Path({str(tmp_path)!r}); print(wording.tr('predicting'))"
    )
    process = subprocess.run(
        [sys.executable, "-c", code], env={VARIABLE: "zz"}, capture_output=True, text=True, check=True
    )
    assert process.stdout.strip() == "voorspellen"
