"""Tables of a study's page: visits, scores, surfaces and correlations."""

import math
from collections.abc import Callable, Iterable, Sequence

from sessions.prediction import BY_NAME
from sessions.report.tables import Cell, Format, Row, Table, number_cell, range_cell, sections_of, table
from sessions.report.tables.rivals import rival_tables
from sessions.report.tables.scales import latent_table, psychometric_table, scales_table, study_functions
from sessions.report.tables.session import paths_table, rank_interval, score_cells, spread_cell
from sessions.report.tables.study_models import flaws_table, ground_truth_table, models_table, study_model, trials_table
from sessions.report.wording import (
    NONE,
    caption,
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
    """Return the tables a study has numbers for, by section."""
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
        "paths": (paths_table((one.descriptor, one.paths) for one in study.descriptors),),
        "ground_truth": (ground_truth_table(study), flaws_table(study)),
        "trials": (trials_table(study),),
    }
    return sections_of(sections)


def _visits(study: StudyFindings) -> Table | None:
    def row(visit: Visit) -> Row:
        out = ["nothing"] if visit.session in dict(study.copies) else []
        out += [e.descriptor or "nothing" for e in study.excluded if e.subject == visit.subject]
        return (
            visit.session,
            visit.subject,
            f"{sum(row.score is not None for row in visit.rows)} of {len(visit.rows)}",
            str(sum(row.sed is not None for row in visit.rows)) if visit.forces else NONE,
            "yes" if visit.complete else "no",
            sum(bool(row.flaws) for row in visit.rows),
            "yes" if not out else ("no" if "nothing" in out else f"without {', '.join(out)}"),
        )

    columns = "session | subject | answers | strokes with SED | ended as planned | flawed trials | counted"
    return table("table-visits", caption("study-visits"), columns, [("", map(row, study.visits))])


def _scores(study: StudyFindings) -> Table | None:

    def rows(one: DescriptorFindings) -> Iterable[Row]:
        within = {mean.index: mean for mean in one.within}
        for mean in one.scores:
            inner = within.get(mean.index)
            *cells, spread = score_cells(mean)
            low, high = (None, None) if inner is None else (inner.low, inner.high)
            yield (*cells, range_cell(low, high, places(1), _NOT_WITHIN), spread)

    columns = (
        "index | subjects | mean score [0–100] | 95 % interval of the mean [0–100] | "
        "within subjects [0–100] | standard deviation [0–100]"
    )
    complete = ", ".join(f"{one.within[0].n} for {one.descriptor}" for one in study.descriptors if one.within)
    words = caption("study-scores", complete=complete or "none")
    return _table(study, "table-scores", words, columns, rows)


def _agreement(study: StudyFindings) -> Table | None:
    rows = tuple(
        (one.descriptor, of.n, digits(of.kendall_w, 2), p_value(of.friedman_p), p_value(of.page_p))
        for one in study.descriptors
        if (of := one.agreement) is not None
    )
    columns = "descriptor | subjects | Kendall's W | Friedman's p | Page's p"
    return table("table-agreement", caption("study-agreement"), columns, [("", rows)])


def _normalised_scores(study: StudyFindings) -> Table | None:

    def rows(one: DescriptorFindings) -> Iterable[Row]:
        raw = {mean.index: mean for mean in one.scores}
        for index, mean in one.normalised.means.items():
            plain = raw[index]
            ends = range_cell(plain.low, plain.high, places(1), plain.reason)
            yield (index, plain.n, digits(plain.mean, 1), ends, mean.n, *_mean(mean, places(2)))

    columns = (
        "index | subjects | as given [0–100] | 95 % interval [0–100] | subjects | standardised [1] | 95 % interval [1]"
    )
    return _table(study, "table-normalised", caption("study-normalised"), columns, rows)


def _differences(study: StudyFindings) -> Table | None:
    def rows(one: DescriptorFindings) -> Iterable[Row]:
        for pair in one.differences:
            name = f"{pair.high_index} − {pair.low_index}"
            ends = range_cell(pair.low, pair.high, places(1))
            yield (name, pair.n, digits(pair.mean, 1), ends, p_value(pair.p), p_value(pair.p_holm))

    columns = "index | subjects | difference of scores [0–100] | 95 % interval [0–100] | p | p, Holm"
    return _table(study, "table-differences", caption("study-differences"), columns, rows)


