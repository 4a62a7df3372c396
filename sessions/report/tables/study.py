"""Tables of a study's page: visits, scores, surfaces and correlations."""

import math
from collections.abc import Callable, Iterable, Sequence
from itertools import chain
from operator import itemgetter

from sessions.prediction import BY_NAME
from sessions.report.tables import Cell, Format, Row, Table, number_cell, range_cell, sections_of, table
from sessions.report.tables.rivals import levels_of_rivals, rival_tables
from sessions.report.tables.scales import latent_table, psychometric_table, scales_table, study_functions
from sessions.report.tables.session import paths_table, rank_interval, score_cells, spread_cell
from sessions.report.tables.study_models import (
    answer_of,
    flaws_table,
    ground_truth_table,
    models_table,
    study_model,
    trials_table,
)
from sessions.report.wording import (
    NONE,
    correlation,
    digits,
    p_value,
    places,
    shown_response,
    significant,
    three_figures,
)
from sessions.statistics.correlations import Relation
from sessions.statistics.findings import DescriptorFindings, StudyFindings
from sessions.statistics.scores import Average, no_interval
from sessions.statistics.visit import Visit
from sessions.statistics.within_subjects import RepeatedCorrelation

RowsOf = Callable[[DescriptorFindings], Iterable[Row]]


def study_tables(study: StudyFindings) -> dict[str, tuple[Table, ...]]:
    """Return the tables of a study that have numbers, by section."""
    sections = {
        "relation": (_relation(study),),
        "scores": (
            _scores(study),
            _normalised_scores(study),
            _differences(study),
            _agreement(study),
            _estimates(study),
            scales_table(study.descriptors),
            latent_table(study.descriptors),
            psychometric_table(study_functions(study)),
        ),
        "surfaces": (_surfaces(study), _forces(study)),
        "rivals": _rivals(study),
        "models": (models_table(study),),
        "visits": (_visits(study),),
        "paths": (paths_table((findings.descriptor, findings.paths) for findings in study.descriptors),),
        "ground_truth": (ground_truth_table(study), flaws_table(study)),
        "trials": (trials_table(study),),
    }
    return sections_of(sections)


def _visits(study: StudyFindings) -> Table | None:
    def row(visit: Visit) -> Row:
        exclusions = ["nothing"] if visit.session in dict(study.copies) else []
        exclusions += [e.descriptor or "nothing" for e in study.excluded if e.subject == visit.subject]
        return (
            visit.session,
            visit.subject,
            f"{sum(answer_of(row) is not None for row in visit.rows)} of {len(visit.rows)}",
            str(sum(row.sed is not None for row in visit.rows)) if visit.forces else NONE,
            "yes" if visit.complete else "no",
            sum(bool(row.flaws) for row in visit.rows),
            "yes" if not exclusions else ("no" if "nothing" in exclusions else f"without {', '.join(exclusions)}"),
        )

    columns = "session | subject | answers | strokes with SED | ended as planned | flawed trials | counted"
    return table("table-visits", "study-visits", columns, [("", map(row, study.visits))])


def _scores(study: StudyFindings) -> Table | None:

    def rows(findings: DescriptorFindings) -> Iterable[Row]:
        within = {mean.index: mean for mean in findings.within}
        for mean in findings.scores:
            within_mean = within.get(mean.index)
            *cells, spread = score_cells(mean)
            low, high = (None, None) if within_mean is None else (within_mean.low, within_mean.high)
            yield (*cells, range_cell(low, high, places(1), _NOT_WITHIN), spread)

    columns = (
        "index | subjects | mean score [0–100] | 95 % interval of the mean [0–100] | "
        "within subjects [0–100] | standard deviation [0–100]"
    )
    complete = ", ".join(f"{d.within[0].n} for {d.descriptor}" for d in study.descriptors if d.within)
    return _table(study, "table-scores", "study-scores", columns, rows, complete=complete or "fewer than two")


