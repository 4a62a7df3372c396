"""From a quantity at the receptor to the firing of an SA-II afferent: an illustration with stated parameters.

The literature has no fitted map from the SED, or any other quantity, to the rate of a human SA-II afferent. This map is
the simplest with the properties of such units: resting discharge, a static and a dynamic part, slow adaptation, regular
intervals. In the settled state it orders surfaces by the size of the quantity, unless a rate is at a bound; what it
adds is the time course.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Annotated, Any, cast

import numpy as np

from drivers.arrays import Array
from sessions.prediction.options import BY_NAME
from sessions.prediction.stored import Ends, SessionPrediction
from sessions.strokes.stroke import Meaning, meanings
from solver.quantities import NAMES, QUANTITIES, SED

_STEP = 1e-3  # [s]
ABOUT = "an illustration with assumed numbers: no fitted map from {label} to the rate of an SA-II afferent is known"
_THINNING = 10  # steps of the integration for one stored rate


_EDIN_2004 = "Edin 2004, J. Neurophysiol. 92:3233"
_SAAL_2023 = "Saal, Birznieks & Johansson 2023, eLife 89616"
# Threshold of each family of quantities, in its unit: the value at 1 % strain in the published dermis, E = 0.08 MPa.
_ENERGY = 4e-6, "SED of 1 % strain in the published dermis, E e^2 / 2 with E = 0.08 MPa"
_STRAIN = 0.01, "1 % strain"
_STRESS = 8e-4, "stress of 1 % strain in the published dermis, E e with E = 0.08 MPa"
_THRESHOLDS = {
    quantity.name: _ENERGY if quantity.name.startswith("sed") else _STRAIN if quantity.unit == "-" else _STRESS
    for quantity in QUANTITIES
}


@dataclass(frozen=True, slots=True)
class AfferentSettings:
    """Rate r = background + static x + dynamic max(0, dx/dt) - adaptation a, in 0 to the greatest rate.

    Drive x = (max(0, |q| - threshold) / (reference - threshold))^exponent, q being the quantity at the ending; a
    follows x with the time constant: da/dt = (x - a) / adaptation_time.
    """

    # Each has its unit ("": the quantity's) and its basis; the numbers claim no authority.
    quantity: str = SED.name
    threshold: Annotated[float, Meaning("", f"that units fire from below 1 %: {_EDIN_2004}")] = _ENERGY[0]
    exponent: Annotated[
        float, Meaning("-", "1: rate follows the quantity; 0.5 with an energy: rate follows strain")
    ] = 1.0
    background: Annotated[float, Meaning("imp/s", f"that SA-2s fire at rest: {_SAAL_2023}")] = 5.0
    static_gain: Annotated[float, Meaning("imp/s", "at the reference; sweep 5 to 40")] = 20.0
    dynamic_gain: Annotated[
        float, Meaning("imp/s per 1/s", f"that rate grows with strain rate: {_EDIN_2004}; sweep 0 to 15")
    ] = 4.0
    adaptation_gain: Annotated[
        float, Meaning("imp/s", "below the static gain: these units never fall silent; sweep 0 to 15")
    ] = 6.0
    adaptation_time: Annotated[float, Meaning("s", "sweep 0.3 to 5")] = 1.5
    greatest_rate: Annotated[float, Meaning("imp/s", f"peaks of 50 to 95 imp/s: {_EDIN_2004}")] = 100.0
    variation: Annotated[float, Meaning("-", "coefficient of variation of intervals; sweep 0.1 to 0.4")] = 0.2
    refractory: Annotated[float, Meaning("s", "sweep 1 to 5 ms")] = 2e-3
    seed: Annotated[int, Meaning("-", "of the spike times")] = 0


PARAMETERS = meanings(AfferentSettings)


@dataclass(frozen=True, slots=True, eq=False)
class Firing:
    """Firing of the afferent in one trial."""

    trial: int | None
    time: Array  # (m,) [s]
    rate: Array  # (m,) [imp/s]
    settled_rate: float  # at long times: background + (static - adaptation) x, within its bounds [imp/s]
    spikes: Array  # (k,) [s]
    peak_interval: Ends | None = None  # of the greatest rate, from the SED's interval; None without it
    settled_interval: Ends | None = None  # of the settled rate [imp/s]

    def to_dict(self) -> dict[str, Any]:
        """Return the firing as plain data, with the rate every 10 ms."""
        return {
            "trial": self.trial,
            "settled_rate": self.settled_rate,
            "settled_rate_interval": self.settled_interval,
            "peak_rate": float(self.rate.max()),
            "peak_rate_interval": self.peak_interval,
            "time": self.time[::_THINNING].tolist(),
            "rate": self.rate[::_THINNING].tolist(),
            "spikes": self.spikes.tolist(),
        }


def firing_rate(time: Array, size: Array, reference: float, settings: AfferentSettings) -> tuple[Array, Array]:
    """Return instants (k,) [s] every millisecond and the rates (k,) [imp/s], from sizes (m,) at `time` (m,).

    The size is interpolated linearly; there is no adaptation before the first instant. At `reference` x is 1.
    """
    grid = np.arange(float(time[0]), float(time[-1]) + _STEP / 2, _STEP)
    x = _drive(np.interp(grid, time, size), reference, settings)
    rise = np.diff(x, prepend=x[0]) / _STEP
    decay = float(np.exp(-_STEP / settings.adaptation_time))
    adaptation = np.zeros_like(x)
    for i in range(1, len(x)):
        adaptation[i] = decay * adaptation[i - 1] + (1.0 - decay) * (x[i] + x[i - 1]) / 2.0
    rate = settings.background + settings.static_gain * x + settings.dynamic_gain * np.maximum(rise, 0.0)
    return grid, np.clip(rate - settings.adaptation_gain * adaptation, 0.0, settings.greatest_rate)


def _drive(size: Array, reference: float, settings: AfferentSettings) -> Array:
    """Return the drive (n,) [-] of sizes (n,): 0 up to the threshold, 1 at the reference."""
    beyond = max(reference - settings.threshold, np.finfo(np.float64).tiny)
    return (np.maximum(size - settings.threshold, 0.0) / beyond) ** settings.exponent


def spike_times(time: Array, rate: Array, draw: np.random.Generator, settings: AfferentSettings) -> Array:
    """Return spike times [s] of a perfect integrator of the rate with thresholds from a gamma distribution of mean 1.

    Its shape is 1 / variation^2, so that a steady rate gives intervals of that coefficient of variation.
    """
    integral = np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2.0 * np.diff(time))])
    shape = settings.variation**-2
    thresholds = np.cumsum(draw.gamma(shape, 1.0 / shape, size=int(2 * integral[-1]) + 20))
    spikes = np.interp(thresholds[thresholds < integral[-1]], integral, time)
    times: list[float] = []
    for spike in spikes.tolist():
        if not times or spike - times[-1] >= settings.refractory:
            times.append(spike)
    return np.array(times)


def session_firing(
    prediction: SessionPrediction, settings: AfferentSettings | None = None
) -> tuple[float | None, tuple[Firing, ...]]:
    """Return the reference, the median size over all trials, and the firing in each trial with a known time course.

    Where tissues relax, only the SED has a time course: other quantities give no firing.
    """
    settings = settings or AfferentSettings()
    settled = [row.responses.get(settings.quantity) for row in prediction.trials]
    sizes = [abs(response.value) for response in settled if response is not None]
    if not sizes:
        return None, ()
    reference = float(np.median(sizes))
    firings: list[Firing] = []
    for number, (row, response) in enumerate(zip(prediction.trials, settled, strict=True)):
        if row.history is None or response is None:
            continue
        value = response.value
        course = np.abs(row.history.responses[:, NAMES.index(settings.quantity)])
        if not np.isfinite(course).all():
            continue
        time, rate = firing_rate(row.history.time, course, reference, settings)
        spikes = spike_times(time, rate, np.random.default_rng([settings.seed, number]), settings)
        peak = settled_ends = None
        friction = row.interval if settings.quantity == SED.name else None  # only the SED has an interval
        if friction is not None and friction.low is not None and friction.high is not None:
            bounds = friction.low, friction.high
            # The whole course scales with its end: only friction is uncertain, not the press.
            peaks = [firing_rate(row.history.time, bound / value * course, reference, settings)[1] for bound in bounds]
            peak = float(peaks[0].max()), float(peaks[1].max())
            settled_ends = _settled_rate(bounds[0], reference, settings), _settled_rate(bounds[1], reference, settings)
        level = _settled_rate(value, reference, settings)
        firings.append(Firing(row.trial, time, rate, level, spikes, peak, settled_ends))
    return reference, tuple(firings)


def _settled_rate(value: float, reference: float, settings: AfferentSettings) -> float:
    x = float(_drive(np.array(abs(value)), reference, settings))
    rate = settings.background + (settings.static_gain - settings.adaptation_gain) * x
    return float(np.clip(rate, 0.0, settings.greatest_rate))


def firing_document(prediction: SessionPrediction, settings: AfferentSettings) -> dict[str, Any]:
    """Return the firing in each trial as plain data, with a caveat and every parameter."""
    reference, firings = session_firing(prediction, settings)
    return {
        "about": ABOUT.format(label=BY_NAME[settings.quantity].label),
        "quantity": settings.quantity,
        "reference": reference,
        "reference_sed": reference if settings.quantity == SED.name else None,  # its former name, for one release
        "settings": asdict(settings),
        "parameters": parameters(settings, reference),
        "trials": [firing.to_dict() for firing in firings],
    }


def parameters(settings: AfferentSettings, reference: float | None = None) -> list[dict[str, Any]]:
    """Return every parameter with its value, unit, standing ("assumed", or "set" by somebody) and basis.

    `reference`, if given, is included, in the unit of the quantity.
    """
    rows: list[dict[str, Any]] = []
    quantity, usual = BY_NAME[settings.quantity], usual_settings(settings.quantity)
    if reference is not None:
        basis = f"where x is 1: the median {quantity.label} of the trials; another reference scales every gain"
        row = {"name": "reference", "value": reference, "unit": quantity.unit}
        rows.append({**row, "standing": "assumed", "basis": basis})
    for name, (unit, basis) in PARAMETERS.items():
        value: float = getattr(settings, name)
        origin = "assumed" if value == getattr(usual, name) and name != "seed" else "set"
        sources = f"{_THRESHOLDS[quantity.name][1]}; {basis}" if name == "threshold" else basis
        rows.append({"name": name, "value": value, "unit": unit or quantity.unit, "standing": origin, "basis": sources})
    return rows


def usual_settings(quantity: str = SED.name) -> AfferentSettings:
    """Return the assumed settings of an afferent driven by a quantity, by its name in `QUANTITIES`."""
    return AfferentSettings(quantity=quantity, threshold=_THRESHOLDS[quantity][0])


def settings_with(changes: Mapping[str, float], seed: int = 0, quantity: str = SED.name) -> AfferentSettings:
    """Return settings with some parameters changed.

    Raises ValueError, with a sentence, for an unknown name and a value out of range.

    >>> settings_with({"static_gain": 30.0}).static_gain
    30.0
    """
    names = [name for name in PARAMETERS if name != "seed"]
    for name, value in changes.items():
        if name not in names:
            raise ValueError(f"{name} is no parameter of the afferent: give one of {', '.join(names)}")
        least = 1e-6 if name in ("exponent", "adaptation_time", "greatest_rate", "variation") else 0.0
        greatest = 1.0 if name == "variation" else 1e4
        if not least <= value <= greatest:
            raise ValueError(f"{name} = {value:g} is not allowed: {least:g} to {greatest:g}")
    return replace(usual_settings(quantity), seed=seed, **cast("Mapping[str, Any]", changes))
