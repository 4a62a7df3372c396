"""Device addresses as people type them."""

import contextlib
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from daq_app.simulation.wiring import connect
from drivers.address import AddressError, check_form, parse_address
from drivers.catalog import open_transducer
from drivers.clock import RealClock
from drivers.transducer import LinkLost, SetupError

SERIAL = "serial-ft:///dev/ttyUSB0?counts_per_N=20"


def test_an_address_is_cut_into_its_parts():
    address = parse_address("net-ft://127.0.0.1?rdt=49152&tcp=49151&http=8080")
    assert (address.scheme, address.host) == ("net-ft", "127.0.0.1")
    assert address.options == {"rdt": "49152", "tcp": "49151", "http": "8080"}
    assert address.number("http", 80, 1, 65535) == 8080
    assert address.number("rate", 200, 1, 7000) == 200


@pytest.mark.parametrize(
    "uri",
    [
        "",
        "192.168.1.1",
        "net-ft",
        "://x",
        "net-ft://a b",
        "net-ft://host:99",
        "net-ft://h:99999",
        "net-ft://[::1",
        "net-ft://u@host",
        "net-ft://h#f",
        "net-ft://h?rdt=1&rdt=2",
    ],
)
def test_what_is_no_address_is_refused_in_a_sentence(uri):
    with pytest.raises(SetupError):
        parse_address(uri)


def test_a_space_in_the_name_of_a_file_is_written_as_the_refusal_of_one_says():
    path = r"C:\Users\Anna Meier\FT1.cal"
    with pytest.raises(SetupError, match="write %20 for each"):
        parse_address(f"labjack-u6://?cal={path}")
    assert parse_address(f"labjack-u6://?cal={path.replace(' ', '%20')}").options["cal"] == path


@pytest.mark.parametrize("value", ["0", "65536", "-1", "1.5", "x", "", "٣", "9" * 5000])
def test_an_option_out_of_range_is_refused_by_name(value):
    with pytest.raises(SetupError, match="rdt"):
        parse_address(f"net-ft://h?rdt={value}").number("rdt", 1, 1, 65535)


def test_an_unknown_option_is_refused_with_those_that_are_allowed():
    with pytest.raises(SetupError, match=r"'port'.*http, rdt"):
        check_form(parse_address("net-ft://h?port=1"), "net-ft://h", frozenset({"rdt", "http"}))


@given(st.one_of(st.text(max_size=30), st.text(max_size=20).map(lambda text: "net-ft://" + text)))
def test_any_text_is_an_address_or_refused_in_a_sentence(text):
    with contextlib.suppress(SetupError):
        parse_address(text)


@pytest.mark.parametrize(
    ("uri", "reason"),
    [
        ("usb://x", "no driver 'usb'"),
        ("net-ft://", "names no host"),
        ("net-ft:192.168.1.1", "names no host; write for example net-ft://192.168.1.1"),
        ("net-ft://192.168.1.1/netftapi2.xml", "has no path (/netftapi2.xml)"),
        ("labjack-u6://foo?cal=a.cal", "has no host (foo); write for example labjack-u6://?serial=...&cal=FILE"),
        ("labjack-u6:/foo?cal=a.cal", "has no path (/foo)"),
        ("nidaq://Dev1/ai0?cal=a.cal", "has no path (/ai0); write for example nidaq://Dev1?cal=FILE"),
        ("net-ft://127.0.0.1?http=0", "http=0"),
        ("net-ft://127.0.0.1?rate=8000", "rate=8000"),
        ("net-ft://127.0.0.1?baud=1", "'baud'"),
        ("net-ft://no.such.host.invalid", "cannot be found"),
        ("serial-ft:///dev/ttyUSB0", "cannot tell its units"),
        ("serial-ft:///dev/ttyUSB0?counts_per_N=20", "cannot tell its units"),
        (f"{SERIAL}&counts_per_Nm=-3", "counts_per_Nm=-3 must be a number above 0"),
        (f"{SERIAL}&counts_per_Nm=3_0", "must be a number above 0"),
        (f"{SERIAL}&counts_per_Nm=30&format=morse", "format=morse"),
        (f"{SERIAL}&counts_per_Nm=30&baud=fast", "baud=fast"),
    ],
)
def test_an_address_that_cannot_be_opened_is_refused_in_a_sentence(uri, reason):
    with pytest.raises(SetupError, match=re.escape(reason)):
        open_transducer(uri, RealClock())


@pytest.mark.parametrize("uri", ["sim://foo", "sim:foo", "sim:/foo?seed=7"])
def test_a_simulated_bench_has_no_name(uri):
    with pytest.raises(AddressError, match=r"foo\); write for example sim:\?seed="), connect(uri, RealClock()):
        pass


@pytest.mark.parametrize(
    "uri", ["net-ft://", "serial-ft://", "serial-ft:///dev/ttyUSB0", "digital-ft://", "labjack-u6://"]
)
def test_an_address_that_lacks_something_is_a_wrong_address(uri):
    with pytest.raises(AddressError):
        open_transducer(uri, RealClock())


def test_nothing_at_an_address_is_a_lost_link():
    with pytest.raises(LinkLost, match=r"nothing answers.*check power"):
        open_transducer("net-ft://127.0.0.1?http=1", RealClock())
