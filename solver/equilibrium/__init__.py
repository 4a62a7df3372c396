"""Equilibria: Newton, load stepping, full slip, force control and relaxation."""
