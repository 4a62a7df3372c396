"""The preview in the real window: opened by key and button, paged by keys and buttons, and nothing is recorded."""

from pathlib import Path

import pytest
from PySide6.QtCore import QSize, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QPushButton

from daq_app.qt.subject_picture import SubjectPreview
from daq_app.window.new_session import SessionForm
from daq_app.window.subject import PreviewPage, SubjectText, SubjectView, preview, translator

pytestmark = pytest.mark.qt
PACE = 1.0  # no test here waits for a session


@pytest.fixture
def open_preview(application):
    """Return a function that shows a preview of pages."""
    previews = []

    def show(pages):
        previews.append(SubjectPreview(pages, QSize(1366, 768)))
        previews[-1].show()
        application.processEvents()
        return previews[-1]

    yield show
    for shown_preview in previews:
        shown_preview.close()
        shown_preview.deleteLater()


def test_keys_buttons_and_list_turn_the_pages(open_preview):
    dialog = open_preview(preview(SessionForm()))
    titles = [dialog.picture.page._title.text()]
    for key in (Qt.Key.Key_Right, Qt.Key.Key_PageDown, Qt.Key.Key_Left, Qt.Key.Key_Down):
        QTest.keyClick(dialog.list, key)
        titles.append(dialog.list.currentItem().text())
    assert titles == [
        "Welcome",
        "the surface is changed",
        "stickiness: stroke",
        "the surface is changed",
        "stickiness: stroke",
    ]
    QTest.mouseClick(dialog.forward, Qt.MouseButton.LeftButton)
    assert dialog.picture.accessibleName().startswith("the subject's page: Judge the stickiness")
    assert not dialog.picture.page.next.isHidden()  # as after an answer
    dialog.list.setCurrentRow(dialog.list.count() - 1)
    assert not dialog.forward.isEnabled()
    QTest.keyClick(dialog.list, Qt.Key.Key_Escape)
    assert not dialog.isVisible()


def test_a_page_is_the_subjects_own_window_in_its_language_and_direction(open_preview):
    words = translator("ar")
    dialog = open_preview(preview(SessionForm(language="ar"), words))
    dialog.list.setCurrentRow(3)
    page = dialog.picture.page
    assert page.next.text() == words(SubjectText.NEXT)
    assert page.layoutDirection() == Qt.LayoutDirection.RightToLeft
    assert (page.width(), page.height()) == (1366, 768)
    assert not page.isVisible()


def test_characters_that_no_font_draws_are_named_on_their_page(open_preview):
    sign = "\U000e0fff"  # stands for nothing, and no font has it
    dialog = open_preview(
        [PreviewPage("a", SubjectView("read", "Rest")), PreviewPage("b", SubjectView("read", f"Rest{sign}"))]
    )
    assert not dialog.lost.isVisible()
    QTest.keyClick(dialog.list, Qt.Key.Key_Right)
    assert dialog.lost.isVisible()
    assert sign in dialog.lost.text()


def test_it_opens_from_prepare_and_records_nothing(driver):
    window = driver.window
    window.setFocus()
    QTest.keyClick(window, Qt.Key.Key_F7)
    QTest.mouseClick(window.page._preview, Qt.MouseButton.LeftButton)
    previews = window.findChildren(SubjectPreview)
    assert len(previews) == 2
    assert driver.session is None
    assert not Path(window.page.folder.text()).exists()
    for shown_preview in previews:
        (close,) = (button for button in shown_preview.findChildren(QPushButton) if button.text().startswith("Close"))
        QTest.mouseClick(close, Qt.MouseButton.LeftButton)


def test_the_subjects_page_speaks_the_chosen_language_before_a_session(driver):
    window, page = driver.window, driver.window.page
    page.protocol.setCurrentText("sensotact-friction")
    page.screen_fields.language.setCurrentIndex(page.screen_fields.language.findData("ar"))
    assert window.subject._title.text() == translator("ar")(SubjectText.WELCOME)
    assert window.subject.layoutDirection() == Qt.LayoutDirection.RightToLeft
    page.screen_fields.language.setCurrentIndex(page.screen_fields.language.findData("en"))
    assert window.subject._title.text() == "Welcome"
    assert window.subject.layoutDirection() == Qt.LayoutDirection.LeftToRight
