"""Records of the controller. Golden bytes: the reading that published drivers quote, in text and as bytes."""

import itertools
import struct

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from drivers.serial_ft.wire import AsciiDecoder, BinaryDecoder, answered_record

GOLDEN = (-102, -99, -225, -20, 39, -39)
GOLDEN_ASCII = b"0,  -102,   -99,  -225,   -20,    39,   -39\r\n"
GOLDEN_BINARY = bytes.fromhex("00 FF93 FF98 FE69 FFBB 0006 FFDB")
GOLDEN_BINARY_VALUES = (-109, -104, -407, -69, 6, -37)  # the bytes as signed big-endian integers

DECODERS = {"ascii": AsciiDecoder, "binary": BinaryDecoder}


def record(form, values, error=0):
    if form == "binary":
        return struct.pack(">B6h", error, *values)
    return (str(error) + "".join(f",{value:6d}" for value in values) + "\r\n").encode()


def wandering_values(count, seed=0, size=300.0):
    """Values (count, 6) that wander as those of a hand on a surface do."""
    rng = np.random.default_rng(seed)
    steps = rng.normal(0.0, 8.0, (count, 6))
    return np.clip(np.rint(np.cumsum(steps, axis=0) + rng.normal(0.0, size, 6)), -32000, 32000).astype(int)


def decode(form, chunks):
    decoder = DECODERS[form]()
    parts = [decoder.feed(chunk) for chunk in chunks]
    raw = np.concatenate([part.raw for part in parts] or [np.empty((0, 6))])
    status = [s for part in parts for s in part.status.tolist()]
    damaged = [d for part in parts for d in part.damaged.tolist()]
    return raw, status, damaged, decoder.malformed


def byte_stream(form, values):
    """The bytes of all values, and enough after them that every one can be judged."""
    tail = [values[-1]] * 9 if form == "binary" else []
    return b"".join(record(form, v) for v in [*values, *tail])


def test_the_golden_line_of_text_is_its_reading():
    raw, status, damaged, malformed = decode("ascii", [GOLDEN_ASCII])
    assert raw.tolist() == [list(GOLDEN)]
    assert (status, damaged, malformed) == ([0], [0], 0)


def test_the_golden_bytes_are_signed_and_big_endian():
    raw, status, _, malformed = decode("binary", [GOLDEN_BINARY * 9 + bytes(12)])
    assert raw.tolist()[0] == list(GOLDEN_BINARY_VALUES)
    assert (status[0], malformed) == (0, 0)


def test_the_golden_answers_to_one_request_are_whole():
    assert answered_record(b"QR\r\n" + GOLDEN_BINARY + bytes.fromhex("06 0D 0A 3E"), binary=True)
    assert answered_record(b"QR\r\n" + GOLDEN_ASCII + b"\r\n>", binary=False)
    assert not answered_record(b"QR\r\n" + GOLDEN_ASCII + b"\r\n>", binary=True)
    assert not answered_record(b"QR\r\n" + GOLDEN_BINARY + b"\x06\r\n>", binary=False)


@pytest.mark.parametrize("form", DECODERS)
@given(cuts=st.lists(st.integers(0, 45 * 40), max_size=30).map(sorted), seed=st.integers(0, 20), damage=st.booleans())
@settings(max_examples=40)
def test_readings_do_not_depend_on_how_the_stream_was_cut(form, cuts, seed, damage):
    stream = bytearray(byte_stream(form, wandering_values(40, seed)))
    if damage:
        del stream[200:205]
        stream[400:413] = b"Power on.\r\n>\xff"
    chunks = [bytes(stream[a:b]) for a, b in itertools.pairwise([0, *cuts, len(stream)])]
    in_chunks, at_once = decode(form, chunks), decode(form, [bytes(stream)])
    assert in_chunks[0].tolist() == at_once[0].tolist()
    assert in_chunks[1:] == at_once[1:]


@pytest.mark.parametrize("form", DECODERS)
@given(garbage=st.lists(st.binary(max_size=200), max_size=8))
def test_no_garbage_raises(form, garbage):
    raw, status, damaged, malformed = decode(form, garbage)
    assert len(raw) == len(status) == len(damaged)
    assert malformed >= sum(damaged)


