"""What a verb says to people and to scripts, kept apart, and how it reads what they ask for."""

import argparse
import io
import json
import os
import re
import sys
import textwrap
import threading
import time
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any, NoReturn, TextIO

from solver.progress import listening

DONE, FAILED, WRONG, FLAWED, STOPPED = 0, 1, 2, 3, 130  # exit codes
OUR_OWN = ("daq_app", "drivers", "sessions", "simulators", "solver")  # packages
_COLUMNS = 80  # of a terminal that does not say how many it has
_PATIENCE = 1.0  # of people, before they want to see that something is going on [s]


@dataclass(slots=True)
class EndlessProgress:
    """Progress of work whose end nobody knows: its present task counts as half of what is left."""

    task: str
    fraction: float = 0.0  # of the whole, as shown
    _start: float = 0.0  # the part of the whole when its task began

    def hear(self, task: str, fraction: float) -> None:
        """Take the name of the present task, and the part of it that is done."""
        if task != self.task:
            self.task, self._start = task, self.fraction
        self.reach(self._start + 0.5 * fraction * (1.0 - self._start))

    def reach(self, fraction: float) -> None:
        """Move on to this part of the whole; the end is only there when it is there."""
        self.fraction = max(self.fraction, min(fraction, 0.99))


class WrongValue(Exception):
    """The command line or a value in a file was wrong: exit code 2."""


class RecordingKept(KeyboardInterrupt):
    """The user stopped work that had already recorded something; the message names the folder (exit code 3)."""


class NotWritten(Exception):
    """The output could not be written: why, where, and what to do."""


def is_ours(error: Exception) -> bool:
    """Say whether an error is of the program's own kinds, whose messages are sentences for people."""
    return type(error).__module__.partition(".")[0] in OUR_OWN


def accept_any_text(*streams: TextIO) -> None:
    """Let each stream read and write what its encoding has no letters for as escapes: no answer is lost to a dash."""
    for stream in streams:
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def harmless(text: str) -> str:
    r"""Return text as a terminal may have it: control characters, which it would obey, are shown escaped.

    >>> print(harmless("a\x1b[31mb"))
    a\x1b[31mb
    """
    return re.sub(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]", lambda match: f"\\x{ord(match[0]):02x}", text)


class Console:
    """Text for people on stdout, or one JSON document there and everything else on stderr."""

    def __init__(self, *, as_json: bool, out: TextIO | None = None, err: TextIO | None = None) -> None:
        """Speak to people, or with `as_json` to scripts."""
        self.as_json = as_json
        self._out = out or sys.stdout
        self._err = err or sys.stderr
        self._last_line = 0.0
        self._start = 0.0  # the job that progress is shown of [s]
        self._fraction = 1.0  # of it
        self._line_open = False
        self._lost_results = False

    @property
    def at_terminal(self) -> bool:
        """Say whether people see progress as a moving bar, with the time left."""
        return self._err.isatty()

    def say(self, *lines: str | None) -> None:
        """Print lines for people, None left out; nothing where a script reads."""
        if not self.as_json:
            self._end_progress()
            for line in lines:
                if line is not None:
                    self._answer(harmless(line))

    def note(self, *lines: str | None) -> None:
        """Print lines on stderr, None left out: progress, warnings, losses."""
        self._end_progress()
        for line in lines:
            if line is not None:
                self._print_error(harmless(line))

    def lose(self, reason: object) -> None:
        """Name the reason why a result, which may still be printed, is not kept; a verb that is done then has flaws."""
        self._lost_results = True
        self.note(f"not kept: {reason}")

    def exit_code(self, code: int) -> int:
        """Return the exit code of a verb that ended with `code`."""
        return FLAWED if code == DONE and self._lost_results else code

    def result(self, document: Mapping[str, Any]) -> None:
        """Print the one JSON document; left out where a person reads. NaN and infinity are refused by the format."""
        if self.as_json:
            self._end_progress()
            self._answer(json.dumps(document, indent=1, allow_nan=False))

    def progress(self, fraction: float, text: str, *, end_known: bool = True) -> None:
        """Show how far a long job is (`fraction` from 0 to 1): a bar on a terminal, else now and then a new line.

        The bar shows rate and time left where the end is known. A `fraction` below the last one begins another job.
        """
        now = time.monotonic()
        if fraction < self._fraction:
            self._start = now
        self._fraction = fraction
        terminal = self.at_terminal
        if now - self._last_line < (0.1 if terminal else 2.0) and fraction < 1:
            return
        self._last_line = now
        if terminal:
            self._print_error(f"\r\x1b[K{self._bar(harmless(text), now, end_known)}", end="")
        else:
            self._print_error(f"{100 * fraction:3.0f} %  {harmless(text)}")
        self._line_open = terminal

    def reporter(self, text: str, until: float = 1.0) -> Callable[[float], bool]:
        """Return what a long job calls with the part done (0 to 1), shown up to `until`; the answer is to go on."""

        def report(fraction: float) -> bool:
            self.progress(until * fraction, text)
            return True

        return report

    def counter(self, things: str, count: int) -> Callable[[float], None]:
        """Return what a long job calls with the part done of so many things."""
        return lambda fraction: self.progress(fraction, f"{round(fraction * count)} of {count} {things}")

    def _bar(self, text: str, now: float, end_known: bool) -> str:
        """Return the line of a terminal: part done, text, bar, and where the end is known rate and time left."""
        from tqdm import tqdm  # here: it takes longer to import than most verbs take to answer

        try:
            columns = os.get_terminal_size(self._err.fileno()).columns or _COLUMNS
        except (OSError, ValueError):
            columns = _COLUMNS
        return tqdm.format_meter(
            100.0 * self._fraction,
            100.0,
            now - self._start,
            ncols=max(columns - 1, 1),  # a full line would be broken by some terminals
            prefix=text,
            ascii=not (self._err.encoding or "").lower().startswith("utf"),
            unit="%",
            bar_format="{percentage:3.0f} %  {desc} |{bar}|" + (" {rate_fmt}, {remaining} left" if end_known else ""),
        )

    @contextmanager
    def working(self, text: str) -> Generator[Callable[[float], bool]]:
        """Show the task of work whose end nobody knows, once it has taken a second, and its time so far.

        Yields a callback that takes the part done (0 to 1), and always answers to go on. The solver's present task
        counts as half of what is left: the part shown moves on, and never back.
        """
        start, finish = time.monotonic(), threading.Event()
        underway = EndlessProgress(text)

        def reach(fraction: float) -> bool:
            underway.reach(fraction)
            return True

        def show() -> None:
            pause = _PATIENCE
            while not finish.wait(pause):
                text = f"{underway.task}, {time.monotonic() - start:.0f} s so far; Ctrl-C stops"
                self.progress(underway.fraction, text, end_known=False)
                pause = 0.2

        shower = threading.Thread(target=show, name="progress", daemon=True)
        shower.start()
        try:
            with listening(underway.hear):
                yield reach
        finally:
            finish.set()
            shower.join()

    def _answer(self, text: str) -> None:
        try:
            print(text, file=self._out, flush=True)
        except BrokenPipeError:
            raise
        except OSError as error:
            reason = (error.strerror or "refused").lower()
            raise NotWritten(
                f"the answer could not be written to standard output ({reason}); free space there, or send it elsewhere"
            ) from error

    def _print_error(self, text: str, end: str = "\n") -> None:
        """Print on stderr; where that is full, or nobody reads it any more, what is being done goes on."""
        with suppress(OSError):
            print(text, end=end, file=self._err, flush=True)

    def _end_progress(self) -> None:
        if self._line_open:
            self._print_error("")
            self._line_open = False


