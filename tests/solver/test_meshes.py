import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solver import Finger, Receptor
from solver.body.receptor import endings
from solver.mesh import ELEMENTS, GAUSS_3, GAUSS_4, Q2P1, MeshError, grid_mesh, quality
from solver.mesh.mesher import DERMIS, EPIDERMIS, FAT, Outline, Sizing, finger_mesh


def test_gauss_rules_are_those_of_numpy():
    for points, weights in (GAUSS_3, GAUSS_4):
        expected = np.polynomial.legendre.leggauss(len(points))
        np.testing.assert_allclose([points, weights], expected, rtol=0, atol=5e-16)


@pytest.mark.parametrize("element", ELEMENTS)
def test_shape_functions_are_one_at_their_node_and_sum_to_one(element):
    values, _ = element.shape(element.positions)
    assert np.allclose(values, np.eye(len(element.positions)), atol=1e-15)
    rng = np.random.default_rng(1)
    values, slopes = element.shape(rng.uniform(-1, 1, (20, 2)))
    assert np.allclose(values.sum(axis=1), 1.0)
    assert np.allclose(slopes.sum(axis=1), 0.0, atol=1e-14)


@pytest.mark.parametrize("element", ELEMENTS)
def test_gradients_of_shape_functions_are_their_differences(element):
    at = np.random.default_rng(2).uniform(-1, 1, (10, 2))
    _, slopes = element.shape(at)
    for axis in range(2):
        step = np.eye(2)[axis] * 1e-6
        difference = (element.shape(at + step)[0] - element.shape(at - step)[0]) / 2e-6
        assert np.allclose(slopes[..., axis], difference, atol=1e-9)


@pytest.mark.parametrize("element", ELEMENTS)
def test_shape_functions_hold_every_polynomial_of_their_order(element):
    at = np.random.default_rng(3).uniform(-1, 1, (20, 2))
    for i in range(element.order + 1):
        for j in range(element.order + 1 - i):
            at_nodes, expected = (points[:, 0] ** i * points[:, 1] ** j for points in (element.positions, at))
            np.testing.assert_allclose(element.shape(at)[0] @ at_nodes, expected, atol=1e-14)


@pytest.mark.parametrize("element", ELEMENTS)
def test_quadrature_integrates_the_products_of_two_shape_functions(element):
    for i in range(2 * element.order + 1):
        for j in range(2 * element.order + 1):
            exact = np.prod([2.0 / (n + 1) if n % 2 == 0 else 0.0 for n in (i, j)])
            x, y = element.points.T
            assert element.weights @ (x**i * y**j) == pytest.approx(exact, abs=1e-14)


@pytest.mark.parametrize("element", ELEMENTS)
@given(st.lists(st.floats(-0.2, 0.2), min_size=10, max_size=10))
@settings(max_examples=20)
def test_an_even_stress_on_distorted_quadrilaterals_leaves_no_force_on_nodes_inside(element, shifts):
    corners = np.stack(np.meshgrid(np.arange(3.0), np.arange(3.0), indexing="ij"), axis=-1)
    corners[1, 1] += shifts[:2]  # the corner that all four share, and those in the middle of the sides
    for number, (i, j) in enumerate([(0, 1), (1, 0), (2, 1), (1, 2)]):
        corners[i, j] += shifts[2 + 2 * number : 4 + 2 * number]
    forces: dict[tuple[float, float], np.ndarray] = {}
    for i in range(2):
        for j in range(2):
            corner_places = corners[[i, i + 1, i + 1, i], [j, j, j + 1, j + 1]]
            x, y = element.positions.T
            bilinear = np.stack([(1 + a * x) * (1 + b * y) / 4 for a, b in element.corners], axis=1)
            nodes = bilinear @ corner_places
            gradients = element.shape(element.points)[1]
            jacobian = np.einsum("ia,qib->qab", nodes, gradients)
            gradient = gradients @ np.linalg.inv(jacobian)
            force = np.einsum("q,q,qia->ia", element.weights, np.linalg.det(jacobian), gradient)
            for place, load, (a, b) in zip(nodes.round(9).tolist(), force, element.positions, strict=True):
                if 0 < i + (a + 1) / 2 < 2 and 0 < j + (b + 1) / 2 < 2:
                    forces[tuple(place)] = forces.get(tuple(place), np.zeros(2)) + load
    np.testing.assert_allclose(list(forces.values()), 0.0, atol=1e-13)


def region_areas(geometry):
    """Area of each region by quadrature."""
    mesh = geometry.mesh
    jacobian = np.swapaxes(mesh.nodes[mesh.elements], 1, 2)[:, None] @ Q2P1.shape(Q2P1.points)[1]
    det = np.linalg.det(jacobian)
    return np.bincount(mesh.region, (det * Q2P1.weights).sum(axis=1))


@pytest.mark.parametrize("shift", [False, True])
def test_the_mesh_has_the_areas_of_the_outline(shift):
    geometry = finger_mesh(Finger(), Receptor(), Sizing(12, 2.0, shift))
    skin = np.pi / 2 * (5.0**2 - 4.25**2) + 2 * 15 * 0.75
    dermis = np.pi / 2 * (4.25**2 - 3.0**2) + 2 * 15 * 1.25
    bone = np.pi / 2 * 1.5**2 + 14 * 3.0
    fat = np.pi / 2 * 3.0**2 + 15 * 6.0 - bone
    areas = region_areas(geometry)
    assert areas[EPIDERMIS] == pytest.approx(skin, rel=1e-4)
    assert areas[DERMIS] == pytest.approx(dermis, rel=1e-4)
    assert areas[FAT] == pytest.approx(fat, rel=1e-4)


