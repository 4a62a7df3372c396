"""The plan of the paper's two experiments, and what an analysis says that found given friction in them."""

from sessions.plan.plan import Block, Frame, SessionPlan, Stimulus, Trial
from sessions.strokes import Analysis, AnalysisSettings, FrictionParameters, Stroke
from solver.scene.published import INDENTATION, SLIPPERINESS, STICKINESS

PLAN = SessionPlan(
    protocol="sensotact-friction",
    subject="P01",
    seed=1,
    order_rule="as listed",
    blocks=tuple(
        Block(
            name=surfaces[0].descriptor,
            instruction="Stroke.",
            direction=direction,
            indentation=INDENTATION[surfaces[0].descriptor],
            scale_ends=("none", "most"),
            trials=tuple(
                Trial(first + n, surfaces[0].descriptor, Stimulus(s.descriptor, s.index, f"K{first + n}"), direction, 1)
                for n, s in enumerate(surfaces)
            ),
        )
        for surfaces, direction, first in ((STICKINESS, 1, 1), (SLIPPERINESS, -1, 6))
    ),
    forces=True,
    frame=Frame(),
)
NORMAL_FORCE = 2.5  # N


def stroke(trial, **fields):
    empty = dict.fromkeys(Stroke.__dataclass_fields__)
    basics = {"trial": trial, "readings": 100, "zero": "before contact", "flaws": (), "reasons": {}, "number": 1}
    basics |= {"kept": True, "decided": {}}
    return Stroke(**(empty | basics | {"normal_force": NORMAL_FORCE, "tangential_force": 1.2} | fields))


def parameters(trial, mu, tau_max, direction, speed=20.0, flaws=()):
    at = 0 if trial is None else trial - 1
    return FrictionParameters(trial, at, mu, None, tau_max, 100.0, speed, direction, "maximum", flaws)


def analysis(friction, strokes):
    return Analysis(True, tuple(strokes), tuple(friction), (), "none", AnalysisSettings())
