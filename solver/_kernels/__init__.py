"""The compiled loops of the solver, and the only modules that are compiled (numba, cached on disk).

`solver.kernels_numpy` says the same of finite strain in plain NumPy, `stiffness` and `dissection` of small strain
(`hooke`); the tests compare them.
"""

from solver._kernels.active_set import meet, restate, solve_active_set
from solver._kernels.carrying import carry
from solver._kernels.compiling import CAP, HELD_X, HELD_Y, OPEN, SLIP, STICK, ending
from solver._kernels.elements import assemble, energies, forces
from solver._kernels.fronts import condense, eliminate, unfold
from solver._kernels.iterating import move
from solver._kernels.outline import crosses, pinched
from solver._kernels.overstress import add_overstress
from solver._kernels.skin import STEEP, impose, rubbed, solve, tributary

__all__ = [
    "CAP",
    "HELD_X",
    "HELD_Y",
    "OPEN",
    "SLIP",
    "STEEP",
    "STICK",
    "add_overstress",
    "assemble",
    "carry",
    "condense",
    "crosses",
    "eliminate",
    "ending",
    "energies",
    "forces",
    "impose",
    "meet",
    "move",
    "pinched",
    "restate",
    "rubbed",
    "solve",
    "solve_active_set",
    "tributary",
    "unfold",
]
