"""Tables of predictions: responses, forces beside measured ones, both directions."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import NamedTuple

from sessions.prediction import SED
from sessions.prediction.stored import Alternative, Ends, SedInterval, Variant
from sessions.report.contents import PredictionFinding, Report, StrokeFinding
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
    """Return what the model was given, and the SED it predicts."""
    columns = "µ [1] | which µ | τ max [kPa] | depth [mm] | SED [kPa] | estimated error [%] | solved in [s]"
    strokes = {stroke.number: stroke for stroke in report.strokes}

    def row(p: PredictionFinding) -> Row:
        stroke = strokes.get(p.stroke or 0)  # they are counted from 1
        intervals = {} if stroke is None else stroke.bootstrap
        mu = intervals.get(model_mu(stroke, p)[0])
        tau_max = intervals.get("tau_max")
        if tau_max is not None and p.tau_max is not None and stroke is not None and stroke.tau_max:
            tau_max = tau_max[0] * p.tau_max / stroke.tau_max, tau_max[1] * p.tau_max / stroke.tau_max  # as it was read
        why, error = p.reasons.get("sed"), None if p.doubt else p.error_estimate
        return (
            estimate_cell(p.mu, places(3), p.reasons.get("mu") or why, mu, TOO_SHORT),
            {"mean over steady window": "mean"}.get(p.mu_rule, p.mu_rule),
            estimate_cell(p.tau_max, tau, p.reasons.get("tau_max") or why, tau_max, TOO_SHORT, unit=1e3),
            _depth(p),
            _stroke_sed(p),
            number_cell(error, lambda v: significant(100 * v, 2), p.doubt or p.reasons.get("error_estimate")),
            number_cell(p.wall_s, lambda v: significant(v, 2), p.reasons.get("wall_s")),
        )

    words = caption("predictions", how=_HOW, model=report.model)
    return _table(report, "table-predictions", words, columns, _rows(report, row))


_HOW = "by derivatives (the solver's converged tangent), or where marked * by solving draws"
_SED_ALONE = "the uncertainty of friction goes through to the SED alone"


class _Estimate(NamedTuple):
    """A number of the model, with its relative error and the interval that friction makes, or why it has none."""

    value: float | None
    error: float | None
    reason: str | None  # why there is no number
    ends: Ends | None
    without: str | None  # why there is no interval
    doubt: str = ""  # why no finger can be in that state


def _cell(of: _Estimate, as_text: Format, least: int, unit: float = 1.0) -> Cell:
    """Return a number ± its error, over its interval; in doubt without both, which would speak for it."""
    if of.doubt and of.value is not None:
        return estimate_cell(of.value, as_text, None, None, of.doubt)

    def shown_with_error(value: float) -> str:
        return with_error(unit * value, None if of.error is None else unit * of.error * abs(value), least)

    return estimate_cell(of.value, shown_with_error, of.reason, of.ends, of.without, of_ends=as_text, unit=unit)


def _sed(
    value: float | None, error: float | None, reason: str | None, interval: SedInterval | None, doubt: str
) -> Cell:
    """Return an SED in kPa; an interval for which draws were solved is marked with a star."""
    cell = _cell(_Estimate(value, error, reason, *_of(interval), doubt), sed, 3, 1e3)
    star = cell.interval and interval is not None and interval.method == "sampling"
    return replace(cell, interval=f"{cell.interval}*") if star else cell


def _stroke_sed(p: PredictionFinding) -> Cell:
    return _sed(p.sed, p.error_estimate, p.reasons.get("sed"), p.interval, p.doubt)


def _of(interval: SedInterval | None) -> tuple[Ends | None, str | None]:
    """Return the ends of an interval, and why it has none."""
    return (None, None) if interval is None else (bounds(interval.low, interval.high), interval.reason or None)


def afferent_table(report: Report) -> Table | None:
    """Return the firing rates of an afferent, where they were asked for."""
    if all(p.settled_rate is None for p in report.predictions):
        return None
    quantity = shown_response(report.afferent_quantity)
    published = quantity.name == SED.name
    columns = f"{quantity.label} [{quantity.unit}] | peak rate [imp/s] | settled rate [imp/s]"

    def row(p: PredictionFinding) -> Row:
        estimates = ((p.peak_rate, p.peak_rate_interval), (p.settled_rate, p.settled_rate_interval))
        why, without = p.reasons.get("sed"), _of(p.interval)[1] if published else _SED_ALONE
        rates = (estimate_cell(rate, places(1), why, ends, without) for rate, ends in estimates)
        return (_stroke_sed(p) if published else _response_cell(p, quantity), *rates)

    below = "Under each number: the 95 % interval that friction's uncertainty makes of it, parameters as given; "
    words = caption("afferent", label=quantity.label, below=below if published else "", model=report.model)
    return _table(report, "table-afferent", words, columns, _rows(report, row))


def _response_cell(p: PredictionFinding, quantity: ShownResponse) -> Cell:
    """Return a quantity at the ending in the unit shown, ± its error from the mesh."""
    numbers = quantity.of(p)
    if not numbers:
        return number_cell(None, str, p.reasons.get("sed"))
    value, error = (quantity.factor * number for number in (*numbers, 0.0)[:2])
    return Cell(with_error(value, error, quantity.places))


def variants_table(report: Report) -> Table | None:
    """Return each trial's SED in every variant it was predicted in, side by side; strains one under another."""

    def cell(one: Alternative) -> Cell:
        return _sed(one.sed, one.error_estimate, one.reason, one.interval, one.doubt)

    ways = dict.fromkeys(variant.way for variant in _variants(report))
    legend = "; ".join(f"({n}) {way}" for n, way in enumerate(ways, 1))
    columns = " | ".join(f"({n}) [kPa]" for n in range(1, len(ways) + 1))
    words = caption("variants", legend=legend, how=_HOW)
    return _table(report, "table-beside", words, columns, _by_strain(report, cell))


