"""The compiled loops of the solver, and the only modules that are compiled (numba, cached on disk).

The tests hold a plain twin of them in NumPy, and compare the two.
"""

from solver._kernels.active_set import meet, solve_active_set, update_contact_states
from solver._kernels.compiling import HELD_X, HELD_Y, OPEN, SHEAR_LIMITED, SLIP, STICK, bind_arguments
from solver._kernels.elements import advance, assemble, energies, forces
from solver._kernels.multifrontal import back_substitute, condense, eliminate
from solver._kernels.outline import crosses, pinched
from solver._kernels.overstress import add_overstress
from solver._kernels.skin import STEEP, assemble_contact_system, bounded_length, rubbed, solve, tributary

__all__ = [
    "HELD_X",
    "HELD_Y",
    "OPEN",
    "SHEAR_LIMITED",
    "SLIP",
    "STEEP",
    "STICK",
    "add_overstress",
    "advance",
    "assemble",
    "assemble_contact_system",
    "back_substitute",
    "bind_arguments",
    "bounded_length",
    "condense",
    "crosses",
    "eliminate",
    "energies",
    "forces",
    "meet",
    "pinched",
    "rubbed",
    "solve",
    "solve_active_set",
    "tributary",
    "update_contact_states",
]
