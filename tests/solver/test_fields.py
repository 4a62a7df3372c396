"""Pictures of a finger under a displacement that is linear in place, for which everything drawn is known."""

import numpy as np
import pytest

from solver.equilibrium.finger import LinearFinger
from solver.mesh.mesher import Outline, Sizing
from solver.response.fields import DISPLACEMENT, Sketch
from solver.scene.published import STICKINESS, scene

SAMPLE = scene(STICKINESS[0])
OUTLINE = Outline.of(SAMPLE.finger)
STRETCH, SHIFT, DEPTH = np.array([[0.02, 0.05], [-0.01, -0.03]]), np.array([0.3, -0.2]), 1.5


@pytest.fixture(scope="module")
def pictures():
    """Return the picture of the undeformed finger and that of the linear displacement, pressed by a depth."""
    mesh = LinearFinger.of(SAMPLE, Sizing(4.0, DEPTH)).geometry.mesh
    sketch, displacement = Sketch.of(mesh, SAMPLE), mesh.nodes @ STRETCH.T + SHIFT
    fields = (
        sketch.fields(u, depth, sketch.values(u[:, :, None])[:, :, 0])
        for u, depth in ((np.zeros(mesh.nodes.shape), 0.0), (displacement, DEPTH))
    )
    return tuple(fields)


def test_all_that_is_drawn_moves_with_the_tissue_and_the_bone_stays(pictures):
    before, after = pictures
    moving = [(before.nodes, after.nodes), (before.patch, after.patch)]
    moving += [(before.outlines[name], after.outlines[name]) for name in ("skin", "epidermis", "dermis")]
    for start, end in moving:
        assert end == pytest.approx(start + start @ STRETCH.T + SHIFT - [0.0, DEPTH], abs=1e-12)
    arcs = np.linspace(OUTLINE.palmar_cut, OUTLINE.dorsal_cut, len(after.outlines["bone"]))
    assert after.outlines["bone"] == pytest.approx(OUTLINE.bone(arcs) - [0.0, DEPTH])
    moved = np.hypot(*(after.nodes - before.nodes + [0.0, DEPTH]).T)
    assert after.values[DISPLACEMENT] == pytest.approx(moved)
    assert not before.values[DISPLACEMENT].any()


def test_triangles_cover_the_tissue_once(pictures):
    a, b, c = np.moveaxis(pictures[0].nodes[pictures[0].triangles], 1, 0)
    areas = np.abs(np.linalg.det(np.stack([b - a, c - a], axis=1))) / 2.0
    skin, bone = (pictures[0].outlines[name] for name in ("skin", "bone"))
    x, y = np.concatenate([skin, bone[::-1]]).T
    around = abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) / 2.0  # Gauss's formula of a polygon
    assert areas.sum() == pytest.approx(around, rel=2e-3)


def test_the_ending_is_drawn_about_its_depth_above_first_touch(pictures):
    across, along = SAMPLE.receptor.ending
    patch = pictures[0].patch[:-1]  # the last closes it
    middle = np.sort(patch[np.abs(patch[:, 0]) < 1e-9][:, 1])
    assert middle == pytest.approx(
        [SAMPLE.receptor.depth - across / 2.0, SAMPLE.receptor.depth + across / 2.0], abs=1e-3
    )
    sides = np.linalg.norm(np.diff(pictures[0].patch, axis=0), axis=1)
    assert sides.sum() == pytest.approx(2.0 * (across + along), rel=0.01)


def test_each_layer_stores_the_energy_of_the_uniform_strain(pictures):
    strain = np.zeros((3, 3))
    strain[:2, :2] = (STRETCH + STRETCH.T) / 2.0
    volume = np.trace(strain)
    layers = (SAMPLE.materials.of(name) for name in ("epidermis", "dermis", "fat"))
    energies = []
    for tissue in layers:
        shear, bulk = tissue.E / (2.0 * (1.0 + tissue.nu)), tissue.E / (3.0 * (1.0 - 2.0 * tissue.nu))
        energies.append(shear * (np.sum(strain**2) - volume**2 / 3.0) + bulk / 2.0 * volume**2)
    nearest = np.min(np.abs(pictures[1].sed[:, None] / energies - 1.0), axis=1)
    assert nearest.max() < 1e-9
    assert {int(np.argmin(np.abs(sed / np.array(energies) - 1.0))) for sed in pictures[1].sed} == {0, 1, 2}
    assert not pictures[0].sed.any()
