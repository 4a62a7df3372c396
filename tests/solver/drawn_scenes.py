"""Scenes drawn at random for the tests of estimates, each with its truth from far finer meshes (`drawn_scenes.csv`)."""

import csv
from pathlib import Path


def _rows(name):
    """Yield kinematics, depth, mu, bound, slide, angle, moduli and truth of each scene of a set."""
    lines = Path(__file__).with_suffix(".csv").read_text().splitlines()
    for set_name, kinematics, *numbers in csv.reader(line for line in lines if not line.startswith("#")):
        if set_name == name:
            depth, mu, bound, slide, angle, *rest = (
                n if n in ("+x", "-x") else float(n) if n else None for n in numbers
            )
            yield kinematics, depth, mu, bound, slide, angle, tuple(rest[:3]), tuple(rest[3:])


RANDOM = tuple(row[1:] for row in _rows("drawn"))
HELD_OUT = tuple(_rows("held out"))
DECEIVING = tuple(row[1:] for row in _rows("deceiving"))
