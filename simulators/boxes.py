"""The other end of every driver: the list of simulated devices, by the name of the driver that reads them.

A test that is run on every driver takes them from here. The list reads itself from the modules of this package.
"""

import pkgutil
from collections.abc import Mapping
from importlib import import_module

import simulators
from simulators.simulator import Simulator

_MODULES = [import_module(f"simulators.{module.name}") for module in pkgutil.iter_modules(simulators.__path__)]
SIMULATORS: Mapping[str, Simulator] = {
    module.SIMULATOR.name: module.SIMULATOR for module in _MODULES if hasattr(module, "SIMULATOR")
}
