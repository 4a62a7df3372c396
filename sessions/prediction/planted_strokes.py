"""Every quantity of simulated people's strokes, for studies whose answer is planted."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from solver import Friction
from solver.quantities import NAMES
from solver.response.receptor_row import rough_responses
from solver.scene.published import STICKINESS, scene

Array = NDArray[np.float64]

PERSON, STROKE = 0.08, 0.05  # standard deviation of ln mu between people, and from stroke to stroke [-]
PRESS = 0.2  # standard deviation of ln N from stroke to stroke [-]
AREA = 100.0  # of the contact [mm2]
USUAL_SPEED = 20.0  # [mm/s]
STIFFNESS = 1.2  # normal force by depth^1.5, as of Hertz's sphere: 3.4 N at 2 mm [N/mm^1.5]


@dataclass(frozen=True, slots=True)
class StudyDesign:
    """What each subject of a study strokes: every surface at every depth."""

    mu: tuple[float, ...]  # of each surface
    force: tuple[float, ...]  # usual normal force in each trial of a person, surface by surface within depths [N]
    speed: tuple[float, ...]  # likewise [mm/s]
    depths: tuple[float, ...] = (2.0,)  # [mm]

    @classmethod
    def even(cls, surfaces: int, depths: tuple[float, ...]) -> "StudyDesign":
        """Return a design whose friction is evenly spaced over that of the published surfaces."""
        mu = np.linspace(0.24, 0.67, surfaces).tolist()
        force = tuple(STIFFNESS * depth**1.5 for depth in depths for _ in mu)
        return cls(tuple(mu), force, (USUAL_SPEED,) * len(force), depths)


def planted_strokes(design: StudyDesign, people: int, draw: np.random.Generator) -> Mapping[str, Array]:
    """Return every quantity of one stroke in each trial (people, surfaces within depths); nan where there is none.

    Friction, its bound and the normal force vary from stroke to stroke. The quantities of the model are those of the
    published finger in settled sliding at that friction.
    """
    shape = (people, len(design.mu) * len(design.depths))
    moist = PERSON * draw.standard_normal((people, 1)) + STROKE * draw.standard_normal(shape)
    mu = np.tile(design.mu, len(design.depths)) * np.exp(moist)
    normal = np.array(design.force) * np.exp(PRESS * draw.standard_normal(shape))
    tau = mu * normal / AREA
    base = scene(STICKINESS[0])
    settled = replace(base.solve, course="steady")
    pressed = [replace(base.loading, indentation=d) for d in np.tile(np.repeat(design.depths, len(design.mu)), people)]
    scenes = [
        replace(base, friction=Friction(m, t), loading=loading, solve=settled)
        for m, t, loading in zip(mu.flat, tau.flat, pressed, strict=True)
    ]
    responses = rough_responses(scenes)[:, :, 0].reshape(*shape, len(NAMES))
    speed = np.array(design.speed) * np.exp(STROKE * draw.standard_normal(shape))
    own = {"mu": mu, "tau_max": tau, "N": normal, "speed": speed}
    return own | {name: responses[:, :, at] for at, name in enumerate(NAMES)}
