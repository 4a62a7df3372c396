"""The hard cases of small strain: each a name, what is run, and whether it must answer.

Run from the root: python -m benchmarks.hard_cases. Writes the table into docs/benchmarks.md, between its two marks. The
tests run the same list: a case passes when it ends in a balanced answer or, where no state need exist, in a sentence.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy: threads cost more than they bring at these sizes

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from solver.body import Body
from solver.contact import Contact, Course, untouched
from solver.elements import Q2P1
from solver.failures import SolveFailure
from solver.finger import FingerModel
from solver.friction import FrictionLaw
from solver.materials import Hooke
from solver.mesh import Indices, Mesh
from solver.mesher import Sizing
from solver.scene import Finger, Friction, Loading, Material, Materials, Receptor, Scene, Solve
from solver.shapes import block
from solver.solution import answers

DOCUMENT = Path(__file__).resolve().parent.parent / "docs" / "benchmarks.md"
MARKS = "<!-- hard cases: begin -->", "<!-- hard cases: end -->"


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a case ended."""

    answered: bool
    numbers: tuple[float, ...]  # all that was found; each must be finite
    flaw: str  # "" where the answer balances and exceeds nothing, else what does not
    told: str  # a row of the table


@dataclass(frozen=True, slots=True)
class Case:
    """A named hard case."""

    name: str
    must_answer: bool
    run: Callable[[], Outcome]


def of_scene(asked: Scene) -> Outcome:
    """Solve a scene of the finger."""
    (found,) = answers([asked])
    if isinstance(found, SolveFailure):
        return Outcome(False, (), "", str(found))
    checks = found.audits
    flaws = [n for n in ("equilibrium_x", "equilibrium_y", "inner_forces", "work_balance") if not checks[n] < 1e-4]
    flaws += [n for n in ("penetration", "tension", "cone_violation") if not checks[n] < 1e-7]
    worst = max(checks[n] for n in ("equilibrium_x", "equilibrium_y", "inner_forces", "work_balance"))
    numbers = (found.sed_ending, found.sed_point, found.normal_force, found.tangential_force, found.error_estimate)
    told = (
        f"SED {found.sed_ending:.4g} ± {_percent(found.error_estimate)}, N {found.normal_force:.4g}, "
        f"T {found.tangential_force + 0.0:.4g}; {found.newton_iterations} systems; balance {_power(worst)}"
    )
    return Outcome(True, numbers, ", ".join(flaws), told)


def _percent(part: float) -> str:
    return f"{100 * part:.2g} %"


def _power(value: float) -> str:
    """Return the power of ten at or above a round-off, whose digits differ from machine to machine."""
    return f"1e{math.ceil(math.log10(max(value, 1e-16)))}"


def _scene(
    mu: float = 0.3,
    bound: float | None = None,
    depth: float = 1.5,
    *,
    backward: bool = False,
    nu: float = 0.48,
    finger: Finger | None = None,
    materials: Materials | None = None,
    receptor: Receptor | None = None,
    history: bool = False,
) -> Scene:
    tissues = materials or Materials(Material(0.136, nu), Material(0.08, nu), Material(0.034, nu))
    return Scene(
        finger=finger or Finger(),
        materials=tissues,
        friction=Friction(mu, bound),
        loading=Loading(depth, "-x" if backward else "+x"),
        receptor=receptor or Receptor(),
        solve=Solve(course="history" if history else "steady"),
    )


def _model(depth: float = 1.5, fineness: float = 8.0) -> FingerModel:
    return FingerModel.of(_scene(), Sizing(fineness, depth, margin=4.0))


def _agree(told: str, numbers: list[float], within: float) -> Outcome:
    """Return an outcome whose numbers must all be one."""
    spread = float(np.ptp(numbers)) / abs(numbers[0])
    flaw = "" if spread <= within else f"{len(numbers)} ways differ by {spread:.1g}"
    return Outcome(True, tuple(numbers), flaw, f"{told}: {len(numbers)} ways agree to {_power(spread)}")


