"""The hard cases at finite strain that are no scenes: bodies, courses and bad meshes."""

from collections.abc import Iterable

import numpy as np

from solver.body.finite import FiniteBody
from solver.constitutive.hyperelastic import NeoHooke
from solver.equilibrium.finite_finger import FiniteFinger
from solver.equilibrium.full_slip import settled
from solver.equilibrium.march import march
from solver.equilibrium.newton import EquilibriumState, FiniteNewton, Pull
from solver.mesh import Mesh
from solver.mesh.blocks import block
from solver.mesh.mesher import Sizing
from solver.scene.published import STICKINESS, scene
from solver.verification.hard_cases.meshes import jittered, slabs, two_parts
from solver.verification.hard_cases.outcome import Outcome, agree, percent, power
from solver.verification.hard_cases.small import one_node as one_node_small

DEPTH = 1.5  # [mm]
TISSUES = (NeoHooke(0.136, 0.48), NeoHooke(0.08, 0.48), NeoHooke(0.034, 0.48))


def _model(fineness: float = 6.0) -> FiniteFinger:
    return FiniteFinger.of(scene(STICKINESS[0]), Sizing(fineness, DEPTH, margin=3.0))


def _slid(mesh: Mesh, laws: Iterable[NeoHooke], pull: Pull) -> EquilibriumState:
    return settled(FiniteNewton(FiniteBody.of(mesh, list(laws))), pull)


def _last(finger: FiniteFinger, course: list[Pull], start: EquilibriumState | None = None) -> EquilibriumState:
    *_, last = march(finger.newton, course, start)
    return last


def reversal() -> Outcome:
    """Slide forth, back and forth again: the settled state must return, and the one of the other way be met."""
    finger, mu, tau = _model(), 0.44, 0.03009
    press = [Pull(DEPTH * (i + 1) / 8, mu, tau) for i in range(8)]
    now, travel, ends = _last(finger, press), 0.0, list[EquilibriumState]()
    for way in (1, -1, 1):
        course: list[Pull] = []
        for _ in range(24):
            travel += way * 0.4
            course.append(Pull(DEPTH, mu, tau, travel=travel))
        now = _last(finger, course, now)
        ends.append(now)
    seds = [finger.sed_ending(end) for end in ends]
    direct = [finger.sed_ending(settled(finger.newton, Pull(DEPTH, mu, tau, sense))) for sense in (1, -1)]
    spread = max(abs(seds[0] / seds[2] - 1), abs(seds[0] / direct[0] - 1), abs(seds[1] / direct[1] - 1))
    flaw = "" if spread < 1e-8 else f"differs from the direct states by {spread:.1g}"
    told = f"SED {seds[0]:.4g} forth, {seds[1]:.4g} back; equal to the direct states to {power(spread)}"
    return Outcome(True, (*seds, *direct), flaw, told)


def steps() -> Outcome:
    """Begin pressing and begin sliding in steps from 1 to 1/10,000 of the way: the settled state is the same."""
    finger, mu, tau = _model(4.0), 0.3, 0.01
    seds: list[float] = []
    for count in (1, 10, 100, 1000, 10000):
        few = min(count, 20)
        down = [DEPTH * (i + 1) / count for i in range(few)]
        along = [8.0 * (i + 1) / count for i in range(few)]
        down += [DEPTH * part for part in (0.25, 0.5, 0.75, 1.0) if DEPTH * part > down[-1]]
        along += [8.0 * part for part in np.linspace(0.05, 1.0, 20) if 8.0 * part > along[-1]]
        course = [Pull(depth, mu, tau) for depth in down] + [Pull(DEPTH, mu, tau, travel=float(t)) for t in along]
        seds.append(finger.sed_ending(_last(finger, course)))
    return agree(f"SED {seds[0]:.4g} after steps of 1 to 1/10,000 of the way", seds, 1e-8)


def edge_at_node() -> Outcome:
    """Bisect for the depth at which one more node comes to touch, and solve on both sides of it and there."""
    finger = _model()
    start = settled(finger.newton, Pull(1.4, 0.3, np.inf, 1))

    def at(depth: float) -> EquilibriumState:
        return settled(finger.newton, Pull(depth, 0.3, np.inf, 1), start)

    low, high = 1.4, 1.5
    fewest = int(start.touching.sum())
    while int(at(high).touching.sum()) == fewest:
        high += 0.05
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (middle, high) if int(at(middle).touching.sum()) == fewest else (low, middle)
    nearby = [low, high, (low + high) / 2, low - 1e-12, high + 1e-12]
    seds = [finger.sed_ending(at(float(depth))) for depth in nearby]
    return agree(f"SED {seds[0]:.4g} at {low:.6g} mm", seds, 1e-8)


def distorted_finger() -> Outcome:
    """Move every free inner node of the finger's mesh by 0.45 of its distance to the next, at random."""
    finger, pull = _model(8.0), Pull(DEPTH, 0.3, np.inf, 1)
    forces = [float(settled(finger.newton, pull).force[1])]
    for seed in range(3):
        mesh = jittered(finger.geometry.mesh, finger.geometry.whole, 0.45, seed)
        forces.append(float(_slid(mesh, TISSUES, pull).force[1]))
    spread = max(abs(f / forces[0] - 1) for f in forces)
    flaw = "" if spread < 0.01 else f"the force changes by {spread:.1g}"
    told = f"N {forces[0]:.4g} undistorted; three distorted meshes differ by {percent(spread)} at most"
    return Outcome(True, tuple(forces), flaw, told)


def stiff_part(ratio: float) -> Outcome:
    """Press a soft block by a plate in it that is `ratio` times stiffer, and by one held as a whole in its place."""
    pull = Pull(0.3, 0.3, np.inf, -1)
    whole, alone = two_parts()
    two = _slid(whole, [NeoHooke(0.034, 0.48), NeoHooke(0.034 * ratio, 0.3)], pull)
    force, rigid = float(two.force[1]), float(_slid(alone, [NeoHooke(0.034, 0.48)], pull).force[1])
    drag, off = -float(two.force[0]) / force, abs(force / rigid - 1)
    good = off < 2.0 / ratio + 1e-7 and abs(drag - 0.3) < 1e-9
    told = f"N {force:.5g}, {percent(off)} from the rigid part's; {two.iterations} systems"
    return Outcome(True, (force, drag, rigid), "" if good else f"off by {off:.1g}", told)


def one_node() -> Outcome:
    """Press so lightly that one node touches: its force is what small strain gives it."""
    mesh = block(np.linspace(-4, 4, 17), np.linspace(0, 3, 7), radius=8.0)
    found = _slid(mesh, [NeoHooke(0.08, 0.48)], Pull(1e-5, 0.3, np.inf, -1))
    force, exact = float(found.force[1]), one_node_small().numbers[0]
    off = abs(force / exact - 1)
    flaw = "" if found.touching.sum() == 1 and off < 1e-4 else "not what one node bears"
    return Outcome(True, (force, exact), flaw, f"N {force:.4g}, {percent(off)} from small strain's")


def aspect() -> Outcome:
    """Press a block of elements fifty times longer than wide, and the same block of squarer ones."""
    pull = Pull(0.1, 0.3, np.inf, -1)
    forces = [float(_slid(mesh, [NeoHooke(0.08, 0.48)], pull).force[1]) for mesh in slabs()]
    off = abs(forces[1] / forces[0] - 1)
    told = f"N {forces[1]:.4g}, {percent(off)} from squarer elements'"
    return Outcome(True, tuple(forces), "" if off < 0.005 else f"off by {off:.1g}", told)
