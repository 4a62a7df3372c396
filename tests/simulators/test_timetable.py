"""A box served for anybody's client, and the file that says what happens on it."""

import contextlib
import socket

import numpy as np
import pytest

from daq_app.simulation.wiring import load_timetable
from drivers.catalog import open_transducer
from drivers.clock import PacedClock
from drivers.transducer import SetupError
from sessions.toml_file import SettingsError
from simulators.faults import Fault
from simulators.serving import ScriptedBench, Timetable, TimetableError, serve, usual_timetable
from simulators.stroke import Surface, paper_surfaces

SCRIPT = """
repeat = 20.0

[[stroke]]
at = 8
mu = 0.5
peak_normal_force = 4.0
speed = 25
direction = -1
holds = false

[[stroke]]
at = 2.0
descriptor = "stickiness"
index = 100

[[fault]]
kind = "lose"
from = 3
to = 4.5
share = 0.25
"""


@pytest.fixture
def write_script(tmp_path):
    def write(text):
        path = tmp_path / "script.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_a_script_gives_strokes_in_order_and_faults(write_script):
    timetable = load_timetable(write_script(SCRIPT))
    assert timetable.strokes == (
        (2.0, paper_surfaces()["stickiness", 100]),
        (8.0, Surface(0.5, "scripted", 0, 0.02, 25.0, -1, holds=False)),
    )
    assert timetable.faults == (Fault("lose", 3.0, 4.5, 0.25),)
    assert timetable.repeat == 20.0


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("\ufeffstrokes = 1", "strokes"),  # the mark that some editors begin a file with
        ("strokes = 1", "strokes is not known; allowed here: stroke, fault, repeat"),
        ("[[stroke]]\nat = -1\nmu = 0.5", r"at = -1 is not allowed: it must be a number at least 0 and at most 1e\+06"),
        ("[[stroke]]\nat = 1\nmu = nan", r"line 3: stroke\[0\]\.mu = nan is not allowed: it must be a finite number"),
        ("[[stroke]]\nat = 1\nmu = '0.5'", "it must be a number above 0 and at most"),
        ("stroke = 1", "stroke = 1 is not allowed: it must be a list, each a table"),
        ("[[stroke]]\nat = 1", "needs mu"),
        ("[[stroke]]\nat = 1\ndescriptor = 'stickiness'\nindex = 55", "slipperiness 55"),
        ("[[stroke]]\nat = 1\nindex = 20\nmu = 0.5", "either"),
        (
            "[[stroke]]\nat = 1\nmu = 0.5\ncolour = 'red'",
            r"stroke\[0\]\.colour is not known; allowed here: at, ",
        ),
        ("[[stroke]]\nat = 1\nmu = 0.5\n[[stroke]]\nat = 3\nmu = 0.5", "apart"),
        ("repeat = 4\n[[stroke]]\nat = 1\nmu = 0.5", "apart"),
        ("repeat = 10\n[[fault]]\nkind = 'lose'\nfrom = 9\nto = 11", "repeat"),
        (
            "[[fault]]\nkind = 'explode'\nfrom = 1\nto = 2",
            'kind = "explode" is not allowed: it must be "corrupt" or "delay" or',
        ),
        ("[[fault]]\nkind = 'lose'\nfrom = 2\nto = 1", "from < to"),
        ("[[fault]]\nkind = 'lose'\nfrom = 1", r"fault\[0\]\.to is missing; it must be a number"),
        (
            "[[fault]]\nkind = 'lose'\nstart = 1",
            r"fault\[0\]\.start is not known; allowed here: kind, from, to, ",
        ),
    ],
)
def test_a_wrong_script_is_refused_in_a_sentence_that_names_file_and_value(write_script, text, reason):
    with pytest.raises((TimetableError, SettingsError), match=rf"script\.toml.*{reason}"):
        load_timetable(write_script(text))


def test_a_bench_is_stroked_as_its_timetable_says_again_and_again():
    surface = paper_surfaces()["stickiness", 100]
    bench = ScriptedBench(1, Timetable(((1.0, surface),), repeat=10.0))
    normal = -bench.wrench(np.arange(0.0, 30.0, 0.01))[:, 2]
    touch_times = [p.touch for p in bench.ground_truth()]
    assert [int(t // 10) for t in touch_times] == [0, 1, 2]
    assert all(normal[int(100 * p.peak)] == pytest.approx(p.peak_normal_force, abs=0.1) for p in bench.ground_truth())


def test_a_timetable_without_repeat_ends():
    bench = ScriptedBench(1, Timetable(((1.0, paper_surfaces()["stickiness", 0]),)))
    bench.wrench(np.arange(0.0, 100.0, 1.0))
    assert len(bench.ground_truth()) == 1


def test_strokes_that_nobody_asked_about_in_their_time_are_skipped():
    bench = ScriptedBench(1, usual_timetable())
    bench.wrench(np.array([6000.5]))
    assert [p.touch > 5990.0 for p in bench.ground_truth()] == [True]


def test_without_a_script_the_papers_ten_surfaces_are_stroked():
    assert [surface for _, surface in usual_timetable().strokes] == list(paper_surfaces().values())


def test_a_served_box_is_opened_by_its_address_and_carries_out_its_script(write_script):
    timetable = load_timetable(write_script(SCRIPT))
    simulator = serve("net-ft", ports=(0, 0, 0), rate=1000, seed=4, factor=20.0, timetable=timetable)
    try:
        transducer = open_transducer(simulator.uri, PacedClock(20.0))
        assert (transducer.info.rate, transducer.info.serial) == (1000.0, "SIM00004")
        transducer.start()
        while transducer.health.lost == 0:
            transducer.read(1.0)
        transducer.close()
    finally:
        simulator.close()


def test_where_port_80_is_refused_a_free_one_is_taken():
    with contextlib.ExitStack() as stack:
        port_80 = stack.enter_context(socket.socket())
        with contextlib.suppress(OSError):  # somebody else may hold it already
            port_80.bind(("127.0.0.1", 80))
            port_80.listen()
        simulator = serve("net-ft", ports=(0, 0, None))
        simulator.close()
    assert "http=80" not in simulator.uri.split("&")


def test_a_port_in_use_is_refused_in_one_sentence():
    simulator = serve("net-ft", ports=(0, 0, 0))
    port = int(simulator.uri.split("rdt=")[1].split("&")[0])
    with pytest.raises(SetupError, match=f"UDP port {port}"):
        serve("net-ft", ports=(port, 0, None))
    simulator.close()