def reversal() -> Outcome:
    """Slide forth, back and forth again: the settled state must return, and the one of the other way be met."""
    model, law = _model(), FrictionLaw(0.44, 0.005)
    course = Course(model.body.touchable, law)
    now, travel = untouched(model.body.touchable), 0.0
    for depth in np.linspace(0.06, 1.5, 25):
        now = course.step(now, float(depth), 0.0)
    ends: list[Contact] = []
    for way in (1, -1, 1):
        for _ in range(200):
            travel += way * 0.05
            now = course.step(now, 1.5, travel)
        ends.append(now)
    seds = [model.sed_ending(model.displacement(end)) for end in ends]
    direct = [model.sed_ending(model.displacement(course.sliding(1.5, way))) for way in (1, -1)]
    spread = max(abs(seds[0] / seds[2] - 1), abs(seds[0] / direct[0] - 1), abs(seds[1] / direct[1] - 1))
    flaw = "" if spread < 1e-10 else f"differs from the direct states by {spread:.1g}"
    told = f"SED {seds[0]:.4g} forth, {seds[1]:.4g} back; equal to the direct states to {_power(spread)}"
    return Outcome(True, (*seds, *direct), flaw, told)


def steps() -> Outcome:
    """Press in 1 to 10,000 steps and slide: the settled state does not depend on the way."""
    model, law = _model(fineness=4.0), FrictionLaw(0.3, 0.01)
    seds: list[float] = []
    for count in (1, 10, 100, 1000, 10000):
        course = Course(model.body.touchable, law)
        now = untouched(model.body.touchable)
        for depth in np.linspace(0.0, 1.5, count + 1)[1:]:
            now = course.step(now, float(depth), 0.0)
        for travel in np.linspace(0.0, 10.0, max(count, 10) + 1)[1:]:
            now = course.step(now, 1.5, float(travel))
        seds.append(model.sed_ending(model.displacement(now)))
    return _agree(f"SED {seds[0]:.4g} after 1 to 10,000 steps", seds, 1e-10)


def edge_at_node() -> Outcome:
    """Bisect for the depth at which one more node comes to touch, and solve on both sides of it and there."""
    model, law = _model(), FrictionLaw(0.3, np.inf)
    course = Course(model.body.touchable, law)
    low, high = 1.4, 1.5

    def touching(depth: float) -> int:
        return int(course.sliding(depth, 1).touching.sum())

    while touching(high) == touching(low):
        high += 0.05
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if touching(middle) == touching(low) else (low, middle)
    nearby = [low, high, (low + high) / 2, np.nextafter(low, 0), np.nextafter(high, 9), low - 1e-12, high + 1e-12]
    seds = [model.sed_ending(model.displacement(course.sliding(float(depth), 1))) for depth in nearby]
    return _agree(f"SED {seds[0]:.4g} at {low:.6g} mm", seds, 1e-9)


def distorted_finger() -> Outcome:
    """Move every free inner node of the finger's mesh by 0.45 of its distance to the next, at random."""
    model, law = _model(), FrictionLaw(0.3, np.inf)
    forces = [_force(model.body, law)]
    tissues = [Hooke(0.136, 0.48), Hooke(0.08, 0.48), Hooke(0.034, 0.48)]
    for seed in range(5):
        mesh = jittered(model.geometry.mesh, model.geometry.whole, 0.45, seed)
        forces.append(_force(Body.of(mesh, tissues), law))
    spread = max(abs(f / forces[0] - 1) for f in forces)
    flaw = "" if spread < 0.01 else f"the force changes by {spread:.1g}"
    told = f"N {forces[0]:.4g} undistorted; five distorted meshes differ by {_percent(spread)} at most"
    return Outcome(True, tuple(forces), flaw, told)


def _force(body: Body, law: FrictionLaw, depth: float = 1.5) -> float:
    return float(Course(body.touchable, law).sliding(depth, 1).normal.sum())


