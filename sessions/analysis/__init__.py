"""From readings to strokes, friction parameters and flaws."""
