"""Tables of a study's page, and the table of all its trials as CSV."""

import csv
import io
from collections.abc import Iterable
from dataclasses import fields

from sessions.analysis.mixed import MixedModel
from sessions.exports.report_tables.cells import Cell, Column, Group, Notes, Table
from sessions.exports.report_tables.paths import paths_table
from sessions.exports.wording import NONE, correlation, digits, significant
from sessions.paths import Path
from sessions.pooling.exclusions import decided
from sessions.pooling.pooled import DescriptorFindings, StudyFindings
from sessions.pooling.visit import TrialRow, Visit

SIMULATED = "SIMULATED"
_UNITS = {
    "tau_max": "MPa",
    "speed": "mm_per_s",
    "normal_force": "N",
    "sed": "MPa",
    "model_normal_force": "N",
    "matching_depth": "mm",
}


def study_tables(study: StudyFindings) -> dict[str, tuple[Table, ...]]:
    """Return the tables a study has numbers for, by section."""
    sections = {
        "visits": (_visits(study),),
        "scores": (_scores(study), _agreement(study)),
        "surfaces": (_surfaces(study),),
        "relation": (_relation(study), _models(study)),
        "paths": (paths_table((one.descriptor, one.paths) for one in study.descriptors),),
        "planted": (_planted(study),),
    }
    return {
        name: tuple(table for table in made if table is not None and table.groups) for name, made in sections.items()
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


def _visits(study: StudyFindings) -> Table:
    rows = tuple(_visit_row(visit, study) for visit in study.visits)
    columns = ("session", "subject", "answers", "strokes with SED", "ended as planned", "flawed trials", "counted")
    caption = "Visits in the order of their names; flawed: doubtful or worse, the table of trials names each flaw."
    return _table("table-visits", caption, columns, [("", rows)])


def _visit_row(visit: Visit, study: StudyFindings) -> tuple[Cell, ...]:
    out = [e.descriptor or "nothing" for e in study.excluded if e.subject == visit.subject]
    counted = "yes" if not out else ("no" if "nothing" in out else f"without {', '.join(out)}")
    return (
        Cell(visit.session),
        Cell(visit.subject),
        Cell(f"{sum(row.score is not None for row in visit.rows)} of {len(visit.rows)}"),
        Cell(str(sum(row.sed is not None for row in visit.rows)) if visit.forces else NONE),
        Cell("yes" if visit.complete else "no"),
        Cell(str(sum(bool(row.flaws) for row in visit.rows))),
        Cell(counted),
    )


def _scores(study: StudyFindings) -> Table:
    notes = Notes()

    def rows(one: DescriptorFindings) -> Iterable[tuple[Cell, ...]]:
        within = {mean.index: mean for mean in one.within}
        for mean in one.scores:
            inner = within.get(mean.index)
            yield (
                Cell(str(mean.index)),
                Cell(str(mean.n)),
                Cell(digits(mean.mean, 1)),
                notes.number(mean.sd, lambda v: digits(v, 1), mean.reason),
                _interval(mean.low, mean.high, 1),
                _interval(None, None, 1) if inner is None else _interval(inner.low, inner.high, 1),
            )

    columns = ("index", "subjects", "mean score", "standard deviation", "95 % interval of the mean", "within subjects")
    complete = ", ".join(f"{one.within[0].n} for {one.descriptor}" for one in study.descriptors if one.within)
    caption = (
        "Scores: t interval of the mean over subjects; and interval within subjects (Cousineau 2005, Morey 2008), for "
        f"comparing surfaces with one another, of the subjects who scored every surface ({complete or 'none'})."
    )
    groups = [(one.descriptor, tuple(rows(one))) for one in study.descriptors]
    return _table("table-scores", caption, columns, groups, notes)


def _agreement(study: StudyFindings) -> Table:
    rows = tuple(
        (
            Cell(one.descriptor),
            Cell(str(found.n)),
            Cell(digits(found.kendall_w, 2)),
            Cell(_p(found.friedman_p)),
            Cell(_p(found.page_p)),
        )
        for one in study.descriptors
        if (found := one.agreement) is not None
    )
    columns = ("descriptor", "subjects", "Kendall's W", "Friedman's p", "Page's p")
    caption = (
        "Agreement on the order of the surfaces; Friedman: that they differ; Page: that scores rise with the index."
    )
    return _table("table-agreement", caption, columns, [("", rows)])


def _surfaces(study: StudyFindings) -> Table:
    def row(one: DescriptorFindings) -> Iterable[tuple[Cell, ...]]:
        for s in one.surfaces:
            yield (
                Cell(str(s.index)),
                Cell(str(s.subjects)),
                Cell(NONE if s.mu is None else digits(s.mu, 3)),
                Cell(NONE if s.sed is None else significant(1e3 * s.sed, 4)),
                Cell(NONE if s.sed_sd is None else significant(1e3 * s.sed_sd, 2)),
            )

    columns = ("index", "subjects", "µ", "SED [kPa]", "standard deviation of SED [kPa]")
    caption = "Friction that the model got, and predicted SED: means over subjects, each from its own strokes."
    groups = [(one.descriptor, tuple(row(one))) for one in study.descriptors if any(s.subjects for s in one.surfaces)]
    return _table("table-surfaces", caption, columns, groups)


def _relation(study: StudyFindings) -> Table:
    def rows(one: DescriptorFindings) -> Iterable[tuple[Cell, ...]]:
        related, within = one.mean_relation, one.repeated
        if related is not None and related.pearson is not None:
            p = NONE if related.spearman_p is None else _p(related.spearman_p)
            rho = NONE if related.spearman is None else f"{correlation(related.spearman)} (p {p})"
            r = Cell(correlation(related.pearson))
            yield Cell("means"), Cell(f"{related.n} surfaces"), r, _correlations(related.low, related.high), Cell(rho)
        if within is not None:
            n = Cell(f"{within.dof} degrees of freedom")
            interval = _correlations(within.low, within.high)
            yield Cell("within subjects"), n, Cell(correlation(within.r)), interval, Cell(f"{NONE} (p {_p(within.p)})")

    columns = ("of", "n", "r", "95 % interval", "Spearman's rho")
    caption = (
        "Predicted SED with scores. Means: Pearson's r of means over subjects, interval by Fisher's z, p of rho exact. "
        "Within subjects: repeated-measures correlation of each subject's scores with the SEDs of its own strokes "
        "(Bakdash and Marusich 2017)."
    )
    return _table("table-relation", caption, columns, [(one.descriptor, tuple(rows(one))) for one in study.descriptors])


def _models(study: StudyFindings) -> Table:
    groups = [
        (f"{one.descriptor}: score on {what}", _terms(model))
        for one in study.descriptors
        for what, model in (("SED", one.on_sed), ("index", one.on_index))
        if model is not None
    ]
    caption = (
        "Mixed models of the score, fitted by restricted maximum likelihood: level and first slope differ between "
        "subjects; drift is the slope on the trials before in the block, carry-over that on the index stroked before. "
        "t intervals."
    )
    return _table("table-models", caption, ("term", "estimate", "95 % interval", "p"), groups)


def _terms(model: MixedModel) -> tuple[tuple[Cell, ...], ...]:
    shown = tuple(
        (Cell(t.name), Cell(significant(t.estimate, 3)), Cell(_to(t.low, t.high)), Cell(_p(t.p))) for t in model.terms
    )
    told = f"{model.n} scores of {model.subjects} subjects{'; singular fit' if model.singular else ''}"
    return (*shown, (Cell(f"what is left ({told})"), Cell(significant(model.within_sd, 3)), Cell(NONE), Cell(NONE)))


def _planted(study: StudyFindings) -> Table:
    rows = tuple(
        (
            Cell(one.descriptor),
            Cell(one.effect),
            Cell(significant(one.planted, 3)),
            Cell(significant(one.found, 3)),
            Cell(_to(one.low, one.high)),
            Cell("yes" if one.covered else "no"),
        )
        for one in study.effects
    )
    columns = ("descriptor", "effect on the score", "planted", "found", "95 % interval", "inside")
    caption = "Planted effects and what the mixed model on the index finds of them; one interval in twenty misses."
    return _table("table-planted", caption, columns, [("", rows)])


def _table(
    name: str,
    caption: str,
    columns: Iterable[str],
    groups: Iterable[tuple[str, tuple[tuple[Cell, ...], ...]]],
    notes: Notes | None = None,
) -> Table:
    kept = tuple(Group(head, rows) for head, rows in groups if rows)
    return Table(name, caption, tuple(Column(c) for c in columns), kept, () if notes is None else notes.listed())


def _interval(low: float | None, high: float | None, decimals: int) -> Cell:
    return Cell(NONE if low is None or high is None else f"{digits(low, decimals)} to {digits(high, decimals)}")


def _correlations(low: float | None, high: float | None) -> Cell:
    return Cell(NONE if low is None or high is None else f"{correlation(low)} to {correlation(high)}")


def _to(low: float, high: float) -> str:
    return f"{significant(low, 3)} to {significant(high, 3)}"


def _p(p: float) -> str:
    """Return a p value as people write it.

    >>> _p(0.0321), _p(1e-9)
    ('0.032', '< 0.001')
    """
    return "< 0.001" if p < 0.001 else digits(p, 3)
