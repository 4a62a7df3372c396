"""The psychometric function of constant stimuli: how often a comparison is judged to have more than the standard.

P(comparison chosen) = lapse / 2 + (1 - lapse) Φ(slope (x - PSE + order o)), where x is the logarithm of the ratio of
magnitudes, o is 1 where the comparison came second and -1 where it came first, and a lapse is a random answer (Wichmann
and Hill 2001, Percept. Psychophys. 63, 1293). Answers to one pair may scatter more than binomially: they follow a
beta-binomial law (Schütt et al. 2016, Vision Res. 122, 105). The fit is by maximum likelihood; intervals are from the
profile likelihood, which requires no symmetry and holds at the boundary of no lapses (Venzon and Moolgavkar 1988, Appl.
Stat. 37, 87).

Maximum likelihood underestimates the scatter of few levels, since the function was fitted to them. The likelihood of
the intervals is therefore adjusted by half the logarithm of the function's information (Cox and Reid 1987, J. R. Stat.
Soc. B 49, 1), as in restricted maximum likelihood. With n levels in either order and p parameters of the function, it
drops at an end by half of (n - p) ln(1 + F(1, n - p) / (n - p)), the drop at which a normal law of unknown variance has
Student's interval.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from operator import itemgetter

import numpy as np
from scipy import special

from drivers.arrays import Array
from sessions.statistics.correlations import CONFIDENCE
from sessions.statistics.scores import IntervalEstimate, by_key

QUARTILE = float(special.ndtri(0.75))  # from the PSE to the JND, where three of four answers name the comparison [z]
LEAST_LEVELS = 3  # of x: two do not determine PSE, JND and lapses
MOST_LAPSES = 0.5  # beyond it an observer mostly guesses, and lapses cannot be distinguished from a flat slope
MOST_SCATTER = 1.0  # of the beta law's theta; the correlation is then 1/2, and most levels have identical answers
STEEPEST = 100.0  # slope times the spread of levels, beyond which any function is a step at these levels
_PSE, _SLOPE, _ORDER, _LAPSE, _SCATTER = range(5)
_SAME = 1e-6  # negligible difference of log likelihoods
_PRECISE, _ENOUGH = 1e-15, 1e-9  # relative change of the likelihood that ends a search: estimate, end of an interval
_SOME_SCATTER = 0.05  # theta from which a search begins, since it may not leave an edge
_SLOPES = (0.5, 2.0, 8.0, 32.0)  # start values: slopes relative to the spread of levels, and shares of lapses
_LAPSES = (0.01, 0.1, 0.3)
_DOUBLINGS = 12  # of the step from the estimate, until the likelihood drops enough


@dataclass(frozen=True, slots=True)
class Level:
    """The answers to one comparison in one order."""

    log_ratio: float  # of the comparison's magnitude to the standard's [-]
    choices: int  # how often the comparison was judged to have more
    presented: int
    order: int = 0  # 1: the comparison came second; -1: first; 0: not known


@dataclass(frozen=True, slots=True)
class Psychometric:
    """One psychometric function. Without values `reason` says why."""

    answers: int  # all that were given
    pse: IntervalEstimate | None = None  # log ratio at which both are chosen equally often [-]
    # From the PSE to three of four choices, without lapses, in log ratio; 0 where answers step between two levels [-].
    jnd: IntervalEstimate | None = None
    lapse: IntervalEstimate | None = None  # share of random answers [-]
    # Of answers to one pair in one order; 0: binomial scatter; None where the likelihood does not depend on it [-]
    correlation: IntervalEstimate | None = None
    order: IntervalEstimate | None = None  # log ratio added by coming second; None where orders are unknown [-]
    rises: bool = True  # the comparison is chosen more often with greater magnitude
    log_likelihood: float | None = None  # of all answers, natural logarithm
    deviance: float | None = None  # of the binomial law, against a separate probability for every level and order
    freedom: int | None = None  # degrees of freedom of that deviance
    reason: str = ""


def psychometric(levels: Sequence[Level]) -> Psychometric:
    """Return the function fitted to answers."""
    levels = [level for level in levels if level.presented]
    none = Psychometric(sum(level.presented for level in levels))
    if len({level.log_ratio for level in levels}) < LEAST_LEVELS:
        return replace(none, reason=f"it takes {LEAST_LEVELS} comparisons of different friction")
    fit = _ProfileLikelihood(levels)
    if fit.flat:
        return replace(none, reason="answers hardly depend on friction: the JND is beyond all comparisons")
    slope = fit.estimate(_SLOPE)
    return replace(
        none,
        pse=fit.estimate(_PSE),
        jnd=_jnd(slope, fit.steepest, fit.reach),
        lapse=fit.estimate(_LAPSE),
        correlation=_correlation(fit.estimate(_SCATTER)) if fit.scatters else None,
        order=fit.estimate(_ORDER) if fit.ordered else None,
        rises=slope.value > 0.0,
        log_likelihood=fit.likelihood,
        deviance=binomial_deviance(fit.choices, fit.n, fit.chances(fit.best)[0]),
        freedom=len(levels) - fit.parameters,
    )


def binomial_deviance(k: Array, n: Array, p: Array) -> float:
    """Return the deviance of probabilities p for k of n answers, against the saturated model k / n."""
    return 2.0 * float((special.rel_entr(k, n * p) + special.rel_entr(n - k, n * (1.0 - p))).sum())


class _ProfileLikelihood:
    """The likelihood of answers, its maximum, and its profiles."""

    def __init__(self, levels: Sequence[Level]) -> None:
        self.x = np.array([level.log_ratio for level in levels])
        self.orders = np.array([float(level.order) for level in levels])
        self.choices = np.array([float(level.choices) for level in levels])
        self.n = np.array([float(level.presented) for level in levels])
        # For every answer: level, number of earlier ones, if the comparison was chosen, number of equal earlier ones.
        self.level = np.repeat(np.arange(len(levels)), [level.presented for level in levels])
        self.trial = np.concatenate([np.arange(float(level.presented)) for level in levels])
        self.is_chosen = self.trial < self.choices[self.level]
        self.earlier = np.where(self.is_chosen, self.trial, self.trial - self.choices[self.level])
        self.spread = float(np.std(self.x))
        self.steepest = STEEPEST / self.spread
        self.ordered = len(set(self.orders.tolist())) > 1
        self.reach = reach = float(np.ptp(self.x))
        self.bounds = (
            (float(self.x.min()) - reach, float(self.x.max()) + reach),
            (-self.steepest, self.steepest),
            (-reach, reach) if self.ordered else (0.0, 0.0),
            (0.0, MOST_LAPSES),
            (0.0, MOST_SCATTER if self.n.max() > 1.0 else 0.0),
        )
        self.scale = np.array([self.spread, 1.0 / self.spread, self.spread, 0.1, 0.1])
        self.parameters = sum(low < high for low, high in self.bounds[:_SCATTER])
        dof = max(len(levels) - self.parameters, 1)
        # Square root of the drop of the adjusted log likelihood at an end.
        self.drop = math.sqrt(dof / 2.0 * math.log1p(float(special.fdtri(1, dof, CONFIDENCE)) / dof))
        self.best, self.likelihood = self._search()
        with_scatter = np.append(self.best[:_SCATTER], _SOME_SCATTER)
        optima = [self._fit({}, start, _PRECISE, adjusted=True) for start in (self.best, with_scatter)]
        self.top, self.adjusted = max(optima, key=itemgetter(1))

    @property
    def flat(self) -> bool:
        """Say whether all answers are the same, or the JND is beyond the range of comparisons."""
        return self.choices.sum() in (0.0, self.n.sum()) or abs(float(self.best[_SLOPE])) * self.reach < QUARTILE

    @property
    def scatters(self) -> bool:
        """Say whether the likelihood depends on the scatter, unlike for a step or single answers."""
        none, most = (self._fit({_SCATTER: theta}, self.best)[1] for theta in self.bounds[_SCATTER])
        return abs(most - none) > _SAME

    def estimate(self, parameter: int) -> IntervalEstimate:
        """Return a parameter with its interval from the profile likelihood."""
        value = float(self.best[parameter])
        low, high = self._limit(parameter, -1.0), self._limit(parameter, 1.0)
        low, high = None if low is None else min(low, value), None if high is None else max(high, value)
        return IntervalEstimate(value, low, high)

    def _search(self) -> tuple[Array, float]:
        """Return the best parameters and their log likelihood.

        The likelihood has several maxima: searches start at the likeliest grid point of each slope and share of lapses.
        """
        levels = np.unique(self.x)
        points = np.concatenate([levels, (levels[1:] + levels[:-1]) / 2.0])
        orders = (-0.5, 0.0, 0.5) if self.ordered else (0.0,)
        optima: list[tuple[Array, float]] = []
        for steep, lapse in product(_SLOPES, _LAPSES):
            grid = [
                np.array([pse, sign * steep / self.spread, order * self.spread, lapse, _SOME_SCATTER])
                for pse, sign, order in product(points, (-1.0, 1.0), orders)
            ]
            optima.append(self._fit({}, max(grid, key=lambda values: self._log_likelihood(values)[0]), _PRECISE))
        best, likelihood = max(optima, key=itemgetter(1))
        step = self._fit({_SLOPE: math.copysign(self.steepest, best[_SLOPE])}, best)
        return step if step[1] > likelihood - _SAME else (best, likelihood)

    def _limit(self, parameter: int, sense: float) -> float | None:
        """Return the bound of an interval towards `sense`: the edge or None where the likelihood drops too little."""
        edge = self.bounds[parameter][1 if sense > 0.0 else 0]
        value, start = float(self.top[parameter]), self.top
        fallback = None if parameter in (_PSE, _ORDER) else edge
        if value == edge:
            return fallback
        from scipy.optimize import brentq  # slow to load and not needed to open a session

        drops = {value: -self.drop}

        def drop(trial: float) -> float:
            nonlocal start
            if trial not in drops:
                optimum, likelihood = self._fit({parameter: trial}, start, adjusted=True)
                drops[trial] = math.sqrt(max(self.adjusted - likelihood, 0.0)) - self.drop  # nearly linear
                start = optimum if drops[trial] < 0.0 else start  # beyond the interval a fit may be far away
            return drops[trial]

        inner, step = value, float(self.scale[parameter]) / 4.0
        for _ in range(_DOUBLINGS):
            outer = min(inner + step, edge) if sense > 0.0 else max(inner - step, edge)
            if drop(outer) > 0.0:
                return float(brentq(drop, inner, outer, xtol=1e-3 * self.scale[parameter]))
            if outer == edge:
                break
            inner, step = outer, 2.0 * step
        return fallback

    def _fit(
        self, fixed: dict[int, float], start: Array, precision: float = _ENOUGH, *, adjusted: bool = False
    ) -> tuple[Array, float]:
        """Return the best parameters with some fixed, and their log likelihood, or the adjusted one."""
        from scipy.optimize import minimize  # slow to load and not needed to open a session

        bounds = [(fixed[n], fixed[n]) if n in fixed else pair for n, pair in enumerate(self.bounds)]
        low, high = np.array(bounds).T / self.scale
        start = np.clip(start / self.scale, low, high)
        bounds = list(zip(low, high, strict=True))

        def loss(scaled: Array) -> tuple[float, Array]:
            value, slope = self._log_likelihood(scaled * self.scale)
            theta = float(scaled[_SCATTER] * self.scale[_SCATTER])
            adjustment, theta_slope = self._adjustment(theta) if adjusted else (0.0, 0.0)
            slope[_SCATTER] += theta_slope
            return -value - adjustment, -slope * self.scale

        optimum = minimize(
            loss, start, jac=True, method="L-BFGS-B", bounds=bounds, options={"ftol": precision, "gtol": 1e-9}
        )
        return np.asarray(optimum.x, np.float64) * self.scale, -float(optimum.fun)

    def chances(self, parameters: Array) -> tuple[Array, Array]:
        """Return each level's probability (n,), clipped off 0 and 1, and its derivatives by the first four (n, 4)."""
        pse, slope, order, lapse, _ = parameters.tolist()
        offset = self.x - pse + order * self.orders
        eta = slope * offset
        attentive = np.asarray(special.ndtr(eta), np.float64)
        rise = (1.0 - lapse) * np.exp(-(eta**2) / 2.0) / math.sqrt(2.0 * math.pi)
        p = np.clip(lapse / 2.0 + (1.0 - lapse) * attentive, 1e-12, 1.0 - 1e-12)
        return p, np.stack([-slope * rise, offset * rise, slope * self.orders * rise, 0.5 - attentive], axis=1)

    def _log_likelihood(self, parameters: Array) -> tuple[float, Array]:
        """Return the beta-binomial log likelihood without its coefficient, and its derivatives (5,).

        With theta 0 it is binomial (Griffiths 1973, Biometrics 29, 637).
        """
        p, slopes = self.chances(parameters)
        theta = float(parameters[_SCATTER])
        numerators = np.where(self.is_chosen, p[self.level], 1.0 - p[self.level]) + theta * self.earlier
        denominators = 1.0 + theta * self.trial
        p_slope = np.bincount(self.level, np.where(self.is_chosen, 1.0, -1.0) / numerators, len(p))
        theta_slope = (self.earlier / numerators).sum() - (self.trial / denominators).sum()
        value = float(np.log(numerators).sum() - np.log(denominators).sum())
        return value, np.append(p_slope @ slopes, theta_slope)

    def _adjustment(self, theta: float) -> tuple[float, float]:
        """Return the Cox-Reid adjustment of the log likelihood for the fitted parameters, and its derivative by theta.

        n answers at a level have the information of n (1 + theta) / (1 + n theta) independent ones.
        """
        inflation = 1.0 + self.n * theta
        independent = self.n * (1.0 + theta) / inflation
        slope = self.n * (1.0 - self.n) / inflation**2
        half, total = self.parameters / 2.0, independent.sum()
        return -half * math.log(float(total / self.n.sum())), -half * float(slope.sum() / total)


