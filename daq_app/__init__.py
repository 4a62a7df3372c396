"""The shell people start."""
