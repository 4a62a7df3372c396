"""Sentences of a report: its question, its summary, and conditions that would change the sign of r."""

from collections.abc import Callable, Mapping
from itertools import takewhile

import numpy as np

from sessions.prediction import Kinematics
from sessions.prediction.stored import Ends, Variant
from sessions.report.contents import Experiment, PredictionFinding, Report
from sessions.report.tables.rivals import rivals_sentences
from sessions.report.tables.scales import psychometric_sentences, session_functions
from sessions.report.tables.session import paths_sentence
from sessions.report.trials import NO_ESTIMATE
from sessions.report.wording import (
    ShownResponse,
    capital,
    correlation,
    digits,
    ends_of,
    plural,
    reversal_sentence,
    shown_response,
    spread_share,
)
from sessions.statistics.correlations import Relation, relation
from sessions.statistics.scores import by_key

_REACH = 2.0  # of the places considered along the skin, on both sides of the ending [mm]
OTHER_FINGERS = "On a finger of another size or stiffness the sign may differ; 'daq-app sensitivity' tries 896 of them."
_NumberOf = Callable[[PredictionFinding], float | None]


def doubts(report: Report) -> tuple[str, ...]:
    """Return sentences on what would change the sign of r between prediction and scores; empty without an r."""
    relations = [experiment.score_relation for experiment in report.experiments]
    if all(relation is None or relation.pearson is None for relation in relations):
        return ()
    strain: Kinematics = "small" if report.model.startswith("small") else "finite"
    other_strain: Kinematics = "finite" if strain == "small" else "small"
    by_force = Variant(strain, "computed", "force")
    return (
        _in_variant(report, Variant(other_strain, "computed", "depth"), f"At {other_strain} strain"),
        _by_place(report),
        *_without_impossible(report),
        _in_variant(report, by_force, "Under the measured normal force in place of a given depth"),
        OTHER_FINGERS,
        *report.other_signs,
    )


def _in_variant(report: Report, variant: Variant, condition: str) -> str:
    """Return a sentence with r of the scores and the SED in a variant, for each experiment."""

    def sed(prediction: PredictionFinding) -> float | None:
        return next((a.sed for a in prediction.alternatives if a.variant == variant), None)

    tried = {p.experiment for p in report.predictions for a in p.alternatives if a.variant == variant}
    clauses: list[str] = []
    names: dict[str, None] = {}
    for experiment in report.experiments:
        if experiment.name in tried:
            names[_scores(experiment)] = None
            fit = _relation(report, experiment, sed)
            clauses.append(f"{experiment.name} {_fit_in_short(fit)}")
    if not clauses:
        sizes = [fact.value for fact in report.left_out if condition.endswith(fact.name) and fact.value != NO_ESTIMATE]
        change = f": the change is estimated at {sizes[0]}" if sizes else ""
        return f"{condition}, which was not tried here, the sign of r may differ{change}."
    return f"{condition}, r of the SED with the {' and the '.join(names)}: {'; '.join(clauses)}."


def _without_impossible(report: Report) -> list[str]:
    """Return a sentence with r without stimuli in a state that no finger can be in, where there are some."""
    quantity = shown_response(report.response)

    def possible(prediction: PredictionFinding) -> float | None:
        numbers = quantity.numbers(prediction)
        return None if numbers is None or prediction.doubt else numbers[0]

    fits = {
        experiment.name: _relation(report, experiment, possible)
        for experiment in report.experiments
        if experiment.scores and any(p.doubt for p in report.predictions if p.experiment == experiment.name)
    }
    clauses = [f"{name} {_fit_in_short(fit)}" for name, fit in fits.items()]
    return [f"Without trials in a state that no finger can be in: {'; '.join(clauses)}."] if clauses else []


def _fit_in_short(fit: Relation) -> str:
    text = fit.reason if fit.pearson is None else f"r = {correlation(fit.pearson)}{ends_of(fit)}"
    return f"{text}, n = {plural(fit.n, 'stimulus', 'stimuli')}"


