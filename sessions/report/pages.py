"""The pages of a session and of a study, each self-contained, with figures and trials in separate files."""

import base64
import errno
import io
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from itertools import count
from pathlib import Path

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined, Template, select_autoescape
from markupsafe import Markup

from sessions.exchange.csv_text import write_rows
from sessions.exchange.session_tables import heading
from sessions.file_access import check_replaceable, remedy, write_whole
from sessions.prediction import QUANTITIES, SED
from sessions.recording.head import software_versions
from sessions.report import study_prose
from sessions.report.contents import Report
from sessions.report.figures import Panel, Plate, plates
from sessions.report.figures.relation import study_plates
from sessions.report.figures.style import SVG_MARK
from sessions.report.prose import distinctions, doubts, question, summary
from sessions.report.tables import split_off_appendix
from sessions.report.tables.session import tables as session_tables
from sessions.report.tables.study import study_tables
from sessions.report.tables.study_models import missing_models, missing_scores
from sessions.statistics.correlations import Contrast
from sessions.statistics.findings import StudyFindings
from sessions.statistics.multiverse import CHOICE_LABELS, PathFinding
from sessions.statistics.rivals import Rival
from sessions.statistics.visit import TrialRow, exclusion_of
from sessions.strokes.stroke import meanings


def template(name: str, package: str = "sessions.report") -> Template:
    """Return the template in a file of this folder, or of another `package`."""
    environment = Environment(
        loader=ChoiceLoader([PackageLoader(package, "."), PackageLoader("sessions.report", ".")]),
        autoescape=select_autoescape(default=True, default_for_string=True),
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    return environment.get_template(name)


_DOCTYPE = "<!DOCTYPE html>"
BODY = {"table-relation", "table-strokes", "table-predictions", "table-rivals"}  # all others are in the appendix


class ReportError(Exception):
    """A report that could not be written; the message says where, why, and what to do."""


def page(report: Report, drawings: Sequence[Plate] | None = None) -> str:
    """Return the page, without script or network, from `drawings` if given; one report always gives the same bytes."""
    tables, further = split_off_appendix(session_tables(report), BODY)
    return _page(
        "report.html.jinja",
        plates(report) if drawings is None else drawings,
        report.head,
        report=report,
        question=question(report),
        summary=summary(report),
        doubts=doubts(report),
        distinctions=distinctions(report),
        tables=tables,
        further=further,
    )


def _page(file: str, drawings: Iterable[Plate], notice: str, **values: object) -> str:
    """Return a page of a template; figures and tables are numbered in order of appearance."""
    return template(file).render(
        figures={plate.name: plate for plate in drawings},
        figure_number=count(1).__next__,
        table_number=count(1).__next__,
        headings=partial(re.findall, r'<h2 id="(\w+)">([^<]*)</h2>'),
        drawing=embed,
        text_address=text_address,
        csv_of=partial(panel_csv, notice=notice),
        versions=software_versions(),
        **values,
    )


def write_report(report: Report, path: Path, drawings: Sequence[Plate] | None = None) -> None:
    """Write the page to `path`: as a new file that replaces the old one, so that readers see either page whole.

    Raises ReportError when writing fails, and NotOurs when `path` holds something other than a page.
    """
    check_place(path)
    swap_in(path, page(report, drawings))


def check_place(path: Path, *companions: Path) -> None:
    """Raise ReportError where a page cannot be written, NotOurs where it or `companions` would replace other files."""
    make_place(path.parent)
    check_replaceable(path, _DOCTYPE, *companions)


def write_figures(report: Report, folder: Path, drawings: Sequence[Plate] | None = None) -> tuple[Path, ...]:
    """Write every picture of the report to `folder` as SVG, each with its numbers as CSV; return the files.

    Raises ReportError, and NotOurs before any is written.
    """
    files: dict[Path, str] = {}
    for plate in plates(report) if drawings is None else drawings:
        for panel in plate.panels:
            name = re.sub(r"[^0-9A-Za-z_-]", "-", panel.name)  # valid in any file system
            picture, numbers = folder / f"{name}.svg", folder / f"{name}.csv"
            check_replaceable(picture, SVG_MARK, numbers)
            files |= {picture: panel.svg, numbers: panel_csv(panel, report.head)}
    for path, text in files.items():
        swap_in(path, text)
    return tuple(files)


def embed(panel: Panel) -> Markup:
    """Return the picture for a page, without the head of an SVG file."""
    return Markup(panel.svg[panel.svg.index("<svg") :])


def text_address(text: str, media_type: str = "text/csv") -> str:
    """Return a data address of a text file, by default CSV, which makes a page self-contained."""
    return f"data:{media_type};charset=utf-8;base64," + base64.b64encode(text.encode()).decode()


def panel_csv(panel: Panel, notice: str) -> str:
    """Return the numbers of a picture, empty cells for missing ones; a `notice` of simulation comes first."""
    return (f"# {notice}\n" if notice else "") + _csv([panel.header, *panel.rows])


def make_place(folder: Path) -> None:
    """Make a folder unless it exists. Raises ReportError, also where it is not writable."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if not os.access(folder, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    except OSError as error:
        advice = f"{remedy(error, new=True)}, or choose another folder"
        raise ReportError(f"{folder} cannot be written into ({error.strerror}): {advice}") from error


def swap_in(path: Path, text: str) -> None:
    """Replace the file at `path` in one step. Raises ReportError."""
    try:
        make_place(path.parent)
        write_whole(path, text.encode())
    except OSError as error:
        advice = f"{remedy(error, new=True)}, or choose another folder"
        raise ReportError(f"{path} cannot be written ({error.strerror}): {advice}") from error


# Tables outside the appendix; the table of trials has its own heading after it.
STUDY_BODY = {"table-relation", "table-scores", "table-surfaces", "table-rivals", "table-trials"}


def study_page(study: StudyFindings, name: str) -> str:
    """Return the page of the study called `name`; the same findings give the same bytes."""
    tables, further = split_off_appendix(study_tables(study), STUDY_BODY)
    return _page(
        "study.html.jinja",
        study_plates(study),
        study.simulated,
        study=study,
        name=name,
        prose=study_prose,
        trials=sum(len(visit.rows) for visit in study.visits),
        trials_csv=trials_csv(study),
        columns_csv=columns_csv(study),
        unmodelled=missing_models(study),
        untold=missing_scores(study),
        tables=tables,
        further=further,
    )


_SIMULATED = "SIMULATED"
TRIALS, TRIAL_COLUMNS = "trials.csv", "trials-columns.csv"  # next to the page
_MEANING = meanings(TrialRow)  # of each column of the table of trials: all fields of a row except its paths
_RESPONSES: Mapping[str, tuple[str, str]] = {
    quantity.name: (quantity.unit.strip("-"), f"of the model, averaged over the ending: {quantity.meaning}")
    for quantity in QUANTITIES
    if quantity is not SED
}


def _columns(study: StudyFindings) -> Mapping[str, tuple[str, str]]:
    """Return unit and meaning of each column of `trials_csv`, by its name."""
    session_columns = {"session": ("", "folder of the session"), "subject": ("", "code of the subject")}
    excluded = {"excluded": ("", "why the trial is left out of every number of the study; empty where it counts")}
    return {**_simulated_column(study), **session_columns, **_MEANING, **_RESPONSES, **excluded}


def _simulated_column(study: StudyFindings) -> Mapping[str, tuple[str, str]]:
    return {_SIMULATED: ("", "yes where transducer or subject were simulated")} if study.simulated else {}


def columns_csv(study: StudyFindings) -> str:
    """Return a row for each column of `trials_csv`: its name, its unit and its meaning."""
    return _columns_csv({heading(name, unit): (unit, meaning) for name, (unit, meaning) in _columns(study).items()})


def _columns_csv(columns: Mapping[str, tuple[str, str]]) -> str:
    return _csv([["column", "unit", "meaning"], *([name, *meaning] for name, meaning in columns.items())])


_DESCRIPTOR = {"descriptor": ("", "what was judged")}
_CHOICES = {choice: ("", f"choice of this path: {label}") for choice, label in CHOICE_LABELS.items()}
_PATH_NUMBERS = {"r": "r_of_means", "within": "r_within_subjects"}  # columns with another name than the field
_PATHS = _DESCRIPTOR | _CHOICES | {_PATH_NUMBERS.get(name, name): text for name, text in meanings(PathFinding).items()}
_KIND = {"kind": ("", "means: over subjects, of each surface; within: of trials, within subjects")}
_CONTRAST_COLUMNS = {
    "difference": "difference", "low": "difference_low", "high": "difference_high", "z": "steiger_z", "p": "p"
}  # fmt: skip
_RIVAL, _CONTRAST = meanings(Rival), meanings(Contrast)
_RIVALS = _DESCRIPTOR | _KIND | _RIVAL | {column: _CONTRAST[name] for name, column in _CONTRAST_COLUMNS.items()}


def path_columns_csv(study: StudyFindings) -> str:
    """Return a row for each column of `paths_csv`, as `columns_csv`."""
    return _columns_csv({**_simulated_column(study), **_PATHS})


def rival_columns_csv(study: StudyFindings) -> str:
    """Return a row for each column of `rivals_csv`, as `columns_csv`."""
    return _columns_csv({**_simulated_column(study), **_RIVALS})


def paths_csv(study: StudyFindings) -> str:
    """Return a row for each path and descriptor, for R and pandas as `trials_csv`."""
    rows: list[list[object]] = [list(_PATHS)]
    for descriptor in study.descriptors:
        for path in descriptor.paths:
            numbers = (path.surfaces, path.trials, path.r, path.within, path.low, path.high)
            choices = (getattr(path.path, choice) for choice in CHOICE_LABELS)
            rows.append([descriptor.descriptor, *choices, "yes" if path.usual else "no", *numbers])
    return _csv(rows, simulated=bool(study.simulated))


def rivals_csv(study: StudyFindings) -> str:
    """Return a row for each quantity correlated with scores, of means and within subjects, for R and pandas."""
    rows: list[list[object]] = [list(_RIVALS)]
    for descriptor in study.descriptors:
        for level, rivals in (("means", descriptor.rivals_of_means), ("within", descriptor.rivals)):
            for rival in rivals:
                contrast = [getattr(rival.contrast, name, None) for name in _CONTRAST_COLUMNS]
                numbers = [*(getattr(rival, name) for name in _RIVAL), *contrast]
                rows.append([descriptor.descriptor, level, *numbers])
    return _csv(rows, simulated=bool(study.simulated))


def trials_csv(study: StudyFindings) -> str:
    """Return a row for each trial of each visit: one header line, decimal points, empty cells for missing numbers.

    R's read.csv and pandas' read_csv open it directly. The first column of a simulated study is SIMULATED.
    """
    rows: list[list[object]] = [[heading(name, unit) for name, (unit, _) in _columns(study).items()]]
    copies = dict(study.copies)
    for visit in study.visits:
        for row in visit.rows:
            decision = exclusion_of(study.excluded, visit.subject, row.descriptor)
            reason = "" if decision is None else decision.why
            reason = f"the same recording as {copies[visit.session]}" if visit.session in copies else reason
            cells = ["yes" if visit.simulated else "no"] if study.simulated else []
            measures = (" ".join(row.flaws) if name == "flaws" else getattr(row, name) for name in _MEANING)
            rows.append([*cells, visit.session, visit.subject, *measures, *map(row.responses.get, _RESPONSES), reason])
    return _csv(rows)


def _csv(rows: Sequence[Sequence[object]], *, simulated: bool = False) -> str:
    """Return rows as CSV; in a simulated study the first column marks each row."""
    if simulated:
        rows = [[_SIMULATED, *rows[0]], *(["yes", *row] for row in rows[1:])]
    buffer = io.StringIO()
    write_rows(buffer, rows)
    return buffer.getvalue()
