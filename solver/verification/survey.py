"""Compare error estimates with true errors on many random scenes: `python -m solver.verification.survey`.

Each scene is solved as users request it, at 1 % and at 0.3 %, and on fine meshes, in 1 to 60 s. `--keep FILE` reads the
rows that FILE contains, and appends new ones.
"""

from argparse import ArgumentParser
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median

import msgspec
import numpy as np
from scipy.stats import spearmanr

from solver.accuracy.error_estimate import contrast_error
from solver.arrays import Array
from solver.failures import SolveFailure
from solver.prediction import Prediction, percent
from solver.response.solution import solve_many
from solver.scene import Scene
from solver.verification.estimates import CORRECTED, Estimate, compare
from solver.verification.fine_meshes import fine_numbers
from solver.verification.marked_page import fill_marks
from solver.verification.methods import Kinematics
from solver.verification.random_scenes import FAMILIES, random_scene, surface_set
from solver.verification.truth import TRUE_NUMBERS, mean_and_doubt

SURFACE_SET = "surfaces"  # the set of three surfaces solved together, whose differences are relative to their range
BY_TOLERANCE = 5.0  # ratio of the tolerance of a difference to that of a scene
TOLERANCES = (0.01, 0.003)  # of answers; the second is the default
ROW_SED = "SED of the row of receptors"
EXACT = 1e-12  # error below which a result follows from the input alone, and is not judged [-]
HEADER = (
    "set", "strain", "answers", "SED above", "corrected above", "forces above", "row above", "near", "missed unsaid",
    "ratio", "corrected ratio", "row ratio", "rank", "sign", "corrected",
)  # fmt: skip
CAPTION = (
    "Two answers of each scene. Above: share of estimates at or above the true error. Near: below ten times the larger "
    "of true error and 0.02 %. Missed unsaid: tolerances said to be met that are not, without a warning. Ratio: median "
    "of estimate by error. Corrected: median of its error by the answer's. Counted where the reference is accurate "
    "enough. Above and ratio: of the corrected SED and of the row of receptors, too."
)


@dataclass(frozen=True, slots=True)
class Row:
    """Result of one scene, or set of surfaces."""

    family: str
    number: int
    kinematics: Kinematics
    estimates: tuple[Estimate, ...] = ()  # of the answers
    refusals: tuple[str, ...] = ()  # of the answers, or of the truth


def solve(family: str, number: int, kinematics: Kinematics) -> Row:
    """Return the answers of one scene with their estimates and true errors."""
    together = family == SURFACE_SET
    scenes = surface_set(number, kinematics) if together else [random_scene(family, number, kinematics)]
    estimates: list[Estimate] = []
    refusals: list[str] = []
    try:
        truth = fine_numbers(scenes)
    except SolveFailure as failure:
        return Row(family, number, kinematics, refusals=(f"no truth: {failure}",))
    for tolerance in TOLERANCES:
        answers = solve_many([_with_tolerance(scene, tolerance, together=together) for scene in scenes])
        refusals += [str(answer) for answer in answers if isinstance(answer, SolveFailure)]
        predictions = [answer for answer in answers if isinstance(answer, Prediction)]
        refusals += [f"errors unknown at {percent(tolerance)}" for answer in predictions if answer.nested is None]
        if together and len(predictions) == len(scenes):
            estimates.append(_difference(predictions, BY_TOLERANCE * tolerance, truth))
        elif predictions:
            means, doubts = mean_and_doubt(truth[:, 0])
            estimates += compare(predictions[0], tolerance, means, doubts)
            estimates += _compare_row(predictions[0], tolerance, means[3:], doubts[3:])
    return Row(family, number, kinematics, tuple(estimates), tuple(dict.fromkeys(refusals)))


def _with_tolerance(scene: Scene, tolerance: float, *, together: bool) -> Scene:
    solve = replace(scene.solve, evidence="estimated")
    if together:
        return replace(scene, solve=replace(solve, contrast_tolerance=BY_TOLERANCE * tolerance))
    return replace(scene, solve=replace(solve, tolerance=tolerance))


def _compare_row(answer: Prediction, tolerance: float, truth: Array, doubt: Array) -> list[Estimate]:
    """Return the estimate and error of each receptor of an answer's row, against `truth` (r,) of relative `doubt`."""
    row, scene = answer.row, answer.scene
    finite = np.isfinite(row.error) & np.isfinite(truth)
    columns = row.error[finite], np.abs(row.sed / truth - 1.0)[finite], doubt[finite]
    return [
        Estimate(scene.solve.kinematics, scene.title, ROW_SED, tolerance, answer.dofs, *numbers)
        for numbers in zip(*(column.tolist() for column in columns), strict=True)
    ]


def _difference(answers: Sequence[Prediction], tolerance: float, solves: Array) -> Estimate:
    """Return estimate and error of differences in SED, relative to the range of the truth `solves` (3, n, 3)."""
    sed = np.array([answer.sed_ending for answer in answers])
    error, doubt = apart(sed, solves[:, :, 0])
    first = answers[0]
    title, estimate = first.scene.title, contrast_error(answers).share
    return Estimate(first.scene.solve.kinematics, title, TRUE_NUMBERS[0], tolerance, first.dofs, estimate, error, doubt)


def apart(numbers: Array, solves: Array) -> tuple[float, float]:
    """Return the worst error of a difference between `numbers` (n,), and the truth's doubt, both relative to its range.

    `solves` (m, n) are the values on m fine meshes, whose mean is the truth.
    """
    truth = solves.mean(axis=0)
    span = float(np.ptp(truth))
    return float(np.ptp(numbers - truth)) / span, float(np.ptp(solves - truth, axis=1).max()) / span


