"""The subject's side: texts and pages, the preview, the answer being given, and the owner of a key."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from enum import StrEnum
from math import isfinite
from typing import Literal

from daq_app.recorder.messages import SessionBegun
from daq_app.window.course_state import SessionState, begin_session, session_after
from daq_app.window.new_session import PILOT, Bench, Refusal, SessionForm, check_form
from daq_app.wording import SUBJECT, tr, tr_noop, translations
from sessions.plan.plan import Frame, Hand, SessionPlan
from sessions.plan.protocols.protocol import ENGLISH
from sessions.run import machine, states, steps
from sessions.run.steps import MagnitudeEstimate, PairedChoice, Scored

Translate = Callable[[str], str]  # English text -> text in the subject's language
Kind = Literal["read", "line", "number", "choice"]
Device = Literal["mouse", "touch", "pen", "keyboard"]
Which = Literal["first", "second"]
Owner = Literal["text", "answer", "course"]

# Of a preview: answers, events, and names of its pages.
EXAMPLES = {"number": steps.MagnitudeEstimate(1.0), "choice": steps.PairedChoice("first")}
_ALWAYS: Mapping[type, steps.Event] = {  # event that advances a session from a state, for any trial
    states.Idle: steps.Begin(), states.Taring: steps.Zeroed(), states.Stroking: steps.FingerLifted(),
    states.Settling: steps.FingerLifted(), states.Resting: steps.RestOver(),
}  # fmt: skip
OF_A_BLOCK = {"ready": tr_noop("stroke"), "scoring": tr_noop("answer")}  # phases whose page differs between blocks
_NAMES = {
    "mounting": tr_noop("the surface is changed"), "settling": tr_noop("the finger is still on"),
    "resting": tr_noop("rest"), "paused": tr_noop("pause"), "closing": tr_noop("end"),
}  # fmt: skip

# Of an answer on the line, and of keys:
LENGTH = 100.0  # of the line [mm]
_MIDDLE = 50.0  # position of the mark after the first press of any key
STEP = 1.0  # of the mark by an arrow key ...
LEAP = 10.0  # ... and by Page Up or Page Down
PAUSE = 1.0  # key presses further apart count as two answers [s]
DIGITS = 1  # of a score: the resolution of the mark
GIVES = frozenset({"Enter"})  # the present answer; Space is the experimenter's
_PLACES = frozenset({"Left", "Right", "Up", "Down", "PgUp", "PgDown", "Home", "End"})  # the mark on the line
TYPES = frozenset({*"0123456789.,", "Backspace", "Del"})  # a number
CHOOSES = frozenset({"0", "1", "2", "Left", "Right"})  # one of two; 0, next to them on a keypad, does nothing
ANSWER_KEYS: dict[Kind, frozenset[str]] = {
    "read": frozenset(), "line": _PLACES | GIVES, "number": TYPES | GIVES, "choice": CHOOSES | GIVES,
}  # fmt: skip


class SubjectText(StrEnum):
    """The texts of the subject's page that do not come from a protocol. Words in braces are replaced."""

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
    TWO_MEANINGS = "Do you mean {whole} or {fraction}? Please type it like that."
    WHICH = "Which one?"
    NEXT = "Next"
    FIRST = "The first"
    SECOND = "The second"
    OFFLINE = "No connection. Your answer is kept on this device."
    # Texts for a screen reader:
    LINE = "Line from {low} to {high}"
    UNANSWERED = "No answer yet. The arrow keys move the mark."
    ANSWERED = "Answer at {score} of 100. The arrow keys move the mark."
    OWN_NUMBER = "Your number, above 0"
    OF_TWO = "Which of the two: 1 for the first, 2 for the second"
    PRESSING = "How hard you press"


_PLAIN = {  # title and text of the pages without a task
    "idle": (SubjectText.WELCOME, SubjectText.BEGINS), "settling": (SubjectText.THANKS, SubjectText.LIFT),
    "resting": (SubjectText.REST, SubjectText.RESTING), "paused": (SubjectText.PAUSE, SubjectText.GOES_ON),
    "resuming": (SubjectText.PAUSE, SubjectText.GOES_ON), "ended": (SubjectText.THANKS, SubjectText.REST_HAND),
}  # fmt: skip


