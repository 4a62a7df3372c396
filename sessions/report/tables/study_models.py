"""Tables of a study's page: mixed models, true and estimated values, and every trial."""

from collections.abc import Iterable
from itertools import combinations

from sessions.prediction import BY_NAME, Quantity
from sessions.report.tables import Cell, Format, Row, Table, estimate_cell, number_cell, range_cell, table
from sessions.report.trials import model_in_short
from sessions.report.wording import NONE, caption, digits, p_value, places, plural, sed, significant, tau, three_figures
from sessions.statistics.findings import INDEX, LEVELS, NOISE, UNITS, DescriptorFindings, StudyFindings
from sessions.statistics.mixed_model import INTERCEPT, MixedModel, Spread, Term
from sessions.statistics.pooled import response_term
from sessions.statistics.scores import bounds, by_key
from sessions.statistics.visit import TrialRow, Visit, exclusion_of


def study_model(study: StudyFindings) -> str:
    """Return in a few words which model a study's SEDs are of."""
    return model_in_short(study.options.prediction, study.options.area)


def models_table(study: StudyFindings) -> Table | None:
    """Return the mixed models of scores on the model's response and on index, with how far subjects differ."""
    quantity = BY_NAME[study.response]
    groups = [
        (
            f"{one.descriptor}: score on {what}, {model.n} scores of {plural(model.subjects, 'subject')}"
            f"{', singular fit' if model.singular else ''}",
            _terms(model, quantity),
        )
        for one in study.descriptors
        for what, model in _models(one, study)
        if not isinstance(model, str)
    ]
    words = caption("study-models", label=quantity.label)
    return table("table-models", words, "term | unit | estimate | 95 % interval | p", groups)


def _models(one: DescriptorFindings, study: StudyFindings) -> tuple[tuple[str, MixedModel | str], ...]:
    """Return the mixed models of a descriptor, each with what the score stands on."""
    label = BY_NAME[study.response].label
    return (label, one.on_response), ("index", one.on_index), ("index and µ", one.on_friction)


def missing_models(study: StudyFindings) -> list[str]:
    """Return why there is no correlation of means, and no mixed model: a sentence for each reason."""
    by_reason = by_key(
        (model, f"{one.descriptor} on {what}")
        for one in study.descriptors
        for what, model in _models(one, study)
        if isinstance(model, str)
    )
    return [
        *(
            f"No correlation of means on {one.descriptor}: {r.reason}."
            for one in study.descriptors
            if (r := one.mean_relation) is not None and r.pearson is None
        ),
        *(f"No mixed model of {', '.join(names)}: {why}." for why, names in by_reason.items()),
    ]


def missing_scores(study: StudyFindings) -> list[str]:
    """Return why there is no agreement, and no difference of surfaces: a sentence for each reason."""
    sentences: list[str] = []
    for one in study.descriptors:
        whole = sum(None not in answers for answers in one.answers.values())
        have = f"{one.descriptor} has {plural(whole, 'such subject')} and {plural(len(one.indices), 'surface')}"
        if not one.scores:
            continue
        order = "it takes two subjects who scored each of three surfaces or more, not all alike"
        within = "they take two subjects who scored each of two surfaces"
        pairs = "it takes three subjects who scored both, not all with the same difference"
        index_pairs = {(pair.low_index, pair.high_index) for pair in one.differences}
        indices = sorted(mean.index for mean in one.scores)
        without = [f"{b} − {a}" for a, b in combinations(indices, 2) if (a, b) not in index_pairs]
        sentences += [] if one.agreement else [f"No agreement on the order: {order}; {have}."]
        sentences += [] if one.within else [f"No intervals within subjects: {within}; {have}."]
        if without:
            which = f" {', '.join(without)}" if one.differences else ""
            sentences.append(f"No difference{'' if which else 's'} of surfaces{which} of {one.descriptor}: {pairs}.")
    return sentences


def _terms(model: MixedModel, quantity: Quantity) -> Iterable[Row]:
    first, (unit, _) = model.terms[1].name, quantity.shown_unit
    units = {response_term(quantity): f"points per {unit}", **UNITS}
    middle = f"{digits(model.middle, 3)} {unit}" if first != INDEX else f"index {digits(50 + model.middle, 1)}"

    def row(name: str, unit: str, value: float, of: Term | Spread, p: str = NONE) -> Row:
        return (name, unit, three_figures(value), range_cell(of.low, of.high, three_figures), p)

    names = {INTERCEPT: f"level at {middle}"}
    for t in model.terms:
        yield row(names.get(t.name, t.name), units.get(t.name, "points"), t.estimate, t, p_value(t.p))
    of = model.spreads
    if of is not None:
        slopes = ("spread of subjects' slopes", units[first], of.slope)
        for name, unit, s in ((LEVELS, "points", of.level), slopes, (NOISE, "points", of.left)):
            if s is not None:
                yield row(name, unit, s.sd, s)


def ground_truth_table(study: StudyFindings) -> Table | None:
    """Return the true effects of a simulated study beside their estimates."""
    rows = tuple(
        (
            one.descriptor,
            one.effect,
            UNITS[one.effect],
            three_figures(one.true_value),
            three_figures(one.estimate),
            range_cell(one.low, one.high, three_figures),
            "yes" if one.covered else "no",
        )
        for one in study.effects
    )
    columns = "descriptor | effect | unit | true | estimated | 95 % interval | inside"
    return table("table-planted", caption("study-ground-truth"), columns, [("", rows)])


def flaws_table(study: StudyFindings) -> Table | None:
    """Return what went wrong in a simulated study, and whether the analysis detected it."""
    rows = tuple((one.session, one.expected, "yes" if one.detected else "no") for one in study.flaws)
    return table("table-planted-flaws", caption("study-flaws"), "session | simulated | detected", [("", rows)])


_FEW = "too few readings"
_MOST_TRIALS = 400  # of which the page shows a table; `trials.csv` holds those of any study


def trials_table(study: StudyFindings) -> Table | None:
    """Return every trial with what was scored, measured and predicted; None where they are too many for a page."""
    if sum(len(visit.rows) for visit in study.visits) > _MOST_TRIALS:
        return None
    columns = (
        "trial | index | score [0–100] | µ [1] | τ max [kPa] | N [N] | speed [mm/s] | SED [kPa] | "
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
    words = caption("study-trials", calibrations=calibrations, model=study_model(study))
    return table("table-trials", words, columns, groups)


def _exclusion_note(study: StudyFindings, visit: Visit, descriptor: str) -> str:
    if visit.session in dict(study.copies):
        return " (a copy: counts nothing)"
    return (
        "" if exclusion_of(study.excluded, visit.subject, descriptor) is None else " (left out of every number above)"
    )


def _row(row: TrialRow) -> Row:
    answer = row.score if row.score is not None else row.estimate
    why = row.why or "withheld: the flaws say why"

    def estimate(name: str, as_text: Format, unit: float = 1.0, without: str = _FEW) -> Cell:
        interval = bounds(getattr(row, f"{name}_low"), getattr(row, f"{name}_high"))
        return estimate_cell(getattr(row, name), as_text, why, interval, without, unit=unit)

    return (
        row.trial,
        row.index,
        number_cell(answer, places(1), f"no score: {row.outcome}"),
        estimate("mu", places(3)),
        estimate("tau_max", tau, 1e3),
        estimate("normal_force", places(2)),
        estimate("speed", places(1)),
        estimate("sed", sed, 1e3, row.sed_interval),
        number_cell(row.error_estimate, lambda v: significant(100 * v, 2), why),
        ", ".join(flaw.replace("_", " ") for flaw in row.flaws) or "none",
    )
