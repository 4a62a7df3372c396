"""Tables and sentences of scales from choices of two, of Stevens' exponent and of psychometric functions."""

import itertools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from sessions.report.contents import Report
from sessions.report.tables import Cell, Row, Rows, Table, estimate_cell, number_cell, table
from sessions.report.wording import NONE, capital, digits, p_value, places, plural
from sessions.statistics.findings import DescriptorFindings, StudyFindings
from sessions.statistics.psychometric import Psychometric
from sessions.statistics.scales import JUDGEMENTS, Judgement, PairedScale
from sessions.statistics.scores import Average, IntervalEstimate, bounds

CONSISTENT = 1.0  # coefficient of consistence of choices that follow one order


def scales_table(descriptors: Sequence[DescriptorFindings]) -> Table | None:
    """Return the values of each surface by both models, where subjects chose between two."""
    groups = [(findings.descriptor, tuple(_rows(findings))) for findings in descriptors if findings.scales]
    return table("table-scales", "scales", "surface | Bradley–Terry [logit] | Thurstone V [z]", groups)


def latent_table(descriptors: Sequence[DescriptorFindings]) -> Table | None:
    """Return the latent values of each surface by each kind of judgement, if there are any besides scores."""
    judgements: list[Judgement] = [name for name in JUDGEMENTS if any(name in d.latent for d in descriptors)]
    if judgements in ([], ["scores"]):
        return None
    groups: list[Rows] = []
    for findings in descriptors:
        means = {mean.index: mean.mean for mean in findings.scores}
        rows = (
            (
                index,
                number_cell(means.get(index), places(1), "no scores were given"),
                *(_latent(findings, judgement, index) for judgement in judgements),
            )
            for index in findings.indices
        )
        groups.append((findings.descriptor, tuple(rows)))
    headings = " | ".join(f"by {judgement} [z]" for judgement in judgements)
    return table("table-latent", "latent", f"surface | mean score [0–100] | {headings}", groups)


def _latent(findings: DescriptorFindings, judgement: Judgement, index: int) -> Cell:
    values = findings.latent.get(judgement)
    estimate = None if values is None else values.get(index)
    if estimate is None:
        return number_cell(None, str, f"no scale by {judgement}: there are none, too few, or they do not scatter")
    return estimate_cell(estimate.value, places(2), None, estimate.ends, "too few subjects")


def _rows(findings: DescriptorFindings) -> Iterable[Row]:
    indices = sorted({index for scale in findings.scales for index in scale.values}) or list(findings.indices)
    for index in indices:
        yield (index, *(_value(scale, scale.values.get(index)) for scale in findings.scales))
    yield ("first of two", *(_value(scale, scale.first) for scale in findings.scales))


def _value(scale: PairedScale, interval: IntervalEstimate | None) -> Cell:
    if interval is None:
        return number_cell(None, str, scale.reason or "this surface was not chosen between")
    return estimate_cell(interval.value, places(2), None, interval.ends, scale.interval_reason or None)


