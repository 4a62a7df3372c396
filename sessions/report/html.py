"""The pages of a session and of a study, each self-contained, and figures as files with their numbers."""

import base64
import io
import re
from collections.abc import Sequence
from functools import partial
from itertools import chain
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined, Template, select_autoescape
from markupsafe import Markup

from sessions.exchange.csv_text import write_rows
from sessions.file_access import remedy, write_whole
from sessions.report import study_prose
from sessions.report import tables as report_tables
from sessions.report.contents import Report
from sessions.report.figures import Panel, Plate, plates
from sessions.report.figures.scores import study_plates
from sessions.report.prose import doubts, question, summary, told_apart
from sessions.report.study_csv import columns_csv, trials_csv
from sessions.report.tables import Table
from sessions.report.tables.cells import parted
from sessions.report.tables.study import study_tables
from sessions.report.tables.study_models import missing_models, missing_scores
from sessions.statistics.pooling.findings import StudyFindings


def template(name: str) -> Template:
    """Return the template in a file of this folder."""
    environment = Environment(
        loader=PackageLoader("sessions.report", "."),
        autoescape=select_autoescape(default=True, default_for_string=True),
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    return environment.get_template(name)


HEAD = "<!DOCTYPE html>"
BODY = {"table-relation", "table-strokes", "table-predictions", "table-rivals"}  # all others stand in the appendix


class ReportError(Exception):
    """A report that could not be written: where, why, what to do."""


def page(report: Report, drawings: Sequence[Plate] | None = None) -> str:
    """Return the page: no script, nothing asked of any network; the same report gives the same bytes.

    `drawings` are its `plates`, where they were drawn already.
    """
    figures = {plate.name: plate for plate in (plates(report) if drawings is None else drawings)}
    tables, further = parted(report_tables.tables(report), BODY)
    return template("report.html.jinja").render(
        report=report,
        question=question(report),
        summary=summary(report),
        doubts=doubts(report),
        told_apart=told_apart(report),
        figures=figures,
        drawing=drawn,
        data_address=partial(data_address, head=report.head if report.simulated else ""),
        scene_address="" if report.scene is None else text_address(report.scene.text, "application/toml"),
        numbers=_numbers(figures, {**tables, "further": further}),
        contents=_contents(report, figures, tables, further=bool(further)),
        tables=tables,
        further=further,
    )


def write_report(report: Report, path: Path, drawings: Sequence[Plate] | None = None) -> None:
    """Write the page to `path`: a new file, then swapped in, so that readers see the old page or the new one.

    Raises ReportError when that cannot be done, or when `path` holds something that is no page.
    """
    leave_others_alone(path)
    swap_in(path, page(report, drawings))


def leave_others_alone(path: Path) -> None:
    """Raise ReportError where a page would replace something that is none."""
    if path.exists() and not _is_page(path):
        raise ReportError(f"{path} holds something that is no report, so it is left alone: choose another file")


def write_figures(report: Report, folder: Path, drawings: Sequence[Plate] | None = None) -> tuple[Path, ...]:
    """Write every picture of the report to `folder` as SVG, each with its numbers as CSV; return the files."""
    written: list[Path] = []
    for plate in plates(report) if drawings is None else drawings:
        for panel in plate.panels:
            for ending, text in (
                (".svg", panel.svg),
                (".csv", panel_csv(panel, report.head if report.simulated else "")),
            ):
                path = folder / (re.sub(r"[^0-9A-Za-z_-]", "-", panel.name) + ending)  # a name any file system takes
                swap_in(path, text)
                written.append(path)
    return tuple(written)


def _numbers(figures: dict[str, Plate], tables: dict[str, tuple[Table, ...]]) -> dict[str, int]:
    """Return the numbers of figures and of tables, each counted from 1 in the order of the page."""
    order = ("relation", "scores", "course", "friction", "speed", "finger", "response", "paths", "forces")
    numbered = {name: n for n, name in enumerate((name for name in order if name in figures), 1)}
    return numbered | {table.name: n for n, table in enumerate(chain.from_iterable(tables.values()), 1)}


def _contents(
    report: Report, figures: dict[str, Plate], tables: dict[str, tuple[Table, ...]], *, further: bool
) -> tuple[tuple[str, str], ...]:
    """Return anchor and words of the sections that the page has."""
    parts = (
        ("relation", "prediction against score", "relation" in figures or bool(tables["relation"])),
        ("friction", "friction", bool(tables["strokes"])),
        ("predictions", "predicted responses", bool(tables["predictions"])),
        ("rivals", "rivals", bool(tables["rivals"])),
        ("who", "appendix: who and what", True),
        ("excluded", "excluded", True),
        ("scores", "scores", "scores" in figures),
        ("course", "forces in time", "course" in figures or "friction" in figures),
        ("responses", "responses", "finger" in figures or "response" in figures),
        ("paths", "many paths", "paths" in figures),
        ("model", "the model", bool(report.modelled or report.left_out)),
        ("again", "to do it again", True),
        ("further", "further tables", further or "forces" in figures),
    )
    return tuple((anchor, words) for anchor, words, there in parts if there)


def drawn(panel: Panel) -> Markup:
    """Return the picture as it stands in a page: without the head an SVG file has."""
    return Markup(panel.svg[panel.svg.index("<svg") :])


def data_address(panel: Panel, head: str) -> str:
    """Return an address that holds the numbers of a picture as CSV, so that a page needs no file beside it."""
    return text_address(panel_csv(panel, head))


def text_address(text: str, kind: str = "text/csv") -> str:
    """Return an address that holds a text file, a CSV file unless another media type is given."""
    return f"data:{kind};charset=utf-8;base64," + base64.b64encode(text.encode()).decode()


def panel_csv(panel: Panel, head: str) -> str:
    """Return the numbers of a picture, empty where there is none; `head` comes first where something is simulated."""
    out = io.StringIO()
    if head:
        out.write(f"# {head}\n")
    write_rows(out, [panel.header, *panel.rows])
    return out.getvalue()


def _is_page(path: Path) -> bool:
    """Say whether a file begins as our pages do; an empty one may be replaced as well."""
    try:
        with path.open("rb") as file:
            start = file.read(len(HEAD))
    except OSError as error:
        raise ReportError(f"{path} cannot be read ({error.strerror}): choose another file") from error
    return start in (b"", HEAD.encode())


def swap_in(path: Path, text: str) -> None:
    """Replace the file at `path` in one step. Raises ReportError."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, text.encode())
    except OSError as error:
        raise ReportError(
            f"{path} cannot be written ({error.strerror}): {remedy(error)}, or choose another folder"
        ) from error


# Tables that are no appendix; that of the trials stands under a heading of its own behind it.
STUDY_BODY = {"table-relation", "table-scores", "table-surfaces", "table-rivals", "table-trials"}


def study_page(study: StudyFindings, name: str) -> str:
    """Return the page of the study called `name`; the same findings give the same bytes."""
    figures = {plate.name: plate for plate in study_plates(study)}
    tables, further = parted(study_tables(study), STUDY_BODY)
    trials = tables.pop("trials")
    numbers = {plate: n for n, plate in enumerate(figures, 1)}
    numbers |= {table.name: n for n, table in enumerate((*chain.from_iterable(tables.values()), *further, *trials), 1)}
    return template("study.html.jinja").render(
        study=study,
        name=name,
        prose=study_prose,
        trials=sum(len(visit.rows) for visit in study.visits),
        trials_file=text_address(trials_csv(study)),
        columns_file=text_address(columns_csv(study)),
        unmodelled=missing_models(study),
        untold=missing_scores(study),
        figures=figures,
        tables={**tables, "trials": trials},
        further=further,
        numbers=numbers,
        drawing=drawn,
        data_address=partial(data_address, head=study.simulated),
    )
