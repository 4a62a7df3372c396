"""Settled SEDs of scenes, and those beside a prediction: what intervals, variants and many paths ask of the solver."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from sessions.prediction.options import PredictionOptions, bound, template
from sessions.prediction.scenes import SLIDES
from solver import Friction, Loading, Prediction, Scene, Solve, SolveFailure, solve_many
from solver.accuracy.audits import inside_out
from solver.progress import Progress, report_part
from solver.response.nearby import By, Nearby, nearby


def part_of(progress: Progress | None, low: float, high: float) -> Progress | None:
    """Return what reports the part done of a piece of work that reaches from `low` to `high` of the whole."""
    return None if progress is None else lambda done: progress(low + (high - low) * done)


def settled(scenes: Sequence[Scene], progress: Progress | None = None) -> tuple[Prediction | None, ...]:
    """Return what the solver finds of each scene, None where it finds no settled state. Raises Cancelled."""
    return tuple(None if isinstance(one, SolveFailure) else one for one in _answers(scenes, progress))


def solved(scenes: Sequence[Scene], progress: Progress | None = None) -> tuple[Prediction | str, ...]:
    """Return what the solver finds of each scene, or why it finds no settled state. Raises Cancelled."""
    return tuple(str(one) if isinstance(one, SolveFailure) else one for one in _answers(scenes, progress))


def _answers(scenes: Sequence[Scene], progress: Progress | None) -> tuple[Prediction | SolveFailure, ...]:
    return solve_many([quick(scene) for scene in scenes], progress)


def quick(scene: Scene) -> Scene:
    """Return a scene whose evidence nobody will read: to march it takes as long as the answer."""
    return replace(scene, solve=replace(scene.solve, evidence="quick"))


def seds_at(
    strokes: Sequence[tuple[float, float, float, int, float]], options: PredictionOptions
) -> tuple[float | None, ...]:
    """Return the settled SED [MPa] of the options' finger for each mu, tau_max [MPa], depth [mm], direction and speed.

    None where there is no settled state.
    """
    base = template(options)
    course = Solve(options.kinematics, "steady", base.solve.tolerance)
    scenes = [
        replace(
            base,
            friction=Friction(mu, bound(tau_max, options)),
            loading=Loading(depth, SLIDES[direction], speed),
            solve=course,
        )
        for mu, tau_max, depth, direction, speed in strokes
    ]
    return tuple(None if one is None else one.sed_ending for one in settled(scenes))


def slides(predictions: Sequence[Prediction], progress: Progress | None = None) -> Iterator[Nearby | None]:
    """Yield the slide of each prediction, from which others and derivatives are a few small systems away.

    None where there is none that does not depend on the way to it. Raises Cancelled.
    """
    for number, slide in enumerate(nearby(predictions)):
        report_part(progress, number / len(predictions))
        yield slide


def derivatives_by(slide: Nearby, scene: Scene) -> Mapping[str, Mapping[str, float]]:
    """Return the derivatives, by each load that `with_loads` knows, at the slide of a scene.

    They are those of "sed" [MPa], of the whole finger's "normal_force" and "tangential_force" [N], and of the
    "indentation" [mm].
    """
    derivatives, force, width = slide.derivatives(), scene.loading.normal_force, scene.finger.width
    per_mm = 0.0 if force is None else (scene.normal_force or 0.0) / force  # of a force as it is given

    def by(one: By, unit: float = 1.0) -> dict[str, float]:
        return {"mu": unit * one.mu, "tau_max": unit * one.tau_max, "force": unit * per_mm * (one.normal_force or 0.0)}

    return {
        "sed": by(derivatives.sed),
        "normal_force": by(derivatives.normal, width),
        "tangential_force": by(derivatives.tangential, width),
        "indentation": by(derivatives.indentation),
    }


def traction_reached(prediction: Prediction) -> float:
    """Return the greatest friction traction on the skin [MPa]: any tau_max beyond it has the same solution."""
    return float(abs(prediction.skin.traction).max())


def doubt_of(prediction: Prediction) -> str:
    """Return why numbers are not to be believed where the model was driven beyond its range, else ""."""
    return inside_out(prediction.audits)
