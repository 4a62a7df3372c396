"""Compare error estimates with true errors on many random scenes: `python -m solver.verification.survey`.

Each scene is solved at 1 % and at 0.3 %, in 1 to 60 s. `--keep FILE` reads the rows that FILE
contains, and appends new ones.
"""

from argparse import ArgumentParser
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

import msgspec

from solver.verification.marked_page import fill_marks
from solver.verification.methods import Kinematics
from solver.verification.random_scenes import FAMILIES
from solver.verification.survey.answers import SURFACE_SET, Row, report, solve, table

Key = tuple[str, int, Kinematics]
CAPTION = (
    "Two answers of each scene. Above: share of estimates at or above the true error. Near: below ten times the larger "
    "of true error and 0.02 %. Missed unsaid: tolerances said to be met that are not, without a warning. Ratio: median "
    "of estimate by error. Corrected: median of its error by the answer's. Counted where the reference is accurate "
    "enough. Above and ratio: of the corrected SED, too."
)


def read_rows(keep: Path | None) -> list[Row]:
    """Return the rows of a file; none where it does not exist."""
    lines = keep.read_bytes().splitlines() if keep is not None and keep.exists() else []
    return [msgspec.json.decode(line, type=Row) for line in lines]


def rows(keys: Sequence[Key], keep: Path | None, solve: Callable[[str, int, Kinematics], Row] = solve) -> Iterator[Row]:
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
