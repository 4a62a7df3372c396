"""Datagrams of the networked box. Expected bytes are typed from the maker's layout, not made by the codec."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.calibration import Calibration
from drivers.net_ft.wire import (
    AXIA,
    NET_FT,
    RECORD,
    START,
    STOP,
    Units,
    decode,
    is_latched,
    parse_units,
    parse_wrench,
)
from drivers.transducer import TransducerInfo
from sessions.recording.head import info_from_dict, info_to_dict

RECORD_BYTES = bytes.fromhex("00000001 00000023 00000000 000F4240 FFE17B80 004C4B40 0001E848 FFFFFFFF 00000000")


def test_requests_are_the_makers_bytes():
    assert bytes.fromhex("1234 0002 00000000") == START
    assert bytes.fromhex("1234 0000 00000000") == STOP


def test_a_record_typed_by_hand_is_read():
    (record,) = decode([RECORD_BYTES]).records
    assert (record["number"], record["counter"], record["status"]) == (1, 35, 0)
    assert record["counts"].tolist() == [1_000_000, -2_000_000, 5_000_000, 125_000, -1, 0]


WRENCH = bytes.fromhex("1234 8001 0001 FFFF 7FFF 8000 0000 000A")
UNITS = bytes.fromhex("1234 02 03 000F4240 000003E8 05DC 05DC 05DC 000A 000A 000B")


def test_answers_of_the_command_port_typed_by_hand_are_read():
    assert parse_wrench(WRENCH) == (1, -1, 32767, -32768, 0, 10)
    assert parse_units(UNITS) == Units(1_000_000, 1_000, (1500, 1500, 1500, 10, 10, 11))
    assert [is_latched(WRENCH[:2] + word + WRENCH[4:]) for word in (b"\x80\x01", b"\x80\x02", b"\x00\x00")] == [
        True, False, False
    ]  # fmt: skip


@pytest.mark.parametrize(("parse", "answer"), [(parse_wrench, WRENCH), (parse_units, UNITS)], ids=["wrench", "units"])
@pytest.mark.parametrize("damage", ["shorter", "longer", "first byte", "second byte"])
def test_what_has_another_length_or_header_is_no_answer(parse, answer, damage):
    spoilt = {
        "shorter": answer[:-1],
        "longer": answer + b"\x00",
        "first byte": b"\x13" + answer[1:],
        "second byte": answer[:1] + b"\x35" + answer[2:],
    }
    assert parse(spoilt[damage]) is None


def test_extremes_of_every_field_are_read():
    low, high = bytes.fromhex("80000000") * 9, bytes.fromhex("7FFFFFFF") * 9
    records = decode([b"\xff" * 36, low, high]).records
    assert records["number"].tolist() == [2**32 - 1, 2**31, 2**31 - 1]
    assert records["counts"].tolist() == [[-1] * 6, [-(2**31)] * 6, [2**31 - 1] * 6]


@given(st.lists(st.one_of(st.binary(max_size=80), st.binary(min_size=36, max_size=36))))
def test_any_datagrams_are_either_records_or_malformed(datagrams):
    decoded = decode(datagrams)
    assert len(decoded.records) + decoded.malformed == len(datagrams)
    assert [datagrams[i] for i in decoded.origin] == [d for d in datagrams if len(d) == 36]
    assert decoded.records.tobytes() == b"".join(d for d in datagrams if len(d) == 36)


@given(st.integers(0, 36))
def test_a_cut_record_is_malformed(length):
    assert decode([RECORD_BYTES[:length]]).malformed == (length != 36)


def test_a_record_is_36_bytes():
    assert RECORD.itemsize == 36


@pytest.mark.parametrize(
    ("status", "words"),
    [
        (0, ()),
        (0x80020000, ("transducer saturated or converter error",)),
        (0x80010000, ("monitor condition latched",)),
        (0x00010000, ("monitor condition latched",)),
        (0x80000000, ("unnamed error",)),
        (0xC0000004, ("processor or memory fault", "internal temperature error")),
        (0x00008001, ("unknown bit 15", "unknown bit 0")),
    ],
)
def test_a_status_word_is_reported_in_words(status, words):
    assert NET_FT.words(status) == words


@pytest.mark.parametrize(
    ("family", "saturated", "notes", "numbers"),
    [  # bits of the makers' tables: 9620-05-NET FT, section 15.2, and 9610-05-Ethernet Axia, chapter 10
        (NET_FT, {17}, {16}, {*range(1, 15), *range(16, 31)}),
        (AXIA, {30, 27}, {28, 16, 3}, {0, 1, 2, 3, 5, 7, 16, 27, 28, 29, 30}),
    ],
)
def test_every_bit_of_the_makers_table_is_named_and_judged(family, saturated, notes, numbers):
    for number in range(31):
        (entry,) = family.entries(1 << number)
        assert ("unknown" not in entry.words) == (number in numbers)
        assert entry.verdict == ("saturated" if number in saturated else "note" if number in notes else "doubtful")
        assert family.entries(1 << number | 1 << 31) == (entry,)


def test_the_readings_of_a_box_with_too_little_gauge_excitation_are_doubtful():
    assert NET_FT.words(0x80000100) == ("gauge excitation current too low",)
    assert NET_FT.verdict(0x80000100) == "doubtful"


@pytest.mark.parametrize(
    ("family", "status", "doubtful"),
    [
        (NET_FT, 0, False),
        (NET_FT, 0x00010000, False),  # a latched condition, with and without the summary bit
        (NET_FT, 0x80010000, False),
        (NET_FT, 0x80020000, True),
        (NET_FT, 0x80030000, True),  # latched and saturated
        (NET_FT, 0x80000000, True),  # an error that is not named
        (AXIA, 0x00010000, False),
        (AXIA, 0x00000008, False),  # busy
        (AXIA, 0x88000000, True),
        (AXIA, 0x80000005, True),
    ],
)
def test_a_latched_condition_does_not_make_a_reading_doubtful(family, status, doubtful):
    calibration = Calibration("FT1", "counts", np.eye(6), np.full(6, np.nan), "a test")
    info = TransducerInfo("", "net-ft", "", "FT1", False, 1.0, 1.0, calibration, status=family)
    assert info_from_dict(info_to_dict(info)).status.doubtful(np.array([status])).tolist() == [doubtful]


@given(st.integers(0, 2**32 - 1))
def test_every_status_word_but_0_has_words(status):
    assert bool(NET_FT.words(status)) == (status != 0)


def test_counts_come_as_numbers_numpy_can_hold_exactly():
    counts = decode([RECORD_BYTES]).records["counts"].astype(np.float64)
    assert counts.tolist() == [[1e6, -2e6, 5e6, 125e3, -1.0, 0.0]]
