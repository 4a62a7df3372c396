"""Bodies: element stiffness, loads, probes and checks of what a caller hands in."""
