"""The program's own texts in other languages, from XLIFF files, which every process reads."""

import os
import re
from collections.abc import Mapping, Sequence
from functools import lru_cache
from math import floor, isfinite, log10
from pathlib import Path
from typing import TypeVar
from xml.etree import ElementTree

SOURCE_LANGUAGE = "en"
_FOLDER = Path(__file__).parent / "translations"
VARIABLE = "DAQ_APP_LANGUAGE"  # the experimenter's language, for this process and its child processes
SUBJECT, EXPERIMENTER = "subject", "experimenter"  # contexts: the name of a file is context_language.xlf

POINTS = ".,\u066b\uff0e\uff0c"  # Latin, Arabic and full-width decimal marks
_PLAIN = re.compile(rf"(\d*)([{POINTS}]?)(\d*)")
_MOST_DIGITS = 9  # of a range whose ends look the same with fewer

T = TypeVar("T")


@lru_cache
def translations(context: str, language: str) -> Mapping[str, str]:
    """Return the texts of a language by the English ones; empty if its file is missing or unreadable."""
    try:
        units = ElementTree.parse(_FOLDER / f"{context}_{language}.xlf").iterfind(".//{*}trans-unit")
    except (OSError, ElementTree.ParseError):
        return {}
    return {unit.findtext("{*}source", ""): text for unit in units if (text := unit.findtext("{*}target", ""))}


def languages(context: str) -> tuple[str, ...]:
    """Return the languages that a context is translated into, English first."""
    names = (file.stem for file in _FOLDER.glob(f"{context}_*.xlf"))
    return (SOURCE_LANGUAGE, *sorted(name.removeprefix(f"{context}_") for name in names))


def tr(text: str, /, **values: object) -> str:
    """Return a text of the experimenter's side in the language of this process, with `values` in its braces.

    A text without a translation, or whose translation has other braces, is returned in English.

    >>> tr("Trial {number} of {count}", number=3, count=10)
    'Trial 3 of 10'
    """
    translation = translations(EXPERIMENTER, os.environ.get(VARIABLE, SOURCE_LANGUAGE)).get(text, text)
    if not values:
        return translation
    try:
        return translation.format(**values)
    except (LookupError, ValueError, AttributeError):
        return text.format(**values)


def tr_noop(texts: T) -> T:
    """Mark texts for `daq-app translate`, like QT_TR_NOOP, and return them unchanged; call `tr` to show one."""
    return texts


COUNT_LABELS: Mapping[str, str] = tr_noop({  # of a transducer's `Health`, by the names of its counts
    "received": "received", "lost": "lost", "repeated": "repeated", "late": "late", "malformed": "malformed",
    "stalled": "stalled", "restarted": "restarted", "saturated": "saturated", "doubtful": "doubtful", "noted": "noted",
    "off_units": "in other units", "off_rate": "rate changes",
})  # fmt: skip


_ANSWERS: Mapping[str, str] = tr_noop({  # by the outcome of a trial, or the choice of two
    "scored": "score {answer:.0f}", "numbered": "number {answer:.9g}", "first": "the first", "second": "the second",
})  # fmt: skip


def answer_text(outcome: str, answer: float | str | None) -> str:
    """Return a subject's answer as text: a score, a number on the subject's own scale, or a choice of two.

    >>> answer_text("scored", 37.4), answer_text("numbered", 0.125), answer_text("chosen", "first")
    ('score 37', 'number 0.125', 'the first')
    """
    if answer is None:
        return tr("no answer")
    return tr(_ANSWERS[answer]) if isinstance(answer, str) else tr(_ANSWERS[outcome], answer=answer)


def quantity(value: float | None, digits: int, unit: str = "") -> str:
    """Return a number with its unit and a true minus sign, never minus zero; a dash if it is unknown.

    >>> quantity(-0.001, 2, "N"), quantity(-1.25, 1), quantity(None, 0, "mm/s")
    ('0.00 N', '−1.2', '–')
    """
    if value is None or not isfinite(value):
        return "–"
    return f"{round(value, digits) + 0.0:.{digits}f} {unit}".rstrip().replace("-", "−")


def no_strokes(device: object) -> str:
    """Say why a session has no strokes; `device` is None for one without forces."""
    return "no forces were recorded" if device is None else "no stroke was found"


