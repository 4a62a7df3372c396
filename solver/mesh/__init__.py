"""Meshes of the finger: outline, grid, elements along the skin and across the tissues."""
