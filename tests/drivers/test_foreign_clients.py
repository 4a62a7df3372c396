"""Simulated boxes as other people's clients see them, so that one misreading of a manual is not made twice.

The LabJack U6 is read by its maker's client in tests/drivers/labjack_u6. No kept package reads the stand-alone
controller, nor the stream of the RS-485 transducer.
"""

import contextlib
import os
import socket

import numpy as np
import pytest

from drivers.clock import RealClock
from simulators.bench import FT32831, Bench, BenchSettings
from simulators.digital_ft_box import DigitalFtBox
from simulators.net_ft_box import NetFtBox

OFFSET = (1.0, -2.0, 3.5, 40.0, -50.0, 60.0)  # N, N mm
STILL = BenchSettings(noise_force=0.0, noise_torque=0.0, drift_force=0.0, drift_torque=0.0, offset=OFFSET)


def test_the_netft_package_reads_the_simulated_wrench_from_the_networked_box():
    module = pytest.importorskip("NetFT")
    box = NetFtBox(Bench(3, STILL), RealClock())
    box.start()
    try:
        sensor = module.Sensor("127.0.0.1")
        sensor.sock.connect(("127.0.0.1", int(box.uri.split("rdt=")[1].split("&")[0])))
        sensor.sock.settimeout(2.0)
        counts = np.array(sensor.getMeasurement())
        sensor.sock.close()
    finally:
        box.close()
    # A million counts in one N and in one N m, as its web page states.
    np.testing.assert_allclose(counts / np.repeat([1e6, 1e3], 3), OFFSET, atol=1e-3)


@pytest.mark.skipif(os.name != "posix", reason="there are no pseudo-terminals on this system")
def test_pymodbus_reads_the_stored_calibration_from_the_digital_transducer():
    client_module = pytest.importorskip("pymodbus.client")
    box = DigitalFtBox(Bench(3, STILL), RealClock())
    box.start()
    try:
        path = box.uri.removeprefix("digital-ft://").split("?")[0]
        client = client_module.ModbusSerialClient(path, baudrate=115200, parity="N", timeout=2.0)
        assert client.connect()
        words = [
            word
            for first in range(0xE3, 0xE3 + 133, 19)
            for word in client.read_holding_registers(first, count=19, device_id=10).registers
        ]
        write_reply = client.write_registers(0, [1, 2, 3], device_id=10)
        client.close()
    finally:
        box.close()
    memory = b"".join(word.to_bytes(2, "big") for word in words)
    assert memory[:8].rstrip(b"\0") == b"SIM00003"
    matrix = np.frombuffer(memory, ">f4", 36, 64).reshape(6, 6)
    force_counts, torque_counts = np.frombuffer(memory, ">i4", 2, 64 + 144 + 2 + 24).tolist()
    # The box's gauges give 3000 counts a volt; a million of what the matrix gives are one N or one N m.
    newton_matrix = matrix * 3000.0 / np.repeat([force_counts, torque_counts / 1000.0], 3)[:, None]
    np.testing.assert_allclose(newton_matrix, FT32831, rtol=1e-5, atol=1e-6)
    assert write_reply.isError(), "nothing is written while it is locked"


def test_a_second_client_takes_the_stream_of_the_networked_box():
    box = NetFtBox(Bench(3, STILL), RealClock())
    box.start()
    try:
        port = int(box.uri.split("rdt=")[1].split("&")[0])
        first, second = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
        for client in (first, second):
            client.settimeout(1.0)
            client.sendto(bytes.fromhex("1234 0002 0000 0000"), ("127.0.0.1", port))
            assert len(client.recv(100)) == 36
        first.settimeout(0.1)
        in_flight = 0
        with contextlib.suppress(TimeoutError):
            while in_flight < 100 and first.recv(100):
                in_flight += 1
        assert in_flight < 100
        assert len(second.recv(100)) == 36
        first.close()
        second.close()
    finally:
        box.close()
