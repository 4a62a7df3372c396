"""Branches of settled slides, followed to the limit where they end."""
