"""The result of a study as one self-contained page."""

from functools import partial
from itertools import chain

from sessions.report.figures.study import study_plates
from sessions.report.html import data_address, drawn, text_address
from sessions.report.study_csv import columns_csv, trials_csv
from sessions.report.study_prose import (
    again,
    command,
    excluded,
    modelled,
    remarks,
    sealed,
    summary,
    told_apart,
    versions,
    who,
)
from sessions.report.tables.cells import parted
from sessions.report.tables.study import study_tables
from sessions.report.tables.study_models import missing_models, missing_scores
from sessions.report.templates import template
from sessions.statistics.pooling.findings import StudyFindings

# Tables that are no appendix; that of the trials stands under a heading of its own behind it.
BODY = {"table-relation", "table-scores", "table-surfaces", "table-rivals", "table-trials"}
QUESTION = (
    "People stroke surfaces and scale what they feel. Does the strain-energy density (SED) that a finger model "
    "predicts at a receptor, from the friction of the same people's own strokes, follow their scores?"
)


def study_page(study: StudyFindings, name: str) -> str:
    """Return the page of the study called `name`; the same findings give the same bytes."""
    figures = {plate.name: plate for plate in study_plates(study)}
    tables, further = parted(study_tables(study), BODY)
    trials = tables.pop("trials")
    numbers = {plate: n for n, plate in enumerate(figures, 1)}
    numbers |= {table.name: n for n, table in enumerate((*chain.from_iterable(tables.values()), *further, *trials), 1)}
    return template("study.html.jinja").render(
        study=study,
        name=name,
        question=QUESTION,
        summary=summary(study),
        told_apart=told_apart(study),
        sealed=sealed(study),
        who=who(study),
        excluded=excluded(study),
        remarks=remarks(study),
        modelled=modelled(study),
        versions=versions(),
        again=again(study),
        command=command(study, name),
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