def _scores(experiment: Experiment) -> str:
    return experiment.score_name.replace("score", "scores", 1)


def _relation(report: Report, experiment: Experiment, value: _NumberOf) -> Relation:
    """Return the relation of a number to mean scores, over the stimuli that have both; repetitions are averaged."""
    means = {mean.index: mean.mean for mean in experiment.scores}
    by_index = by_key(
        (p.index, number)
        for p in report.predictions
        if p.experiment == experiment.name and p.index in means and (number := value(p)) is not None
    )
    numbers = [float(np.mean(repeats)) for repeats in by_index.values()]
    return relation(numbers, [means[index] for index in by_index], list(by_index))


def _by_place(report: Report) -> str:
    """Return a sentence on the range of the ending along the skin without a change of the sign of r."""
    ranges: list[str] = []
    for experiment in report.experiments:
        rows = [p.row for p in report.predictions if p.experiment == experiment.name and p.row]
        arcs = rows[0] if rows else ()
        positions = sorted(arc for arc in arcs if abs(arc) <= _REACH and all(arc in row for row in rows))
        fits = {arc: _relation(report, experiment, lambda p, arc=arc: p.row.get(arc)) for arc in positions}
        r_by_arc = {arc: fit.pearson for arc, fit in fits.items() if fit.pearson is not None}
        if 0.0 in r_by_arc:
            low, high = _alike(r_by_arc)
            ranges.append(f"{experiment.name} from {digits(low, 2)} to {digits(high, 2)} mm")
    if not ranges:
        return "How the sign of r depends on the place of the ending is not known here."
    return (
        "The sign of r of the SED stays the same if the ending is moved along the skin (tried up to "
        f"{_REACH:g} mm to each side, positive towards the tip): in {' and in '.join(ranges)}."
    )


def _alike(r_by_arc: Mapping[float, float]) -> tuple[float, float]:
    """Return the ends of the stretch about 0 with the sign at 0.

    >>> _alike({-0.5: -0.9, -0.25: 0.3, 0.0: 0.9, 0.25: 0.8})
    (-0.25, 0.25)
    """
    limits: list[float] = []
    for side in (-1.0, 1.0):
        outwards = sorted((arc for arc in r_by_arc if side * arc >= 0.0), key=abs)
        limits.append(list(takewhile(lambda arc: r_by_arc[arc] * r_by_arc[0.0] > 0.0, outwards))[-1])
    return limits[0], limits[1]


def question(report: Report) -> str:
    """Return the session's question, as far as its data can answer it."""
    descriptors = " and ".join(dict.fromkeys(e.descriptor for e in report.experiments))
    if not report.experiments:
        return "What forces does this recording hold, where does something stroke the surface, and with what friction?"
    if not any(e.scale_ends[0] for e in report.experiments):
        quantity = shown_response(report.response).in_full if report.predictions else ""
        return f"People judge the {descriptors} of surfaces they stroke. {friction_question(quantity)}"
    if not report.predictions:
        stroked = report.course is not None or report.strokes
        friction = ", and with what friction do fingers stroke the same surfaces" if stroked else ""
        return f"How do people scale {descriptors}{friction}?"
    return (
        f"People scale the {descriptors} of surfaces they stroke. Does the {shown_response(report.response).in_full} "
        "that a finger model predicts at a receptor, from nothing but the friction of one finger on the same surfaces, "
        "follow their scores?"
    )


def friction_question(quantity: str) -> str:
    """Return the question of a session without scores; `quantity` is the model's prediction, "" for none."""
    model_clause = f", and what {quantity} does a finger model predict at a receptor" if quantity else ""
    return f"With what µ do they stroke them{model_clause}?"


