# ruff: noqa: N803, N806 - the letters of the literature
"""Every law of the list: stress and tangent follow from the energy, turning is free, known states come out."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solver.constitutive import LAWS, NeoHooke, Ogden, stress, tangent
from tests.solver.oracle.laws import energy

MEMBERS = [law(0.08, 0.48) for law in LAWS]
DERMIS = NeoHooke(0.08, 0.48)
EPIDERMIS = NeoHooke(0.136, 0.48)
entries = st.floats(-0.4, 0.4)
gradients = st.tuples(entries, entries, entries, entries).map(lambda g: np.eye(2) + np.reshape(g, (2, 2)))


@pytest.mark.parametrize("law", MEMBERS, ids=lambda law: law.name)
@given(F=gradients, direction=gradients)
def test_stress_is_the_derivative_of_the_energy_and_the_tangent_that_of_the_stress(law, F, direction):
    complex_step = 1e-30
    complex_F = F + 1j * complex_step * direction
    slope = energy(law, complex_F).imag / complex_step
    np.testing.assert_allclose(np.sum(stress(law, F) * direction), slope, rtol=1e-10, atol=1e-12)
    bend = stress(law, complex_F).imag / complex_step
    np.testing.assert_allclose(np.einsum("aAbB,bB->aA", tangent(law, F), direction), bend, rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize("law", MEMBERS, ids=lambda law: law.name)
@given(F=gradients, angle=st.floats(-4.0, 4.0))
def test_turning_the_body_costs_nothing_and_turns_the_stress(law, F, angle):
    R = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    np.testing.assert_allclose(energy(law, R @ F), energy(law, F), rtol=1e-11, atol=1e-14)
    np.testing.assert_allclose(stress(law, R @ F), R @ stress(law, F), rtol=1e-10, atol=1e-13)


@pytest.mark.parametrize("law", MEMBERS, ids=lambda law: law.name)
def test_the_undeformed_tissue_has_no_stress_and_the_moduli_of_hooke(law):
    np.testing.assert_allclose(stress(law, np.eye(2)), 0.0, atol=1e-18)
    A = tangent(law, np.eye(2))
    np.testing.assert_allclose([A[0, 0, 0, 0], A[0, 0, 1, 1], A[0, 1, 0, 1]],
                               [law.lame + 2 * law.shear, law.lame, law.shear])  # fmt: skip


def test_the_stiffening_law_becomes_the_neo_hookean_one_without_stiffening():
    F = np.array([[1.2, 0.3], [-0.1, 0.7]])
    np.testing.assert_allclose(stress(Ogden(0.08, 0.48, 2.0 + 1e-9), F), stress(DERMIS, F), rtol=1e-8)


@pytest.mark.parametrize(
    ("law", "stretch", "cauchy", "density"),
    [  # sides held: recomputed closed forms of W = G/2 (tr C - 3 - 2 ln J) + lambda/2 (ln J)^2, sigma = dW/dL
        (DERMIS, 0.9, -0.081641, 0.003880),
        (DERMIS, 0.8, -0.193089, 0.017315),
        (DERMIS, 0.7, -0.350201, 0.044008),
        (DERMIS, 0.6, -0.581073, 0.089788),
        (DERMIS, 1.2, 0.108462, 0.011799),
        (EPIDERMIS, 0.9, -0.138790, 0.006596),
        (EPIDERMIS, 0.8, -0.328252, 0.029436),
        (EPIDERMIS, 0.7, -0.595341, 0.074813),
        (EPIDERMIS, 0.6, -0.987824, 0.152639),
        (EPIDERMIS, 1.2, 0.184386, 0.020059),
    ],
)
def test_a_block_held_at_its_sides_has_the_closed_form_stress(law, stretch, cauchy, density):
    F = np.diag([1.0, stretch])
    np.testing.assert_allclose((stress(law, F) @ F.T / stretch)[1, 1], cauchy, atol=6e-7)
    np.testing.assert_allclose(energy(law, F), density, atol=6e-7)


@pytest.mark.parametrize(
    ("stretch", "lateral", "cauchy", "nominal", "density"),
    [
        (0.9, 1.101300, -0.010985, -0.012098, 0.000574),
        (0.8, 1.224285, -0.023700, -0.029016, 0.002579),
        (0.7, 1.376321, -0.039394, -0.054219, 0.006650),
    ],
)
def test_a_block_with_free_sides_has_the_closed_form_stress(stretch, lateral, cauchy, nominal, density):
    F = np.diag([lateral, stretch])
    P = stress(DERMIS, F)
    sigma = P @ F.T / np.linalg.det(F)
    np.testing.assert_allclose([P[0, 0], P[1, 1], sigma[1, 1]], [0.0, nominal, cauchy], atol=2e-6)
    np.testing.assert_allclose(energy(DERMIS, F), density, atol=6e-7)


def test_simple_shear_has_the_closed_form_stress():
    F = np.array([[1.0, 0.5], [0.0, 1.0]])
    np.testing.assert_allclose(stress(DERMIS, F) @ F.T, [[0.006757, 0.013514], [0.013514, 0.0]], atol=6e-7)
    np.testing.assert_allclose(energy(DERMIS, F), 0.003378, atol=6e-7)
