"""Tables of a study's page: mixed models, true and estimated values, and every trial."""

from collections.abc import Iterable
from itertools import combinations

from sessions.prediction import BY_NAME, Quantity
from sessions.report.tables import Cell, Format, Row, Table, estimate_cell, number_cell, range_cell, table
from sessions.report.trials import model_in_short
from sessions.report.wording import NONE, digits, p_value, places, plural, sed, significant, tau, three_figures
from sessions.statistics.findings import INDEX, LEVELS, NOISE, UNITS, DescriptorFindings, StudyFindings
from sessions.statistics.mixed_model import INTERCEPT, MixedModel, Spread, Term
from sessions.statistics.pooled import response_term
from sessions.statistics.scores import bounds, by_key
from sessions.statistics.visit import TrialRow, Visit, exclusion_of


def study_model(study: StudyFindings) -> str:
    """Return a short description of the model of a study's SEDs."""
    return model_in_short(study.options.prediction, study.options.area)


def models_table(study: StudyFindings) -> Table | None:
    """Return the mixed models of scores on the model's response and on index, with the spreads between subjects."""
    quantity = BY_NAME[study.response]
    groups = [
        (
            f"{findings.descriptor}: score on {predictor}, {model.n} scores of {plural(model.subjects, 'subject')}"
            f"{', singular fit' if model.singular else ''}",
            _terms(model, quantity),
        )
        for findings in study.descriptors
        for predictor, model in _models(findings, study)
        if not isinstance(model, str)
    ]
    columns = "term | unit | estimate | 95 % interval | p"
    return table("table-models", "study-models", columns, groups, label=quantity.label)


def _models(findings: DescriptorFindings, study: StudyFindings) -> tuple[tuple[str, MixedModel | str], ...]:
    """Return the mixed models of a descriptor, each with the name of its predictor."""
    label = BY_NAME[study.response].label
    return (label, findings.on_response), ("index", findings.on_index), ("index and µ", findings.on_friction)


def missing_models(study: StudyFindings) -> list[str]:
    """Return a sentence for each reason why a correlation of means or a mixed model is missing."""
    by_reason = by_key(
        (model, f"{findings.descriptor} on {predictor}")
        for findings in study.descriptors
        for predictor, model in _models(findings, study)
        if isinstance(model, str)
    )
    return [
        *(
            f"No correlation of means on {findings.descriptor}: {relation.reason}."
            for findings in study.descriptors
            if (relation := findings.mean_relation) is not None and relation.pearson is None
        ),
        *(f"No mixed model of {', '.join(names)}: {reason}." for reason, names in by_reason.items()),
    ]


def missing_scores(study: StudyFindings) -> list[str]:
    """Return a sentence for each reason why agreement, intervals or differences of surfaces are missing."""
    sentences: list[str] = []
    for findings in study.descriptors:
        complete_count = sum(None not in answers for answers in findings.answers.values())
        subjects, surfaces = plural(complete_count, "such subject"), plural(len(findings.indices), "surface")
        counts = f"{findings.descriptor} has {subjects} and {surfaces}"
        if not findings.scores:
            continue
        of_order = "it takes two subjects who scored each of three surfaces or more, not all the same"
        of_intervals = "they take two subjects who scored each of two surfaces"
        of_pairs = "it takes three subjects who scored both, not all with the same difference"
        index_pairs = {(difference.low_index, difference.high_index) for difference in findings.differences}
        indices = sorted(mean.index for mean in findings.scores)
        without = [f"{high} − {low}" for low, high in combinations(indices, 2) if (low, high) not in index_pairs]
        sentences += [] if findings.agreement else [f"No agreement on the order: {of_order}; {counts}."]
        sentences += [] if findings.within else [f"No intervals within subjects: {of_intervals}; {counts}."]
        if without:
            names = f" of surfaces {', '.join(without)}" if findings.differences else "s of surfaces"
            sentences.append(f"No difference{names} of {findings.descriptor}: {of_pairs}.")
    return sentences


