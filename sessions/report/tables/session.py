"""The tables of a session: strokes, scores, how predictions go with them, and the ground truth."""

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
    caption,
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
from sessions.statistics.multiverse import CHOICE_LABELS, SAME, PathFinding, Spread, by_choice, correlations, spread
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

    kind = f" Under each number: {report.interval_kind}." if report.interval_kind else ""
    return _table(report, "table-strokes", caption("session-strokes", kind=kind), columns, row)


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
        why = stroke.reasons.get("direction") or TOO_SHORT
        return (
            cell("normal_force", places(2)),
            cell("tangential_force", places(2)),
            cell("heading", places(1)),
            number_cell(stroke.direction_agrees, places(3), why),
            cell("onset", places(3)),
            cell("break_away", places(3)),
            cell("slide_onset", places(3)),
        )

    kinds = "; ".join(f"{name.replace('_', ' ')}: {what}" for name, what in report.interval_kinds.items())
    return _table(report, "table-courses", caption("session-courses", kinds=kinds), columns, row)


def _table(report: Report, name: str, caption: str, columns: str, row: Callable[[StrokeFinding], Row]) -> Table | None:
    """Return a table of strokes by experiment, each named with its trial and index where there are trials."""
    planned = any(stroke.trial is not None for stroke in report.strokes)

    def name_row(stroke: StrokeFinding) -> Row:
        if not planned:
            return (stroke.number, *row(stroke))
        cell = partial(number_cell, as_text=places(0), reason="no trial asks for it")
        by_code = stroke.index is None and stroke.code
        return (stroke.number, cell(stroke.trial), stroke.code if by_code else cell(stroke.index), *row(stroke))

    groups = group_by_experiment(report, report.strokes, lambda s: s.experiment, name_row)
    return table(name, caption, f"{'stroke | trial | index' if planned else 'stroke'} | {columns}", groups)


def _estimate(stroke: StrokeFinding, name: str, as_text: Format, unit: float = 1.0) -> Cell:
    """Return one number of a stroke over its bootstrap interval, or why it has none."""
    without = "a person decided it" if _OF_DECISION.get(name) in stroke.decided else _WITHOUT.get(name, TOO_SHORT)
    why = stroke.reasons.get(name) or _WHY_MISSING.get(name)
    return estimate_cell(getattr(stroke, name), as_text, why, stroke.bootstrap.get(name), without, unit=unit)


def ground_truth_table(report: Report) -> Table | None:
    """Return the simulator's ground truth beside the numbers of the analysis."""
    # Of several strokes in a trial the model gets the first.
    strokes_by_trial = {stroke.trial: stroke for stroke in reversed(report.strokes) if stroke.trial is not None}
    predictions = {prediction.trial: prediction for prediction in report.predictions}
    columns = (
        "trial | index | true µ [1] | estimated µ [1] | off by [%] | true τ max [kPa] | estimated τ max [kPa] | "
        "off by [%] | true speed [mm/s] | estimated speed [mm/s] | off by [%] | direction"
    )

    def row(p: GroundTruth) -> Row:
        stroke, prediction = strokes_by_trial.get(p.trial), predictions.get(p.trial)
        first = stroke or prediction
        cells: list[Cell | str | int] = [p.trial, NONE if first is None or first.index is None else str(first.index)]
        name, mu = of_predictions.model_mu(stroke, prediction)
        quantities: tuple[tuple[str, float, float | None, Format, float], ...] = (
            (name, p.mu, mu, places(3), 1.0),
            ("tau_max", p.tau_max, stroke.tau_max if stroke else None, tau, 1e3),
            ("speed", p.speed, stroke.speed if stroke else None, places(1), 1.0),
        )
        for name, truth, value, as_text, unit in quantities:
            reason = stroke.reasons.get(name) if stroke else "no stroke was found in this trial"
            ends = stroke.bootstrap.get(name) if stroke else None
            cell = estimate_cell(value, as_text, reason, ends, TOO_SHORT, unit=unit)
            off = None if value is None else 100 * (value / truth - 1)
            cells += [as_text(truth), cell, number_cell(off, with_sign, reason)]
        right = stroke is not None and stroke.direction == p.direction
        cells.append(Cell("right" if right else NONE if stroke is None or stroke.direction is None else "wrong"))
        return tuple(cells)

    names = {trial: one.experiment for trial, one in {**predictions, **strokes_by_trial}.items()}
    groups = group_by_experiment(report, report.ground_truth, lambda p: names.get(p.trial, ""), row)
    return table("table-planted", caption("session-ground-truth"), columns, groups)


def score_table(report: Report) -> Table | None:
    """Return mean scores with their intervals."""
    groups = [(e.name, [score_cells(m) for m in e.scores]) for e in report.experiments]
    columns = "index | subjects | mean score [0–100] | 95 % interval of the mean [0–100] | standard deviation [0–100]"
    return table("table-scores", caption("session-scores"), columns, groups)


def score_cells(mean: MeanScore) -> Row:
    """Return index, subjects, mean score, its interval and standard deviation; of a session as of a study."""
    interval = range_cell(mean.low, mean.high, places(1), mean.reason)
    sd = spread_cell(mean.sd, mean.n, places(1), mean.reason)
    return mean.index, mean.n, digits(mean.mean, 1), interval, sd


def spread_cell(sd: float | None, n: int, as_text: Format, reason: str | None) -> Cell:
    """Return the standard deviation of n values over its interval."""
    return estimate_cell(sd, as_text, reason, sd_interval(sd, n) if sd else None, "all are alike")


