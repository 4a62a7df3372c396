"""Pre-evaluation: does the maker's grading of the stimuli hold for this subject."""

from collections import defaultdict
from collections.abc import Iterable
from itertools import pairwise

from sessions.recording.log import TrialRecord


def grading(records: Iterable[TrialRecord]) -> dict[str, str]:
    """Return a sentence for each descriptor that was pre-evaluated; none where nothing was.

    The grading holds where the answers rise with the maker's number throughout. Raises Blinded while it is sealed.
    """
    judgements: defaultdict[str, dict[int, float]] = defaultdict(dict)
    for record in records:
        answer = record.number if record.score is None else record.score
        if record.trial.phase == "pre-evaluation" and answer is not None:
            stimulus = record.trial.stimulus
            judgements[stimulus.descriptor][stimulus.known_index] = answer
    return {descriptor: _sentence(answers) for descriptor, answers in judgements.items()}


def _sentence(answers: dict[int, float]) -> str:
    """Say whether answers rise with the index.

    >>> _sentence({0: 3.0, 55: 62.0, 75: 58.0})
    'the grading does not hold: 75 was judged no higher than 55 (0: 3, 55: 62, 75: 58)'
    """
    listed = ", ".join(f"{index}: {answer:g}" for index, answer in sorted(answers.items()))
    if len(answers) < 2:
        return f"too few answers to see a grading ({listed})"
    wrong = [f"{b} was judged no higher than {a}" for a, b in pairwise(sorted(answers)) if answers[b] <= answers[a]]
    return f"{'the grading does not hold: ' + ', '.join(wrong) if wrong else 'the grading holds'} ({listed})"
