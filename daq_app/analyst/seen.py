"""What is said of the finger that is shown, and with which colours."""

from daq_app.analyst import messages as m
from daq_app.analyst.field_list import FieldChoice, Range, automatic_range
from daq_app.analyst.frame import Frame
from daq_app.analyst.shown import condition
from daq_app.analyst.state import AnalystState, chosen
from sessions.report.contents import PredictionFinding

PHASES = {
    "pressing": "pressing down",
    "sticking": "sticking: dragged, nothing slips yet",
    "slipping in part": "slipping in part",
    "sliding": "sliding: every point slips",
}


def common_range(state: AnalystState | None, field: FieldChoice) -> Range:
    """Return where the colours of all trials of a session begin and end."""
    return automatic_range(field, () if state is None else (finger.frame for finger in state.fingers.values()))


def shown_film(state: AnalystState) -> m.Filmed | None:
    """Return the history that was asked for, where it is that of the chosen trial."""
    row = chosen(state)
    return state.film if row is not None and state.film is not None and state.film.key == row.key else None


def was_tried(said: PredictionFinding) -> bool:
    """Say whether a trial was given to the solver: all that it needs is known."""
    return None not in (said.mu, said.tau_max, said.indentation, said.direction)


def finger_words(state: AnalystState | None) -> str:
    """Return what is said of the settled finger, or why there is none."""
    row = None if state is None else chosen(state)
    if state is None or row is None:
        return ""
    said = row.prediction
    name = "stroke" if row.trial is None else f"trial {row.trial}"
    if said is None:
        if state.halted:
            return f"The finger of {name} was not solved: the work was stopped. 'Go on' solves it."
        return f"The finger of {name} is being solved."
    if said.sed is None:
        why = said.reasons.get("sed", "no reason is known")
        return f"No settled finger. {why}"
    finger = state.fingers.get(row.key)
    parts = [f"Finger of {name}, settled", f"SED {condition(state.report, said)} {1000.0 * said.sed:.3f} kPa"]
    if finger is not None:
        parts.append(_contact_words(finger.frame))
    return " · ".join(parts)


def film_words(film: m.Filmed | None, at: int | None = None) -> str:
    """Return what is said of one state of a history; without one, why the history ends before it settles."""
    if film is None:
        return ""
    if at is None:
        if not film.why:
            return ""
        last = film.film.instants[-1]
        return (
            f"No settled state. The last good one, before tissue folds, is step {len(film.film.instants)}: "
            f"at {last.time:.3f} s, {last.depth:.3g} mm deep after {abs(last.travel):.3g} mm of sliding; "
            f"⊗ marks its most squeezed tissue. {film.why}"
        )
    now, frame = film.film.instants[at], film.film.frames[at]
    count = len(film.film.instants)
    return (
        f"Step {at + 1} of {count}, {now.time:.3f} s · {PHASES[now.phase]} · {now.depth:.2f} mm deep, "
        f"{abs(now.travel):.2f} mm slid · SED {1000.0 * now.sed:.3f} kPa · {_contact_words(frame)}"
    )


def _contact_words(frame: Frame) -> str:
    states = frame.contact.state
    touching = sum(state != "open" for state in states)
    slipping = sum(state in ("slip", "cap") for state in states)
    return f"{slipping} of {touching} touching points slip" if touching else "nothing touches"
