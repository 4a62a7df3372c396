"""The simulated networked box, spoken to with bytes typed from the maker's layout."""

import contextlib
import re
import socket
import struct
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request

import numpy as np
import pytest

from drivers.clock import PacedClock
from drivers.transducer import SetupError
from simulators.bench import Bench, BenchSettings
from simulators.faults import Fault, Faults
from simulators.net_ft_box import NetFtBox
from simulators.net_ft_electronics import NET_FT, Electronics

QUIET = BenchSettings(
    noise_force=0.0, noise_torque=0.0, drift_force=0.0, drift_torque=0.0, offset=(1, -2, 5, 125, 0, 0)
)
STOP, START, BUFFERED, RESET_LATCH, BIAS = (struct.pack(">HHI", 0x1234, c, 0) for c in (0, 2, 3, 0x41, 0x42))


@pytest.fixture
def start_box():
    """Return a function that starts a box in simulated time ten times as fast."""
    boxes = []

    def start(settings=QUIET, **options):
        boxes.append(NetFtBox(Bench(1, settings), PacedClock(10.0), **options))
        boxes[-1].start()
        return boxes[-1]

    yield start
    for box in boxes:
        box.close()


def ports(box):
    return {name: int(port) for name, port in re.findall(r"(rdt|tcp|http)=(\d+)", box.uri)}


@contextlib.contextmanager
def client(box):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
        udp.connect(("127.0.0.1", ports(box)["rdt"]))
        udp.settimeout(5)
        yield udp


def receive_records(udp, count):
    return [struct.unpack(">3I6i", udp.recv(4096)) for _ in range(count)]


def until_silent(udp):
    """Take what still comes until nothing has come for a tenth of a second."""
    udp.settimeout(0.1)
    with contextlib.suppress(TimeoutError):
        while True:
            udp.recv(100)
    udp.settimeout(5)


def read_page(box, path):
    with urllib.request.urlopen(f"http://127.0.0.1:{ports(box)['http']}{path}", timeout=5) as answer:
        return answer.status, answer.read().decode()


def setting(box, name):
    return re.search(f"<{name}>(.*)</{name}>", read_page(box, "/netftapi2.xml")[1])[1]


def change_setting(box, path):
    """Set a value as a browser would, and return the status without following where it leads."""
    with socket.create_connection(("127.0.0.1", ports(box)["http"]), timeout=5) as tcp:
        tcp.sendall(f"GET {path} HTTP/1.0\r\n\r\n".encode())
        return tcp.recv(4096).split(b"\r\n")[0]


def test_a_stream_numbers_its_records_from_1_and_counts_35_ticks_at_200_hz(start_box):
    with client(start_box()) as udp:
        udp.send(START)
        records = receive_records(udp, 20)
    assert [r[0] for r in records] == list(range(1, 21))
    assert np.diff([r[1] for r in records]).tolist() == [35] * 19
    assert {r[2] for r in records} == {0}
    assert {r[3:] for r in records} == {(1_000_000, -2_000_000, 5_000_000, 125_000, 0, 0)}


@pytest.mark.parametrize(("rate", "step", "page"), [(7000, 1, 7000), (1000, 7, 1000), (150, 46, 152), (99, 70, 100)])
def test_rates_are_integer_fractions_of_7000_rounded_up(start_box, rate, step, page):
    box = start_box()
    assert change_setting(box, f"/comm.cgi?comrdtrate={rate}") == b"HTTP/1.0 302 Found"
    assert setting(box, "comrdtrate") == str(page)
    with client(box) as udp:
        udp.send(START)
        records = receive_records(udp, 10)
    assert np.diff([r[1] for r in records]).tolist() == [step] * 9


@pytest.mark.parametrize("rate", ["0", "7001", "-1", "fast", ""])
def test_a_rate_the_box_does_not_have_changes_nothing(start_box, rate):
    box = start_box()
    change_setting(box, f"/comm.cgi?comrdtrate={rate}")
    assert setting(box, "comrdtrate") == "200"


def test_so_many_records_are_sent_as_were_asked_for(start_box):
    with client(start_box()) as udp:
        udp.send(struct.pack(">HHI", 0x1234, 2, 3))
        assert len(receive_records(udp, 3)) == 3
        udp.settimeout(0.1)
        with pytest.raises(TimeoutError):
            udp.recv(100)


def test_buffered_streaming_sends_several_records_in_a_datagram(start_box):
    box = start_box()
    change_setting(box, "/comm.cgi?comrdtbsiz=4")
    with client(box) as udp:
        udp.send(struct.pack(">HHI", 0x1234, 3, 10))
        datagrams = [udp.recv(4096) for _ in range(3)]
    assert [len(d) for d in datagrams] == [144, 144, 72]
    assert [struct.unpack_from(">I", b"".join(datagrams), 36 * i)[0] for i in range(10)] == list(range(1, 11))


