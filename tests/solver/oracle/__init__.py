"""Plain NumPy twins of the compiled loops: slow, short, and what the tests hold the loops to."""
