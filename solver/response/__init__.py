"""Solutions of scenes, and their predictions: results with error estimates, skin, history and omitted effects."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from solver._kernels.contact_system import bounded_length
from solver.accuracy import audits
from solver.accuracy.error_estimate import SHIFT, Steps, errors, row_errors
from solver.accuracy.omitted_effects import Answer, model, warnings
from solver.arrays import Array
from solver.body import Patches
from solver.contact import STATE_NAMES
from solver.continuation.small_states import expected_depth
from solver.equilibrium import EquilibriumState, Newton
from solver.equilibrium.finger import Finger, LinearFinger
from solver.equilibrium.load_path import Instant, LoadPath
from solver.failures import NotConverged
from solver.mesh import Fineness
from solver.prediction import FORCES_AND_PLACES, ROW, History, NestedNumbers, Prediction, Row, Skin, drag
from solver.quantities import NAMES, SED
from solver.scene import Scene

# Elements per tip radius of the first mesh. At finite strain, skin folds on a mesh of 3 under steep friction; 5 takes a
# tenth less time to 1 % and a fifth more to 0.1 %. At small strain 3 and 5 take as long to 1 %.
FIRST_FINENESS = 4.0


@dataclass(frozen=True, slots=True, eq=False)
class SceneSolution:
    """The state of a scene on one mesh."""

    scene: Scene
    state: EquilibriumState
    displacement: Array  # (nodes, 2) [mm]
    audits: dict[str, float]
    steps: Steps | None  # where the state depends on its load path
    path: LoadPath | None  # the load path, where the scene requests it
    warnings: tuple[str, ...] = ()  # of its kinematics
    wall_s: float = 0.0
    setup_s: float = 0.0

    @property
    def elastic_path(self) -> tuple[Instant, ...] | None:
        """The load path, where no tissue relaxes, so that forces alone determine its pictures."""
        return None if self.path is None or self.path.tissue is not None else tuple(self.path.instants)


def prediction(
    solution: SceneSolution,
    finger: Finger[Patches],
    numbers: Array,
    row: Array,
    nested: NestedNumbers | NotConverged,
    estimate_s: float,
) -> Prediction:
    """Return the prediction of a state from its `numbers` (COUNT,) and the SED (r,) of the row of receptors [MPa]."""
    scene, state = solution.scene, solution.state
    sed, normal, tangential, depth, shift, width, point = numbers[:FORCES_AND_PLACES].tolist()
    driven = scene.driven(depth)
    entry = model(driven, finger, state, solution.displacement, width)
    has_shift = scene.loading.dragged and state.load.path_dependent  # the shift of a sliding finger is arbitrary
    numbers[SHIFT] = shift if has_shift else 0.0
    unknown = nested if isinstance(nested, NotConverged) else None
    nested_numbers = None if isinstance(nested, NotConverged) else nested
    estimates = errors(scene, numbers, nested_numbers, solution.steps)
    if not has_shift:
        estimates = estimates._replace(shift_error=None)
    return Prediction(
        scene=scene,
        sed_ending=sed,
        sed_point=point,
        normal_force=normal,
        tangential_force=drag(scene, tangential),
        contact_width=width,
        indentation=depth,
        shift=shift if has_shift else None,
        nested=nested_numbers,
        unknown=unknown,
        dofs=finger.body.mesh.dofs,
        newton_iterations=state.iterations,
        wall_s=solution.wall_s,
        setup_s=solution.setup_s,
        estimate_s=estimate_s,
        row=Row(ROW, row, row_errors(row, nested_numbers, finger.geometry.lines)),
        model=entry,
        audits=solution.audits,
        skin=skin_of(finger, state),
        geometry=finger.geometry,
        displacement=solution.displacement,
        history=None if solution.path is None else history(scene, finger, solution.path),
        warnings=(
            *warnings(driven, entry["left_out"]),
            *solution.warnings,
            *audits.round_off_warnings(solution.audits),
        ),
        **estimates._asdict(),
    )


def skin_of(finger: Finger[Patches], state: EquilibriumState) -> Skin:
    """Return positions, tractions and contact states of the skin that may touch."""
    place, touching, length = state.skin_positions(finger.newton.condensed), state.touching, np.empty(len(state.state))
    bounded_length(np.ascontiguousarray(place[:, 0]), finger.newton.skin, length)
    length = np.where(touching, length, 1.0)
    return Skin(
        x=place[:, 0],
        gap=np.where(touching, 0.0, place[:, 1] - state.load.depth),
        pressure=state.normal / length,
        traction=state.tangential / length,
        state=tuple(STATE_NAMES[int(s)] for s in state.state),
    )


def history(scene: Scene, finger: Finger[Patches], path: LoadPath) -> History:
    """Return a load path as arrays; at small strain it begins with the finger at rest."""
    first = 0 if isinstance(finger, LinearFinger) else 1
    instants = path.instants[first:]
    states = [instant.state for instant in instants]
    if path.tissue is not None:
        sed = np.array([(0.0, 0.0), *path.energies])[first:]
        responses = np.full((len(sed), len(NAMES)), np.nan)  # of all quantities but the SED
        responses[:, NAMES.index(SED.name)] = sed[:, 0]
    else:
        values = finger.ending_and_middle(states)
        sed, responses = values[:, 0], values[:, :, 0]
    return History(
        time=np.array([i.time for i in instants]),
        bone_x=np.array([i.travel for i in instants]),
        bone_y=np.array([-i.depth for i in instants]),
        sed_ending=sed[:, 0],
        sed_point=sed[:, 1],
        normal_force=np.array([s.normal.sum() for s in states]),
        tangential_force=np.array([drag(scene, float(s.tangential.sum())) for s in states]),
        contact_width=np.array([finger.contact_width(s) for s in states]),
        slipping=np.array([1.0 - s.sticking if s.touching.any() else 0.0 for s in states]),
        responses=responses,
    )


Scenes = dict[int, Scene]  # by number
Answers = dict[int, Answer]
Watch = Callable[[int, Answer, LinearFinger, tuple[Instant, ...] | None], None]  # number, answer, finger, load path
LoadingGroup = tuple[float, float, str]  # depth, force and direction: `Scene.loading_group`


class Meshing(ABC):
    """Solves scenes of one finger on meshes of any fineness, and keeps meshes for reuse."""

    def __init__(self, scenes: Scenes) -> None:
        """Start without meshes; these are made for the depths of `scenes`, estimated where forces are given."""
        self.scene = next(iter(scenes.values()))  # for finger, materials and receptor
        self.deepest: dict[LoadingGroup, float] = {}  # [mm]
        for scene in scenes.values():
            depth = expected_depth(scene)
            self.deepest[scene.loading_group] = max(depth, self.deepest.get(scene.loading_group, 0.0))

    @abstractmethod
    def answers(self, scenes: Scenes, fineness: Fineness, watch: Watch | None = None) -> Answers:
        """Return the prediction or the failure of each numbered scene on meshes of a `fineness`.

        Raises SceneError where the finger cannot be meshed, Cancelled.
        """


def complete_audits(
    finger: Finger[Patches], solution: SceneSolution, newton: Newton, settled_sed: Callable[[], float]
) -> None:
    """Complete the audits of a state and of its load path. Raises SolveFailure where they fail.

    `newton` belongs to the body that stores the energy of the load path. `settled_sed` returns the SED of the directly
    solved state, with which a load path must end.
    """
    checks, state, path = solution.audits, solution.state, solution.path
    audits.refuse_unsound(checks, state.load.depth)
    audits.refuse_beyond_finger(finger, state, solution.displacement)
    checks |= audits.force_residuals(solution.scene, float(state.force[1]), float(state.force[0]))
    if path is None:
        return
    relaxing = path.tissue is not None
    checks |= audits.course_audits(newton, [instant.state for instant in path.instants], relaxing=relaxing)
    if not relaxing or state.sticking == 0.0:  # the end of a relaxing path with stuck points depends on the path
        checks["course_against_direct"] = abs(settled_sed() / finger.sed_ending(solution.displacement) - 1.0)