def summary(report: Report) -> tuple[str, ...]:
    """Return the findings in short, a sentence each."""
    sentences = list(report.seal_differences)
    subjects = {subject for e in report.experiments for subject in e.answers}
    if subjects:
        stimuli = len({(mean.descriptor, mean.index) for e in report.experiments for mean in e.scores})
        sentences.append(f"{plural(len(subjects), 'subject')} scored {plural(stimuli, 'stimulus', 'stimuli')}.")
    if report.course is not None or report.strokes:
        sentences.append(_strokes(report))
    for results in session_functions(report):
        sentences += psychometric_sentences(results)
    for experiment in report.experiments:
        quantity = shown_response(report.response)
        responses = [quantity.numbers(p) for p in report.predictions if p.experiment == experiment.name]
        values = [quantity.factor * numbers[0] for numbers in responses if numbers is not None]
        if values:
            sentences.append(
                _prediction_sentence(experiment, quantity, (min(values), max(values)), report.model.split(",")[0])
            )
        if experiment.paths:
            sentences.append(paths_sentence(experiment.name, experiment.paths))
    if any(e.score_relation is not None and e.score_relation.low is not None for e in report.experiments):
        sentences.append("Intervals of r hold as if the stimuli had been drawn at random.")
    reversals = [
        reversal_sentence(e.descriptor, len(e.falling), len(e.answers)) for e in report.experiments if e.falling
    ]
    sentences += dict.fromkeys(reversals)  # once for a descriptor of several blocks
    noun = "trial" if any(p.trial is not None for p in report.predictions) else "stroke"
    missing_count = sum(p.sed is None for p in report.predictions)
    if missing_count:
        sentences.append(f"{plural(missing_count, noun)} without a prediction; the tables say why.")
    doubtful = sum(bool(p.doubt) for p in report.predictions)
    if doubtful:
        verb = "is" if doubtful == 1 else "are"
        sentences.append(f"{plural(doubtful, noun)} {verb} in a state that no finger can be in; the tables mark each.")
    excluded, flaws = len(report.excluded) or "nothing", len(report.flaws) or "none"
    names = "; the appendix names each" if report.excluded or report.flaws else ""
    sentences.append(f"Excluded: {excluded}; flaws found: {flaws}{names}.")
    return tuple(sentences)


def distinctions(report: Report) -> tuple[str, ...]:
    """Return sentences on the rivals that scores can and cannot distinguish."""
    return tuple(s for e in report.experiments if e.rivals for s in rivals_sentences(e.name, e.rivals))


def _strokes(report: Report) -> str:
    count = len(report.strokes)
    if count == 0:
        return "No stroke was found in the recording; the flaws below say why."
    values = [s.mu_dynamic for s in report.strokes if s.mu_dynamic is not None]
    verb = "was" if count == 1 else "were"
    sentence = f"{plural(count, 'stroke')} {verb} found; {len(values)} gave a dynamic friction"
    if len(values) < 2:
        return sentence + (f", µ = {digits(values[0], 2)}." if values else ".")
    return sentence + f", from µ = {digits(min(values), 2)} to {digits(max(values), 2)}."


def _prediction_sentence(experiment: Experiment, quantity: ShownResponse, limits: Ends, strain: str) -> str:
    """Return a sentence on prediction and score in one experiment; `limits` are in the shown unit."""
    low, high = limits
    decimals, unit = (2, " kPa") if quantity.unit == "kPa" else (quantity.places, "")
    sentence = f"{capital(experiment.name)}: the {quantity.label} predicted{f' at {strain}' if strain else ''}"
    if high > low:
        sentence += f" runs from {digits(low, decimals)} to {digits(high, decimals)}{unit}"
        sentence += f" (a range of {spread_share(low, high)})"
    else:
        sentence += f" is {digits(low, decimals)}{unit}"
    fit = experiment.score_relation
    if fit is None:
        return f"{sentence}; there are no scores to compare it with."
    if fit.pearson is None:
        return f"{sentence}; no correlation with the scores: {fit.reason}."
    r = f"{correlation(fit.pearson)}{ends_of(fit)}"
    return f"{sentence}; against the {_scores(experiment)} r = {r}, n = {fit.n} stimuli."
