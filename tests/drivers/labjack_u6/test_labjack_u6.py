"""The LabJack U6: bytes packed by hand, the driver on a simulated converter behind pyusb, and another client."""

import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reading import read_until

from drivers import usb_link
from drivers.address import parse_address
from drivers.catalog import open_transducer
from drivers.clock import PacedClock, RealClock
from drivers.clock_recovery import ScanCount
from drivers.deadline import Deadline
from drivers.labjack_u6 import identify_labjack_u6, wire
from drivers.transducer import DeviceFault, LinkLost, SetupError
from simulators.bench import RATED, Bench, calibration_file
from simulators.faults import Fault, Faults
from simulators.labjack_u6_box import LabJackU6Box, SimulatedBus
from simulators.stroke import Stroke, paper_surfaces

NOMINAL = wire.Constants(3.1580578e-4, -3.158058e-4, 33523.0)
GOLDEN_PACKET = bytes.fromhex("F1 F9 1C C0 F8 22 00 00 00 00 00 00" + "F3 82" * 24 + "00 00")  # 0 V everywhere


@pytest.fixture
def cal(tmp_path):
    """The calibration file of the simulated gauges."""
    return calibration_file(tmp_path, "SIM00003")


@pytest.fixture
def plug_in(monkeypatch):
    """Return a function that plugs simulated converters in; no thread may be left when they are pulled."""
    before = set(threading.enumerate())

    def plug(*boxes):
        monkeypatch.setattr(usb_link, "BACKEND", SimulatedBus(boxes))
        return boxes[0]

    yield plug
    assert set(threading.enumerate()) <= before, "a thread was left running"


def box(clock, *timetable, serial=360_000_001):
    return LabJackU6Box(Bench(3), clock, serial=serial, faults=Faults(timetable, seed=1))


def readings(transducer, device, end):
    return read_until(transducer, lambda: device.now() >= end)


@pytest.mark.parametrize(
    ("rate", "clock"), [(200, "00 20 4E"), (500, "00 40 1F"), (1000, "08 80 BB"), (60, "0A 35 0C")]
)
def test_scan_rates_are_set_as_another_library_sets_them(rate, clock):
    assert wire.configure_stream(wire.scan_clock(rate))[11:14] == bytes.fromhex(clock)


def test_requests_are_those_another_library_packs():
    head, channels = "C2 F8 0A 11 AB 03 06 01 18 00 00 00 20 4E", "00 80 02 80 04 80 06 80 08 80 0A 80"
    assert wire.configure_stream(wire.scan_clock(200)) == bytes.fromhex(head + channels)


def test_plain_requests_are_those_another_library_packs():
    assert wire.read_identity() == bytes.fromhex("0B F8 0A 08") + bytes(22)
    assert wire.read_memory(0) == bytes.fromhex("27 F8 01 2D 00 00 00 00")
    assert wire.read_memory(2) == bytes.fromhex("29 F8 01 2D 02 00 00 02")


def test_answers_are_read_as_packed_by_hand():
    wire.check_configuration(bytes.fromhex("0B F8 01 11 00 00 00 00"))
    with pytest.raises(DeviceFault, match="a stream is active"):
        wire.check_configuration(bytes.fromhex("3B F8 01 11 30 00 30 00"))
    assert wire.normal_error(bytes.fromhex("A9 A9 00 00"), 0xA9) == 0
    assert wire.normal_error(bytes.fromhex("D9 A9 30 00"), 0xA9) == 48
    with pytest.raises(DeviceFault, match="garbled"):
        wire.check_configuration(b"\xb8\xb8")


def test_constants_are_signed_numbers_of_32_bits_before_and_behind_the_point():
    positive = bytes.fromhex("57B2140000000000 A637BD69F5FFFFFF") + bytes(16)
    negative = bytes.fromhex("A84DEBFFFFFFFFFF 00000000F3820000") + bytes(16)

    def answer(data):
        body = bytes(2) + data
        checksum = (sum(body) & 0xFFFF).to_bytes(2, "little")
        head = bytes([0xF8, 0x11, 0x2D]) + checksum
        total = sum(head)
        return bytes([(total & 0xFF) + (total >> 8)]) + head + body

    constants = wire.parse_constants(answer(positive), answer(negative))
    assert constants.positive_slope == pytest.approx(3.1580578e-4, rel=1e-5)
    assert constants.negative_slope == pytest.approx(-3.158058e-4, rel=1e-5)
    assert constants.centre == 33523.0
    with pytest.raises(DeviceFault, match="no calibration constants"):
        wire.parse_constants(answer(bytes(32)), answer(bytes(32)))


def test_a_packet_packed_by_hand_is_four_scans_of_nothing():
    records = wire.StreamDecoder(NOMINAL).feed(GOLDEN_PACKET)
    assert records.raw.tolist() == [[0.0] * 6] * 4
    assert records.status.tolist() == records.damaged.tolist() == [0] * 4


