"""Meshes of the finger: outline, grid, elements along the skin and across the tissues."""

from solver.mesh.mesh import Array, Flags, Indices, Mesh, distinct

__all__ = ["Array", "Flags", "Indices", "Mesh", "distinct"]
