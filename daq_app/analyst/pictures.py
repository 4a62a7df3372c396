"""The model's finger, its states turned to what the window paints."""

from collections.abc import Callable, Sequence

import numpy as np

from daq_app.analyst.frame import Film, Finger, Frame, Instant, Parts
from sessions.prediction.predicting import Way
from sessions.report.contents import Field
from solver import Cancelled, Prediction
from solver.equilibrium.load_path import Instant as Step
from solver.prediction import ROW, Skin
from solver.quantities import SED
from solver.response.fields import Fields, Sketch, Still, fields_of, place_of_least_stretch, stills, way_until

MOST = 150  # states of a way that did not settle, which may be long
AT_ONCE = 8  # states that are drawn between two reports of progress
Progress = Callable[[float], bool]


def finger_of(prediction: Prediction, sketch: Sketch) -> Finger:
    """Return the settled finger of a prediction."""
    drawn = fields_of(prediction, sketch)
    return Finger(_parts(sketch), _frame(drawn, prediction.skin, prediction.row.sed), prediction.row.arc)


def film_of(way: Way, instants: Sequence[Step], sketch: Sketch, progress: Progress) -> Film:
    """Return the states of a way. Raises Cancelled where `progress` returns False."""
    pictures: list[Still] = []
    for begin in range(0, len(instants), AT_ONCE):
        pictures += stills(way.finger, instants[begin : begin + AT_ONCE], sketch)
        if not progress(min(1.0, (begin + AT_ONCE) / len(instants))):
            raise Cancelled
    frames = tuple(_frame(still.fields, still.skin, still.row) for still in pictures)
    return Film(_parts(sketch), frames, tuple(_instant(still) for still in pictures), ROW)


def lost_film(way: Way, sketch: Sketch, progress: Progress) -> tuple[Film, str]:
    """Return the states up to where a solve that has no answer came, and what stopped it there."""
    instants, failure = way_until(way.scene, way.finger, progress)
    every = max(1, -(-len(instants) // MOST))
    film = film_of(way, [*instants[:-1:every], instants[-1]], sketch, progress)
    if failure is None:
        return film, ""
    last = instants[-1]
    lost = place_of_least_stretch(way.finger, last.state, last.depth)
    return Film(film.parts, film.frames, film.instants, film.arcs, lost), str(failure.in_a_sentence())


def field_at(experiment: str, index: int, film: Film, at: int) -> Field:
    """Return one state of a film as the figures of a report draw it."""
    frame = film.frames[at]
    contact = frame.contact
    return Field(
        experiment=experiment,
        index=index,
        nodes=_pairs(frame.nodes),
        triangles=tuple((int(a), int(b), int(c)) for a, b, c in film.parts.triangles),
        sed=tuple(frame.values[SED.name].tolist()),
        outlines={name: _pairs(line) for name, line in frame.outlines.items()},
        patch=_pairs(frame.patch),
        contact=_pairs(np.column_stack([contact.x, contact.gap])),
        pressure=tuple(contact.pressure.tolist()),
        traction=tuple(contact.traction.tolist()),
        state=contact.state,
    )


def _pairs(points: "np.ndarray[tuple[int, ...], np.dtype[np.float64]]") -> tuple[tuple[float, float], ...]:
    return tuple((float(x), float(y)) for x, y in points)


def _parts(sketch: Sketch) -> Parts:
    return Parts(sketch.triangles, sketch.elements, sketch.region, sketch.skin)


def _frame(drawn: Fields, skin: Skin, row: "np.ndarray[tuple[int], np.dtype[np.float64]]") -> Frame:
    return Frame(drawn.nodes, dict(drawn.values), dict(drawn.outlines), drawn.patch, skin, row)


def _instant(still: Still) -> Instant:
    at, force = still.instant, still.instant.state.force
    states = still.skin.state
    sticking, slipping = states.count("stick"), states.count("slip") + states.count("cap")
    return Instant(at.time, at.depth, at.travel, still.sed, float(force[1]), float(force[0]), sticking, slipping)
