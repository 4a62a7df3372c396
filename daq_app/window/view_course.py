"""The experimenter's view of a session: the current step, the plan, its trials and their strokes."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from daq_app.recorder import messages as m
from daq_app.window.course_state import IN_A_TRIAL, PICTURE, Quality, SessionState, TrialState, redo_targets
from daq_app.window.state import BenchState, Message, NewSession
from daq_app.wording import aligned, quantity, tr, tr_noop
from sessions.plan.plan import PROXIMAL_TO_DISTAL, SessionPlan, Trial
from sessions.run import steps
from sessions.strokes.stroke import Stroke

NO_ANSWER: Mapping[type, steps.Event] = {  # of a subject who cannot decide
    steps.AskScore: steps.Scored(None),
    steps.AskNumber: steps.MagnitudeEstimate(None),
    steps.AskChoice: steps.PairedChoice(None),
}
_DIRECTIONS = {1: tr_noop("away from the subject"), -1: tr_noop("towards the subject")}
TileKind = Literal["done", "redone", "flawed", "current", "skipped", "coming"]
TILES: dict[TileKind, tuple[str, str]] = {  # a shape that identifies the state without colour, and the state in words
    "done": ("✓", tr_noop("done")),
    "redone": ("↻", tr_noop("done again")),
    "flawed": ("!", tr_noop("done, its stroke has a flaw")),
    "current": ("▶", tr_noop("in hand")),
    "skipped": ("–", tr_noop("skipped")),
    "coming": ("○", tr_noop("still to come")),
}
MEANS = ("normal_force", "tangential_force", "mu_dynamic", "speed")  # of a stroke, in the order of PICTURE
BEFORE_STROKE = ("mounting", "taring", "ready")  # phases in which a redo can be undone
NO_FORCES = tr_noop("Forces are not shown in this protocol.")


@dataclass(frozen=True, slots=True)
class Tile:
    """One trial: its shape and words identify its state without colour."""

    number: int
    code: str
    kind: TileKind

    @property
    def description(self) -> str:
        """Return the trial and its state for a screen reader.

        >>> Tile(3, "D86", "flawed").description
        'trial 3, D86: done, its stroke has a flaw'
        """
        return tr("trial {number}, {code}: {state}", number=self.number, code=self.code, state=tr(TILES[self.kind][1]))


@dataclass(frozen=True, slots=True)
class Inspection:
    """The displayed data of one trial, never live readings."""

    number: int
    heading: str
    verdict: str  # one line, or why there is none
    details: str  # every flaw in full, the worst first
    grade: Literal["none", "good", "doubtful", "refused"] = "none"
    cells: tuple[tuple[str, str], ...] = tuple((name, "–") for name in PICTURE)  # means over the steady window
    stroke: Stroke | None = None


@dataclass(frozen=True, slots=True)
class Button:
    """An action of the experimenter."""

    label: str
    key: str
    enabled: bool = True
    sends: Message | None = None  # None: it opens a part of the window, such as the line for a reason
    question: str = ""  # next to the line for a reason


@dataclass(frozen=True, slots=True)
class PlanRow:
    """A line of the plan: a block's heading, or a trial."""

    kind: Literal["block", "done", "current", "coming", "skipped"]
    mark: str  # shape that identifies the kind without colour
    name: str
    outcome: str = ""  # the result


@dataclass(frozen=True, slots=True)
class StrokeView:
    """The text about the last stroke."""

    grade: Literal["none", "good", "doubtful", "refused"]
    text: str
    details: str = ""  # in full, for a tool tip or a screen reader
    redo: steps.Redo | None = None  # sent by one key if there is a flaw


@dataclass(frozen=True, slots=True)
class CourseView:
    """The displayed data of the session."""

    headline: str
    primary: Button | None
    direction: int  # of the next stroke: +1 away from the subject, -1 towards, 0 if none is due
    timer: str  # time spent waiting for the current step
    notice: str
    rows: tuple[PlanRow, ...]
    tiles: tuple[Tile, ...]
    stroke: StrokeView
    buttons: Mapping[str, Button]  # by action
    no_forces: str  # why no forces are shown; empty if they are