def answer_tables(report: Report) -> tuple[Table | None, ...]:
    """Return every subject's scores, a table an experiment."""
    tables: list[Table | None] = []
    for e in report.experiments:
        rows = [(who, *(number_cell(s, places(1), "no score") for s in own)) for who, own in e.answers.items()]
        columns = " | ".join(["subject", *(f"index {index}" for index in e.indices)])
        caption = f"Every score of {e.descriptor} [0–100]; repeats of one subject averaged."
        tables.append(table(f"table-answers-{identifier(e.name)}", caption, columns, [("", rows)]))
    return tuple(tables)


def other_answer_table(report: Report) -> Table | None:
    """Return the numbers and the choices of the session's own subject."""
    groups = [(e.name, list(e.other_answers)) for e in report.experiments]
    return table("table-other-answers", caption("session-other-answers"), "trial | index | answer", groups)


def relation_table(report: Report) -> Table | None:
    """Return how the predicted quantity goes with mean scores and with the indices."""
    quantity = shown_response(report.response)
    groups: list[Rows] = []
    for e in report.experiments:
        relations = (("mean score", e.score_relation), ("own score", e.own_relation), ("index", e.index_relation))
        groups.append((e.name, [_relation_row(name, r) for name, r in relations if r is not None]))
    columns = (
        f"{quantity.label} against | stimuli | Pearson's r | 95 % interval | Spearman's rho | rho's 95 % interval | "
        f"exact p of rho | slope [{quantity.step} a point] | r without one"
    )
    any_own = any(e.own_relation is not None for e in report.experiments)
    own = "The forces are those of one subject, whose scores are the own ones. " if any_own else ""
    scores = "scores and to " if report.scored else ""
    words = caption("session-relation", label=quantity.label, model=report.model, scores=scores, own=own)
    return table("table-relation", words, columns, groups)


def rank_interval(relation: Relation) -> Cell:
    """Return the interval of Spearman's rho, or why it has none."""
    alike = "no interval of a perfect rho" if relation.n > 3 else f"no interval of rho from {relation.n} points"
    why = alike if relation.spearman is not None else relation.reason
    return range_cell(relation.spearman_low, relation.spearman_high, correlation, why)


def _relation_row(name: str, relation: Relation) -> Row:
    without = [(label, NONE if r is None else correlation(r)) for label, r in relation.without]
    no_slope = "no line has one through two points, or through points wholly on it"
    return (
        name,
        relation.n,
        number_cell(relation.pearson, correlation, relation.reason),
        range_cell(relation.low, relation.high, correlation, relation.reason),
        number_cell(relation.spearman, correlation, relation.reason),
        rank_interval(relation),
        number_cell(relation.spearman_p, p_value, relation.reason or "too many orders to count"),
        estimate_cell(
            relation.slope,
            lambda v: significant(1e6 * v, 3),
            relation.reason,
            slope_interval(relation),
            no_slope,
            unit=1e6,
        ),
        ", ".join(f"{label}:\N{NO-BREAK SPACE}{r}" for label, r in without),
    )


NamedPaths = tuple[str, Sequence[PathFinding]]


def paths_table(path_groups: Iterable[NamedPaths]) -> Table | None:
    """Return the distribution of the correlation over all paths and over those with each choice, by descriptor."""
    groups = [(name, _rows(findings)) for name, findings in path_groups if findings]
    columns = (
        "choice |  | usual | paths with r | different r | least | lower quartile | median | upper quartile | greatest"
    )
    return table("table-paths", caption("paths", same=SAME), columns, groups)


def paths_sentence(name: str, findings: Sequence[PathFinding]) -> str:
    """Return the distribution in a sentence, and how many paths turn the sign of the usual one."""
    values = correlations(findings)
    whole, usual = spread(values), next((r for r, one in zip(values, findings, strict=True) if one.usual and r), 0.0)
    start = f"{capital(name)}: of {len(findings)} paths of the analysis"
    if whole is None:
        return f"{start} none gives a correlation."
    opposite_count = sum(r is not None and r * usual < 0.0 for r in values)
    turn = f", {opposite_count} with another sign than the usual path" if opposite_count else ""
    differ = "all agree within" if whole.distinct == 1 else f"{whole.distinct} of these differ by more than"
    return (
        f"{start} {whole.correlated} give a correlation, from {correlation(whole.least)} to "
        f"{correlation(whole.greatest)}, median {correlation(whole.median)}{turn}; {differ} {SAME:g}."
    )


def _rows(findings: Sequence[PathFinding]) -> tuple[Row, ...]:
    rows = [("all", "", "", *_spread(spread(correlations(findings)), len(findings)))]
    before = ""
    for choice, name, of, usual in by_choice(findings):
        count = sum(getattr(one.path, choice) == name for one in findings)
        label = CHOICE_LABELS[choice] if choice != before else ""
        rows.append((label, name, "usual" if usual else "", *_spread(of, count)))
        before = choice
    return tuple(rows)


def _spread(of: Spread | None, paths: int) -> Row:
    if of is None:
        return (f"0 of {paths}", *(NONE for _ in range(6)))
    numbers = (of.least, of.lower, of.median, of.upper, of.greatest)
    return (f"{of.correlated} of {paths}", of.distinct, *(correlation(value) for value in numbers))


def tables(report: Report) -> dict[str, tuple[Table, ...]]:
    """Return the tables a report has numbers for, by section, in their order."""
    rival_groups = [(e.name, e.rivals) for e in report.experiments]
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
            other_answer_table(report),
            psychometric_table(session_functions(report)),
        ),
        "afferent": (of_predictions.afferent_table(report),),
        "paths": (paths_table((e.name, e.paths) for e in report.experiments),),
        "ground_truth": (ground_truth_table(report),),
    }
    return sections_of(sections)