def _agreement(study: StudyFindings) -> Table | None:
    agreements = ((findings.descriptor, findings.agreement) for findings in study.descriptors)
    rows = [
        (descriptor, fit.n, digits(fit.kendall_w, 2), p_value(fit.friedman_p), p_value(fit.page_p))
        for descriptor, fit in agreements
        if fit is not None
    ]
    columns = "descriptor | subjects | Kendall's W | Friedman's p | Page's p"
    return table("table-agreement", "study-agreement", columns, [("", rows)])


def _normalised_scores(study: StudyFindings) -> Table | None:

    def rows(findings: DescriptorFindings) -> Iterable[Row]:
        raw = {mean.index: mean for mean in findings.scores}
        for index, mean in findings.normalised.means.items():
            plain = raw[index]
            interval = range_cell(plain.low, plain.high, places(1), plain.reason)
            yield (index, plain.n, digits(plain.mean, 1), interval, mean.n, *_mean(mean, places(2)))

    columns = (
        "index | subjects | as given [0–100] | 95 % interval [0–100] | subjects | standardised [1] | 95 % interval [1]"
    )
    return _table(study, "table-normalised", "study-normalised", columns, rows)


def _differences(study: StudyFindings) -> Table | None:
    def rows(findings: DescriptorFindings) -> Iterable[Row]:
        for pair in findings.differences:
            name = f"{pair.high_index} − {pair.low_index}"
            interval = range_cell(pair.low, pair.high, places(1))
            yield (name, pair.n, digits(pair.mean, 1), interval, p_value(pair.p), p_value(pair.p_holm))

    columns = "index | subjects | difference of scores [0–100] | 95 % interval [0–100] | p | p, Holm"
    return _table(study, "table-differences", "study-differences", columns, rows)


def _estimates(study: StudyFindings) -> Table | None:

    def from_log(log: float) -> str:
        return three_figures(math.exp(log))

    def rows(findings: DescriptorFindings) -> Iterable[Row]:
        if findings.estimates is None:
            return
        for index, geometric in findings.estimates.geometric.items():
            means = (geometric, findings.estimates.equal_moduli[index])
            yield (index, geometric.n, *(cell for mean in means for cell in _mean(mean, from_log)))

    columns = "index | subjects | geometric mean | 95 % interval | at one modulus | 95 % interval"
    left_out = {d.descriptor: d.estimates.left_out for d in study.descriptors if d.estimates and d.estimates.left_out}
    subjects = "; ".join(f"{descriptor}: {', '.join(names)}" for descriptor, names in left_out.items())
    note = f" Left out for an estimate that is not above 0: {subjects}." if subjects else ""
    return _table(study, "table-estimates", "study-estimates", columns, rows, left=note)


def _surfaces(study: StudyFindings) -> Table | None:

    def rows(findings: DescriptorFindings) -> Iterable[Row]:
        for surface in findings.surfaces if any(s.subjects for s in findings.surfaces) else ():
            cells = (*_mean(surface.mu, places(3)), *_mean(surface.response, in_unit))
            yield (surface.index, surface.subjects, *cells, _spread(surface.response, quantity.factor))

    def in_unit(response: float) -> str:
        return digits(quantity.factor * response, quantity.places)

    quantity = shown_response(study.response)
    unit = quantity.unit
    columns = (
        f"index | subjects | µ [1] | 95 % interval [1] | {quantity.label} [{unit}] | 95 % interval [{unit}] | "
        f"standard deviation [{unit}]"
    )
    return _table(study, "table-surfaces", "study-surfaces", columns, rows)


def _spread(mean: Average | None, factor: float) -> Cell:
    if mean is None:
        return number_cell(None, str, _NO_STROKE)
    sd = None if mean.sd is None else factor * mean.sd
    return spread_cell(sd, mean.n, lambda v: significant(v, 2), "one subject alone has no spread")


def _forces(study: StudyFindings) -> Table | None:

    def rows(findings: DescriptorFindings) -> Iterable[Row]:
        for surface in findings.surfaces:
            if surface.normal_force is not None or surface.model_normal_force is not None:
                numbers = (surface.normal_force, surface.model_normal_force, surface.matching_depth)
                cells = chain.from_iterable(_mean(number, places(2)) for number in numbers)
                yield (surface.index, surface.subjects, *cells)

    columns = (
        "index | subjects | measured N [N] | 95 % interval [N] | model N [N] | 95 % interval [N] | "
        "depth to match [mm] | 95 % interval [mm]"
    )
    return _table(study, "table-forces", "study-forces", columns, rows)


