from hypothesis import given
from hypothesis import strategies as st

from daq_app.window.subject import Answer


def test_an_untouched_line_has_no_answer():
    event = Answer().judgement("right")
    assert event.score is None
    assert event.positions == ()
    assert event.first_touch is None


def test_a_click_and_a_drag_are_one_answer_with_every_position_in_it():
    answer = Answer().press(1.0, 20.0, "mouse").drag(1.1, 30.0, "mouse").drag(1.2, 41.26, "mouse").release()
    event = answer.judgement("left")
    assert event.positions == ((1.0, 20.0), (1.1, 30.0), (1.2, 41.26))
    assert (event.score, event.first_touch, event.corrections) == (41.3, 1.0, 0)
    assert (event.hand, event.input_device) == ("left", "mouse")


def test_touching_the_line_again_is_a_correction():
    answer = Answer().press(1.0, 20.0, "touch").release().press(3.0, 60.0, "touch").release()
    assert answer.corrections == 1


def test_moving_without_pressing_changes_nothing():
    assert Answer().drag(1.0, 50.0, "mouse") == Answer()


def test_the_first_key_puts_the_mark_in_the_middle_whichever_key_it_is():
    for by in (-1.0, 1.0, 10.0, -100.0):
        answer = Answer().step(1.0, by)
        assert answer.score == 50.0
        assert answer.device == "keyboard"


def test_keys_in_one_go_are_one_answer_and_keys_after_a_while_a_correction():
    answer = Answer().step(1.0, 1.0).step(1.2, 1.0).step(1.4, 1.0)
    assert (answer.score, answer.corrections) == (52.0, 0)
    assert answer.step(4.0, 1.0).corrections == 1


@given(st.lists(st.tuples(st.floats(-50, 150), st.sampled_from(["press", "drag", "key"])), max_size=20))
def test_no_answer_leaves_the_line(acts):
    answer = Answer()
    for time, (position, act) in enumerate(acts):
        if act == "press":
            answer = answer.press(time, position, "touch")
        elif act == "drag":
            answer = answer.drag(time, position, "touch")
        else:
            answer = answer.step(time, position)
    assert answer.score is None or 0.0 <= answer.score <= 100.0
    assert all(0.0 <= position <= 100.0 for _, position in answer.positions)
    times = [time for time, _ in answer.positions]
    assert times == sorted(times)
