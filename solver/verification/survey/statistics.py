"""How many estimates are safe, and how many are near."""

from collections.abc import Iterator, Sequence
from statistics import median

from solver.verification.estimates import Estimate
from solver.verification.truth import NUMBERS

ASKED = (None, 0.01, 0.003)  # tolerances of answers


def wanted(tolerance: float | None) -> str:
    """Return a tolerance as a heading."""
    return "no tolerance" if tolerance is None else f"{100 * tolerance:g} %"


def times(took_s: Sequence[float]) -> str:
    """Return what solves took, in words."""
    return f"{median(took_s):.2f} s in the median, {max(took_s):.1f} s at most"


def shares(rows: Sequence[Estimate]) -> Iterator[str]:
    """Yield a line a number: estimates above the true error, below ten times it, and the worst."""
    for name in NUMBERS:
        mine = [row for row in rows if row.number == name]
        if not mine:
            continue
        parts: list[str] = []
        for word, verdicts in (
            ("above", [row.above for row in mine]),
            ("near", [row.near for row in mine]),
            ("within the tolerance", [row.met for row in mine if row.tolerance and name == NUMBERS[0]]),
        ):
            known = [verdict for verdict in verdicts if verdict is not None]
            if verdicts:
                parts.append(f"{word} {sum(known)} of {len(known)}")
        errors = [row.error for row in mine]
        tail = ""
        if judged := [row for row in mine if row.above is not None]:
            worst = max(judged, key=lambda row: row.error / row.estimate)
            part, estimate = worst.error / worst.estimate, 100 * worst.estimate
            tail = f"; worst {part:.2f}: {100 * worst.error:.2g} % estimated at {estimate:.2g} % in {worst.case}"
        yield (
            f"  {name}: {', '.join(parts)}; error {100 * median(errors):.2g} % in the median, "
            f"{100 * max(errors):.2g} % at most{tail}"
        )
