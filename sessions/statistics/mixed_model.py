"""Linear mixed models of scores, with random levels and slopes of subjects, or subjects crossed with surfaces.

The likelihood is a function of the factor of the random effects' covariance relative to the residual variance, as in
Bates, Maechler, Bolker & Walker 2015 (J. Stat. Softw. 67:1, equations 34 and 41). Fixed effects and scale are profiled
out, and singular covariances are interior points. The gradient is exact, so the maximum is found to the last few bits.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy import special
from scipy.linalg import lapack

from drivers.arrays import Array
from sessions.statistics.correlations import TAILS, t_quantile
from sessions.statistics.scores import indicator_columns, sd_interval

_STARTS = (0.3, 3.0)  # spreads relative to the residual's: the search starts from each pair and keeps the best optimum
_WIDEST = 1e3  # largest such spread in the search: scores have three figures
# Gradient of the deviance at which Newton's method takes over: a tenth or ten times it changes no number by 1e-10.
_NEARBY = 1e-5
_SINGULAR = 1e-4  # of the factor's diagonal, as lme4 has it
_NOTHING = 1e-9  # of the factor: its square is then below round-off
_STEPS = 6  # of Newton's method; more change nothing


@dataclass(frozen=True, slots=True, eq=False)
class _Likelihood:
    """The likelihood of y = X b + Z u + e in the factor L of the covariance of u relative to the variance of e.

    n values, p fixed effects b, c random effects u; restricted (`reml`) or full likelihood.
    """

    n: int
    sums: Array  # of products of all columns: Z (c), X (p), and the least-squares residuals of y on X
    offset: Array  # (p,) least-squares estimates, subtracted first to avoid cancellation
    patterns: Array  # (m, c, c): L is their sum weighted by the m parameters
    reml: bool

    @staticmethod
    def of(y: Array, fixed: Array, random: Array, patterns: Array, *, reml: bool) -> "_Likelihood":
        offset = np.asarray(np.linalg.lstsq(fixed, y, rcond=None)[0], np.float64)
        columns = np.column_stack([random, fixed, y - fixed @ offset])
        return _Likelihood(len(y), columns.T @ columns, offset, patterns, reml)

    @property
    def dof(self) -> int:
        """Degrees of freedom of the variance of e."""
        return self.n - len(self.offset) * self.reml

    def reduce(self, theta: Array) -> tuple[Array, Array, float]:
        """Return L (c, c), `sums` weighted by the inverse covariance, and the log of the covariance's determinant."""
        factor = np.einsum("m,mij->ij", theta, self.patterns)
        count = len(factor)
        rows = factor.T @ self.sums[:count]
        half, log_det = _eliminate(np.eye(count) + factor.T @ self.sums[:count, :count] @ factor, rows)
        return factor, self.sums - half.T @ half, log_det

    def deviance(self, theta: Array) -> tuple[float, Array]:
        """Return -2 log likelihood, and its gradient."""
        factor, cross_products, value = self.reduce(theta)
        count = len(factor)
        half, log_det = _eliminate(cross_products[count:-1, count:-1], cross_products[count:-1])
        cross_products = cross_products - half.T @ half  # of what fixed effects do not explain
        residual_square = float(cross_products[-1, -1])
        errors = cross_products[:count, -1]
        factor_gradient = cross_products[:count, :count] - self.dof / residual_square * np.outer(errors, errors)
        if self.reml:
            value += log_det
        else:
            factor_gradient += half[:, :count].T @ half[:, :count]
        value += self.dof * (1.0 + math.log(2.0 * math.pi * residual_square / self.dof))
        return value, 2.0 * np.einsum("mij,ij->m", self.patterns, factor_gradient @ factor)

    def maximum(self, starts: Sequence[Array]) -> Array:
        """Return the parameters (m,) of maximum likelihood."""
        from scipy.optimize import minimize  # slow to load and not needed to open a session

        optima = [
            minimize(
                self.deviance,
                start,
                jac=True,
                method="L-BFGS-B",
                bounds=[(-_WIDEST, _WIDEST)] * len(self.patterns),
                options={"ftol": 0.0, "gtol": _NEARBY},
            )
            for start in starts
        ]
        return self._polish(min(optima, key=lambda optimum: float(optimum.fun)).x)

    def _polish(self, theta: Array) -> Array:
        """Return the zero of the gradient to round-off, by Newton's method from a nearby point."""
        value, slope = self.deviance(theta)
        for _ in range(_STEPS):
            step = 1e-6 * np.maximum(np.abs(theta), 1e-2)
            differences = [
                self.deviance(theta + offset)[1] - self.deviance(theta - offset)[1] for offset in np.diag(step)
            ]
            curvature = np.array(differences) / (2 * step[:, None])
            # Without differences of levels the factor may rotate at constant covariance: no step in that direction.
            candidate = theta - np.linalg.lstsq(0.5 * (curvature + curvature.T), slope, rcond=1e-7)[0]
            candidate_value, candidate_slope = self.deviance(candidate)
            if not candidate_value <= value + 1e-9 * abs(value) or np.abs(candidate_slope).max() >= np.abs(slope).max():
                break
            theta, value, slope = candidate, candidate_value, candidate_slope
        return np.where(np.abs(theta) < _NOTHING, 0.0, theta)


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """The maximum of the restricted likelihood; p fixed effects, q of them random between subjects."""

    estimates: Array  # (p,)
    errors: Array  # (p,) standard errors
    among: Array  # (q, q) covariance of the subjects' own coefficients
    within: float  # residual standard deviation
    deviance: float  # -2 log restricted likelihood, up to a constant of the design
    singular: bool  # `among` is rank-deficient
    exact: bool  # the residuals are round-off


