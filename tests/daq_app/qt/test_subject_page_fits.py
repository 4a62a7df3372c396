"""What the subject reads is seen whole: long texts of several languages, both ways of reading, large type."""

from itertools import pairwise

import numpy as np
import pytest
from PySide6.QtCore import QRect, Qt
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QLabel

from daq_app.qt import tokens
from daq_app.qt.answer_fields import FULL, PressBar
from daq_app.qt.subject_window import LARGER
from daq_app.window.live_trace import CHANNELS, LiveTrace
from daq_app.window.subject import SubjectView
from sessions.plan.protocols.protocol import LONGEST_TEXT
from tests.daq_app.qt.written_text import cut_off

pytestmark = pytest.mark.qt

GERMAN = "Ziehen Sie den Zeigefinger einmal über jede Oberfläche, zu sich heran, unter 45 Grad. " * 4
JAPANESE = "人差し指で各表面を体に近づける向きに一回引き、どれくらい滑りやすいかを数で答えてください。" * 4
ARABIC = "اسحب سبابتك مرة واحدة على كل سطح نحوك بزاوية 45 درجة، وأعطه رقمًا يعبّر عن مدى انزلاقه. " * 4
RIGHT_TO_LEFT = Qt.LayoutDirection.RightToLeft
LEFT_TO_RIGHT = Qt.LayoutDirection.LeftToRight
READING = [(GERMAN, LEFT_TO_RIGHT), (JAPANESE, LEFT_TO_RIGHT), (ARABIC, RIGHT_TO_LEFT)]


def box(widget):
    window = widget.window()
    return QRect(widget.mapTo(window, widget.rect().topLeft()), widget.size())


@pytest.mark.parametrize("scale", [1.0, 1.5, 2.0])
@pytest.mark.parametrize(("text", "direction"), READING, ids=["German", "Japanese", "Arabic"])
def test_a_long_instruction_is_seen_whole_with_the_bar_beneath_it(subject_page, text, direction, scale):
    window = subject_page(SubjectView("read", text[:40], text, force=True), scale, direction)
    assert cut_off(window) == []
    boxes = [box(window._title), box(window._text), box(window.press)]
    assert all(window.rect().contains(rect) for rect in boxes)
    assert not any(upper.intersects(lower) for upper, lower in pairwise(boxes))


@pytest.mark.parametrize(("text", "direction"), READING, ids=["German", "Japanese", "Arabic"])
def test_the_longest_instruction_of_a_protocol_is_seen_whole_on_a_small_screen(subject_page, text, direction):
    longest = (text * LONGEST_TEXT)[:LONGEST_TEXT]
    window = subject_page(SubjectView("read", "Stroke the surface once", longest, force=True), 1.0, direction)
    window.resize(960, 540)
    assert cut_off(window) == []


def test_type_becomes_smaller_only_where_a_text_is_not_seen_whole(subject_page):
    short = subject_page(SubjectView("read", "Please wait", "Keep your fingers off the surface."), 2.0)
    assert short._title.font().pixelSize() == 2 * LARGER
    short.show_view(SubjectView("read", "Please wait", 2 * GERMAN), "right")
    assert short._title.font().pixelSize() < 2 * LARGER
    short.show_view(SubjectView("read", "Please wait"), "right")
    assert short._title.font().pixelSize() == 2 * LARGER


@pytest.mark.parametrize("scale", [1.0, 2.0])
@pytest.mark.parametrize("direction", [LEFT_TO_RIGHT, RIGHT_TO_LEFT], ids=["to the right", "to the left"])
def test_the_words_of_each_end_stand_beneath_it_and_are_seen_whole(subject_page, direction, scale):
    ends = ("pas du tout collante", "aussi collante que possible")
    window = subject_page(SubjectView("line", "À quel point ?", ends=ends, key=(1, 1)), scale, direction)
    assert cut_off(window) == []
    line = window.line
    for position, words in zip((0.0, 100.0), ends, strict=True):
        (label,) = (candidate for candidate in window.findChildren(QLabel) if candidate.text() == words)
        assert label.width() > 0
        end = line.mapTo(window, line.point_at(position).toPoint())
        assert box(label).center().x() == pytest.approx(end.x(), abs=2)


@pytest.mark.parametrize("scale", [1.0, 2.0])
def test_both_choices_are_large_enough_for_a_finger_and_their_words_are_seen_whole(subject_page, scale):
    window = subject_page(SubjectView("choice", "Which one?", key=(1, 1)), scale)
    for button in (window.choice.first, window.choice.second):
        assert button.width() >= button.sizeHint().width()
        assert button.height() >= 96 * scale
        assert button.fontMetrics().height() >= 20 * scale
        assert button.fontMetrics().horizontalAdvance(button.text()) < button.width()


@pytest.mark.parametrize("direction", [LEFT_TO_RIGHT, RIGHT_TO_LEFT], ids=["to the right", "to the left"])
@pytest.mark.usefixtures("application")
def test_the_bar_of_the_force_fills_by_the_mean_of_the_last_moment_from_where_reading_begins(direction):
    bar, trace = PressBar(), LiveTrace(100.0)
    bar.setLayoutDirection(direction)
    bar.resize(400, 40)

    def show_force():
        bar.show_force(trace)
        image, colour = bar.grab().toImage(), QColor(tokens.theme_of(bar).act)
        return [x for x in range(image.width()) if image.pixelColor(x, image.height() // 2) == colour]

    assert show_force() == []
    values = np.full((len(CHANNELS), 200), np.nan)
    values[CHANNELS.index("N")] = np.repeat([4.0, 2.5], [180, 20])
    trace.add(np.arange(200) / 100.0, values)
    columns = show_force()
    assert len(columns) == pytest.approx(400 * 2.5 / FULL, abs=4)
    assert (columns[-1] > 390) is (direction == RIGHT_TO_LEFT)
