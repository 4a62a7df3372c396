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


@dataclass(frozen=True, slots=True)
class Term:
    """One fixed effect with its 95 % Wald interval."""

    name: str
    estimate: float
    low: float
    high: float
    p: float  # two-sided, normal


@dataclass(frozen=True, slots=True)
class MixedModel:
    """A linear mixed model with a random intercept for each subject, fitted by restricted maximum likelihood."""

    terms: tuple[Term, ...]
    between_sd: float  # of the subjects' levels
    within_sd: float  # of what is left
    n: int
    subjects: int
    singular: bool  # the subjects' levels do not differ beyond what is left: between_sd is 0 or nearly

    def term(self, name: str) -> Term:
        """Return one fixed effect. Raises KeyError for one that was not in the model."""
        return {term.name: term for term in self.terms}[name]


def mixed_model(
    subjects: Sequence[str], score: Sequence[float], covariates: Mapping[str, Sequence[float]]
) -> MixedModel | None:
    """Return score (n) as intercept + sum of slopes times covariates (n each) + the subject's level + what is left.

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
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of fits at the boundary; `singular` tells
        model = library.MixedLM(np.array(score, np.float64), columns, groups=np.array(subjects))
        fit = model.fit(reml=True, method=["lbfgs", "powell"])
    between, within = float(np.sqrt(max(fit.cov_re[0, 0], 0.0))), float(np.sqrt(fit.scale))
    half = float(stats.norm.ppf((1 + CONFIDENCE) / 2))
    information = columns.T @ np.linalg.solve(_covariance(subjects, between, within), columns)
    errors = np.sqrt(np.diag(np.linalg.inv(information)))
    estimates: list[float] = np.asarray(fit.fe_params, np.float64).tolist()
    terms = tuple(
        Term(name, b, b - half * e, b + half * e, math.erfc(abs(b / e) / math.sqrt(2.0)))
        for name, b, e in zip(names, estimates, errors.tolist(), strict=True)
    )
    return MixedModel(terms, between, within, len(score), count, between < 0.02 * within)


def _covariance(subjects: Sequence[str], between: float, within: float) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return the covariance (n, n) of scores whose fixed part is known."""
    codes = np.array(subjects)
    return within**2 * np.eye(len(codes)) + between**2 * (codes[:, None] == codes[None, :])