def reml_fit(y: Array, columns: Array, subjects: Sequence[str] | Array, random_terms: int) -> Fit:
    """Return the fit of y (n) by `columns` (n, p) of one scale; the first `random_terms` also vary by subject."""
    indicators = indicator_columns(subjects)
    random = (indicators[:, :, None] * columns[:, None, :random_terms]).reshape(len(y), -1)
    triangle = np.tril_indices(random_terms)
    units = np.zeros((len(triangle[0]), random_terms, random_terms))
    units[(np.arange(len(units)), *triangle)] = 1.0
    patterns = np.array([np.kron(np.eye(indicators.shape[1]), unit) for unit in units], np.float64)
    likelihood = _Likelihood.of(y, columns, random, patterns, reml=True)
    theta = likelihood.maximum([np.diag(spread)[triangle] for spread in product(_STARTS, repeat=random_terms)])
    factor, cross_products, _ = likelihood.reduce(theta)
    factor, cross_products = factor[:random_terms, :random_terms], cross_products[random.shape[1] :, random.shape[1] :]
    inverse = np.linalg.inv(cross_products[:-1, :-1])
    beta = inverse @ cross_products[:-1, -1]
    variance = float(cross_products[-1, -1] - cross_products[-1, :-1] @ beta) / likelihood.dof
    return Fit(
        estimates=likelihood.offset + beta,
        errors=np.sqrt(variance * np.diag(inverse)),
        among=variance * factor @ factor.T,
        within=math.sqrt(variance),
        deviance=likelihood.deviance(theta)[0],
        singular=bool(np.abs(np.diag(factor)).min() < _SINGULAR),
        exact=bool(np.abs(theta).max() >= _WIDEST),
    )


def _eliminate(matrix: Array, rows: Array) -> tuple[Array, float]:
    """Return R^-1 `rows` with `matrix` = R R', and the log of its determinant.

    LAPACK is called without SciPy's checks, which take most of the time of small matrices.
    """
    root, failed = lapack.dpotrf(matrix, lower=True)
    if failed:
        raise np.linalg.LinAlgError("the matrix is not positive definite")
    half, _ = lapack.dtrtrs(root, rows, lower=True)
    return half, 2.0 * float(np.log(root.diagonal()).sum())


