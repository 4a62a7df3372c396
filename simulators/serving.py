"""The list of simulated devices, one for each driver, how one is served, and its timetable.

The list is read from the modules of this package. Tests of all drivers use it.
"""

import itertools
import pkgutil
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Annotated

import msgspec

import simulators
from drivers.arrays import Array
from drivers.clock import clock_at
from simulators.bench import Bench
from simulators.faults import Fault, Faults, Time
from simulators.simulator import RunningSimulator, Simulator
from simulators.stroke import CONTACT_AREA, Surface, paper_surfaces
from simulators.subject import SimulatedSubject

APART = 5.0  # least time between the starts of strokes; no stroke lasts longer [s]

_Positive = Annotated[float, msgspec.Meta(gt=0.0, le=1e6)]


class TimetableError(ValueError):
    """A timetable file that cannot be carried out."""


@dataclass(frozen=True, slots=True)
class Timetable:
    """Strokes, in order of time, and faults; restarted every `repeat` seconds if above 0."""

    strokes: tuple[tuple[float, Surface], ...]  # beginning [s] and surface of each
    faults: tuple[Fault, ...] = ()
    repeat: float = 0.0  # [s]

    def __post_init__(self) -> None:
        times = [time for time, _ in self.strokes]
        if self.repeat > 0.0 and times:
            times.append(times[0] + self.repeat)
        for first, second in itertools.pairwise(times):
            if second - first < APART:
                raise TimetableError(f"the strokes at {first:g} s and {second:g} s are less than {APART:g} s apart")
        if self.repeat > 0.0 and any(fault.stop > self.repeat for fault in self.faults):
            raise TimetableError(f"a fault ends after repeat = {self.repeat:g} s, when the timetable begins anew")


class ScriptedBench(Bench):
    """A bench stroked by one subject according to a timetable."""

    def __init__(self, seed: int, timetable: Timetable) -> None:
        """Begin the timetable at the bench's time 0. The seed sets the noise and the subject."""
        super().__init__(seed)
        self._timetable = timetable
        self._subject = SimulatedSubject(seed)
        self._stroke_count = 0  # so far

    def wrench(self, times: Array) -> Array:
        """Return the measured wrench (n, 6) at `times` (n,) [s], after beginning the strokes due by then."""
        strokes = self._timetable.strokes
        while len(times) and strokes:
            cycle, position = divmod(self._stroke_count, len(strokes))
            time, surface = strokes[position]
            time += cycle * self._timetable.repeat
            if time > times[-1] or (cycle > 0 and self._timetable.repeat == 0.0):
                break
            self._stroke_count += 1
            if time + APART < times[0]:  # its time has passed without a reading
                continue
            self.mount(surface)
            self.begin_stroke(self._subject.stroke(surface, repetition=cycle + 1), time)
        return super().wrench(times)


def usual_timetable() -> Timetable:
    """Return the default timetable: the paper's ten surfaces, one every six seconds, repeatedly."""
    surfaces = paper_surfaces().values()
    return Timetable(tuple((6.0 * i, surface) for i, surface in enumerate(surfaces)), repeat=6.0 * len(surfaces))


class _StrokeEntry(msgspec.Struct, forbid_unknown_fields=True):
    """One [[stroke]]: a surface of the paper by descriptor and index, or any other by mu and the rest."""

    at: Time
    descriptor: str | None = None
    index: int | None = None
    mu: _Positive | None = None
    peak_normal_force: _Positive = 3.0
    speed: _Positive = 20.0
    direction: int = 1
    holds: bool = True


class Script(msgspec.Struct, forbid_unknown_fields=True):
    """A whole timetable file."""

    stroke: list[_StrokeEntry] = []  # msgspec copies an empty default for each instance
    fault: list[Fault] = []
    repeat: Time = 0.0


def timetable_in(script: Script) -> Timetable:
    """Return the timetable that a script describes. Raises TimetableError."""
    strokes = sorted(((entry.at, _surface(entry)) for entry in script.stroke), key=lambda stroke: stroke[0])
    return Timetable(tuple(strokes), tuple(script.fault), script.repeat)


def _surface(entry: _StrokeEntry) -> Surface:
    if entry.mu is not None:
        if entry.descriptor is not None or entry.index is not None:
            raise TimetableError(f"the stroke at {entry.at:g} s gives mu as well as descriptor and index; give either")
        tau_max = entry.mu * entry.peak_normal_force / CONTACT_AREA
        return Surface(entry.mu, "scripted", 0, tau_max, entry.speed, entry.direction, entry.holds)
    surface = paper_surfaces().get((entry.descriptor or "", -1 if entry.index is None else entry.index))
    if surface is None:
        surfaces = ", ".join(f"{descriptor} {index}" for descriptor, index in paper_surfaces())
        raise TimetableError(f"the stroke at {entry.at:g} s needs mu, or a descriptor and an index out of {surfaces}")
    return surface


_MODULES = [import_module(f"simulators.{module.name}") for module in pkgutil.iter_modules(simulators.__path__)]
SIMULATORS: Mapping[str, Simulator] = {
    module.SIMULATOR.name: module.SIMULATOR for module in _MODULES if hasattr(module, "SIMULATOR")
}


WIRES = tuple(name for name, simulator in SIMULATORS.items() if simulator.on_ports)


def serve(
    name: str, *, seed: int = 0, factor: float = 1.0, timetable: Timetable | None = None, **settings: object
) -> RunningSimulator:
    """Return a device of `WIRES` served on this computer until it is closed, stroked according to a timetable.

    `settings` are those of the device. Time runs at `factor` times real time. Raises SetupError when a port is in use.
    """
    timetable = timetable or usual_timetable()
    faults = Faults(timetable.faults, seed=seed, repeat=timetable.repeat)
    return SIMULATORS[name].start(ScriptedBench(seed, timetable), clock_at(factor), faults, Path(), **settings)