def test_a_stop_stops_and_a_new_start_begins_at_1(start_box):
    with client(start_box()) as udp:
        udp.send(START)
        first = receive_records(udp, 3)
        udp.send(STOP)
        until_silent(udp)
        udp.send(START)
        again = receive_records(udp, 1)
    assert again[0][0] == 1
    assert again[0][1] > first[-1][1], "the tick counter is not reset by a request"


def test_a_box_on_a_busy_computer_sends_what_is_due_before_it_hears_another_start(start_box):
    box, hold = start_box(), threading.Event()
    with client(box) as udp:
        udp.send(START)
        records = receive_records(udp, 5)
        until_due = box._until_due

        def delay_once():
            if not hold.is_set():
                hold.set()
                time.sleep(0.1)
            return until_due()

        box._until_due = delay_once
        hold.wait()
        udp.send(START)
        while records[-1][0] > 300 or len(records) < 305:  # more are due where this computer is busy itself
            records += receive_records(udp, 1)
            assert len(records) < 3000
    assert set(np.diff([ticks for _, ticks, *_ in records]).tolist()) == {35}
    assert [number for number, *_ in records].count(1) == 2


def test_a_second_client_takes_the_stream(start_box):
    box = start_box()
    with client(box) as first, client(box) as second:
        first.send(START)
        receive_records(first, 3)
        second.send(START)
        assert receive_records(second, 1)[0][0] == 1
        until_silent(first)


def test_bias_makes_what_is_felt_read_zero_until_power_off(start_box):
    box = start_box(faults=Faults([Fault("reboot", 3.0, 3.5)]))
    with client(box) as udp:
        udp.send(BIAS)
        udp.send(RESET_LATCH)
        udp.send(START)
        assert receive_records(udp, 1)[0][3:] == (0,) * 6
        while box.now() < 4.0:
            udp.settimeout(0.05)
            with contextlib.suppress(TimeoutError):
                udp.recv(100)
        udp.settimeout(5)
        udp.send(START)
        (number, counter, _, *counts) = receive_records(udp, 1)[0]
    assert counts == [1_000_000, -2_000_000, 5_000_000, 125_000, 0, 0]
    assert number == 1
    assert counter < 7000 * (box.now() - 3.5)


@pytest.mark.parametrize(
    "request_bytes",
    [b"", b"\x12\x34", START[:7], START + b"\0", b"\x43\x21" + START[2:], struct.pack(">HHI", 0x1234, 9, 0)],
)
def test_what_is_no_request_is_ignored(start_box, request_bytes):
    with client(start_box()) as udp:
        udp.send(request_bytes)
        udp.settimeout(0.05)
        with pytest.raises(TimeoutError):
            udp.recv(100)


def test_both_counters_wrap(start_box):
    with client(start_box(first=(2**32 - 200, 2**32 - 3))) as udp:
        udp.send(START)
        records = receive_records(udp, 50)
    assert np.diff(np.array([r[:2] for r in records]).astype(np.uint32), axis=0).tolist() == [[1, 35]] * 49
    assert 0 in [r[0] for r in records]


def test_an_oscillator_that_is_slow_counts_fewer_ticks_in_the_same_time():
    exact, slow = (
        Electronics(Bench(1, QUIET), Faults(timetable), rate=200, first_tick=50, product=NET_FT)
        for timetable in ((), (Fault("slow", 0.0, 100.0, share=0.005),))
    )
    assert exact.tick(4.0) - exact.tick(0.0) == 4 * 7000
    assert slow.tick(4.0) - slow.tick(0.0) == pytest.approx(4 * 7000 * 0.995, abs=1)
    assert slow.time(50 + 7000) == pytest.approx(1.0 / 0.995, abs=1e-9)


def test_saturation_is_reported_in_the_status_and_clips_at_the_rated_range(start_box):
    settings = BenchSettings(noise_force=0, noise_torque=0, drift_force=0, drift_torque=0, offset=(0, 0, -40, 0, 0, 0))
    with client(start_box(settings)) as udp:
        udp.send(START)
        (_, _, status, *counts) = receive_records(udp, 1)[0]
    assert status == 0x80020000
    assert counts == [0, 0, -36_000_000, 0, 0, 0]


def test_the_page_tells_who_it_is_and_that_it_is_simulated(start_box):
    box = start_box()
    status, text = read_page(box, "/netftapi2.xml")
    assert status == 200
    assert "SIMULATED" in setting(box, "prodname")
    for name, value in {
        "cfgcalsn": "SIM00001",
        "cfgcpf": "1000000",
        "cfgcpt": "1000000",
        "scfgfu": "N",
        "scfgtu": "N-m",
        "cfgmr": "36;36;36;0.5;0.5;0.5",
        "comrdte": "Enabled",
        "runstat": "0x00000000",
        "runft": "1000000;-2000000;5000000;125000;0;0",
    }.items():
        assert f"<{name}>{value}</{name}>" in text
    assert "SIM00001" in read_page(box, "/netftcalapi.xml?index=0")[1]