def usual_question(descriptor: str) -> str:
    """Return the English question of a block that has none."""
    return f"Judge the {descriptor} of the surface"


def translator(language: str) -> Translate:
    """Return a function from English texts to a language; a text without a translation stays English."""
    texts = translations(SUBJECT, language)
    return lambda text: texts.get(text, text)


@dataclass(frozen=True, slots=True)
class SubjectView:
    """One page for the subject."""

    kind: Kind  # reading, or a way to answer
    title: str
    text: str = ""
    ends: tuple[str, str] = ("", "")  # of the line
    ticks: int = 0  # on the line, between its ends
    key: tuple[int, int] = (0, 0)  # trial and take: a new key begins with an empty answer
    hand: Hand = "right"  # the answering one, on whose side Next is
    language: str = ENGLISH
    force: bool = False  # show the normal force; the tangential force would reveal the surface

    @property
    def asks(self) -> bool:
        """Say whether the page waits for an answer."""
        return self.kind != "read"


def subject_view(session: SessionState | None, translate: Translate = str, language: str = ENGLISH) -> SubjectView:
    """Return the subject's present page, translated from English by `translate`.

    `language` is the code of the chosen language while there is no session, which has its own.
    """
    if session is None:
        return SubjectView("read", translate(SubjectText.WELCOME), translate(SubjectText.BEGINS), language=language)
    return replace(_Page(session, translate).view(), language=session.plan.language)


def mirror_view(session: SessionState, translate: Translate = str) -> SubjectView:
    """Return the experimenter's view of the subject's page, without elements that the protocol hides from them.

    The bar of the force is left out too: in a still picture it would show no force.
    """
    plan = session.plan
    hidden = {"forces", *({"trial count"} - set(plan.shown.experimenter))}
    visibility = replace(plan.shown, subject=tuple(element for element in plan.shown.subject if element not in hidden))
    return subject_view(replace(session, plan=replace(plan, shown=visibility)), translate)


@dataclass(frozen=True, slots=True)
class _Page:
    session: SessionState
    translate: Translate

    def view(self) -> SubjectView:
        session, visible = self.session, self.session.plan.shown.subject
        phase = "ended" if session.phase == "closing" else session.phase
        match phase:
            case "mounting" | "taring":
                return self._read(self.translate(SubjectText.WAIT), self._notice(self.translate(SubjectText.HANDS_OFF)))
            case "ready" | "stroking":
                force = session.plan.forces and "forces" in visible
                instruction = session.block.instruction if session.block and "instruction" in visible else ""
                return replace(self._read(self._stroke(), self._notice(instruction)), force=force)
            case "scoring":
                return self._question()
            case _:
                title, text = _PLAIN["paused" if session.resumable else phase]
                return self._read(self.translate(title), self.translate(text))

    def _read(self, title: str, text: str = "") -> SubjectView:
        return SubjectView("read", title, text, hand=self.session.plan.answering_hand or "right")

    def _stroke(self) -> str:
        trial = self.session.trial_state(self.session.trial)
        limit = 1 if trial is None else self.session.plan.stroke_limit(trial.trial)
        return self.translate(SubjectText.STROKE if limit == 1 else SubjectText.STROKES).format(number=limit)

    def _notice(self, to_do: str) -> str:
        """Return the instruction for the finger, and the progress that the protocol shows the subject."""
        session = self.session
        visible, trial = session.plan.shown.subject, session.trial_state(session.trial)
        sentences = [to_do]
        if session.block is not None and session.block.phase == "practice":
            sentences.insert(0, self.translate(SubjectText.PRACTICE))
        if trial is not None and "trial count" in visible:
            number, count = trial.trial.number, len(session.trials)
            sentences.append(self.translate(SubjectText.COUNT).format(number=number, count=count))
        if trial is not None and "code" in visible:
            sentences.append(self.translate(SubjectText.SAMPLE).format(code=trial.trial.stimulus.code))
        return " ".join(sentence for sentence in sentences if sentence)

    def _question(self) -> SubjectView:
        trial, page = self.session.trial_state(self.session.trial), self._read(self.translate(SubjectText.WAIT))
        if trial is None:
            return page
        # A descriptor is a word in the protocol's own language.
        usual = usual_question(trial.trial.stimulus.descriptor)
        judge = usual if self.session.plan.language == ENGLISH else self.translate(SubjectText.JUDGE)
        page = replace(page, key=(trial.trial.number, trial.takes))
        match self.session.command:
            case steps.AskScore(_, end_labels, ticks, question):
                return replace(page, kind="line", title=question or judge, ends=end_labels, ticks=ticks)
            case steps.AskNumber(_, question):
                return replace(page, kind="number", title=question or judge, text=self.translate(SubjectText.NUMBER))
            case steps.AskChoice(_, _, question):
                return replace(page, kind="choice", title=question or self.translate(SubjectText.WHICH))
            case _:
                return self._read(page.title)


