"""The fields in which a subject types a number or chooses one of two."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLabel

from daq_app.qt.answer_fields import ChoiceOfTwo, NumberField
from daq_app.qt.subject_window import SubjectWindow
from daq_app.window.subject import SubjectView

pytestmark = pytest.mark.qt


@pytest.mark.usefixtures("application")
def test_a_number_is_typed_of_digits_alone():
    field = NumberField(lambda: 0.0)
    QTest.keyClicks(field.field, "stop")
    assert field.field.text() == ""
    QTest.keyClicks(field.field, "-1x2,5")
    assert field.field.text() == "12,5"
    assert field.answer.value == 12.5
    field.field.clear()
    QTest.keyClicks(field.field, "1,000")  # a thousand, in English
    assert field.answer.value is None
    field.point = ","
    QTest.keyClicks(field.field, "0")
    assert field.answer.value == 1.0
    field.field.clear()
    QTest.keyClicks(field.field, "1234567891111")  # no more than nine digits of a whole number, which the field shows
    assert field.answer.value == 123456789.0


@pytest.mark.usefixtures("application")
def test_ctrl_z_does_not_bring_the_number_of_the_trial_before_into_the_next():
    field = NumberField(lambda: 0.0)
    QTest.keyClicks(field.field, "70")
    field.begin()
    QTest.keyClick(field.field, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    assert field.field.text() == ""
    assert field.answer.value is None


@pytest.mark.usefixtures("application")
@pytest.mark.parametrize(
    ("language", "typed", "doubt", "numbers"),
    [
        ("en", "1,000", "1000 or 1.000", {"1000": 1000.0, "1.000": 1.0}),
        ("de", "1.250", "1250 oder 1,250", {"1250": 1250.0, "1,250": 1.25}),
    ],
)
def test_a_subject_whose_mark_may_group_thousands_is_asked_which_of_two_numbers_it_is(language, typed, doubt, numbers):
    window = SubjectWindow(lambda: 0.0)
    window.show_view(SubjectView("number", "How rough?", "Give a number.", language=language), None)
    window.show()
    for text, number in numbers.items():
        QTest.keyClicks(window.number.field, typed)
        page_text = " ".join(label.text() for label in window.findChildren(QLabel) if label.isVisible())
        assert doubt in page_text
        assert not window.next.isVisible()
        window.number.field.clear()
        QTest.keyClicks(window.number.field, text)
        page_text = " ".join(label.text() for label in window.findChildren(QLabel) if label.isVisible())
        assert "Give a number." in page_text
        assert doubt not in page_text
        assert window.next.isVisible()
        assert window.number.answer.value == number
        window.number.begin()
    window.hide()


def test_a_choice_by_touch_is_kept_as_one_by_touch(application):
    choice, finger = ChoiceOfTwo(lambda: 0.0), QTest.createTouchDevice()
    choice.show()
    application.processEvents()
    place = choice.second.rect().center()
    QTest.touchEvent(choice.second, finger).press(0, place, choice.second).commit()
    QTest.touchEvent(choice.second, finger).release(0, place, choice.second).commit()
    assert (choice.answer.value, choice.answer.device) == ("second", "touch")
    QTest.mouseClick(choice.first, Qt.MouseButton.LeftButton)
    assert (choice.answer.value, choice.answer.device) == ("first", "mouse")