def fits_exactly(design: Array, y: Array) -> bool:
    """Say whether columns (n, k) explain y (n) to round-off."""
    residuals = y - design @ np.linalg.lstsq(design, y, rcond=None)[0]
    return float(np.abs(residuals).max()) <= 1e-9 * (1.0 + float(np.abs(y).max()))


def crossed_aic(
    subjects: Sequence[str], surfaces: Sequence[int], conditions: Sequence[str], y: Sequence[float], x: Sequence[float]
) -> float | None:
    """Return Akaike's criterion, up to a constant, of a model of y (n) with levels of subjects and surfaces and error.

    Its fixed terms are an intercept, a slope on the mean of x (n) over the trials of each condition, and another slope
    on the difference of x from that mean (Mundlak 1978, Econometrica 46:69). `conditions` (n) are those of all
    subjects, such as a surface at a depth. A single slope would be that of the many strokes in one condition, and the
    surfaces' levels would explain what this slope does not.

    By restricted likelihood with the determinant of the fixed terms (Harville 1974, Biometrika 61:383; Gurka 2006, Am.
    Stat. 60:19). Maximum likelihood takes the slope between a few surfaces as exactly known, so it prefers too firmly.
    A correction by numbers of parameters would be the same for all rivals. The unit is the standard deviation of y.
    None where x does not vary, or where the fixed terms leave no residuals.
    """
    covariate = np.asarray(x, np.float64) - np.mean(x)
    size, noise = float(np.abs(covariate).max()), 1e-12 * float(np.abs(x).max())
    if size <= noise:
        return None
    covariate /= size
    values, levels = np.asarray(y, np.float64), [indicator_columns(groups) for groups in (subjects, surfaces)]
    random = np.hstack(levels)
    if fits_exactly(np.column_stack([random, covariate]), values):
        return None
    alike = indicator_columns(conditions)
    usual = alike @ (alike.T @ covariate / alike.sum(axis=0))
    parts = [part for part in (usual, covariate - usual) if size * np.abs(part).max() > noise]
    fixed = np.column_stack([np.ones(len(values)), *parts])
    factors = np.repeat([0, 1], [groups.shape[1] for groups in levels])
    patterns = np.array([np.diag((factors == group).astype(np.float64)) for group in (0, 1)])
    likelihood = _Likelihood.of(values / values.std(), fixed, random, patterns, reml=True)
    maximum = likelihood.maximum([np.array(spread) for spread in product(_STARTS, repeat=2)])
    determinant = float(np.linalg.slogdet(fixed.T @ fixed)[1])
    return likelihood.deviance(maximum)[0] - determinant + 2.0 * len(parts)


def akaike_weights(criteria: Sequence[float]) -> tuple[float, ...]:
    """Return the weights of models by their Akaike criteria (Wagenmakers & Farrell 2004, Psychon. Bull. Rev. 11).

    >>> tuple(round(weight, 3) for weight in akaike_weights([204.0, 202.0, 206.0]))
    (0.245, 0.665, 0.09)
    """
    return tuple(special.softmax(-0.5 * np.asarray(criteria, np.float64)).tolist())


@dataclass(frozen=True, slots=True)
class Spread:
    """A standard deviation with its 95 % interval; 0 where subjects differ no more than residuals explain."""

    sd: float  # the standard deviation
    low: float  # 95 % interval
    high: float  # its upper end


@dataclass(frozen=True, slots=True)
class Spreads:
    """Spreads between subjects, and between trials within subjects."""

    level: Spread  # of the subjects' levels, at the mean of the covariate [unit of y]
    slope: Spread | None  # of their slopes on the covariate [unit of y over unit of x]; None without one
    left: Spread  # of y about each subject's line: the noise of single trials
    subjects: int  # with such trials
    dof: int  # of the residuals