def scale_sentences(findings: DescriptorFindings) -> list[str]:
    """Return sentences on choices and estimates of a descriptor, in addition to the tables."""
    sentences: list[str] = []
    name = capital(findings.descriptor)
    if findings.scales and findings.scales[0].p is not None:
        fits = [
            f"{scale.model} {digits(scale.deviance, 1)} on {scale.freedom} degrees of freedom (p {p})"
            for scale in findings.scales
            if scale.deviance is not None and scale.p is not None
            for p in [p_value(scale.p) if scale.p < 0.001 else f"= {p_value(scale.p)}"]
        ]
        sentences.append(
            f"{name}: deviance of the scales from choices: {', '.join(fits)}, by chi squared: few answers to a pair "
            "make p too small or too great."
        )
    if findings.consistence:
        zeta = [exponent.zeta for exponent in findings.consistence.values()]
        orders = sum(value == CONSISTENT for value in zeta)
        total = findings.scales[0].subjects
        count = f"{orders} of {plural(total, 'subject')}"
        if len(zeta) < total:
            count = (
                f"of {plural(total, 'subject')} {len(zeta)} compared every pair without a tie, and {orders} of these"
            )
        sentences.append(
            f"{name}: {count} chose by one order without a circle; mean "
            f"coefficient of consistence {digits(float(np.mean(zeta)), 2)}."
        )
    exponent = findings.exponent
    if exponent is not None and exponent.plain is not None:
        plain = exponent.plain
        estimates = (
            f"{digits(plain.estimate, 2)}{_range((plain.low, plain.high), float, 2, _OF_95)} with µ taken as exact"
        )
        if exponent.deming is not None:
            value, low, high = exponent.deming
            interval = _range(bounds(low, high), float, 2) or " (no interval: all subjects are alike)"
            estimates += f", {digits(value, 2)}{interval} with errors in both"
        data = f"by {plural(exponent.trials, 'trial')} of {plural(exponent.subjects, 'subject')}"
        sentences.append(f"{name}: if estimates are a power of µ, its exponent {data} is {estimates}.")
    elif exponent is not None and exponent.reason:
        sentences.append(f"{name}: no exponent of the estimates by µ: {exponent.reason}.")
    return sentences


Means = tuple[Average | None, Average | None]  # of log PSE and of log JND over subjects
LEAST_OF_A_MEAN = 2  # subjects
PsychometricResults = tuple[str, Mapping[str, Psychometric], Means]  # descriptor, each subject's function, means


def psychometric_table(judgements: Iterable[PsychometricResults]) -> Table | None:
    """Return PSE, JND, lapses, order and scatter of each subject, grouped by descriptor."""
    groups = [
        (name, (*itertools.starmap(_row, functions.items()), *_mean_row(means)))
        for name, functions, means in judgements
        if functions
    ]
    columns = "subject | answers | PSE [times µ] | JND [% of µ] | lapses [%] | order [% of µ] | correlation of answers"
    return table("table-psychometric", "psychometric", columns, groups)


def session_functions(report: Report) -> list[PsychometricResults]:
    """Return the psychometric functions of a session, of one subject."""
    return [
        (e.name, {"this session": e.psychometric}, (None, None))
        for e in report.experiments
        if e.psychometric is not None
    ]


def study_functions(study: StudyFindings) -> list[PsychometricResults]:
    """Return the psychometric functions of a study: every subject's, and means over them."""
    pairs = ((findings.descriptor, findings.constant_stimuli) for findings in study.descriptors)
    return [(name, fits.functions, (fits.pse, fits.jnd)) for name, fits in pairs if fits is not None]


def psychometric_sentences(results: PsychometricResults) -> list[str]:
    """Return sentences on comparisons with a standard, for one subject or for means over subjects."""
    name, functions, (pse, jnd) = results
    title = capital(name)
    fits = [fit for fit in functions.values() if fit.pse is not None and fit.jnd is not None]
    sentences: list[str] = []
    if len(functions) == 1:
        sentences += [_psychometric_sentence(title, function) for function in functions.values()]
    elif pse is not None:
        equal = f"{digits(math.exp(pse.mean), 2)}{_range(bounds(pse.low, pse.high), math.exp, 2, _OF_95)}"
        sentences.append(
            f"{title}: over {pse.n} of {len(functions)} subjects the surface felt equal to the standard has {equal} "
            f"times its µ; {_mean_jnd(jnd, pse.n)}."
        )
    elif functions:
        sentences.append(f"{title}: no subject's answers give a psychometric function; the table says why.")
    falling = sum(not fit.rises for fit in fits)
    if falling:
        count_text = f"{falling} of {plural(len(fits), 'subject')}"
        sentences.append(f"{title}: {count_text} chose the surface of less µ more often.")
    return sentences


