"""Progress reports of the solver, since the duration of a hard scene is unknown.

with listening(lambda doing, part: print(f"{doing}: {part:.0%} of it")):
    solve(scene)
"""

from collections.abc import Callable, Generator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass


class Cancelled(Exception):
    """The caller stopped the solve."""


Listener = Callable[[str, float], None]  # called with the current work, and the part of it done, 0 to 1
Progress = Callable[[float], bool | None]  # called with the part done, 0 to 1; returns False to stop the work


@dataclass(slots=True)
class _Audience:
    """The listener and the last report."""

    listener: Listener
    doing: str = ""


@dataclass(slots=True)
class _Caller:
    """The callback of a caller, and the last part of the work that it was told."""

    progress: Progress | None
    part: float = 0.0


_AUDIENCE: ContextVar[_Audience | None] = ContextVar("audience", default=None)
_CALLER: ContextVar[_Caller | None] = ContextVar("caller", default=None)


@contextmanager
def listening(listener: Listener) -> Generator[None]:
    """Send the progress reports of this thread to `listener` until the block ends."""
    token = _AUDIENCE.set(_Audience(listener))
    try:
        yield
    finally:
        _AUDIENCE.reset(token)


def report_progress(doing: str, part: float = 0.0) -> None:
    """Report the current work, and the `part` of it done, 0 to 1.

    >>> heard = []
    >>> with listening(lambda doing, part: heard.append((doing, part))):
    ...     report_progress("following sliding to its largest friction", 0.25)
    >>> report_progress("to nobody")
    >>> heard
    [('following sliding to its largest friction', 0.25)]
    """
    audience = _AUDIENCE.get()
    if audience is not None:
        audience.doing = doing
        audience.listener(doing, part)


@contextmanager
def interruptible(progress: Progress | None) -> Generator[None]:
    """Let `check_stop` call `progress` in this thread, until the block ends."""
    token = _CALLER.set(_Caller(progress))
    try:
        yield
    finally:
        _CALLER.reset(token)


def check_stop(part: float | None = None) -> None:
    """Raise Cancelled where the caller stops the solve; `part` is the part of the work done, None for no change.

    Code calls it between any two steps that take long.
    """
    caller = _CALLER.get()
    if caller is not None:
        caller.part = caller.part if part is None else part
        report_part(caller.progress, caller.part)


def report_part(progress: Progress | None, part: float) -> None:
    """Call `progress`, if there is one, with the part done. Raises Cancelled where it returns False, and not None."""
    if progress is not None and progress(part) is False:
        raise Cancelled("the caller stopped the solve")


@contextmanager
def interlude(doing: str) -> Generator[None]:
    """Report other work until the block ends; then repeat the previous report, or "solving" where there was none.

    >>> heard = []
    >>> with listening(lambda doing, part: heard.append(doing)):
    ...     with interlude("compiling"):
    ...         pass
    ...     report_progress("estimating", 0.5)
    ...     with interlude("compiling"):
    ...         pass
    >>> heard
    ['compiling', 'solving', 'estimating', 'compiling', 'estimating']
    """
    audience = _AUDIENCE.get()
    previous = (audience.doing if audience is not None else "") or "solving"
    report_progress(doing)
    try:
        yield
    finally:
        report_progress(previous)