def test_what_was_set_is_read_back(start_box):
    box = start_box()
    change_setting(box, "/setting.cgi?setuserfilter=5&setbias2=-18343")
    change_setting(box, "/config.cgi?cfgfu=1&cfgtu=4&cfgnam=a%26b")
    assert setting(box, "setuserfilter") == "5"
    assert setting(box, "setbias") == "0;0;-18343;0;0;0"
    assert (setting(box, "scfgfu"), setting(box, "scfgtu")) == ("lb", "N-mm")
    assert setting(box, "cfgnam") == "a&amp;b"
    with client(box) as udp:
        udp.send(START)
        counts = receive_records(udp, 1)[0][3:]
    assert counts == (224809, -449618, 1124045, 125_000_000, 0, 0)


def test_a_disabled_output_sends_nothing(start_box):
    box = start_box()
    change_setting(box, "/comm.cgi?comrdte=0")
    assert setting(box, "comrdte") == "Disabled"
    with client(box) as udp:
        udp.send(START)
        udp.settimeout(0.05)
        with pytest.raises(TimeoutError):
            udp.recv(100)


def test_an_unknown_page_is_not_found(start_box):
    with pytest.raises(urllib.error.HTTPError, match="404"):
        read_page(start_box(), "/nothing.html")


def test_the_tcp_port_answers_in_16_bits_and_tells_the_calibration(start_box):
    box = start_box()
    with socket.create_connection(("127.0.0.1", ports(box)["tcp"]), timeout=5) as tcp:
        calibration = b"\x01" + bytes(19)
        tcp.sendall(calibration[:7])
        tcp.sendall(calibration[7:] + bytes(20))
        answer = tcp.makefile("rb").read(24 + 16)
        tcp.sendall(bytes(19) + b"\x01" + bytes(20))
        biased = tcp.makefile("rb").read(32)
    # 36 N and 0.5 N m at 1e6 counts a unit need at least 1099 and 16 counts in one of 32767 steps.
    assert answer[:24] == bytes.fromhex("1234 02 03 000F4240 000F4240 044B 044B 044B 0010 0010 0010")
    assert struct.unpack(">HH6h", answer[24:]) == (0x1234, 0, 910, -1820, 4550, 7812, 0, 0)
    assert struct.unpack(">HH6h", biased[16:])[2:] == (0,) * 6


def test_a_caller_that_hangs_up_or_talks_nonsense_harms_nobody(start_box):
    box = start_box()
    with socket.create_connection(("127.0.0.1", ports(box)["http"]), timeout=5) as tcp:
        tcp.sendall(b"x" * 9000)
        with contextlib.suppress(ConnectionError):  # it may hang up with some of that unread
            assert tcp.recv(100) == b""
    socket.create_connection(("127.0.0.1", ports(box)["tcp"]), timeout=5).close()
    with socket.create_connection(("127.0.0.1", ports(box)["http"]), timeout=5) as tcp:
        tcp.sendall(b"\xff\xfe nonsense\r\n\r\n")
        assert tcp.recv(100).startswith(b"HTTP/1.0 404")
    assert setting(box, "cfgcalsn") == "SIM00001"


@pytest.mark.parametrize("name", ["rdt", "tcp", "http"])
def test_a_port_in_use_is_refused_in_one_sentence(start_box, name):
    port = ports(start_box())[name]
    threads = threading.active_count()
    with pytest.raises(SetupError, match=rf"port {port} .*in use.*another {name} port"):
        start_box(ports=tuple(port if box == name else 0 for box in ("rdt", "tcp", "http")))
    assert threading.active_count() == threads


def test_a_closed_box_gives_its_ports_back(start_box):
    box = start_box()
    box_ports = ports(box)
    box.close()
    box.close()
    start_box(ports=tuple(box_ports[name] for name in ("rdt", "tcp", "http")))


def test_a_box_does_not_keep_a_program_alive_that_fails():
    program = (
        "from drivers.clock import RealClock; from simulators.bench import Bench; import simulators.net_ft_box as box\n"
        "box.NetFtBox(Bench(1), RealClock()).start(); raise SystemExit(7)"
    )
    assert subprocess.run([sys.executable, "-c", program], timeout=60, check=False).returncode == 7


def test_the_same_seed_sends_the_same_bytes_whenever_it_is_asked(start_box):
    streams = []
    for _ in range(2):
        with client(start_box(BenchSettings(), faults=Faults([Fault("corrupt", 0.0, 1e6, share=0.3)], seed=5))) as udp:
            udp.send(struct.pack(">HHI", 0x1234, 2, 400))
            streams.append({d[4:8]: d[4:] for d in (udp.recv(100) for _ in range(400))})
    sound = [{k: d for k, d in stream.items() if d[4:8] == bytes(4)} for stream in streams]
    (a, b), common = sound, sound[0].keys() & sound[1].keys()
    assert len(common) > 100
    assert all(a[k] == b[k] for k in common)
    ticks = sorted(int.from_bytes(k, "big") for k in common)
    gaps = [{t for t in range(ticks[0], ticks[-1], 35) if t.to_bytes(4, "big") not in stream} for stream in sound]
    assert gaps[0] == gaps[1] != set()
