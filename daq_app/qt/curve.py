"""What a live plot shows."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Curve:
    """One curve of a plot."""

    channel: str
    colour: str  # a token's name, or a colour
    dashed: bool = False
    named: bool = True  # in the plot, where it has several
