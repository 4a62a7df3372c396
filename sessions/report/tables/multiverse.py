"""Table of the correlation along many paths of the analysis."""

from collections.abc import Iterable, Sequence

from sessions.report.tables.cells import Cell, Group, Row, Table, table
from sessions.report.wording import NONE, correlation
from sessions.statistics.multiverse import CHOICE_LABELS, SAME, PathFinding, Spread, by_choice, correlations, spread

Named = tuple[str, Sequence[PathFinding]]


def paths_table(named: Iterable[Named]) -> Table | None:
    """Return the distribution of the correlation over all paths and over those with each choice, by descriptor."""
    groups = [Group(name, _rows(findings)) for name, findings in named if findings]
    columns = (
        "choice |  | usual | paths with r | different r | least | lower quartile | median | upper quartile | greatest"
    )
    caption = (
        "The correlation of the predicted response with scores as a distribution over paths of the analysis: every "
        "choice below crossed with every other at small strain; finite strain, where it was tried, with the other "
        "choices as usual. "
        "Contact is solved at every friction that was met, from the trial's own prediction on and on its mesh. All of "
        "them are reasonable and none is a sample of others: quartiles describe, and are no intervals. Different r: "
        "how many are left where those that agree within "
        f"{SAME:g} count once. A path of which fewer than three surfaces have a prediction gives no r."
    )
    return table("table-paths", caption, columns, groups)


def paths_sentence(name: str, findings: Sequence[PathFinding]) -> str:
    """Return the distribution in a sentence."""
    whole = spread(correlations(findings))
    start = f"{name[:1].upper()}{name[1:]}: of {len(findings)} paths of the analysis"
    if whole is None:
        return f"{start} none gives a correlation."
    return (
        f"{start} {whole.correlated} give a correlation, from {correlation(whole.least)} to "
        f"{correlation(whole.greatest)}, median {correlation(whole.median)}; "
        f"{whole.distinct} of these differ by more than {SAME:g}."
    )


def _rows(findings: Sequence[PathFinding]) -> tuple[Row, ...]:
    rows = [(Cell("all"), Cell(""), Cell(""), *_spread(spread(correlations(findings)), len(findings)))]
    before = ""
    for choice, name, of, usual in by_choice(findings):
        count = sum(getattr(one.path, choice) == name for one in findings)
        label = CHOICE_LABELS[choice] if choice != before else ""
        rows.append((Cell(label), Cell(name), Cell("usual" if usual else ""), *_spread(of, count)))
        before = choice
    return tuple(rows)


def _spread(of: Spread | None, paths: int) -> Row:
    if of is None:
        return (Cell(f"0 of {paths}"), *(Cell(NONE) for _ in range(6)))
    numbers = (of.least, of.lower, of.median, of.upper, of.greatest)
    return (
        Cell(f"{of.correlated} of {paths}"),
        Cell(str(of.distinct)),
        *(Cell(correlation(value)) for value in numbers),
    )