@pytest.mark.parametrize("form", DECODERS)
@given(gap=st.integers(1, 60), at=st.integers(300, 900), seed=st.integers(0, 50))
@settings(max_examples=40)
def test_lost_bytes_cost_the_records_they_belonged_to_and_no_wrong_reading_comes_out(form, gap, at, seed):
    values = wandering_values(80, seed, size=3000.0)
    stream = byte_stream(form, values)
    raw, _, damaged, malformed = decode(form, [stream[:at], stream[at + gap :]])
    size = 13 if form == "binary" else 45
    assume(gap % size)  # else one reading is pieced together from two, which no reader can see
    true_values = {tuple(v) for v in values.tolist()}
    assert all(tuple(int(x) for x in v) in true_values for v in raw.tolist())
    assert len(raw) >= len(values) - gap // size - 4
    assert malformed == sum(damaged)


def test_binary_keeps_its_place_through_a_blow_that_no_smooth_course_has():
    values = wandering_values(60, 3)
    values[30:34] += np.array([4000, -9000, 20000, 12000, -7000, 3000])
    raw, _, damaged, malformed = decode("binary", [byte_stream("binary", values)])
    np.testing.assert_array_equal(raw[:60], values)
    assert malformed == sum(damaged) == 0


def test_binary_finds_its_place_though_the_values_stand_still():
    values = [(5, -2, 0, 300, -1, 7)] * 40
    stream = byte_stream("binary", values)
    raw, _, damaged, _ = decode("binary", [stream[:201], stream[202:]])
    assert {tuple(int(x) for x in v) for v in raw.tolist()} == {values[0]}
    assert sum(damaged) == 3  # the one that lost a byte, and both beside it, which might be the ones that did


@pytest.mark.parametrize("form", DECODERS)
def test_an_error_digit_is_the_status_of_its_reading_which_is_kept(form):
    values = wandering_values(6, 1)
    stream = b"".join(record(form, v, error=int(i == 2)) for i, v in enumerate(values)) + byte_stream(form, values[-1:])
    raw, status, _, malformed = decode(form, [stream])
    assert status[:6] == [0, 0, 1, 0, 0, 0]
    np.testing.assert_array_equal(raw[:6], values)
    assert malformed == 0


def test_a_banner_in_mid_stream_is_broken_records_and_nothing_else():
    values = wandering_values(30, 2)
    text = b"\r\nF/T Controller\r\nall rights reserved, ready\r\n>"
    stream = byte_stream("ascii", values[:15]) + text + byte_stream("ascii", values[15:])
    raw, _, damaged, _ = decode("ascii", [stream])
    assert len(raw) >= 29
    assert sum(damaged) >= 1
    stream = byte_stream("binary", values[:15]) + text + byte_stream("binary", values[15:])
    raw, _, damaged, _ = decode("binary", [stream])
    true_values = {tuple(v) for v in values.tolist()}
    assert all(tuple(int(x) for x in v) in true_values for v in raw.tolist())
    assert sum(damaged) >= len(text) // 13


@pytest.mark.parametrize(
    "line",
    [
        b"0,  -102,   -99,  -225,   -20,    39,   -3\r\n",  # a digit is missing
        b"0,  -102,   -99,  -225,   -20,    39\r\n",
        b"0, 40000,   -99,  -225,   -20,    39,   -39\r\n",  # not in 16 bits
        b"0,  -1-2,   -99,  -225,   -20,    39,   -39\r\n",
        b"x,  -102,   -99,  -225,   -20,    39,   -39\r\n",
        b"0,  -102,   -99,  -225,   -20,    39,   -39\n\n",
    ],
)
def test_a_line_of_another_form_is_a_broken_record(line):
    raw, _, damaged, malformed = decode("ascii", [line, GOLDEN_ASCII])
    assert raw.tolist() == [list(GOLDEN)]
    assert damaged[0] == malformed >= 1