@dataclass(frozen=True, slots=True)
class PreviewPage:
    """One page and its name in a list."""

    name: str
    view: SubjectView


def preview(form: SessionForm, translate: Translate = str) -> tuple[PreviewPage, ...] | Refusal:
    """Return every page of the form's protocol in the form's language, each once, or the form's errors.

    The session's state machine runs through every trial, with the real pages; codes and orders are an example.
    """
    plan = _plan(form)
    return plan if isinstance(plan, Refusal) else tuple(_pages(plan, translate))


def first_question(form: SessionForm, translate: Translate = str) -> SubjectView | Refusal:
    """Return the first page of `preview` that asks a question, or the first of all, or the form's errors."""
    plan = _plan(form)
    if isinstance(plan, Refusal):
        return plan
    pages = _pages(plan, translate)
    first = next(pages).view
    return next((page.view for page in pages if page.view.asks), first)


def _plan(form: SessionForm) -> SessionPlan | Refusal:
    """Return an example plan of the form's protocol."""
    folder = form.folder if form.study.strip() else "."  # nothing is written
    plain = replace(
        form, subject=PILOT, folder=folder, seed="", height="", normal="", area="", simulated=False, pilot=True
    )
    session_plan = check_form(plain, Bench(connected=True, simulated=True, frame=Frame()), datetime.now(), 0)
    return session_plan if isinstance(session_plan, Refusal) else session_plan.plan


def _pages(plan: SessionPlan, translate: Translate) -> Iterator[PreviewPage]:
    """Yield the pages of a session in the order of their first appearance, the page of its end last."""
    yield PreviewPage(tr("before the session"), subject_view(None, translate, plan.language))
    pages: dict[str, SubjectView] = {}
    session: SessionState = begin_session(SessionBegun("", plan, "people", None, 0), 0.0)
    step = machine.start(plan)
    while not isinstance(step[0], states.Ended):
        state, commands = step
        for command in commands:
            session = session_after(session, command, 0.0)
        if isinstance(state, states.Settling):
            session = replace(session, phase="settling")
        if session.phase in OF_A_BLOCK or session.phase in _NAMES:
            name = _name(session)
            if name not in pages:
                pages[name] = replace(subject_view(session, translate), key=(len(pages) + 1, 1))
                if name != _NAMES["closing"]:
                    yield PreviewPage(tr(name), pages[name])
        step = machine.advance(state, _next_event(state))
    yield PreviewPage(tr(_NAMES["paused"]), subject_view(replace(session, phase="paused"), translate))
    thanks = SubjectView("read", translate(SubjectText.THANKS), language=plan.language)
    yield PreviewPage(tr("an answer was given"), thanks)
    yield PreviewPage(tr(_NAMES["closing"]), pages[_NAMES["closing"]])


def _name(session: SessionState) -> str:
    if session.phase in _NAMES or session.block is None:
        return _NAMES.get(session.phase, session.phase)
    return f"{session.block.name}: {tr(OF_A_BLOCK[session.phase])}"


def _next_event(state: states.State) -> steps.Event:
    match state:
        case states.Mounting(place):
            return steps.StimulusMounted(place.trial.stimulus.code)
        case states.Ready(place):
            return steps.ContactOnset() if place.plan.forces else steps.StrokeDone()
        case states.Scoring(place):
            return EXAMPLES.get(place.trial.answer, steps.Scored(50.0))
        case states.Settling(touching=False):
            return steps.Settled()
        case _:
            return _ALWAYS.get(type(state), steps.Finish())


