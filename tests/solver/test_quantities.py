"""Every quantity at a receptor: objective, with its small-strain limit, and as closed forms say."""

import numpy as np
import pytest

from solver import Friction, Loading, Scene, Solve, solve
from solver.constitutive import Hooke, NeoHooke, Ogden, stress
from solver.quantities import FIELDS, QUANTITIES, LocalState
from tests.solver.oracle.laws import energy, hooke_energy

E, NU = 0.08, 0.48
LAWS = [NeoHooke(E, NU), Ogden(E, NU)]
BY_NAME = {quantity.name: quantity for quantity in (*QUANTITIES, *FIELDS)}
EVERY_QUANTITY = pytest.mark.parametrize("name", BY_NAME)


def state(grad, law=LAWS[0], angle=0.3, small=False):
    """Return what is known of places with displacement gradients (n, 2, 2), the skin's tangent turned by an angle."""
    grad = np.asarray(grad, float)
    volume = np.trace(grad, axis1=-2, axis2=-1) if small else np.log(np.linalg.det(np.eye(2) + grad))
    along = np.full(len(grad), np.cos(angle)), np.full(len(grad), np.sin(angle))
    moduli = (np.array(number) for number in (law.shear, law.lame, law.stiffening))
    return LocalState(grad[:, 0, 0], grad[:, 0, 1], grad[:, 1, 0], grad[:, 1, 1], volume, *moduli, along)


def random_gradients(size, count=20):
    return np.random.default_rng(5).uniform(-size, size, (count, 2, 2))


@EVERY_QUANTITY
@pytest.mark.parametrize("law", LAWS, ids=str)
def test_a_rotation_of_the_deformed_body_changes_no_quantity(name, law):
    grad = random_gradients(0.25)
    turn = np.array([[np.cos(0.9), -np.sin(0.9)], [np.sin(0.9), np.cos(0.9)]])
    spun = turn @ (np.eye(2) + grad) - np.eye(2)
    finite = BY_NAME[name].finite
    np.testing.assert_allclose(finite(state(spun, law)), finite(state(grad, law)), rtol=1e-9, atol=1e-13)


@EVERY_QUANTITY
def test_at_small_strain_a_small_rotation_changes_no_quantity(name):
    grad = random_gradients(0.01)
    small = BY_NAME[name].small
    spun = grad + 0.02 * np.array([[0.0, -1.0], [1.0, 0.0]])
    np.testing.assert_allclose(small(state(spun, small=True)), small(state(grad, small=True)), rtol=1e-9, atol=1e-15)


@EVERY_QUANTITY
def test_a_quantity_is_below_zero_somewhere_unless_it_says_that_it_never_is(name):
    grad = random_gradients(0.25, count=500)
    quantity = BY_NAME[name]
    for values in (quantity.small(state(grad, small=True)), quantity.finite(state(grad))):
        assert (values.min() < 0.0) == quantity.signed


@EVERY_QUANTITY
@pytest.mark.parametrize("law", LAWS, ids=str)
def test_the_small_strain_form_is_the_limit_of_the_finite_one(name, law):
    """The part by which they differ falls with the strain, so ten times less strain leaves a tenth of it."""
    grad, differences = random_gradients(1.0), []
    for size in (1e-4, 1e-5):
        small = BY_NAME[name].small(state(size * grad, law, small=True))
        finite = BY_NAME[name].finite(state(size * grad, law))
        differences.append(np.abs(finite - small).max() / np.abs(small).max())
    assert differences[0] < 1e-3
    assert differences[1] <= 0.15 * differences[0]


def test_energy_and_stresses_are_those_of_the_laws():
    grad = random_gradients(0.2)
    deformed, det = np.eye(2) + grad, np.linalg.det(np.eye(2) + grad)
    for law in LAWS:
        local = state(grad, law)
        np.testing.assert_allclose(BY_NAME["sed"].finite(local), energy(law, deformed), rtol=1e-12)
        cauchy = np.zeros((len(grad), 3, 3))
        cauchy[:, :2, :2] = stress(law, deformed) @ np.swapaxes(deformed, 1, 2) / det[:, None, None]
        cauchy[:, 2, 2] = law.lame * np.log(det) / det
        pressure = -np.trace(cauchy, axis1=1, axis2=2) / 3.0
        np.testing.assert_allclose(BY_NAME["pressure"].finite(local), pressure, rtol=1e-10)
        deviator = cauchy + pressure[:, None, None] * np.eye(3)
        mises = np.sqrt(1.5 * np.sum(deviator**2, axis=(1, 2)))
        np.testing.assert_allclose(BY_NAME["von_mises"].finite(local), mises, rtol=1e-9)
    hooke = Hooke(E, NU)
    np.testing.assert_allclose(BY_NAME["sed"].small(state(grad, small=True)), hooke_energy(hooke, grad), rtol=1e-12)


