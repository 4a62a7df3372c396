"""A study as CSV files that R's read.csv and pandas' read_csv open as they are: its trials, its many paths."""

import csv
import io
from dataclasses import fields

from sessions.paths import Path
from sessions.pooling.exclusions import decided
from sessions.pooling.pooled import StudyFindings
from sessions.pooling.visit import TrialRow

SIMULATED = "SIMULATED"
_UNITS = {
    "tau_max": "MPa",
    "speed": "mm_per_s",
    "normal_force": "N",
    "sed": "MPa",
    "model_normal_force": "N",
    "matching_depth": "mm",
}


def paths_csv(study: StudyFindings) -> str:
    """Return a row for each path and descriptor, for R and pandas as `trials_csv`."""
    mark = [SIMULATED] if study.simulated else []
    names = [field.name for field in fields(Path)]
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    heads = ("usual", "surfaces", "trials", "r_of_means", "r_within_subjects", "low", "high")
    writer.writerow([*mark, "descriptor", *names, *heads])
    for one in study.descriptors:
        for found in one.paths:
            numbers = (found.surfaces, found.trials, found.r, found.within, found.low, found.high)
            told = [*(["yes"] if mark else []), one.descriptor, *(getattr(found.path, name) for name in names)]
            writer.writerow([*told, "yes" if found.usual else "no", *(_plain(number) for number in numbers)])
    return out.getvalue()


def trials_csv(study: StudyFindings) -> str:
    """Return a row for each trial of each visit: one header line, a point in decimals, empty where there is no number.

    R's read.csv and pandas' read_csv open it as it is. Of a simulated study the first column is called SIMULATED.
    """
    names = [field.name for field in fields(TrialRow) if field.name != "paths"]  # these have a table of their own
    heads = [f"{name}_{_UNITS[name]}" if name in _UNITS else name for name in names]
    mark = [SIMULATED] if study.simulated else []
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([*mark, "session", "subject", *heads, "excluded"])
    for visit in study.visits:
        for row in visit.rows:
            decision = decided(study.excluded, visit.subject, row.descriptor)
            why = "" if decision is None else decision.why
            told = ["yes" if visit.simulated else "no"] if mark else []
            writer.writerow([*told, visit.session, visit.subject, *(_plain(getattr(row, n)) for n in names), why])
    return out.getvalue()


def _plain(value: object) -> object:
    if isinstance(value, tuple):
        return " ".join(str(one) for one in value)  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType]
    return "" if value is None else value
