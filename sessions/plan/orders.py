"""Orders and labels of stimuli, reproducible from a seed, and the next comparison of an adaptive block.

The comparison is chosen by QUEST+ (Watson 2017, J. Vis. 17(3), 10): P(comparison chosen) = lapse / 2 + (1 - lapse) Φ((i
- PSE) / spread), where i is the stimulus's index. The prior is uniform over PSEs within the indices, spreads between a
fifth of their mean step and their range, both senses and two lapse rates. The next comparison minimises the expected
entropy of the posterior. It depends on candidates and answers alone, so a resumed session continues with the same
comparison.
"""

import hashlib
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from itertools import combinations, product
from typing import TypeVar

import numpy as np

from drivers.arrays import Array
from sessions.plan.plan import SessionPlan, Stimulus, Trial

LETTERS = "BCDFGHJKLMNPQRSTVWXZ"  # no vowels: no label spells a word
_DRAWS = 10_000  # tried for an order that meets the constraints

Item = TypeVar("Item", int, str)


def shuffle(items: Sequence[Item], seed: int, name: str) -> tuple[Item, ...]:
    """Return the items in a random order determined by `seed` and `name`.

    The rule: sort by the SHA-256 digest of the UTF-8 text "seed/name/item", each a decimal number or the name itself.
    Every order is equally likely over seeds. Items must differ.

    >>> shuffle((0, 20, 50, 80, 100), 1, "stickiness")
    (80, 100, 20, 50, 0)
    """
    return tuple(sorted(items, key=lambda item: _digest(f"{seed}/{name}/{item}")))


def draw(
    items: Sequence[Item], seed: int, name: str, meets: Callable[[Sequence[Item]], bool]
) -> tuple[Item, ...] | None:
    """Return the first random order that `meets` accepts; None where it rejects all of `_DRAWS` orders.

    The orders are those of `shuffle` for `name`, "name~1" and so on; all accepted orders are equally likely.
    """
    orders = (shuffle(items, seed, f"{name}~{draw}" if draw else name) for draw in range(_DRAWS))
    return next(filter(meets, orders), None)