def variant_forces_table(report: Report) -> Table | None:
    """Return the normal force of each variant, or the depth that the measured force presses it to."""

    def cell(one: Alternative) -> Cell:
        pressed = one.variant.driven == "force"
        value = one.indentation if pressed else one.normal_force
        error = one.indentation_error if pressed else one.normal_force_error
        interval = one.interval
        ends = None if interval is None else interval.indentation if pressed else interval.normal_force
        why = None if interval is None else interval.reason
        estimate = _Estimate(None if one.sed is None else value, error, one.reason, ends, why, one.doubt)
        return _cell(estimate, places(2), 2)

    units = {variant.way: "mm" if variant.driven == "force" else "N" for variant in _variants(report)}
    columns = " | ".join(f"({n}) [{unit}]" for n, unit in enumerate(units.values(), 1))
    return _table(report, "table-beside-forces", caption("variant-forces"), columns, _by_strain(report, cell))


def _variants(report: Report) -> list[Variant]:
    """Return how trials were predicted otherwise, in the same ways at each strain; [] where none was."""
    return [one.variant for one in next((p.alternatives for p in report.predictions if p.alternatives), ())]


def _by_strain(report: Report, cell: Callable[[Alternative], Cell]) -> list[Rows]:
    groups: list[Rows] = []
    for strain in dict.fromkeys(variant.kinematics for variant in _variants(report)):

        def row(p: PredictionFinding, strain: str = strain) -> Row:
            return tuple(cell(one) for one in p.alternatives if one.variant.kinematics == strain)

        groups += [(f"{name or 'trials'}, at {strain} strain", rows) for name, rows in _rows(report, row)]
    return groups


