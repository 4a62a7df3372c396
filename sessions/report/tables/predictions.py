"""Tables of predictions: responses, forces next to measured ones, both directions."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import NamedTuple

from sessions.prediction import SED
from sessions.prediction.stored import Alternative, Ends, SedInterval, Variant
from sessions.report.contents import PredictionFinding, Report, StrokeFinding
from sessions.report.tables import (
    NOT_ASKED,
    TOO_SHORT,
    Cell,
    Format,
    Row,
    Rows,
    Table,
    estimate_cell,
    group_by_experiment,
    number_cell,
    table,
)
from sessions.report.wording import (
    ShownResponse,
    caption,
    direction,
    places,
    sed,
    shown_response,
    significant,
    tau,
    with_error,
)
from sessions.statistics.scores import bounds


def prediction_table(report: Report) -> Table | None:
    """Return the model's input and the predicted SED."""
    columns = "µ [1] | which µ | τ max [kPa] | depth [mm] | SED [kPa] | estimated error [%] | solved in [s]"
    strokes = {stroke.number: stroke for stroke in report.strokes}

    def row(prediction: PredictionFinding) -> Row:
        stroke = strokes.get(prediction.stroke or 0)  # they are counted from 1
        intervals = {} if stroke is None else stroke.bootstrap
        mu = intervals.get(model_mu(stroke, prediction)[0])
        tau_max = intervals.get("tau_max")
        if tau_max is not None and prediction.tau_max is not None and stroke is not None and stroke.tau_max:
            reading = prediction.tau_max / stroke.tau_max
            tau_max = tau_max[0] * reading, tau_max[1] * reading
        reason, error = prediction.reasons.get("sed"), None if prediction.doubt else prediction.error_estimate
        return (
            estimate_cell(prediction.mu, places(3), prediction.reasons.get("mu") or reason, mu, TOO_SHORT),
            {"mean over steady window": "mean"}.get(prediction.mu_rule, prediction.mu_rule),
            estimate_cell(
                prediction.tau_max, tau, prediction.reasons.get("tau_max") or reason, tau_max, TOO_SHORT, unit=1e3
            ),
            _depth(prediction),
            _stroke_sed(prediction),
            number_cell(
                error, lambda v: significant(100 * v, 2), prediction.doubt or prediction.reasons.get("error_estimate")
            ),
            number_cell(prediction.wall_s, lambda v: significant(v, 2), prediction.reasons.get("wall_s")),
        )

    intervals = [p.interval for p in report.predictions]
    return _table(report, "table-predictions", "predictions", columns, _rows(report, row), intervals)


_INTERVAL_METHOD = "by derivatives (the solver's converged tangent), or where marked * by solving draws"
_SED_ALONE = "the uncertainty of friction goes through to the SED alone"


class _Estimate(NamedTuple):
    """A number of the model with its relative error and the interval from the uncertainty of friction."""

    value: float | None
    error: float | None
    reason: str | None  # why there is no number
    interval: Ends | None
    without: str | None  # why there is no interval
    doubt: str  # why no finger can be in that state, else ""


def _cell(estimate: _Estimate, as_text: Format, least: int, unit: float = 1.0) -> Cell:
    """Return a number ± its error, over its interval. A doubtful number has neither: they would support it."""
    value, error, reason, interval, without, doubt = estimate
    if doubt and value is not None:
        return estimate_cell(value, as_text, None, None, doubt)

    def shown_with_error(number: float) -> str:
        return with_error(unit * number, None if error is None else unit * error * abs(number), least)

    return estimate_cell(value, shown_with_error, reason, interval, without, of_limits=as_text, unit=unit)


def _sed(
    value: float | None, error: float | None, reason: str | None, interval: SedInterval | None, doubt: str
) -> Cell:
    """Return an SED in kPa; an interval from solved draws is marked with a star."""
    cell = _cell(_Estimate(value, error, reason, *_limits(interval), doubt), sed, 3, 1e3)
    star = cell.interval and interval is not None and interval.method == "sampling"
    return replace(cell, interval=f"{cell.interval}*") if star else cell


def _stroke_sed(p: PredictionFinding) -> Cell:
    return _sed(p.sed, p.error_estimate, p.reasons.get("sed"), p.interval, p.doubt)


def _limits(interval: SedInterval | None) -> tuple[Ends | None, str | None]:
    """Return the limits of an interval, and the reason if it has none."""
    if interval is None:
        return None, NOT_ASKED
    return bounds(interval.low, interval.high), interval.reason or None


