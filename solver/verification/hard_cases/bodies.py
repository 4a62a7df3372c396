"""The hard cases other than scenes: bodies, load paths and bad meshes, in either kinematics."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from solver.arrays import Array
from solver.body.finite import FiniteBody
from solver.body.linear import LinearBody
from solver.constitutive import Hooke, NeoHooke
from solver.contact import LoadState
from solver.equilibrium import EquilibriumState, Newton
from solver.equilibrium.finger import FiniteFinger, LinearFinger
from solver.equilibrium.load_stepping import march, solve_full_slip
from solver.mesh import Mesh, block
from solver.mesh.mesher import Sizing
from solver.prediction import percent
from solver.scene.published import STICKINESS, scene
from solver.verification.hard_cases.outcome import Outcome, agree, power
from solver.verification.histories import press_and_slide
from solver.verification.methods import Kinematics
from solver.verification.published.bodies import distort

_DEPTH = 1.5  # [mm]
STIFF_LAYERS = 2  # of elements
_TISSUES = ((0.136, 0.48), (0.08, 0.48), (0.034, 0.48))  # Young's modulus [MPa] and Poisson's ratio
Finger = LinearFinger | FiniteFinger


@dataclass(frozen=True, slots=True)
class Bodies:
    """Construction and loading of bodies in one kinematics, and the required agreement of their states."""

    newton: Callable[[Mesh, Sequence[tuple[float, float]]], Newton]  # of a body of layers (E, nu)
    finger: Callable[[float], Finger]  # by fineness
    fineness: float
    sense: int  # of the surface, in its first slide
    back_and_forth: tuple[float, int, int, float]  # bound [MPa], steps of the press and of a leg, and their length [mm]
    path: Callable[[int], list[LoadState]]  # whose first steps are 1/count of the path
    path_words: str
    meshes: int  # number of distorted meshes
    agreement: float  # relative, of states that must be equal
    rigid_agreement: float  # of the forces with a stiff part and with a rigid one, up to round-off
    node_agreement: float  # of one node's force with its compliance


def _linear(mesh: Mesh, layers: Sequence[tuple[float, float]]) -> Newton:
    return Newton(LinearBody.of(mesh, [Hooke(*layer) for layer in layers]).condensed)


def _finite(mesh: Mesh, layers: Sequence[tuple[float, float]]) -> Newton:
    return Newton(FiniteBody.of(mesh, [NeoHooke(*layer) for layer in layers]).condensed)


def _sed(finger: Finger, state: EquilibriumState) -> float:
    return finger.sed_ending(finger.displacement(state))


def _beginning(count: int) -> list[LoadState]:
    """Return a press and a slide, each with up to twenty first steps of 1/`count` of the path, then long ones."""
    down = [_DEPTH * (i + 1) / count for i in range(min(count, 20))]
    along = [8.0 * (i + 1) / count for i in range(min(count, 20))]
    down += [_DEPTH * part for part in (0.25, 0.5, 0.75, 1.0) if _DEPTH * part > down[-1]]
    along += [8.0 * part for part in np.linspace(0.05, 1.0, 20).tolist() if 8.0 * part > along[-1]]
    return [LoadState(depth, 0.3, 0.01) for depth in down] + [
        LoadState(_DEPTH, 0.3, 0.01, travel=travel) for travel in along
    ]


BODIES: dict[Kinematics, Bodies] = {
    "small": Bodies(
        _linear, lambda fineness: LinearFinger.of(scene(STICKINESS[0]), Sizing(fineness, _DEPTH, margin=4.0)),
        8.0, -1, (0.005, 25, 200, 0.05),
        lambda count: press_and_slide(_DEPTH, 0.3, 0.01, 1, count, max(count, 10), 10.0),
        "1 to 10,000 steps", 5, 1e-10, 1e-9, 1e-12,
    ),
    "finite": Bodies(
        _finite, lambda fineness: FiniteFinger.of(scene(STICKINESS[0]), Sizing(fineness, _DEPTH, margin=3.0)),
        6.0, 1, (0.03009, 8, 24, 0.4), _beginning, "steps of 1 to 1/10,000 of the way", 3, 1e-8, 1e-7, 1e-4,
    ),
}  # fmt: skip


def _last(newton: Newton, path: Iterable[LoadState]) -> EquilibriumState:
    *_, last = march(newton, path)
    return last


def _force(newton: Newton, depth: float, sense: int = -1) -> float:
    return float(solve_full_slip(newton, LoadState(depth, 0.3, sense=sense)).force[1])


def reversal(bodies: Bodies) -> Outcome:
    """Slide forth, back and forth again: full slip must recur, and must occur in the other direction."""
    tau, press, leg, step = bodies.back_and_forth
    finger, load = bodies.finger(bodies.fineness), LoadState(_DEPTH, 0.44, tau)
    senses = [bodies.sense, -bodies.sense, bodies.sense]
    down = [load._replace(depth=_DEPTH * (i + 1) / press) for i in range(press)]
    travels = np.cumsum(np.repeat(step * np.array(senses), leg)).tolist()
    states = list(march(finger.newton, down + [load._replace(travel=travel) for travel in travels]))
    seds = [_sed(finger, state) for state in states[press + leg - 1 :: leg]]
    direct = [_sed(finger, solve_full_slip(finger.newton, load._replace(sense=sense))) for sense in senses[:2]]
    spread = max(abs(seds[0] / seds[2] - 1), abs(seds[0] / direct[0] - 1), abs(seds[1] / direct[1] - 1))
    flaw = "" if spread < bodies.agreement else f"differs from the direct states by {spread:.1g}"
    summary = f"SED {seds[0]:.4g} forth, {seds[1]:.4g} back; equal to the direct states to {power(spread)}"
    return Outcome(True, (*seds, *direct), flaw, summary)


def steps(bodies: Bodies) -> Outcome:
    """Press and slide in steps of 1 to 1/10,000 of the path: full slip does not depend on the load path."""
    finger = bodies.finger(4.0)
    seds = [_sed(finger, _last(finger.newton, bodies.path(count))) for count in (1, 10, 100, 1000, 10000)]
    return agree(f"SED {seds[0]:.4g} after {bodies.path_words}", seds, bodies.agreement)


def edge_at_node(bodies: Bodies) -> Outcome:
    """Bisect for the depth at which one more node comes into contact; solve there and on both sides of it."""
    finger = bodies.finger(bodies.fineness)

    def at(depth: float) -> EquilibriumState:
        return solve_full_slip(finger.newton, LoadState(float(depth), 0.3, sense=bodies.sense))

    low, high = 1.4, 1.5
    fewest = int(at(low).touching.sum())
    while int(at(high).touching.sum()) == fewest:
        high += 0.05
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (middle, high) if int(at(middle).touching.sum()) == fewest else (low, middle)
    nearby = [low, high, (low + high) / 2, np.nextafter(low, 0), np.nextafter(high, 9), low - 1e-12, high + 1e-12]
    seds = [_sed(finger, at(depth)) for depth in nearby]
    return agree(f"SED {seds[0]:.4g} at {low:.6g} mm", seds, 1e-9)


def distorted_finger(bodies: Bodies) -> Outcome:
    """Move every free inner node of the finger's mesh by 0.45 of its distance to the next, at random."""
    geometry = bodies.finger(8.0).geometry
    meshes = [distort(geometry.mesh, 0.45, seed, geometry.all_skin) for seed in range(bodies.meshes)]
    forces = [_force(bodies.newton(mesh, _TISSUES), _DEPTH, bodies.sense) for mesh in (geometry.mesh, *meshes)]
    spread = max(abs(f / forces[0] - 1) for f in forces)
    flaw = "" if spread < 0.01 else f"the force changes by {spread:.1g}"
    summary = f"N {forces[0]:.4g} undistorted; {len(meshes)} distorted meshes differ by {percent(spread)} at most"
    return Outcome(True, tuple(forces), flaw, summary)