def williams(count: int) -> tuple[tuple[int, ...], ...]:
    """Return the rows of a Williams design, in which each of 0 to `count` - 1 follows every other equally often.

    Each item also has each position equally often. An even count gives `count` rows (each item follows every other
    once), an odd one twice as many (twice): the second square is the first one reversed. E. J. Williams, Australian
    Journal of Scientific Research A 2 (1949) 149; first row 0, 1, n-1, 2, n-2, ...

    >>> williams(4)
    ((0, 1, 3, 2), (1, 2, 0, 3), (2, 3, 1, 0), (3, 0, 2, 1))
    """
    zigzag = [0, *((step + 1) // 2 if step % 2 else count - step // 2 for step in range(1, count))]
    square = tuple(tuple((item + shift) % count for item in zigzag) for shift in range(count))
    return square if count % 2 == 0 or count == 1 else (*square, *(row[::-1] for row in square))


def pairs(items: Sequence[Item], seed: int, name: str) -> tuple[tuple[Item, Item], ...]:
    """Return every pair of items once, in a random order, each item first as often as second (or nearly).

    The items are placed round a circle in the order of `shuffle` for "name/first". The first of two is the one from
    which the other is reached sooner clockwise (of two opposite items, the earlier one). Pairs come in the order of
    `shuffle` for `name` and the texts "first,second".
    """
    circle = shuffle(items, seed, f"{name}/first")
    count = len(circle)
    orders = {
        f"{first},{second}": (first, second)
        for i, j in combinations(range(count), 2)
        for first, second in [(circle[i], circle[j]) if 2 * (j - i) <= count else (circle[j], circle[i])]
    }
    return tuple(orders[key] for key in shuffle(tuple(orders), seed, name))


def pairs_with(
    standard: Item, items: Sequence[Item], seed: int, name: str, repetition: int
) -> tuple[tuple[Item, Item], ...]:
    """Pair each item once with the standard, in a random order; over two repetitions it is first once.

    Repetitions count from 1. Repetition 2 k - 1 has those items first that `shuffle` puts into the first half for
    "name/first/k"; repetition 2 k has the others first. Pairs come in the order of `shuffle` for `name` in repetition
    1, and for "name#repetition" after it.
    """
    leaders = shuffle(items, seed, f"{name}/first/{(repetition + 1) // 2}")[: len(items) // 2]
    order = shuffle(items, seed, name if repetition == 1 else f"{name}#{repetition}")
    return tuple((item, standard) if (item in leaders) == (repetition % 2 == 1) else (standard, item) for item in order)


def opaque_codes(count: int, seed: int) -> tuple[str, ...]:
    """Return `count` different labels of a letter and two digits, which reveal nothing about the stimuli.

    The rule: from the SHA-256 digests of "seed/label/0", "seed/label/1", ... as whole numbers, the letter is the
    remainder by 20 and the digits the remainder by 100 of the quotient; repeated labels are left out.
    Raises ValueError for more than 2000 labels.

    >>> opaque_codes(3, 1)
    ('X87', 'D86', 'K50')
    """
    if count > len(LETTERS) * 100:
        raise ValueError(f"{count} labels were asked for; a letter and two digits give at most {len(LETTERS) * 100}")
    codes: dict[str, None] = {}
    attempt = 0
    while len(codes) < count:
        number = int.from_bytes(_digest(f"{seed}/label/{attempt}"), "big")
        quotient, letter = divmod(number, len(LETTERS))
        codes[f"{LETTERS[letter]}{quotient % 100:02d}"] = None
        attempt += 1
    return tuple(codes)


def _digest(text: str) -> bytes:
    return hashlib.sha256(text.encode()).digest()


_PSES, _SPREADS = 41, 15  # of the grid: steps of a fortieth of the indices' range, and of a third of a spread
_LAPSES = (0.0, 0.05)
_ENTROPY_RESOLUTION = 1e-9  # of entropy: smaller differences depend on the processor; the first comparison is taken


def next_comparison(candidates: Sequence[Stimulus], answers: Sequence[tuple[Stimulus, bool]]) -> Stimulus:
    """Return the candidate to compare next; an answer is a stimulus compared so far, and whether it was chosen."""
    chance = _chances(tuple(candidate.known_index for candidate in candidates))
    belief = np.zeros(chance.shape[0])
    for comparison, choice in answers:
        choice_chance = chance[:, candidates.index(comparison)]
        belief += np.log(choice_chance if choice else 1.0 - choice_chance)
    weight = np.exp(belief - belief.max())
    return candidates[int(np.argmin(np.round(_expected_entropy(weight / weight.sum(), chance) / _ENTROPY_RESOLUTION)))]


def with_comparison(plan: SessionPlan, number: int, answers: Sequence[tuple[Stimulus, bool]]) -> SessionPlan:
    """Return the plan with the next comparison in the adaptive pair that begins with trial `number`, if one does."""
    block = next(block for block in plan.blocks if any(trial.number == number for trial in block.trials))
    if not block.candidates or number not in {trial.compared_with for trial in block.trials}:
        return plan
    stimulus = next_comparison(block.candidates, answers)

    def choose(trial: Trial) -> Trial:
        in_pair = trial.number in (number, number + 1) and not trial.standard
        return replace(trial, stimulus=stimulus) if in_pair else trial

    return plan.with_trials(choose)


def with_mounted_stimuli(plan: SessionPlan, codes: Mapping[int | None, str]) -> SessionPlan:
    """Return the plan with the stimuli that were mounted in trials of adaptive blocks; `codes` are by trial number."""
    stimuli = {(block.name, stimulus.code): stimulus for block in plan.blocks for stimulus in block.candidates}

    def mount(trial: Trial) -> Trial:
        return replace(trial, stimulus=stimuli.get((trial.block, codes.get(trial.number, "")), trial.stimulus))

    return plan.with_trials(mount) if stimuli else plan


@cache
def _chances(indices: tuple[int, ...]) -> Array:
    """Return the probability that each model subject chooses each of k comparisons (s, k), clipped off 0 and 1."""
    reach = float(max(indices) - min(indices))
    step = reach / (len(indices) - 1)
    pses = np.linspace(float(min(indices)), float(max(indices)), _PSES)
    spreads, root = np.geomspace(step / 5.0, reach, _SPREADS), math.sqrt(2.0)
    return np.array(
        [
            [lapse / 2.0 + (1.0 - lapse) / 2.0 * math.erfc(sense * (pse - i) / spread / root) for i in indices]
            for pse, spread, sense, lapse in product(pses, spreads, (1.0, -1.0), _LAPSES)
        ]
    ).clip(1e-6, 1.0 - 1e-6)


def _expected_entropy(weight: Array, chance: Array) -> Array:
    """Return the expected entropy of the posterior after an answer to each comparison [nat]."""
    entropy_left = np.zeros(chance.shape[1])
    for answer_chance in (chance, 1.0 - chance):
        joint = weight[:, None] * answer_chance
        likely = joint.sum(axis=0)
        entropy_left -= (joint * np.log(np.maximum(joint / likely, 1e-300))).sum(axis=0)
    return entropy_left
