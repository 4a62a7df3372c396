"""What simulated people will have done, each event at its time."""

from drivers.clock import Clock
from sessions.run.steps import Event


class DueEvents:
    """Events that come up when their time has come, in the order they were put in."""

    def __init__(self, clock: Clock) -> None:
        """Tell time by `clock`."""
        self.clock = clock
        self._due: list[tuple[int, Event]] = []  # session clock [ns]

    def put(self, event: Event, after: float = 0.0) -> None:
        """Let an event come up in `after` seconds of the clock."""
        self._due.append((self.clock.now_ns() + int(after * 1e9), event))

    def poll(self) -> tuple[Event, ...]:
        """Return what has come up by now, once."""
        now_ns = self.clock.now_ns()
        done = tuple(event for due, event in self._due if due <= now_ns)
        self._due = [(due, event) for due, event in self._due if due > now_ns]
        return done
