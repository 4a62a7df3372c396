"""The same study with the kernels of other processors: NumPy's, the linear algebra's, the compiled loops', its threads.

What each library picks for the processor it finds can be chosen by hand, in a process of its own.
"""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

from daq_app.console import Console
from daq_app.simulation.synthetic import synthetic_study

NEAR = 1e-12
# A mean, its spread and its interval, or an effect and its interval, are one quantity: each counts against the largest.
ONE_QUANTITY = ("estimate", "found", "mean", "sd", "low", "high")  # `found` is the former name of `estimate`
SPREAD_OF = {"between_sd": 0, "slope_sd": 1}  # in a mixed model: of which term, whose spread between subjects it is
# Probabilities, correlations, differences of two of these, also in units of their own errors (z), and estimated errors
# of SEDs and forces as parts of them: counted against 1.
AGAINST_ONE = (
    "difference",
    "error_estimate",
    "friedman_p",
    "model_normal_force_error",
    "p",
    "p_holm",
    "page_p",
    "partial",
    "partial_high",
    "partial_low",
    "pearson",
    "people_p",
    "r",
    "repeated_holm",
    "spearman_p",
    "without",
    "without_subject",
    "weight",
    "z",
)


def near(path):
    """Return how near a number has to come.

    Rivals are compared by differences of correlations and by what is left once another is given: both divide by
    1 - r^2 of two quantities, and r is 0.99 to 0.999 here. With the round-off of r itself that leaves nine figures. An
    estimated error is a difference of answers that agree to three figures. A mixed model is a regression on columns
    whose condition number is 4 to 42 here, the latter where SED and µ stand together.
    """
    loses = "rivals" in path or "rivals_of_means" in path or str(path[-1]).endswith(("error", "error_estimate"))
    regression = "terms" in path or "spreads" in path
    return 1e3 * NEAR if loses else 42.0 * NEAR if regression else NEAR


def kernels_to_try(cache):
    """Return the kernels to try, name and environment of each; loops for another processor are kept in `cache`."""
    from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__

    plain = {"NPY_DISABLE_CPU_FEATURES": " ".join(name for name in __cpu_dispatch__ if __cpu_features__[name])}
    loops = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": "", "NUMBA_CACHE_DIR": str(cache)}
    return {
        "Haswell's linear algebra": {"OPENBLAS_CORETYPE": "Haswell"},
        "two threads": {"OPENBLAS_NUM_THREADS": "2"},
        "oldest": {"OPENBLAS_CORETYPE": "Prescott", **loops, **plain},
    }


def numbers(node, path=(), scale=None):
    """Yield where each number of a study stands, the number, and the size it counts against."""
    if isinstance(node, dict):
        kin = [abs(node[name]) for name in ONE_QUANTITY if isinstance(node.get(name), float)]
        for name, value in node.items():
            own = max(kin, default=None) if name in ONE_QUANTITY else 1.0 if name in AGAINST_ONE else None
            if name in SPREAD_OF and "terms" in node:
                term = node["terms"][SPREAD_OF[name]]
                own = max(abs(term[part]) for part in ("estimate", "low", "high"))
            yield from numbers(value, (*path, name), own)
    elif isinstance(node, list):
        for i, value in enumerate(node):
            yield from numbers(value, (*path, i), scale)
    elif isinstance(node, float):
        yield path, node, abs(node) if scale is None else scale


def study(folder, out, kernels):
    """Return the numbers of a study computed by a process with the kernels asked for."""
    command = [sys.executable, "-m", "daq_app", "study", str(folder), "--out", str(out), "--json"]
    clean = {name: value for name, value in os.environ.items() if name != "OPENBLAS_CORETYPE"}
    environment = {**clean, "OPENBLAS_NUM_THREADS": "1", **kernels}
    process = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert process.returncode == 3, process.stderr  # 3: one session was damaged on purpose
    return {path: (value, size) for path, value, size in numbers(json.loads((out / "study.json").read_bytes()))}


@pytest.mark.slow
def test_kernels_of_other_processors_give_every_number_of_a_study_within_1e_12(tmp_path):
    folder = tmp_path / "study"
    synthetic_study(folder, 1, Console(as_json=True), subjects=4)
    base = study(folder, tmp_path / "here", {})
    assert study(folder, tmp_path / "again", {}) == base  # to the last bit
    assert len(base) > 1000
    for name, kernels in kernels_to_try(tmp_path / "loops").items():
        values = study(folder, tmp_path / name, kernels)
        assert values.keys() == base.keys()
        off = {
            path: abs(values[path][0] - value) / max(size, np.finfo(float).tiny) for path, (value, size) in base.items()
        }
        worst = max(off, key=lambda path: off[path] / near(path))
        assert off[worst] <= near(worst), (name, worst, base[worst], values[worst])