INTERCEPT = "intercept"


@dataclass(frozen=True, slots=True)
class Term:
    """One fixed effect with its 95 % interval."""

    name: str
    estimate: float  # score per unit of the covariate that `name` states [points]
    low: float  # 95 % interval
    high: float  # its upper end
    p: float  # two-sided


@dataclass(frozen=True, slots=True)
class MixedModel:
    """A linear mixed model by restricted maximum likelihood: with random levels and slopes of subjects."""

    terms: tuple[Term, ...]
    middle: float  # mean of the first covariate, where intercept and subjects' levels are defined
    between_sd: float  # of the subjects' levels [points]
    within_sd: float  # of the residuals [points]
    n: int  # trials
    subjects: int  # with such trials
    slope_sd: float  # of the subjects' slopes on the first covariate
    singular: bool  # a spread is 0, or level and slope are perfectly correlated
    spreads: Spreads | None  # the same standard deviations by least squares, with intervals; None with too few subjects

    def term(self, name: str) -> Term:
        """Return one fixed effect. Raises KeyError for one that was not in the model."""
        return {term.name: term for term in self.terms}[name]


def mixed_model(
    subjects: Sequence[str], score: Sequence[float], covariates: Mapping[str, Sequence[float]]
) -> MixedModel | str:
    """Return the model score (n) = intercept + slopes times covariates (n each) + level of the subject + error.

    Each subject also has its own slope on the first covariate; otherwise that slope's interval would be too narrow
    where subjects use more or less of the scale. t intervals have these degrees of freedom: subjects - 1 for the level,
    subjects in whom the covariate varies - 1 for the slope, and for the others those left by separate fits to each
    subject. The first covariate is centred, so that an offset of it changes nothing.

    Carry-over and drift are covariates: preceding index, place in the block. Without a model a sentence says why.
    """
    names = [INTERCEPT, *covariates]
    columns = np.column_stack([np.ones(len(score)), *covariates.values()])
    count = len(set(subjects))
    if count < 2 or len(score) <= len(names) + count:
        return f"{len(score)} scores of {count} subjects are too few for {len(names)} terms and a level of each subject"
    middle = float(columns[:, 1].mean())
    columns[:, 1] -= middle
    scale = np.abs(columns).max(axis=0)  # so covariates in any unit are fitted equally well
    if not scale.all() or np.linalg.matrix_rank(columns / scale) < len(names):
        return "a term does not vary, or others determine it"
    varies = sum(float(np.ptp(columns[np.array(subjects) == subject, 1])) > 0.0 for subject in set(subjects))
    if varies < 2:
        return f"{names[1]} varies between the scores of {varies} of {count} subjects, and it takes two"
    if fits_exactly(np.hstack([indicator_columns(subjects), columns[:, 1:] / scale[1:]]), np.array(score, np.float64)):
        return "all scores lie on the line but for round-off: no residuals remain to estimate an error"
    fit = reml_fit(np.array(score, np.float64), columns / scale, np.array(subjects), random_terms=2)
    if fit.exact:
        return "each subject's scores lie on a line of their own: no residuals remain to estimate an error"
    level_sd, slope_sd = (np.sqrt(np.diag(fit.among)) / scale[:2]).tolist()
    residual_dof = max(len(score) - len(names) - (count - 1) - (varies - 1), 1)
    dofs = [count - 1, varies - 1, *([residual_dof] * (len(names) - 2))]
    terms = map(_term, names, (fit.estimates / scale).tolist(), (fit.errors / scale).tolist(), dofs)
    first, *common = covariates.values()
    return MixedModel(
        terms=tuple(terms),
        middle=middle,
        between_sd=level_sd,
        within_sd=fit.within,
        n=len(score),
        subjects=count,
        slope_sd=slope_sd,
        singular=fit.singular,
        spreads=spreads(subjects, score, common, first),
    )


