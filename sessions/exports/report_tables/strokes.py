"""Tables of strokes: what was found, and what had been planted."""

from collections.abc import Callable

from sessions.exports.report_tables.cells import Cell, Column, Notes, Table, grouped
from sessions.exports.wording import NONE, between, places, signed, tau, with_error
from sessions.report import Planted, Report, StrokeFinding

_TOO_SHORT = "the stroke has too few readings for an interval"
_WITHOUT = {
    "break_away": "the ratio does not climb before the slide, so there is no stick phase; or a person decided it",
    "slide_onset": "nothing tells when the slide begins, or a person decided it",
}


def stroke_table(report: Report) -> Table | None:
    """Return the strokes with their friction, speed and flaws."""
    if not report.strokes:
        return None
    notes = Notes()
    planned = any(stroke.trial is not None for stroke in report.strokes)
    columns = (
        Column("stroke"),
        *((Column("trial"), Column("index")) if planned else ()),
        Column("onset", "s"),
        Column("µ static"),
        Column("µ dynamic"),
        Column("µ maximum"),
        Column("τ max", "kPa"),
        Column("normal force", "N"),
        Column("speed", "mm/s"),
        Column("direction"),
        Column("flaws"),
    )
    groups = grouped(report, report.strokes, lambda s: s.experiment, lambda s: _stroke_row(s, notes, planned=planned))
    caption = (
        "Strokes. µ dynamic: mean over the steady window (± half its 95 % interval); µ static: height of the static "
        "peak; µ maximum: greatest above the force floor; τ max: greatest tangential force over the contact area; "
        "normal force: mean over the steady window; speed: slope of the centre of pressure (± its standard error)."
    )
    return Table("table-strokes", caption, columns, groups, notes.listed())


def _stroke_row(stroke: StrokeFinding, notes: Notes, *, planned: bool) -> tuple[Cell, ...]:
    def cell(name: str, value: float | None, shown: Callable[[float], str]) -> Cell:
        return notes.number(value, shown, stroke.reasons.get(name))

    half = None if stroke.mu_interval is None else (stroke.mu_interval[1] - stroke.mu_interval[0]) / 2
    error = stroke.speed_error
    marks = ", ".join(name.replace("_", " ") for name in stroke.flaws)
    return (
        Cell(str(stroke.number)),
        *((cell("trial", stroke.trial, places(0)), cell("index", stroke.index, places(0))) if planned else ()),
        cell("onset", stroke.onset, places(3)),
        cell("mu_static", stroke.mu_static, places(3)),
        cell("mu_dynamic", stroke.mu_dynamic, lambda v: with_error(v, half, 3)),
        cell("mu_max", stroke.mu_max, places(3)),
        cell("tau_max", stroke.tau_max, tau),
        cell("normal_force", stroke.normal_force, places(2)),
        cell("speed", stroke.speed, lambda v: with_error(v, error, 1)),
        cell("direction", stroke.direction, lambda v: {1: "p → d", -1: "d → p"}[int(v)]),
        Cell(marks or "none"),
    )


Shown = tuple[tuple[str, Column, Callable[[float], str]], ...]


def interval_table(report: Report) -> Table | None:
    """Return the bootstrap intervals of each stroke's friction and speed."""
    shown: Shown = (
        ("mu_static", Column("µ static"), places(3)),
        ("mu_dynamic", Column("µ dynamic"), places(3)),
        ("mu_max", Column("µ maximum"), places(3)),
        ("tau_max", Column("τ max", "kPa"), tau),
        ("speed", Column("speed", "mm/s"), places(1)),
    )
    caption = f"Intervals of the strokes' friction and speed: {report.interval_kind}. The contact area is as given."
    return _intervals(report, "table-intervals", caption, shown)


def course_table(report: Report) -> Table | None:
    """Return the bootstrap intervals of each stroke's forces, direction and instants."""
    shown: Shown = (
        ("normal_force", Column("normal force", "N"), places(2)),
        ("tangential_force", Column("tangential force", "N"), places(2)),
        ("heading", Column("heading", "°"), places(1)),
        ("break_away", Column("break-away", "s"), places(3)),
        ("slide_onset", Column("slide onset", "s"), places(3)),
    )
    kinds = "; ".join(f"{name.replace('_', ' ')}: {what}" for name, what in report.interval_kinds.items())
    caption = (
        "Intervals of the strokes' forces, direction and instants, from the same repeats. Forces: means over the "
        "steady window. Heading: angle of the movement from +x (proximal to distal) towards +y; agree: share of "
        "repeats with the direction told. Break-away: where T/N stops climbing. Slide onset: from when the centre of "
        f"pressure keeps a fifth of its steady speed. What each holds: {kinds}."
    )
    return _intervals(report, "table-courses", caption, shown, agreeing=True)