def judgement(name: str, kinematics: str, rows: Iterable[Estimate]) -> tuple[str, ...]:
    """Return the cells under `HEADER` of one set of scenes.

    Near, ratio (median of estimate over error), rank (Spearman's, of estimate and error), sign (whether the nested
    value lies on the truth's side) and corrected (median of its error over the answer's) are those of the SED.
    """
    decidable = [row for row in rows if row.above is not None and row.error > EXACT]
    goals = (TRUE_NUMBERS[:1], (CORRECTED,), TRUE_NUMBERS[1:], (ROW_SED,))
    columns = [[row for row in decidable if row.number in names] for names in goals]
    sed, corrected, _, receptors = columns
    within = [row for row in sed if row.meets_tolerance is not None and row.estimate <= row.tolerance]
    true = [row for row in sed if row.corrected is not None and row.doubt <= row.error / 3.0]
    halves = [row.corrected / row.error for row in true if row.corrected is not None]
    return (
        name,
        kinematics,
        str(len(sed)),
        *(_share([bool(row.above) for row in column]) for column in columns),
        _share([row.near for row in sed if row.near is not None]),
        f"{sum(not row.meets_tolerance and not row.warned for row in within)} of {len(within)}",
        _ratio(sed),
        _ratio(corrected),
        _ratio(receptors),
        f"{spearmanr([(row.estimate, row.error) for row in sed]).statistic:.2f}" if len(sed) > 2 else "–",
        _share([row.towards for row in true]),
        f"{median(halves):.2f}" if halves else "–",
    )


def _ratio(rows: Sequence[Estimate]) -> str:
    return f"{median(row.estimate / row.error for row in rows):.1f}" if rows else "–"


def _share(verdicts: Sequence[bool]) -> str:
    return f"{100.0 * sum(verdicts) / len(verdicts):.3g} %" if verdicts else "–"


def misses(rows: Iterable[Estimate]) -> Iterator[str]:
    """Yield a line for every result whose error exceeds its estimate."""
    for row in rows:
        if row.above is False and row.error > EXACT:
            sentence = f"error of the {row.number} {row.error:.2g}, estimate {row.estimate:.2g}"
            yield f"{row.case}, {row.kinematics} strain, {100 * row.tolerance:g} %: {sentence}"


def report(rows: Sequence[Row]) -> Iterator[str]:
    """Yield the refusals, the misses, and a table with a row for each set and kinematics."""
    yield from (f"{row.family} {row.number}: {sentence}" for row in rows for sentence in row.refusals)
    yield from misses(estimate for row in rows for estimate in row.estimates)
    yield from table(rows)


def table(rows: Sequence[Row]) -> Iterator[str]:
    """Yield the lines of a Markdown table with a row for each set and kinematics."""
    yield _line(HEADER)
    yield _line(["---"] * len(HEADER))
    for kinematics, family in dict.fromkeys((row.kinematics, row.family) for row in rows):
        selection = [row for row in rows if (row.kinematics, row.family) == (kinematics, family)]
        yield _line(judgement(family, kinematics, (estimate for row in selection for estimate in row.estimates)))


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def read_rows(keep: Path | None) -> list[Row]:
    """Return the rows of a file; none where it does not exist."""
    lines = keep.read_bytes().splitlines() if keep is not None and keep.exists() else []
    return [msgspec.json.decode(line, type=Row) for line in lines]


def rows(keys: Sequence[tuple[str, int, Kinematics]], keep: Path | None) -> Iterator[Row]:
    """Yield the rows of scenes from the file `keep`; solve scenes that it lacks and append their rows."""
    by_key = {(row.family, row.number, row.kinematics): row for row in read_rows(keep)}
    for key in keys:
        row = by_key.get(key)
        if row is None:
            row = solve(*key)
            if keep is not None:
                with keep.open("ab") as file:
                    file.write(msgspec.json.encode(row) + b"\n")
        yield row


def main() -> None:
    """Solve and print."""
    parser = ArgumentParser(prog="python -m solver.verification.survey", description="Judge error estimates.")
    parser.add_argument("--family", choices=(*FAMILIES, SURFACE_SET), default="axis", help="of scenes")
    parser.add_argument("--kinematics", choices=("small", "finite"), default="small")
    parser.add_argument("--scenes", type=int, default=20)
    parser.add_argument("--first", type=int, default=0, help="number of the first scene")
    parser.add_argument("--keep", type=Path, help="file of solved scenes")
    parser.add_argument("--page", type=Path, help="write the rows of all that is kept into the table of this page")
    options = parser.parse_args()
    keys = [
        (options.family, number, options.kinematics) for number in range(options.first, options.first + options.scenes)
    ]
    for line in report(list(rows(keys, options.keep))):
        print(line)
    if options.page is not None:
        text = options.page.read_text("utf-8")
        judgements = "\n".join([CAPTION, "", *merge(text.splitlines(), table(read_rows(options.keep)))])
        options.page.write_text(fill_marks(text, "judged", judgements), "utf-8")


def merge(page: Sequence[str], rows: Iterable[str]) -> list[str]:
    """Return the table of a page with new `rows` for their sets, sorted by strain and set; its header comes first."""
    header, rule, *new = rows
    by_set = {tuple(line.split(" | ")[:2]): line for line in (*page, *new) if line.startswith("| ")}
    lines = [line for (_, *strain), line in sorted(by_set.items()) if strain in (["small"], ["finite"])]
    return [header, rule, *sorted(lines, key=lambda line: line.split(" | ")[1] != "small")]


if __name__ == "__main__":
    main()
