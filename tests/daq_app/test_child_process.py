"""Workers of one command, which stand in for one program."""

import logging
import os
import time

from daq_app.child_process import COMPILATION, process_pool


def warn(_):
    time.sleep(0.2)  # so that both workers have a job
    logging.getLogger(COMPILATION).warning("Compiling the loops")
    return os.getpid()


def test_workers_that_compile_say_it_once_for_the_whole_command(capfd):
    workers = set()
    for _ in range(2):
        with process_pool(2) as pool:
            workers |= {*pool.map(warn, range(4))}
    assert len(workers) > 2
    assert capfd.readouterr().err.count("Compiling the loops") == 1


def test_the_loops_warn_by_the_logger_that_workers_listen_to():
    from solver import _kernels

    assert _kernels.__name__ == COMPILATION