def force_table(report: Report) -> Table | None:
    """Return the model's forces beside the measured ones."""
    columns = (
        "model N [N/mm] | model N × width [N] | measured N [N] | model T × width [N] | "
        "measured T [N] | depth of the model [mm] | depth to match [mm]"
    )
    strokes = {stroke.number: stroke.bootstrap for stroke in report.strokes}

    def row(p: PredictionFinding) -> Row:
        intervals = strokes.get(p.stroke or 0, {})
        normal, tangential = (
            (None, None) if p.interval is None else (p.interval.normal_force, p.interval.tangential_force)
        )
        per_mm = None if normal is None or not report.width else (normal[0] / report.width, normal[1] / report.width)

        def cell(name: str, error: float | None, ends: Ends | None, without: str | None, decimals: int = 2) -> Cell:
            doubt = p.doubt if name in _OF_STATE else ""
            estimate = _Estimate(getattr(p, name), error, p.reasons.get(name), ends, without, doubt)
            return _cell(estimate, places(decimals), decimals)

        why = _of(p.interval)[1]
        return (
            cell("normal_per_mm", p.normal_force_error, per_mm, why, 4),
            cell("normal_force", p.normal_force_error, normal, why),
            cell("measured_normal", None, intervals.get("normal_force"), TOO_SHORT),
            cell("tangential_force", p.tangential_force_error, tangential, why),
            cell("measured_tangential", None, intervals.get("tangential_force"), TOO_SHORT),
            _depth(p),
            cell("matching_depth", p.matching_depth_error, p.matching_depth_interval, why or _ROUGH),
        )

    origin = f" ({report.width_origin})" if report.width_origin else ""
    width = "the finger's width" if report.width is None else f"a width of {report.width:g} mm{origin}"
    words = caption("forces", width=width, model=report.model)
    return _table(report, "table-forces", words, columns, _rows(report, row))


_OF_STATE = ("normal_per_mm", "normal_force", "tangential_force")  # the depth to match is that of another state
_ROUGH = "found on a rough mesh; under the measured force trials are solved with tau_max computed (--variants small)"


def direction_table(report: Report) -> Table | None:
    """Return the SED of both directions at equal depth."""
    if all(p.opposite_sed is None for p in report.predictions):
        return None
    columns = "depth [mm] | stroked | SED as stroked [kPa] | SED the other way [kPa] | d → p over p → d [1]"

    def row(p: PredictionFinding) -> Row:
        back, without = _of(p.opposite_interval)
        why = p.reasons.get("opposite_sed") or p.reasons.get("sed")
        ratio, ends = _ratio(p, back)
        doubt = p.doubt or p.opposite_doubt
        unknown = doubt or without or _of(p.interval)[1]
        return (
            _depth(p),
            direction(p.direction),
            _stroke_sed(p),
            _sed(p.opposite_sed, p.opposite_error, why, p.opposite_interval, p.opposite_doubt),
            estimate_cell(ratio, places(3), why, None if doubt else ends, unknown),
        )

    words = caption("directions", how=_HOW, model=report.model)
    return _table(report, "table-directions", words, columns, _rows(report, row))


def _ratio(p: PredictionFinding, back: Ends | None) -> tuple[float | None, Ends | None]:
    """Return the SED slid from distal to proximal over that slid back, with the range that their intervals allow."""
    if p.sed is None or p.opposite_sed is None or p.direction is None:
        return None, None
    upper, lower = (p.sed, p.opposite_sed) if p.direction < 0 else (p.opposite_sed, p.sed)
    ahead = _of(p.interval)[0]
    if back is None or ahead is None:
        return upper / lower, None
    over, under = (ahead, back) if p.direction < 0 else (back, ahead)
    return upper / lower, (over[0] / under[1], over[1] / under[0])


def _table(report: Report, name: str, caption: str, columns: str, groups: Iterable[Rows]) -> Table | None:
    """Return a table whose rows are named by trial and index, or by the stroke where there are no trials."""
    planned = any(p.trial is not None for p in report.predictions)
    return table(name, caption, f"{'trial | index' if planned else 'stroke'} | {columns}", groups)


def _rows(report: Report, row: Callable[[PredictionFinding], Row]) -> list[Rows]:
    """Return the named rows of all trials by experiment; `row` gives the cells after the name."""

    def name_row(p: PredictionFinding) -> Row:
        name = (str(p.stroke),) if p.trial is None else (p.trial, p.code if p.index is None else str(p.index))
        return (*name, *row(p))

    return group_by_experiment(report, report.predictions, lambda p: p.experiment, name_row)


def _depth(p: PredictionFinding) -> Cell:
    return number_cell(p.indentation, lambda v: f"{v:g}", "no plan says how deep the model is pressed")


def model_mu(stroke: StrokeFinding | None, prediction: PredictionFinding | None) -> tuple[str, float | None]:
    """Return the mu that the model got, and the name of the stroke's number that it is."""
    if prediction is not None and prediction.mu is not None:
        return ("mu_max" if prediction.mu_rule == "maximum" else "mu_dynamic"), prediction.mu
    return "mu_dynamic", None if stroke is None else stroke.mu_dynamic
