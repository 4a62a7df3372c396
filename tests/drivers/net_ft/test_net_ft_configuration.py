"""The box's configuration page, as pages that real boxes and hostile ones could send."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.net_ft.configuration import parse_configuration, true_rate
from drivers.transducer import SetupError

URI = "net-ft://box"
ELEMENTS = {
    "prodname": "Net F/T",
    "mfgtxdmdl": "SI-36-0.5",
    "runstat": "0x80020000",
    "setbias": "1;-2; 3,4 5;-18343",
    "setuserfilter": "5",
    "cfgnam": "Nano43",
    "cfgcalsn": "FT12345",
    "cfgcpf": "1000000",
    "cfgcpt": "1000000",
    "scfgfu": "N",
    "scfgtu": "N-m",
    "cfgmr": "36;36;36;0.5;0.5;0.5",
    "cfgtfx": "0;0;0;0;0;0",
    "comrdte": "Enabled",
    "comrdtrate": "200",
}


def page(root="netft", extra="", **changes):
    elements = ELEMENTS | changes
    body = "".join(f"<{name}>{text}</{name}>" for name, text in elements.items() if text is not None)
    return f'<?xml version="1.0"?><{root}>{extra}{body}</{root}>'.encode()


def test_a_page_gives_identity_calibration_and_settings():
    info, _, streams = parse_configuration(page(), URI)
    assert (info.uri, info.model, info.serial) == (URI, "Net F/T SI-36-0.5", "FT12345")
    assert (info.rate, streams) == (200.0, True)
    calibration = info.calibration
    assert calibration.serial == "FT12345"
    assert calibration.rated.tolist() == [36, 36, 36, 500, 500, 500]
    assert calibration.wrench(np.array([[1e6, 0, 0, 0, 0, 2e6]]), np.zeros(6)).tolist() == [[1, 0, 0, 0, 0, 2000]]
    assert info.settings == {
        "configuration": "Nano43",
        "filter": "35 Hz",
        "stored bias [gauge counts]": "1 -2 3 4 5 -18343",
        "status at opening": "transducer saturated or converter error",
    }


@pytest.mark.parametrize(
    ("force", "torque", "newtons", "newton_millimetres"),
    [
        ("N", "N-mm", 1.0, 1.0),
        ("N", "Nm", 1.0, 1000.0),
        ("lbf", "lbf-in", 4.4482216, 112.98483),
        ("lb", "lb-ft", 4.4482216, 1355.8179),
        ("klbf", "ft-lb", 4448.2216, 1355.8179),
        ("kN", "kN-m", 1000.0, 1e6),
        ("kg", "kgf-cm", 9.80665, 98.0665),
        ("g", "Nmm", 0.00980665, 1.0),
    ],
)
def test_units_are_converted(force, torque, newtons, newton_millimetres):
    matrix = parse_configuration(page(scfgfu=force, scfgtu=torque), URI).info.calibration.matrix
    np.testing.assert_allclose(np.diag(matrix) * 1e6, [newtons] * 3 + [newton_millimetres] * 3, rtol=1e-7)


def test_the_rated_range_follows_the_units():
    configuration = parse_configuration(page(scfgfu="lbf", cfgmr="8;8;8;0.5;0.5;0.5"), URI)
    np.testing.assert_allclose(configuration.info.calibration.rated, [35.585773] * 3 + [500.0] * 3, rtol=1e-7)


@pytest.mark.parametrize("text", [None, "", "1;2;3", "36;36;36;0.5;0.5;nan", "0;0;0;0;0;0"])
def test_a_rated_range_that_is_not_stated_is_unknown(text):
    assert np.all(np.isnan(parse_configuration(page(cfgmr=text), URI).info.calibration.rated))


@pytest.mark.parametrize("name", ["prodname", "cfgcpf", "cfgcpt", "scfgfu", "scfgtu"])
@pytest.mark.parametrize("text", [None, "", "  ", "1</{name}><{name}>1", "1<inner/>"])
def test_what_a_client_needs_must_be_there_exactly_once_as_text(name, text):
    with pytest.raises(SetupError, match=name):
        parse_configuration(page(**{name: text and text.format(name=name)}), URI)


@pytest.mark.parametrize("text", ["0", "-1", "nan", "inf", "1e999", "1_000", "1,5", "0x10", "१", "1" * 60, "1 2"])
@pytest.mark.parametrize("name", ["cfgcpf", "cfgcpt"])
def test_counts_per_unit_are_a_number_above_0_written_with_a_point(name, text):
    with pytest.raises(SetupError, match=name):
        parse_configuration(page(**{name: text}), URI)


@pytest.mark.parametrize("text", ["500000.5", "1e6", " 1000000 ", "+.5E3"])
def test_counts_per_unit_may_be_fractions(text):
    assert parse_configuration(page(cfgcpf=text), URI).counts[0] == float(text)


def test_an_unknown_unit_is_refused():
    with pytest.raises(SetupError, match="stone"):
        parse_configuration(page(scfgfu="stone"), URI)


BOMB = '<!DOCTYPE netft [<!ENTITY a "x"><!ENTITY b "&a;&a;">]>'


@pytest.mark.parametrize(
    "hostile",
    [
        page().replace(b"<netft>", BOMB.encode() + b"<netft>"),
        page().replace(b"<netft>", b'<!DOCTYPE netft SYSTEM "file:///etc/passwd"><netft>'),
        page(prodname="&undeclared;"),
        page(root="html"),
        page()[:-30],
        page() + b"<more/>",
        b"",
        b"\x00\xff" * 50,
        page().replace(b'version="1.0"', b'version="1.0" encoding="klingon"'),
        b"<netft>" * 5000,
    ],
)
def test_a_hostile_or_broken_page_is_refused_in_a_sentence(hostile):
    with pytest.raises(SetupError, match="configuration page"):
        parse_configuration(hostile, URI)


@given(st.binary(max_size=300))
def test_garbage_raises_nothing_but_a_sentence(garbage):
    with pytest.raises(SetupError):
        parse_configuration(garbage, URI)


@given(st.dictionaries(st.sampled_from(sorted(ELEMENTS)), st.text("0123456789;.-xeN \u00e9", max_size=12)))
def test_any_texts_give_a_configuration_that_can_be_used_or_a_sentence(changes):
    try:
        configuration = parse_configuration(page(**changes), URI)
    except SetupError:
        return
    assert np.all(np.isfinite(configuration.info.calibration.matrix))
    assert math.isnan(configuration.info.rate) or 1.0 <= configuration.info.rate <= 7000.0


def test_a_disabled_stream_is_seen():
    assert not parse_configuration(page(comrdte="Disabled"), URI).streams


@pytest.mark.parametrize("text", [None, "", "0", "7001", "many"])
def test_a_rate_that_is_not_stated_is_unknown(text):
    assert math.isnan(parse_configuration(page(comrdtrate=text), URI).info.rate)


def test_a_tool_transform_in_force_is_recorded():
    configuration = parse_configuration(page(cfgtfx="0;0;4.5;0;0;90", scfgtdu="mm", scfgtau="degrees"), URI)
    assert configuration.info.settings["tool transform"] == "0 0 4.5 0 0 90 [mm, degrees]"


@pytest.mark.parametrize("code", ["12", "13", "x", "-1"])
def test_a_filter_is_named_or_its_code_kept(code):
    filter_name = parse_configuration(page(setuserfilter=code), URI).info.settings["filter"]
    assert filter_name == ("3000 Hz" if code == "12" else code)


@pytest.mark.parametrize(
    ("rate", "expected"), [(200, 200), (1000, 1000), (150, 7000 / 46), (99, 100), (7000, 7000), (1, 1)]
)
def test_rates_are_integer_fractions_of_7000_rounded_up(rate, expected):
    assert true_rate(rate) == pytest.approx(expected, rel=1e-12)
    assert true_rate(int(expected)) == pytest.approx(expected, rel=1e-12)


def test_166_rates_can_be_told_apart_by_the_whole_number_shown():
    assert len({round(true_rate(rate), 6) for rate in range(1, 7001)}) == 166
