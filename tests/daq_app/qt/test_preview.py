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
def opened(application):
    """Return a function that shows a preview of pages."""
    made = []

    def show(pages):
        made.append(SubjectPreview(pages, QSize(1366, 768)))
        made[-1].show()
        application.processEvents()
        return made[-1]

    yield show
    for shown in made:
        shown.close()
        shown.deleteLater()


def test_keys_buttons_and_list_turn_the_pages(opened):
    shown = opened(preview(SessionForm()))
    titles = [shown.picture.page._title.text()]
    for key in (Qt.Key.Key_Right, Qt.Key.Key_PageDown, Qt.Key.Key_Left, Qt.Key.Key_Down):
        QTest.keyClick(shown.list, key)
        titles.append(shown.list.currentItem().text())
    assert titles == [
        "Welcome",
        "the surface is changed",
        "stickiness: stroke",
        "the surface is changed",
        "stickiness: stroke",
    ]
    QTest.mouseClick(shown.on, Qt.MouseButton.LeftButton)
    assert shown.picture.accessibleName().startswith("the subject's page: Judge the stickiness")
    assert not shown.picture.page.next.isHidden()  # as after an answer
    shown.list.setCurrentRow(shown.list.count() - 1)
    assert not shown.on.isEnabled()
    QTest.keyClick(shown.list, Qt.Key.Key_Escape)
    assert not shown.isVisible()


def test_a_page_is_the_subjects_own_window_in_its_language_and_direction(opened):
    words = translator("ar")
    shown = opened(preview(SessionForm(language="ar"), words))
    shown.list.setCurrentRow(3)
    page = shown.picture.page
    assert page.next.text() == words(SubjectText.NEXT)
    assert page.layoutDirection() == Qt.LayoutDirection.RightToLeft
    assert (page.width(), page.height()) == (1366, 768)
    assert not page.isVisible()


def test_characters_that_no_font_draws_are_named_on_their_page(opened):
    lost = "\U000e0fff"  # stands for nothing, and no font has it
    shown = opened(
        [PreviewPage("a", SubjectView("read", "Rest")), PreviewPage("b", SubjectView("read", f"Rest{lost}"))]
    )
    assert not shown.lost.isVisible()
    QTest.keyClick(shown.list, Qt.Key.Key_Right)
    assert shown.lost.isVisible()
    assert lost in shown.lost.text()


def test_it_opens_from_prepare_and_records_nothing(driver):
    window = driver.window
    window.setFocus()
    QTest.keyClick(window, Qt.Key.Key_F7)
    QTest.mouseClick(window.page._preview, Qt.MouseButton.LeftButton)
    shown = window.findChildren(SubjectPreview)
    assert len(shown) == 2
    assert driver.session is None
    assert not Path(window.page.folder.text()).exists()
    for one in shown:
        (close,) = (made for made in one.findChildren(QPushButton) if made.text().startswith("Close"))
        QTest.mouseClick(close, Qt.MouseButton.LeftButton)


def test_a_protocol_that_cannot_be_read_says_why_in_the_window(driver, tmp_path):
    (tmp_path / "wrong.toml").write_text("name = ")
    driver.window.page.add_protocol(str(tmp_path / "wrong.toml"))
    QTest.mouseClick(driver.window.page._preview, Qt.MouseButton.LeftButton)
    assert "wrong.toml" in driver.window.notice._words.text()


def test_the_subjects_page_speaks_the_chosen_language_before_a_session(driver):
    window, page = driver.window, driver.window.page
    page.protocol.setCurrentText("sensotact-friction")
    page.screen_fields.language.setCurrentIndex(page.screen_fields.language.findData("ar"))
    assert window.subject._title.text() == translator("ar")(SubjectText.WELCOME)
    assert window.subject.layoutDirection() == Qt.LayoutDirection.RightToLeft
    page.screen_fields.language.setCurrentIndex(page.screen_fields.language.findData("en"))
    assert window.subject._title.text() == "Welcome"
    assert window.subject.layoutDirection() == Qt.LayoutDirection.LeftToRight