def test_lines_between_elements_frame_the_ending_and_lie_on_the_layers():
    geometry = finger_mesh(Finger(), Receptor(), Sizing(6, 2.0))
    for depth in (0.0, 0.75, 1.8, 2.0):
        assert np.abs(geometry.depths - depth).min() < 1e-12
    for arc in (-0.5 / 3.1 * 5, 0.5 / 3.1 * 5, -np.pi / 4 * 5):
        assert np.abs(geometry.arcs - arc).min() < 1e-9


@pytest.mark.parametrize("depth", [0.8505, 0.6495, 1.8991, 1.8999])
def test_the_layers_keep_their_thickness_where_an_ending_ends_next_to_them(depth):
    geometry = finger_mesh(Finger(), Receptor(depth, (0.2, 1.0)), Sizing(8.0, 1.0))
    assert {0.0, 0.75, 2.0} <= set(geometry.depths.tolist())


def test_a_thin_ending_deep_in_a_thick_finger_is_whole():
    finger = Finger(20.0, 7.0, 5.0, 40.0, 2.0, (-4.0, 3.0))
    for depth in (8.17, 8.196, 10.828, 10.975):
        receptor = Receptor(depth, (0.001, 4.0))
        geometry = finger_mesh(finger, receptor, Sizing(6.0, 2.0))
        (area,) = endings(geometry, np.zeros((len(geometry.mesh.elements), 2)), receptor, np.zeros(1)).areas
        assert area == pytest.approx(0.004, rel=1e-9)


@pytest.mark.parametrize("depth", [1.3, 0.003, 0.752])  # at the surface, and beside a line between layers
@pytest.mark.parametrize("fineness", [2.5, 12.0])
def test_an_ending_that_is_hardly_more_than_a_point_lies_in_one_small_element_and_those_around_it_grow(depth, fineness):
    geometry = finger_mesh(Finger(), Receptor(depth, (0.004, 0.004)), Sizing(fineness, 2.0))
    size = 0.1 * 5.0 / fineness
    half = 0.002 * 5.0 / (5.0 - depth)  # of the ending, by the skin above it
    for lines, low, high in ((-geometry.depths, -depth - 0.002, -depth + 0.002), (geometry.arcs, -half, half)):
        first = int(np.searchsorted(lines, (low + high) / 2.0)) - 1
        assert lines[first] <= low + 1e-9
        assert lines[first + 1] >= high - 1e-9
        assert lines[first + 1] - lines[first] <= size * (1 + 1e-9)
        assert np.diff(lines[max(first - 1, 0) : first + 3]).max() <= 3.0 * size
    assert geometry.arcs[first] == pytest.approx(-size / 2)  # in the middle of it, where no layer ends


@pytest.mark.parametrize(
    "finger", [Finger(), Finger(bone="meshed", nail_length=4.0, cut="driven")], ids=["usual", "all"]
)
def test_the_nested_mesh_divides_every_element_in_four_and_keeps_every_node(finger):
    geometry, nested = (finger_mesh(finger, Receptor(), Sizing(5, 1.5, halved=halved)) for halved in (False, True))
    assert len(nested.mesh.elements) == 4 * len(geometry.mesh.elements)
    corners = geometry.mesh.nodes[geometry.mesh.elements[:, :4]].reshape(-1, 2)
    nested_corners = nested.mesh.nodes[nested.mesh.elements[:, :4]].reshape(-1, 2)
    distances = np.abs(corners[:, None] - nested_corners[None]).sum(axis=2).min(axis=1)
    assert distances.max() < 1e-12
    np.testing.assert_array_equal(np.bincount(nested.mesh.region), 4 * np.bincount(geometry.mesh.region))


def test_the_lowest_point_of_the_skin_touches_the_surface():
    for angle in (10.0, 45.0, 85.0):
        outline = Outline.of(Finger(contact_angle=angle))
        arc = np.linspace(outline.palmar_cut, outline.dorsal_cut, 2001)
        height = outline.tissue(arc, np.asarray(0.0))[:, 1]
        assert height.min() == pytest.approx(0.0, abs=1e-4)
        assert abs(arc[height.argmin()]) < 0.03


@settings(deadline=None, max_examples=40)
@given(
    angle=st.floats(15, 85),
    epidermis=st.floats(0.05, 1.2),
    dermis=st.floats(0.3, 1.2),
    bone=st.floats(0.8, 1.7),
    depth=st.floats(1e-3, 2.5),
    fineness=st.sampled_from([3, 6, 12]),
    shift=st.booleans(),
    ending=st.sampled_from([(0.2, 1.0), (0.001, 0.001)]),
)
def test_every_finger_that_a_scene_allows_can_be_meshed_without_a_folded_element(
    angle, epidermis, dermis, bone, depth, fineness, shift, ending
):
    finger = Finger(epidermis=epidermis, dermis=dermis, bone_radius=bone, bone_centre=(-1.0, 0.3), contact_angle=angle)
    receptor = Receptor(epidermis + dermis - 0.1, ending)
    geometry = finger_mesh(finger, receptor, Sizing(fineness, depth, shift))
    measures = quality(geometry.mesh)
    assert measures["jacobian_ratio"] > 0.02
    assert np.isin(geometry.mesh.skin, geometry.all_skin).all()


def test_a_folded_element_is_refused():
    points = np.stack(np.meshgrid(np.arange(3.0), -np.arange(3.0), indexing="ij"), axis=-1)
    points[2, 2] = [0.2, -0.2]
    with pytest.raises(MeshError, match="folded"):
        grid_mesh(points, np.zeros(1, np.int64), slice(0, 3), np.zeros(0, np.int64))
