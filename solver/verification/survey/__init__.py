"""Surveys of error estimates against true errors over many random scenes."""
