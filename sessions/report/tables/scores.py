"""Tables of scores, and of how predictions go with them, along many paths of the analysis too."""

from collections.abc import Callable, Iterable, Sequence

from sessions.report.contents import Report
from sessions.report.tables.cells import Cell, Notes, Row, Rows, Table, range_cell, table
from sessions.report.wording import NONE, capital, correlation, digits, identifier, places, shown_response, significant
from sessions.statistics.multiverse import CHOICE_LABELS, SAME, PathFinding, Spread, by_choice, correlations, spread
from sessions.statistics.scores import MeanScore, Relation, sd_interval, slope_interval


def score_table(report: Report) -> Table | None:
    """Return mean scores with their intervals."""
    notes = Notes()
    groups = tuple((e.name, tuple(score_cells(m, notes) for m in e.scores)) for e in report.experiments)
    columns = "index | subjects | mean score [0–100] | 95 % interval of the mean [0–100] | standard deviation [0–100]"
    caption = (
        "Scores: mean ± t(0.975, n − 1) s / √n, n subjects. Repeats of one subject are averaged first. Under the "
        "standard deviation s: its 95 % interval by chi squared."
    )
    return table("table-scores", caption, columns, groups, notes)


def score_cells(mean: MeanScore, notes: Notes) -> Row:
    """Return index, subjects, mean score, its interval and standard deviation; of a session as of a study."""
    interval = notes.interval(mean.low, mean.high, places(1), mean.reason)
    if mean.bootstrap is not None:
        why = (
            "The t interval leaves the scale, where no score can be. Resampling the subjects gives instead, "
            f"for index {mean.index} of {mean.descriptor}, {range_cell(*mean.bootstrap, places(1)).text}."
        )
        interval = Cell(interval.text, notes.mark(why), why)
    return (
        mean.index,
        mean.n,
        digits(mean.mean, 1),
        interval,
        spread_cell(mean.sd, mean.n, places(1), mean.reason, notes),
    )


def spread_cell(
    sd: float | None, n: int, shown: Callable[[float], str], reason: str | None, notes: Notes, unit: float = 1.0
) -> Cell:
    """Return the standard deviation of n values over its interval."""
    ends = None if sd is None else sd_interval(sd, n)
    return notes.estimate(sd, shown, reason, ends, unit=unit)


def answer_tables(report: Report) -> tuple[Table | None, ...]:
    """Return every subject's scores, a table an experiment."""
    tables: list[Table | None] = []
    for e in report.experiments:
        if e.answers:
            notes = Notes()
            rows = tuple((a.subject, *(notes.number(s, places(1), "no score") for s in a.scores)) for a in e.answers)
            columns = " | ".join(["subject", *(f"index {index}" for index in e.indices)])
            caption = f"Every score of {e.descriptor} [0–100]; repeats of one subject averaged."
            tables.append(table(f"table-answers-{identifier(e.name)}", caption, columns, [("", rows)], notes))
    return tuple(tables)


def relation_table(report: Report) -> Table | None:
    """Return how the predicted quantity goes with mean scores and with the indices."""
    shown = shown_response(report.response)
    notes = Notes()
    groups: list[Rows] = []
    for e in report.experiments:
        related = [("mean score", e.score_relation), ("own score", e.own_relation), ("index", e.index_relation)]
        groups.append((e.name, tuple(_relation_row(name, r, notes) for name, r in related if r is not None)))
    columns = (
        f"{shown.label} against | stimuli | Pearson's r | 95 % interval | Spearman's rho | rho's 95 % interval | "
        f"exact p of rho | slope [{shown.step} a point] | r without one"
    )
    caption = (
        f"Relation of the predicted {shown.label} ({report.model}) to scores and to the stimuli's indices. "
        "The forces are those of one subject, whose scores are the own ones. Intervals: Fisher's z, for rho as by "
        "Bonett and Wright (2000). p: two-sided, counted over all orders. Slope: of it on the score or index, over its "
        "t interval. Last column: r when the stimulus of that index is left out."
    )
    return table("table-relation", caption, columns, groups, notes)


def rank_interval(related: Relation, notes: Notes) -> Cell:
    """Return the interval of Spearman's rho, or why it has none."""
    alike = "no interval of a perfect rho" if related.n > 3 else f"no interval of rho from {related.n} points"
    why = alike if related.spearman is not None else related.reason
    return notes.interval(related.spearman_low, related.spearman_high, correlation, why)


def _relation_row(name: str, related: Relation, notes: Notes) -> Row:
    left_out = ", ".join(
        f"{label}:\N{NO-BREAK SPACE}{NONE if r is None else correlation(r)}" for label, r in related.without
    )
    return (
        name,
        related.n,
        notes.number(related.pearson, correlation, related.reason),
        notes.interval(related.low, related.high, correlation, related.reason),
        notes.number(related.spearman, correlation, related.reason),
        rank_interval(related, notes),
        notes.number(related.spearman_p, places(3), related.reason or "too many orders to count"),
        notes.estimate(
            related.slope,
            lambda v: significant(1e6 * v, 3),
            related.reason,
            slope_interval(related),
            "no line has one through two points, or through points wholly on it",
            unit=1e6,
        ),
        left_out,
    )


Named = tuple[str, Sequence[PathFinding]]


def paths_table(named: Iterable[Named]) -> Table | None:
    """Return the distribution of the correlation over all paths and over those with each choice, by descriptor."""
    groups = [(name, _rows(findings)) for name, findings in named if findings]
    columns = (
        "choice |  | usual | paths with r | different r | least | lower quartile | median | upper quartile | greatest"
    )
    caption = (
        "The correlation of the predicted response with scores as a distribution over paths of the analysis: every "
        "choice below crossed with every other at small strain; finite strain, where it was tried, with the other "
        "choices as usual. "
        "Contact is solved at every friction that was met, from the trial's own prediction on and on its mesh. All of "
        "them are reasonable and none is a sample of others: quartiles describe, and are no intervals. Different r: "
        "how many are left where those that agree within "
        f"{SAME:g} count once. A path of which fewer than three surfaces have a prediction gives no r."
    )
    return table("table-paths", caption, columns, groups)


def paths_sentence(name: str, findings: Sequence[PathFinding]) -> str:
    """Return the distribution in a sentence."""
    whole = spread(correlations(findings))
    start = f"{capital(name)}: of {len(findings)} paths of the analysis"
    if whole is None:
        return f"{start} none gives a correlation."
    return (
        f"{start} {whole.correlated} give a correlation, from {correlation(whole.least)} to "
        f"{correlation(whole.greatest)}, median {correlation(whole.median)}; "
        f"{whole.distinct} of these differ by more than {SAME:g}."
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
