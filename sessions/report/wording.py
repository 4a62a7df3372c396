"""Numbers, names and quantities at the ending for people, and the captions in `captions.toml`."""

import math
import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from sessions.prediction import BY_NAME, SED
from sessions.prediction.stored import Ends
from sessions.report.contents import PredictionFinding
from sessions.statistics.correlations import Relation
from sessions.statistics.scores import bounds
from sessions.strokes.stroke import digits, significant

NONE = "–"
_CAPTIONS: Mapping[str, str] = tomllib.loads((Path(__file__).parent / "captions.toml").read_text("utf-8"))


def caption(name: str, **words: object) -> str:
    """Return the caption of a table or figure, with `words` in its placeholders."""
    return _CAPTIONS[name].format(**words)


def with_error(value: float, error: float | None, least: int) -> str:
    """Return a number and its error with enough decimals for one figure of the error, and at least `least`.

    >>> with_error(0.27982, 0.00031, 3), with_error(21.4, 0.42, 1), with_error(21.4, None, 1)
    ('0.2798 ± 0.0003', '21.4 ± 0.4', '21.4')
    """
    if not error:
        return digits(value, least)
    decimals = max(least, -math.floor(math.log10(error)))
    return f"{digits(value, decimals)} ± {digits(error, decimals)}"


def between(low: float, high: float, as_text: Callable[[float], str], unit: float = 1.0) -> str:
    """Return a range with ends written by `as_text`, with more decimals where they would look equal.

    `as_text` first multiplies a number by `unit`.

    >>> between(0.5, 1.25, places(1)), between(-178.12, -178.09, places(0)), between(2.0, 2.0, places(1))
    ('0.5 to 1.2', '−178.12 to −178.09', '2.0 to 2.0')
    >>> between(0.001, 0.003, correlation)
    '+0.001 to +0.003'
    """
    as_text = finer(low, high, as_text, unit)
    return f"{as_text(low)} to {as_text(high)}"


def finer(low: float, high: float, as_text: Callable[[float], str], unit: float = 1.0) -> Callable[[float], str]:
    """Return `as_text`, or a format with enough decimals to distinguish the ends of a range.

    >>> finer(0.001, 0.003, correlation)(0.0021)
    '+0.002'
    """
    if as_text(low) != as_text(high) or low == high:
        return as_text
    decimals = max(0, -math.floor(math.log10(unit * abs(high - low))))
    sign: Literal["", "+"] = "+" if as_text(1.0).startswith("+") else ""
    return lambda value: digits(unit * value, decimals, sign)


def places(n: int) -> Callable[[float], str]:
    """Return a format with n decimals.

    >>> places(1)(2.25)
    '2.2'
    """
    return lambda value: digits(value, n)


def with_sign(value: float) -> str:
    """Return a number with one decimal and its sign.

    >>> with_sign(-0.25), with_sign(-0.01)
    ('−0.2', '0.0')
    """
    if abs(value) < 0.05:
        return "0.0"
    return digits(value, 1, "+")


def sed(megapascal: float) -> str:
    """Return a strain-energy density in kPa."""
    return digits(1e3 * megapascal, 3)


def tau(megapascal: float) -> str:
    """Return a traction in kPa."""
    return significant(1e3 * megapascal, 3)


def correlation(r: float) -> str:
    """Return a coefficient with two decimals, or more if it would look perfect.

    >>> correlation(-0.5), correlation(0.997), correlation(-0.99996), correlation(-0.004), correlation(1.0)
    ('−0.50', '+0.997', '−0.99996', '+0.00', '+1.00')
    """
    gap = 1.0 - abs(r)
    decimals = -math.floor(math.log10(gap)) if 1e-9 < gap <= 0.005 else 2
    return digits(r, decimals, "+")


def ends_of(relation: Relation) -> str:
    """Return the 95 % interval of a correlation, or why it has none, as the end of a sentence."""
    if relation.low is None or relation.high is None:
        return f", {relation.reason}" if relation.reason else ""
    return f", 95 % interval {correlation(relation.low)} to {correlation(relation.high)}"


def spread_share(low: float, high: float) -> str:
    """Return a range as a share of the middle of its ends; across 0 it may be any share above 200 %.

    >>> spread_share(5.185, 5.3575), spread_share(-0.3, 0.1), spread_share(-0.2, 0.2)
    ('3.3 %', 'more than 200 %', 'more than 200 %')
    """
    if low < 0.0 < high:
        return "more than 200 %"
    middle = abs(high + low)
    return f"{significant(200 * (high - low) / middle, 2)} %" if middle else "about 0"


