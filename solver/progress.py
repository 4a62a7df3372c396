"""What the solver is at, told by the way to whoever listens, since nobody knows how long a hard scene takes.

with listening(lambda doing, part: print(f"{doing}: {part:.0%} of it")):
    solve(scene)
"""

from collections.abc import Callable, Generator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

Listener = Callable[[str, float], None]  # told what is being done, and which part of that is done, 0 to 1


@dataclass(slots=True)
class _Told:
    """Who listens, and what was said last."""

    listener: Listener
    doing: str = ""


_TOLD: ContextVar[_Told | None] = ContextVar("told", default=None)


@contextmanager
def listening(listener: Listener) -> Generator[None]:
    """Let `listener` hear what the solver is at in this thread, until the block ends."""
    before = _TOLD.set(_Told(listener))
    try:
        yield
    finally:
        _TOLD.reset(before)


def report_progress(doing: str, part: float = 0.0) -> None:
    """Say what is being done, and which part of it is done.

    >>> heard = []
    >>> with listening(lambda doing, part: heard.append((doing, part))):
    ...     report_progress("following sliding to its largest friction", 0.25)
    >>> report_progress("to nobody")
    >>> heard
    [('following sliding to its largest friction', 0.25)]
    """
    told = _TOLD.get()
    if told is not None:
        told.doing = doing
        told.listener(doing, part)


@contextmanager
def aside(doing: str) -> Generator[None]:
    """Say what is done in between, until the block ends; then again what was said before.

    >>> heard = []
    >>> with listening(lambda doing, part: heard.append(doing)):
    ...     report_progress("solving", 0.5)
    ...     with aside("compiling"):
    ...         pass
    >>> heard
    ['solving', 'compiling', 'solving']
    """
    told = _TOLD.get()
    before = told.doing if told is not None else ""
    report_progress(doing)
    try:
        yield
    finally:
        if before:
            report_progress(before)