def _terms(model: MixedModel, quantity: Quantity) -> Iterable[Row]:
    predictor, (unit, _) = model.terms[1].name, quantity.shown_unit
    units = {response_term(quantity): f"points per {unit}", **UNITS}
    middle = f"{digits(model.middle, 3)} {unit}" if predictor != INDEX else f"index {digits(50 + model.middle, 1)}"

    def row(name: str, unit: str, value: float, spreads: Term | Spread, p: str = NONE) -> Row:
        return (name, unit, three_figures(value), range_cell(spreads.low, spreads.high, three_figures), p)

    names = {INTERCEPT: f"level at {middle}"}
    for term in model.terms:
        yield row(names.get(term.name, term.name), units.get(term.name, "points"), term.estimate, term, p_value(term.p))
    spreads = model.spreads
    if spreads is not None:
        slopes = ("spread of subjects' slopes", units[predictor], spreads.slope)
        for name, unit, spread in ((LEVELS, "points", spreads.level), slopes, (NOISE, "points", spreads.left)):
            if spread is not None:
                yield row(name, unit, spread.sd, spread)


def ground_truth_table(study: StudyFindings) -> Table | None:
    """Return the true effects of a simulated study next to their estimates."""
    rows = tuple(
        (
            effect.descriptor,
            effect.effect,
            UNITS[effect.effect],
            three_figures(effect.true_value),
            three_figures(effect.estimate),
            range_cell(effect.low, effect.high, three_figures),
            "yes" if effect.covered else "no",
        )
        for effect in study.effects
    )
    columns = "descriptor | effect | unit | true | estimated | 95 % interval | inside"
    return table("table-planted", "study-ground-truth", columns, [("", rows)])


def flaws_table(study: StudyFindings) -> Table | None:
    """Return the faults of a simulated study, and whether the analysis detected them."""
    rows = tuple((flaw.session, flaw.expected, "yes" if flaw.detected else "no") for flaw in study.flaws)
    return table("table-planted-flaws", "study-flaws", "session | simulated | detected", [("", rows)])


_TOO_FEW = "too few readings"
_MOST_TRIALS = 400  # most trials in a table of the page; `trials.csv` has all


def trials_table(study: StudyFindings) -> Table | None:
    """Return every trial with scores, measurements and predictions; None where they are too many for a page."""
    if sum(len(visit.rows) for visit in study.visits) > _MOST_TRIALS:
        return None
    columns = (
        "trial | index | answer [score: 0–100] | µ [1] | τ max [kPa] | N [N] | speed [mm/s] | SED [kPa] | "
        "estimated error [%] | flaws"
    )
    groups = [
        (
            f"{visit.session}, {descriptor}{_exclusion_note(study, visit, descriptor)}",
            [_row(row) for row in visit.rows if row.descriptor == descriptor],
        )
        for visit in study.visits
        for descriptor in dict.fromkeys(row.descriptor for row in visit.rows)
    ]
    distinct = dict.fromkeys(visit.calibration for visit in study.visits if visit.calibration)
    calibrations = f" (calibration: {'; '.join(distinct)})" if distinct else ""
    return table("table-trials", "study-trials", columns, groups, calibrations=calibrations, model=study_model(study))


def _exclusion_note(study: StudyFindings, visit: Visit, descriptor: str) -> str:
    if visit.session in dict(study.copies):
        return " (a copy: not counted)"
    exclusion = exclusion_of(study.excluded, visit.subject, descriptor)
    return "" if exclusion is None else " (left out of every number above)"


def answer_of(row: TrialRow) -> float | str | None:
    """Return the subject's answer: a score, a number on a scale of its own, or a choice; None without one."""
    return next((answer for answer in (row.score, row.estimate, row.choice) if answer is not None), None)


def _row(row: TrialRow) -> Row:
    answer = answer_of(row)
    reason = row.why or "withheld: the flaws say why"

    def estimate(name: str, as_text: Format, unit: float = 1.0, without: str = _TOO_FEW) -> Cell:
        interval = bounds(getattr(row, f"{name}_low"), getattr(row, f"{name}_high"))
        return estimate_cell(getattr(row, name), as_text, reason, interval, without, unit=unit)

    return (
        row.trial,
        row.index,
        answer if isinstance(answer, str) else number_cell(answer, places(1), f"no answer: {row.outcome}"),
        estimate("mu", places(3)),
        estimate("tau_max", tau, 1e3),
        estimate("normal_force", places(2)),
        estimate("speed", places(1)),
        estimate("sed", sed, 1e3, row.sed_interval),
        number_cell(row.error_estimate, lambda v: significant(100 * v, 2), reason),
        ", ".join(flaw.replace("_", " ") for flaw in row.flaws) or "none",
    )
