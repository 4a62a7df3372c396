"""Tables of predictions: responses, forces beside measured ones, both directions."""

from collections.abc import Callable

from sessions.alternative import Alternative
from sessions.exports.report_tables.cells import Cell, Column, Group, Notes, Table, grouped
from sessions.exports.wording import between, digits, direction, places, sed, significant, tau
from sessions.report import PredictionFinding, Report
from sessions.sed_interval import SedInterval


def prediction_table(report: Report) -> Table | None:
    """Return what the model was given, and the SED it predicts."""
    if not report.predictions:
        return None
    notes = Notes()
    columns = (
        *_who(report),
        Column("µ"),
        Column("which µ"),
        Column("τ max", "kPa"),
        Column("depth", "mm"),
        Column("SED", "kPa"),
        Column("95 % interval", "kPa"),
        Column("estimated error", "%"),
        Column("solved in", "s"),
    )

    def row(p: PredictionFinding) -> tuple[Cell, ...]:
        return (
            *_named(p),
            notes.number(p.mu, places(3), p.reasons.get("mu") or p.reasons.get("sed")),
            Cell({"mean over steady window": "mean"}.get(p.mu_rule, p.mu_rule)),
            notes.number(p.tau_max, tau, p.reasons.get("tau_max") or p.reasons.get("sed")),
            _depth(p, notes),
            notes.number(p.sed, sed, p.reasons.get("sed")),
            _interval(p, notes),
            notes.number(p.error_estimate, lambda v: significant(100 * v, 2), p.reasons.get("error_estimate")),
            notes.number(p.wall_s, lambda v: significant(v, 2), p.reasons.get("wall_s")),
        )

    groups = grouped(report, report.predictions, lambda p: p.experiment, row)
    caption = (
        "Predictions: SED averaged over the ending in the settled state (1 kPa = 1 mJ/cm³). Which µ: the mean over the "
        "steady window, or the maximum. Interval: what the uncertainty of friction alone makes of the SED, by "
        "derivatives (the solver's converged tangent), or where marked * by solving draws; the model's own error is "
        "not in it. Estimated error: of one "
        "SED, from the mesh; differences between stimuli, which share the mesh, are more accurate. "
        f"Model: {report.model}."
    )
    return Table("table-predictions", caption, columns, groups, notes.listed())


def _interval(p: PredictionFinding, notes: Notes) -> Cell:
    if p.sed_interval is None:
        return notes.number(None, sed, p.reasons.get("sed_interval") or p.reasons.get("sed") or "not computed")
    low, high = p.sed_interval
    return Cell(f"{between(low, high, sed, 1e3)}{'*' if p.interval_by == 'sampling' else ''}")


def afferent_table(report: Report) -> Table | None:
    """Return the firing rates of an afferent, where they were asked for."""
    if all(p.settled_rate is None for p in report.predictions):
        return None
    notes = Notes()
    columns = (*_who(report), Column("SED", "kPa"), Column("peak rate", "imp/s"), Column("settled rate", "imp/s"))

    def row(p: PredictionFinding) -> tuple[Cell, ...]:
        rates = (notes.number(rate, places(1), p.reasons.get("sed")) for rate in (p.peak_rate, p.settled_rate))
        return (*_named(p), notes.number(p.sed, sed, p.reasons.get("sed")), *rates)

    groups = grouped(report, report.predictions, lambda p: p.experiment, row)
    caption = (
        "Firing of an SA-II afferent: an illustration. No fitted map from SED to the rate of a human SA-II afferent is "
        "known; every parameter is told below, assumed unless it says that somebody set it. The order of the settled "
        "rates is that of the SED as long as no rate lies at a bound, every SED is beyond the threshold and the "
        f"adaptation gain stays below the static gain. Model of the SED: {report.model}."
    )
    return Table("table-afferent", caption, columns, groups, notes.listed())


def beside_table(report: Report) -> Table | None:
    """Return each trial's SED in every variant it was predicted in, side by side; strains one under another."""
    ways = _ways(report)
    if not ways:
        return None
    notes = Notes()

    def cell(one: Alternative) -> Cell:
        if one.sed is None:
            return notes.number(None, sed, one.reason)
        held = one.indentation if one.variant.driven == "force" else one.normal_force
        unit = "mm" if one.variant.driven == "force" else "N"
        text = sed(one.sed) if held is None else f"{sed(one.sed)} ({digits(held, 2)} {unit})"
        return Cell(text, notes.mark(one.doubt), one.doubt) if one.doubt else Cell(text)

    told = "; ".join(f"({n}) {way}" for n, way in enumerate(ways, 1))
    caption = (
        f"The same trials predicted otherwise, SED in kPa: {told}. In brackets the model's normal force, or the depth "
        "that the measured force presses it to. At one strain all trials of a column share a mesh. A dash says why."
    )
    columns = (*_who(report), *(Column(f"({n})", "kPa") for n in range(1, len(ways) + 1)))
    return Table("table-beside", caption, columns, _by_strain(report, cell), notes.listed())


def beside_interval_table(report: Report) -> Table | None:
    """Return the interval of each SED in every variant, where they were asked for."""
    ways, notes = _ways(report), Notes()
    if all(one.interval is None for p in report.predictions for one in p.alternatives):
        return None
    caption = (
        "95 % intervals of the SEDs of the table before, column by column, that the uncertainty of friction makes, and "
        "of the force where that drives the model: by derivatives (the solver's converged tangent), or where marked * "
        "by solving draws."
    )
    columns = (*_who(report), *(Column(f"({n})", "kPa") for n in range(1, len(ways) + 1)))
    groups = _by_strain(report, lambda one: _ends(one.interval, notes, one.reason))
    return Table("table-beside-intervals", caption, columns, groups, notes.listed())


