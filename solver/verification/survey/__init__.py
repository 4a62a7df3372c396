"""Surveys of error estimates against true errors over many random scenes, for choosing the factors of estimates."""
