"""Statistics of estimates: how many are safe, how many are close, and the gain of the corrected value."""

from collections.abc import Iterable, Iterator, Sequence
from statistics import median

from scipy.stats import spearmanr

from solver.verification.estimates import GOALS, Estimate

TOLERANCES = (0.01, 0.003)  # of answers; the second is the default
EXACT = 1e-12  # error below which a result follows from the input alone, and is not judged [-]
HEADER = (
    "set", "strain", "answers", "SED above", "corrected above", "force above", "drag above", "near", "missed unsaid",
    "ratio", "corrected ratio", "rank", "sign", "corrected",
)  # fmt: skip


def judgement(name: str, kinematics: str, rows: Iterable[Estimate]) -> tuple[str, ...]:
    """Return the cells under `HEADER` of one set of scenes.

    Near, ratio (median of estimate over error), rank (Spearman's, of estimate and error), sign (whether the nested
    value lies on the truth's side) and corrected (median of its error over the answer's) are those of the SED.
    """
    decidable = [row for row in rows if row.above is not None and row.error > EXACT]
    by_number = [[row for row in decidable if row.number == number] for number in GOALS]
    sed = by_number[0]
    within = [row for row in sed if row.meets_tolerance is not None and row.estimate <= row.tolerance]
    true = [row for row in sed if row.corrected is not None and row.doubt <= row.error / 3.0]
    halves = [row.corrected / row.error for row in true if row.corrected is not None]
    return (
        name,
        kinematics,
        str(len(sed)),
        *(_share([bool(row.above) for row in column]) for column in by_number),
        _share([row.near for row in sed if row.near is not None]),
        f"{sum(not row.meets_tolerance and not row.warned for row in within)} of {len(within)}",
        _ratio(sed),
        _ratio(by_number[1]),
        f"{spearmanr([(row.estimate, row.error) for row in sed]).statistic:.2f}" if len(sed) > 2 else "–",
        _share([row.towards for row in true]),
        f"{median(halves):.2f}" if halves else "–",
    )


def _ratio(rows: Sequence[Estimate]) -> str:
    return f"{median(row.estimate / row.error for row in rows):.1f}" if rows else "–"


def _share(verdicts: Sequence[bool]) -> str:
    return f"{100.0 * sum(verdicts) / len(verdicts):.0f} %" if verdicts else "–"


def misses(rows: Iterable[Estimate]) -> Iterator[str]:
    """Yield a line for every result whose error exceeds its estimate."""
    for row in rows:
        if row.above is False and row.error > EXACT:
            sentence = f"error of the {row.number} {row.error:.2g}, estimate {row.estimate:.2g}"
            yield f"{row.case}, {row.kinematics} strain, {100 * row.tolerance:g} %: {sentence}"
