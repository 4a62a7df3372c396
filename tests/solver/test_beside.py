"""Ctrl-C is heard while a library works, even where Python would print it and go on."""

import ctypes
import signal
import threading

import pytest

from solver.uninterrupted import beside


@pytest.fixture
def heard():
    """Let this process hear Ctrl-C: one begun in the background by a shell was told not to."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("heard")
def test_ctrl_c_that_comes_while_c_calls_python_stops_the_wait_and_not_the_work():
    go_on, ended = threading.Event(), threading.Event()

    @ctypes.CFUNCTYPE(None)
    def called_by_c():  # what is raised in here is printed and lost
        signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)
        go_on.wait(10.0)
        ended.set()

    with pytest.raises(KeyboardInterrupt):
        beside(called_by_c)
    assert not ended.is_set()
    go_on.set()
    assert ended.wait(10.0)


def test_what_the_work_raises_is_raised_where_it_is_waited_for():
    def fails():
        raise ValueError("no such loop")

    with pytest.raises(ValueError, match="no such loop"):
        beside(fails)


def test_a_thread_that_hears_no_ctrl_c_does_the_work_itself():
    seen = []
    other = threading.Thread(target=lambda: beside(lambda: seen.append(threading.current_thread())))
    other.start()
    other.join()
    assert seen == [other]
