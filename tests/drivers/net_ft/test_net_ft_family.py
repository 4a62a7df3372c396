"""What the boxes of the Net F/T family differ in, and what an address can ask of them, on simulated ones."""

import re

import numpy as np
import pytest
from reading import read_until

from drivers.catalog import open_transducer
from drivers.clock import PacedClock
from drivers.net_ft.wire import AXIA, START_BUFFERED
from drivers.transducer import LinkLost, SetupError
from simulators import net_ft_electronics
from simulators.bench import Bench, BenchSettings
from simulators.faults import Fault, Faults

CLOCK = PacedClock(10.0)


def stream(transducer, seconds):
    transducer.start()
    return read_until(transducer, lambda: transducer.health.received > seconds * transducer.info.rate)


def test_an_axia_streams_whole_fractions_of_its_own_converter_rate(start_box):
    box = start_box(product=net_ft_electronics.AXIA, rate=900)
    transducer = open_transducer(box.uri, CLOCK)
    block = stream(transducer, 1.0)
    transducer.close()
    assert "Axia" in transducer.info.model
    assert transducer.info.rate == 7812.5 / 8
    assert transducer.info.counter_rate == 7812.5
    np.testing.assert_allclose(np.diff(block.time), 8 / 7812.5, rtol=1e-9)
    assert transducer.health.lost == 0


def test_an_axia_says_in_its_own_bits_that_a_reading_is_invalid(start_box):
    box = start_box(faults=Faults([Fault("saturate", 0.5, 1.0)]), product=net_ft_electronics.AXIA)
    transducer = open_transducer(box.uri, CLOCK)
    block = stream(transducer, 1.5)
    transducer.close()
    assert transducer.health.saturated == np.count_nonzero(block.status) > 0
    assert AXIA.words(int(block.status.max())) == ("force or torque out of range",)


@pytest.mark.parametrize(
    ("status", "words"),
    [
        (0x88000000, ("gauge out of range",)),
        (0xA0000000, ("calibration checksum error",)),
        (0xC0000000, ("force or torque out of range",)),
        (0x80000005, ("broken gauge", "temperature outside -5 to 70 °C")),
    ],
)
def test_the_status_words_of_an_axia_are_those_of_its_manual(status, words):
    assert AXIA.words(status) == words


def test_buffered_streaming_brings_the_same_readings_many_to_a_datagram(start_box):
    assert bytes.fromhex("12 34 00 03 00 00 00 00") == START_BUFFERED
    box = start_box(rate=1000)
    transducer = open_transducer(f"{box.uri}&mode=buffered", CLOCK)
    block = stream(transducer, 1.0)
    transducer.close()
    assert transducer.info.settings["streaming"] == "buffered"
    assert len(np.unique(block.received_ns)) <= len(block) // 5, "ten records come in each datagram"
    assert transducer.health.lost == transducer.health.malformed == 0
    np.testing.assert_allclose(np.diff(block.time), 0.001, rtol=1e-9)


def test_a_bias_is_set_where_the_address_asks_for_it_and_reported(start_box):
    box = start_box(Bench(3, BenchSettings(offset=(1.0, -2.0, 3.0, 40.0, 50.0, 60.0))))
    untouched = open_transducer(box.uri, CLOCK)
    before = stream(untouched, 0.5).raw.mean(axis=0)
    biased = open_transducer(f"{box.uri}&bias=set", CLOCK)
    after = stream(biased, 0.5).raw.mean(axis=0)
    untouched.close()
    biased.close()
    np.testing.assert_allclose(before[:3] / 1e6, [1.0, -2.0, 3.0], atol=0.03)
    np.testing.assert_allclose(after[:3] / 1e6, 0.0, atol=0.03)
    assert "software bias" not in untouched.info.settings
    setting = biased.info.settings["software bias"]  # the box answers in steps, and may leave none
    assert re.match(r"set at opening, as the address asks; at most 0(\.0\d+)? N and ", setting)


def test_a_latch_is_reset_where_the_address_asks_for_it_and_reported(start_box):
    info = open_transducer(f"{start_box().uri}&latch=reset", CLOCK).info
    setting = info.settings["monitor condition latch"]
    assert setting == "reset at opening, as the address asks, and read back as not latched"
    with pytest.raises(SetupError, match="latch=maybe must be keep or reset"):
        open_transducer(f"{start_box().uri}&latch=maybe", CLOCK)


def test_whoever_keeps_taking_the_stream_is_told_of(start_box):
    box = start_box(faults=Faults([Fault("steal", 0.5, 1000.0)]))
    transducer = open_transducer(box.uri, CLOCK)

    def run():
        transducer.start()
        while True:
            transducer.read(1.0)

    with pytest.raises(LinkLost, match=r"another program on the network|end any other program"):
        run()
    transducer.close()
