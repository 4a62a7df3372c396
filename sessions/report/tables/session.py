"""The tables of a session: strokes, scores, their relation to predictions, and the ground truth."""

from collections.abc import Callable, Iterable, Sequence
from functools import partial

from sessions.prediction import BY_NAME
from sessions.report.contents import GroundTruth, Report, StrokeFinding
from sessions.report.tables import (
    TOO_SHORT,
    Cell,
    Format,
    Row,
    Rows,
    Table,
    estimate_cell,
    group_by_experiment,
    number_cell,
    range_cell,
    sections_of,
    table,
)
from sessions.report.tables import predictions as of_predictions
from sessions.report.tables.rivals import rival_tables
from sessions.report.tables.scales import psychometric_table, session_functions
from sessions.report.wording import (
    NONE,
    capital,
    correlation,
    digits,
    identifier,
    p_value,
    places,
    shown_response,
    significant,
    tau,
    with_sign,
)
from sessions.statistics.correlations import Relation, slope_interval
from sessions.statistics.multiverse import (
    CHOICE_LABELS,
    SAME,
    FiveNumberSummary,
    PathFinding,
    by_choice,
    correlations,
    five_number_summary,
)
from sessions.statistics.scores import MeanScore, sd_interval

_WITHOUT = {
    "onset": "the force had left its noise before, or too few readings measure its noise",
    "break_away": "too few readings to fit the rise of T/N",
    "slide_onset": "too few readings to measure the speed",
}
_WHY_MISSING = {
    "break_away": "T/N does not rise before the slide, so there is no stick phase, or rises on while it slides",
    "slide_onset": "the start of the slide cannot be determined",
}
_OF_DECISION = {"onset": "onset", "break_away": "stick", "slide_onset": "slide_onset"}


def stroke_table(report: Report) -> Table | None:
    """Return the strokes with their friction, speed and flaws, each number over its interval."""
    columns = "µ static [1] | µ dynamic [1] | µ maximum [1] | τ max [kPa] | speed [mm/s] | direction | flaws"

    def row(stroke: StrokeFinding) -> Row:
        cell = partial(_estimate, stroke)
        return (
            cell("mu_static", places(3)),
            cell("mu_dynamic", places(3)),
            cell("mu_max", places(3)),
            cell("tau_max", tau, unit=1e3),
            cell("speed", places(1)),
            number_cell(stroke.direction, lambda v: "p → d" if v > 0 else "d → p", stroke.reasons.get("direction")),
            ", ".join(name.replace("_", " ") for name in stroke.flaws) or "none",
        )

    interval_note = f" Under each number: {report.interval_kind}." if report.interval_kind else ""
    return _table(report, "table-strokes", "session-strokes", columns, row, kind=interval_note, area=report.area)


def course_table(report: Report) -> Table | None:
    """Return each stroke's forces, direction and instants, each over its bootstrap interval."""
    if not any(stroke.bootstrap for stroke in report.strokes):
        return None
    columns = (
        "normal force [N] | tangential force [N] | heading [°] | agree [1] | "
        "onset [s] | break-away [s] | slide onset [s]"
    )

    def row(stroke: StrokeFinding) -> Row:
        cell = partial(_estimate, stroke)
        reason = stroke.reasons.get("direction") or TOO_SHORT
        return (
            cell("normal_force", places(2)),
            cell("tangential_force", places(2)),
            cell("heading", places(1)),
            number_cell(stroke.direction_agrees, places(3), reason),
            cell("onset", places(3)),
            cell("break_away", places(3)),
            cell("slide_onset", places(3)),
        )

    kinds = "; ".join(f"{name.replace('_', ' ')}: {kind}" for name, kind in report.interval_kinds.items())
    return _table(report, "table-courses", "session-courses", columns, row, kinds=kinds)


def _table(
    report: Report, name: str, caption: str, columns: str, row: Callable[[StrokeFinding], Row], **values: str
) -> Table | None:
    """Return a table of strokes by experiment, each with its trial and index if there are trials."""
    planned = any(stroke.trial is not None for stroke in report.strokes)

    def name_row(stroke: StrokeFinding) -> Row:
        if not planned:
            return (stroke.number, *row(stroke))
        cell = partial(number_cell, as_text=places(0), reason="no trial asks for it")
        by_code = stroke.index is None and stroke.code
        return (stroke.number, cell(stroke.trial), stroke.code if by_code else cell(stroke.index), *row(stroke))

    groups = group_by_experiment(report, report.strokes, lambda s: s.experiment, name_row)
    columns = f"{'stroke | trial | index' if planned else 'stroke'} | {columns}"
    return table(name, caption, columns, groups, **values)


def _estimate(stroke: StrokeFinding, name: str, as_text: Format, unit: float = 1.0) -> Cell:
    """Return one number of a stroke over its bootstrap interval, or why it has none."""
    without = "a person decided it" if _OF_DECISION.get(name) in stroke.decided else _WITHOUT.get(name, TOO_SHORT)
    reason = stroke.reasons.get(name) or _WHY_MISSING.get(name)
    return estimate_cell(getattr(stroke, name), as_text, reason, stroke.bootstrap.get(name), without, unit=unit)


