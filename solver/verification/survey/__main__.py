"""Judge error estimates over many random scenes: `python -m solver.verification.survey`.

| survey | asks |
| --- | --- |
| answers | whether the estimates of answers are safe and near, without a tolerance, at 1 % and at 0.3 % |
| contrasts | whether differences between three surfaces solved together are right to 5 % of their range |

One scene takes 1 to 60 s. `--keep FILE` appends what is solved to FILE, and takes from it what is there.
"""

from argparse import ArgumentParser
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from solver.verification.methods import Kinematics
from solver.verification.random_scenes import FAMILIES
from solver.verification.survey import answers, contrasts


@dataclass(frozen=True, slots=True)
class Survey:
    """One kind of survey: what a scene gives, and what is said of all of them."""

    row: type[Any]
    solve: Callable[[str, int, Kinematics], Any]
    report: Callable[[Sequence[Any]], Iterator[str]]


SURVEYS = {
    "answers": Survey(answers.Row, answers.solve, answers.report),
    "contrasts": Survey(contrasts.Row, contrasts.solve, contrasts.report),
}


def rows(survey: Survey, keys: Sequence[tuple[str, int, Kinematics]], keep: Path | None) -> Iterator[Any]:
    """Yield what scenes give, from the lines of `keep` where it has them; the others are solved and appended."""
    lines = keep.read_bytes().splitlines() if keep is not None and keep.exists() else []
    stored = [msgspec.json.decode(line, type=survey.row) for line in lines]
    by_key = {(row.family, row.number, row.kinematics): row for row in stored}
    for key in keys:
        row = by_key.get(key)
        if row is None:
            row = survey.solve(*key)
            if keep is not None:
                with keep.open("ab") as file:
                    file.write(msgspec.json.encode(row) + b"\n")
        yield row


def main() -> None:
    """Solve and print."""
    parser = ArgumentParser(prog="python -m solver.verification.survey", description="Judge error estimates.")
    parser.add_argument("survey", choices=SURVEYS)
    parser.add_argument("--family", choices=FAMILIES, default="published", help="of scenes (not of contrasts)")
    parser.add_argument("--kinematics", choices=("small", "finite"), default="small")
    parser.add_argument("--scenes", type=int, default=20)
    parser.add_argument("--first", type=int, default=0, help="number of the first scene")
    parser.add_argument("--keep", type=Path, help="file of solved scenes")
    options = parser.parse_args()
    if options.family in ("bounded", "stiff") and options.kinematics == "small":
        parser.error(f"scenes of the family {options.family} are of finite strain; add --kinematics finite")
    survey = SURVEYS[options.survey]
    keys = [
        (options.family, number, options.kinematics) for number in range(options.first, options.first + options.scenes)
    ]
    for line in survey.report(list(rows(survey, keys, options.keep))):
        print(line)


if __name__ == "__main__":
    main()
