"""Scales of what subjects answered otherwise than on a line: choices between two, and numbers of their own."""
