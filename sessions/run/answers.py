"""What a subject may answer: on the line, with a free number, or by choosing one of two; and what is none of them."""

import math
from itertools import pairwise

from sessions.plan.plan import Answer
from sessions.run.steps import MagnitudeEstimate, PairedChoice, Scored

AnswerEvent = Scored | MagnitudeEstimate | PairedChoice

EVENTS: dict[Answer, type[AnswerEvent] | None] = {
    "line": Scored,
    "number": MagnitudeEstimate,
    "choice": PairedChoice,
    "none": None,
}
IN_WORDS: dict[type[AnswerEvent], str] = {Scored: "a score", MagnitudeEstimate: "a number", PairedChoice: "a choice"}


def problem(answer: AnswerEvent, expected: Answer) -> str | None:
    """Say in a sentence what is wrong with an answer where `expected` is due; None where nothing is.

    >>> problem(Scored(120.0), "line")
    'a score lies between 0 and 100; 120 does not'
    >>> problem(Scored(12.0), "number")
    'this trial asks for a number, not for a score'
    """
    expected_kind = EVENTS[expected]
    if expected_kind is None:
        return "this trial asks for no answer"
    if not isinstance(answer, expected_kind):
        return f"this trial asks for {IN_WORDS[expected_kind]}, not for {IN_WORDS[type(answer)]}"
    if answer.corrections is not None and answer.corrections < 0:
        return f"an answer is corrected a number of times; {answer.corrections} is none"
    match answer:
        case Scored(score) if score is not None and not 0 <= score <= 100:
            return f"a score lies between 0 and 100; {score:g} does not"
        case Scored(positions=positions) if not all(0 <= at <= 100 and math.isfinite(t) for t, at in positions):
            return "every position on the line has a time and lies between 0 and 100; one of these does not"
        case Scored(positions=positions) if any(after < before for (before, _), (after, _) in pairwise(positions)):
            return "positions on the line come in the order of time; these do not"
        case MagnitudeEstimate(number) if number is not None and not (number > 0 and math.isfinite(number)):
            return f"a number on a scale of one's own is above 0; {number:g} is not"
        case _:
            return None
