"""Output of a verb for people or for scripts, and the parser of its command line."""

import argparse
import io
import json
import os
import re
import sys
import textwrap
import threading
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any, NoReturn, TextIO

from solver.progress import listening

DONE, FAILED, WRONG, FLAWED, STOPPED = 0, 1, 2, 3, 130  # exit codes
_OUR_OWN = ("daq_app", "drivers", "sessions", "simulators", "solver")  # packages
_COLUMNS = 80  # of a terminal that does not report its width
_PATIENCE = 1.0  # before people want to see progress [s]


@dataclass(slots=True)
class EndlessProgress:
    """Progress of work of unknown length: its present task counts as half of the remainder."""

    task: str
    fraction: float = 0.0  # of the whole, as shown
    _start: float = 0.0  # the part of the whole when its task began

    def hear(self, task: str, fraction: float) -> None:
        """Take the name of the present task, and the fraction of it that is done."""
        if task != self.task:
            self.task, self._start = task, self.fraction
        self.reach(self._start + 0.5 * fraction * (1.0 - self._start))

    def reach(self, fraction: float) -> bool:
        """Advance to this fraction of the whole, at most 99 %, and never back; return True."""
        self.fraction = max(self.fraction, min(fraction, 0.99))
        return True


class WrongValue(Exception):
    """The command line or a value in a file was wrong: exit code 2."""


class RecordingKept(KeyboardInterrupt):
    """A stop or a crash ended work that had already recorded data; the message names the folder (exit code 3).

    A script gets a document with the `kind` of the end, the message, and the verb's own keys in `document`.
    """

    def __init__(self, message: str, kind: str, **document: object) -> None:
        super().__init__(message)
        self.document = {**document, "error": {"kind": kind, "message": message}}


class NotWritten(Exception):
    """The output could not be written: why, where, and what to do."""


def is_ours(module: str) -> bool:
    """Say whether a module is the program's own; the messages of its exceptions are sentences for people."""
    return module.partition(".")[0] in _OUR_OWN


def accept_any_text(*streams: TextIO) -> None:
    """Let each stream escape characters that its encoding lacks, so that no answer is lost to a dash."""
    for stream in streams:
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def harmless(text: str) -> str:
    r"""Escape the control characters of a text, which a terminal would obey.

    >>> print(harmless("a\x1b[31mb"))
    a\x1b[31mb
    """
    return re.sub(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]", lambda match: f"\\x{ord(match[0]):02x}", text)


