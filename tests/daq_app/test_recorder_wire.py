import io
import itertools
import math
import os
from dataclasses import fields, is_dataclass

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from stand_ins import INFO

from daq_app.recorder.messages import (
    LENGTH_PREFIX,
    REPORTS,
    REQUESTS,
    BrokenMessage,
    Codec,
    Connect,
    Device,
    Failed,
    HealthReport,
    Live,
    People,
    ResumeSession,
    SessionBegun,
    StartSession,
    Stop,
)
from daq_app.recorder.pipes import Outbox
from drivers.transducer import Health
from sessions.plan.plan import Frame
from sessions.plan.protocols.planning import plan
from sessions.plan.protocols.protocol import protocol
from sessions.recording import LoggedEvent, Setting
from sessions.run.steps import AskScore, Scored, Zeroed

PLAN = plan(protocol("sensotact-friction"), "S01", 3, forces=True)
SIX = (1.0, 2.0, 3.0, 4.0, 5.0, math.nan)
REQUEST_EXAMPLES = [
    Connect("sim:?seed=7"),
    StartSession(PLAN, "recordings/P07", People("simulated hand", 7), (Setting("seed", 3, "", "set"),)),
    ResumeSession("recordings/Ä 日", None, None),
    Stop(),
    Scored(None, ((1.5, 20.0), (1.75, 30.25)), 1.5, 1, "left", "pen"),
]
REPORT_EXAMPLES = [
    Device(INFO, Frame("-z", "set", 20.0, "set")),
    HealthReport(Health(received=7), 200.5, (*SIX, 2.0), (*SIX, 2.0), 0),
    Live(
        1, np.arange(3), np.arange(3.0), np.arange(3) * 7, np.arange(18.0).reshape(3, 6), np.zeros(3, int), SIX[:6], 4
    ),
    SessionBegun("f", PLAN, "people", None, -5, (LoggedEvent(1, 2**60, "zeroed", None, 3, {"mean": [0.1] * 6}),)),
    AskScore(PLAN.trials[0], ("not at all", "very")),
    Failed("Tare", "no"),
]


def same(a, b):
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    if is_dataclass(a) or isinstance(a, msgspec.Struct):
        names = [field.name for field in (fields(a) if is_dataclass(a) else msgspec.structs.fields(a))]
        return type(a) is type(b) and all(same(getattr(a, name), getattr(b, name)) for name in names)
    if isinstance(a, tuple):
        return len(a) == len(b) and all(itertools.starmap(same, zip(a, b, strict=True)))
    if isinstance(a, float) and math.isnan(a):
        return math.isnan(b)
    return a == b and type(a) is type(b)  # a seed stays a whole number


@pytest.mark.parametrize(("types", "messages"), [(REQUESTS, REQUEST_EXAMPLES), (REPORTS, REPORT_EXAMPLES)])
@given(data=st.data())
def test_messages_come_out_as_they_went_in_but_for_one_that_is_cut_short(types, messages, data):
    codec = Codec(types)
    parts = list(map(codec.encode, messages))
    end = data.draw(st.integers(0, sum(map(len, parts))))
    whole = sum(total <= end for total in itertools.accumulate(map(len, parts)))
    results = list(codec.read(io.BytesIO(b"".join(parts)[:end])))
    assert all(itertools.starmap(same, zip(messages[:whole], results, strict=True)))


def test_no_two_messages_of_one_direction_share_a_name():
    for types in (REQUESTS, REPORTS):
        assert len({cls.__name__ for cls in types}) == len(types)


@given(st.binary(max_size=60))
def test_bytes_that_are_no_message_are_refused_and_nothing_else(garbage):
    with pytest.raises(BrokenMessage):
        Codec([Connect]).decode(b"\x92\xa7Connect\xc0" + garbage)
    with pytest.raises(BrokenMessage):
        Codec([Connect]).decode(Codec([Zeroed]).encode(Zeroed())[LENGTH_PREFIX.size :])


def test_a_length_beyond_all_reason_is_refused_before_anything_is_gathered():
    with pytest.raises(BrokenMessage):
        next(Codec([Connect]).read(io.BytesIO(LENGTH_PREFIX.pack(2**31) + b"x")))


def test_an_array_of_objects_is_refused():
    body = Codec([Live]).encode(REPORT_EXAMPLES[2])[LENGTH_PREFIX.size :].replace(b"\xa3<i8", b"\xa3|O8")
    with pytest.raises(BrokenMessage):
        Codec([Live]).decode(body)


def test_a_report_that_cannot_be_sent_does_not_keep_the_others_back():
    reading, writing = os.pipe()
    outbox = Outbox(writing)
    outbox.send(LoggedEvent(1, 0, "made up", None, 0, {"value": object()}))
    outbox.send(Failed("Tare", "no"))
    outbox.flush(60.0)
    first, second = Codec(REPORTS).read(io.BytesIO(os.read(reading, 65536)))
    assert "could not be sent" in first.sentence
    assert second == Failed("Tare", "no")
    os.close(reading)
    os.close(writing)
