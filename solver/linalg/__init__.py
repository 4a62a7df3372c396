"""Elimination of a body down to its skin."""
