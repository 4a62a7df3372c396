"""Cells of a table as text: how they sort, and how a range of them is copied. No Qt."""

import re
from collections.abc import Iterable

NUMBER = re.compile(r"[-−+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?", re.IGNORECASE)


def number_in(text: str) -> float | None:
    """Return the number with which a text begins; None where it begins with none.

    >>> number_in("0.440 to 0.453"), number_in("−3.5 %"), number_in("–"), number_in("stroke 3")
    (0.44, -3.5, None, None)
    """
    match = NUMBER.match(text.strip())
    return None if match is None else float(match[0].replace("−", "-"))


def sort_key(text: str) -> tuple[bool, float, str]:
    """Return what a cell is sorted by: numbers by their value, then words.

    >>> sorted(["10", "9.5", "–", "−1"], key=sort_key)
    ['−1', '9.5', '10', '–']
    """
    number = number_in(text)
    return number is None, 0.0 if number is None else number, text.casefold()


def as_tsv(lines: Iterable[Iterable[str]]) -> str:
    r"""Return cells as tab-separated values; a tab or a new line within a cell becomes a space.

    >>> as_tsv([["a", "b\tc"], ["1", "2"]])
    'a\tb c\n1\t2'
    """
    return "\n".join("\t".join(re.sub(r"[\t\r\n]+", " ", cell) for cell in line) for line in lines)
