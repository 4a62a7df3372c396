"""Tables and sentences of scales from choices of two, of Stevens' exponent and of psychometric functions."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np

from sessions.report.contents import Report
from sessions.report.tables import Cell, Row, Rows, Table, estimate_cell, number_cell, table
from sessions.report.wording import NONE, capital, caption, digits, p_value, places, plural
from sessions.statistics.findings import DescriptorFindings, StudyFindings
from sessions.statistics.psychometric import Psychometric
from sessions.statistics.scales import JUDGEMENTS, Judgement, PairedScale
from sessions.statistics.scores import Average, IntervalEstimate, bounds

CONSISTENT = 1.0  # coefficient of consistence of choices that follow one order


def scales_table(descriptors: Sequence[DescriptorFindings]) -> Table | None:
    """Return the values of each surface by both models, where subjects chose between two."""
    groups = [(one.descriptor, tuple(_rows(one))) for one in descriptors if one.scales]
    return table("table-scales", caption("scales"), "surface | Bradley–Terry [logit] | Thurstone V [z]", groups)


def latent_table(descriptors: Sequence[DescriptorFindings]) -> Table | None:
    """Return the latent values of each surface by every kind of judgement, where there are others than scores."""
    judgements: list[Judgement] = [kind for kind in JUDGEMENTS if any(kind in one.latent for one in descriptors)]
    if judgements in ([], ["scores"]):
        return None
    groups: list[Rows] = []
    for one in descriptors:
        means = {mean.index: mean.mean for mean in one.scores}
        rows = (
            (
                index,
                number_cell(means.get(index), places(1), "no scores were given"),
                *(_latent(one, kind, index) for kind in judgements),
            )
            for index in one.indices
        )
        groups.append((one.descriptor, tuple(rows)))
    heads = " | ".join(f"by {kind} [z]" for kind in judgements)
    return table("table-latent", caption("latent"), f"surface | mean score [0–100] | {heads}", groups)


def _latent(one: DescriptorFindings, kind: Judgement, index: int) -> Cell:
    values = one.latent.get(kind)
    value = None if values is None else values.get(index)
    if value is None:
        return number_cell(None, str, f"no scale by {kind}: nobody gave them, too few did, or nothing scatters")
    return estimate_cell(value.value, places(2), None, value.ends, "too few subjects")


def _rows(one: DescriptorFindings) -> Iterable[Row]:
    indices = sorted({index for scale in one.scales for index in scale.values}) or list(one.indices)
    for index in indices:
        yield (index, *(_value(scale, scale.values.get(index)) for scale in one.scales))
    yield ("first of two", *(_value(scale, scale.first) for scale in one.scales))


def _value(scale: PairedScale, interval: IntervalEstimate | None) -> Cell:
    if interval is None:
        return number_cell(None, str, scale.reason or "this surface was not chosen between")
    return estimate_cell(interval.value, places(2), None, interval.ends, scale.interval_reason or None)


def scale_sentences(one: DescriptorFindings) -> list[str]:
    """Return what choices and estimates of a descriptor say beside their tables."""
    sentences: list[str] = []
    name = capital(one.descriptor)
    if one.scales and one.scales[0].p is not None:
        fits = [
            f"{scale.model} {digits(scale.deviance, 1)} on {scale.freedom} degrees of freedom (p {p})"
            for scale in one.scales
            if scale.deviance is not None and scale.p is not None
            for p in [p_value(scale.p) if scale.p < 0.001 else f"= {p_value(scale.p)}"]
        ]
        sentences.append(f"{name}: deviance of the scales from choices: {', '.join(fits)}.")
    if one.consistence:
        zeta = [exponent.zeta for exponent in one.consistence.values()]
        orders = sum(value == CONSISTENT for value in zeta)
        sentences.append(
            f"{name}: {orders} of {plural(len(zeta), 'subject')} chose by one order without a circle; mean "
            f"coefficient of consistence {digits(float(np.mean(zeta)), 2)}."
        )
    exponent = one.exponent
    if exponent is not None and exponent.plain is not None:
        plain = exponent.plain
        words = f"{digits(plain.estimate, 2)} ({digits(plain.low, 2)} to {digits(plain.high, 2)}) with µ taken as exact"
        if exponent.deming is not None:
            value, low, high = exponent.deming
            ends = "no interval: all subjects are alike"
            if low is not None and high is not None:
                ends = f"{digits(low, 2)} to {digits(high, 2)}"
            words += f", {digits(value, 2)} ({ends}) with errors in both"
        sentences.append(f"{name}: if estimates are a power of µ, its exponent is {words}.")
    elif exponent is not None and exponent.reason:
        sentences.append(f"{name}: no exponent of the estimates by µ: {exponent.reason}.")
    return sentences


Means = tuple[Average | None, Average | None]  # of log PSE and of log JND over subjects
LEAST_OF_A_MEAN = 2  # subjects
PsychometricResults = tuple[str, Mapping[str, Psychometric], Means]  # descriptor, each subject's function, means


def psychometric_table(judgements: Iterable[PsychometricResults]) -> Table | None:
    """Return PSE, JND, lapses, order and scatter of each subject, under the name of what was judged."""
    groups = [
        (name, (*(_row(who, one) for who, one in functions.items()), *_mean_row(means)))
        for name, functions, means in judgements
        if functions
    ]
    columns = "subject | answers | PSE [times µ] | JND [% of µ] | lapses [%] | order [% of µ] | correlation of answers"
    return table("table-psychometric", caption("psychometric"), columns, groups)


def session_functions(report: Report) -> list[PsychometricResults]:
    """Return the psychometric functions of a session, which are one subject's."""
    return [
        (e.name, {"this session": e.psychometric}, (None, None))
        for e in report.experiments
        if e.psychometric is not None
    ]


