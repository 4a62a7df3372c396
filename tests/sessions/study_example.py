"""A made-up study: ten subjects, five surfaces of one descriptor, every section of the page filled."""

import hashlib
from dataclasses import replace
from functools import cache

import numpy as np

from sessions.statistics.multiverse import PATHS
from sessions.statistics.pooled import pool_visits
from sessions.statistics.visit import Exclusion, TrialRow, Visit, VisitOptions

INDICES = (0, 20, 50, 80, 100)
STROKE_VALUES = {"tau_max": 0.02, "speed": 20.0, "normal_force": 2.5}
ENDS = {"tau_max": (0.0196, 0.0204), "speed": (19.8, 20.3), "normal_force": (2.4, 2.7)}


def visit(number, *, gain=0.8, noise=3.0, sed=lambda index: 0.008 + 1e-5 * index, simulated=""):
    rng = np.random.default_rng(number)
    level, order = rng.normal(0.0, 5.0), rng.permutation(INDICES).tolist()
    friction = np.random.default_rng([number, 1]).normal(0.4, 0.05, len(order)).tolist()
    rows = [
        TrialRow(
            trial=place + 1,
            block="stickiness",
            descriptor="stickiness",
            index=index,
            code=f"K{index}",
            direction=1,
            repetition=1,
            place=place,
            before=order[place - 1] if place else None,
            outcome="scored",
            score=50.0 + level + gain * (index - 50) + 0.4 * place + noise * rng.normal(),
            mu=friction[place],
            sed=None if sed is None else sed(index) * (1.0 + 0.01 * rng.normal()),
        )
        for place, index in enumerate(order)
    ]
    return Visit(f"S{number:02d}", f"S{number:02d}", "p", simulated, sed is not None, True, tuple(rows), (), {})


@cache
def study():
    """Return its findings, made once."""
    simulated = "SIMULATED: made up"
    visits = [_full(visit(number, simulated=simulated)) for number in range(1, 11)]
    visits[8] = replace(visits[8], session="S09_" + "as_long_as_a_folder_may_be_called_" * 7)
    truth = {
        "score": {"gain": 0.8, "drift": 0.4, "carry_over": 0.0},
        "strokes": [{"subject": v.subject, "trial": row.trial, "mu": row.mu} for v in visits for row in v.rows],
    }
    out = (Exclusion("S03", "used the scale backwards, and said so afterwards", "E02"),)
    return pool_visits(visits, [("S11", "session.sqlite is damaged")], out, truth, VisitOptions(paths="small"))


def _with_ends(**ends):
    lows = {f"{name}_low": low for name, (low, _) in ends.items()}
    return lows | {f"{name}_high": high for name, (_, high) in ends.items()}


def _full(bare_visit):
    number = int(bare_visit.subject[1:])
    small = [path for path in PATHS if path.kinematics == "small"]
    rows = [
        replace(
            row,
            rule="maximum",
            sed_interval="by derivatives",
            **STROKE_VALUES | {"normal_force": 2.5 + 0.01 * number},
            **_with_ends(mu=(row.mu - 0.02, row.mu + 0.02), sed=(0.98 * row.sed, 1.03 * row.sed), **ENDS),
            error_estimate=0.002,
            model_normal_force=2.1 + 0.01 * number,
            matching_depth=2.2 + 0.01 * number,
            flaws=("too_little_force",) if row.trial == 3 else (),
            paths=tuple(row.sed * (1.0 if path.receptor == "ending" else 1.0 - 0.002 * row.index) for path in small),
        )
        for row in bare_visit.rows
    ]
    return replace(
        bare_visit,
        rows=tuple(rows),
        sha256=hashlib.sha256(bare_visit.session.encode()).hexdigest(),
        sealed="The predictions were made after the scores had been given, and had not been sealed before.",
        decisions=("decision 1 by E02: stroke 1 of trial 2 is kept: it was good",)
        if bare_visit.session == "S04"
        else (),
        model=(("kinematics", "small strain, plane strain", ""),),
        made_by={"daq-app": "0.1.0"},
    )