def _intervals(report: Report, name: str, caption: str, shown: Shown, *, agreeing: bool = False) -> Table | None:
    if not any(stroke.bootstrap for stroke in report.strokes):
        return None
    notes = Notes()
    planned = any(stroke.trial is not None for stroke in report.strokes)

    def row(stroke: StrokeFinding) -> tuple[Cell, ...]:
        cells = [Cell(str(stroke.number))]
        if planned:
            cells += [notes.number(v, places(0), "no trial asks for it") for v in (stroke.trial, stroke.index)]
        for name, _, told in shown:
            interval = stroke.bootstrap.get(name)
            why = stroke.reasons.get(name) or _WITHOUT.get(name, _TOO_SHORT)
            cells.append(
                notes.number(None, told, why)
                if interval is None
                else Cell(between(*interval, told, 1e3 if name == "tau_max" else 1.0))
            )
        if agreeing:
            cells.append(
                notes.number(stroke.direction_agrees, places(3), stroke.reasons.get("direction") or _TOO_SHORT)
            )
        return tuple(cells)

    who = (Column("stroke"), *((Column("trial"), Column("index")) if planned else ()))
    groups = grouped(report, report.strokes, lambda s: s.experiment, row)
    columns = (*who, *(column for _, column, _ in shown), *((Column("agree"),) if agreeing else ()))
    return Table(name, caption, columns, groups, notes.listed())


def planted_table(report: Report) -> Table | None:
    """Return what the simulator planted beside what the analysis found."""
    if not report.planted:
        return None
    notes = Notes()
    # Of several strokes in a trial the model gets the first.
    found = {stroke.trial: stroke for stroke in reversed(report.strokes) if stroke.trial is not None}
    given = {prediction.trial: prediction for prediction in report.predictions}
    columns = (
        Column("trial"),
        Column("index"),
        Column("µ planted"),
        Column("µ found"),
        Column("off by", "%"),
        Column("τ max planted", "kPa"),
        Column("τ max found", "kPa"),
        Column("off by", "%"),
        Column("speed planted", "mm/s"),
        Column("speed found", "mm/s"),
        Column("off by", "%"),
        Column("direction"),
    )

    def row(p: Planted) -> tuple[Cell, ...]:
        stroke = found.get(p.trial)
        cells: list[Cell] = [
            Cell(str(p.trial)),
            Cell(NONE if stroke is None or stroke.index is None else str(stroke.index)),
        ]
        prediction = given.get(p.trial)
        mu = (
            prediction.mu
            if prediction is not None and prediction.mu is not None
            else stroke.mu_dynamic
            if stroke
            else None
        )
        quantities: tuple[tuple[str, float, float | None, Callable[[float], str]], ...] = (
            ("mu_dynamic", p.mu, mu, places(3)),
            ("tau_max", p.tau_max, stroke.tau_max if stroke else None, tau),
            ("speed", p.speed, stroke.speed if stroke else None, places(1)),
        )
        for name, truth, value, shown in quantities:
            reason = stroke.reasons.get(name) if stroke else "no stroke was found in this trial"
            off = None if value is None else 100 * (value / truth - 1)
            cells += [Cell(shown(truth)), notes.number(value, shown, reason), notes.number(off, signed, reason)]
        right = stroke is not None and stroke.direction == p.direction
        cells.append(Cell("as planted" if right else NONE if stroke is None or stroke.direction is None else "wrong"))
        return tuple(cells)

    names = {p.trial: s.experiment for p in report.planted if (s := found.get(p.trial)) is not None}
    groups = grouped(report, report.planted, lambda p: names.get(p.trial, ""), row)
    caption = (
        "Planted friction beside what the analysis found: the µ and τ max that the model gets, and the speed. The "
        "analysis does not know what was planted."
    )
    return Table("table-planted", caption, columns, groups, notes.listed())
