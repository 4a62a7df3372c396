"""Table and sentences of psychometric functions: friction that is felt equal, and the least difference felt."""

import math
from collections.abc import Callable, Iterable, Mapping

from sessions.report import Report
from sessions.report.tables.cells import Cell, Group, Notes, Row, Table, table
from sessions.report.wording import NONE, digits, places
from sessions.statistics.pooling.averages import Average
from sessions.statistics.pooling.findings import StudyFindings
from sessions.statistics.scales.psychometric import Profile, Psychometric

Means = tuple[Average | None, Average | None]  # of log PSE and of log JND over subjects
LEAST_OF_A_MEAN = 2  # subjects
Judged = tuple[str, Mapping[str, Psychometric], Means]  # what was judged, each subject's function, and means


def psychometric_table(judgements: Iterable[Judged]) -> Table | None:
    """Return PSE, JND, lapses, order and scatter of each subject, under the name of what was judged."""
    notes = Notes()
    groups = [
        Group(name, (*(_row(who, one, notes) for who, one in functions.items()), *_mean_row(means, notes)))
        for name, functions, means in judgements
        if functions
    ]
    caption = (
        "Comparisons with a standard, by cumulative normal functions of log µ of the subject's own strokes. PSE: µ "
        "judged equal, by the standard's. JND: from there to three choices of four. Order: what coming second adds. By "
        "maximum likelihood, with 95 % profile intervals; over subjects geometric means with t intervals."
    )
    columns = "subject | answers | PSE [times µ] | JND [% of µ] | lapses [%] | order [% of µ] | correlation of answers"
    return table("table-psychometric", caption, columns, groups, notes)


def compared_with_standard(report: Report) -> list[Judged]:
    """Return what the table of a session is made of: one subject's functions."""
    return [
        (e.name, {"this session": e.psychometric}, (None, None))
        for e in report.experiments
        if e.psychometric is not None
    ]


def compared_in_study(study: StudyFindings) -> list[Judged]:
    """Return what the table of a study is made of: every subject's functions, and means over them."""
    pairs = ((one.descriptor, one.constant_stimuli) for one in study.descriptors)
    return [(name, one.functions, (one.pse, one.jnd)) for name, one in pairs if one is not None]


def psychometric_sentences(judged: Judged) -> list[str]:
    """Return what comparisons with a standard say: of one subject, or of subjects at large."""
    name, functions, (pse, jnd) = judged
    title = name[:1].upper() + name[1:]
    fitted = [one for one in functions.values() if one.pse is not None and one.jnd is not None]
    sentences: list[str] = []
    if len(functions) == 1:
        sentences += [_of_one(title, one) for one in functions.values()]
    elif pse is not None and jnd is not None:
        equal = f"{digits(math.exp(pse.mean), 2)}{_range(_ends(pse), math.exp, 2)}"
        least = f"{digits(_mean_percent(jnd.mean), 0)} % of it{_range(_ends(jnd), _mean_percent, 0)}"
        sentences.append(
            f"{title}: over {pse.n} of {len(functions)} subjects the surface felt equal to the standard has {equal} "
            f"times its µ; over {jnd.n} the just noticeable difference is {least}."
        )
    elif functions:
        sentences.append(f"{title}: no subject's answers give a psychometric function; the table says why.")
    falling = sum(not one.rises for one in fitted)
    if falling:
        sentences.append(f"{title}: {falling} of {len(fitted)} subjects chose the surface of less µ more often.")
    return sentences


def _of_one(title: str, one: Psychometric) -> str:
    if one.pse is None or one.jnd is None or one.lapse is None:
        return f"{title}: no psychometric function: {one.reason}."
    jnd = "bounded on neither side"
    if one.jnd.high is None and one.jnd.low is not None:
        jnd = f"above {digits(_percent(one.jnd.low), 0)} % of it"
    elif one.jnd.value == 0.0 and one.jnd.high is not None:
        jnd = f"below {digits(_percent(one.jnd.high), 0)} % of it"
    elif one.jnd.low is not None and one.jnd.high is not None:
        jnd = f"{digits(_percent(one.jnd.value), 0)} % of it{_range((one.jnd.low, one.jnd.high), _percent, 0)}"
    ends = None if one.pse.low is None or one.pse.high is None else (one.pse.low, one.pse.high)
    return (
        f"{title}: by {one.answers} answers the surface felt equal to the standard has "
        f"{digits(math.exp(one.pse.value), 2)}{_range(ends, math.exp, 2)} times its µ; the just noticeable difference "
        f"is {jnd}, with {digits(100.0 * one.lapse.value, 0)} % lapses."
    )


def _ends(mean: Average) -> tuple[float, float] | None:
    return None if mean.low is None or mean.high is None else (mean.low, mean.high)


def _range(ends: tuple[float, float] | None, unit: Callable[[float], float], after: int) -> str:
    return "" if ends is None else f" ({digits(unit(ends[0]), after)} to {digits(unit(ends[1]), after)})"


def _percent(difference: float) -> float:
    """Return a difference of logarithms in percent of the smaller."""
    return 100.0 * math.expm1(difference)


def _mean_percent(log_difference: float) -> float:
    """Return likewise a difference of which the logarithm was averaged."""
    return _percent(math.exp(log_difference))


def _mean_row(means: Means, notes: Notes) -> Iterable[Row]:
    """Yield the row of the means, where there are two subjects."""
    pse, jnd = means
    if pse is None or jnd is None or pse.n < LEAST_OF_A_MEAN:
        return
    cells = [
        notes.estimate(
            unit(mean.mean),
            places(after),
            None,
            None if ends is None else (unit(ends[0]), unit(ends[1])),
            "it takes two subjects",
        )
        for mean, unit, after in ((pse, math.exp, 2), (jnd, _mean_percent, 0))
        for ends in [_ends(mean)]
    ]
    yield (Cell("geometric mean"), Cell(f"of {pse.n} and {jnd.n}"), *cells, Cell(NONE), Cell(NONE), Cell(NONE))


def _row(who: str, one: Psychometric, notes: Notes) -> Row:
    return (
        Cell(who),
        Cell(str(one.answers)),
        _cell(one.pse, one, math.exp, 2, notes),
        _cell(one.jnd, one, _percent, 0, notes),
        _cell(one.lapse, one, lambda share: 100.0 * share, 1, notes),
        _cell(one.order, one, _percent, 1, notes),
        _cell(one.correlation, one, float, 2, notes),
    )


def _cell(profile: Profile | None, one: Psychometric, unit: Callable[[float], float], after: int, notes: Notes) -> Cell:
    if profile is None:
        return notes.number(None, str, one.reason or "orders are not known")
    ends = None if profile.low is None or profile.high is None else (unit(profile.low), unit(profile.high))
    sides = [f"above {digits(unit(profile.low), after)}"] if profile.low is not None else []
    sides += [f"below {digits(unit(profile.high), after)}"] if profile.high is not None else []
    without = f"within what was compared the answers bound it {' and '.join(sides) or 'on neither side'}"
    return notes.estimate(unit(profile.value), places(after), None, ends, without)
