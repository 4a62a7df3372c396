"""The result of a study as one self-contained page."""

from functools import partial
from itertools import chain

from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape

from sessions.exports.figures.study import study_plates
from sessions.exports.html import data_address, drawn
from sessions.exports.report_tables.paths import paths_sentence
from sessions.exports.study_tables import study_tables
from sessions.exports.wording import correlation, digits, plural
from sessions.pooling.pooled import DescriptorFindings, StudyFindings
from sessions.recording.provenance import software_versions
from sessions.report import Fact

QUESTION = (
    "People stroke surfaces and scale what they feel. Does the strain-energy density (SED) that a finger model "
    "predicts at a receptor, from the friction of the same people's own strokes, follow their scores?"
)


def study_page(study: StudyFindings, name: str) -> str:
    """Return the page of the study called `name`; the same findings give the same bytes."""
    environment = Environment(
        loader=PackageLoader("sessions.exports", "."),
        autoescape=select_autoescape(default=True, default_for_string=True),
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    figures = {plate.name: plate for plate in study_plates(study)}
    tables = study_tables(study)
    numbers = {plate: n for n, plate in enumerate(figures, 1)}
    numbers |= {table.name: n for n, table in enumerate(chain.from_iterable(tables.values()), 1)}
    return environment.get_template("study.html.jinja").render(
        study=study,
        name=name,
        question=QUESTION,
        summary=summary(study),
        who=_who(study),
        excluded=excluded(study),
        versions=[Fact(name, version) for name, version in software_versions().items()],
        figures=figures,
        tables=tables,
        numbers=numbers,
        drawing=drawn,
        data_address=partial(data_address, head=study.simulated),
    )


def summary(study: StudyFindings) -> list[str]:
    """Return the findings in short, a sentence each."""
    subjects = {visit.subject for visit in study.visits}
    said = [f"{plural(len(study.visits), 'session')} of {plural(len(subjects), 'subject')} were read."]
    for one in study.descriptors:
        said += _related(one)
        said += [paths_sentence(one.descriptor, one.paths)] if one.paths else []
    if study.friction is not None:
        f = study.friction
        said.append(
            f"Of {f.strokes} strokes the planted µ came back with a median error of "
            f"{digits(100 * f.median_error, 2)} %, {digits(100 * f.worst_error, 2)} % at worst; "
            f"{f.covered} of {f.intervals} intervals of µ hold it."
        )
    return said


def _related(one: DescriptorFindings) -> list[str]:
    name = one.descriptor[:1].upper() + one.descriptor[1:]
    if one.repeated is None:
        return [f"{name}: too few subjects with scores and strokes of their own for a correlation within subjects."]
    r = one.repeated
    interval = f"95 % interval {correlation(r.low)} to {correlation(r.high)}"
    return [f"{name}: within subjects, score and predicted SED go together by r = {correlation(r.r)}, {interval}."]


def _who(study: StudyFindings) -> list[Fact]:
    subjects = sorted({visit.subject for visit in study.visits})
    stroked = sorted({visit.subject for visit in study.visits if visit.forces})
    protocols = sorted({visit.protocol for visit in study.visits})
    return [
        Fact("subjects", f"{len(subjects)}: {', '.join(subjects)}"),
        Fact("of them with forces", f"{len(stroked)}: {', '.join(stroked)}" if stroked else "none"),
        Fact("protocol", ", ".join(protocols)),
    ]


def excluded(study: StudyFindings) -> list[str]:
    """Return a sentence for all that does not count, and for each doubt about what does."""
    said = [f"Session {folder} could not be read, and nothing of it counts: {why}." for folder, why in study.failed]
    for one in study.excluded:
        what = f"trials on {one.descriptor}" if one.descriptor else "every trial"
        said.append(f"Subject {one.subject}: {what} left out by {one.who}: {one.why}.")
    said += [
        f"Session {visit.session} ended before its last trial; what it holds counts."
        for visit in study.visits
        if not visit.complete
    ]
    said += [f"Session {visit.session}: {loss}." for visit in study.visits for loss in visit.losses]
    said += [
        f"Nothing, but a doubt: the {descriptor} scores of {subject} fall as the index rises (r = {correlation(r)}); "
        "the scale may have been used backwards."
        for subject, descriptor, r in study.reversed
    ]
    return said