def course_view(session: SessionState, bench: BenchState, now: float) -> CourseView:
    """Return the view of a session."""
    (headline, primary), over = _to_do(session, bench), session.is_over
    targets = redo_targets(session)
    stroke, trial = _stroke(session, targets), session.trial_state(session.trial)
    wait_s = max(int(now - session.since), 0)
    return CourseView(
        headline=headline,
        primary=primary,
        direction=trial.trial.direction if trial is not None and session.phase in IN_A_TRIAL else 0,
        timer="" if over else f"{wait_s // 60}:{wait_s % 60:02d}",
        notice=tr("It is stored in {folder}", folder=session.folder) if over else session.notice or _undo_text(session),
        rows=_rows(session),
        tiles=tiles(session),
        stroke=stroke,
        buttons=_buttons(session, trial) | {"redo": _redo(targets, stroke.redo)},
        no_forces=_no_forces(session.plan),
    )


def _no_forces(plan: SessionPlan) -> str:
    if not plan.forces:
        return tr("No forces are recorded: this visit is of scores only.")
    return "" if "forces" in plan.shown.experimenter else tr(NO_FORCES)


def _buttons(session: SessionState, trial: TrialState | None) -> dict[str, Button]:
    phase = session.phase
    by_digits = isinstance(session.command, steps.AskNumber | steps.AskChoice)
    key = "" if by_digits else "0"  # a digit that a subject may press by mistake
    why_skip = "" if trial is None else tr("Why is {trial} left out?", trial=_name_trials((trial,)))
    pause = Button(tr("Pause"), "P", phase in IN_A_TRIAL, steps.Pause())
    end = Button(tr("End"), "Ctrl+E", question=tr("Why does the session end now?"))
    undo = tr("Undo redo {numbers}", numbers="–".join(map(str, session.redone)))
    return {
        "skip": Button(tr("Skip"), "S", trial is not None and phase in IN_A_TRIAL, question=why_skip),
        "pause": Button(tr("Resume"), "P", sends=steps.Resume()) if phase == "paused" else pause,
        "note": Button(tr("Note"), "N", not session.is_over, question=tr("Note, stored with its time:")),
        "no answer": Button(tr("No answer"), key, phase == "scoring", NO_ANSWER.get(type(session.command))),
        "end": Button(tr("New"), "Ctrl+N", sends=NewSession()) if session.is_over else end,
        "undo": Button(undo, "Ctrl+Z", bool(session.redone) and phase in BEFORE_STROKE, steps.UndoRedo()),
    }


def _redo(targets: tuple[TrialState, ...], sends: steps.Redo | None) -> Button:
    """Return the redo button, which names the trials that it discards."""
    if not targets:
        return Button(tr("Redo"), "R", enabled=False)
    numbers = "–".join(str(trial.trial.number) for trial in targets)
    question = tr("Why redo {trials}? What was recorded there no longer counts.", trials=_name_trials(targets))
    return Button(tr("Redo {numbers}", numbers=numbers), "R", sends=sends, question=question)


def _undo_text(session: SessionState) -> str:
    trials = tuple(trial for trial in session.trials if trial.trial.number in session.redone)
    if not trials:
        return ""
    return tr("To be done again: {trials}. Ctrl+Z undoes that until the next stroke.", trials=_name_trials(trials))


def _name_trials(trials: tuple[TrialState, ...]) -> str:
    names = tr(" and ").join(f"{trial.trial.number} ({trial.trial.stimulus.code})" for trial in trials)
    return tr("trial {named}", named=names) if len(trials) == 1 else tr("trials {named}", named=names)


def _to_do(session: SessionState, bench: BenchState) -> tuple[str, Button | None]:
    """Return the sentence of the current step, and its button."""
    match session.phase:
        case "idle" if bench.link == "lost":
            return tr("Wait: the transducer does not answer."), None
        case "idle":
            return tr("Everything is set up. Press Space to begin."), Button(tr("Begin"), "Space", sends=steps.Begin())
        case "paused":
            return tr("Paused. Press Space to continue."), Button(tr("Resume"), "Space", sends=steps.Resume())
        case "resting":
            return _to_do_in_rest(session)
        case "resuming":
            return tr("Wait: the session is being resumed."), None
        case "closing":
            finish = Button(tr("End session"), "Space", sends=steps.Finish())
            return tr("Every trial is done. Press Space to end the session."), finish
        case "ended":
            return _to_do_at_end(session)
        case _:
            trial = session.trial_state(session.trial)
            return ("", None) if trial is None else _to_do_in(trial.trial, session)