def _estimates(study: StudyFindings) -> Table | None:

    def from_log(log: float) -> str:
        return three_figures(math.exp(log))

    def rows(one: DescriptorFindings) -> Iterable[Row]:
        if one.estimates is None:
            return
        for index, geometric in one.estimates.geometric.items():
            means = (geometric, one.estimates.equal_moduli[index])
            yield (index, geometric.n, *(cell for mean in means for cell in _mean(mean, from_log)))

    columns = "index | subjects | geometric mean | 95 % interval | at one modulus | 95 % interval"
    out = [f"{o.descriptor}: {', '.join(s)}" for o in study.descriptors if o.estimates and (s := o.estimates.left_out)]
    note = f" Left out for an estimate that is not above 0: {'; '.join(out)}." if out else ""
    return _table(study, "table-estimates", caption("study-estimates", left=note), columns, rows)


def _surfaces(study: StudyFindings) -> Table | None:

    def row(one: DescriptorFindings) -> Iterable[Row]:
        for s in one.surfaces if any(s.subjects for s in one.surfaces) else ():
            cells = (*_mean(s.mu, places(3)), *_mean(s.response, in_unit))
            yield (s.index, s.subjects, *cells, _spread(s.response, quantity.factor))

    def in_unit(response: float) -> str:
        return digits(quantity.factor * response, quantity.places)

    quantity = shown_response(study.response)
    unit = quantity.unit
    columns = (
        f"index | subjects | µ [1] | 95 % interval [1] | {quantity.label} [{unit}] | 95 % interval [{unit}] | "
        f"standard deviation [{unit}]"
    )
    words = caption("study-surfaces", label=quantity.label, model=study_model(study))
    return _table(study, "table-surfaces", words, columns, row)


def _spread(mean: Average | None, factor: float) -> Cell:
    if mean is None:
        return number_cell(None, str, _NO_STROKE)
    sd = None if mean.sd is None else factor * mean.sd
    return spread_cell(sd, mean.n, lambda v: significant(v, 2), "one subject alone has no spread")


def _forces(study: StudyFindings) -> Table | None:

    def row(one: DescriptorFindings) -> Iterable[Row]:
        for s in one.surfaces:
            if s.normal_force is not None or s.model_normal_force is not None:
                numbers = (s.normal_force, s.model_normal_force, s.matching_depth)
                yield (s.index, s.subjects, *(cell for number in numbers for cell in _mean(number, places(2))))

    columns = (
        "index | subjects | measured N [N] | 95 % interval [N] | model N [N] | 95 % interval [N] | "
        "depth to match [mm] | 95 % interval [mm]"
    )
    return _table(study, "table-forces", caption("study-forces", model=study_model(study)), columns, row)


_NOT_WITHIN = "no interval: no two subjects scored every surface, or they differ alike between surfaces"
_NOT_OF_PEOPLE = "no interval of two subjects, of some who are all alike, or of a perfect r"
_NO_STROKE = "no subject's stroke gives this number"


def _mean(mean: Average | None, as_text: Format) -> Row:
    """Return a mean and its interval, or dashes with the reason."""
    if mean is None:
        return (number_cell(None, str, _NO_STROKE),) * 2
    return as_text(mean.mean), range_cell(mean.low, mean.high, as_text, no_interval(mean))


def _relation(study: StudyFindings) -> Table | None:

    def rows(one: DescriptorFindings) -> tuple[Row, ...]:
        of_estimates = None if one.estimates is None else one.estimates.repeated
        return (
            *_of_means("means", one.mean_relation),
            *_of_means("means, standardised", one.normalised.mean_relation),
            *_within_subjects("within subjects", one.repeated, one.repeated_holm, one.without_subject),
            *_within_subjects("within, standardised", one.normalised.repeated),
            *_within_subjects("within, log estimates", of_estimates),
        )

    columns = "scores | n | r | 95 % interval | rho | 95 % interval of rho | p | p, Holm | r with one left out"
    words = caption("study-relation", label=BY_NAME[study.response].label, model=study_model(study))
    return _table(study, "table-relation", words, columns, rows)


def _rivals(study: StudyFindings) -> tuple[Table | None, ...]:
    rival_groups = [
        (f"{one.descriptor}, {kind}", rivals)
        for one in study.descriptors
        for kind, rivals in (("means over subjects", one.rivals_of_means), ("within subjects", one.rivals))
    ]
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
    least, greatest = min(left_out, key=lambda one: one[1]), max(left_out, key=lambda one: one[1])
    return ", ".join(f"{correlation(r)} ({name})" for name, r in (least, greatest))


def _table(study: StudyFindings, name: str, words: str, columns: str, rows: RowsOf) -> Table | None:
    """Return a table with the rows of each descriptor under its name."""
    return table(name, words, columns, ((one.descriptor, rows(one)) for one in study.descriptors))
