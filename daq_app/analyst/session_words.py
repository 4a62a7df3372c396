"""The analyst's texts about a session: lines, numbers, tables, points, and the path back to the readings."""

import re
from dataclasses import dataclass
from typing import Literal

from daq_app.analyst.state import AnalystState, Row, Step, rows, selected_row
from daq_app.wording import aligned, answer_text, errors_text, quantity, tr, tr_noop
from sessions.prediction import SED
from sessions.report.contents import AnswerFinding, PredictionFinding, Report, StrokeFinding
from sessions.report.wording import shown_response

Target = Literal["session", "trial", "prediction", "friction", "window", "readings"]
_PLAIN = re.compile(r"[0-9]+(?:[.][0-9]+)?")
RULES = tr_noop(("maximum", "mean over steady window"))  # which mu the model is given, as named by `sessions`
FRICTION_HEAD = tr_noop(
    ("trial", "stimulus", "µ steady", "95 %", "µ greatest", "τ max [kPa]", "V [mm/s]", "N [N]", "way", "flaws")
)
PICTURES = {  # one of each experiment
    "relation": tr_noop("SED against score"), "scores": tr_noop("scores"), "friction": tr_noop("friction over time"),
    "speed": tr_noop("speed over time"), "response": tr_noop("response over time"),
}  # fmt: skip
_DIRECTIONS = {1: tr_noop("distal"), -1: tr_noop("proximal")}


@dataclass(frozen=True, slots=True)
class Point:
    """A stimulus in the plot of prediction against score."""

    score: float
    response: float  # the quantity compared with the scores, in the unit shown
    row: int  # selected by a click on it


def row_text(row: Row) -> str:
    """Return a line of the list of trials; `marks_of` explains its marks."""
    answer = "" if row.answer is None else f"  {answer_text(row.answer.outcome, row.answer.answer)}"
    if row.stroke is None:
        finding = row.prediction or row.answer
        assert finding is not None  # a row has at least one finding
        return _name_of(finding) + ("" if row.prediction is None else tr("  no stroke")) + answer
    mu = f"µ {quantity(row.stroke.mu_dynamic, 2)}"
    mark = ("  !" if row.stroke.flaws else "") + ("  ✎" if row.stroke.decided else "")
    cross = "  ✗" if row.prediction is not None and row.prediction.sed is None else ""
    return f"{_name_of(row.stroke)}  {mu}{answer}{mark}{cross}"


def marks_of(row: Row) -> str:
    """Return the meaning of a line's marks, for tool tips and screen readers."""
    stroke, failed = row.stroke, row.prediction is not None and row.prediction.sed is None
    flaws = tr("! has flaws: ") + _flaws(stroke) if stroke is not None and stroke.flaws else ""
    decision = tr("✎ has a decision") if stroke is not None and stroke.decided else ""
    return "; ".join(filter(None, (flaws, decision, tr("✗ the model has no SED for it") if failed else "")))


def numbers(state: AnalystState) -> tuple[tuple[str, str], ...]:
    """Return names and values of the chosen line."""
    row = selected_row(state)
    if row is None:
        return ()
    lines: list[tuple[str, str]] = []
    if (stroke := row.stroke) is not None:
        limits = stroke.mu_dynamic_interval
        interval = "" if limits is None else f"  [{limits[0]:.3f}, {limits[1]:.3f}]"
        lines += [
            (tr("µ over the steady window"), _value(stroke, "mu_dynamic", "{:.3f}" + interval)),
            (tr("µ at its greatest"), _value(stroke, "mu_max", "{:.3f}")),
            (tr("traction bound"), _value(stroke, "tau_max", "{:.1f} kPa", 1000.0)),
            (tr("speed"), _value(stroke, "speed", "{:.1f} mm/s")),
            (tr("normal force"), _value(stroke, "normal_force", "{:.2f} N")),
            (tr("flaws"), _flaws(stroke) or tr("none")),
        ]
    if (prediction := row.prediction) is not None:
        condition_text = condition(state.report, prediction)
        force = _value(prediction, "normal_force", "{:.2f} N" + errors_text(prediction.normal_force_error))
        sed = _value(prediction, "sed", "") if prediction.sed is None else sed_with_errors(state.report, prediction)
        lines += [
            (tr("SED {condition}, averaged over the ending", condition=condition_text), sed),
            *_other_response(state, prediction),
            (tr("model: µ"), _value(prediction, "mu", "{:.3f} (" + tr(prediction.mu_rule) + ")")),
            (tr("model: indentation"), _value(prediction, "indentation", "{:.2f} mm, " + tr("prescribed"))),
            (tr("model: normal force {condition}", condition=condition_text), force),
        ]
    elif state.stage == "analysed":
        lines.append(("SED", tr("– stopped before this trial") if state.halted else tr("not predicted yet")))
    return tuple(lines)


