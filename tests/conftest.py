"""What holds for every test."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the program has it; read when NumPy is loaded

from hypothesis import HealthCheck, settings

# Machines that run the tests are shared: how long an example takes says nothing about the code.
settings.register_profile("shared machine", settings(), deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("shared machine")
