"""Transducers on the command line: who answers, and what a probe measures of one whose readings are known."""

import json
from contextlib import nullcontext
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from stand_ins import INFO as SIMULATED

from daq_app.cli.main import run
from daq_app.cli.verbs import devices
from daq_app.recorder.device_history import platformdirs, remember_overload, remember_zero
from drivers.catalog import Probe
from drivers.clock import SimulatedClock
from drivers.readings import ReadingBlock
from drivers.transducer import Health

INFO = replace(SIMULATED, uri="net-ft://192.168.1.1", serial="FT1234", simulated=False)  # 1e-6 N, 1e-3 N mm a count


@pytest.fixture(autouse=True)
def data_folder(tmp_path, monkeypatch):
    monkeypatch.setattr(platformdirs, "user_data_dir", lambda *_, **__: str(tmp_path))


def cells(text):
    return [line.split("  ") for line in text.splitlines()]


def test_who_answers_is_listed_with_what_it_has_been_through(monkeypatch, capsys):
    silent = Probe("labjack-u6:", None, "labjack-u6: nothing answers")
    monkeypatch.setattr(devices, "reachable", lambda _: [Probe(INFO.uri, INFO, None), silent])
    monkeypatch.setattr(devices, "serial_ports", lambda: ["/dev/ttyUSB0"])
    remember_zero(INFO, (0, 0, 0, 0, 0, 0), (1e3, 1e3, 4e3, 9e3, 9e3, 9e3))
    remember_zero(INFO, (1e5, 0, -3e5, 9e3, 0, 0), (1e3, 1e3, 4e3, 9e3, 9e3, 9e3))
    assert run(["devices"]) == 0
    text = capsys.readouterr().out
    rows = [[cell.strip() for cell in row if cell.strip()] for row in cells(text)]
    assert [INFO.uri, INFO.model, "FT1234", "typed in"] in rows
    assert ["labjack-u6:", "–", "–", "no answer"] in rows
    assert "labjack-u6: nothing answers" in text.splitlines()
    assert "/dev/ttyUSB0 is a serial port, which was not opened: try it as " in text
    assert "FT1234: zero moved by at most 0.30 N since " in text
    assert "(2 zeros), noise at rest 0.0040 N, no overload" in text
    remember_overload(INFO, (1.2,) * 7)
    assert run(["devices", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    first, second, third = document["devices"]
    assert (first["serial"], first["life"]["zeros"], first["life"]["overloads"]) == ("FT1234", 2, 1)
    assert second == {"uri": "labjack-u6:", "problem": "labjack-u6: nothing answers"}
    assert (third["uri"], third["simulated"]) == ("sim:", True)


class PlainTransducer:
    """A transducer of 250 readings a second whose raw numbers alternate about (0, 0, -2e6, 0, 0, 3e3) counts."""

    def __init__(self, clock, lost):
        self.clock, self.info, self.health = clock, INFO, Health(received=100, lost=lost)
        self.start = self.stop = lambda: None

    def read(self, timeout):
        self.clock.sleep(timeout)
        end_ns = self.clock.now_ns()
        number = np.arange(round(250 * end_ns * 1e-9) - 25, round(250 * end_ns * 1e-9)) + 1000
        raw = np.array([0.0, 0.0, -2e6, 0.0, 0.0, 3e3]) + np.where(number % 2, 1.0, -1.0)[:, None] * 5e3
        return ReadingBlock(number, number, 0 * number, number / 250.0, (number - 1000) * 4_000_000, raw)


@pytest.mark.parametrize(("lost", "code"), [(0, 0), (1, 3)])
def test_a_probe_measures_rate_mean_and_noise_and_a_loss_is_a_flaw(monkeypatch, capsys, lost, code):
    clock = SimulatedClock()
    monkeypatch.setattr(devices, "RealClock", lambda: clock)
    monkeypatch.setattr(
        devices, "connect", lambda *_: nullcontext(SimpleNamespace(transducer=PlainTransducer(clock, lost)))
    )
    assert run(["devices", "probe", INFO.uri]) == code
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["measured", "250.00", "Hz", "on", "the", "session's", "clock"] in rows
    assert ["Fz", "−2.00", "0.0050", "N"] in rows
    assert ["Tz", "3.00", "5.0", "N", "mm"] in rows
    assert run(["devices", "probe", INFO.uri, "--json"]) == code
    document = json.loads(capsys.readouterr().out)
    assert document["measured_rate"] == pytest.approx(250.0)
    assert document["mean"] == pytest.approx([0.0, 0.0, -2.0, 0.0, 0.0, 3.0], abs=1e-9)
    count = round(devices.PROBED * 250)
    assert document["noise"] == pytest.approx(np.array([5e-3] * 3 + [5.0] * 3) * (count / (count - 1)) ** 0.5)
    assert document["health"]["lost"] == lost
