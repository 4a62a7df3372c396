"""The driver against the simulated box, over real ports of this computer."""

import contextlib
import re
import socket
import struct
import time

import numpy as np
import pytest
from hostile_devices import web
from ledger import Ledger
from reading import read_until

from drivers import links
from drivers.catalog import open_transducer, reachable
from drivers.clock import PacedClock, RealClock
from drivers.deadline import Deadline
from drivers.links import http_get
from drivers.readings import ReadingBlock
from drivers.transducer import LinkLost, SetupError
from simulators.bench import Bench
from simulators.faults import Fault, Faults
from simulators.net_ft_electronics import Pages


def port(uri, name):
    return int(re.search(rf"{name}=(\d+)", uri)[1])


@pytest.mark.parametrize("rate", [200, 1000, 7000])
def test_a_stream_in_real_time_arrives_whole(start_box, rate):
    bench = Bench(2)
    box = start_box(bench, clock=RealClock(), rate=rate)
    clock = RealClock()
    transducer = open_transducer(box.uri, clock)
    transducer.start()
    block = read_until(transducer, lambda: transducer.health.received >= rate // 2)
    transducer.close()
    health = transducer.health
    assert (health.received, health.lost) == (len(block), 0)
    assert np.diff(block.sequence).tolist() == [1] * (len(block) - 1)
    np.testing.assert_allclose(np.diff(block.time), 1 / rate, rtol=1e-9)
    expected = bench.wrench(block.counter / 7000.0) * 1e6 / np.repeat([1.0, 1000.0], 3)
    assert np.array_equal(block.raw, np.rint(expected))


def test_7000_readings_a_second_are_each_received_or_named_as_lost_over_a_bad_network(start_box):
    timetable = [Fault("lose", 0.3, 0.6, 0.1), Fault("reorder", 0.3, 1.0, 0.05), Fault("repeat", 0.3, 0.8, 0.1)]
    timetable += [Fault("corrupt", 0.4, 0.9, 0.05), Fault("shorten", 0.4, 0.9, 0.05), Fault("unplug", 1.2, 1e6)]
    faults = Ledger(timetable, seed=3)
    box = start_box(clock=RealClock(), rate=7000, faults=faults)
    transducer = open_transducer(box.uri, RealClock())
    transducer.start()
    block = read_until(transducer, lambda: int.from_bytes(faults.datagrams[-1][4:8], "big") > 1.3 * 7000)
    box.close()

    originals = {d[4:8]: d for d in faults.datagrams}  # a box asked twice to start numbers anew; its counter goes on
    sound = [d for d in faults.delivered if len(d) == 36 and originals.get(d[4:8]) == d]
    ticks = [int.from_bytes(d[4:8], "big") for d in sound]
    survivors, greatest, repeated, late = [], -1, 0, 0
    for tick in ticks:
        repeated += tick == greatest
        late += tick < greatest
        if tick > greatest:
            survivors.append(tick)
            greatest = tick
    health = transducer.health
    assert block.counter.tolist() == survivors
    assert (health.received, health.repeated, health.late) == (len(survivors), repeated, late)
    assert health.malformed == len(faults.delivered) - len(sound)
    assert health.received + health.lost == survivors[-1] - int.from_bytes(faults.datagrams[0][4:8], "big") + 1


def test_the_rate_asked_for_is_set_and_read_back(start_box):
    box = start_box(rate=7000)
    transducer = open_transducer(f"{box.uri}&rate=150", PacedClock(10.0))
    assert transducer.info.rate == pytest.approx(7000 / 46)
    transducer.start()
    block = read_until(transducer, lambda: transducer.health.received > 20)
    transducer.close()
    assert np.diff(block.counter).tolist() == [46] * (len(block) - 1)


def test_a_rate_that_somebody_changes_on_the_web_page_is_reported_in_words_and_times_stay_true(start_box):
    box = start_box()
    transducer = open_transducer(box.uri, PacedClock(10.0))
    transducer.start()
    while transducer.health.received < 50:
        time.sleep(0.001)
    before = transducer.read(0.0)
    assert http_get("127.0.0.1", port(box.uri, "http"), "/comm.cgi?comrdtrate=100", Deadline(3.0)).status == 302
    block = read_until(transducer, lambda: transducer.health.off_rate)
    transducer.close()
    block = ReadingBlock.concatenate([before, block])
    assert transducer.health.rate_words == "it sends at 100 Hz, not at 200 Hz"
    assert (transducer.health.lost, transducer.health.received) == (0, len(block))
    assert set(np.round(np.diff(block.time), 9)) <= {0.005, 0.01, 0.015}


def test_units_that_somebody_changes_while_it_streams_are_found_within_a_second(start_box):
    faults = Faults()
    box = start_box(clock=RealClock(), faults=faults)
    transducer = open_transducer(box.uri, RealClock())
    transducer.start()
    transducer.read(1.0)
    faults.put(Fault("units", box.now(), 1e6, share=1e-6))  # counts per force from 1 000 000 to 1
    began = time.monotonic()
    with pytest.raises(LinkLost, match="counts in other units than before: 1 counts a N"):
        read_until(transducer, lambda: False)
    elapsed_s = time.monotonic() - began
    transducer.close()
    assert elapsed_s < 1.0
    assert 0 < transducer.health.off_units < 400, "readings that came since the page was last as before"


def test_a_box_that_goes_on_in_the_same_units_is_not_disturbed_by_looking_at_its_page(start_box):
    transducer = open_transducer(start_box(clock=RealClock()).uri, RealClock())
    transducer.start()
    time.sleep(1.5)  # the page is read again in this time
    transducer.close()
    assert transducer.health.off_units == transducer.health.lost == transducer.health.restarted == 0


def test_a_name_server_that_falls_silent_does_not_end_a_stream(start_box, monkeypatch):
    transducer = open_transducer(start_box(clock=RealClock()).uri.replace("127.0.0.1", "localhost"), RealClock())
    transducer.start()

    def refuse(_):
        raise OSError

    monkeypatch.setattr(links.socket, "gethostbyname", refuse)
    time.sleep(1.5)  # the page is read again in this time
    transducer.stop()
    assert transducer.ended is None
    assert transducer.health.received > 200
    transducer.close()


def test_without_a_rate_the_box_is_left_as_it_is(start_box):
    assert open_transducer(start_box(rate=1000).uri, PacedClock(10.0)).info.rate == 1000.0


@pytest.mark.parametrize("units", ["cfgfu=1&cfgtu=1", "cfgfu=4&cfgtu=6", "cfgfu=6&cfgtu=5", "cfgfu=5&cfgtu=2"])
def test_a_wrench_is_the_same_in_whatever_units_the_box_counts(start_box, units):
    bench = Bench(2)
    box = start_box(bench)
    with socket.create_connection(("127.0.0.1", port(box.uri, "http"))) as tcp:
        tcp.sendall(f"GET /config.cgi?{units} HTTP/1.0\r\n\r\n".encode())
        tcp.recv(100)
    transducer = open_transducer(box.uri, PacedClock(10.0))
    transducer.start()
    block = read_until(transducer, lambda: transducer.health.received > 20)
    transducer.close()
    info = transducer.info
    wrench = info.calibration.wrench(block.raw, np.zeros(6))
    resolution = np.diag(info.calibration.matrix)
    assert np.all(np.abs(wrench - bench.wrench(block.counter / 7000.0)) <= 0.51 * resolution)
    np.testing.assert_allclose(info.calibration.rated, [36.0] * 3 + [500.0] * 3, rtol=1e-6)


def test_two_programs_that_take_the_stream_from_each_other_are_reported(start_box):
    box = start_box(clock=RealClock())
    first, second = (open_transducer(box.uri, RealClock()) for _ in range(2))
    first.start()
    second.start()
    sentences = []
    while not sentences:
        for transducer in (first, second):
            try:
                transducer.read(0.01)
            except LinkLost as error:
                sentences.append(str(error))
    first.close()
    second.close()
    assert "another program" in sentences[0]


def test_a_box_with_its_output_disabled_is_refused(start_box):
    box = start_box()
    with socket.create_connection(("127.0.0.1", port(box.uri, "http"))) as tcp:
        tcp.sendall(b"GET /comm.cgi?comrdte=0 HTTP/1.0\r\n\r\n")
        tcp.recv(100)
    with pytest.raises(SetupError, match="disabled"):
        open_transducer(box.uri, PacedClock(10.0))


PAGE = (
    b"<netft><prodname>%s</prodname><cfgcpf>1</cfgcpf><cfgcpt>1</cfgcpt><scfgfu>N</scfgfu><scfgtu>Nm</scfgtu>%s</netft>"
)


@pytest.mark.parametrize(
    ("status", "body", "options", "reason"),
    [
        (404, b"", "", "answers 404"),
        (302, b"", "", "answers 302"),
        (200, b"<html/>", "", "<html> and not <netft>"),
        (200, PAGE % (b"Ethernet Axia80", b"<setadcrate>7</setadcrate>"), "", "converter runs at '7' Hz"),
        (200, PAGE % (b"Net F/T", b"<comrdtrate>7000</comrdtrate>"), "&rate=200", "stays at 7000 Hz"),
        (200, PAGE % (b"Net F/T", b""), "&rate=200", "shows no rate"),
    ],
)
def test_a_box_that_is_not_as_asked_is_refused_with_its_address_and_the_reason(status, body, options, reason):
    with contextlib.closing(web(status, body)) as server, pytest.raises(SetupError, match=reason) as refusal:
        open_transducer(server.uri + options, RealClock())
    assert server.uri + options in str(refusal.value)


def test_a_box_that_counts_otherwise_from_its_new_rate_on_is_taken_as_it_counts_now(start_box, monkeypatch):
    monkeypatch.setattr(Pages, "counts", property(lambda pages: 2_000_000 if pages.step == 14 else 1_000_000))
    box = start_box()
    info = open_transducer(f"{box.uri}&rate=500&bias=set", PacedClock(10.0)).info
    assert info.rate == 500.0
    np.testing.assert_allclose(np.diag(info.calibration.matrix), [0.5e-6] * 3 + [0.5e-3] * 3)


def test_what_is_not_simulated_does_not_say_so():
    with contextlib.closing(web(200, PAGE % (b"Net F/T", b""))) as server:
        info = open_transducer(server.uri, RealClock()).info
    assert not info.simulated
    assert info.serial == ""
    assert np.isnan(info.rate)


def test_whoever_can_be_reached_is_named_and_whoever_cannot_has_a_reason(start_box):
    uri = start_box().uri
    results = {device.uri: device for device in reachable([uri, "net-ft://127.0.0.1?http=1", "nonsense"], patience=2.0)}
    assert results[uri].info.serial == "SIM00001"
    assert results["net-ft://127.0.0.1?http=1"].problem.startswith("nothing answers")
    assert "not a device address" in results["nonsense"].problem


def test_a_closed_transducer_tells_the_box_to_stop(start_box):
    box = start_box(clock=RealClock())
    transducer = open_transducer(box.uri, RealClock())
    transducer.start()
    transducer.close()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
        udp.connect(("127.0.0.1", port(box.uri, "rdt")))
        udp.send(struct.pack(">HHI", 0x1234, 2, 2))  # a stopped box serves whoever asks next
        udp.settimeout(5)
        assert [struct.unpack(">I", udp.recv(100)[:4])[0] for _ in range(2)] == [1, 2]


def test_health_counts_even_when_nobody_reads(start_box):
    transducer = open_transducer(start_box().uri, PacedClock(10.0))
    transducer.start()
    before = transducer.health.received
    while transducer.health.received < before + 100:
        time.sleep(0.001)
    assert len(transducer.read(0.0)) >= before + 100
    transducer.close()