def number(value: float | None, digits: int = 3, *, factor: float = 1.0) -> str:
    """Return a number times a factor with `digits` significant digits, or a dash for None.

    Numbers below a million have all digits before the point.

    >>> number(0.0052573, 3), number(None), number(0.012, factor=1e3), number(-1423.4, 2), number(99.96, 2)
    ('0.00526', '–', '12.0', '−1,423', '100')
    """
    if value is None or not isfinite(value):
        return "–"
    value *= factor
    text = f"{abs(value):#.{digits}g}".rstrip(".")
    text = f"{abs(value):,.0f}" if 10.0**digits <= float(text) < 1e6 else text
    return f"−{text}" if value < 0.0 else text


def step_above(value: float, steps: Sequence[float] = (1.0, 2.0, 5.0, 10.0)) -> float:
    """Return the least of `steps` times a power of ten that is not below a value; 0 for none.

    >>> step_above(0.3), step_above(5.1), step_above(0.013, (1.0, 1.5, 10.0)), step_above(-2.0)
    (0.5, 10.0, 0.015, 0.0)
    """
    if not value > 0.0:
        return 0.0
    power = 10.0 ** floor(log10(value))
    return float(f"{next(step * power for step in steps if step * power >= value * (1 - 1e-9)):.6g}")


def aligned(count: int) -> str:
    r"""Return a row number padded to two figures.

    >>> aligned(3), aligned(12)
    ('\u20073', '12')
    """
    return f"{count:\u2007>2}"


def typed_number(text: str, point: str = ".") -> float | None:
    """Return a typed number, in digits of any script; None if it is not a plain or unambiguous number.

    Every mark is a decimal mark, but one other than the language's `point`, followed by three digits, may group
    thousands.

    >>> typed_number("12,5"), typed_number("1,000"), typed_number("1,000", ","), typed_number("0,125")
    (12.5, None, 1.0, 0.125)
    """
    match = _PLAIN.fullmatch(text.strip())
    if match is None or not (match[1] or match[3]) or two_meanings(text, point):
        return None
    return float(f"{match[1] or 0}.{match[3] or 0}")


def two_meanings(text: str, point: str = ".") -> tuple[str, str] | None:
    """Return both readings of a number whose mark may group thousands, without and with a fraction; else None.

    >>> two_meanings("1,250"), two_meanings("1.250", ","), two_meanings("1.250")
    (('1250', '1.250'), ('1250', '1,250'), None)
    """
    match = _PLAIN.fullmatch(text.strip())
    if match is None or match[2] in ("", point) or len(match[3]) != 3 or len(match[1]) > 3 or not float(match[1] or 0):
        return None
    return f"{match[1]}{match[3]}", f"{match[1]}{point}{match[3]}"


def span(low: float, high: float, digits: int = 3) -> str:
    """Return a range with `digits` significant digits, or more if its ends would look the same.

    >>> span(1.0, 2.5), span(-178.94, -178.91), span(2.0, 2.0)
    ('1.00 to 2.50', '−178.94 to −178.91', '2.00 to 2.00')
    """
    while low != high and digits < _MOST_DIGITS and number(low, digits) == number(high, digits):
        digits += 1
    return f"{number(low, digits)} to {number(high, digits)}"


def errors_text(mesh: float | None, effect: str = "") -> str:
    """Return the text after a number of the model: its relative errors, from the mesh and from omitted effects.

    >>> errors_text(0.0036, "viscosity 4 % of the SED"), errors_text(None)
    (' ± 0.36 % by the mesh; model: viscosity 4 % of the SED', '; mesh, model: no estimate')
    """
    from solver.prediction import percent  # slow to load, and most verbs do not need it

    if mesh is None and not effect:
        return tr("; mesh, model: no estimate")
    return tr(
        "{mesh}; model: {effect}",
        mesh=tr("; mesh: no estimate") if mesh is None else tr(" ± {share} by the mesh", share=percent(mesh)),
        effect=effect or tr("no estimate"),
    )


def sentence(text: str) -> str:
    """Return a text with a capital and a full stop; a leading file name or address is kept unchanged.

    >>> sentence("there is no driver 'x'"), sentence("a.toml: no such file"), sentence("sim: has no rate 9")
    ("There is no driver 'x'.", 'a.toml: no such file.', 'sim: has no rate 9.')
    """
    text = " ".join(text.split())
    if text.split(" ", 1)[0].isalpha():
        text = text[:1].upper() + text[1:]
    return text if text.endswith((".", "!", "?")) else f"{text}."