class Console:
    """Writes text for people to stdout, or one JSON document there and everything else to stderr."""

    def __init__(self, *, as_json: bool, out: TextIO | None = None, err: TextIO | None = None) -> None:
        """Write for people, or with `as_json` for scripts."""
        self.as_json = as_json
        self._out = out or sys.stdout
        self._err = err or sys.stderr
        self._last_line = 0.0
        self._start = 0.0  # of the job whose progress is shown [s]
        self._fraction = 1.0  # of that job
        self._line_open = False
        self._lost_results = False

    @property
    def at_terminal(self) -> bool:
        """Say whether people see progress as a moving bar, with the time left."""
        return self._err.isatty()

    def say(self, *lines: str | None) -> None:
        """Print lines for people, without None; nothing if a script reads."""
        if not self.as_json:
            self._end_progress()
            for line in lines:
                if line is not None:
                    self._answer(harmless(line))

    def note(self, *lines: str | None) -> None:
        """Print lines on stderr, without None: progress, warnings, losses."""
        self._end_progress()
        for line in lines:
            if line is not None:
                self._print_error(harmless(line))

    def lose(self, sentence: str) -> None:
        """Print that a result or a setting is lost; the exit code is then that of flaws."""
        self._lost_results = True
        self.note(sentence)

    def exit_code(self, code: int) -> int:
        """Return the exit code of a verb that ended with `code`."""
        return FLAWED if code == DONE and self._lost_results else code

    def result(self, /, **document: object) -> None:
        """Print the one JSON document, or nothing if a person reads. The format refuses NaN and infinity."""
        if self.as_json:
            self._end_progress()
            self._answer(json.dumps(document, indent=1, allow_nan=False))

    def progress(self, fraction: float, text: str, *, end_known: bool = True) -> None:
        """Show how far a long job is (`fraction` from 0 to 1): a bar on a terminal, else an occasional new line.

        The bar shows rate and time left if the end is known. A `fraction` below the last one begins another job.
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
        """Return a callback that takes the fraction done (0 to 1), shows it up to `until`, and returns True."""

        def report(fraction: float) -> bool:
            self.progress(until * fraction, text)
            return True

        return report

    def counter(self, things: str, count: int) -> Callable[[float], None]:
        """Return a callback that takes the fraction done and shows it as a number of `count` things."""
        return lambda fraction: self.progress(fraction, f"{round(fraction * count)} of {count} {things}")

    def _bar(self, text: str, now: float, end_known: bool) -> str:
        """Return a terminal's line: fraction done, text, bar, and if the end is known, rate and time left."""
        from tqdm import tqdm  # slower to import than most verbs are to answer

        try:
            columns = os.get_terminal_size(self._err.fileno()).columns or _COLUMNS
        except (OSError, ValueError):
            columns = _COLUMNS
        return tqdm.format_meter(
            100.0 * self._fraction,
            100.0,
            now - self._start,
            ncols=max(columns - 1, 1),  # some terminals would wrap a full line
            prefix=text,
            ascii=not (self._err.encoding or "").lower().startswith("utf"),
            unit="%",
            bar_format="{percentage:3.0f} %  {desc} |{bar}|" + (" {rate_fmt}, {remaining} left" if end_known else ""),
        )

    @contextmanager
    def working(self, text: str) -> Generator[Callable[[float], bool]]:
        """Show the task of work of unknown length, once it has taken a second, and its time so far.

        Yields a callback that takes the fraction done (0 to 1) and always returns True. The solver's present task
        counts as half of the remainder: the fraction shown never decreases.
        """
        start, finish = time.monotonic(), threading.Event()
        underway = EndlessProgress(text)

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
                yield underway.reach
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
        """Print on stderr; if that is full or closed, the work continues."""
        with suppress(OSError):
            print(text, end=end, file=self._err, flush=True)

    def _end_progress(self) -> None:
        if self._line_open:
            self._print_error("")
            self._line_open = False


def point_advice(text: str) -> str:
    """Return advice to add to an error message where somebody typed a decimal comma, else an empty text.

    >>> point_advice("'1,5'"), point_advice("1.5"), point_advice("1,5,2")
    (', with a decimal point', '', '')
    """
    return ", with a decimal point" if re.fullmatch(r"'?[+-]?\d*,\d+'?", text.strip()) else ""


class _Help(argparse.HelpFormatter):
    """Wraps each paragraph of a text to the terminal's width, except those with indented lines."""

    def format_help(self) -> str:
        """Return the text; a usage line is wrapped between choices too, which argparse keeps on one line."""
        return "\n".join(map(self._break_choices, super().format_help().split("\n")))

    def _break_choices(self, line: str) -> str:
        words = line.replace(" ", "\0").replace("\0|\0", "\0| ")  # lines wrap at spaces only
        indent = " " * (len(line) - len(line.lstrip()) + 1)
        wrapper = textwrap.TextWrapper(self._width, break_long_words=False, break_on_hyphens=False)
        wrapper.subsequent_indent = indent
        return wrapper.fill(words).replace("\0", " ")

    def _fill_text(self, text: str, width: int, indent: str) -> str:  # noqa: ARG002  argparse's own
        paragraphs = text.strip().split("\n\n")
        return "\n\n".join(one if "\n  " in one else textwrap.fill(one, width) for one in paragraphs)


class Parser(argparse.ArgumentParser):
    """Reports an error in a command line in one sentence, without the whole usage text."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:  # noqa: ANN401  argparse's own
        super().__init__(*args, **kwargs, formatter_class=_Help)
        # argparse's own pattern takes -1e-3 and -inf for options
        self._negative_number_matcher = re.compile(r"-(\.?\d|inf$|nan$)", re.IGNORECASE)

    def error(self, message: str) -> NoReturn:
        """Raise WrongValue."""
        if wrong := re.fullmatch(r"argument (\S+): invalid (int|float) value: (.*)", message, re.DOTALL):
            number_kind = "a whole number" if wrong[2] == "int" else "a number"
            message = f"{wrong[1]} {wrong[3]} is not allowed: it must be {number_kind}{point_advice(wrong[3])}"
        raise WrongValue(f"{message}; '{self.prog} --help' explains")

    def print_help(self, file: object = None) -> None:  # noqa: ARG002  argparse's own
        """Print the help; argparse itself ignores output that cannot be written."""
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