def _to_do_in(trial: Trial, session: SessionState) -> tuple[str, Button | None]:
    code = trial.stimulus.code
    match session.phase:
        case "mounting":
            next_step = tr("to zero") if session.plan.forces else tr("to continue")
            label = tr("Zero") if session.plan.forces else tr("Mounted")
            practice = "" if trial.phase == "main" else f"{trial.phase.capitalize()}: "
            sentence = tr(
                "{practice}mount sample {code}, its arrow {way}. Then press Space {then}.",
                practice=practice, code=code, way=tr(_DIRECTIONS[trial.direction]), then=next_step,
            )  # fmt: skip
            return sentence[:1].upper() + sentence[1:], Button(label, "Space", sends=steps.StimulusMounted(code))
        case "taring":
            return tr("Hands off: zero is being measured with sample {code} on.", code=code), None
        case "ready":
            stroke_done = Button(tr("Stroke done"), "Space", sends=steps.StrokeDone())
            return _stroke_sentence(session, trial), None if session.plan.forces else stroke_done
        case "stroking":
            return tr("Stroke on {code} is being recorded.", code=code), None
        case "settling":
            return tr("Fingers off: the recording of {code} ends in a moment.", code=code), None
        case _:
            return _answer_sentence(session, code), None


def _answer_sentence(session: SessionState, code: str) -> str:
    match session.command:
        case steps.AskNumber():
            return tr("The subject gives sample {code} a number.", code=code)
        case steps.AskChoice(first, second):
            codes = first.stimulus.code, second.stimulus.code
            return tr("The subject chooses between {first} and {second}.", first=codes[0], second=codes[1])
        case _:
            return tr("The subject scores sample {code}.", code=code)


def _to_do_in_rest(session: SessionState) -> tuple[str, Button]:
    duration = session.command.duration if isinstance(session.command, steps.AskRest) else None
    by_itself = "" if duration is None else tr(" It continues automatically after {duration:g} s.", duration=duration)
    return tr("The subject rests.{by_itself}", by_itself=by_itself), Button(tr("Go on"), "Space", sends=steps.Resume())


def _stroke_sentence(session: SessionState, trial: Trial) -> str:
    hand = session.plan.stroking_hand
    finger = tr("{hand} index finger", hand=hand) if hand else tr("index finger")
    heading = tr("away from the body") if trial.direction == PROXIMAL_TO_DISTAL else tr("towards the body")
    limit = session.plan.stroke_limit(trial)
    often = tr("once") if limit == 1 else tr("at most {allowed}×", allowed=limit)
    sentence = tr(
        "Subject strokes {code} {often}, {way}, with the {finger}.",
        code=trial.stimulus.code, often=often, way=heading, finger=finger,
    )  # fmt: skip
    return sentence if session.plan.forces else tr("{sentence} Then press Space.", sentence=sentence)


def _to_do_at_end(session: SessionState) -> tuple[str, Button | None]:
    if not session.is_over:
        return tr("The session is being ended."), None
    if session.resumable:
        resume = Button(tr("Resume session"), "Space", sends=m.ResumeSession(session.folder))
        return tr("The session was cut short and can be resumed at the same trial."), resume
    count = sum(t.outcome == "done" for t in session.trials)
    sentence = tr("Session ended. Trials done: {done} of {count}.", done=count, count=len(session.trials))
    return sentence, Button(tr("New session"), "Space", sends=NewSession())


def _rows(session: SessionState) -> tuple[PlanRow, ...]:
    rows: list[PlanRow] = []
    for block in session.plan.blocks:
        heading = tr("↑ away") if block.direction == PROXIMAL_TO_DISTAL else tr("↓ towards")
        rows.append(PlanRow("block", "", block.name, heading))
        numbers = {trial.number for trial in block.trials}
        rows += [_row(session, trial) for trial in session.trials if trial.trial.number in numbers]
    return tuple(rows)


def _row(session: SessionState, trial: TrialState) -> PlanRow:
    name = f"{aligned(trial.trial.number)}  {trial.code}"
    if trial.trial.number == session.trial and session.phase != "ended":
        return PlanRow("current", "▶", name, tr("take {takes}", takes=trial.takes) if trial.takes > 1 else "")
    if trial.outcome == "skipped":
        return PlanRow("skipped", "–", name, tr("skipped"))
    if trial.outcome == "coming":
        return PlanRow("coming", "○", name)
    visible = session.plan.shown.experimenter
    quality = trial.quality
    mu = _mu(quality.stroke) if quality is not None and "forces" in visible else ""
    answer = trial.answer if "answer" in visible else ""
    mark = "!" if quality is not None and quality.texts else ""
    return PlanRow("done", "✓", name, "   ".join(filter(None, (mu, answer, mark))))


