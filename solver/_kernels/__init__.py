"""The compiled loops of the solver, and the only modules that are compiled (numba, cached on disk).

The tests hold a plain twin of them in NumPy, and compare the two.
"""
