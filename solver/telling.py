"""What the solver is at, told by the way to whoever listens, since nobody knows how long a hard scene takes.

with listening(lambda doing, part: print(f"{doing}: {part:.0%} of it")):
    solve(scene)
"""

from collections.abc import Callable, Generator
from contextlib import contextmanager
from contextvars import ContextVar

Listener = Callable[[str, float], None]  # told what is being done, and which part of that is done, 0 to 1
_LISTENER: ContextVar[Listener | None] = ContextVar("listener", default=None)


@contextmanager
def listening(listener: Listener) -> Generator[None]:
    """Let `listener` hear what the solver is at in this thread, until the block ends."""
    before = _LISTENER.set(listener)
    try:
        yield
    finally:
        _LISTENER.reset(before)


def tell(doing: str, part: float = 0.0) -> None:
    """Say what is being done, and which part of it is done.

    >>> heard = []
    >>> with listening(lambda doing, part: heard.append((doing, part))):
    ...     tell("following sliding to its largest friction", 0.25)
    >>> tell("to nobody")
    >>> heard
    [('following sliding to its largest friction', 0.25)]
    """
    listener = _LISTENER.get()
    if listener is not None:
        listener(doing, part)
