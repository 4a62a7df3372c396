"""The comparison that a subject's answers so far ask for next: QUEST+ (Watson 2017, J. Vis. 17(3), 10).

P(comparison chosen) = lapse / 2 + (1 - lapse) Φ((i - PSE) / spread), where i is the stimulus's index. Possible, and
equally likely at first, are PSEs within the indices, spreads between a fifth of their mean step and their range, both
senses and two shares of lapses. Next comes the comparison that leaves the least entropy of these, as far as can be
expected. It depends on candidates and answers alone: a session that is resumed goes on with the same.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from sessions.plan.plan import Block, SessionPlan, Stimulus

Array = NDArray[np.float64]

_PSES, _SPREADS = 41, 15  # of the grid: steps of a fortieth of the indices' range, and of a third of a spread
_LAPSES = (0.0, 0.05)
_SAME = 1e-9  # of entropy: below it two comparisons are alike on any processor, and the first is taken


def next_comparison(candidates: Sequence[Stimulus], answers: Sequence[tuple[Stimulus, bool]]) -> Stimulus:
    """Return which of the candidates is compared next, from answers: what was compared, and whether it was chosen."""
    chance = _chances(tuple(one.known_index for one in candidates))
    belief = np.zeros(chance.shape[0])
    for compared, choice in answers:
        p = chance[:, candidates.index(compared)]
        belief += np.log(p if choice else 1.0 - p)
    weight = np.exp(belief - belief.max())
    return candidates[int(np.argmin(np.round(_expected_entropy(weight / weight.sum(), chance) / _SAME)))]


def with_comparison(plan: SessionPlan, number: int, answers: Sequence[tuple[Stimulus, bool]]) -> SessionPlan:
    """Return the plan in which the pair that begins with a trial compares what the answers of its block ask for.

    The same plan where the trial begins no pair of an adaptive block.
    """
    block = next(one for one in plan.blocks if any(trial.number == number for trial in one.trials))
    if not block.candidates or number not in {trial.compared_with for trial in block.trials}:
        return plan
    stimulus = next_comparison(block.candidates, answers)
    pair = {number, number + 1}
    trials = tuple(
        replace(trial, stimulus=stimulus) if trial.number in pair and not trial.standard else trial
        for trial in block.trials
    )
    return _with_block(plan, replace(block, trials=trials))


def with_mounted(plan: SessionPlan, codes: Mapping[int, str]) -> SessionPlan:
    """Return the plan with the stimuli that were mounted in trials of adaptive blocks; `codes` go by trial number."""
    for block in plan.blocks:
        by_code = {one.code: one for one in block.candidates}
        trials = tuple(
            replace(trial, stimulus=by_code.get(codes.get(trial.number, ""), trial.stimulus)) for trial in block.trials
        )
        plan = _with_block(plan, replace(block, trials=trials)) if by_code else plan
    return plan


def _with_block(plan: SessionPlan, block: Block) -> SessionPlan:
    return replace(plan, blocks=tuple(block if one.name == block.name else one for one in plan.blocks))


@cache
def _chances(indices: tuple[int, ...]) -> Array:
    """Return the chance of each possible subject to choose each of k comparisons (s, k), kept off 0 and 1."""
    reach = float(max(indices) - min(indices))
    step = reach / (len(indices) - 1)
    pses = np.linspace(float(min(indices)), float(max(indices)), _PSES)
    spreads = np.geomspace(step / 5.0, reach, _SPREADS)
    return np.array(
        [
            [lapse / 2.0 + (1.0 - lapse) * _normal(sense * (i - pse) / spread) for i in indices]
            for pse, spread, sense, lapse in product(pses, spreads, (1.0, -1.0), _LAPSES)
        ]
    ).clip(1e-6, 1.0 - 1e-6)


def _normal(z: float) -> float:
    return 0.5 * math.erfc(-z / math.sqrt(2.0))


def _expected_entropy(weight: Array, chance: Array) -> Array:
    """Return the entropy of what is possible that is left after an answer to each comparison, on average [nat]."""
    entropy_left = np.zeros(chance.shape[1])
    for p in (chance, 1.0 - chance):
        joint = weight[:, None] * p
        likely = joint.sum(axis=0)
        entropy_left -= (joint * np.log(np.maximum(joint / likely, 1e-300))).sum(axis=0)
    return entropy_left