_NOT_WITHIN = "no interval: no two subjects scored every surface, or their differences between surfaces are the same"
_NOT_OF_PEOPLE = "no interval for fewer than three subjects, for identical ones, or for a perfect r"
_NO_STROKE = "no subject's stroke gives this number"


def _mean(mean: Average | None, as_text: Format) -> Row:
    """Return a mean and its interval, or dashes with the reason."""
    if mean is None:
        return (number_cell(None, str, _NO_STROKE),) * 2
    return as_text(mean.mean), range_cell(mean.low, mean.high, as_text, no_interval(mean))


def _relation(study: StudyFindings) -> Table | None:

    def rows(findings: DescriptorFindings) -> tuple[Row, ...]:
        of_estimates = None if findings.estimates is None else findings.estimates.repeated
        if findings.single_subject:
            return (
                *_of_means(f"scores of {findings.single_subject}", findings.mean_relation),
                *_within_subjects("its single trials", findings.repeated),
                *_within_subjects("within, log estimates", of_estimates),
            )
        return (
            *_of_means("means", findings.mean_relation),
            *_of_means("means, standardised", findings.normalised.mean_relation),
            *_within_subjects("within subjects", findings.repeated, findings.repeated_holm, findings.without_subject),
            *_within_subjects("within each block", findings.repeated_in_blocks),
            *_within_subjects("within, possible states", findings.repeated_possible if findings.doubtful else None),
            *_within_subjects("within, standardised", findings.normalised.repeated),
            *_within_subjects("within, log estimates", of_estimates),
        )

    columns = "scores | n | r | 95 % interval | rho | 95 % interval of rho | p | p, Holm | r with one left out"
    return _table(study, "table-relation", "study-relation", columns, rows)


def _rivals(study: StudyFindings) -> tuple[Table | None, ...]:
    rival_groups = [group for findings in study.descriptors for group in levels_of_rivals(findings)]
    return rival_tables(rival_groups, BY_NAME[study.response].label, study_model(study))


def _of_means(name: str, relation: Relation | None) -> Iterable[Row]:
    if relation is not None and relation.pearson is not None:
        yield (
            name,
            f"{relation.n} surfaces",
            correlation(relation.pearson),
            range_cell(relation.low, relation.high, correlation, relation.reason),
            _or_dash(relation.spearman, correlation),
            rank_interval(relation),
            _or_dash(relation.spearman_p, p_value),
            NONE,
            _without([(f"index {label}", r) for label, r in relation.without if r is not None]),
        )


def _within_subjects(
    name: str,
    repeated: RepeatedCorrelation | None,
    adjusted: float | None = None,
    without: Sequence[tuple[str, float]] = (),
) -> Iterable[Row]:
    if repeated is not None:
        yield (
            name,
            f"{repeated.dof} d.f.",
            correlation(repeated.r),
            range_cell(*(repeated.people or (None, None)), correlation, _NOT_OF_PEOPLE),
            NONE,
            NONE,
            _or_dash(repeated.people_p, p_value),
            _or_dash(adjusted, p_value),
            _without(without),
        )


def _or_dash(value: float | None, as_text: Format) -> str:
    return NONE if value is None else as_text(value)


def _without(left_out: Sequence[tuple[str, float]]) -> str:
    if not left_out:
        return NONE
    extremes = min(left_out, key=itemgetter(1)), max(left_out, key=itemgetter(1))
    return ", ".join(f"{correlation(r)} ({name})" for name, r in extremes)


def _table(study: StudyFindings, name: str, caption: str, columns: str, rows: RowsOf, **values: str) -> Table | None:
    """Return a table with the rows of each descriptor under its name."""
    groups = ((findings.descriptor, rows(findings)) for findings in study.descriptors)
    model = {"label": BY_NAME[study.response].label, "model": study_model(study)}
    return table(name, caption, columns, groups, **model, **values)