def _other_response(state: AnalystState, prediction: PredictionFinding) -> list[tuple[str, str]]:
    """Return the chosen quantity with its errors; [] for the SED, which is always shown."""
    response_kind = shown_response(state.response)
    response = response_kind.numbers(prediction)
    if response_kind.name == SED.name or not response:
        return []
    value, error = response
    mesh = error / abs(value) if error is not None and value else None
    condition_text, label = condition(state.report, prediction), tr(response_kind.label)
    name = tr("{response} {condition}, averaged over the ending", response=label, condition=condition_text)
    return [(name, response_kind.text(response_kind.factor * value) + errors_text(mesh))]


def sed_with_errors(report: Report | None, prediction: PredictionFinding) -> str:
    """Return an SED with its error from the mesh, and the greatest omitted effect over all trials."""
    assert prediction.sed is not None  # a trial without an SED shows a reason instead
    return f"{1000.0 * prediction.sed:.3f} kPa{errors_text(prediction.error_estimate, _effect(report))}"


def sed_text(report: Report | None, prediction: PredictionFinding) -> str:
    """Return an SED with its condition and errors."""
    return f"SED {condition(report, prediction)} {sed_with_errors(report, prediction)}"


def greatest_errors(report: Report | None, response: str = SED.name) -> str:
    """Return the condition and error bounds for all trials of a session; "" if none was predicted.

    The mesh's error is the greatest of all trials, and unknown if that of one is unknown.
    """
    response_kind = shown_response(response)
    predictions = () if report is None else report.predictions
    answers = [(prediction, value) for prediction in predictions if (value := response_kind.numbers(prediction))]
    if not answers:
        return ""
    mesh = [error / abs(value) for _, (value, error) in answers if error is not None and value]
    effect = _effect(report) if response == SED.name else ""
    errors = errors_text(max(mesh) if len(mesh) == len(answers) else None, effect)
    conditions = " / ".join(sorted({condition(report, prediction) for prediction, _ in answers}))
    return tr("{response} {condition}{errors}", response=tr(response_kind.label), condition=conditions, errors=errors)


def picture_errors(report: Report | None, picture: str) -> str:
    """Return the condition and the errors for a picture of `session_pictures`; "" if it shows no SED."""
    return greatest_errors(report) if picture.partition(" ")[0] in ("relation", "response") else ""


def _effect(report: Report | None) -> str:
    """Return the greatest omitted effect on the SED; "" if none is known."""
    facts = [fact for fact in (() if report is None else report.left_out) if fact.name != "warning"]
    most = max(facts, key=lambda fact: max(map(float, _PLAIN.findall(fact.value)), default=0.0), default=None)
    return "" if most is None else f"{most.name} {most.value}"


def condition(report: Report | None, prediction: PredictionFinding) -> str:
    """Return the condition under which an SED holds: prescribed depth and kinematics.

    While a session runs, the window shows the SED at the measured force instead.
    """
    depth = "" if prediction.indentation is None else tr("at {depth:.3g} mm", depth=prediction.indentation)
    return ", ".join(filter(None, (depth, "" if report is None else tr(report.model.split(",")[0]))))


def friction_table(report: Report | None) -> tuple[tuple[str, ...], ...]:
    """Return a line of `FRICTION_HEAD` for each stroke, in order of time; "–" for a withheld number."""
    return () if report is None else tuple(_friction_line(stroke) for stroke in report.strokes)


def scene_table(state: AnalystState) -> tuple[tuple[str, str, str], ...]:
    """Return the model's inputs for the chosen trial and for all: name, value, remark."""
    row = selected_row(state)
    prediction = None if row is None else row.prediction
    facts: list[tuple[str, str, str]] = []
    if prediction is not None:
        sense = prediction.direction
        direction = "–" if sense is None else tr("{way}, as measured", way=tr(_DIRECTIONS[sense]))
        facts += [
            (tr("µ of this trial"), _value(prediction, "mu", "{:.4f}"), tr(prediction.mu_rule)),
            (tr("τ max of this trial"), _value(prediction, "tau_max", "{:.2f} kPa", 1000.0), ""),
            (tr("indentation"), _value(prediction, "indentation", "{:.3g} mm"), tr("of the block's plan")),
            (tr("way"), direction, ""),
        ]
    if (report := state.report) is not None:
        facts += [(fact.name, fact.value, fact.remark) for fact in (*report.modelled, *report.left_out)]
    return tuple(facts)


def session_pictures(report: Report | None) -> tuple[tuple[str, str], ...]:
    """Return names and titles of all pictures of a session, including those without data."""
    if report is None:
        return ()
    experiments = [experiment.name for experiment in report.experiments] or [""]
    names = [("course", tr("forces over the whole recording"))]
    for picture, title in ((picture, tr(title)) for picture, title in PICTURES.items()):
        names += [(f"{picture} {name}".rstrip(), f"{title}, {name}" if name else title) for name in experiments]
    return tuple(names)


