"""Light touches against Hertz: a cylinder of the tip's radius on an epidermis far thicker than the contact."""

from dataclasses import dataclass, replace
from functools import cache
from math import log, pi, sqrt

from solver.failures import SolveFailure
from solver.prediction import Prediction
from solver.response.solution import solve_many
from solver.scene import Scene
from solver.verification.hard_cases.outcome import Outcome, of_answer

RESOLVABLE = 1e-3  # indentation with many elements in contact, but far smaller than the epidermis [mm]
_MODEL = 0.005  # change of both laws by the rest of the finger, between this indentation and lighter touches


@dataclass(frozen=True, slots=True)
class Touch:
    """Theoretical values of a light touch."""

    force: float  # [N/mm]
    sed: float  # [MPa]
    width: float  # of the contact [mm]


def of_light_touch(scene: Scene) -> Outcome:
    """Solve a scene of a light touch; SED, normal force and width must agree with Hertz within their estimates."""
    (answer,) = solve_many([scene])
    outcome = of_answer(answer)
    if not isinstance(answer, Prediction):
        return outcome
    true = hertz(scene)
    pairs = (
        ("SED", answer.sed_ending, true.sed, answer.error_estimate),
        ("N", answer.normal_force, true.force, answer.normal_force_error or 0.0),
        ("width", answer.contact_width, true.width, answer.contact_width_error or 0.0),
    )
    far = [
        f"{name} {abs(number / exact - 1.0):.1%} from Hertz's"
        for name, number, exact, off in pairs
        if abs(number - exact) > off * number + _MODEL * exact
    ]
    flaws = ", ".join(flaw for flaw in (outcome.flaw, *far) if flaw)
    summary = (
        f"{outcome.summary}; SED by Hertz {true.sed:.4g}, width {answer.contact_width:.3g} by Hertz {true.width:.3g}"
    )
    return replace(outcome, flaw=flaws, summary=summary)


def hertz(scene: Scene) -> Touch:
    """Return Hertz's values at the depth of a scene (Johnson 1985, eqs 4.43 to 4.45 and 5.56).

    The half-width is sqrt(4 N R / (pi E*)). As the force N per mm of width falls, d / N grows by ln(1 / N) / (pi E*).
    The finger behind the contact adds a constant to d / N. The ratio of SED to force squared is another constant. Both
    come from a deeper touch, which every mesh resolves.
    """
    from scipy.optimize import brentq  # slow to load, and only light touches use it

    skin = scene.materials.of("epidermis")
    modulus = skin.E / (1.0 - skin.nu**2)
    yields, response = _finger(replace(scene, loading=replace(scene.loading, indentation=RESOLVABLE)))
    offset = yields[0] / yields[1] + log(yields[1]) / (pi * modulus)

    def too_deep(power: float) -> float:
        force = 10.0**power
        return force * (offset - log(force) / (pi * modulus)) - scene.loading.depth

    force = 10.0 ** float(brentq(too_deep, -20.0, 0.0))
    return Touch(force, response * force**2, 2.0 * sqrt(4.0 * force * scene.finger.tip_radius / (pi * modulus)))


@cache
def _finger(deeper: Scene) -> tuple[tuple[float, float], float]:
    """Return depth [mm] and force [N/mm] of a touch, and its SED over the force squared [mm^2/(N^2) MPa]."""
    (answer,) = solve_many([deeper])
    if isinstance(answer, SolveFailure):
        raise answer
    force = answer.normal_force
    return (deeper.loading.depth, force), answer.sed_ending / force**2
