"""The hard cases at small strain that are no scenes: bodies, courses and bad meshes."""

import numpy as np

from solver.body.linear import LinearBody
from solver.constitutive.linear import Hooke
from solver.equilibrium.finger import FingerModel
from solver.equilibrium.full_slip import settled
from solver.equilibrium.march import march
from solver.equilibrium.newton import Newton, Pull
from solver.mesh.blocks import block
from solver.mesh.mesher import Sizing
from solver.scene.published import STICKINESS, scene
from solver.verification.hard_cases.meshes import jittered, slabs, two_parts
from solver.verification.hard_cases.outcome import Outcome, agree, percent, power

DEPTH = 1.5  # [mm]
TISSUES = (Hooke(0.136, 0.48), Hooke(0.08, 0.48), Hooke(0.034, 0.48))


def _model(fineness: float = 8.0) -> FingerModel:
    return FingerModel.of(scene(STICKINESS[0]), Sizing(fineness, DEPTH, margin=4.0))


def _force(body: LinearBody, mu: float, depth: float = DEPTH) -> float:
    return float(settled(Newton(body.condensed), Pull(depth, mu, sense=-1)).force[1])


def reversal() -> Outcome:
    """Slide forth, back and forth again: the settled state must return, and the one of the other way be met."""
    model, pull = _model(), Pull(DEPTH, 0.44, 0.005)
    press = [pull._replace(depth=depth) for depth in np.linspace(0.06, DEPTH, 25).tolist()]
    legs = np.cumsum(np.repeat([-0.05, 0.05, -0.05], 200)).tolist()
    states = list(march(model.newton, press + [pull._replace(travel=travel) for travel in legs]))
    seds = [model.sed_ending(model.displacement(end)) for end in states[len(press) + 199 :: 200]]
    slides = [settled(model.newton, pull._replace(sense=-way)) for way in (1, -1)]
    direct = [model.sed_ending(model.displacement(slide)) for slide in slides]
    spread = max(abs(seds[0] / seds[2] - 1), abs(seds[0] / direct[0] - 1), abs(seds[1] / direct[1] - 1))
    flaw = "" if spread < 1e-10 else f"differs from the direct states by {spread:.1g}"
    told = f"SED {seds[0]:.4g} forth, {seds[1]:.4g} back; equal to the direct states to {power(spread)}"
    return Outcome(True, (*seds, *direct), flaw, told)


def steps() -> Outcome:
    """Press in 1 to 10,000 steps and slide: the settled state does not depend on the way."""
    model, pull = _model(fineness=4.0), Pull(DEPTH, 0.3, 0.01)
    seds: list[float] = []
    for count in (1, 10, 100, 1000, 10000):
        press = [pull._replace(depth=depth) for depth in np.linspace(0.0, DEPTH, count + 1)[1:].tolist()]
        slide = [pull._replace(travel=-far) for far in np.linspace(0.0, 10.0, max(count, 10) + 1)[1:].tolist()]
        *_, last = march(model.newton, press + slide)
        seds.append(model.sed_ending(model.displacement(last)))
    return agree(f"SED {seds[0]:.4g} after 1 to 10,000 steps", seds, 1e-10)


def edge_at_node() -> Outcome:
    """Bisect for the depth at which one more node comes to touch, and solve on both sides of it and there."""
    model, pull = _model(), Pull(DEPTH, 0.3, sense=-1)
    low, high = 1.4, 1.5

    def touching(depth: float) -> int:
        return int(settled(model.newton, pull._replace(depth=depth)).touching.sum())

    while touching(high) == touching(low):
        high += 0.05
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if touching(middle) == touching(low) else (low, middle)
    nearby = [low, high, (low + high) / 2, np.nextafter(low, 0), np.nextafter(high, 9), low - 1e-12, high + 1e-12]
    slides = [settled(model.newton, pull._replace(depth=float(depth))) for depth in nearby]
    seds = [model.sed_ending(model.displacement(slide)) for slide in slides]
    return agree(f"SED {seds[0]:.4g} at {low:.6g} mm", seds, 1e-9)


def distorted_finger() -> Outcome:
    """Move every free inner node of the finger's mesh by 0.45 of its distance to the next, at random."""
    model = _model()
    forces = [_force(model.body, 0.3)]
    for seed in range(5):
        mesh = jittered(model.geometry.mesh, model.geometry.whole, 0.45, seed)
        forces.append(_force(LinearBody.of(mesh, TISSUES), 0.3))
    spread = max(abs(f / forces[0] - 1) for f in forces)
    flaw = "" if spread < 0.01 else f"the force changes by {spread:.1g}"
    told = f"N {forces[0]:.4g} undistorted; five distorted meshes differ by {percent(spread)} at most"
    return Outcome(True, tuple(forces), flaw, told)


def stiff_part(ratio: float) -> Outcome:
    """Press a soft block by a plate in it that is `ratio` times stiffer, and by one held as a whole in its place."""
    whole, alone = two_parts()
    two = LinearBody.of(whole, [Hooke(0.034, 0.48), Hooke(0.034 * ratio, 0.3)])
    found = settled(Newton(two.condensed), Pull(0.3, 0.3, sense=-1))
    drag = -float(found.tangential.sum()) / float(found.normal.sum())
    inner = two.reactions(two.displacement(found.u[:, :, None]))[:, :, 0]
    bone = inner[whole.held].sum(axis=0)
    balance = abs(bone[1] / found.normal.sum() + 1.0)
    force = float(found.force[1])
    rigid = _force(LinearBody.of(alone, [Hooke(0.034, 0.48)]), 0.3, 0.3)
    off = abs(force / rigid - 1)
    good = balance < 1e-4 and off < 2.0 / ratio + 1e-9 and abs(drag - 0.3) < 1e-12
    flaw = "" if good else f"off by {off:.1g}"
    told = f"N {force:.5g}, {percent(off)} from the rigid part's; balance {power(balance)}"
    return Outcome(True, (force, drag, rigid), flaw, told)


def one_node() -> Outcome:
    """Press so lightly that one node touches: its force is its depth by its own compliance, and no more."""
    mesh = block(np.linspace(-4, 4, 17), np.linspace(0, 3, 7), radius=8.0)
    body = LinearBody.of(mesh, [Hooke(0.08, 0.48)])
    newton, mu, depth = Newton(body.condensed), 0.3, 1e-5
    up = 2 * (len(newton.skin_x) // 2) + 1  # the unknown of the node in the middle
    found = settled(newton, Pull(depth, mu, sense=-1))
    compliance = np.linalg.inv(body.condensed.stiffness)
    force, exact = float(found.force[1]), depth / float(compliance[up, up] - mu * compliance[up, up - 1])
    flaw = "" if found.touching.sum() == 1 and abs(force / exact - 1) < 1e-12 else "not what one node bears"
    return Outcome(True, (force, exact), flaw, f"N {force:.4g}, equal to the depth by the node's compliance")


def aspect() -> Outcome:
    """Press a block of elements fifty times longer than wide, and the same block of squarer ones."""
    forces = [_force(LinearBody.of(mesh, [Hooke(0.08, 0.48)]), 0.3, 0.1) for mesh in slabs()]
    off = abs(forces[1] / forces[0] - 1)
    told = f"N {forces[1]:.4g}, {percent(off)} from squarer elements'"
    return Outcome(True, tuple(forces), "" if off < 0.005 else f"off by {off:.1g}", told)
