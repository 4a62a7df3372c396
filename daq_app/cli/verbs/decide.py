"""Record a person's decision about a stroke: its window, its ends, its direction, or that it is excluded.

The recording is not changed: the decision is added to decisions.jsonl next to it, with author, time, reason and
previous value. Every later analysis, prediction, report, export and study applies it. --undo withdraws a decision by
adding another line. Times are seconds on the device's clock, as 'daq-app analyse' prints them.
"""

import argparse
from dataclasses import replace
from functools import partial
from typing import Any

from daq_app.batch.derived import ANALYSIS, PREDICTION, analyse_session, settings_of, stored_document
from daq_app.cli.options import add_session
from daq_app.console import DONE, FLAWED, Console, WrongValue
from daq_app.wording import number
from sessions.plan.study import check_code
from sessions.recording import Recording
from sessions.recording.derived import gain_error_set
from sessions.strokes import Analysis, analyse
from sessions.strokes.analysis import preview, with_present
from sessions.strokes.decisions import Decision, DecisionError, Decisions, append, read
from sessions.strokes.stroke import Stroke, meanings

EXAMPLE = 'daq-app decide recordings/P07 --trial 4 --steady 31.2 32.6 --by E02 --why "the ramp was in it"'
CHANGING = ("mu_static", "mu_dynamic", "mu_max", "tau_max", "speed", "direction", "break_away", "slide_onset")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_session(parser)
    parser.add_argument("--trial", type=int, metavar="N", help="the stroke's trial; none if there are no trials")
    parser.add_argument("--stroke", type=int, metavar="K", default=1, help="its number within the trial (1)")
    choices = parser.add_mutually_exclusive_group(required=True)
    window = partial(choices.add_argument, type=float, nargs=2, metavar=("FROM", "TO"))
    window("--steady", help="steady window, for mu_dynamic and speed [s]")
    window("--stick", help="stick phase: its greatest T/N is mu_static, its end break-away [s]")
    choices.add_argument("--onset", type=float, metavar="S", help="contact onset [s]")
    choices.add_argument("--lift", type=float, metavar="S", help="end of contact [s]")
    choices.add_argument("--slide-onset", type=float, metavar="S", help="where the slide begins, for mu_static [s]")
    choices.add_argument("--direction", type=int, choices=[1, -1], help="1 proximal to distal, -1 distal to proximal")
    for name, meaning in (
        ("--drop", "exclude the stroke: it is shown, but not used by the model"),
        ("--keep", "include the stroke: its flaws were examined"),
        ("--choose", "use this stroke of its trial in the model"),
        ("--list", "only list the decisions"),
    ):
        choices.add_argument(name, action="store_true", help=meaning)
    meaning = "tilt of the session's face to +x and to +y, to level it; without numbers, as estimated from its presses"
    choices.add_argument("--tilt", type=float, nargs="*", metavar="DEGREES", help=meaning)
    choices.add_argument("--undo", type=int, metavar="NUMBER", help="withdraw a decision")
    parser.add_argument("--by", metavar="CODE", help="who decides: a code, never a name")
    parser.add_argument("--why", metavar="REASON", help="in a few words")


def run(options: argparse.Namespace, console: Console) -> int:
    recording = Recording.open(options.session)
    decisions = read(recording.folder)
    if options.list:
        return _list(decisions, console)
    if options.by is None or options.why is None:
        raise WrongValue("a decision says who decides and why: give --by CODE and --why REASON")
    check_code("--by", options.by)
    if options.choose and options.trial is None:
        raise WrongValue("--choose picks a stroke of a trial: give --trial N")
    document = stored_document(recording.folder, ANALYSIS)
    gain_error_set(recording.folder)  # raises if damaged, before a decision is recorded that could not be analysed
    analysis = analyse(recording, settings_of(document or {}), decisions)
    decision = _decision(options) if options.tilt is None else _tilt(options, analysis)
    decision = with_present(analysis, decision)
    new_analysis = preview(recording, decision, decisions, analysis)
    line = append(recording, decision)
    if document is not None:
        analyse_session(recording, console)
    older = (recording.folder / PREDICTION).is_file()
    changes = _changes(analysis, new_analysis)
    console.result(decision=line.to_dict(), changes=changes, prediction_is_older=older)
    console.say(recording.simulated_sentence, line.sentence, *changes)
    if older:
        console.say(f"{PREDICTION} was made before this decision: 'daq-app predict' computes it again")
    return DONE


def _decision(options: argparse.Namespace) -> Decision:
    decision = Decision(options.by, options.why, trial=options.trial, stroke=options.stroke)
    if options.undo is not None:
        return Decision(options.by, options.why, undoes=options.undo)
    if options.choose:
        return replace(decision, what="choice", stroke=None, new=options.stroke)
    if options.drop or options.keep:
        return replace(decision, what="kept", new=bool(options.keep))
    names = ("steady", "stick", "onset", "lift", "slide_onset", "direction")
    target = next(name for name in names if getattr(options, name) is not None)
    value: Any = getattr(options, target)
    return replace(decision, what=target, new=tuple(value) if target in ("steady", "stick") else value)


def _tilt(options: argparse.Namespace, analysis: Analysis) -> Decision:
    """Return the decision to level the face, by given angles or by those estimated from presses."""
    angles: list[float] = options.tilt
    if len(angles) not in (0, 2):
        raise WrongValue("--tilt takes two angles, to +x and to +y in degrees, or none")
    if angles:
        return Decision(options.by, options.why, "tilt", new=(angles[0], angles[1]))
    if analysis.tilt is None:
        raise DecisionError("no press without a slide, so the tilt is not known: give two angles after --tilt")
    return Decision(options.by, options.why, "tilt", new=analysis.tilt.lean)


def _list(decisions: Decisions, console: Console) -> int:
    in_force = {decision.number for decision in decisions.in_force}
    lines = [{**line.to_dict(), "in_force": line.number in in_force} for line in decisions.lines]
    console.result(decisions=lines, problems=decisions.problems)
    for line in decisions.lines:
        remark = "" if line.number in in_force or line.undoes is not None else " (no longer in force)"
        console.say(f"{line.made_utc}  {line.sentence}{remark}")
    console.say(*decisions.problems, None if decisions.lines else "nothing was decided")
    return FLAWED if decisions.problems else DONE


def _changes(old_analysis: Analysis, new_analysis: Analysis) -> list[str]:
    """Return a sentence for each stroke whose numbers a decision changes."""
    sentences: list[str] = []
    units = meanings(Stroke)
    of_model, new_of_model = ({friction.stroke for friction in a.friction} for a in (old_analysis, new_analysis))
    for index, (old_stroke, new_stroke) in enumerate(zip(old_analysis.strokes, new_analysis.strokes, strict=False)):
        numbers = ((name, *(number(getattr(s, name), 4) for s in (old_stroke, new_stroke))) for name in CHANGING)
        texts = [f"{name} {old} -> {new} {units[name].unit}".rstrip() for name, old, new in numbers if old != new]
        if (index in of_model) != (index in new_of_model):
            texts.append("now used by the model" if index in new_of_model else "no longer used by the model")
        if texts:
            trial = "" if new_stroke.trial is None else f" of trial {new_stroke.trial}"
            sentences.append(f"stroke {new_stroke.number}{trial}: {', '.join(texts)}")
    return sentences
