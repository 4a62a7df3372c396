"""How uncertain a predicted SED is because its friction is: the draws of the friction's bootstrap through the solver.

Where the SED goes straight over the range of the draws, derivatives carry all of them; where it bends, or a settled
state is missing at an end, the solver is run at draws themselves. Each interval says which. A trial predicted by the
force measured has the uncertainty of that force in it too.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sessions.alternative import Variant
from sessions.analysis import Analysis
from sessions.analysis.bootstrap import BootstrapSettings, FrictionDraws, drawn_from, friction_draws
from sessions.prediction import (
    Prediction,
    PredictionOptions,
    Progress,
    Scene,
    SessionPrediction,
    TrialPrediction,
    scene_along,
    seds_of,
    tau_scale,
    traction_reached,
    with_loads,
)
from sessions.sed_interval import SedInterval

Array = NDArray[np.float64]

SAMPLES = 60  # draws that are solved where derivatives do not suffice
BEND = 0.1  # the SED goes straight where its middle lies within this share of its range off the chord [-]
_FLAT = 1e-5  # a bend below this share of the SED is of no account [-]
_ENDS = (0.025, 0.975)
_BEYOND = 1.05  # a tau_max so much beyond the greatest traction is not reached by any draw of the rest either [-]


@dataclass(frozen=True, slots=True, eq=False)
class _Case:
    """One scene, and what its loads may have been; (repeats,) of each."""

    scene: Scene  # settled
    drawn: Mapping[str, Array]  # "mu" [-], "tau_max" [MPa] as the model gets it, "force" [N] where that drives it

    @property
    def told(self) -> Mapping[str, float]:
        """What each is in the scene."""
        scene = self.scene
        known = {"mu": scene.friction.mu, "tau_max": scene.friction.tau_max, "force": scene.loading.normal_force}
        return {name: known[name] or 0.0 for name in self.drawn}

    @property
    def cross(self) -> list[Scene]:
        """The scene, and those with one load at either end of its interval, in the order of `drawn`."""
        ends = [(name, end) for name, drawn in self.drawn.items() for end in np.quantile(drawn, _ENDS).tolist()]
        return [self.scene, *(with_loads(self.scene, {name: end}) for name, end in ends)]

    def bounded(self, reached: float) -> "_Case":
        """Return it without the draws of a tau_max far above the traction that the skin anywhere reaches [MPa]."""
        free = "tau_max" in self.drawn and float(self.drawn["tau_max"].min()) > _BEYOND * reached
        return replace(self, drawn={n: d for n, d in self.drawn.items() if n != "tau_max"}) if free else self


_Column = Sequence[_Case | str]  # a case for each trial, or why there is none


def with_intervals(
    analysis: Analysis,
    prediction: SessionPrediction,
    settings: BootstrapSettings | None = None,
    progress: Progress | None = None,
    *,
    both_ways: bool = True,
) -> SessionPrediction:
    """Return a prediction with an interval of each SED it holds, where its options ask for them.

    They are of each trial, of the same slid the other way (where asked for by `both_ways`), and of each variant
    where the options ask for those too.
    The friction found and the ends of its intervals are solved together, five scenes a trial, seven where the force
    drives the model, two fewer where the skin does not reach tau_max. Raises Cancelled where `progress`, told the part
    done, returns False.
    """
    if not prediction.options.intervals:
        return prediction
    rows, options = prediction.trials, prediction.options
    settings = settings or drawn_from(analysis.settings)
    drawn = [_draws(analysis, row, settings) for row in rows]
    first = next((row.alternatives for row in rows if row.alternatives), ())
    variants = [one.variant for one in first] if options.beside_intervals else []
    share = 1.0 / (1 + len(variants))
    scale = tau_scale(options)
    along = [_solved(row, row.prediction, "sed", one, scale) for row, one in zip(rows, drawn, strict=True)]
    back = [_solved(row, row.opposite, "opposite_sed", one, scale) for row, one in zip(rows, drawn, strict=True)]
    both = _intervals([*along, *(back if both_ways else ())], _part(progress, 0.0, share))
    usual, other = both[: len(rows)], both[len(rows) :] or [None] * len(rows)
    columns: list[Sequence[SedInterval | None]] = []
    for number, variant in enumerate(variants, 1):
        if (variant.kinematics, variant.tau_reading) == (options.kinematics, options.tau_reading) and (
            variant.driven in ("depth", "other way")
        ):
            columns.append(usual if variant.driven == "depth" else other)
            continue
        cases = [_along(row, variant, options, one) for row, one in zip(rows, drawn, strict=True)]
        columns.append(_intervals(cases, _part(progress, share * number, share)))
    told = tuple(
        replace(
            row,
            interval=usual[at],
            opposite_interval=other[at],
            alternatives=tuple(
                replace(one, interval=column[at]) for one, column in zip(row.alternatives, columns, strict=True)
            )
            if variants
            else row.alternatives,
        )
        for at, row in enumerate(rows)
    )
    return replace(prediction, trials=told)


def _draws(analysis: Analysis, row: TrialPrediction, settings: BootstrapSettings) -> FrictionDraws | str:
    """Return what friction may have been in each repeat, or why that is not known."""
    if row.prediction is None or row.stroke is None or row.mu is None or row.tau_max is None:
        return row.reasons.get("sed", "nothing was predicted")
    rule = "maximum" if row.mu_rule == "maximum" else "mean over steady window"
    found = friction_draws(analysis.strokes[row.stroke], row.stroke, rule, settings)
    return "the stroke is too short for an interval of its friction" if found is None else found


def _solved(
    row: TrialPrediction, found: Prediction | None, name: str, drawn: FrictionDraws | str, scale: float
) -> _Case | str:
    """Return the case of what the solver found, or why there is none."""
    if found is None:
        return row.reasons.get(name, "nothing was predicted")
    scene = replace(found.scene, solve=replace(found.scene.solve, course="steady"))
    return drawn if isinstance(drawn, str) else _case(scene, drawn, scale, traction_reached(found))


def _along(
    row: TrialPrediction, variant: Variant, options: PredictionOptions, drawn: FrictionDraws | str
) -> _Case | str:
    """Return the case of a trial in a variant; why there is none where it has no SED: its limits are not looked for."""
    found = next(one for one in row.alternatives if one.variant == variant)
    scene = scene_along(row, variant, options) if found.sed is not None else found.reason
    if isinstance(scene, str) or isinstance(drawn, str):
        return scene if isinstance(scene, str) else str(drawn)
    scale = tau_scale(replace(options, tau_reading=variant.tau_reading))
    return _case(scene, drawn, scale, found.traction or 0.0)


def _case(scene: Scene, drawn: FrictionDraws, scale: float, reached: float) -> _Case | str:
    """Return the case of a scene whose friction was drawn, or why there is none; `reached` [MPa] on the skin."""
    loads = {"mu": np.maximum(drawn.mu, 0.0), "tau_max": drawn.tau_max * scale}
    if scene.loading.normal_force is not None:
        if drawn.normal_force is None:
            return "the stroke is too short for an interval of its normal force"
        loads["force"] = drawn.normal_force
    return _Case(scene, loads).bounded(reached)


def _intervals(column: _Column, progress: Progress | None) -> list[SedInterval]:
    """Return the interval of each case, all of them solved on one mesh."""
    crosses = [[] if isinstance(one, str) else one.cross for one in column]
    seds = iter(seds_of([scene for cross in crosses for scene in cross], progress))
    return [
        SedInterval(None, None, None, reason=one)
        if isinstance(one, str)
        else _interval(one, [next(seds) for _ in cross], progress)
        for one, cross in zip(column, crosses, strict=True)
    ]


def _interval(case: _Case, seds: Sequence[float | None], progress: Progress | None) -> SedInterval:
    middle, *ends = seds
    if middle is not None and all(end is not None for end in ends):
        pairs = dict(zip(case.drawn, zip(ends[::2], ends[1::2], strict=True), strict=True))
        slopes: dict[str, float] = {}
        for name, (low, high) in pairs.items():
            assert low is not None  # asked above, and of the other
            assert high is not None
            if _straight(low, middle, high):
                slopes[name] = (high - low) / float(np.diff(np.quantile(case.drawn[name], _ENDS))[0])
        if len(slopes) == len(pairs):
            carried = middle + sum(slopes[name] * (case.drawn[name] - told) for name, told in case.told.items())
            low, high = np.quantile(carried, _ENDS).tolist()
            by_mu, by_force = slopes.get("mu"), slopes.get("force")
            by_tau_max = slopes.get("tau_max", 0.0)  # without a draw it bounds nothing
            return SedInterval(low, high, "derivatives", by_mu, by_tau_max, by_force)
    elif case.scene.solve.kinematics == "finite":  # each draw without a state would be followed to its limit
        return SedInterval(None, None, None, reason="at an end of the friction's interval there is no settled state")
    return _sampled(case, progress)


def _sampled(case: _Case, progress: Progress | None) -> SedInterval:
    """Return the interval of the SEDs of some draws."""
    repeats = len(case.drawn["mu"])
    few = np.linspace(0, repeats - 1, SAMPLES).astype(int)  # the draws are independent: any of them will do
    scenes = [with_loads(case.scene, {name: float(drawn[i]) for name, drawn in case.drawn.items()}) for i in few]
    held = [sed for sed in seds_of(scenes, progress) if sed is not None]
    if len(held) < SAMPLES:
        reason = f"{SAMPLES - len(held)} of {SAMPLES} draws of the friction have no settled state"
        return SedInterval(None, None, "sampling", reason=reason)
    low, high = np.quantile(held, _ENDS).tolist()
    return SedInterval(low, high, "sampling")


def _straight(low: float, middle: float, high: float) -> bool:
    """Say whether three values at about equal steps lie on a line as far as matters.

    >>> _straight(1.0, 2.05, 3.0), _straight(1.0, 2.5, 3.0)
    (True, False)
    """
    return abs(middle - (low + high) / 2.0) <= max(BEND * abs(high - low), _FLAT * abs(middle))


def _part(progress: Progress | None, low: float, share: float) -> Callable[[float], bool] | None:
    return None if progress is None else lambda done: progress(low + share * done)