def _mean_jnd(jnd: Average | None, subjects: int) -> str:
    """Return a clause on the mean JND; a step between two comparisons has a JND of 0, which has no logarithm."""
    if jnd is None:
        return "every subject's answers step between two comparisons, so no just noticeable difference is above 0"
    least = f"{digits(_mean_percent(jnd.mean), 0)} % of it{_range(bounds(jnd.low, jnd.high), _mean_percent, 0)}"
    if jnd.n == subjects:
        return f"over {jnd.n} the just noticeable difference is {least}"
    return f"over the {jnd.n} whose just noticeable difference is above 0 it is {least}, too great for all {subjects}"


def _psychometric_sentence(title: str, function: Psychometric) -> str:
    pse, threshold, lapse = function.pse, function.jnd, function.lapse
    if pse is None or threshold is None or lapse is None:
        return f"{title}: no psychometric function: {function.reason}."
    jnd = "bounded on neither side"
    if threshold.high is None and threshold.low is not None:
        jnd = f"above {digits(_percent(threshold.low), 0)} % of it"
    elif threshold.value == 0.0 and threshold.high is not None:
        jnd = f"below {digits(_percent(threshold.high), 0)} % of it"
    elif interval := _range(bounds(threshold.low, threshold.high), _percent, 0):
        jnd = f"{digits(_percent(threshold.value), 0)} % of it{interval}"
    return (
        f"{title}: by {function.answers} answers the surface felt equal to the standard has "
        f"{digits(math.exp(pse.value), 2)}{_range(pse.ends, math.exp, 2, _OF_95)} times its µ; the just "
        f"noticeable difference is {jnd}, with {digits(100.0 * lapse.value, 0)} % lapses."
    )


_OF_95 = "95 % interval "  # said once in a sentence


def _range(interval: tuple[float, float] | None, unit: Callable[[float], float], decimals: int, kind: str = "") -> str:
    if interval is None:
        return ""
    low, high = (digits(unit(limit), decimals) for limit in interval)
    return f" ({kind}{low} to {high})"


def _percent(difference: float) -> float:
    """Return a difference of logarithms in percent of the smaller value."""
    return 100.0 * math.expm1(difference)


def _mean_percent(log_difference: float) -> float:
    """Return the same for the mean of logarithms of such differences."""
    return _percent(math.exp(log_difference))


def _mean_row(means: Means) -> Iterable[Row]:
    pse, jnd = means
    if pse is None or jnd is None or pse.n < LEAST_OF_A_MEAN:
        return
    cells: list[Cell] = []
    for mean, unit, decimals in ((pse, math.exp, 2), (jnd, _mean_percent, 0)):
        interval = bounds(mean.low, mean.high)
        limits = interval and (unit(interval[0]), unit(interval[1]))
        cells.append(estimate_cell(unit(mean.mean), places(decimals), None, limits, "it takes two subjects"))
    yield ("geometric mean", f"of {pse.n} and {jnd.n}", *cells, NONE, NONE, NONE)


def _row(subject: str, function: Psychometric) -> Row:
    return (
        subject,
        function.answers,
        _cell(function.pse, function, math.exp, 2),
        _cell(function.jnd, function, _percent, 0),
        _cell(function.lapse, function, lambda share: 100.0 * share, 1),
        _cell(function.order, function, _percent, 1),
        _cell(function.correlation, function, float, 2, "answers to a pair are single, or all one way"),
    )


def _cell(
    profile: IntervalEstimate | None,
    function: Psychometric,
    unit: Callable[[float], float],
    decimals: int,
    without_order: str = "orders are not known",
) -> Cell:
    if profile is None:
        return number_cell(None, str, function.reason or without_order)
    interval = None if profile.ends is None else (unit(profile.ends[0]), unit(profile.ends[1]))
    sides = [f"above {digits(unit(profile.low), decimals)}"] if profile.low is not None else []
    sides += [f"below {digits(unit(profile.high), decimals)}"] if profile.high is not None else []
    without = f"within what was compared the answers bound it {' and '.join(sides) or 'on neither side'}"
    return estimate_cell(unit(profile.value), places(decimals), None, interval, without)
