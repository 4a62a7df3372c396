"""The compiled loops of the solver, and the only modules that are compiled (numba, cached on disk).

`solver.kernels_numpy` says the same of finite strain in plain NumPy, `stiffness`, `dissection` and
`solver.contact.active_set` of small strain (`hooke`, `rubbing`, `following`); the tests compare them.
"""

from solver._kernels.carrying import carry
from solver._kernels.compiling import HELD_X, HELD_Y, OPEN, SHEAR_LIMITED, SLIP, STICK, ending
from solver._kernels.elements import assemble, energies, forces
from solver._kernels.iterating import meet, move, touch
from solver._kernels.multifrontal import back_substitute, condense, eliminate
from solver._kernels.outline import crosses, pinched
from solver._kernels.overstress import add_overstress
from solver._kernels.skin import STEEP, assemble_contact_system, rubbed, solve, tributary, update_contact_states

__all__ = [
    "HELD_X",
    "HELD_Y",
    "OPEN",
    "SHEAR_LIMITED",
    "SLIP",
    "STEEP",
    "STICK",
    "add_overstress",
    "assemble",
    "assemble_contact_system",
    "back_substitute",
    "carry",
    "condense",
    "crosses",
    "eliminate",
    "ending",
    "energies",
    "forces",
    "meet",
    "move",
    "pinched",
    "rubbed",
    "solve",
    "touch",
    "tributary",
    "update_contact_states",
]