def afferent_table(report: Report) -> Table | None:
    """Return the firing rates of an afferent, where requested."""
    if all(p.settled_rate is None for p in report.predictions):
        return None
    quantity = shown_response(report.afferent_quantity)
    published = quantity.name == SED.name
    columns = f"{quantity.label} [{quantity.unit}] | peak rate [imp/s] | settled rate [imp/s]"

    def row(prediction: PredictionFinding) -> Row:
        def cell(rate: float | None, interval: Ends | None) -> Cell:
            return estimate_cell(rate, places(1), prediction.reasons.get("sed"), interval, without)

        without = _limits(prediction.interval)[1] if published else _SED_ALONE
        return (
            _stroke_sed(prediction) if published else _response_cell(prediction, quantity),
            cell(prediction.peak_rate, prediction.peak_rate_interval),
            cell(prediction.settled_rate, prediction.settled_rate_interval),
        )

    intervals = [p.interval for p in report.predictions] if published else []
    return _table(report, "table-afferent", "afferent", columns, _rows(report, row), intervals, label=quantity.label)


def _response_cell(prediction: PredictionFinding, quantity: ShownResponse) -> Cell:
    """Return a quantity at the ending in its shown unit, ± the error from the mesh."""
    numbers = quantity.numbers(prediction)
    if not numbers:
        return number_cell(None, str, prediction.reasons.get("sed"))
    value, error = numbers
    return Cell(with_error(quantity.factor * value, quantity.factor * (error or 0.0), quantity.places))


def variants_table(report: Report) -> Table | None:
    """Return each trial's SED in all variants, in columns, with strains in groups of rows."""

    def cell(variant: Alternative) -> Cell:
        return _sed(variant.sed, variant.error_estimate, variant.reason, variant.interval, variant.doubt)

    labels = dict.fromkeys(variant.conditions for variant in _variants(report))
    legend = "; ".join(f"({n}) {label}" for n, label in enumerate(labels, 1))
    columns = " | ".join(f"({n}) [kPa]" for n in range(1, len(labels) + 1))
    return _table(
        report, "table-beside", "variants", columns, _by_strain(report, cell), _variant_intervals(report), legend=legend
    )


def variant_forces_table(report: Report) -> Table | None:
    """Return the normal force of each variant, or the depth under the measured force."""

    def cell(alternative: Alternative) -> Cell:
        pressed = alternative.variant.driven == "force"
        value = alternative.indentation if pressed else alternative.normal_force
        error = alternative.indentation_error if pressed else alternative.normal_force_error
        value = None if alternative.sed is None else value
        bands = alternative.interval
        interval = None if bands is None else bands.indentation if pressed else bands.normal_force
        estimate = _Estimate(value, error, alternative.reason, interval, _limits(bands)[1], alternative.doubt)
        return _cell(estimate, places(2), 2)

    units = {variant.conditions: "mm" if variant.driven == "force" else "N" for variant in _variants(report)}
    columns = " | ".join(f"({n}) [{unit}]" for n, unit in enumerate(units.values(), 1))
    rows, intervals = _by_strain(report, cell), _variant_intervals(report)
    return _table(report, "table-beside-forces", "variant-forces", columns, rows, intervals)


def _variants(report: Report) -> list[Variant]:
    """Return the variants of the trials, the same at each strain; [] without any."""
    alternatives = next((p.alternatives for p in report.predictions if p.alternatives), ())
    return [alternative.variant for alternative in alternatives]


def _variant_intervals(report: Report) -> list[SedInterval | None]:
    return [alternative.interval for p in report.predictions for alternative in p.alternatives]


def _by_strain(report: Report, cell: Callable[[Alternative], Cell]) -> list[Rows]:
    groups: list[Rows] = []
    for strain in dict.fromkeys(variant.kinematics for variant in _variants(report)):

        def row(p: PredictionFinding, strain: str = strain) -> Row:
            return tuple(map(cell, (a for a in p.alternatives if a.variant.kinematics == strain)))

        groups += [(f"{name or 'trials'}, at {strain} strain", rows) for name, rows in _rows(report, row)]
    return groups


def force_table(report: Report) -> Table | None:
    """Return the model's forces next to the measured ones."""
    columns = (
        "model N [N/mm] | model N × width [N] | measured N [N] | model T × width [N] | "
        "measured T [N] | depth of the model [mm] | depth to match [mm]"
    )
    strokes = {stroke.number: stroke.bootstrap for stroke in report.strokes}

    def row(prediction: PredictionFinding) -> Row:
        intervals = strokes.get(prediction.stroke or 0, {})
        interval = prediction.interval
        normal, tangential = (interval.normal_force, interval.tangential_force) if interval else (None, None)
        per_mm = None if normal is None or not report.width else (normal[0] / report.width, normal[1] / report.width)
        without = _limits(interval)[1]

        def cell(name: str, error: float | None, interval: Ends | None, without: str | None, decimals: int = 2) -> Cell:
            doubt, reason = prediction.doubt if name in _OF_STATE else "", prediction.reasons.get(name)
            value: float | None = getattr(prediction, name)
            return _cell(_Estimate(value, error, reason, interval, without, doubt), places(decimals), decimals)

        depth = prediction.matching_depth
        by_force = (a for a in prediction.alternatives if a.variant.driven == "force" and a.indentation == depth)
        without_depth = next((_limits(alternative.interval)[1] for alternative in by_force), _ROUGH)
        return (
            cell("normal_per_mm", prediction.normal_force_error, per_mm, without, 4),
            cell("normal_force", prediction.normal_force_error, normal, without),
            cell("measured_normal", None, intervals.get("normal_force"), TOO_SHORT),
            cell("tangential_force", prediction.tangential_force_error, tangential, without),
            cell("measured_tangential", None, intervals.get("tangential_force"), TOO_SHORT),
            _depth(prediction),
            cell("matching_depth", prediction.matching_depth_error, prediction.matching_depth_interval, without_depth),
        )

    origin = f" ({report.width_origin})" if report.width_origin else ""
    width = "the finger's width" if report.width is None else f"a width of {report.width:g} mm{origin}"
    intervals = [ends for p in report.predictions for ends in (p.interval, p.matching_depth_interval)]
    return _table(report, "table-forces", "forces", columns, _rows(report, row), intervals, width=width)


