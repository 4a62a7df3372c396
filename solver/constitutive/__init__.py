"""Constitutive laws: energy, stress and tangent of each tissue."""
