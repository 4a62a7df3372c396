"""Finding the data-acquisition device a nidaq address names."""

import importlib
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from drivers.address import Address, AddressError, check_options
from drivers.calibration_file import read_calibration_file
from drivers.clock import Clock
from drivers.nidaq.device import TaskConversation, TaskLink
from drivers.streaming import StreamingTransducer
from drivers.transducer import SetupError, TransducerInfo

_OPTIONS = frozenset({"cal", "rate"})
_DEFAULT_RATE = 1000  # [Hz]


def library() -> Any:  # noqa: ANN401 - it is not always there
    """Return NI's library. Raises SetupError with what to install."""
    try:
        importlib.import_module("nidaqmx.constants")
        importlib.import_module("nidaqmx.system")
        return importlib.import_module("nidaqmx")
    except ImportError:
        raise SetupError(
            "nidaq:// needs NI's library: pip install 'daq-app[nidaq]', and the NI-DAQmx driver from NI"
        ) from None


def open_nidaq(address: Address, clock: Clock) -> StreamingTransducer:
    """Return the transducer at `address`, not streaming. Raises SetupError with the reason."""
    api = library()
    device, info = _found(api, address)
    rate = address.number("rate", _DEFAULT_RATE, 1, 100_000)
    link = TaskLink(api, device, rate)
    link.close()
    return StreamingTransducer(
        replace(info, rate=link.rate, counter_rate=link.rate),
        partial(TaskLink, api, device, rate),
        TaskConversation(),
        clock,
    )


def identify_nidaq(address: Address, _patience: float) -> TransducerInfo:
    """Return who is there; nothing is acquired. Raises SetupError with the reason."""
    return _found(library(), address)[1]


def _found(api: Any, address: Address) -> tuple[str, TransducerInfo]:  # noqa: ANN401
    """Return the device's name as NI-DAQmx spells it, and who the transducer on it is."""
    check_options(address, _OPTIONS)
    file = address.options.get("cal")
    if not address.host or file is None:
        raise AddressError(f"{address.uri}: write nidaq://Dev1?cal=FILE, with the transducer's own .cal file")
    calibration = read_calibration_file(Path(file))
    try:
        devices = {device.name.lower(): device for device in api.system.System.local().devices}
    except Exception as error:  # noqa: BLE001 - without NI's driver the library raises errors of several kinds
        raise SetupError(f"{address.uri}: NI-DAQmx does not answer ({error}); install its driver from NI") from None
    device = devices.get(address.host.lower())
    if device is None:
        known = ", ".join(sorted(device.name for device in devices.values())) or "none"
        raise SetupError(f"{address.uri}: there is no device {address.host}; NI-DAQmx knows {known}")
    simulated = bool(device.is_simulated)
    info = TransducerInfo(
        uri=address.uri,
        driver="nidaq",
        model=f"{calibration.body} {calibration.part_number} on NI {device.product_type}",
        serial=calibration.calibration.serial,
        simulated=simulated or "SIMULATED" in calibration.part_number.upper(),
        rate=float("nan"),
        counter_rate=float("nan"),
        calibration=calibration.calibration,
        settings={
            "converter": f"{device.product_type}, serial number {device.serial_num:X}",
            "calibration": f"{calibration.calibration.source}, SHA-256 {calibration.sha256}",
            "gauges": "six differential pairs from ai0 on, +-10 V",
            "bias": "none in the device",
            "filter": "none",
            "time": "the device's own clock; gauges of one reading may be converted one after the other",
        },
    )
    return str(device.name), info
