"""The subject's page in five languages: whole, never clipped, mirrored where one reads from the right."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QAccessible, QFont
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel

from daq_app.qt.tokens import missing_glyphs
from daq_app.window.subject import SubjectText, SubjectView, translator
from daq_app.wording import SUBJECT, translations
from sessions.plan.protocols.protocol import protocol

pytestmark = pytest.mark.qt
TRANSLATED = ("de", "fr", "ja", "ar")
NAMES = ("{number}", "{count}", "{code}", "{low}", "{high}", "{score}")


@pytest.mark.parametrize("language", TRANSLATED)
def test_each_file_has_every_text_with_its_words_in_braces(language):
    texts = translations(SUBJECT, language)
    assert set(texts) == set(SubjectText)
    for text, translation in texts.items():
        names = [name for name in NAMES if name in text]
        assert all(name in translation for name in names)


def test_a_language_that_the_program_does_not_speak_leaves_its_own_texts_english():
    assert translator("nl")(SubjectText.NEXT) == "Next"


def test_a_page_that_changes_its_language_has_every_word_in_the_new_one(subject_page):
    english = protocol("sensotact-friction").blocks[0]
    page = subject_page(SubjectView("line", "How sticky was it?", "", english.scale_ends, 0, (1, 1), "right", "en"))
    german = protocol("sensotact-friction").in_language("de").blocks[0]
    page.show_view(SubjectView("line", german.question, "", german.scale_ends, 0, (1, 1), "right", "de"), None)
    texts = [part.text() for part in page.findChildren(QLabel) if part.isVisible() and part.text()]
    assert sorted(texts) == sorted([german.question, *german.scale_ends])


def test_arabic_runs_from_the_right_and_the_line_and_its_keys_with_it(subject_page):
    page = subject_page(SubjectView("line", "كم؟", "", ("غير لزج", "لزج"), 0, (1, 1), "right", "ar"))
    line = page.line
    assert page.layoutDirection() == Qt.LayoutDirection.RightToLeft
    assert line.point_at(0.0).x() > line.point_at(100.0).x()
    QTest.mouseClick(line, Qt.MouseButton.LeftButton, pos=line.point_at(25.0).toPoint())
    assert line.answer.score == pytest.approx(25.0, abs=0.5)
    low, high = (shown_end for shown_end in page._scale._labels)
    assert low.geometry().center().x() > high.geometry().center().x()
    before = line.answer.score
    QTest.keyClick(line, Qt.Key.Key_Left)  # away from 0, which lies at the right
    assert line.answer.score > before
    assert page.next.text() == "التالي"


def test_back_in_english_the_line_is_as_it_was(subject_page):
    page = subject_page(SubjectView("line", "كم؟", "", ("a", "b"), 0, (1, 1), "right", "ar"))
    page.show_view(SubjectView("line", "How?", "", ("a", "b"), 0, (2, 1)), None)
    assert page.line.point_at(0.0).x() < page.line.point_at(100.0).x()
    assert page.next.text() == "Next"


@pytest.mark.parametrize("hand", ["left", "right"])
@pytest.mark.parametrize("language", ["en", "ar"])
def test_next_stands_where_the_answering_hand_is_in_every_language(subject_page, language, hand):
    page = subject_page(SubjectView("line", "?", "", ("a", "b"), 0, (1, 1), hand, language))
    page.line._take(page.line.answer.press(0.0, 50.0, "mouse").release())
    QApplication.processEvents()
    place = page.next.mapTo(page, page.next.rect().center()).x()
    assert (place > page.width() / 2) is (hand == "right")


@pytest.mark.usefixtures("application")
def test_a_character_that_no_font_draws_is_named():
    assert missing_glyphs(["Hello, 5"], QFont()) == ""
    assert missing_glyphs(["a \U000f0000 b"], QFont()) == "\U000f0000"


@pytest.mark.parametrize("language", TRANSLATED)
def test_screen_readers_speak_the_language_of_the_page_and_tell_the_line_as_a_slider(subject_page, language):
    words = translator(language)
    page = subject_page(SubjectView("line", "?", ends=("low", "high"), key=(1, 1), language=language))
    name = words(SubjectText.LINE).format(low="low", high="high")
    reader = QAccessible.queryAccessibleInterface(page.line)
    assert reader.role() == QAccessible.Role.Slider
    assert reader.text(QAccessible.Text.Name) == name
    assert reader.text(QAccessible.Text.Description) == words(SubjectText.UNANSWERED)
    QTest.keyClick(page.line, Qt.Key.Key_End)
    score = round(page.line.answer.score)
    assert reader.text(QAccessible.Text.Description) == words(SubjectText.ANSWERED).format(score=score)
    assert page.next.accessibleName() == words(SubjectText.NEXT)
    assert page.number.field.accessibleName() == words(SubjectText.OWN_NUMBER)
    assert page.choice.accessibleName() == words(SubjectText.OF_TWO)
    assert page.press.accessibleName() == words(SubjectText.PRESSING)
    ours = {widget.accessibleName() for widget in (page.line, page.next, page.number.field, page.choice, page.press)}
    assert not ours & {str(text) for text in SubjectText}
