"""Unilateral contact with Coulomb friction and a shear limit on the condensed skin."""
