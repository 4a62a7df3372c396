"""Every page that the subject will see in a session, before there is one. No Qt."""

from dataclasses import dataclass, replace
from datetime import datetime

from daq_app.recorder.messages import SessionBegun
from daq_app.window.course_state import SessionState, session_after, session_begun
from daq_app.window.new_session import PILOT, Bench, Refused, SessionForm, checked
from daq_app.window.subject_texts import SubjectText, Translate
from daq_app.window.view_subject import SubjectView, subject_view
from daq_app.wording import tr, tr_noop
from sessions.plan.plan import Frame, SessionPlan
from sessions.run import machine, states, steps

ANSWERS = {"number": steps.MagnitudeEstimate(1.0), "choice": steps.PairedChoice("first")}
OF_A_BLOCK = {"ready": tr_noop("stroke"), "scoring": tr_noop("answer")}  # phases whose page is the block's own
NAMES = {
    "mounting": tr_noop("the surface is changed"),
    "settling": tr_noop("the finger is still on"),
    "resting": tr_noop("rest"),
    "paused": tr_noop("pause"),
    "closing": tr_noop("end"),
}


@dataclass(frozen=True, slots=True)
class PreviewPage:
    """One page, with what it is called in a list."""

    name: str
    view: SubjectView


def preview(form: SessionForm, translate: Translate = str) -> tuple[PreviewPage, ...] | Refused:
    """Return every page of the form's protocol in the form's language, each once, or what is wrong with the form.

    The session's own machine is led through every trial, and each page is what the window would show the subject then.
    Codes and orders are those of one example.
    """
    folder = form.folder if form.study.strip() else "."  # nothing is written
    plain = replace(
        form, subject=PILOT, folder=folder, seed="", height="", normal="", area="", simulated=False, pilot=True
    )
    session_plan = checked(plain, Bench(connected=True, simulated=True, frame=Frame()), datetime.now(), 0)
    if isinstance(session_plan, Refused):
        return session_plan
    language = session_plan.plan.language
    first = PreviewPage(tr("before the session"), subject_view(None, translate, language))
    thanks = SubjectView("read", translate(SubjectText.THANKS), language=language)
    *course, end = _pages(session_plan.plan, translate)
    return (first, *course, PreviewPage(tr("an answer was given"), thanks), end)


def _pages(plan: SessionPlan, translate: Translate) -> tuple[PreviewPage, ...]:
    pages: dict[str, SubjectView] = {}
    session: SessionState = session_begun(SessionBegun("", plan, "people", None, 0, 1.0), 0.0)
    step = machine.start(plan)
    while not isinstance(step[0], states.Ended):
        state, commands = step
        for command in commands:
            session = session_after(session, command, 0.0)
        if isinstance(state, states.Settling):
            session = replace(session, phase="settling")
        if session.phase in OF_A_BLOCK or session.phase in NAMES:
            pages.setdefault(_name(session), replace(subject_view(session, translate), key=(len(pages) + 1, 1)))
        step = machine.advance(state, _next_event(state))
    pages[NAMES["paused"]] = subject_view(replace(session, phase="paused"), translate)
    pages[NAMES["closing"]] = pages.pop(NAMES["closing"])  # the last one
    return tuple(PreviewPage(tr(name), view) for name, view in pages.items())


def _name(session: SessionState) -> str:
    if session.phase in NAMES or session.block is None:
        return NAMES.get(session.phase, session.phase)
    return f"{session.block.name}: {tr(OF_A_BLOCK[session.phase])}"


def _next_event(state: states.State) -> steps.Event:
    """Return what brings a session on from a state."""
    match state:
        case states.Idle():
            return steps.Begin()
        case states.Mounting(place):
            return steps.StimulusMounted(place.trial.stimulus.code)
        case states.Taring():
            return steps.Zeroed()
        case states.Ready(place):
            return steps.ContactOnset() if place.plan.forces else steps.StrokeDone()
        case states.Stroking():
            return steps.FingerLifted()
        case states.Scoring(place):
            return ANSWERS.get(place.trial.answer, steps.Scored(50.0))
        case states.Settling(touching=touching):
            return steps.FingerLifted() if touching else steps.Settled()
        case states.Resting():
            return steps.RestOver()
        case _:
            return steps.Finish()