def ground_truth_table(report: Report) -> Table | None:
    """Return the simulator's ground truth next to the results of the analysis."""
    # The model uses the first of several strokes in a trial.
    strokes_by_trial = {stroke.trial: stroke for stroke in reversed(report.strokes) if stroke.trial is not None}
    predictions = {prediction.trial: prediction for prediction in report.predictions}
    columns = (
        "trial | index | true µ [1] | estimated µ [1] | off by [%] | true τ max [kPa] | estimated τ max [kPa] | "
        "off by [%] | true speed [mm/s] | estimated speed [mm/s] | off by [%] | direction"
    )

    def row(trial: GroundTruth) -> Row:
        stroke, prediction = strokes_by_trial.get(trial.trial), predictions.get(trial.trial)
        first = stroke or prediction
        index = NONE if first is None or first.index is None else str(first.index)
        cells: list[Cell | str | int] = [trial.trial, index]
        name, mu = of_predictions.model_mu(stroke, prediction)
        quantities: tuple[tuple[str, float, float | None, Format, float], ...] = (
            (name, trial.mu, mu, places(3), 1.0),
            ("tau_max", trial.tau_max, stroke.tau_max if stroke else None, tau, 1e3),
            ("speed", trial.speed, stroke.speed if stroke else None, places(1), 1.0),
        )
        for name, truth, value, as_text, unit in quantities:
            reason = stroke.reasons.get(name) if stroke else "no stroke was found in this trial"
            interval = stroke.bootstrap.get(name) if stroke else None
            cell = estimate_cell(value, as_text, reason, interval, TOO_SHORT, unit=unit)
            error = None if value is None else 100 * (value / truth - 1)
            cells += [as_text(truth), cell, number_cell(error, with_sign, reason)]
        agrees = stroke is not None and stroke.direction == trial.direction
        cells.append(Cell("right" if agrees else NONE if stroke is None or stroke.direction is None else "wrong"))
        return tuple(cells)

    names = {trial: finding.experiment for trial, finding in {**predictions, **strokes_by_trial}.items()}
    groups = group_by_experiment(report, report.ground_truth, lambda trial: names.get(trial.trial, ""), row)
    return table("table-planted", "session-ground-truth", columns, groups)


def score_table(report: Report) -> Table | None:
    """Return mean scores with their intervals."""
    groups = [(e.name, [score_cells(m) for m in e.scores]) for e in report.experiments]
    columns = "index | subjects | mean score [0–100] | 95 % interval of the mean [0–100] | standard deviation [0–100]"
    return table("table-scores", "session-scores", columns, groups)


def score_cells(mean: MeanScore) -> Row:
    """Return index, subjects, mean score, its interval and standard deviation; for a session or a study."""
    interval = range_cell(mean.low, mean.high, places(1), mean.reason)
    sd = spread_cell(mean.sd, mean.n, places(1), mean.reason)
    return mean.index, mean.n, digits(mean.mean, 1), interval, sd


def spread_cell(sd: float | None, n: int, as_text: Format, reason: str | None) -> Cell:
    """Return the standard deviation of n values over its interval."""
    return estimate_cell(sd, as_text, reason, sd_interval(sd, n) if sd else None, "all are the same")


def answer_tables(report: Report) -> tuple[Table | None, ...]:
    """Return every subject's scores, a table for each experiment."""
    tables: list[Table | None] = []
    for experiment in report.experiments:
        answers = experiment.answers.items()
        rows = [(subject, *(number_cell(s, places(1), "no score") for s in scores)) for subject, scores in answers]
        columns = " | ".join(["subject", *(f"index {index}" for index in experiment.indices)])
        name = f"table-answers-{identifier(experiment.name)}"
        tables.append(table(name, "session-answers", columns, [("", rows)], block=experiment.name))
    return tuple(tables)


def relation_table(report: Report) -> Table | None:
    """Return the relation of the predicted quantity to mean scores and to indices."""
    quantity = shown_response(report.response)
    groups: list[Rows] = []
    for e in report.experiments:
        relations = {e.score_name: e.score_relation, "own score": e.own_relation, "index": e.index_relation}
        groups.append((e.name, [_relation_row(name, r) for name, r in relations.items() if r is not None]))
    columns = (
        f"{quantity.label} against | stimuli | Pearson's r | 95 % interval | Spearman's rho | rho's 95 % interval | "
        f"exact p of rho | slope [{quantity.step} a point] | r without one"
    )
    any_own = any(experiment.own_relation is not None for experiment in report.experiments)
    texts = {
        "own": "The forces are those of one subject, whose scores are the own ones. " if any_own else "",
        "scores": "scores and to " if report.scored else "",
    }
    model = {"label": quantity.label, "model": report.model}
    return table("table-relation", "session-relation", columns, groups, **model, **texts)


