"""What a report says in sentences: its question and, in short, its answer."""

from sessions.report import Experiment, Report
from sessions.report.responses import ShownResponse, shown_response
from sessions.report.robustness import robustness
from sessions.report.tables.multiverse import paths_sentence
from sessions.report.tables.psychometric import compared_with_standard, psychometric_sentences
from sessions.report.tables.rivals import rivals_sentences
from sessions.report.wording import correlation, digits, ends_of, plural, spread_share
from sessions.statistics.scores import Relation


def question(report: Report) -> str:
    """Return what the session asks, as far as what it holds can answer it."""
    judged = " and ".join(e.descriptor for e in report.experiments)
    if not report.experiments:
        return "What forces does this recording hold, where does something stroke the surface, and with what friction?"
    if not report.predictions:
        return f"How do people scale {judged}, and with what friction do fingers stroke the same surfaces?"
    return (
        f"People scale the {judged} of surfaces they stroke. Does the strain-energy density that a finger model "
        "predicts at a receptor, from nothing but the friction of one finger on the same surfaces, follow their scores?"
    )


def summary(report: Report) -> tuple[str, ...]:
    """Return the findings in short, a sentence each."""
    sentences: list[str] = []
    subjects = {answers.subject for e in report.experiments for answers in e.answers}
    if subjects:
        stimuli = sum(len(e.scores) for e in report.experiments)
        sentences.append(
            f"{_capital(plural(len(subjects), 'subject'))} scored {_plural(stimuli, 'stimulus', 'stimuli')}."
        )
    if report.course is not None or report.strokes:
        sentences.append(_strokes(report))
    for judged in compared_with_standard(report):
        sentences += psychometric_sentences(judged)
    for experiment in report.experiments:
        shown = shown_response(report.response)
        responses = [shown.of(p) for p in report.predictions if p.experiment == experiment.name]
        values = [shown.factor * one[0] for one in responses if one is not None]
        if values:
            sentences.append(_predicted(experiment, shown, (min(values), max(values)), report.model.split(",")[0]))
        if experiment.paths:
            sentences.append(paths_sentence(experiment.name, experiment.paths))
    missing = sum(p.sed is None for p in report.predictions)
    if missing:
        sentences.append(f"{_capital(plural(missing, 'trial'))} got no prediction; the tables say why.")
    excluded, flaws = len(report.excluded) or "nothing", len(report.flaws) or "none"
    sentences.append(f"Excluded: {excluded}; flaws found: {flaws}; the appendix names each.")
    return tuple(sentences)


def doubts(report: Report) -> tuple[str, ...]:
    """Return what would change the sign between prediction and scores; nothing without a prediction."""
    predicted = any(p.sed is not None for p in report.predictions)
    return (*robustness(report), *report.other_signs) if predicted else ()


def told_apart(report: Report) -> tuple[str, ...]:
    """Return what scores can and cannot tell apart."""
    return tuple(s for e in report.experiments if e.rivals for s in rivals_sentences(e.name, e.rivals))


def _strokes(report: Report) -> str:
    """Return how many strokes were found and how many gave friction."""
    n = len(report.strokes)
    if n == 0:
        return "No stroke was found in the recording; the flaws below say why."
    measured = sum(s.mu_dynamic is not None for s in report.strokes)
    words = f"{_capital(plural(n, 'stroke'))} {'was' if n == 1 else 'were'} found; {measured} gave a dynamic friction"
    values = [s.mu_dynamic for s in report.strokes if s.mu_dynamic is not None]
    if len(values) < 2:
        return words + (f", µ = {digits(values[0], 2)}." if values else ".")
    return words + f", from µ = {digits(min(values), 2)} to {digits(max(values), 2)}."


def _predicted(experiment: Experiment, shown: ShownResponse, ends: tuple[float, float], strain: str) -> str:
    """Return how prediction and score go together in one experiment; `ends` are in the shown unit."""
    low, high = ends
    decimals, unit = (2, " kPa") if shown.unit == "kPa" else (shown.places, "")
    words = f"{_capital(experiment.name)}: the {shown.label} predicted{f' at {strain}' if strain else ''}"
    if high > low:
        words += f" runs from {digits(low, decimals)} to {digits(high, decimals)}{unit}"
        words += f" (a range of {spread_share(low, high)})"
    else:
        words += f" is {digits(low, decimals)}{unit}"
    return words + related_words(experiment.score_relation) + "."


def related_words(related: Relation | None) -> str:
    """Return r with its interval and n as the end of a sentence, or why there is none."""
    if related is None:
        return "; there are no scores to hold it against"
    if related.pearson is None:
        return f"; no correlation with the scores: {related.reason}"
    words = f"; against the mean scores r = {correlation(related.pearson)}{ends_of(related)}"
    return words + f", n = {related.n} stimuli"


def _plural(n: int, one: str, many: str) -> str:
    return f"{n} {one if n == 1 else many}"


def _capital(words: str) -> str:
    return words[:1].upper() + words[1:]
