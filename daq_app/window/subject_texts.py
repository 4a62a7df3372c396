"""What the program itself says to the subject, in English: the texts that are translated. No Qt."""

from collections.abc import Callable
from enum import StrEnum

Translate = Callable[[str], str]  # an English text -> that in the subject's language


class SubjectText(StrEnum):
    """Every text of the subject's page that no protocol gives. Words in braces are put in."""

    WELCOME = "Welcome"
    BEGINS = "The experimenter will begin in a moment."
    HANDS_OFF = "Keep your fingers off the surface."
    WAIT = "Please wait"
    THANKS = "Thank you"
    REST_HAND = "You can rest your hand now."
    LIFT = "Please lift your finger off the surface."
    REST = "Rest"
    RESTING = "Rest your hand. The experimenter will go on with you."
    PAUSE = "Pause"
    GOES_ON = "The experimenter will go on in a moment."
    STROKE = "Stroke the surface once"
    STROKES = "Stroke the surface up to {number} times"
    PRACTICE = "This one is for practice."
    COUNT = "Surface {number} of {count}."
    SAMPLE = "Sample {code}."
    JUDGE = "Judge the surface"
    NUMBER = "Give a number above 0, on your own scale."
    WHICH = "Which one?"
    NEXT = "Next"
    FIRST = "The first"
    SECOND = "The second"
    OFFLINE = "No connection. Your answer is kept on this device."
    # What a screen reader tells:
    LINE = "Line from {low} to {high}"
    UNANSWERED = "No answer yet. The arrow keys move the mark."
    ANSWERED = "Answer at {score} of 100. The arrow keys move the mark."
    OWN_NUMBER = "Your number, above 0"
    OF_TWO = "Which of the two: 1 for the first, 2 for the second"
    PRESSING = "How hard you press"


def usual_question(descriptor: str) -> str:
    """Return what is asked in English where a block has no question."""
    return f"Judge the {descriptor} of the surface"
