"""What holds for every test."""

import gc
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the program has it; read when NumPy is loaded

import pytest
from hypothesis import HealthCheck, settings

# Machines that run the tests are shared: how long an example takes says nothing about the code.
shared = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
# The quick run draws the same 40 examples each time, so that it judges a change; the long run draws 100 fresh ones.
settings.register_profile("fresh examples", shared)
settings.register_profile("same examples", shared, derandomize=True, max_examples=40)
settings.load_profile("same examples")


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Keep all that is collected here, and stays, from the garbage collector: to look through it takes long."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@pytest.fixture
def in_this_process(monkeypatch):
    """Compute sessions and fingers in this process: another takes seconds of a core to begin."""
    monkeypatch.setattr(
        "daq_app.batch.pool._in_pool",
        lambda work, jobs, _: ((name, work(*arguments)) for name, arguments in jobs.items()),
    )