_OF_STATE = ("normal_per_mm", "normal_force", "tangential_force")  # the depth to match belongs to another state
_ROUGH = "computed on a coarse mesh; a trial that --variants small solves under the measured force has an interval"


def direction_table(report: Report) -> Table | None:
    """Return the SED of both directions at equal depth."""
    if all(p.opposite_sed is None for p in report.predictions):
        return None
    columns = "depth [mm] | stroked | SED as stroked [kPa] | SED the other way [kPa] | d → p over p → d [1]"

    def row(prediction: PredictionFinding) -> Row:
        opposite, opposite_doubt = prediction.opposite_interval, prediction.opposite_doubt
        reason = prediction.reasons.get("opposite_sed") or prediction.reasons.get("sed")
        ratio, interval = _ratio(prediction)
        doubt = prediction.doubt or opposite_doubt
        without = doubt or _limits(opposite)[1] or _limits(prediction.interval)[1]
        return (
            _depth(prediction),
            direction(prediction.direction),
            _stroke_sed(prediction),
            _sed(prediction.opposite_sed, prediction.opposite_error, reason, opposite, opposite_doubt),
            estimate_cell(ratio, places(3), reason, None if doubt else interval, without),
        )

    intervals = [interval for p in report.predictions for interval in (p.interval, p.opposite_interval)]
    return _table(report, "table-directions", "directions", columns, _rows(report, row), intervals)


def _ratio(prediction: PredictionFinding) -> tuple[float | None, Ends | None]:
    """Return the SED slid from distal to proximal over that slid back, with the range from their intervals."""
    if prediction.sed is None or prediction.opposite_sed is None or prediction.direction is None:
        return None, None
    states = (prediction.sed, prediction.interval), (prediction.opposite_sed, prediction.opposite_interval)
    (upper, upper_interval), (lower, lower_interval) = states if prediction.direction < 0 else states[::-1]
    numerator, denominator = _limits(upper_interval)[0], _limits(lower_interval)[0]
    if numerator is None or denominator is None:
        return upper / lower, None
    return upper / lower, (numerator[0] / denominator[1], numerator[1] / denominator[0])


def _table(
    report: Report,
    name: str,
    caption_name: str,
    columns: str,
    groups: Iterable[Rows],
    intervals: Iterable[object],
    **values: str,
) -> Table | None:
    """Return a table with rows named by trial and index, or by the stroke without trials.

    Its caption explains the `intervals` under its numbers unless all are None: nobody asked for them.
    """
    computed = any(interval is not None for interval in intervals)
    under = caption(f"{caption_name}-under", how=_INTERVAL_METHOD) if computed else ""
    planned = any(p.trial is not None for p in report.predictions)
    columns = f"{'trial | index' if planned else 'stroke'} | {columns}"
    return table(name, caption_name, columns, groups, under=under, model=report.model, **values)


def _rows(report: Report, row: Callable[[PredictionFinding], Row]) -> list[Rows]:
    """Return the named rows of all trials by experiment; `row` gives the cells after the name."""

    def name_row(prediction: PredictionFinding) -> Row:
        index = prediction.code if prediction.index is None else str(prediction.index)
        name: Row = (str(prediction.stroke),) if prediction.trial is None else (prediction.trial, index)
        return (*name, *row(prediction))

    return group_by_experiment(report, report.predictions, lambda p: p.experiment, name_row)


def _depth(p: PredictionFinding) -> Cell:
    return number_cell(p.indentation, lambda v: f"{v:g}", "no plan states the model's depth")


def model_mu(stroke: StrokeFinding | None, prediction: PredictionFinding | None) -> tuple[str, float | None]:
    """Return the name of the stroke's number that is the model's mu, and its value."""
    if prediction is not None and prediction.mu is not None:
        return ("mu_max" if prediction.mu_rule == "maximum" else "mu_dynamic"), prediction.mu
    return "mu_dynamic", None if stroke is None else stroke.mu_dynamic
