"""The compiled loops of the finite-strain solver, and the only modules that are compiled (numba, cached on disk).

`solver.kernels_numpy` says the same in plain NumPy; the tests compare the two.
"""

from solver.kernels.compiling import CAP, OPEN, SLIP, STICK
from solver.kernels.elements import advance, assemble, energies, forces
from solver.kernels.fronts import condense, eliminate, unfold
from solver.kernels.overstress import add_overstress
from solver.kernels.skin import impose, restate, settle, solve, tributary

__all__ = [
    "CAP",
    "OPEN",
    "SLIP",
    "STICK",
    "add_overstress",
    "advance",
    "assemble",
    "condense",
    "eliminate",
    "energies",
    "forces",
    "impose",
    "restate",
    "settle",
    "solve",
    "tributary",
    "unfold",
]