@dataclass(frozen=True, slots=True)
class Answer:
    """The answer on the line so far; empty until the first touch."""

    positions: tuple[tuple[float, float], ...] = ()  # (session clock [s], 0 to 100)
    corrections: int = 0  # number of changes of the answer
    device: Device | None = None  # of the last position
    pressed: bool = False  # a finger or button is down

    @property
    def score(self) -> float | None:
        """Return the position of the mark; None before the first touch."""
        return round(self.positions[-1][1], DIGITS) if self.positions else None

    def press(self, time: float, position: float, device: Device) -> "Answer":
        """Return the answer after a touch or click on the line at `time` [s] and `position` [0 to 100]."""
        corrections = self.corrections + bool(self.positions)
        return replace(self._move(time, position, device), corrections=corrections, pressed=True)

    def drag(self, time: float, position: float, device: Device) -> "Answer":
        """Return the answer after a movement with finger or button down, which is still the same answer."""
        return self._move(time, position, device) if self.pressed else self

    def release(self) -> "Answer":
        """Return the answer after the release of finger or button."""
        return replace(self, pressed=False)

    def step(self, time: float, step: float) -> "Answer":
        """Return the answer after a key moved the mark by `step`; the first key puts the mark in the middle."""
        if not self.positions:
            return self._move(time, _MIDDLE, "keyboard")
        last, position = self.positions[-1]
        corrections = self.corrections + (time - last > PAUSE or self.device != "keyboard")
        return replace(self._move(time, position + step, "keyboard"), corrections=corrections)

    def judgement(self, hand: Hand | None) -> Scored:
        """Return the answer as the event that a session records."""
        first = self.positions[0][0] if self.positions else None
        return Scored(self.score, self.positions, first, self.corrections, hand, self.device)

    def _move(self, time: float, position: float, device: Device) -> "Answer":
        position = min(max(position, 0.0), 100.0)
        if self.positions and self.positions[-1][1] == position:
            return replace(self, device=device)
        return replace(self, positions=(*self.positions, (time, position)), device=device)


@dataclass(frozen=True, slots=True)
class Choice:
    """A number, or one of two, while it is given: its value, first touch and corrections."""

    value: float | Which | None = None
    first_touch: float | None = None  # [s, session clock]
    corrections: int = 0  # number of times that another value replaced one
    device: Device | None = None

    def choose(self, time: float, value: Which, device: Device) -> "Choice":
        """Return the answer after the choice of one of two at `time` [s]."""
        corrections = self.corrections + (self.value not in (None, value))
        return Choice(value, self._first(time), corrections, device)

    def type_number(self, time: float, number: float | None) -> "Choice":
        """Return the answer after the number in the field changed at `time` [s]; only numbers above 0 count.

        Intermediate values while a number is typed are not corrections.
        """
        value = number if number is not None and number > 0.0 and isfinite(number) else None
        return Choice(value, self._first(time), self.corrections, "keyboard")

    def _first(self, time: float) -> float:
        return time if self.first_touch is None else self.first_touch

    def judgement(self, hand: Hand | None) -> MagnitudeEstimate | PairedChoice:
        """Return the answer as the event that a session records."""
        if self.value in ("first", "second"):
            return PairedChoice(self.value, self.first_touch, self.corrections, hand, self.device)
        number = self.value if isinstance(self.value, float) else None
        return MagnitudeEstimate(number, self.first_touch, self.corrections, hand, self.device)


def owner(key: str, asks: Kind, *, typing: bool, from_subject: bool = False, by_keys: bool = False) -> Owner:
    """Return the owner of a key while the subject is asked for `asks`, independent of the window with the focus.

    While the experimenter types, keys belong to the text, even those that reached the subject's window. Keys that the
    text does not use are never answers. Where people answer `by_keys`, the key that gives an answer never does more.

    >>> owner("1", "choice", typing=False), owner("1", "choice", typing=True), owner("1", "line", typing=False)
    ('answer', 'text', 'course')
    >>> owner("Enter", "read", typing=False), owner("Enter", "read", typing=False, by_keys=True)
    ('course', 'answer')
    """
    answers = key in ANSWER_KEYS[asks] or (by_keys and key in GIVES)
    if typing and (from_subject or answers):
        return "text"
    return "answer" if answers else "course"
