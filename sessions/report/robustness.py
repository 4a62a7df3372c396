"""Sentences on what would change the sign between prediction and scores: the strain, the ending's place, the drive."""

from collections.abc import Callable, Mapping
from typing import Literal

from sessions.prediction.variants import Variant
from sessions.report.contents import Experiment, PredictionFinding, Report
from sessions.report.wording import correlation, digits, ends_of
from sessions.statistics.scores import Relation, relation

REACH = 2.0  # of the places that are looked at, along the skin to both sides of the ending [mm]
OTHER_FINGERS = "On a finger of another size or stiffness the sign may differ; 'daq-app sensitivity' tries 900 of them."
_Value = Callable[[PredictionFinding], float | None]


def robustness(report: Report) -> list[str]:
    """Return what the other strain, the ending's place, a given force and another finger make of r with the scores."""
    kind: Literal["small", "finite"] = "small" if report.model.startswith("small") else "finite"
    other: Literal["small", "finite"] = "finite" if kind == "small" else "small"
    return [
        _in_variant(
            report,
            Variant(other, "computed", "depth"),
            f"At {other} strain, r of the SED with the mean scores",
            f"At {other} strain, which was not tried here, the sign of r may differ.",
        ),
        _by_place(report),
        _in_variant(
            report,
            Variant(kind, "computed", "force"),
            "Under the measured normal force, in place of a given depth",
            "Under the measured normal force, which was not tried here, the sign of r may differ.",
        ),
        OTHER_FINGERS,
    ]


def _in_variant(report: Report, variant: Variant, opening: str, untried: str) -> str:
    """Return r of the scores with the SED in a variant, for each experiment."""

    def sed(one: PredictionFinding) -> float | None:
        return next((alternative.sed for alternative in one.alternatives if alternative.variant == variant), None)

    tried = {p.experiment for p in report.predictions if any(one.variant == variant for one in p.alternatives)}
    parts = [
        f"{experiment.name} {_words(related)}, n = {related.n} {'stimulus' if related.n == 1 else 'stimuli'}"
        for experiment in report.experiments
        if experiment.name in tried
        for related in [_related(report, experiment, sed)]
    ]
    return f"{opening}: {'; '.join(parts)}." if parts else untried


def _words(related: Relation) -> str:
    return str(related.reason) if related.pearson is None else f"r = {correlation(related.pearson)}{ends_of(related)}"


def _related(report: Report, experiment: Experiment, value: _Value) -> Relation:
    """Return how the mean scores of an experiment go with a value of its predictions."""
    means = {mean.index: mean.mean for mean in experiment.scores}
    points = [
        (p.index, means[p.index], number)
        for p in report.predictions
        if p.experiment == experiment.name and p.index in means
        for number in [value(p)]
        if number is not None
    ]
    return relation([point[2] for point in points], [point[1] for point in points], [point[0] for point in points])


def _by_place(report: Report) -> str:
    """Return how far along the skin the ending may lie without another sign of r."""
    ranges: list[str] = []
    for experiment in report.experiments:
        by_place = {arc: _related(report, experiment, _at(arc)).pearson for arc in _places(report, experiment)}
        known = {arc: r for arc, r in by_place.items() if r is not None}
        if 0.0 in known:
            low, high = _alike(known)
            ranges.append(f"{experiment.name} from {digits(low, 2)} to {digits(high, 2)} mm")
    if not ranges:
        return "How the sign of r depends on the place of the ending is not known here."
    return (
        f"The sign of r stays the same if the ending is moved along the skin (tried up to {REACH:g} mm to each side, "
        f"positive towards the tip): in {' and in '.join(ranges)}."
    )


def _at(arc: float) -> _Value:
    return lambda one: dict(one.row).get(arc)


def _places(report: Report, experiment: Experiment) -> list[float]:
    """Return the places [mm] that every prediction of an experiment has an SED of."""
    rows = [dict(p.row) for p in report.predictions if p.experiment == experiment.name and p.row]
    return sorted(arc for arc in rows[0] if abs(arc) <= REACH and all(arc in row for row in rows)) if rows else []


def _alike(known: Mapping[float, float]) -> tuple[float, float]:
    """Return the ends of the stretch about 0 in which the sign is that at 0.

    >>> _alike({-0.5: -0.9, -0.25: 0.3, 0.0: 0.9, 0.25: 0.8})
    (-0.25, 0.25)
    """
    ends = [0.0, 0.0]
    for side, places in (
        (0, sorted((a for a in known if a < 0.0), reverse=True)),
        (1, sorted(a for a in known if a > 0.0)),
    ):
        for arc in places:
            if known[arc] * known[0.0] <= 0.0:
                break
            ends[side] = arc
    return ends[0], ends[1]
