"""Table and sentences of scales from choices between two, and the sentence of Stevens' exponent."""

from collections.abc import Iterable, Sequence

import numpy as np

from sessions.report.tables.cells import Cell, Group, Notes, Row, Table, table
from sessions.report.wording import digits, p_value, places
from sessions.statistics.pooling.findings import DescriptorFindings
from sessions.statistics.scales.latent import JUDGEMENTS, Judgement
from sessions.statistics.scales.paired import Ends, PairedScale

CONSISTENT = 1.0  # coefficient of consistence of choices that follow one order


def scales_table(descriptors: Sequence[DescriptorFindings]) -> Table | None:
    """Return the values of each surface by both models, where subjects chose between two."""
    notes = Notes()
    groups = [Group(one.descriptor, tuple(_rows(one, notes))) for one in descriptors if one.scales]
    caption = (
        "Scales from choices between two surfaces, with mean 0: Bradley and Terry's in logits, Thurstone's case V in z,"
        " by maximum likelihood, with 95 % intervals of a bootstrap over subjects. Last row: what coming first adds."
    )
    return table("table-scales", caption, "surface | Bradley–Terry [logit] | Thurstone V [z]", groups, notes)


def latent_table(descriptors: Sequence[DescriptorFindings]) -> Table | None:
    """Return the latent values of each surface by every kind of judgement, where there are others than scores."""
    judgements: list[Judgement] = [kind for kind in JUDGEMENTS if any(kind in one.latent for one in descriptors)]
    if judgements in ([], ["scores"]):
        return None
    notes = Notes()
    groups: list[Group] = []
    for one in descriptors:
        means = {mean.index: mean.mean for mean in one.scores}
        rows = (
            (
                Cell(str(index)),
                notes.number(means.get(index), places(1), "no scores were given"),
                *(_latent(one, kind, index, notes) for kind in judgements),
            )
            for index in one.indices
        )
        groups.append(Group(one.descriptor, tuple(rows)))
    heads = " | ".join(f"by {kind} [z]" for kind in judgements)
    caption = (
        "One latent scale, with mean 0. Its unit is the standard deviation of the difference of two judgements: √2 "
        "times the scatter of single scores or log estimates, Thurstone's z of choices, the JND of comparisons by "
        "0.674. 95 % intervals: bootstrap over subjects; of comparisons the JND's. People who differ count as scatter."
    )
    return table("table-latent", caption, f"surface | mean score [0–100] | {heads}", groups, notes)


def _latent(one: DescriptorFindings, kind: Judgement, index: int, notes: Notes) -> Cell:
    values = one.latent.get(kind)
    scaled = None if values is None else values.get(index)
    if scaled is None:
        return notes.number(None, str, f"no scale by {kind}: nobody gave them, too few did, or nothing scatters")
    ends = None if scaled.low is None or scaled.high is None else (scaled.low, scaled.high)
    return notes.estimate(scaled.value, places(2), None, ends, "too few subjects")


def _rows(one: DescriptorFindings, notes: Notes) -> Iterable[Row]:
    indices = sorted({index for scale in one.scales for index in scale.values}) or list(one.indices)
    for index in indices:
        yield (Cell(str(index)), *(_value(scale, scale.values.get(index), notes) for scale in one.scales))
    yield (Cell("first of two"), *(_value(scale, scale.first, notes) for scale in one.scales))


def _value(scale: PairedScale, interval: Ends | None, notes: Notes) -> Cell:
    if interval is None:
        return notes.number(None, str, scale.reason or "this surface was not chosen between")
    ends = None if interval.low is None or interval.high is None else (interval.low, interval.high)
    return notes.estimate(interval.value, places(2), None, ends, scale.interval_reason or None)


def scale_sentences(one: DescriptorFindings) -> list[str]:
    """Return what choices and estimates of a descriptor say beside their tables."""
    sentences: list[str] = []
    name = one.descriptor[:1].upper() + one.descriptor[1:]
    if one.scales and one.scales[0].p is not None:
        fits = [
            f"{scale.model} {digits(scale.deviance, 1)} on {scale.freedom} degrees of freedom (p {_p(scale.p)})"
            for scale in one.scales
            if scale.deviance is not None and scale.p is not None
        ]
        sentences.append(f"{name}: deviance of the scales from choices: {', '.join(fits)}.")
    if one.consistence:
        zeta = [exponent.zeta for exponent in one.consistence.values()]
        orders = sum(value == CONSISTENT for value in zeta)
        sentences.append(
            f"{name}: {orders} of {len(zeta)} subjects chose by one order without a circle; mean coefficient of "
            f"consistence {digits(float(np.mean(zeta)), 2)}."
        )
    exponent = one.exponent
    if exponent is not None and exponent.plain is not None:
        plain = exponent.plain
        words = f"{digits(plain.estimate, 2)} ({digits(plain.low, 2)} to {digits(plain.high, 2)}) with µ taken as exact"
        if exponent.deming is not None:
            value, low, high = exponent.deming
            words += f", {digits(value, 2)} ({digits(low, 2)} to {digits(high, 2)}) with errors in both"
        sentences.append(f"{name}: estimates grow as a power of µ, with an exponent of {words}.")
    elif exponent is not None and exponent.reason:
        sentences.append(f"{name}: no exponent of the estimates by µ: {exponent.reason}.")
    return sentences


def _p(p: float) -> str:
    text = p_value(p)
    return text if text.startswith("<") else f"= {text}"
