"""From the predicted SED to the firing of an SA-II afferent: an illustration with declared parameters, no finding.

No fitted map from SED to the rate of a human SA-II afferent was found in the literature. This one is the simplest that
has what such units show: firing at rest, a static and a dynamic part, slow adaptation, regular intervals. Its order of
surfaces in the settled state is that of the SED, as long as none lies at a bound: what it adds is the course in time.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sessions.prediction import SessionPrediction
from sessions.prediction.sed_interval import Ends

Array = NDArray[np.float64]

STEP = 1e-3  # [s]
ABOUT = "an illustration with assumed numbers: no fitted map from SED to the rate of an SA-II afferent is known"
SHOWN = 10  # every so many steps the rate is told


@dataclass(frozen=True, slots=True)
class AfferentSettings:
    """Rate r = background + static x + dynamic max(0, dx/dt) - adaptation a, in 0 to the greatest rate.

    Drive x = (max(0, SED - threshold) / (reference - threshold))^exponent; a follows x with the time constant:
    da/dt = (x - a) / adaptation_time.
    """

    threshold: float = 4e-6
    exponent: float = 1.0
    background: float = 5.0
    static_gain: float = 20.0
    dynamic_gain: float = 4.0
    adaptation_gain: float = 6.0
    adaptation_time: float = 1.5
    greatest_rate: float = 100.0
    variation: float = 0.2
    refractory: float = 2e-3
    seed: int = 0


# Unit, standing, and what it rests on. "assumed": no authority is claimed for the number.
TOLD: Mapping[str, tuple[str, str, str]] = {
    "threshold": (
        "MPa",
        "assumed",
        "SED of 1 % strain in the published dermis, E e^2 / 2 with E = 0.08 MPa; that units fire from below 1 %: "
        "Edin 2004, J. Neurophysiol. 92:3233",
    ),
    "exponent": ("-", "assumed", "1: rate follows SED, the hypothesis under test; 0.5: rate follows strain"),
    "background": ("imp/s", "assumed", "that SA-2s fire at rest: Saal, Birznieks & Johansson 2023, eLife 89616"),
    "static_gain": ("imp/s", "assumed", "at the reference SED; sweep 5 to 40"),
    "dynamic_gain": (
        "imp/s per 1/s",
        "assumed",
        "that rate grows with strain rate: Edin 2004, J. Neurophysiol. 92:3233; sweep 0 to 15",
    ),
    "adaptation_gain": ("imp/s", "assumed", "below the static gain: these units never fall silent; sweep 0 to 15"),
    "adaptation_time": ("s", "assumed", "sweep 0.3 to 5"),
    "greatest_rate": ("imp/s", "assumed", "peaks of 50 to 95 imp/s: Edin 2004, J. Neurophysiol. 92:3233"),
    "variation": ("-", "assumed", "coefficient of variation of intervals; sweep 0.1 to 0.4"),
    "refractory": ("s", "assumed", "sweep 1 to 5 ms"),
    "seed": ("-", "set", "of the spike times"),
}


@dataclass(frozen=True, slots=True, eq=False)
class Firing:
    """What the afferent does in one trial."""

    trial: int | None
    time: Array  # (m,) [s]
    rate: Array  # (m,) [imp/s]
    settled_rate: float  # long after: background + (static - adaptation) x, within its bounds [imp/s]
    spikes: Array  # (k,) [s]
    peak_interval: Ends | None = None  # of the greatest rate, that the interval of the SED makes; None without that
    settled_interval: Ends | None = None  # likewise of the settled rate [imp/s]

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain data, the rate every 10 ms."""
        return {
            "trial": self.trial,
            "settled_rate": self.settled_rate,
            "settled_rate_interval": self.settled_interval,
            "peak_rate": float(self.rate.max()),
            "peak_rate_interval": self.peak_interval,
            "time": self.time[::SHOWN].tolist(),
            "rate": self.rate[::SHOWN].tolist(),
            "spikes": self.spikes.tolist(),
        }


def firing_rate(time: Array, sed: Array, reference: float, settings: AfferentSettings) -> tuple[Array, Array]:
    """Return instants (k,) [s] every millisecond and the rate (k,) [imp/s] there, from SED (m,) [MPa] at `time` (m,).

    SED goes straight between its instants; before the first nothing is adapted. `reference` [MPa] is where x is 1.
    """
    grid = np.arange(float(time[0]), float(time[-1]) + STEP / 2, STEP)
    x = _drive(np.interp(grid, time, sed), reference, settings)
    rise = np.diff(x, prepend=x[0]) / STEP
    kept = float(np.exp(-STEP / settings.adaptation_time))
    adapted = np.zeros_like(x)
    for i in range(1, len(x)):
        adapted[i] = kept * adapted[i - 1] + (1.0 - kept) * (x[i] + x[i - 1]) / 2.0
    rate = settings.background + settings.static_gain * x + settings.dynamic_gain * np.maximum(rise, 0.0)
    return grid, np.clip(rate - settings.adaptation_gain * adapted, 0.0, settings.greatest_rate)


