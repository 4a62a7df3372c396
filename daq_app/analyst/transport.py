"""What plays, stands or is sought: the course of a replay or of an animation, against the window's clock."""

from dataclasses import dataclass, replace

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0)


@dataclass(frozen=True, slots=True)
class Transport:
    """A place between two instants, and whether it moves."""

    first: float  # [s]
    last: float  # [s]
    place: float  # where it stood at `since` [s]
    speed: float = 1.0  # session seconds in a real one
    since: float | None = None  # when it began to move [s, window's clock]; None: it stands

    @property
    def playing(self) -> bool:
        """Say whether it moves."""
        return self.since is not None

    def at(self, now: float) -> float:
        """Return where it is [s]; it does not go beyond its end.

        >>> Transport(0.0, 5.0, 1.0, speed=2.0, since=100.0).at(101.0), Transport(0.0, 5.0, 1.0).at(101.0)
        (3.0, 1.0)
        """
        moved = 0.0 if self.since is None else (now - self.since) * self.speed
        return min(max(self.place + moved, self.first), self.last)

    def ended(self, now: float) -> bool:
        """Say whether it has come to its end."""
        return self.playing and self.at(now) >= self.last

    def played(self, now: float) -> "Transport":
        """Return it moving; from its beginning where it stood at its end."""
        at = self.at(now)
        return replace(self, place=self.first if at >= self.last else at, since=now)

    def paused(self, now: float) -> "Transport":
        """Return it standing where it is."""
        return replace(self, place=self.at(now), since=None)

    def sought(self, place: float, now: float) -> "Transport":
        """Return it at another place, moving where it moved."""
        inside = min(max(place, self.first), self.last)
        return replace(self, place=inside, since=now if self.playing else None)

    def at_speed(self, speed: float, now: float) -> "Transport":
        """Return it with another speed, from where it is on."""
        return replace(self, place=self.at(now), speed=speed, since=now if self.playing else None)
