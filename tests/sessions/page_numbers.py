"""The numbers in the tables of a page as a reader sees them: which of them lack an interval, and which a unit."""

import re
from html.parser import HTMLParser

# What an interval has no meaning for: names, counts, settings; what somebody answered; what is itself a measure of
# doubt or of chance; what describes a whole set of numbers.
NO_ESTIMATES = {
    "names": {"stroke", "trial", "index", "subject", "session", "term", "descriptor", "effect", "scores", "choice", "",
              "quantity",
              "SED against", "unit", "which µ", "direction", "stroked", "flaws", "usual"},
    "counts": {"subjects", "stimuli", "n", "answers", "strokes with SED", "flawed trials", "paths with r",
               "different r"},
    "settings": {"depth", "depth of the model", "true µ", "true τ max", "true speed", "true",
                 "ended as planned", "counted", "inside"},
    "answers": {"score", "answer"},
    "doubt": {"estimated error", "solved in", "agree", "exact p of rho", "p", "p, Holm", "Friedman's p", "Page's p",
              "off by", "Steiger's Z", "left-out error", "AIC weight"},
    "descriptions": {"r without one", "r with one left out", "Kendall's W", "least", "lower quartile", "median",
                     "upper quartile", "greatest"},
}  # fmt: skip
PLAIN = set().union(*NO_ESTIMATES.values())
BARE = {
    "r",
    "rho",
    "Pearson's r",
    "Spearman's rho",
    "estimate",
    "estimated",
    "geometric mean",
    "at one modulus",
    "r of SED minus this",
    "r given the model's µ",
}
# Correlations have no unit; a row of effects has a column for its own; magnitude estimates have the subject's own.


class Tables(HTMLParser):
    """Every table of results on a page: its name, heads (name, unit), rows of cells (words, mark, interval), notes."""

    def __init__(self, text):
        super().__init__()
        self.tables, self._in, self._notes = [], [], ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        attributes = dict(attrs)
        if tag == "table":
            self._row = None
            if attributes["class"] == "data":
                self.tables.append({"name": attributes["id"], "heads": [], "rows": [], "notes": {}})
        if tag in ("table", "th", "td", "small", "sup", "span", "caption", "li", "ul"):
            self._in.append((tag, attributes.get("class", "")))
        if tag == "tr":
            self._row = []
        if tag in ("th", "td", "li"):
            self._cell = {"words": "", "mark": "", "interval": "", "unit": ""}

    def handle_endtag(self, tag):
        if tag == "li" and ("ul", "notes") in self._in:
            self.tables[-1]["notes"][self._cell["mark"].strip()] = self._cell["words"].strip()
        if tag in ("th", "td") and ("table", "data") in self._in:
            self._row.append({name: words.strip() for name, words in self._cell.items()})
        if tag == "tr" and ("table", "data") in self._in:
            table = self.tables[-1]
            if not table["heads"]:
                table["heads"] = [(cell["words"], cell["unit"]) for cell in self._row]
            elif len(self._row) == len(table["heads"]):
                table["rows"].append(self._row)
        if self._in and self._in[-1][0] == tag:
            self._in.pop()

    def handle_data(self, data):
        inside = dict.fromkeys(tag for tag, _ in self._in)
        if "caption" in inside or not ({"th", "td", "li"} & set(inside)) or ("table", "facts") in self._in:
            return
        part = {"small": "unit", "sup": "mark", "span": "interval"}.get(self._in[-1][0], "words")
        self._cell[part] += data


def estimates(text):
    """Yield (place, unit, interval, the note in its stead) for each number that is estimated; "" for what is not."""
    for table in Tables(text).tables:
        heads = table["heads"]
        for row in table["rows"]:
            for at, ((name, unit), cell) in enumerate(zip(heads, row, strict=True)):
                plain = name in PLAIN or _is_interval(name) or re.match(r"index \d", name)
                if plain or not re.search(r"\d", cell["words"]):
                    continue
                neighbour = row[at + 1] if at + 1 < len(row) and _is_interval(heads[at + 1][0]) else None
                interval_beside = neighbour is not None and " to " in neighbour["words"]
                interval = cell["interval"] or (neighbour["words"] if interval_beside else "")
                marks = [*cell["mark"].split(","), *([] if neighbour is None else neighbour["mark"].split(","))]
                notes = [table["notes"].get(mark, "") for mark in marks]
                why = next((note for note in notes if "no interval" in note), "")
                place = f"{table['name']}, {name}, {' '.join(head['words'] for head in row[:3])}: {cell['words']}"
                yield place, unit or (name if name in BARE else ""), interval, why


def _is_interval(name):
    return "interval" in name or name == "within subjects"
