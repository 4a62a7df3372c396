"""Frames and packets of the RS-485 transducer. Golden bytes: from the published layout and the Modbus checksum."""

import itertools
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.digital_ft import wire
from drivers.digital_ft.wire import StreamDecoder, answer_in, parse_calibration
from drivers.transducer import SetupError

GOLDEN_PACKET = bytes.fromhex("0064 012C 01F4 FF38 FE70 FDA8 50")
GOLDEN_GAUGES = [100, -200, 300, -400, 500, -600]  # G0 to G5


def packet(gauges, flag=False):
    body = struct.pack(">6h", *(gauges[i] for i in (0, 2, 4, 1, 3, 5)))
    return body + bytes([sum(body) & 0x7F | (0x80 if flag else 0)])


def random_gauges(count, seed=0):
    rng = np.random.default_rng(seed)
    return np.clip(np.rint(np.cumsum(rng.normal(0.0, 20.0, (count, 6)), axis=0)), -32000, 32000).astype(int)


def decode(chunks):
    decoder = StreamDecoder()
    parts = [decoder.feed(chunk) for chunk in chunks]
    raw = [v for part in parts for v in part.raw.astype(int).tolist()]
    status = [s for part in parts for s in part.status.tolist()]
    damaged = [d for part in parts for d in part.damaged.tolist()]
    return raw, status, damaged, decoder.malformed


@pytest.mark.parametrize(
    ("frame", "golden"),
    [
        (wire.request(wire.START_STREAM, b"\x55"), "0A 46 55 A3 9D"),
        (wire.request(wire.START_STREAM, b"\x01"), "0A 46 01 A2 62"),
        (wire.request(wire.UNLOCK, b"\xaa"), "0A 6A AA FF 1D"),
        (wire.request(wire.UNLOCK, b"\x01"), "0A 6A 01 BE A2"),
        (wire.request(wire.UNLOCK, b"\x18"), "0A 6A 18 7F 68"),
        (wire.read_registers(wire.STATUS, 1), "0A 03 00 1D 00 01 15 77"),
        (wire.read_registers(wire.calibration_address(1), 64), "0A 03 00 E3 00 40 B4 B7"),
    ],
)
def test_frames_are_the_golden_ones(frame, golden):
    assert frame == bytes.fromhex(golden)


def test_golden_answers_are_understood_wherever_they_lie():
    status_request = wire.read_registers(wire.STATUS, 1)
    assert answer_in(bytes.fromhex("0A 03 02 00 00 1D 85"), status_request) == b"\0\0"
    assert answer_in(b"\x0a\x03garbage" + bytes.fromhex("0A 03 02 00 00 1D 85 0A"), status_request) == b"\0\0"
    assert answer_in(status_request + bytes.fromhex("0A 83 02 B1 33"), status_request) == "illegal address"
    assert answer_in(bytes.fromhex("0A 03 02 00 00 1D 84"), status_request) is None
    start_request = wire.request(wire.START_STREAM, b"\x55")
    assert answer_in(start_request, start_request) is None  # an adapter that repeats what is sent is no answer
    assert answer_in(start_request + bytes.fromhex("0A 46 01 A2 62"), start_request) == b"\x01"


@given(response=st.binary(max_size=80), function=st.sampled_from([0x03, 0x10, 0x46, 0x6A]))
def test_no_garbage_is_an_answer_or_raises(response, function):
    request = {0x03: wire.read_registers(29, 1), 0x10: wire.write_registers(0, bytes(24))}.get(
        function, wire.request(function, b"\x55")
    )
    answer = answer_in(response, request)
    assert answer is None or isinstance(answer, (bytes, str))


def test_the_golden_packet_gives_its_gauges_in_order():
    raw, status, damaged, malformed = decode([GOLDEN_PACKET * 7])
    assert raw == [GOLDEN_GAUGES] * 6
    assert status == damaged == [0] * 6
    assert malformed == 0


def test_the_flag_of_a_packet_is_its_status_and_no_part_of_the_checksum():
    raw, status, _, _ = decode([GOLDEN_PACKET * 6 + GOLDEN_PACKET[:-1] + b"\xd0" + GOLDEN_PACKET])
    assert raw == [GOLDEN_GAUGES] * 7
    assert status == [0] * 6 + [wire.STATUS_FLAG]


@pytest.mark.parametrize("end", [32767, -32768])
def test_a_gauge_at_the_end_of_its_range_marks_its_reading(end):
    _, status, _, _ = decode([GOLDEN_PACKET * 6 + packet([1, 2, end, 3, 4, 5]) + GOLDEN_PACKET])
    assert status == [0] * 6 + [wire.GAUGE_AT_END]


@given(
    cuts=st.lists(st.integers(0, 13 * 60), max_size=40).map(sorted),
    seed=st.integers(0, 20),
    damages=st.lists(st.tuples(st.integers(0, 700), st.integers(0, 30), st.binary(max_size=30)), max_size=3),
)
def test_readings_do_not_depend_on_how_the_stream_was_cut(cuts, seed, damages):
    stream = bytearray(b"".join(packet(v) for v in random_gauges(60, seed)))
    for start, length, replacement in damages:
        stream[start : start + length] = replacement
    chunks = [bytes(stream[a:b]) for a, b in itertools.pairwise([0, *cuts, len(stream)])]
    assert decode(chunks) == decode([bytes(stream)])