def rank_interval(relation: Relation) -> Cell:
    """Return the interval of Spearman's rho, or why it has none."""
    reason = "no interval of a perfect rho" if relation.n > 3 else f"no interval of rho from {relation.n} points"
    reason = relation.reason if relation.spearman is None else reason
    return range_cell(relation.spearman_low, relation.spearman_high, correlation, reason)


def _relation_row(name: str, relation: Relation) -> Row:
    without = [(label, NONE if r is None else correlation(r)) for label, r in relation.without]
    no_slope = "no interval of a line through two points, or through points exactly on it"

    def in_millionths(slope: float) -> str:
        return significant(1e6 * slope, 3)

    return (
        name,
        relation.n,
        number_cell(relation.pearson, correlation, relation.reason),
        range_cell(relation.low, relation.high, correlation, relation.reason),
        number_cell(relation.spearman, correlation, relation.reason),
        rank_interval(relation),
        number_cell(relation.spearman_p, p_value, relation.reason or "too many orders to count"),
        estimate_cell(relation.slope, in_millionths, relation.reason, slope_interval(relation), no_slope, unit=1e6),
        ", ".join(f"{label}:\N{NO-BREAK SPACE}{r}" for label, r in without),
    )


def paths_table(path_groups: Iterable[tuple[str, Sequence[PathFinding]]]) -> Table | None:
    """Return five-number summaries of the correlation over all paths and over those with each choice, by descriptor."""
    groups = [(name, _rows(findings)) for name, findings in path_groups if findings]
    columns = (
        "choice |  | usual | paths with r | different r | least | lower quartile | median | upper quartile | greatest"
    )
    return table("table-paths", "paths", columns, groups, same=SAME)


def paths_sentence(name: str, findings: Sequence[PathFinding], single_subject: str = "") -> str:
    """Return a sentence on the distribution of the correlation, and the number of paths with the opposite sign.

    `single_subject` is the code of the only subject of a study.
    """
    values = correlations(findings)
    summary = five_number_summary(values)
    usual_values = [r for r, finding in zip(values, findings, strict=True) if finding.usual]
    usual = next((r for r in usual_values if r), 0.0)
    start = f"{capital(name)}: of {len(findings)} paths of the analysis"
    if summary is None:
        return f"{start} none gives a correlation."
    opposite_count = sum(r is not None and r * usual < 0.0 for r in values)
    sign_clause = f", {opposite_count} with another sign than the usual path" if opposite_count else ""
    if None in usual_values:
        sign_clause = ", none on the usual path"
    distinct = summary.distinct
    difference = "all agree within" if distinct == 1 else f"{distinct} of these differ by more than"
    least, median, greatest = map(correlation, (summary.least, summary.median, summary.greatest))
    level = f"over the trials of {single_subject}" if single_subject else "within subjects"
    level = "over surfaces" if all(finding.within is None for finding in findings) else level
    return (
        f"{start} {summary.correlated} give a correlation {level}, from {least} to {greatest}, "
        f"median {median}{sign_clause}; {difference} {SAME:g}."
    )


def _rows(findings: Sequence[PathFinding]) -> tuple[Row, ...]:
    rows = [("all", "", "", *_spread(five_number_summary(correlations(findings)), len(findings)))]
    previous = ""
    for choice, name, summary, usual in by_choice(findings):
        count = sum(getattr(finding.path, choice) == name for finding in findings)
        label = CHOICE_LABELS[choice] if choice != previous else ""
        rows.append((label, name, "usual" if usual else "", *_spread(summary, count)))
        previous = choice
    return tuple(rows)


def _spread(summary: FiveNumberSummary | None, paths: int) -> Row:
    if summary is None:
        return (f"0 of {paths}", *(NONE for _ in range(6)))
    numbers = (summary.least, summary.lower, summary.median, summary.upper, summary.greatest)
    return (f"{summary.correlated} of {paths}", summary.distinct, *(correlation(value) for value in numbers))


def tables(report: Report) -> dict[str, tuple[Table, ...]]:
    """Return the tables of a report that have numbers, by section, in order."""
    rival_groups = [(e.name, e.rivals) for e in report.experiments]
    other_answers = [(e.name, e.other_answers) for e in report.experiments]
    sections = {
        "relation": (relation_table(report),),
        "strokes": (stroke_table(report), course_table(report)),
        "predictions": (
            of_predictions.prediction_table(report),
            of_predictions.force_table(report),
            of_predictions.direction_table(report),
            of_predictions.variants_table(report),
            of_predictions.variant_forces_table(report),
        ),
        "rivals": rival_tables(rival_groups, BY_NAME[report.response].label, report.model),
        "scores": (
            score_table(report),
            *answer_tables(report),
            table("table-other-answers", "session-other-answers", "trial | index | answer", other_answers),
            psychometric_table(session_functions(report)),
        ),
        "afferent": (of_predictions.afferent_table(report),),
        "paths": (paths_table((e.name, e.paths) for e in report.experiments),),
        "ground_truth": (ground_truth_table(report),),
    }
    return sections_of(sections)
