"""A pool of processes of this computer for a verb that Ctrl-C stops at once."""

import multiprocessing
import os
from collections.abc import Generator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager

from daq_app.child_process import process_pool

KILLED = 0.1  # that a killed process may take to end [s]


@contextmanager
def local_pool(work: int, workers: int | None = None) -> Generator[ProcessPoolExecutor]:
    """Give a pool for so many pieces of work: `workers` processes, or as many as there are cores.

    At the end the work is waited for. Where an exception leaves, as on Ctrl-C, the processes are killed.
    """
    pool = process_pool(workers or min(os.cpu_count() or 1, work))
    try:
        yield pool
        pool.shutdown()
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        children = multiprocessing.active_children()
        for process in children:
            process.kill()  # they hold nothing that is not computed again
        for process in children:
            process.join(KILLED)
        raise