def _term(name: str, estimate: float, error: float, dof: int) -> Term:
    half, p = t_quantile(dof) * error, 2.0 * float(special.stdtr(dof, -abs(estimate / error)))
    return Term(name, estimate, estimate - half, estimate + half, p)


def spreads(
    subjects: Sequence[str], y: Sequence[float], common: Sequence[Sequence[float]], x: Sequence[float] | None = None
) -> Spreads | None:
    """Return the spreads of y (n): levels vary by subject, with `x` (n) also slopes; all share slopes on `common`.

    `common` holds covariates (n each). Fitted by least squares; the variance of subjects' coefficients is their own
    variance plus that of their error, which is subtracted. Intervals: chi squared for the residuals; for the others
    that of a difference of two mean squares (modified large sample: Ting, Burdick, Graybill, Jeyaratnam & Lu 1990, J.
    Stat. Comput. Simul. 35:135), with unweighted coefficients where subjects have different trials (Thomas & Hultquist
    1978, Ann. Stat. 6:582). Subjects with too few trials for their own line do not count. None for fewer than three
    subjects, or collinear covariates.
    """
    line_terms = 1 if x is None else 2
    _, members, trials = np.unique(np.array(subjects), return_inverse=True, return_counts=True)
    usable = trials[members] > line_terms
    count = int((trials > line_terms).sum())
    if count < 3:
        return None
    lines = indicators = indicator_columns(members[usable])
    if x is not None:
        covariate = np.array(x, np.float64)[usable]
        lines = np.hstack([indicators, indicators * (covariate - covariate.mean())[:, None]])
    covariates = np.array(common, np.float64).reshape(len(common), len(y))[:, usable].T
    design = np.hstack([lines, covariates])
    scale = np.abs(design).max(axis=0)
    if not scale.all():
        return None
    design /= scale
    values = np.array(y, np.float64)[usable]
    dof = len(values) - design.shape[1]
    if dof < 1 or np.linalg.matrix_rank(design) < design.shape[1]:
        return None
    inverse = np.asarray(np.linalg.pinv(design), np.float64)
    residuals = values - design @ inverse @ values
    square = float(residuals @ residuals) / dof
    coefficients, errors = inverse @ values / scale, inverse @ inverse.T / np.outer(scale, scale)

    def spread_of(first: int) -> Spread:
        block = slice(first, first + count)
        error = errors[block, block]
        share = float(np.trace(error) - error.mean(axis=0).sum()) / (count - 1)  # of `square` in the mean square
        return difference_of_squares(float(coefficients[block].var(ddof=1)), count - 1, share * square, dof)

    sd = math.sqrt(square)
    residual = Spread(sd, *sd_interval(sd, dof + 1))
    return Spreads(spread_of(0), None if x is None else spread_of(count), residual, count, dof)


def difference_of_squares(first: float, first_dof: int, second: float, second_dof: int) -> Spread:
    """Return the square root of the difference of two independent mean squares.

    Its lower end is 0 exactly where an F test does not distinguish the two.
    """

    def margin(tail: float, opposite: float) -> float:
        ratio = float(special.fdtri(first_dof, second_dof, opposite))
        first_excess = first_dof / float(special.chdtri(first_dof, tail)) - 1
        second_excess = second_dof / float(special.chdtri(second_dof, opposite)) - 1
        bound = ((ratio - 1) ** 2 - (first_excess * ratio) ** 2 - second_excess**2) / ratio
        return math.sqrt(max((first_excess * first) ** 2 + (second_excess * second) ** 2 + bound * first * second, 0.0))

    squares = first - second, first - second - margin(*TAILS), first - second + margin(*TAILS[::-1])
    return Spread(*(math.sqrt(max(square, 0.0)) for square in squares))