def packets(count, seed=5):
    """Return sound packets of a simulated converter."""
    clock = PacedClock(200.0)
    device = LabJackU6Box(Bench(seed), clock)
    device.command(wire.configure_stream(wire.scan_clock(1000)))
    device.command(wire.START)
    stream_packets = []
    while len(stream_packets) < count:
        stream_packets += filter(None, [device.stream_packet(0.1)])
    return stream_packets


STREAM = b"".join(packets(5))


@given(cuts=st.lists(st.integers(0, len(STREAM)), max_size=12).map(sorted))
def test_scans_do_not_depend_on_how_the_stream_was_cut(cuts):
    whole_decoder, cut_decoder = wire.StreamDecoder(NOMINAL), wire.StreamDecoder(NOMINAL)
    expected = whole_decoder.feed(STREAM)
    parts = [cut_decoder.feed(STREAM[a:b]) for a, b in zip([0, *cuts], [*cuts, len(STREAM)], strict=True)]
    assert len(expected.status) == 20
    np.testing.assert_array_equal(np.concatenate([part.raw for part in parts]), expected.raw)
    assert cut_decoder.malformed == whole_decoder.malformed == 0


@given(garbage=st.binary(max_size=200), at=st.integers(0, len(STREAM)))
def test_garbage_raises_nothing_and_is_counted(garbage, at):
    decoder = wire.StreamDecoder(NOMINAL)
    records = decoder.feed(STREAM[:at] + garbage + STREAM[at:])
    # Sums do not notice a zero that is put in before another drops out, so a packet that was moved may count as sound.
    assert len(records.status) <= 20 + 4 * (1 + len(garbage) // wire.STREAM_PACKET)
    assert records.raw.shape == (len(records.status), 6)
    if len(garbage) >= wire.STREAM_PACKET and len(records.status) == 20:
        assert decoder.malformed >= 4


def test_a_lost_packet_is_four_lost_scans_and_the_gauges_stay_in_place():
    sound_packets = packets(5)
    expected = wire.StreamDecoder(NOMINAL).feed(b"".join(sound_packets))
    records = wire.StreamDecoder(NOMINAL).feed(b"".join(sound_packets[:2] + sound_packets[3:]))
    assert records.damaged.tolist() == [0] * 8 + [4] + [0] * 7
    np.testing.assert_array_equal(records.raw, np.delete(expected.raw, slice(8, 12), axis=0))


def test_losses_that_let_the_packet_counter_go_round_are_found_by_the_clock():
    count, period_ns = ScanCount(1000.0, wrap=256 * wire.SCANS), 1_000_000
    count.take(np.zeros(4, np.int64), 4 * period_ns)
    lost_scans = 2 * 1024 + 40  # two rounds of 256 packets of four scans, and ten packets
    block = count.take(np.array([40, 0, 0, 0]), (4 + lost_scans + 4) * period_ns)
    assert block.sequence.tolist() == [4 + lost_scans + k for k in (1, 2, 3, 4)]
    assert count.lost == lost_scans


def test_it_says_who_it_is_and_what_it_rests_on(plug_in, cal):
    device = plug_in(box(RealClock()))
    uri = f"labjack-u6://?cal={cal}"
    info = open_transducer(uri, RealClock()).info
    assert info.simulated
    assert info.serial == info.calibration.serial == "SIM00003"
    assert info.calibration.rated.tolist() == list(RATED)
    assert info.rate == 1000.0
    assert str(device.serial) in info.settings["converter"]
    assert "3.1572e-04" in f"{float(info.settings['constants'].split()[0]):.4e}"
    assert identify_labjack_u6(parse_address(uri), Deadline(1.0)).model == info.model


def test_an_undisturbed_stream_is_whole_evenly_timed_and_feels_what_the_bench_exerts(plug_in, cal):
    clock = PacedClock(2.0)  # so that the converter's memory lasts for 0.4 s of a busy computer
    device = plug_in(box(clock))
    transducer = open_transducer(f"labjack-u6://?cal={cal}&rate=200", clock)
    transducer.start()
    device.bench.mount(paper_surfaces()["stickiness", 80])
    ground_truth = device.bench.begin_stroke(Stroke(7.81, 17.5, approach=0.2, stick=0.2, slide=0.8), device.now() + 0.5)
    block = readings(transducer, device, ground_truth.end + 0.3)
    transducer.close()
    info, health = transducer.info, transducer.health
    assert health.received == len(block)
    assert health.lost == health.malformed == health.restarted == health.saturated == 0
    assert block.sequence.tolist() == list(range(1, len(block) + 1))
    np.testing.assert_allclose(np.diff(block.time), 1.0 / 200.0, rtol=1e-9)
    bias = block.raw[block.time < 0.4].mean(axis=0)
    assert np.abs(bias).max() > 0.5, "gauges are never at 0 V when mounted"
    wrench = info.calibration.wrench(block.raw, bias)
    assert -wrench[:, 2].min() == pytest.approx(ground_truth.peak_normal_force, abs=0.05)
    assert wrench[:, 0].max() == pytest.approx(ground_truth.mu * ground_truth.peak_normal_force, abs=0.05)


def test_one_saturated_gauge_invalidates_the_reading_and_is_named_in_its_status(plug_in, cal):
    clock = PacedClock(2.0)
    device = plug_in(box(clock, Fault("saturate", 0.1, 0.3)))
    transducer = open_transducer(f"labjack-u6://?cal={cal}&rate=300", clock)
    transducer.start()
    block = readings(transducer, device, 0.5)
    transducer.close()
    assert 0 < transducer.health.saturated < transducer.health.received == len(block)
    assert set(block.status[block.status > 0].tolist()) == {1 << 10}, "gauge 2, and no other"


def test_what_an_overflow_cost_is_reported_by_the_converter_and_counted(plug_in, cal, monkeypatch):
    clock = RealClock()
    device = plug_in(box(clock))
    transducer = open_transducer(f"labjack-u6://?cal={cal}&rate=2000", clock)
    hold = threading.Event()
    receive = usb_link.UsbLink.receive

    def receive_late(link, timeout):
        if hold.is_set():
            hold.clear()
            threading.Event().wait(0.3)  # the computer is busy; the converter holds 82 ms
        return receive(link, timeout)

    monkeypatch.setattr(usb_link.UsbLink, "receive", receive_late)
    transducer.start()
    while device.now() < 0.3:
        transducer.read(0.05)
    hold.set()
    end = device.now() + 1.0
    readings(transducer, device, end)
    health = transducer.health
    transducer.close()
    assert health.restarted == 0
    assert health.lost > 200
    # What the converter still held when it was stopped, 164 scans at most, is dropped at the end.
    assert 0 <= device._scan_count - (health.received + health.lost) <= 170


class Forgetful(LabJackU6Box):
    """A converter that leaves so many requests to start unanswered."""

    unanswered = 0

    def command(self, request):
        super().command(request)
        if request == wire.START and self.unanswered:
            self.unanswered -= 1
            self.answer()


def test_a_converter_that_answers_late_after_its_plug_was_put_in_again_is_read_on(plug_in, cal):
    faults, clock = Faults(), RealClock()
    device = plug_in(Forgetful(Bench(3), clock, faults=faults))
    transducer = open_transducer(f"labjack-u6://?cal={cal}&rate=300", clock)
    transducer.start()
    device.unanswered = 1
    faults.put(Fault("unplug", device.now(), device.now() + 0.1))
    while transducer.health.restarted == 0:
        transducer.read(0.1)
    transducer.close()
    assert transducer.health.lost > 300, "for a second nothing answered"


def test_two_converters_are_told_apart_by_serial_number_and_neither_is_taken_unasked(plug_in, cal):
    plug_in(box(RealClock(), serial=11), box(RealClock(), serial=22))
    with pytest.raises(SetupError, match="several are plugged in; add serial= one of 11, 22"):
        open_transducer(f"labjack-u6://?cal={cal}", RealClock())
    info = open_transducer(f"labjack-u6://?cal={cal}&serial=22", RealClock()).info
    assert "serial number 22" in info.settings["converter"]
    with pytest.raises(LinkLost, match="no LabJack U6 33 is plugged in"):
        open_transducer(f"labjack-u6://?cal={cal}&serial=33", RealClock())


def test_a_missing_calibration_is_asked_for_in_one_sentence(plug_in):
    plug_in(box(RealClock()))
    with pytest.raises(SetupError, match="add cal=FILE"):
        open_transducer("labjack-u6://", RealClock())
    with pytest.raises(SetupError, match="360000001 is there; add cal=FILE"):
        identify_labjack_u6(parse_address("labjack-u6://"), Deadline(1.0))


@pytest.mark.filterwarnings("ignore")
def test_another_client_reads_the_same_volts_from_the_simulated_converter():
    """LabJackPython, the maker's client, with its transport replaced by the simulated converter."""
    u6, base = pytest.importorskip("u6"), pytest.importorskip("LabJackPython")
    device = LabJackU6Box(Bench(3), RealClock())

    class Client(u6.U6):
        def write(self, data, _modbus=False, checksum=True):
            if checksum:
                base.setChecksum(data)
            device.command(bytes(data))

        def read(self, length, stream=False, _modbus=False):
            data = device.stream_packet(1.0) if stream else device.answer()
            return data if stream else list(data[:length])

    client = Client(autoOpen=False)
    client.handle, client.devType = 1, 6
    assert client.configU6()["SerialNumber"] == device.serial
    client.getCalibrationData()
    client.streamConfig(
        NumChannels=6,
        ChannelNumbers=[0, 2, 4, 6, 8, 10],
        ChannelOptions=[0x80] * 6,
        ResolutionIndex=1,
        SamplesPerPacket=24,
        ScanFrequency=1000,
    )
    client.streamStart()
    client.streamSamplesPerPacket = 24
    packet = device.stream_packet(1.0)
    makers_volts = client.processStreamData(packet, numBytes=62)
    constants = wire.parse_constants(*_memory(device))
    driver_volts = wire.StreamDecoder(constants).feed(packet).raw
    for gauge in range(6):
        np.testing.assert_allclose(makers_volts[f"AIN{2 * gauge}"], driver_volts[:, gauge], atol=1e-9)


def _memory(device):
    for block in (0, 2):
        device.command(wire.read_memory(block))
        yield device.answer()
