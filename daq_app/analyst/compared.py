"""Two sessions side by side: friction, SED and score of each stimulus, and how far they lie apart."""

from collections import defaultdict
from dataclasses import dataclass

from daq_app.wording import tr_noop
from sessions.report.contents import Report

Number = float | None
NAMES = tr_noop(("µ", "SED [kPa]", "score"))


@dataclass(frozen=True, slots=True)
class Pair:
    """One quantity of one stimulus in both sessions."""

    first: Number
    second: Number

    @property
    def difference(self) -> Number:
        """Return the second less the first; None where one of them is missing."""
        return None if self.first is None or self.second is None else self.second - self.first


@dataclass(frozen=True, slots=True)
class ComparedRow:
    """One stimulus that either session has."""

    experiment: str
    index: int
    pairs: tuple[Pair, ...]  # of `NAMES`, means over repetitions


def compared(first: Report, second: Report) -> tuple[ComparedRow, ...]:
    """Return every stimulus of either session, experiments in their order; mu is the one the model got."""
    tables = [_numbers(report) for report in (first, second)]
    names = [experiment.name for report in (first, second) for experiment in report.experiments]
    keys = sorted({*tables[0], *tables[1]}, key=lambda key: (names.index(key[0]) if key[0] in names else -1, *key))
    return tuple(
        ComparedRow(*key, tuple(Pair(*(table.get(key, {}).get(name) for table in tables)) for name in NAMES))
        for key in keys
    )


def _numbers(report: Report) -> dict[tuple[str, int], dict[str, float]]:
    gathered: defaultdict[tuple[str, int], defaultdict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    for said in report.predictions:
        if said.index is None:
            continue
        for name, value in (("µ", said.mu), ("SED [kPa]", None if said.sed is None else 1000.0 * said.sed)):
            if value is not None:
                gathered[said.experiment, said.index][name].append(value)
    for experiment in report.experiments:
        for score in experiment.scores:
            gathered[experiment.name, score.index]["score"].append(score.mean)
    return {key: {name: sum(v) / len(v) for name, v in values.items()} for key, values in gathered.items()}