def test_principal_strains_are_singular_values_of_the_deformation():
    grad = random_gradients(0.3)
    values = np.linalg.svd(np.eye(2) + grad, compute_uv=False)
    local = state(grad)
    np.testing.assert_allclose(BY_NAME["principal_strain_greatest"].finite(local), values[:, 0] - 1.0, rtol=1e-12)
    np.testing.assert_allclose(BY_NAME["principal_strain_least"].finite(local), values[:, 1] - 1.0, rtol=1e-11)
    np.testing.assert_allclose(BY_NAME["shear_greatest"].finite(local), values[:, 0] - values[:, 1], rtol=1e-11)
    strains = np.linalg.eigvalsh((grad + np.swapaxes(grad, 1, 2)) / 2.0)
    np.testing.assert_allclose(BY_NAME["principal_strain_greatest"].small(local), strains[:, 1], rtol=1e-11, atol=1e-15)
    np.testing.assert_allclose(BY_NAME["shear_greatest"].small(local), strains[:, 1] - strains[:, 0], rtol=1e-11)


@pytest.mark.parametrize("kind", ["small", "finite"])
def test_simple_shear_along_the_skin_by_gamma_is_a_shear_of_gamma_and_stretches_no_line_along_it(kind):
    gamma = 0.2
    local = state([[[0.0, gamma], [0.0, 0.0]]], angle=0.0, small=kind == "small")
    assert getattr(BY_NAME["shear_along_skin"], kind)(local) == pytest.approx([gamma], rel=1e-14)
    assert getattr(BY_NAME["stretch_along_skin"], kind)(local) == pytest.approx([0.0], abs=1e-15)
    upright = state([[[0.0, 0.0], [-gamma, 0.0]]], angle=np.pi / 2, small=kind == "small")  # the same, all turned
    assert getattr(BY_NAME["shear_along_skin"], kind)(upright) == pytest.approx([gamma], rel=1e-14)


def test_a_pure_dilation_has_no_energy_of_shape_but_for_the_plane_that_holds_it():
    """Plane strain has no equal stretch in all directions: the deviator of (e, e, 0) holds 2/3 G e^2."""
    e, law = 1e-6, LAWS[0]
    local = state([[[e, 0.0], [0.0, e]]], small=True)
    assert BY_NAME["sed_deviatoric"].small(local) == pytest.approx([2.0 / 3.0 * law.shear * e**2], rel=1e-12)
    bulk = law.lame + 2.0 / 3.0 * law.shear
    assert BY_NAME["sed_volumetric"].small(local) == pytest.approx([bulk / 2.0 * (2.0 * e) ** 2], rel=1e-12)


def test_energies_of_shape_and_volume_are_neither_negative_and_add_up():
    local = state(random_gradients(0.3))
    shape, volume = BY_NAME["sed_deviatoric"].finite(local), BY_NAME["sed_volumetric"].finite(local)
    assert min(shape.min(), volume.min()) > 0.0
    np.testing.assert_allclose(shape + volume, BY_NAME["sed"].finite(local), rtol=1e-12)


@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_every_quantity_of_a_prediction_lies_within_its_error_of_a_mesh_three_times_as_fine(kinematics):
    """The truth is a mesh whose own error is a small part of the coarse one's: all fall with its square."""
    coarse, fine = (
        solve(Scene(friction=Friction(0.5, 0.02), loading=Loading(1.2, "-x"), solve=Solve(kinematics, "steady", size)))
        for size in (0.05, 0.002)
    )
    for name in (quantity.name for quantity in QUANTITIES):
        value, error = coarse.responses[name]
        truth, truth_error = fine.responses[name]
        assert abs(value - truth) < error + truth_error, name
    assert coarse.responses["sed"].value == pytest.approx(coarse.sed_ending, rel=1e-12)
    assert coarse.responses["sed"].error == pytest.approx(coarse.error_estimate * coarse.sed_ending, rel=1e-9)


@pytest.mark.parametrize("law", LAWS, ids=str)
def test_principal_stresses_of_simple_states_are_as_closed_forms_say(law):
    """Pure shear by an angle g has G g and -G g; a stretch e with the sides held has (lambda + 2 G) e and lambda e."""
    shear, lame = float(law.shear), float(law.lame)
    local = state([[[0.0, 0.01], [0.01, 0.0]], [[0.01, 0.0], [0.0, 0.0]]], law, small=True)
    greatest, least = (BY_NAME[f"principal_stress_{kind}"].small(local) for kind in ("greatest", "least"))
    np.testing.assert_allclose(greatest, [0.02 * shear, 0.01 * (lame + 2.0 * shear)], rtol=1e-12)
    np.testing.assert_allclose(least, [-0.02 * shear, 0.01 * lame], rtol=1e-12)