def _drive(sed: Array, reference: float, settings: AfferentSettings) -> Array:
    """Return the drive (n,) [-] of SED (n,) [MPa]: 0 up to the threshold, 1 at the reference."""
    beyond = max(reference - settings.threshold, np.finfo(np.float64).tiny)
    return (np.maximum(sed - settings.threshold, 0.0) / beyond) ** settings.exponent


def spike_times(time: Array, rate: Array, draw: np.random.Generator, settings: AfferentSettings) -> Array:
    """Return when a perfect integrator of the rate passes thresholds drawn from a gamma distribution of mean 1 [s].

    Its shape is 1 / variation^2, so that a steady rate gives intervals of that coefficient of variation.
    """
    passed = np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2.0 * np.diff(time))])
    shape = settings.variation**-2
    thresholds = np.cumsum(draw.gamma(shape, 1.0 / shape, size=int(2 * passed[-1]) + 20))
    found = np.interp(thresholds[thresholds < passed[-1]], passed, time)
    kept: list[float] = []
    for spike in found.tolist():
        if not kept or spike - kept[-1] >= settings.refractory:
            kept.append(spike)
    return np.array(kept)


def session_firing(
    prediction: SessionPrediction, settings: AfferentSettings | None = None
) -> tuple[float | None, tuple[Firing, ...]]:
    """Return the reference SED [MPa], the median of all trials, and the firing in each trial that has a course."""
    chosen = settings or AfferentSettings()
    seds = [row.sed for row in prediction.trials if row.sed is not None]
    if not seds:
        return None, ()
    reference = float(np.median(seds))
    found: list[Firing] = []
    for number, row in enumerate(prediction.trials):
        if row.history is None or row.sed is None:
            continue
        time, rate = firing_rate(row.history.time, row.history.sed_ending, reference, chosen)
        spikes = spike_times(time, rate, np.random.default_rng([chosen.seed, number]), chosen)
        peak = settled = None
        if row.interval is not None and row.interval.low is not None and row.interval.high is not None:
            # The whole course moves with its end: friction is what is uncertain, and presses nothing.
            low, high = row.interval.low / row.sed, row.interval.high / row.sed
            course = row.history.sed_ending
            peaks = [firing_rate(row.history.time, share * course, reference, chosen)[1] for share in (low, high)]
            peak = float(peaks[0].max()), float(peaks[1].max())
            settled = (
                _settled_rate(row.interval.low, reference, chosen),
                _settled_rate(row.interval.high, reference, chosen),
            )
        found.append(Firing(row.trial, time, rate, _settled_rate(row.sed, reference, chosen), spikes, peak, settled))
    return reference, tuple(found)


def _settled_rate(sed: float, reference: float, settings: AfferentSettings) -> float:
    x = float(_drive(np.array(sed), reference, settings))
    settled = settings.background + (settings.static_gain - settings.adaptation_gain) * x
    return float(np.clip(settled, 0.0, settings.greatest_rate))


def firing_document(prediction: SessionPrediction, settings: AfferentSettings) -> dict[str, Any]:
    """Return the firing in each trial as plain data, with what it is and every parameter."""
    reference, found = session_firing(prediction, settings)
    return {
        "about": ABOUT,
        "reference_sed": reference,
        "settings": asdict(settings),
        "parameters": parameters(settings, reference),
        "trials": [one.to_dict() for one in found],
    }


def parameters(settings: AfferentSettings, reference: float | None = None) -> list[dict[str, Any]]:
    """Return every parameter with its value, unit, standing ("assumed", or "set" by somebody) and what it rests on.

    `reference` [MPa] is told with them where it is given.
    """
    told: list[dict[str, Any]] = []
    if reference is not None:
        basis = "where x is 1: the median SED of the trials; another reference scales every gain"
        told.append({"name": "reference", "value": reference, "unit": "MPa", "standing": "assumed", "basis": basis})
    for one in fields(settings):
        value: float = getattr(settings, one.name)
        unit, standing, basis = TOLD[one.name]
        chosen = standing if value == one.default else "set"
        told.append({"name": one.name, "value": value, "unit": unit, "standing": chosen, "basis": basis})
    return told


def settings_with(changes: Mapping[str, float], seed: int = 0) -> AfferentSettings:
    """Return settings with some parameters set by somebody.

    Raises ValueError, with a sentence, for a name that is none and a value that means nothing.

    >>> settings_with({"static_gain": 30.0}).static_gain
    30.0
    """
    names = [one.name for one in fields(AfferentSettings) if one.name != "seed"]
    for name, value in changes.items():
        if name not in names:
            raise ValueError(f"{name} is no parameter of the afferent: give one of {', '.join(names)}")
        least = 1e-6 if name in ("exponent", "adaptation_time", "greatest_rate", "variation") else 0.0
        most = 1.0 if name == "variation" else 1e4
        if not least <= value <= most:
            raise ValueError(f"{name} = {value:g} is not allowed: {least:g} to {most:g}")
    return replace(AfferentSettings(seed=seed), **changes)
