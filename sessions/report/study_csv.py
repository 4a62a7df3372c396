"""A study as CSV files that R's read.csv and pandas' read_csv open as they are: its trials, its many paths."""

import io
from collections.abc import Mapping, Sequence
from dataclasses import fields

from sessions.exchange.csv_text import write_rows
from sessions.exchange.session_tables import heading
from sessions.prediction import QUANTITIES, SED
from sessions.statistics.multiverse import Path
from sessions.statistics.pooling.findings import StudyFindings
from sessions.statistics.pooling.visit import TrialRow, decided
from sessions.statistics.rivals import Rival
from sessions.strokes.stroke import meanings

SIMULATED = "SIMULATED"
TRIALS, COLUMNS = "trials.csv", "trials-columns.csv"  # as they lie beside the page
_MEANING = meanings(TrialRow)  # of each column of the table of trials: all fields of a row but its paths
_RESPONSES: Mapping[str, tuple[str, str]] = {
    one.name: ("" if one.unit == "-" else one.unit, f"of the model, averaged over the ending: {one.meaning}")
    for one in QUANTITIES
    if one is not SED
}
_OWN: Mapping[str, str] = {
    SIMULATED: "yes where transducer or subject were simulated",
    "session": "folder of the session",
    "subject": "code of the subject",
    "excluded": "why the trial is left out of every number of the study; empty where it counts",
}


def _heading(name: str) -> str:
    return heading(name, {**_MEANING, **_RESPONSES}[name][0])


def columns_csv(study: StudyFindings) -> str:
    """Return a row for each column of `trials_csv`: its name, its unit and its meaning."""
    first = [name for name in _OWN if name != "excluded" and (study.simulated or name != SIMULATED)]
    rows = [["column", "unit", "meaning"], *([name, "", _OWN[name]] for name in first)]
    rows += [[_heading(name), *meaning] for name, meaning in {**_MEANING, **_RESPONSES}.items()]
    return _csv([*rows, ["excluded", "", _OWN["excluded"]]])


def paths_csv(study: StudyFindings) -> str:
    """Return a row for each path and descriptor, for R and pandas as `trials_csv`."""
    names = [field.name for field in fields(Path)]
    heads = ("usual", "surfaces", "trials", "r_of_means", "r_within_subjects", "low", "high")
    rows: list[list[object]] = [["descriptor", *names, *heads]]
    for one in study.descriptors:
        for path in one.paths:
            numbers = (path.surfaces, path.trials, path.r, path.within, path.low, path.high)
            choices = (getattr(path.path, name) for name in names)
            rows.append([one.descriptor, *choices, "yes" if path.usual else "no", *numbers])
    return _csv(rows, simulated=bool(study.simulated))


def rivals_csv(study: StudyFindings) -> str:
    """Return a row for each quantity that may follow the scores, of means and within subjects, for R and pandas."""
    names = [field.name for field in fields(Rival) if field.name not in ("contrast", "reasons")]
    heads = ["difference", "difference_low", "difference_high", "steiger_z", "p"]
    rows: list[list[object]] = [["descriptor", "kind", *names, *heads]]
    for one in study.descriptors:
        for kind, rivals in (("means", one.rivals_of_means), ("within", one.rivals)):
            for rival in rivals:
                less = [getattr(rival.contrast, name, None) for name in ("difference", "low", "high", "z", "p")]
                numbers = [*(getattr(rival, name) for name in names), *less]
                rows.append([one.descriptor, kind, *numbers])
    return _csv(rows, simulated=bool(study.simulated))


def trials_csv(study: StudyFindings) -> str:
    """Return a row for each trial of each visit: one header line, a point in decimals, empty where there is no number.

    R's read.csv and pandas' read_csv open it as it is. Of a simulated study the first column is called SIMULATED.
    """
    names = list(_MEANING)  # paths have a table of their own
    heads = [_heading(name) for name in (*names, *_RESPONSES)]
    mark = [SIMULATED] if study.simulated else []
    rows: list[list[object]] = [[*mark, "session", "subject", *heads, "excluded"]]
    copies = dict(study.copies)
    for visit in study.visits:
        for row in visit.rows:
            decision = decided(study.excluded, visit.subject, row.descriptor)
            why = "" if decision is None else decision.why
            why = f"the same recording as {copies[visit.session]}" if visit.session in copies else why
            cells = ["yes" if visit.simulated else "no"] if mark else []
            numbers = [*(getattr(row, name) for name in names), *map(row.responses.get, _RESPONSES)]
            rows.append([*cells, visit.session, visit.subject, *numbers, why])
    return _csv(rows)


def _csv(rows: Sequence[Sequence[object]], *, simulated: bool = False) -> str:
    """Return rows as CSV; a first column says of each of a simulated study that it is."""
    if simulated:
        rows = [[SIMULATED, *rows[0]], *(["yes", *row] for row in rows[1:])]
    out = io.StringIO()
    write_rows(out, [[_plain(value) for value in row] for row in rows])
    return out.getvalue()


def _plain(value: object) -> object:
    if isinstance(value, tuple):
        return " ".join(str(one) for one in value)  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType]
    return "" if value is None else value