def _ways(report: Report) -> tuple[str, ...]:
    """Return the ways trials were predicted otherwise, the same at each strain."""
    first = next((p.alternatives for p in report.predictions if p.alternatives), ())
    return tuple(dict.fromkeys(one.variant.way for one in first))


def _by_strain(report: Report, cell: Callable[[Alternative], Cell]) -> tuple[Group, ...]:
    """Return the rows of each experiment at each strain."""
    first = next((p.alternatives for p in report.predictions if p.alternatives), ())
    groups: list[Group] = []
    for strain in dict.fromkeys(one.variant.kinematics for one in first):

        def row(p: PredictionFinding, strain: str = strain) -> tuple[Cell, ...]:
            return (*_named(p), *(cell(one) for one in p.alternatives if one.variant.kinematics == strain))

        found = grouped(report, report.predictions, lambda p: p.experiment, row)
        groups += [Group(f"{group.name or 'trials'}, at {strain} strain", group.rows) for group in found]
    return tuple(groups)


def _ends(interval: SedInterval | None, notes: Notes, why: str | None) -> Cell:
    if interval is None or interval.low is None or interval.high is None:
        told = "" if interval is None else interval.reason
        return notes.number(None, sed, told or why or "not computed")
    return Cell(f"{between(interval.low, interval.high, sed, 1e3)}{'*' if interval.method == 'sampling' else ''}")


def force_table(report: Report) -> Table | None:
    """Return the model's forces beside the measured ones."""
    if not report.predictions:
        return None
    notes = Notes()
    columns = (
        *_who(report),
        Column("model N", "N/mm"),
        Column("model N × width", "N"),
        Column("measured N", "N"),
        Column("model T × width", "N"),
        Column("measured T", "N"),
        Column("depth of the model", "mm"),
        Column("depth to match", "mm"),
    )

    def row(p: PredictionFinding) -> tuple[Cell, ...]:
        def cell(name: str, value: float | None, decimals: int = 2) -> Cell:
            return notes.number(value, places(decimals), p.reasons.get(name))

        return (
            *_named(p),
            cell("normal_per_mm", p.normal_per_mm, 4),
            cell("normal_force", p.normal_force),
            cell("measured_normal", p.measured_normal),
            cell("tangential_force", p.tangential_force),
            cell("measured_tangential", p.measured_tangential),
            _depth(p, notes),
            cell("matching_depth", p.matching_depth),
        )

    width = "the finger's width" if report.width is None else f"a width of {report.width:g} mm"
    caption = (
        f"Forces of the model, per mm and times {width} (assumed), beside the means measured over the steady window. "
        f"Depth to match: indentation at which the model would press as hard as the subject did. Model: {report.model}."
    )
    groups = grouped(report, report.predictions, lambda p: p.experiment, row)
    return Table("table-forces", caption, columns, groups, notes.listed())


def direction_table(report: Report) -> Table | None:
    """Return the SED of both directions at equal depth."""
    if all(p.opposite_sed is None for p in report.predictions):
        return None
    notes = Notes()
    columns = (
        *_who(report),
        Column("depth", "mm"),
        Column("stroked"),
        Column("SED as stroked", "kPa"),
        Column("95 % interval", "kPa"),
        Column("SED the other way", "kPa"),
        Column("95 % interval", "kPa"),
        Column("d → p over p → d"),
    )

    def row(p: PredictionFinding) -> tuple[Cell, ...]:
        ratio = None
        if p.sed is not None and p.opposite_sed is not None and p.direction is not None:
            backward, forward = (p.sed, p.opposite_sed) if p.direction < 0 else (p.opposite_sed, p.sed)
            ratio = backward / forward
        why = p.reasons.get("opposite_sed") or p.reasons.get("sed")
        return (
            *_named(p),
            _depth(p, notes),
            Cell(direction(p.direction)),
            notes.number(p.sed, sed, p.reasons.get("sed")),
            _interval(p, notes),
            notes.number(p.opposite_sed, sed, why),
            _ends(p.opposite_interval, notes, why),
            notes.number(ratio, places(3), why),
        )

    caption = (
        "Both directions at equal depth, each with its trial's friction. Intervals: what the uncertainty of friction "
        "makes of each, by derivatives (the solver's converged tangent), or where marked * by solving draws. "
        "Last column: SED while sliding from distal "
        f"to proximal over SED while sliding from proximal to distal. Model: {report.model}."
    )
    groups = grouped(report, report.predictions, lambda p: p.experiment, row)
    return Table("table-directions", caption, columns, groups, notes.listed())


def _who(report: Report) -> tuple[Column, ...]:
    """Return the columns that name a row: trial and index, or the stroke where there are no trials."""
    planned = any(p.trial is not None for p in report.predictions)
    return (Column("trial"), Column("index")) if planned else (Column("stroke"),)


def _named(p: PredictionFinding) -> tuple[Cell, ...]:
    return (Cell(str(p.stroke)),) if p.trial is None else (Cell(str(p.trial)), Cell(str(p.index)))


def _depth(p: PredictionFinding, notes: Notes) -> Cell:
    return notes.number(p.indentation, lambda v: f"{v:g}", "no plan tells how deep the model is to press")