def _jnd(slope: IntervalEstimate, steepest: float, reach: float) -> IntervalEstimate:
    """Return the JND of a slope of either sign: 0 where it may be a step, unbounded beyond the reach."""
    steeper, flatter = (slope.high, slope.low) if slope.value > 0.0 else (slope.low, slope.high)
    flat = flatter is None or flatter * slope.value <= 0.0 or abs(flatter) * reach < QUARTILE
    slopes = (math.inf if steeper is None else abs(steeper), abs(slope.value))
    low, value = (0.0 if size >= steepest else QUARTILE / size for size in slopes)
    return IntervalEstimate(value, low, None if flat or flatter is None else QUARTILE / abs(flatter))


def _correlation(scatter: IntervalEstimate) -> IntervalEstimate:
    """Return the correlation of answers, theta / (1 + theta)."""
    low, high = (None if bound is None else bound / (1.0 + bound) for bound in (scatter.low, scatter.high))
    return IntervalEstimate(scatter.value / (1.0 + scatter.value), low, high)


# One answer: session, the standard's index, the pair in order of stroking, and "first" or "second" chosen
Comparison = tuple[str, int, tuple[int, int], str]


def function_of(answers: Sequence[Comparison], friction: Mapping[tuple[str, int], Sequence[float]]) -> Psychometric:
    """Return the psychometric function of one subject.

    `friction` holds the µ of each stroke by session and index; a surface's is their geometric mean. Answers count where
    both surfaces have a µ. A level is the answers of one session to one surface in one order.
    """
    log_mu = {key: float(np.mean(np.log(values))) for key, values in friction.items() if values}
    levels = by_key(
        ((session, standard, index, order), choice == comparison)
        for session, standard, (first, second), choice in answers
        for index, comparison, order in [(second, "second", 1) if first == standard else (first, "first", -1)]
        if (session, index) in log_mu and (session, standard) in log_mu
    )
    if answers and not levels:
        return Psychometric(0, reason="no comparison has a measured friction of both surfaces")
    return psychometric(
        [
            Level(log_mu[session, index] - log_mu[session, standard], sum(replies), len(replies), order)
            for (session, standard, index, order), replies in sorted(levels.items())
        ]
    )
