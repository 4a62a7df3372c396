"""How far skin may be squeezed along itself until its surface loses stability, by the law of its tissue.

A squeezed half-space wrinkles at once at all wavelengths (Biot 1963, Appl. Sci. Res. A 12, 168): of wrinkles
exp(i k X) the impedance of the surface, tractions by displacements, has a determinant of zero. There the equations of a
free surface lose their meaning, and finer meshes end ever nearer to it. The theory of small motions on a large strain
is that of Dowaikh and Ogden (1990, IMA J. Appl. Math. 44, 261), here with any law and plane strain.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from solver.arrays import Array
from solver.constitutive.hyperelastic import Law, stress, tangent

Waves = NDArray[np.complex128]
STEP = 0.01  # of the stretch, between two looks
LEAST = 0.05  # stretch down to which they are taken
HALVINGS = 40


@lru_cache(maxsize=16)
def folds_at(law: Law) -> float:
    """Return the stretch along a free surface at which it loses stability in plane strain; LEAST where it never does.

    Biot's root for neo-Hookean tissue that keeps its volume, 0.5437:

    >>> from solver.constitutive.hyperelastic import NeoHooke
    >>> round(folds_at(NeoHooke(1.0, 0.4999999)), 4)
    0.5437
    """
    high = 1.0 - 5.0 * STEP
    while high > LEAST and _stable(law, high - STEP):
        high -= STEP
    if high <= LEAST:
        return LEAST
    low = high - STEP
    for _ in range(HALVINGS):
        middle = (low + high) / 2.0
        low, high = (low, middle) if _stable(law, middle) else (middle, high)
    return high


def _stable(law: Law, stretch: float) -> bool:
    """Return whether the surface's impedance is positive at this stretch along it, its other side being free."""
    across = 1.0 / stretch
    for _ in range(50):
        F = np.diag([stretch, across])
        step = float(stress(law, F)[1, 1] / tangent(law, F)[1, 1, 1, 1])
        across -= step
        if abs(step) < 1e-14 * across:
            break
    moduli = tangent(law, np.diag([stretch, across]))
    impedance = _impedance(moduli[:, 0, :, 0], moduli[:, 0, :, 1], moduli[:, 1, :, 1])
    return impedance is not None and float(np.linalg.det(impedance).real) > 0.0


def _impedance(along: Array, mixed: Array, across: Array) -> Waves | None:
    """Return the impedance (2, 2) of waves exp(i (X + p Y)) that decay with depth; None where two do not.

    `along`, `mixed`, `across` (2, 2) are the moduli dP_aA/dF_bB with A, B = X, X; X, Y; Y, Y.
    """
    inverse = np.linalg.inv(across)
    system = np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ along, -inverse @ (mixed + mixed.T)]])
    found = np.linalg.eig(system.astype(np.complex128))
    p: Waves = np.asarray(found[0], np.complex128)
    waves: Waves = np.asarray(found[1], np.complex128)
    decay = p.imag > 0.0
    if decay.sum() != 2:
        return None
    shapes = waves[:2, decay]
    tractions = mixed.T @ shapes + across @ shapes * p[decay]
    return -1j * tractions @ np.linalg.inv(shapes)
