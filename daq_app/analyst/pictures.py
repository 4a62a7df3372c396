"""The model's finger, its states turned to what the window paints."""

from collections.abc import Callable, Sequence

import numpy as np

from daq_app.analyst.frame import Contact, Film, Finger, Frame, Instant
from sessions.prediction import Way
from solver.failures import Cancelled
from solver.fields import Fields, Sketch, fields_of
from solver.film import Still, most_squeezed, stills, way_until
from solver.prediction import Prediction, Skin
from solver.receptor import ROW
from solver.stepping import Instant as Step

AT_ONCE = 8  # states that are drawn before progress is told
Told = Callable[[float], bool]


def finger_of(prediction: Prediction, sketch: Sketch) -> Finger:
    """Return the settled finger of a prediction."""
    drawn = fields_of(prediction, sketch)
    return Finger(drawn.triangles, _frame(drawn, prediction.skin, prediction.row.sed), prediction.row.arc)


def film_of(way: Way, instants: Sequence[Step], sketch: Sketch, told: Told) -> Film:
    """Return the states of a way. Raises Cancelled where `told` returns False."""
    made: list[Still] = []
    for begin in range(0, len(instants), AT_ONCE):
        made += stills(way.finger, instants[begin : begin + AT_ONCE], sketch)
        if not told(min(1.0, (begin + AT_ONCE) / len(instants))):
            raise Cancelled
    frames = tuple(_frame(still.fields, still.skin, still.row) for still in made)
    return Film(sketch.triangles, frames, tuple(_instant(still) for still in made), ROW)


def lost_film(way: Way, sketch: Sketch, told: Told) -> tuple[Film, str]:
    """Return the states up to where a solve that has no answer came, and what stopped it there."""
    instants, failure = way_until(way.scene, way.finger, told)
    film = film_of(way, instants, sketch, told)
    if failure is None:
        return film, ""
    last = instants[-1]
    lost = most_squeezed(way.finger, last.contact, last.depth)
    return Film(film.triangles, film.frames, film.instants, film.arcs, lost), str(failure.in_a_sentence())


def _frame(drawn: Fields, skin: Skin, row: "np.ndarray[tuple[int], np.dtype[np.float64]]") -> Frame:
    contact = Contact(skin.x, skin.gap, skin.pressure, skin.traction, skin.state)
    return Frame(drawn.nodes, drawn.sed, dict(drawn.outlines), drawn.patch, contact, row)


def _instant(still: Still) -> Instant:
    at, contact = still.instant, still.instant.contact
    states = still.skin.state
    return Instant(
        at.time,
        at.depth,
        at.travel,
        still.sed,
        float(contact.normal.sum()),
        float(contact.tangential.sum()),
        sum(state == "stick" for state in states),
        sum(state in ("slip", "cap") for state in states),
    )
