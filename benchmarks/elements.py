"""Draw docs/pictures/elements.svg: the elements that were compared before one was chosen, from the numbers beside it.

`python -m benchmarks.elements`. Nothing is measured here: the code of the other elements was not kept.
"""

import csv
from itertools import groupby
from pathlib import Path

from sessions.report.figures.style import GREEN, GREY, INK, PURPLE, SKY, VERMILLION, look, sheet, svg

PICTURES = Path(__file__).parents[1] / "docs" / "pictures"
LOOKS = {
    "P1 triangles": (GREY, "v", ":"),
    "P2 triangles": (SKY, "^", "--"),
    "Q1/P0": (GREY, "s", "--"),
    "Q2 displacement": (PURPLE, "D", "-."),
    "Q2/P-1": (VERMILLION, "o", "-"),
    "Q3/P2": (GREEN, "P", "--"),
    "Q4/P3": (INK, "X", ":"),
}


def main() -> None:
    """Read the numbers, write the picture."""
    with (PICTURES / "elements.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    with look():
        drawn = sheet(560, 380)
        (axes,) = drawn.axes
        for element, of_it in groupby(rows, lambda row: row["element"]):
            points = [(float(row["ms_per_further_surface"]), float(row["error_percent"])) for row in of_it]
            colour, mark, line = LOOKS[element]
            axes.plot(*zip(*points, strict=True), color=colour, marker=mark, linestyle=line, label=element)
        axes.set(
            xscale="log", yscale="log", xlabel="time of a further surface [ms]", ylabel="largest error of the SED [%]"
        )
        axes.set(
            xticks=[1, 10, 100], xticklabels=["1", "10", "100"], yticks=[0.1, 1, 10], yticklabels=["0.1", "1", "10"]
        )
        axes.legend()
        text = svg(drawn, "elements", "Time against error of seven elements", simulated=False)
        (PICTURES / "elements.svg").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
