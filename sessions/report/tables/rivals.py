"""Tables and sentences on rivals of the model's quantity, for a session or a study."""

from collections.abc import Callable, Mapping, Sequence
from textwrap import fill

from sessions.report.tables import Row, Table, estimate_cell, number_cell, table
from sessions.report.wording import NONE, capital, correlation, digits, p_value, places, plural
from sessions.statistics.correlations import LEAST_OF_STEIGER, POWER
from sessions.statistics.findings import DescriptorFindings
from sessions.statistics.rivals import RESPONSES, Rival
from sessions.statistics.scores import bounds
from sessions.statistics.within_subjects import holm

_ALPHA = 0.05
MANY_SURFACES = 10_000  # a greater number is not shown
MOST_NAMED = 3  # number of responses from which they are counted, not named
_TITLE_WIDTH = 44  # characters in a line of a picture's title


_WITHIN = " Within subjects n counts trials, and intervals and tests are by the jackknife over subjects."
_AIC = (
    "AIC weight: a share among these quantities, of which none need be right, by mixed models with one slope between "
    "surfaces and one within; on five surfaces the greatest is too large. "
)

RivalGroups = Sequence[tuple[str, Sequence[Rival]]]  # name of a group, and its rivals


def rival_tables(groups: RivalGroups, quantity: str, model: str) -> tuple[Table | None, Table | None]:
    """Return tables of measured rivals of a quantity of the `model`, and of the model's other quantities."""
    weighed = _have_weights(groups)
    texts = {"label": quantity, "model": model, "within": _WITHIN if weighed else "", "aic": _AIC if weighed else ""}
    return (
        _table("rivals", groups, texts, lambda name: name == quantity or name not in RESPONSES),
        _table("responses", groups, texts, lambda name: name != quantity and name in RESPONSES),
    )


def levels_of_rivals(findings: DescriptorFindings) -> RivalGroups:
    """Return the rivals of a study for means over subjects and within subjects; for one subject those of its scores."""
    levels = [("means over subjects", findings.rivals_of_means), ("within subjects", findings.rivals)]
    if findings.single_subject:
        levels = [(f"scores of {findings.single_subject}", findings.rivals_of_means)]
    return [(f"{findings.descriptor}, {level}", rivals) for level, rivals in levels]


def _have_weights(groups: RivalGroups) -> bool:
    """Say whether the rivals have weights of mixed models, as within the subjects of a study."""
    return any(rival.weight is not None or "weight" in rival.reasons for _, rivals in groups for rival in rivals)


def _table(name: str, groups: RivalGroups, texts: Mapping[str, str], includes: Callable[[str], bool]) -> Table | None:
    quantity = texts["label"]
    columns = (
        f"quantity | n | r | r of {quantity} minus this | Steiger's Z | p | r given the model's µ | "
        f"left-out error [0–100]{' | AIC weight' if _have_weights(groups) else ''}"
    )
    width = columns.count("|") + 1
    rows = (
        (group, [_row(rival, quantity)[:width] for rival in rivals if includes(rival.name)]) for group, rivals in groups
    )
    return table(f"table-{name}", name, columns, rows, **texts)


def rival_title(rivals: Sequence[Rival]) -> str:
    """Return lines with the r of each measured rival for the title of a picture, "" without any."""
    measured = [rival for rival in rivals if rival.name not in RESPONSES]
    correlations = [(rival.name, correlation(rival.r)) for rival in measured if rival.r is not None]
    unbroken = [f"{name} {r}".replace(" ", "\N{NO-BREAK SPACE}") for name, r in correlations]
    return fill(f"r of rivals: {', '.join(unbroken)}", _TITLE_WIDTH) if correlations else ""


def rivals_sentences(name: str, rivals: Sequence[Rival]) -> list[str]:
    """Return sentences on the rivals that scores can and cannot distinguish; none without rivals."""
    if len(rivals) < 2:
        return []
    contrasts = [rival for rival in rivals if rival.contrast is not None]
    reason = next((rival.reasons["contrast"] for rival in rivals if "contrast" in rival.reasons), "")
    model = rivals[0].name
    no_contrast = f"Of {name}, the {model} is compared with no rival: {reason}."
    return [*_alike(name, model, rivals), _verdict(name, model, contrasts) if contrasts else no_contrast]


