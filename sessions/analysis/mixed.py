"""The score as a straight line of the predicted energy, subjects differing in level, with what the order adds."""

import importlib
import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

CONFIDENCE = 0.95
INTERCEPT = "intercept"

Array = np.ndarray[Any, np.dtype[np.float64]]


@dataclass(frozen=True, slots=True)
class Term:
    """One fixed effect with its 95 % interval."""

    name: str
    estimate: float
    low: float
    high: float
    p: float  # two-sided


@dataclass(frozen=True, slots=True)
class MixedModel:
    """A linear mixed model by restricted maximum likelihood: each subject has a level, perhaps a slope, of its own."""

    terms: tuple[Term, ...]
    between_sd: float  # of the subjects' levels
    within_sd: float  # of what is left
    n: int
    subjects: int
    slope_sd: float | None  # of the subjects' slopes on the first covariate; None where one slope was fitted for all
    singular: bool  # the subjects' levels do not differ beyond what is left: between_sd is 0 or nearly

    def term(self, name: str) -> Term:
        """Return one fixed effect. Raises KeyError for one that was not in the model."""
        return {term.name: term for term in self.terms}[name]


def mixed_model(
    subjects: Sequence[str],
    score: Sequence[float],
    covariates: Mapping[str, Sequence[float]],
    *,
    slopes_differ: bool = False,
) -> MixedModel | None:
    """Return score (n) as intercept + sum of slopes times covariates (n each) + the subject's level + what is left.

    With `slopes_differ` each subject also has its own slope on the first covariate. Without it the interval of that
    slope is too narrow where subjects use more or less of the scale. Intervals are then t intervals, with as many
    degrees of freedom as subjects less one for terms that differ between subjects, and for the others as many as a fit
    to each subject alone would leave; without it they are Wald's.

    Carry-over and drift enter as covariates: the index scored before, and the trial's place in its block. None where
    there are fewer than two subjects, a covariate does not vary, or covariates determine each other.
    """
    # Slow to load, and only studies need it.
    library: Any = importlib.import_module("statsmodels.regression.mixed_linear_model")
    names = [INTERCEPT, *covariates]
    columns = np.column_stack([np.ones(len(score)), *covariates.values()])
    count = len(set(subjects))
    if count < 2 or len(score) <= len(names) + count or np.linalg.matrix_rank(columns) < len(names):
        return None
    scale = np.abs(columns).max(axis=0)  # covariates in any unit are fitted alike well
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of fits at the boundary; `singular` tells
        varying = columns[:, : 2 if slopes_differ else 1] / scale[: 2 if slopes_differ else 1]
        model = library.MixedLM(
            np.array(score, np.float64), columns / scale, groups=np.array(subjects), exog_re=varying
        )
        fit = model.fit(reml=True, method=["lbfgs", "powell"])
    among = np.asarray(fit.cov_re, np.float64)
    within = float(np.sqrt(fit.scale))
    spread = np.sqrt(np.maximum(np.diag(among), 0.0)) / scale[: len(among)]
    scaled: Array = columns / scale
    information: Array = scaled.T @ np.linalg.solve(_covariance(subjects, varying, among, within), scaled)
    errors = np.sqrt(np.diag(np.linalg.inv(information))) / scale
    estimates = np.asarray(fit.fe_params, np.float64) / scale
    dof = max(len(score) - len(names) - (count - 1) * len(among), 1)
    terms = tuple(
        _term(name, b, e, dof if i >= len(among) else count - 1) if slopes_differ else _term(name, b, e, None)
        for i, (name, b, e) in enumerate(zip(names, estimates.tolist(), errors.tolist(), strict=True))
    )
    between = float(spread[0])
    slope_sd = float(spread[1]) if slopes_differ else None
    return MixedModel(terms, between, within, len(score), count, slope_sd, between < 0.02 * within)


def _term(name: str, estimate: float, error: float, dof: int | None) -> Term:
    """Return a fixed effect with a t interval of `dof` degrees of freedom, Wald's where None."""
    if dof is None:
        half, p = float(stats.norm.ppf((1 + CONFIDENCE) / 2)), math.erfc(abs(estimate / error) / math.sqrt(2.0))
    else:
        half, p = float(stats.t.ppf((1 + CONFIDENCE) / 2, dof)), 2.0 * float(stats.t.sf(abs(estimate / error), dof))
    return Term(name, estimate, estimate - half * error, estimate + half * error, p)


def _covariance(subjects: Sequence[str], varying: Array, among: Array, within: float) -> Array:
    """Return the covariance (n, n) of scores whose fixed part is known.

    `varying` (n, k) are the columns whose coefficients differ between subjects, with covariance `among` (k, k).
    """
    codes = np.array(subjects)
    same = codes[:, None] == codes[None, :]
    return within**2 * np.eye(len(codes)) + (varying @ among @ varying.T) * same
