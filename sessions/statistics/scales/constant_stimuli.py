"""From comparisons with a standard to psychometric functions, by the friction of the subject's own strokes."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sessions.statistics.scales.psychometric import Level, Psychometric, psychometric


@dataclass(frozen=True, slots=True)
class Comparison:
    """One answer: whether a surface was judged to have more than the standard."""

    session: str
    standard: int  # index of the surface, as the next
    comparison: int
    second: bool  # the comparison was stroked after the standard
    chosen: bool  # the comparison was judged to have more


def comparison(session: str, standard: int, pair: tuple[int, int], choice: str) -> Comparison:
    """Return the answer to a pair of indices, in the order they were stroked, where "first" or "second" was chosen."""
    first, second = pair
    after = first == standard
    return Comparison(session, standard, second if after else first, after, choice == ("second" if after else "first"))


def function_of(answers: Sequence[Comparison], friction: Mapping[tuple[str, int], Sequence[float]]) -> Psychometric:
    """Return the psychometric function of one subject.

    `friction` holds the µ of each stroke by session and index; a surface's is their geometric mean. Answers count where
    both surfaces have one. Answers of one session to one surface in one order make a level.
    """
    log_mu = {key: float(np.mean(np.log(values))) for key, values in friction.items() if values}
    counted = [
        one for one in answers if (one.session, one.comparison) in log_mu and (one.session, one.standard) in log_mu
    ]
    if answers and not counted:
        return Psychometric(0, reason="no friction was measured of the standard and of what it was compared with")
    met = Counter((one.session, one.standard, one.comparison, one.second) for one in counted)
    chosen = Counter((one.session, one.standard, one.comparison, one.second) for one in counted if one.chosen)
    return psychometric(
        [
            Level(log_mu[session, index] - log_mu[session, standard], chosen[key], count, 1 if second else -1)
            for key, count in sorted(met.items())
            for session, standard, index, second in [key]
        ]
    )