def _mu(stroke: Stroke | None) -> str:
    """Return the coefficient as an interval, without insignificant digits."""
    if stroke is None or stroke.mu_dynamic is None:
        return "µ –"
    low, high = stroke.mu_dynamic_interval or (stroke.mu_dynamic, stroke.mu_dynamic)
    return f"µ {low:.2f}–{high:.2f}" if f"{low:.2f}" != f"{high:.2f}" else f"µ {stroke.mu_dynamic:.2f}"


def _stroke(session: SessionState, targets: tuple[TrialState, ...]) -> StrokeView:
    trial = session.trial_state(session.judged_trial)
    if trial is None or trial.quality is None:
        return StrokeView("none", tr("No stroke yet."))
    quality, code = trial.quality, trial.trial.stimulus.code
    texts = [tr("Stroke on {code}", code=code)]
    if (stroke := quality.stroke) is not None:
        steady = stroke.steady
        texts += [] if steady is None else [tr("steady {duration:.1f} s", duration=steady[1] - steady[0])]
        texts += [] if stroke.mu_dynamic is None else [_mu(stroke)]
        texts += [] if stroke.speed is None else [quantity(stroke.speed, 0, "mm/s")]
    if share := round(100 * (quality.fell or 0.0)):
        template = tr_noop("N fell {share:.0f} %") if share > 0 else tr_noop("N rose {share:.0f} %")
        texts.append(tr(template, share=abs(share)))
    texts.append(tr("good") if quality.grade == "good" else "; ".join(tr(text) for text in quality.texts))
    redo = steps.Redo(quality.texts[0]) if quality.texts and trial in targets else None
    return StrokeView(quality.grade, " · ".join(texts), quality.sentences, redo)


def tiles(session: SessionState) -> tuple[Tile, ...]:
    """Return a tile for each trial, in the order of the plan."""
    return tuple(Tile(t.trial.number, t.code, _tile_kind(session, t)) for t in session.trials)


def inspection(session: SessionState, number: int) -> Inspection | None:
    """Return the inspection of a trial; None if the session has no trial with that number."""
    trial = session.trial_state(number)
    if trial is None:
        return None
    take = tr(", take {takes}", takes=trial.takes) if trial.takes > 1 else ""
    state = tr(TILES[_tile_kind(session, trial)][1])
    heading = tr("Trial {number}, {code}{again}: {state}", number=number, code=trial.code, again=take, state=state)
    visible = session.plan.shown.experimenter
    if trial.answer is not None and "answer" in visible:
        heading = f"{heading}, {trial.answer}"
    reason = trial.discard_reason.rstrip(".")
    details = tr("Its take before was discarded: {why}.", why=reason) if reason else ""
    quality = trial.quality
    if "forces" not in visible:
        return Inspection(number, heading, tr(NO_FORCES), details)
    if quality is None:
        return Inspection(number, heading, _why_none(session, trial), details)
    means = [None if quality.stroke is None else getattr(quality.stroke, name) for name in MEANS]
    cells = tuple((name, quantity(mean, *form)) for (name, form), mean in zip(PICTURE.items(), means, strict=True))
    at_length = f"{quality.sentences} {details}".strip()
    return Inspection(number, heading, verdict(quality), at_length, quality.grade, cells, quality.stroke)


def verdict(quality: Quality) -> str:
    """Return the verdict on a stroke: whether to redo it, the worst flaw, then the remedy."""
    if not quality.remarks:
        return tr("Good")
    worst = quality.remarks[0]
    mends = worst.grade == "refused" or (worst.advice and worst.grade == "doubtful")
    return f"{tr('Redo') if mends else tr('Doubtful')}: {tr(worst.text).rstrip('.')}. {tr(worst.advice)}".strip()


def _tile_kind(session: SessionState, trial: TrialState) -> TileKind:
    if trial.trial.number == session.trial and session.phase != "ended":
        return "current"
    if trial.outcome != "done":
        return trial.outcome
    if trial.quality is not None and trial.quality.texts:
        return "flawed"
    return "redone" if trial.takes > 1 else "done"


def _why_none(session: SessionState, trial: TrialState) -> str:
    if not session.plan.forces:
        return tr("No forces are recorded in this session.")
    if trial.outcome == "coming":
        return tr("Its stroke is still to come.")
    if trial.outcome == "skipped":
        return tr("It was left out: no stroke of it counts.")
    return tr("Its stroke was recorded, but this window has not examined it: Review shows it after the session.")
