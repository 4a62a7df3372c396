"""Meshes of the finger: outline, grid, elements along the skin and across the tissues."""

from solver.mesh.mesh import Mesh, distinct

__all__ = ["Mesh", "distinct"]
