"""How uncertain a predicted SED is because its friction is: the draws of the friction's bootstrap through the solver.

Where the SED goes straight over the range of the draws, two derivatives carry all of them; where it bends, or a settled
state is missing at an end, the solver is run at draws themselves. Each interval says which.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sessions.analysis import Analysis
from sessions.analysis.bootstrap import BootstrapSettings, friction_draws
from sessions.prediction import Progress, SessionPrediction, TrialPrediction, seds_with, tau_scale
from sessions.sed_interval import SedInterval

Array = NDArray[np.float64]

SAMPLES = 60  # draws that are solved where derivatives do not suffice
BEND = 0.1  # the SED goes straight where its middle lies within this share of its range off the chord [-]
_FLAT = 1e-5  # a bend below this share of the SED is of no account [-]
_ENDS = (0.025, 0.975)


def with_intervals(
    analysis: Analysis,
    prediction: SessionPrediction,
    settings: BootstrapSettings | None = None,
    progress: Progress | None = None,
) -> SessionPrediction:
    """Return a prediction with the interval of each SED where its options ask for them. Raises as `sed_intervals`."""
    if not prediction.options.intervals:
        return prediction
    return replace(prediction, intervals=sed_intervals(analysis, prediction, settings, progress))


def sed_intervals(
    analysis: Analysis,
    prediction: SessionPrediction,
    settings: BootstrapSettings | None = None,
    progress: Progress | None = None,
) -> tuple[SedInterval, ...]:
    """Return the interval of each predicted trial, in order. Raises Cancelled where `progress` returns False.

    Friction found and its ends are solved together with one another, five scenes a trial.
    """
    scale = tau_scale(prediction.options)
    drawn = [_draws(analysis, row, scale, settings) for row in prediction.trials]
    known = [one for one in drawn if not isinstance(one, str)]
    seds = iter(seds_with([case for row, mu, tau in known for case in _cross(row, mu, tau)], progress))
    found: list[SedInterval] = []
    for row, one in zip(prediction.trials, drawn, strict=True):
        if isinstance(one, str):
            found.append(SedInterval(row.trial, row.stroke, None, None, None, None, None, one))
        else:
            found.append(_interval(row, one[1], one[2], [next(seds) for _ in range(5)], progress))
    return tuple(found)


def _draws(
    analysis: Analysis, row: TrialPrediction, scale: float, settings: BootstrapSettings | None
) -> tuple[TrialPrediction, Array, Array] | str:
    """Return what friction may have been in each repeat, or why that is not known."""
    if row.prediction is None or row.stroke is None or row.mu is None or row.tau_max is None:
        return row.reasons.get("sed", "nothing was predicted")
    rule = "maximum" if row.mu_rule == "maximum" else "mean over steady window"
    found = friction_draws(analysis.strokes[row.stroke], row.stroke, rule, settings)
    if found is None:
        return "the stroke is too short for an interval of its friction"
    return row, found[0], found[1] * scale


def _cross(row: TrialPrediction, mu: Array, tau_max: Array) -> list[tuple[TrialPrediction, float, float]]:
    """Return the friction found, and with each of mu and tau_max at the ends of its interval."""
    assert row.mu is not None  # `_draws` said so
    assert row.tau_max is not None
    (mu_low, mu_high), (tau_low, tau_high) = (np.quantile(values, _ENDS).tolist() for values in (mu, tau_max))
    points = [(row.mu, row.tau_max), (mu_low, row.tau_max), (mu_high, row.tau_max)]
    points += [(row.mu, tau_low), (row.mu, tau_high)]
    return [(row, m, t) for m, t in points]


def _interval(
    row: TrialPrediction, mu: Array, tau_max: Array, seds: Sequence[float | None], progress: Progress | None
) -> SedInterval:
    assert row.mu is not None  # `_draws` said so
    assert row.tau_max is not None
    middle, *ends = seds
    widths = [float(np.diff(np.quantile(values, _ENDS))[0]) for values in (mu, tau_max)]
    if middle is not None and all(end is not None for end in ends):
        mu_low, mu_high, tau_low, tau_high = (end or 0.0 for end in ends)
        by_mu, by_tau = (mu_high - mu_low) / widths[0], (tau_high - tau_low) / widths[1]
        if _straight(mu_low, middle, mu_high) and _straight(tau_low, middle, tau_high):
            carried = middle + by_mu * (mu - row.mu) + by_tau * (tau_max - row.tau_max)
            low, high = np.quantile(carried, _ENDS).tolist()
            return SedInterval(row.trial, row.stroke, low, high, "derivatives", by_mu, by_tau, "")
    few = np.linspace(0, len(mu) - 1, SAMPLES).astype(int)  # the draws are independent: any of them will do
    solved = seds_with([(row, float(mu[i]), float(tau_max[i])) for i in few], progress)
    held = [sed for sed in solved if sed is not None]
    if len(held) < SAMPLES:
        reason = f"{SAMPLES - len(held)} of {SAMPLES} draws of the friction have no settled state"
        return SedInterval(row.trial, row.stroke, None, None, "sampling", None, None, reason)
    low, high = np.quantile(held, _ENDS).tolist()
    return SedInterval(row.trial, row.stroke, low, high, "sampling", None, None, "")


def _straight(low: float, middle: float, high: float) -> bool:
    """Say whether three values at about equal steps lie on a line as far as matters.

    >>> _straight(1.0, 2.05, 3.0), _straight(1.0, 2.5, 3.0)
    (True, False)
    """
    return abs(middle - (low + high) / 2.0) <= max(BEND * abs(high - low), _FLAT * abs(middle))
