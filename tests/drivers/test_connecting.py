"""Connecting ends, and so does a stop, whatever a device sends."""

import os
import threading
import time
from collections import deque
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import mkdtemp
from types import SimpleNamespace

import pytest
from hostile_devices import HOSTILE, STUCK, net_ft

from drivers import deadline
from drivers.catalog import DRIVERS, open_transducer
from drivers.clock import RealClock
from drivers.deadline import Deadline
from drivers.transducer import DeviceFault, LinkLost, SetupError

pytestmark = pytest.mark.skipif(os.name != "posix", reason="there are no pseudo-terminals on this system")

# [real s] Guards against waiting without end on a busy machine; the drivers' own limit has a clock of its own below.
CONNECTS_WITHIN = 10.0
STOPS_WITHIN = 5.0
BY_LIBRARY = {"nidaq"}  # its maker's library speaks to the device
BIAS = "net-ft, a bias on a command port that drips"


class FarLink:
    """A link on a clock of the test's own, which gives this after each wait."""

    def __init__(self, arrival):
        self.now, self._arrival = 0.0, arrival

    def receive(self, timeout):
        self.now += timeout
        return self._arrival


@pytest.mark.parametrize("arrival", [None, b"x"])
def test_every_wait_for_a_device_ends_within_five_seconds_with_closing_whatever_arrives(arrival, monkeypatch):
    far_link = FarLink(arrival)
    monkeypatch.setattr(deadline, "time", SimpleNamespace(monotonic=lambda: far_link.now))
    link = Deadline(deadline.CONNECTING).bound(far_link)
    with pytest.raises(LinkLost, match="not ready within"):
        deque((link.receive(1.0) for _ in range(1000)), maxlen=0)
    assert 4.0 < far_link.now <= 5.0 - deadline.ENDING


def connect(uri, transducers):
    """Open and start, and return the sentence that says why it could not be done."""
    try:
        transducers.append(open_transducer(uri, RealClock()))
        transducers[-1].start()
    except (LinkLost, DeviceFault, SetupError) as error:
        return str(error)
    return ""


def run_in_parallel(task, names):
    """Return by its name what `work` returns for each, all run beside each other."""
    with ThreadPoolExecutor(len(names)) as pool:
        return dict(zip(names, pool.map(task, names), strict=True))


def test_every_driver_with_bytes_of_its_own_has_a_hostile_device():
    assert {name.partition(",")[0] for name in HOSTILE} == {driver.name for driver in DRIVERS} - BY_LIBRARY


@pytest.fixture(scope="module")
def attempts(tmp_path_factory):
    """Of each hostile device what connecting said, its time [s], and what was opened; all at once, for they wait."""
    folder = tmp_path_factory.mktemp("devices")  # its factory is not made for threads
    threads = set(threading.enumerate())

    def attempt(name):
        device = net_ft(STUCK) if name == BIAS else HOSTILE[name](Path(mkdtemp(dir=folder)))
        uri, transducers = device.uri + "&bias=set" * (name == BIAS), []
        try:
            began = time.monotonic()
            sentence = connect(uri, transducers)
            elapsed_s = time.monotonic() - began
        finally:
            for transducer in transducers:
                transducer.close()
            device.close()
        return uri, sentence, elapsed_s, transducers

    return run_in_parallel(attempt, [*HOSTILE, BIAS]), set(threading.enumerate()) - threads


@pytest.mark.parametrize("name", HOSTILE)
def test_connecting_ends_in_one_sentence_whatever_arrives(name, attempts):
    uri, sentence, elapsed_s, _ = attempts[0][name]
    assert elapsed_s < CONNECTS_WITHIN
    assert uri.partition("?")[0].split("://")[0] in sentence or "http" in sentence or "tty" in sentence
    assert "\n" not in sentence


def test_connecting_leaves_no_thread_behind(attempts):
    assert not attempts[1]


PATIENT = [name for name in HOSTILE if "drips" not in name and "any baud" not in name]


@pytest.fixture(scope="module")
def stops(tmp_path_factory):
    """Of each hostile device how long a stop took [s], and whether connecting ended with it; all at once."""
    folder = tmp_path_factory.mktemp("devices")

    def stop(name):
        device, transducers = HOSTILE[name](Path(mkdtemp(dir=folder))), []
        connecting = threading.Thread(target=lambda: connect(device.uri, transducers))
        try:
            connecting.start()
            while connecting.is_alive() and not transducers:
                time.sleep(0.01)
            time.sleep(0.3)
            began = time.monotonic()
            for transducer in transducers:
                transducer.stop()
            elapsed_s = time.monotonic() - began
            connecting.join(CONNECTS_WITHIN)
        finally:
            device.close()
        return elapsed_s, not connecting.is_alive()

    return run_in_parallel(stop, PATIENT)


@pytest.mark.parametrize("name", PATIENT)
def test_a_stop_ends_connecting_whatever_arrives(name, stops):
    elapsed_s, connecting_ended = stops[name]
    assert elapsed_s < STOPS_WITHIN
    assert connecting_ended


def test_setting_a_bias_ends_on_a_command_port_that_drips(attempts):
    _, sentence, elapsed_s, _ = attempts[0][BIAS]
    assert elapsed_s < CONNECTS_WITHIN
    assert "TCP port" in sentence


def test_datagrams_that_are_no_readings_are_named(attempts):
    _, sentence, _, transducers = attempts[0]["net-ft, datagrams of 35 bytes"]
    assert "of which none is a reading" in sentence
    assert transducers[0].health.malformed > 0