def point_advice(text: str) -> str:
    """Return what to add to what is allowed where somebody typed a comma before a fraction.

    >>> point_advice("'1,5'"), point_advice("1.5"), point_advice("1,5,2")
    (', its fraction behind a point', '', '')
    """
    return ", its fraction behind a point" if re.fullmatch(r"'?[+-]?\d*,\d+'?", text.strip()) else ""


class _Help(argparse.HelpFormatter):
    """Fills each paragraph of a text to the width of the terminal, but for those with indented lines."""

    def format_help(self) -> str:
        """Return the text; a usage line is broken between choices too, which argparse keeps on one line."""
        return "\n".join(map(self._break_choices, super().format_help().split("\n")))

    def _break_choices(self, line: str) -> str:
        words = line.replace(" ", "\0").replace("\0|\0", "\0| ")  # a line breaks at a space alone
        indent = " " * (len(line) - len(line.lstrip()) + 1)
        wrapper = textwrap.TextWrapper(self._width, break_long_words=False, break_on_hyphens=False)
        wrapper.subsequent_indent = indent
        return wrapper.fill(words).replace("\0", " ")

    def _fill_text(self, text: str, width: int, indent: str) -> str:  # noqa: ARG002  argparse's own
        paragraphs = text.strip().split("\n\n")
        return "\n\n".join(one if "\n  " in one else textwrap.fill(one, width) for one in paragraphs)


class Parser(argparse.ArgumentParser):
    """Tells what is wrong with a command line in one sentence, without printing how all of it is used."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:  # noqa: ANN401  argparse's own
        super().__init__(*args, **kwargs, formatter_class=_Help)
        # argparse's own takes -1e-3 and -inf for options
        self._negative_number_matcher = re.compile(r"-(\.?\d|inf$|nan$)", re.IGNORECASE)

    def error(self, message: str) -> NoReturn:
        """Raise WrongValue."""
        if wrong := re.fullmatch(r"argument (\S+): invalid (int|float) value: (.*)", message, re.DOTALL):
            number_kind = "a whole number" if wrong[2] == "int" else "a number"
            message = f"{wrong[1]} {wrong[3]} is not allowed: it must be {number_kind}{point_advice(wrong[3])}"
        raise WrongValue(f"{message}; '{self.prog} --help' explains")

    def print_help(self, file: object = None) -> None:  # noqa: ARG002  argparse's own
        """Print how a command line is used; argparse itself would say nothing where that cannot be written."""
        Console(as_json=False).say(self.format_help().rstrip())


def table(rows: list[list[str]], *, header: list[str]) -> str:
    """Return rows as aligned columns; the first column to the left, the others to the right.

    >>> print(table([["slip 0", "1.5"], ["slip 100", "12.0"]], header=["surface", "N"]))
    surface      N
    slip 0     1.5
    slip 100  12.0
    """
    lines = [header, *rows]
    widths = [max(len(line[i]) for line in lines) for i in range(len(header))]
    columns = [f"<{widths[0]}", *(f">{width}" for width in widths[1:])]
    texts = ("  ".join(map(format, line, columns)) for line in lines)
    return "\n".join(text.rstrip() for text in texts)