@given(garbage=st.lists(st.binary(max_size=300), max_size=8))
def test_no_garbage_raises_or_loops(garbage):
    raw, status, damaged, malformed = decode(garbage)
    assert len(raw) == len(status) == len(damaged)
    assert malformed == sum(damaged)


@given(offset=st.integers(0, 12), seed=st.integers(0, 100))
def test_a_stream_begun_in_the_middle_of_a_packet_is_found(offset, seed):
    values = random_gauges(40, seed).tolist()
    raw, _, _, _ = decode([b"".join(packet(v) for v in values)[offset:]])
    first = 1 if offset else 0
    assert raw[-20:] == values[-21:-1]
    assert len(raw) >= 38 - first - 6  # a wrong place may pass for a while, never six packets in a row for long


def test_lost_bytes_cost_few_packets_and_rarely_a_wrong_reading():
    cases = [(at, gap) for at in range(130, 400, 31) for gap in range(1, 61)]
    wrong_count = 0
    for seed in range(4):
        values = random_gauges(80, seed)
        stream = b"".join(packet(v) for v in values)
        true_values = set(map(tuple, values.tolist()))
        for at, gap in cases:
            raw, _, damaged, malformed = decode([stream[:at], stream[at + gap :]])
            wrong_count += sum(tuple(v) not in true_values for v in raw)
            assert len(raw) >= len(values) - gap // 13 - 6
            assert malformed == sum(damaged)
    # Where whole packets' lengths are lost the stream stays in step, and seven bits let one splice in 128 pass.
    assert wrong_count <= 2 * 4 * len(cases) / 13 / 128


def test_a_packet_with_a_bad_checksum_is_broken_and_the_others_are_kept():
    values = random_gauges(30, 5).tolist()
    packets = [packet(v) for v in values]
    packets[12] = packets[12][:-1] + bytes([packets[12][-1] ^ 0x01])
    raw, _, damaged, malformed = decode([b"".join(packets)])
    assert raw == values[:11] + values[14:29]  # its neighbours are not believed without it
    assert damaged[11] == malformed == 3


def calibration_registers(**changes):
    fields = {
        "serial": b"FT12345\0",
        "part": b"SI-36-0.5",
        "units": (2, 3),
        "matrix": np.diag([1.5, 2.5, 3.5, 4.5, 5.5, 6.5]),
        "counts": (1000, 2000),
        "rated": (36, 36, 36, 0.5, 0.5, 0.5),
    } | changes
    return (
        fields["serial"].ljust(8, b"\0")
        + fields["part"].ljust(32, b"\0")
        + b"DIG\0"
        + b"12/14/2020".ljust(20, b"\0")
        + struct.pack(">36f", *np.ravel(fields["matrix"]))
        + bytes(fields["units"])
        + struct.pack(">6f", *fields["rated"])
        + struct.pack(">ii", *fields["counts"])
        + struct.pack(">12H", *range(1, 13))
    )


def test_a_calibration_is_read_from_its_registers():
    registers = calibration_registers()
    assert len(registers) == 2 * wire.CALIBRATION_SIZE
    record = parse_calibration(registers)
    assert (record.calibration.serial, record.part_number, record.calibrated) == ("FT12345", "SI-36-0.5", "12/14/2020")
    # 1.5 in the matrix over 1000 counts in a newton; 4.5 over 2000 counts in a newton metre
    np.testing.assert_allclose(np.diag(record.calibration.matrix), [1.5e-3, 2.5e-3, 3.5e-3, 2.25, 2.75, 3.25])
    np.testing.assert_allclose(record.calibration.rated, [36, 36, 36, 500, 500, 500])
    assert struct.unpack(">12H", record.gains_and_offsets) == tuple(range(1, 13))


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"serial": b""}, "no serial number"),
        ({"units": (9, 3)}, "codes 9 and 3"),
        ({"matrix": np.zeros((6, 6))}, "does not tell forces and torques apart"),
        ({"matrix": np.full((6, 6), np.nan)}, "does not tell"),
        ({"counts": (0, 1)}, "does not tell"),
    ],
)
def test_a_calibration_that_makes_no_sense_is_refused(changes, reason):
    with pytest.raises(SetupError, match=reason):
        parse_calibration(calibration_registers(**changes))


def test_a_range_that_is_not_stated_is_unknown():
    assert np.isnan(
        parse_calibration(calibration_registers(rated=(0, -1, np.nan, 1, 1, 1))).calibration.rated[:3]
    ).all()


@given(st.binary(min_size=266, max_size=266))
def test_any_registers_are_a_calibration_or_refused(registers):
    try:
        record = parse_calibration(registers)
    except SetupError:
        return
    assert np.all(np.isfinite(record.calibration.matrix))


def test_status_bits_have_their_names():
    assert wire.status_words(0) == ()
    assert wire.status_words(1 << 13 | 1 << 7) == ("EEPROM error", "converter reading out of range")
