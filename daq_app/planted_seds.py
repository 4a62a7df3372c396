"""What the model says at the friction that was planted in a simulated study: the truth of its headline."""

from collections.abc import Mapping, Sequence
from typing import Any

from sessions.analysis.area import FIXED, AreaLaw
from sessions.prediction import PredictionOptions, seds_at


def with_seds(
    strokes: Sequence[Mapping[str, Any]], options: PredictionOptions, area: AreaLaw
) -> list[Mapping[str, Any]]:
    """Return the planted strokes, each with the SED [MPa] that the model gives at its planted friction.

    Those of the published finger, which simulated people have; none where a law of the area tells another tau_max than
    the planted one, and none at finite strain, where most sticky surfaces have no settled slide.
    """
    if options.kinematics == "finite" or area != FIXED:
        return list(strokes)
    names = ("mu", "tau_max", "indentation", "direction", "speed")
    loads = [tuple(stroke[name] for name in names) for stroke in strokes]
    return [{**stroke, "sed": sed} for stroke, sed in zip(strokes, seds_at(loads, options), strict=True)]