def study_functions(study: StudyFindings) -> list[PsychometricResults]:
    """Return the psychometric functions of a study: every subject's, and means over them."""
    pairs = ((one.descriptor, one.constant_stimuli) for one in study.descriptors)
    return [(name, one.functions, (one.pse, one.jnd)) for name, one in pairs if one is not None]


def psychometric_sentences(results: PsychometricResults) -> list[str]:
    """Return what comparisons with a standard say: of one subject, or of subjects at large."""
    name, functions, (pse, jnd) = results
    title = capital(name)
    fits = [one for one in functions.values() if one.pse is not None and one.jnd is not None]
    sentences: list[str] = []
    if len(functions) == 1:
        sentences += [_of_one(title, one) for one in functions.values()]
    elif pse is not None and jnd is not None:
        equal = f"{digits(math.exp(pse.mean), 2)}{_range(bounds(pse.low, pse.high), math.exp, 2)}"
        least = f"{digits(_mean_percent(jnd.mean), 0)} % of it{_range(bounds(jnd.low, jnd.high), _mean_percent, 0)}"
        sentences.append(
            f"{title}: over {pse.n} of {len(functions)} subjects the surface felt equal to the standard has {equal} "
            f"times its µ; over {jnd.n} the just noticeable difference is {least}."
        )
    elif functions:
        sentences.append(f"{title}: no subject's answers give a psychometric function; the table says why.")
    falling = sum(not one.rises for one in fits)
    if falling:
        of = f"{falling} of {plural(len(fits), 'subject')}"
        sentences.append(f"{title}: {of} chose the surface of less µ more often.")
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
    return (
        f"{title}: by {one.answers} answers the surface felt equal to the standard has "
        f"{digits(math.exp(one.pse.value), 2)}{_range(one.pse.ends, math.exp, 2)} times its µ; the just noticeable "
        f"difference is {jnd}, with {digits(100.0 * one.lapse.value, 0)} % lapses."
    )


def _range(ends: tuple[float, float] | None, unit: Callable[[float], float], after: int) -> str:
    return "" if ends is None else f" ({digits(unit(ends[0]), after)} to {digits(unit(ends[1]), after)})"


def _percent(difference: float) -> float:
    """Return a difference of logarithms in percent of the smaller."""
    return 100.0 * math.expm1(difference)


def _mean_percent(log_difference: float) -> float:
    """Return likewise a difference of which the logarithm was averaged."""
    return _percent(math.exp(log_difference))


def _mean_row(means: Means) -> Iterable[Row]:
    pse, jnd = means
    if pse is None or jnd is None or pse.n < LEAST_OF_A_MEAN:
        return
    cells: list[Cell] = []
    for mean, unit, after in ((pse, math.exp, 2), (jnd, _mean_percent, 0)):
        ends = None if mean.low is None or mean.high is None else (unit(mean.low), unit(mean.high))
        cells.append(estimate_cell(unit(mean.mean), places(after), None, ends, "it takes two subjects"))
    yield ("geometric mean", f"of {pse.n} and {jnd.n}", *cells, NONE, NONE, NONE)


def _row(who: str, one: Psychometric) -> Row:
    return (
        who,
        one.answers,
        _cell(one.pse, one, math.exp, 2),
        _cell(one.jnd, one, _percent, 0),
        _cell(one.lapse, one, lambda share: 100.0 * share, 1),
        _cell(one.order, one, _percent, 1),
        _cell(one.correlation, one, float, 2, "answers to a pair are single, or all one way"),
    )


def _cell(
    profile: IntervalEstimate | None,
    one: Psychometric,
    unit: Callable[[float], float],
    after: int,
    without_order: str = "orders are not known",
) -> Cell:
    if profile is None:
        return number_cell(None, str, one.reason or without_order)
    ends = None if profile.ends is None else (unit(profile.ends[0]), unit(profile.ends[1]))
    sides = [f"above {digits(unit(profile.low), after)}"] if profile.low is not None else []
    sides += [f"below {digits(unit(profile.high), after)}"] if profile.high is not None else []
    without = f"within what was compared the answers bound it {' and '.join(sides) or 'on neither side'}"
    return estimate_cell(unit(profile.value), places(after), None, ends, without)
