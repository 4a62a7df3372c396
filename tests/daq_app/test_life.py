"""What is kept of a transducer over the years."""

from dataclasses import replace

import numpy as np
import pytest

from daq_app.recorder import device_history as life
from daq_app.recorder.device_history import life_of, remember_overload, remember_zero
from drivers.calibration import Calibration
from drivers.transducer import TransducerInfo

INFO = TransducerInfo(
    "net-ft://192.168.1.1",
    "net-ft",
    "Net F/T",
    "FT1234",
    simulated=False,
    rate=200.0,
    counter_rate=7000.0,
    calibration=Calibration("FT1234", "counts", np.diag([1e-6] * 3 + [1e-3] * 3), np.full(6, 36.0), "by hand"),
)


@pytest.fixture(autouse=True)
def data_folder(tmp_path, monkeypatch):
    monkeypatch.setattr(life.platformdirs, "user_data_dir", lambda *_, **__: str(tmp_path))
    return tmp_path


def test_of_a_stranger_nothing_is_known():
    assert life_of("FT9999") is None


def test_drift_noise_and_overloads_are_those_that_were_kept():
    remember_zero(INFO, (1e6, 0, 0, 0, 0, 0), (4e3,) * 6)
    remember_zero(INFO, (1.25e6, -1e5, 0, 0, 0, 50), (4e3,) * 6)
    remember_overload(INFO, (1.2, 0, 0, 0, 0, 0, 1.2))
    transducer_life = life_of("FT1234")
    assert transducer_life is not None
    assert (transducer_life.zeros, transducer_life.overloads) == (2, 1)
    np.testing.assert_allclose(transducer_life.drift, [0.25, -0.1, 0.0, 0.0, 0.0, 0.05])
    np.testing.assert_allclose(transducer_life.noise, [0.004] * 3 + [4.0] * 3)
    assert transducer_life.since == transducer_life.last_overload != ""


@pytest.mark.parametrize("end", [b"\n", b""])
def test_a_torn_line_costs_itself_alone(data_folder, end):
    remember_overload(INFO, (1.2, 0, 0, 0, 0, 0, 1.2))
    (file,) = (data_folder / "transducers").iterdir()
    with file.open("ab") as output:
        output.write(b'{"time": "2026-11-21", "kind": "zero", "wrench": [1, \xff' + end)
    remember_overload(INFO, (1.3, 0, 0, 0, 0, 0, 1.3))
    transducer_life = life_of("FT1234")
    assert transducer_life is not None
    assert transducer_life.overloads == 2


def test_a_simulated_transducer_has_no_life_and_a_serial_number_is_no_path(data_folder):
    remember_overload(replace(INFO, simulated=True), (1.2,) * 7)
    assert not list(data_folder.iterdir())
    remember_overload(replace(INFO, serial="../../x y"), (1.2,) * 7)
    assert [file.name for file in (data_folder / "transducers").iterdir()] == ["______x_y.jsonl"]