def jittered(mesh: Mesh, outline: Indices, by: float, seed: int) -> Mesh:
    """Return the mesh with inner corners of elements moved by up to `by` of their shortest edge.

    Corners on the outline, on layers and held ones stay, so that the body stays the same; mid-nodes follow.
    """
    rng = np.random.default_rng(seed)
    nodes, corners = mesh.nodes, mesh.elements[:, :4]
    following = np.roll(corners, -1, axis=1)
    length = np.linalg.norm(nodes[corners] - nodes[following], axis=2)
    shortest = np.full(len(nodes), np.inf)
    np.minimum.at(shortest, corners.ravel(), length.ravel())
    np.minimum.at(shortest, following.ravel(), length.ravel())
    met = np.bincount(corners.ravel(), minlength=len(nodes))
    least = np.full(len(nodes), len(nodes))
    most = np.zeros(len(nodes), np.int64)
    for corner in range(4):
        np.minimum.at(least, corners[:, corner], mesh.region)
        np.maximum.at(most, corners[:, corner], mesh.region)
    free = (met == 4) & (least == most)
    free[mesh.held] = False
    free[outline] = False
    moved = np.zeros(nodes.shape)
    moved[free] = rng.uniform(-1, 1, (int(free.sum()), 2)) * by / math.sqrt(2) * shortest[free, None]
    while True:
        nodes = mesh.nodes + moved
        for side in range(4):
            ends = moved[corners[:, side]] + moved[following[:, side]]
            middle = mesh.elements[:, 4 + side]
            nodes[middle] = mesh.nodes[middle] + ends / 2
        nodes[mesh.elements[:, 8]] = mesh.nodes[mesh.elements[:, 8]] + moved[corners].sum(axis=1) / 4
        jacobian = np.swapaxes(nodes[mesh.elements], 1, 2)[:, None] @ Q2P1.shape(Q2P1.corners)[1]
        det = np.linalg.det(jacobian)
        folded = det.min(axis=1) < 0.02 * det.max(axis=1)
        if not folded.any():
            return replace(mesh, nodes=nodes)
        moved[np.unique(corners[folded])] *= 0.8  # the mesh was skew there already


def stiff_part(ratio: float) -> Outcome:
    """Press a soft block by a plate in it that is `ratio` times stiffer, and by one held as a whole in its place."""
    x, soft = np.linspace(-4, 4, 17), np.linspace(0, 2, 9)
    law = FrictionLaw(0.3, np.inf)
    whole = block(x, np.concatenate([soft, [2.5, 3.0]]), radius=8.0)
    layers, stiff_layers = len(soft) + 1, 2
    region = np.zeros(len(whole.elements), np.int64)
    region.reshape(-1, layers)[:, :stiff_layers] = 1  # the elements of a column run from its top down
    two = Body.of(replace(whole, region=region), [Hooke(0.034, 0.48), Hooke(0.034 * ratio, 0.3)])
    found = Course(two.touchable, law).sliding(0.3, 1)
    drag = -float(found.tangential.sum()) / float(found.normal.sum())
    skin = two.skin_displacement(np.concatenate([found.normal, found.tangential])[:, None])
    inner = two.reactions(two.displacement(skin))[:, :, 0]
    bone = inner[whole.held].sum(axis=0)
    balance = abs(bone[1] / found.normal.sum() + 1.0)
    # below a plate that does not yield, the block is held where the plate begins
    grid = np.arange(len(whole.nodes)).reshape(-1, 2 * layers + 1)
    held = grid[:, : 2 * stiff_layers + 1].ravel()
    rigid = Body.of(replace(whole, held=held), [Hooke(0.034, 0.48)])
    force, stiff = float(found.normal.sum()), _force(rigid, law, 0.3)
    off = abs(force / stiff - 1)
    good = balance < 1e-4 and off < 2.0 / ratio + 1e-9 and abs(drag - 0.3) < 1e-12
    flaw = "" if good else f"off by {off:.1g}"
    told = f"N {force:.5g}, {_percent(off)} from the rigid part's; balance {_power(balance)}"
    return Outcome(True, (force, drag, stiff), flaw, told)


def one_node() -> Outcome:
    """Press so lightly that one node touches: its force is its depth by its own compliance, and no more."""
    body = Body.of(block(np.linspace(-4, 4, 17), np.linspace(0, 3, 7), radius=8.0), [Hooke(0.08, 0.48)])
    touch, mu = body.touchable, 0.3
    middle, depth = len(touch.gap) // 2, 1e-5
    found = Course(touch, FrictionLaw(mu, math.inf)).sliding(depth, 1)
    yields = touch.normal_by_normal[middle, middle] - mu * touch.normal_by_tangential[middle, middle]
    force, exact = float(found.normal.sum()), depth / float(yields)
    flaw = "" if found.touching.sum() == 1 and abs(force / exact - 1) < 1e-12 else "not what one node bears"
    return Outcome(True, (force, exact), flaw, f"N {force:.4g}, equal to the depth by the node's compliance")


def aspect() -> Outcome:
    """Press a block of elements fifty times longer than wide, and the same block of squarer ones."""
    law = FrictionLaw(0.3, np.inf)
    fine = np.linspace(0, 1, 26)
    forces = [
        _force(Body.of(block(np.linspace(-5, 5, count), lines, radius=40.0), [Hooke(0.08, 0.48)]), law, 0.1)
        for count, lines in ((41, np.linspace(0, 1, 9)), (41, np.concatenate([0.005 * np.arange(4), fine[1:]])))
    ]
    off = abs(forces[1] / forces[0] - 1)
    told = f"N {forces[1]:.4g}, {_percent(off)} from squarer elements'"
    return Outcome(True, tuple(forces), "" if off < 0.005 else f"off by {off:.1g}", told)