def points(state: AnalystState) -> tuple[Point, ...]:
    """Return the points of prediction against score, one for each stimulus that has both."""
    report = state.report
    if report is None:
        return ()
    response_kind = shown_response(state.response)
    scores = {(group.name, score.index): score.mean for group in report.experiments for score in group.scores}
    points: list[Point] = []
    for number, row in enumerate(rows(state)):
        prediction = row.prediction
        if prediction is None or prediction.index is None:
            continue
        score, response = scores.get((prediction.experiment, prediction.index)), response_kind.numbers(prediction)
        if score is not None and response:
            points.append(Point(score, response_kind.factor * response[0], number))
    return tuple(points)


def progress_text(step: Step | None) -> str:
    """Return the current activity, and the time left.

    >>> progress_text(Step(0.5, "predicting", 3.2))
    'predicting  50 %, about 4 s left'
    >>> progress_text(Step(0.5, "drawing the history", None, 60))
    'drawing the history  load step 30 of 60'
    """
    if step is None:
        return ""
    remaining = "" if step.remaining_s is None else tr(", about {seconds} s left", seconds=int(step.remaining_s) + 1)
    load_step, steps = round(step.fraction * step.load_steps), step.load_steps
    amount = tr("load step {step} of {steps}", step=load_step, steps=steps) if steps else f"{100 * step.fraction:.0f} %"
    return f"{tr(step.activity)}  {amount}{remaining}"


def _name_of(finding: StrokeFinding | PredictionFinding | AnswerFinding) -> str:
    if finding.trial is None:
        return tr("stroke {number}", number=finding.number) if isinstance(finding, StrokeFinding) else tr("stroke –")
    return f"{aligned(finding.trial)}  {finding.experiment} {finding.code if finding.index is None else finding.index}"


def _flaws(stroke: StrokeFinding) -> str:
    return ", ".join(flaw.replace("_", " ") for flaw in stroke.flaws)


def _value(finding: StrokeFinding | PredictionFinding, name: str, form: str, factor: float = 1.0) -> str:
    """Return a formatted number of a finding, or the reason why there is none."""
    value: float | None = getattr(finding, name)
    return form.format(factor * value) if value is not None else f"–  {finding.reasons.get(name, '')}".rstrip()


def _friction_line(stroke: StrokeFinding) -> tuple[str, ...]:
    low, high = stroke.mu_dynamic_interval or (None, None)
    tau = None if stroke.tau_max is None else 1000.0 * stroke.tau_max
    return (
        tr("stroke {number}", number=stroke.number) if stroke.trial is None else str(stroke.trial),
        f"{stroke.experiment} {stroke.code if stroke.index is None else stroke.index}".strip() or "–",
        quantity(stroke.mu_dynamic, 3),
        "–" if low is None else tr("{low:.3f} to {high:.3f}", low=low, high=high),
        *(quantity(*pair) for pair in ((stroke.mu_max, 3), (tau, 1), (stroke.speed, 1), (stroke.normal_force, 2))),
        "–" if stroke.direction is None else tr(_DIRECTIONS[stroke.direction]),
        _flaws(stroke),
    )


@dataclass(frozen=True, slots=True)
class Link:
    """One element of the path: its text, its target, and further details."""

    text: str
    target: Target
    detail: str = ""


def lineage(state: AnalystState) -> tuple[Link, ...]:
    """Return the path from the chosen trial's SED, or its friction if it has none, to its readings."""
    row = selected_row(state)
    if row is None:
        return ()
    links = [Link(state.folder.name, "session", str(state.folder))]
    if row.trial is not None:
        links.append(Link(tr("trial {trial}", trial=row.trial), "trial"))
    prediction, stroke = row.prediction, row.stroke
    if prediction is not None and prediction.sed is not None:
        whole = tr("{sed}, averaged over the ending", sed=sed_text(state.report, prediction))
        links.append(Link(f"SED {1000.0 * prediction.sed:.3f} kPa", "prediction", whole))
    if stroke is None:
        return tuple(links)
    links.append(_friction(stroke, prediction))
    if stroke.steady is not None:
        text = tr("steady window {begin:.3f} to {end:.3f} s", begin=stroke.steady[0], end=stroke.steady[1])
        links.append(Link(text, "window", tr("of stroke {number}, device's clock", number=stroke.number)))
    text, detail = tr("raw readings"), tr("counts, sequence and device counter, as they were recorded")
    if state.excerpt is not None and state.excerpt.stroke == stroke.number:
        text, detail = tr("readings: {count}", count=len(state.excerpt.readings.block)), state.excerpt.readings.location
    return (*links, Link(text, "readings", detail))


def _friction(stroke: StrokeFinding, prediction: PredictionFinding | None) -> Link:
    if prediction is not None and prediction.mu is not None:
        tau = "" if stroke.tau_max is None else tr(", τ max {tau_max:.1f} kPa", tau_max=1000.0 * stroke.tau_max)
        rule = tr("the model was given the {rule}", rule=tr(prediction.mu_rule))
        return Link(f"µ {prediction.mu:.3f}", "friction", f"{rule}{tau}")
    reason = stroke.reasons.get("mu_dynamic", "") if stroke.mu_dynamic is None else tr("mean over the steady window")
    return Link(f"µ {quantity(stroke.mu_dynamic, 3)}", "friction", reason)
