"""Tables of strokes: what was found, and what had been planted."""

from collections.abc import Callable

from sessions.report.contents import Planted, PredictionFinding, Report, StrokeFinding
from sessions.report.tables.cells import Cell, Notes, Row, Table, grouped, table
from sessions.report.wording import NONE, places, signed, tau

Format = Callable[[float], str]

_TOO_SHORT = "the stroke has too few readings"
_WITHOUT = {
    "onset": "the force had left its noise before, or too few readings measure its noise",
    "break_away": "too few readings to fit the rise of T/N",
    "slide_onset": "too few readings to measure the speed",
}
_MISSING = {
    "break_away": "T/N does not rise before the slide, so there is no stick phase, or rises on while it slides",
    "slide_onset": "the start of the slide cannot be determined",
}
_OF_DECISION = {"onset": "onset", "break_away": "stick", "slide_onset": "slide_onset"}


def stroke_table(report: Report) -> Table | None:
    """Return the strokes with their friction, speed and flaws, each number over its interval."""
    if not report.strokes:
        return None
    notes = Notes()
    columns = "µ static [1] | µ dynamic [1] | µ maximum [1] | τ max [kPa] | speed [mm/s] | direction | flaws"

    def row(stroke: StrokeFinding) -> Row:
        def cell(name: str, shown: Format, ends: Format | None = None, unit: float = 1.0) -> Cell:
            return _estimate(notes, stroke, name, shown, ends, unit)

        return (
            cell("mu_static", places(3)),
            cell("mu_dynamic", places(3)),
            cell("mu_max", places(3)),
            cell("tau_max", tau, unit=1e3),
            cell("speed", places(1)),
            notes.number(
                stroke.direction, lambda v: {1: "p → d", -1: "d → p"}[int(v)], stroke.reasons.get("direction")
            ),
            ", ".join(name.replace("_", " ") for name in stroke.flaws) or "none",
        )

    kind = f" Under each number: {report.interval_kind}." if report.interval_kind else ""
    caption = (
        "Strokes. µ dynamic: mean over the steady window; µ static: height of the static peak; µ maximum: greatest "
        "above the force floor; τ max: greatest tangential force over the contact area, which is taken as given; "
        "speed: slope of the centre of pressure."
        f"{kind}"
    )
    return _table(report, "table-strokes", caption, columns, row, notes)


def course_table(report: Report) -> Table | None:
    """Return each stroke's forces, direction and instants, each over its bootstrap interval."""
    if not any(stroke.bootstrap for stroke in report.strokes):
        return None
    notes = Notes()
    columns = (
        "normal force [N] | tangential force [N] | heading [°] | agree [1] | "
        "onset [s] | break-away [s] | slide onset [s]"
    )

    def row(stroke: StrokeFinding) -> Row:
        def cell(name: str, shown: Format) -> Cell:
            return _estimate(notes, stroke, name, shown)

        why = stroke.reasons.get("direction") or _TOO_SHORT
        return (
            cell("normal_force", places(2)),
            cell("tangential_force", places(2)),
            cell("heading", places(1)),
            notes.number(stroke.direction_agrees, places(3), why),
            cell("onset", places(3)),
            cell("break_away", places(3)),
            cell("slide_onset", places(3)),
        )

    kinds = "; ".join(f"{name.replace('_', ' ')}: {what}" for name, what in report.interval_kinds.items())
    caption = (
        "Forces, direction and instants of the strokes, each over its interval from the same repeats. Forces: means "
        "over the steady window. Heading: angle of the movement from +x (proximal to distal) towards +y; agree: share "
        "of repeats with the reported direction. Onset: where N leaves its noise. Break-away: where T/N stops rising. "
        "Slide onset: from when the centre of pressure keeps a fifth of its steady speed. What each interval holds: "
        f"{kinds}."
    )
    return _table(report, "table-courses", caption, columns, row, notes)