def _alike(name: str, model: str, rivals: Sequence[Rival]) -> list[str]:
    """Return a sentence on rivals that order surfaces as the model, and the surfaces needed to distinguish them."""
    alike = [rival for rival in rivals if rival.same_order]
    if not alike:
        return []
    order, them = ("orders", "it") if len(alike) == 1 else ("order", "them")
    names = _rival_names([rival.name for rival in alike])
    counts = sorted((rival.needed, rival.name) for rival in alike if rival.needed is not None)
    figures = {_two_figures(count): name for count, name in (*counts[-1:], *counts[:1])}
    figure_texts = [f"{figure} ({name})" for figure, name in reversed(figures.items())]
    opening = (
        f"{capital(name)}: {names} {order} these {rivals[0].n} surfaces as the {model} does, so no order "
        f"of scores can distinguish {them} from it"
    )
    if rivals[0].n < LEAST_OF_STEIGER:
        return [f"{opening}."]
    opening += "; at the r seen here, "
    if not figure_texts:
        return [f"{opening}no number of surfaces would."]
    power = f"{POWER:.0%} power".replace("%", "\N{NO-BREAK SPACE}%")
    counts_text = " to ".join(figure_texts)
    return [f"{opening}Steiger's test would need {counts_text} surfaces for {power}."]


def _verdict(name: str, model: str, rivals: Sequence[Rival]) -> str:
    """Return a sentence on rivals that scores follow more, less, or indistinguishably closely than the model."""
    sides: dict[str, list[str]] = {"more": [], "less": [], "neither": []}
    contrasts = [(rival.name, rival.contrast) for rival in rivals if rival.contrast is not None]
    adjusted = holm([1.0 if contrast.p is None else contrast.p for _, contrast in contrasts])
    for (rival, contrast), p in zip(contrasts, adjusted, strict=True):
        sides["neither" if p >= _ALPHA else "more" if contrast.difference < 0.0 else "less"].append(rival)
    clauses = [
        f"{_rival_names(sides[side])} {side} closely than the {model}" for side in ("more", "less") if sides[side]
    ]
    sentences: list[str] = []
    if clauses:
        sentences.append(
            f"the scores follow {' and '.join(clauses)} (p < 0.05 by Holm over {plural(len(adjusted), 'rival')})"
        )
    if sides["neither"]:
        subject = "they" if clauses else "the scores"
        sentences.append(f"{subject} distinguish the {model} from none of these: {_rival_names(sides['neither'])}")
    return f"On {name}, {'; '.join(sentences)}."


def _row(rival: Rival, quantity: str) -> Row:
    reason, contrast, weight = rival.reasons.get, rival.contrast, rival.weight
    interval = bounds(rival.low, rival.high)
    partial = bounds(rival.partial_low, rival.partial_high)
    contrast_cells: Row = (NONE, NONE, NONE)
    if contrast is not None:
        contrast_cells = (
            estimate_cell(contrast.difference, correlation, None, bounds(contrast.low, contrast.high)),
            NONE if contrast.z is None else digits(contrast.z, 2),
            NONE if contrast.p is None else p_value(contrast.p),
        )
    elif rival.name != quantity:
        contrast_cells = (number_cell(None, correlation, reason("contrast")), NONE, NONE)
    return (
        rival.name,
        rival.n,
        estimate_cell(rival.r, correlation, reason("r"), interval, "too few cases, or a perfect r"),
        *contrast_cells,
        estimate_cell(rival.partial, correlation, reason("partial"), partial, "it takes five surfaces"),
        number_cell(rival.left_out_error, places(1), reason("left_out_error")),
        NONE if weight is None and reason("weight") is None else number_cell(weight, places(3), reason("weight")),
    )


def _rival_names(names: Sequence[str]) -> str:
    """Return the names of rivals in words; many responses of the model are counted instead.

    >>> _rival_names(["pressure", "T"]), _rival_names([*list(RESPONSES)[1:], "T"])
    ('pressure and T', 'all 9 other responses of the model and T')
    """
    responses = [name for name in names if name in RESPONSES]
    if len(responses) < MOST_NAMED:
        return _join_names(names)
    count = len(RESPONSES) - 1
    quantifier = "all" if len(responses) == count else f"{len(responses)} of the"
    measured = [name for name in names if name not in RESPONSES]
    return _join_names([f"{quantifier} {count} other responses of the model", *measured])


def _join_names(names: Sequence[str]) -> str:
    return " and ".join(text for text in (", ".join(names[:-1]), names[-1] if names else "") if text)


def _two_figures(n: int) -> str:
    """Return a count with two figures, since it is from uncertain correlations.

    >>> _two_figures(2347), _two_figures(8), _two_figures(2_600_000)
    ('about 2300', 'about 8', 'more than 10 000')
    """
    return f"more than {MANY_SURFACES // 1000} 000" if n > MANY_SURFACES else f"about {float(f'{n:.2g}'):.0f}"