def stiff_part(bodies: Bodies, ratio: float) -> Outcome:
    """Press a soft block by an embedded plate that is `ratio` times stiffer, and by held nodes in its place."""
    whole, alone = two_parts()
    slide = solve_full_slip(bodies.newton(whole, [(0.034, 0.48), (0.034 * ratio, 0.3)]), LoadState(0.3, 0.3, sense=-1))
    force, rigid = float(slide.force[1]), _force(bodies.newton(alone, [(0.034, 0.48)]), 0.3)
    drag, deviation = -float(slide.force[0]) / force, abs(force / rigid - 1)
    good = deviation < 2.0 / ratio + bodies.rigid_agreement and abs(drag - 0.3) < 1e-12
    summary = f"N {force:.5g}, {percent(deviation)} from the rigid part's; {slide.iterations} systems"
    return Outcome(True, (force, drag, rigid), "" if good else f"off by {deviation:.1g}", summary)


def one_node(bodies: Bodies) -> Outcome:
    """Press so lightly that one node touches: at small strain its force is the depth divided by its compliance."""
    mesh, layers = block(np.linspace(-4, 4, 17), np.linspace(0, 3, 7), radius=8.0), [(0.08, 0.48)]
    depth, mu = 1e-5, 0.3
    slide = solve_full_slip(bodies.newton(mesh, layers), LoadState(depth, mu, sense=-1))
    compliance = np.linalg.inv(LinearBody.of(mesh, [Hooke(*layers[0])]).condensed.stiffness)
    up = 2 * (len(mesh.skin) // 2) + 1  # normal displacement of the middle node
    force, exact = float(slide.force[1]), depth / float(compliance[up, up] - mu * compliance[up, up - 1])
    deviation = abs(force / exact - 1)
    flaw = "" if slide.touching.sum() == 1 and deviation < bodies.node_agreement else "not what one node bears"
    apart = "equal to" if deviation < 1e-12 else f"{percent(deviation)} from"
    return Outcome(True, (force, exact), flaw, f"N {force:.4g}, {apart} the depth by the node's compliance")


def aspect(bodies: Bodies) -> Outcome:
    """Press a block of elements fifty times longer than high, and the same block of nearly square elements."""
    forces = [_force(bodies.newton(mesh, [(0.08, 0.48)]), 0.1) for mesh in slabs()]
    deviation = abs(forces[1] / forces[0] - 1)
    summary = f"N {forces[1]:.4g}, {percent(deviation)} from squarer elements'"
    return Outcome(True, tuple(forces), "" if deviation < 0.005 else f"off by {deviation:.1g}", summary)


def two_parts() -> tuple[Mesh, Mesh]:
    """Return a soft block (region 0) below a plate (region 1), and the block alone, held where the plate begins."""
    x, soft = np.linspace(-4, 4, 17), np.linspace(0, 2, 9)
    lines: Array = np.concatenate([soft, np.array([2.5, 3.0])])
    whole = block(x, lines, radius=8.0)
    layers = len(soft) + 1
    region = np.zeros(len(whole.elements), np.int64)
    region.reshape(-1, layers)[:, :STIFF_LAYERS] = 1  # elements of a column are numbered from its top down
    column = 2 * layers + 1
    nodes = np.arange(len(whole.nodes)).reshape(-1, column)[:, 2 * STIFF_LAYERS :]
    number = np.full(len(whole.nodes), -1)
    number[nodes.ravel()] = np.arange(nodes.size)
    elements = number[whole.elements[region == 0]]
    alone = Mesh(whole.nodes[nodes.ravel()], elements, region[region == 0], number[whole.skin], number[nodes[:, 0]])
    return replace(whole, region=region), alone


def slabs() -> tuple[Mesh, Mesh]:
    """Return one block twice, its lowest elements nearly square, and fifty times longer than high."""
    x: Array = np.linspace(-5, 5, 41)
    fine: Array = np.linspace(0, 1, 26)
    flat: Array = np.concatenate([np.linspace(0, 0.015, 4), fine[1:]])
    return block(x, np.linspace(0, 1, 9), radius=40.0), block(x, flat, radius=40.0)