def _table(
    report: Report, name: str, caption: str, columns: str, row: Callable[[StrokeFinding], Row], notes: Notes
) -> Table | None:
    """Return a table of strokes by experiment, each named with its trial and index where there are trials."""
    planned = any(stroke.trial is not None for stroke in report.strokes)

    def named(stroke: StrokeFinding) -> Row:
        stimulus = (stroke.trial, stroke.index) if planned else ()
        where = (notes.number(v, places(0), "no trial asks for it") for v in stimulus)
        return (stroke.number, *where, *row(stroke))

    groups = grouped(report, report.strokes, lambda s: s.experiment, named)
    return table(name, caption, f"{'stroke | trial | index' if planned else 'stroke'} | {columns}", groups, notes)


def _estimate(
    notes: Notes, stroke: StrokeFinding, name: str, shown: Format, of_ends: Format | None = None, unit: float = 1.0
) -> Cell:
    """Return one number of a stroke over its bootstrap interval, or why it has none."""
    without = "a person decided it" if _OF_DECISION.get(name) in stroke.decided else _WITHOUT.get(name, _TOO_SHORT)
    why = stroke.reasons.get(name) or _MISSING.get(name)
    return notes.estimate(
        getattr(stroke, name), shown, why, stroke.bootstrap.get(name), without, of_ends=of_ends, unit=unit
    )


def planted_table(report: Report) -> Table | None:
    """Return what the simulator planted beside what the analysis found."""
    if not report.planted:
        return None
    notes = Notes()
    # Of several strokes in a trial the model gets the first.
    strokes_by_trial = {stroke.trial: stroke for stroke in reversed(report.strokes) if stroke.trial is not None}
    predictions = {prediction.trial: prediction for prediction in report.predictions}
    columns = (
        "trial | index | µ planted [1] | µ found [1] | off by [%] | τ max planted [kPa] | "
        "τ max found [kPa] | off by [%] | speed planted [mm/s] | speed found [mm/s] | off by [%] | direction"
    )

    def row(p: Planted) -> Row:
        stroke = strokes_by_trial.get(p.trial)
        cells: list[Cell | str | int] = [p.trial, NONE if stroke is None or stroke.index is None else str(stroke.index)]
        prediction = predictions.get(p.trial)
        name, mu = model_mu(stroke, prediction)
        quantities: tuple[tuple[str, float, float | None, Format, float], ...] = (
            (name, p.mu, mu, places(3), 1.0),
            ("tau_max", p.tau_max, stroke.tau_max if stroke else None, tau, 1e3),
            ("speed", p.speed, stroke.speed if stroke else None, places(1), 1.0),
        )
        for name, truth, value, shown, unit in quantities:
            reason = stroke.reasons.get(name) if stroke else "no stroke was found in this trial"
            ends = stroke.bootstrap.get(name) if stroke else None
            found_cell = notes.estimate(value, shown, reason, ends, _TOO_SHORT, unit=unit)
            off = None if value is None else 100 * (value / truth - 1)
            cells += [shown(truth), found_cell, notes.number(off, signed, reason)]
        right = stroke is not None and stroke.direction == p.direction
        cells.append(Cell("as planted" if right else NONE if stroke is None or stroke.direction is None else "wrong"))
        return tuple(cells)

    names = {p.trial: s.experiment for p in report.planted if (s := strokes_by_trial.get(p.trial)) is not None}
    groups = grouped(report, report.planted, lambda p: names.get(p.trial, ""), row)
    caption = (
        "Planted friction beside what the analysis found: the µ and τ max that the model gets, and the speed. The "
        "analysis does not know what was planted. Under what was found: its 95 % bootstrap interval."
    )
    return table("table-planted", caption, columns, groups, notes)


def model_mu(stroke: StrokeFinding | None, prediction: PredictionFinding | None) -> tuple[str, float | None]:
    """Return the mu that the model got, and the name of the stroke's number that it is."""
    if prediction is not None and prediction.mu is not None:
        return ("mu_max" if prediction.mu_rule == "maximum" else "mu_dynamic"), prediction.mu
    return "mu_dynamic", None if stroke is None else stroke.mu_dynamic
