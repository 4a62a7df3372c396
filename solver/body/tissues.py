"""The tissues of a scene as the laws that elements are made of, in the order of the mesh's regions."""

from solver.constitutive.hyperelastic import Law, NeoHooke, Ogden
from solver.constitutive.linear import Moduli, Prony
from solver.scene.scene import Material, Materials


def settled_moduli(materials: Materials) -> list[Moduli]:
    """Return the small-strain moduli of a settled response: those that a tissue has once it has relaxed."""
    return [law.relaxed for law in relaxing_laws(materials)]


def relaxing_laws(materials: Materials) -> list[Prony]:
    """Return the small-strain laws; a tissue that does not relax has no terms."""
    return [Prony(t.E, t.nu, tuple((term.g, term.tau) for term in t.prony)) for t in materials.by_region]


def finite_laws(materials: Materials) -> list[Law]:
    """Return the laws at finite strain of a settled response: the shear modulus relaxed, the bulk modulus as it was."""
    both = zip(materials.by_region, relaxing_laws(materials), strict=True)
    return [_finite(tissue, law.relaxed) for tissue, law in both]


def _finite(tissue: Material, moduli: Moduli) -> Law:
    young, nu = moduli.engineering if tissue.prony else (tissue.E, tissue.nu)
    if tissue.law != "ogden":
        return NeoHooke(young, nu)
    return Ogden(young, nu) if tissue.stiffening is None else Ogden(young, nu, tissue.stiffening)
