import os
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
import serial

from drivers import digital_ft, serial_link
from drivers.address import parse_address
from drivers.clock import RealClock
from drivers.deadline import Deadline
from drivers.digital_ft import open_digital_ft, wire
from drivers.serial_ft import open_serial_ft
from drivers.serial_link import SerialLink, port_of
from drivers.transducer import LinkLost, SetupError
from simulators.simulator import ROOM, PseudoTerminal

needs_terminals = pytest.mark.skipif(os.name != "posix", reason="there are no pseudo-terminals on this system")


@pytest.fixture
def terminal():
    pseudo_terminal = PseudoTerminal("ttyTest")
    yield pseudo_terminal
    pseudo_terminal.close()


@pytest.fixture
def port_calls(monkeypatch):
    """Let every port opened be one that keeps how it was set and never answers."""
    calls = []

    class Port:
        is_open = True
        in_waiting = 0

        def __init__(self, *arguments, **settings):
            calls.append((arguments, settings))

        def fileno(self):
            return nowhere.fileno()

        def write(self, data):
            return len(data)

        def read(self, size):
            time.sleep(0.01)  # a silent port keeps its reader waiting
            return b""[:size]

        def close(self):
            self.is_open = False

    monkeypatch.setattr(serial_link.serial, "Serial", Port)
    with Path(os.devnull).open("wb") as nowhere:
        yield calls


def test_the_rs485_transducer_is_opened_with_its_own_line_settings(port_calls):
    with pytest.raises(LinkLost, match="does not answer"):
        open_digital_ft(parse_address("digital-ft:///dev/ttyUSB7"), RealClock(), Deadline.for_opening())
    ((port, baud), settings) = port_calls[0]
    assert (port, baud) == ("/dev/ttyUSB7", 1_250_000)
    assert settings["parity"] == serial.PARITY_EVEN
    assert settings["bytesize"] == serial.EIGHTBITS
    assert settings["stopbits"] == serial.STOPBITS_ONE
    assert settings["exclusive"]
    assert not settings["xonxoff"]


def test_the_controller_is_opened_without_parity_at_each_rate_it_might_have(port_calls):
    with pytest.raises(LinkLost, match="no controller answers"):
        open_serial_ft(
            parse_address("serial-ft:///dev/ttyUSB0?counts_per_N=20&counts_per_Nm=333.33"),
            RealClock(),
            Deadline.for_opening(),
        )
    assert [arguments[1] for arguments, _ in port_calls][:3] == [38400, 9600, 115200]
    assert {settings["parity"] for _, settings in port_calls} == {serial.PARITY_NONE}


@needs_terminals
def test_a_computer_busy_while_it_sends_has_sent_all_the_same(terminal, monkeypatch):
    import serial.serialposix

    def write_late(*arguments):
        time.sleep(1.5 * serial_link._WRITE_PATIENCE)
        return os.write(*arguments)

    link = SerialLink(terminal.path, 38400)
    monkeypatch.setattr(serial.serialposix, "os", SimpleNamespace(**{**vars(os), "write": write_late}))
    link.send(b"asked")
    monkeypatch.undo()
    assert terminal.receive(1.0) == b"asked"
    link.close()


def test_an_answer_that_waited_for_a_busy_computer_is_heard():
    class Busy:
        def __init__(self):
            self.comes = [None, None, wire.request(0x46, b"\x01")]  # nothing left over; none in time; there after all

        def send(self, data):
            pass

        def receive(self, timeout):
            if timeout > 0.0:
                time.sleep(timeout + 0.01)
            return self.comes.pop(0)

    assert digital_ft._response(Busy(), b"", wire.request(0x46, b"\x01")) == wire.request(0x46, b"\x01")


@needs_terminals
def test_every_byte_goes_through_unchanged_both_ways(terminal):
    link = SerialLink(terminal.path, 38400)
    all_bytes = bytes(range(256))
    link.send(all_bytes)
    terminal_bytes = b""
    while len(terminal_bytes) < 256:
        terminal_bytes += terminal.receive(1.0)
    terminal.send(all_bytes)
    link_bytes = b""
    while len(link_bytes) < 256:
        link_bytes += link.receive(1.0) or b""
    link.close()
    assert terminal_bytes == link_bytes == all_bytes


@needs_terminals
def test_nothing_received_is_none_and_a_port_pulled_out_is_lost(terminal):
    link = SerialLink(terminal.path, 38400)
    assert link.receive(0.0) is None
    assert link.receive(0.01) is None
    terminal.unplug()
    with pytest.raises(LinkLost, match="is gone"):
        link.receive(0.01)
    with pytest.raises(LinkLost, match="takes no bytes"):
        link.send(b"x")
    link.close()
    link.close()


@needs_terminals
def test_a_port_is_had_by_one_at_a_time(terminal):
    link = SerialLink(terminal.path, 38400)
    with pytest.raises(SetupError, match="another program has it"):
        SerialLink(terminal.path, 38400)
    link.close()
    SerialLink(terminal.path, 38400).close()


def test_a_port_that_cannot_be_opened_is_named_with_the_reason(tmp_path, monkeypatch):
    path = str(tmp_path / "ttyNone")
    with pytest.raises(SetupError, match="no such port") as refusal:
        SerialLink(path, 9600)
    assert str(refusal.value).startswith(path)
    text_file = tmp_path / "plain.txt"
    text_file.write_bytes(b"")
    with pytest.raises(SetupError, match="no serial port"):
        SerialLink(str(text_file), 9600)

    def deny(*_, **__):
        raise serial.SerialException(13, "could not open port: Permission denied")

    monkeypatch.setattr(serial_link.serial, "Serial", deny)
    with pytest.raises(SetupError, match="you may not use it"):
        SerialLink("/dev/ttyS0", 9600)


def test_an_address_without_a_port_is_refused():
    with pytest.raises(SetupError, match="names no port"):
        port_of(parse_address("serial-ft://?baud=9600"))


def test_a_port_that_vanishes_while_its_waiting_time_is_set_is_lost(port_calls, monkeypatch):
    link = SerialLink("/dev/ttyUSB7", 1_250_000)

    def refuse(*_):
        raise ValueError("Failed to set custom baud rate (1250000): [Errno 5] Input/output error")

    monkeypatch.setattr(serial_link.serial.Serial, "timeout", property(fset=refuse), raising=False)
    with pytest.raises(LinkLost, match="/dev/ttyUSB7 is gone"):
        link.receive(0.1)
    assert len(port_calls) == 1


@needs_terminals
def test_what_a_simulated_device_sent_before_its_port_was_opened_is_lost_as_on_a_real_one(terminal):
    terminal.send(bytes(ROOM))  # more than the system holds
    link = SerialLink(terminal.path, 38400)
    terminal.send(b"new")
    data = b""
    while not data.endswith(b"new"):
        terminal.receive(0.01)
        data += link.receive(0.1) or b""
    assert data == b"new"
    link.close()
