"""The score as a straight line of the predicted energy, subjects differing in level, with what the order adds."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special

from sessions.statistics.reml import Fit, fits_exactly, restricted_fit
from sessions.statistics.scores import t_quantile
from sessions.statistics.variance_components import Spreads, spreads

INTERCEPT = "intercept"


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
    middle: float  # mean of the first covariate, at which the intercept and the subjects' levels are told
    between_sd: float  # of the subjects' levels
    within_sd: float  # of what is left
    n: int
    subjects: int
    slope_sd: float | None  # of the subjects' slopes on the first covariate; None where one slope was fitted for all
    singular: bool  # subjects differ in fewer ways than were fitted: a spread is 0, or level and slope go as one
    spreads: Spreads | None  # the same standard deviations by least squares, with intervals; None where too few say so

    def term(self, name: str) -> Term:
        """Return one fixed effect. Raises KeyError for one that was not in the model."""
        return {term.name: term for term in self.terms}[name]


def mixed_model(
    subjects: Sequence[str],
    score: Sequence[float],
    covariates: Mapping[str, Sequence[float]],
    *,
    slopes_differ: bool = False,
) -> MixedModel | str:
    """Return score (n) as intercept + sum of slopes times covariates (n each) + the subject's level + what is left.

    With `slopes_differ` each subject also has its own slope on the first covariate. Without it the interval of that
    slope is too narrow where subjects use more or less of the scale. Intervals are then t intervals, with as many
    degrees of freedom as subjects less one for the level, as subjects in whom the covariate varies less one for the
    slope, and for the others as many as a fit to each subject alone would leave; without it they are Wald's. The first
    covariate counts from its mean, so that an offset of it changes nothing.

    Carry-over and drift enter as covariates: the index scored before, and the trial's place in its block. Where
    nothing can be said a sentence says why.
    """
    names = [INTERCEPT, *covariates]
    columns = np.column_stack([np.ones(len(score)), *covariates.values()])
    count = len(set(subjects))
    if count < 2 or len(score) <= len(names) + count:
        return f"{len(score)} scores of {count} subjects are too few for {len(names)} terms and a level of each subject"
    middle = float(columns[:, 1].mean())
    columns[:, 1] -= middle
    scale = np.abs(columns).max(axis=0)  # covariates in any unit are fitted alike well
    if not scale.all() or np.linalg.matrix_rank(columns / scale) < len(names):
        return "a term does not vary, or others determine it"
    varies = sum(float(np.ptp(columns[np.array(subjects) == one, 1])) > 0.0 for one in set(subjects))
    if slopes_differ and varies < 2:
        return f"{names[1]} varies between the scores of {varies} of {count} subjects, and it takes two"
    own = 2 if slopes_differ else 1
    levels = np.array(subjects)[:, None] == np.unique(np.array(subjects))[None, :]
    if fits_exactly(np.hstack([levels, columns[:, 1:] / scale[1:]]), np.array(score, np.float64)):
        return "all scores lie on the line but for round-off: there is nothing to tell an error from"
    fit: Fit = restricted_fit(np.array(score, np.float64), columns / scale, np.array(subjects), own)
    spread = np.sqrt(np.diag(fit.among)) / scale[:own]
    rest = max(len(score) - len(names) - (count - 1) * own, 1)
    free = [count - 1, varies - 1, *([rest] * len(names))] if slopes_differ else [None] * len(names)
    estimates = zip(names, (fit.estimates / scale).tolist(), (fit.errors / scale).tolist(), free, strict=False)
    terms = tuple(_term(name, estimate, error, dof) for name, estimate, error, dof in estimates)
    first, *common = covariates.values()
    differ = spreads(subjects, score, common, first) if slopes_differ else spreads(subjects, score, [first, *common])
    return MixedModel(
        terms=terms,
        middle=middle,
        between_sd=float(spread[0]),
        within_sd=fit.within,
        n=len(score),
        subjects=count,
        slope_sd=float(spread[1]) if slopes_differ else None,
        singular=fit.singular,
        spreads=differ,
    )


def _term(name: str, estimate: float, error: float, dof: int | None) -> Term:
    """Return a fixed effect with a t interval of `dof` degrees of freedom, Wald's where None."""
    size = abs(estimate / error)
    if dof is None:
        half, p = t_quantile(math.inf), math.erfc(size / math.sqrt(2.0))
    else:
        half, p = t_quantile(dof), 2.0 * float(special.stdtr(dof, -size))
    return Term(name, estimate, estimate - half * error, estimate + half * error, p)