def _thin(epidermis: float, dermis: float) -> Scene:
    across = min(0.2, dermis)
    receptor = Receptor(depth=epidermis + dermis - across / 2, ending=(across, 1.0))
    return _scene(finger=Finger(epidermis=epidermis, dermis=dermis), receptor=receptor)


def _scenes() -> list[tuple[str, Scene, bool]]:
    """Return the cases that are scenes of the finger: name, scene, whether it must answer."""
    soft = Material(0.034, 0.48)
    return [
        *((f"nu {nu}", _scene(nu=nu), True) for nu in (0.0, 0.3, 0.48, 0.499, 0.4999, 0.49999, 0.499999, 0.4999999)),
        *((f"mu {mu:g}", _scene(mu), True) for mu in (0.0, 1e-9)),
        *(
            (f"mu {mu:g} at {depth:g} mm, near or beyond the limit", _scene(mu, depth=depth), False)
            for depth, mu in ((1.5, 1.4), (2.0, 1.3), (2.0, 2.0))
        ),
        *((f"mu {mu:g} with a bound of 0.005 MPa", _scene(mu, 0.005), True) for mu in (10.0, 1000.0)),
        *(
            (f"mu {mu:g} with a bound of 0.02 MPa, backwards", _scene(mu, 0.02, backward=True), True)
            for mu in (10.0, 1000.0)
        ),
        *((f"tau_max {bound:g} MPa", _scene(0.44, bound), True) for bound in (0.0, 1e-9, 1e9)),
        *(
            (f"depth {depth:g} mm", _scene(depth=depth), True)
            for depth in (1e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.1, 1.0, 2.0)
        ),
        ("depth 2 mm without friction", _scene(0.0, depth=2.0), True),
        ("depth 3 mm without friction", _scene(0.0, depth=3.0), True),
        ("depth 3 mm", _scene(depth=3.0), False),
        *(
            (
                f"angle {angle:g} degrees{', backwards' if backward else ''}",
                _scene(0.44, 0.03, finger=Finger(contact_angle=angle), backward=backward),
                30.0 <= angle <= 75.0,
            )
            for angle in (15.0, 30.0, 45.0, 60.0, 75.0, 85.0)
            for backward in (False, True)
        ),
        ("epidermis of 0.05 mm", _thin(0.05, 1.25), True),
        ("dermis of 0.05 mm", _thin(0.75, 0.05), True),
        ("epidermis and dermis of 0.05 mm each", _thin(0.05, 0.05), True),
        (
            "epidermis 1e6 times stiffer than fat",
            _scene(materials=Materials(Material(3.4e4, 0.48), soft, soft)),
            False,
        ),
        ("the whole course at nu 0.4999999", _scene(0.44, 0.005, nu=0.4999999, history=True), True),
    ]


def cases() -> tuple[Case, ...]:
    """Return the suite."""
    others = {
        **{f"a part {ratio:g} times stiffer": partial(stiff_part, ratio) for ratio in (1e3, 1e6, 1e10)},
        "one node touching": one_node,
        "direction reversal": reversal,
        "steps over four decades": steps,
        "contact edge at a mesh node": edge_at_node,
        "elements distorted to 0.45 of an edge": distorted_finger,
        "elements of aspect 50": aspect,
    }
    scenes = (Case(name, must, partial(of_scene, asked)) for name, asked, must in _scenes())
    return (*scenes, *(Case(name, True, run) for name, run in others.items()))


def table() -> str:
    """Return the table of all cases."""
    rows = ["| case | must answer | outcome |", "| --- | --- | --- |"]
    for case in cases():
        found = case.run()
        end = found.told + (f" **{found.flaw}**" if found.flaw else "")
        rows.append(f"| {case.name} | {'yes' if case.must_answer else 'where a state exists'} | {end} |")
    return "\n".join(rows)


def main() -> None:
    """Write the table into the page, and print it."""
    made = table()
    print(made)
    text = DOCUMENT.read_text(encoding="utf-8")
    head, rest = text.split(MARKS[0])
    _, tail = rest.split(MARKS[1])
    DOCUMENT.write_text(f"{head}{MARKS[0]}\n{made}\n{MARKS[1]}{tail}", encoding="utf-8")


if __name__ == "__main__":
    main()
