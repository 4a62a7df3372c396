"""The picture of the live model agrees with the solver's own fields."""

from dataclasses import replace

import numpy as np
import pytest

from solver import Friction, Loading, Scene
from solver.body import Probes
from solver.contact import LoadState
from solver.equilibrium import EquilibriumState
from solver.equilibrium.finger import LinearFinger
from solver.mesh.mesher import Sizing
from solver.response.stepper import LivePicture
from tests.solver.test_meshes import region_areas


@pytest.fixture(scope="module")
def finger():
    return LinearFinger.of(Scene(friction=Friction(0.5), loading=Loading(2.0)), Sizing(4.0, 2.0))


@pytest.fixture(scope="module")
def state(finger):
    rest = EquilibriumState.undeformed(finger.body.condensed)
    return replace(rest, u=np.random.default_rng(1).normal(size=rest.u.shape) * 1e-3, load=LoadState(1.5, 0.5))


def test_nodes_and_energies_are_those_that_the_body_gives_for_the_same_skin(finger, state):
    picture = LivePicture(finger)
    displacement = finger.displacement(state)
    mesh, elastic = finger.geometry.mesh, finger.body.elastic
    assert picture.nodes(state) == pytest.approx(mesh.nodes + displacement - [0.0, 1.5], abs=1e-9)

    element = 7  # an element; its quarters' middles are probed by the solver's own energy
    probes = Probes.at(
        mesh, elastic.centre, np.full(4, element), np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    )
    expected = elastic.energy(probes, displacement[:, :, None])[:, 0]
    assert picture.sed(state)[4 * element : 4 * element + 4] == pytest.approx(expected, rel=1e-9)


def test_faces_cover_the_tissue_once(finger):
    picture = LivePicture(finger)
    corners = picture.nodes(EquilibriumState.undeformed(finger.body.condensed))[picture.faces]
    x, y = corners[..., 0], corners[..., 1]
    area = 0.5 * np.sum(x * np.roll(y, -1, 1) - np.roll(x, -1, 1) * y, axis=1)
    assert (area > 0).all()
    assert area.sum() == pytest.approx(region_areas(finger.geometry).sum(), rel=0.002)  # chords cut the outline off