def direction(sign: int | None) -> str:
    """Return the direction of a stroke in words.

    >>> direction(-1)
    'distal to proximal'
    """
    return {1: "proximal to distal", -1: "distal to proximal", None: NONE}[sign]


def plural(n: int, noun: str, several: str = "") -> str:
    """Return a count with its noun.

    >>> plural(1, "subject"), plural(10, "subject"), plural(2, "stimulus", "stimuli")
    ('1 subject', '10 subjects', '2 stimuli')
    """
    return f"{n} {noun if n == 1 else several or noun + 's'}"


def reversal_sentence(descriptor: str, falling: int, subjects: int) -> str:
    """Return a sentence on the subjects whose scores fall as the index rises.

    >>> reversal_sentence("stickiness", 1, 1)
    'The stickiness scores fall as the index rises; the appendix says more.'
    """
    if subjects == 1:
        return f"The {descriptor} scores fall as the index rises; the appendix says more."
    return (
        f"The {descriptor} scores of {falling} of {subjects} subjects fall as the index rises; the appendix names each."
    )


def capital(text: str) -> str:
    """Return a text with a capital first letter."""
    return text[:1].upper() + text[1:]


def full_stop(sentence: str) -> str:
    """Return a sentence with its full stop."""
    return sentence if sentence.endswith(".") else f"{sentence}."


def identifier(name: str) -> str:
    """Return a different XML identifier for each name: other characters become their code points.

    >>> identifier('relation a"b')
    'relation_20_a_22_b'
    """
    return re.sub(r"[^A-Za-z0-9-]", lambda match: f"_{ord(match[0]):x}_", name)


def p_value(p: float) -> str:
    """Return a p value for people.

    >>> p_value(0.0321), p_value(1e-9)
    ('0.032', '< 0.001')
    """
    return "< 0.001" if p < 0.001 else digits(p, 3)


def three_figures(value: float) -> str:
    """Return a number with three significant figures."""
    return significant(value, 3)


@dataclass(frozen=True, slots=True)
class ShownResponse:
    """One of `solver.quantities` in pages and figures."""

    name: str
    label: str
    kept_unit: str  # of the numbers in files: "MPa", or "-" for a strain
    unit: str  # of the numbers shown: "kPa", or "1"
    factor: float  # ratio of shown to stored numbers
    places: int  # decimals of a shown number
    step: str  # unit of a slope on scores or indices, a millionth of the stored unit

    @property
    def in_full(self) -> str:
        """The label, with abbreviations spelt out."""
        return "strain-energy density (SED)" if self.name == SED.name else self.label

    def text(self, number: float) -> str:
        """Return a number of the shown unit with that unit.

        >>> shown_response("sed").text(9.5528), shown_response("shear_along_skin").text(-0.25)
        ('9.553 kPa', '−0.2500')
        """
        return digits(number, self.places) + ("" if self.unit == "1" else f" {self.unit}")

    def numbers(self, prediction: PredictionFinding) -> tuple[float, float | None] | None:
        """Return a prediction's number in the stored unit, and its error, None if unknown; None without a number."""
        if self.name == SED.name:
            sed, error = prediction.sed, prediction.error_estimate
            return None if sed is None else (sed, None if error is None else abs(sed) * error)
        if self.name not in prediction.responses:
            return None
        value, error = prediction.responses[self.name]
        return value, error if math.isfinite(error) else None

    def interval(self, prediction: PredictionFinding) -> Ends | None:
        """Return the 95 % interval of a prediction from friction, in the stored unit; None without one."""
        sed_interval = prediction.interval
        if self.name != SED.name or sed_interval is None or prediction.doubt:
            return None
        return bounds(sed_interval.low, sed_interval.high)


def shown_response(name: str) -> ShownResponse:
    """Return the description of a quantity by its name in `solver.quantities`."""
    quantity = BY_NAME[name]
    unit, factor = quantity.shown_unit
    places, step = (3, "Pa") if unit == "kPa" else (4, "10⁻⁶")
    return ShownResponse(quantity.name, quantity.label, quantity.unit, unit, factor, places, step)
