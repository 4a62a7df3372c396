"""How often a study's intervals hold what was planted: 400 studies of ten simulated subjects, no force and no solver.

Two sets. In the first the subjects of the synthetic study judge its ten surfaces in the orders of its plan; scores on
slipperiness are planted without carry-over. In the second every trial has an SED of its own, and the score follows it.
"""

import math
from collections import defaultdict
from dataclasses import replace

import numpy as np
import pytest

from daq_app.synthetic import CALIBRATION, GAIN, PEOPLE, PROTOCOL, SUBJECTS
from daq_app.wiring import planted_surface
from sessions.pooling.pooled import CARRY_OVER, DRIFT, SED, pooled
from sessions.pooling.visit import TrialRow, Visit
from sessions.protocols import plan, protocol
from simulators.subject import SimulatedSubject

REPEATS = 400
LEVEL, SLOPE, SCATTER, NOISE = 5.0, 6.0, 1.5, 4.0  # of the second set: points, points/kPa, kPa, points
DRIFTING = 0.5  # points a trial


def planned(seed, subject):
    return plan(protocol(PROTOCOL), subject, seed)


def row(trial, block, place, score, **told):
    before = block.trials[place - 1].stimulus.known_index if place else None
    stimulus = trial.stimulus
    named = (trial.number, block.name, stimulus.descriptor, stimulus.known_index, stimulus.code, trial.direction)
    return TrialRow(*named, trial.repetition, place, before, "scored", score, **told)


def visit(subject, rows):
    return Visit(subject, subject, PROTOCOL, "SIMULATED: s", True, True, tuple(rows), (), {})


def judged(seed, subject):
    """Return the visit of one of the synthetic study's people."""
    carries, does_not = (SimulatedSubject(seed, one) for one in (PEOPLE, replace(PEOPLE, carry_over=0.0)))
    drag, press = np.random.default_rng([seed, 7]).normal(1.0, CALIBRATION, 2)
    rows = []
    for block in planned(seed, subject).blocks:
        for place, trial in enumerate(block.trials):
            person = carries if block.name == "stickiness" else does_not
            surface = planted_surface(trial)
            before = block.trials[place - 1].stimulus.known_index if place else None
            mu = person.felt(surface).mu * drag / press
            rows.append(row(trial, block, place, person.score(surface, 1, place, before), mu=mu))
    return visit(subject, rows)


def followed(seed, subject):
    """Return a visit whose scores follow the SED of each trial, and nothing of the index."""
    draw = np.random.default_rng([seed, 8])
    level, middle = draw.normal(50.0, LEVEL), draw.normal(8.0, 1.0)
    rows = []
    (block, _) = planned(seed, subject).blocks
    for place, trial in enumerate(block.trials):
        sed = draw.normal(middle, SCATTER)
        score = level + SLOPE * (sed - 8.0) + DRIFTING * place + NOISE * draw.normal()
        rows.append(row(trial, block, place, score, sed=1e-3 * sed))
    return visit(subject, rows)


def study(make, number, **told):
    people = [make(100 * number + k, f"S{k:02d}") for k in range(1, SUBJECTS + 1)]
    return pooled(people, **told)


def people_held():
    held = defaultdict(list)
    for number in range(REPEATS):
        score = {"gain": GAIN, "drift": PEOPLE.drift, "carry_over": PEOPLE.carry_over}
        people = {name: getattr(PEOPLE, name) for name in PEOPLE.__dataclass_fields__}
        truth = {"score": score, "people": people, "calibration_sd": CALIBRATION, "strokes": []}
        found = study(judged, number, planted=truth)
        for one in found.effects:
            none = one.descriptor == "slipperiness" and one.effect == CARRY_OVER
            held[one.effect, "none" if none else "planted"].append(one.low <= 0.0 <= one.high if none else one.covered)
        for one, carry in zip(found.descriptors, (PEOPLE.carry_over, 0.0), strict=True):
            # A surface never follows itself: what carries over to it lies a fifth of its own distance below the middle.
            slope = GAIN - carry / 5
            for mean in one.scores:
                expected = 50.0 + slope * (mean.index - 50) + 2 * PEOPLE.drift
                held["mean of a surface", "planted"].append(mean.low <= expected <= mean.high)
            for pair in one.differences:
                expected = slope * (pair.high_index - pair.low_index)
                held["difference of two surfaces", "planted"].append(pair.low <= expected <= pair.high)
            for a in one.within:
                for b in one.within:
                    if a.index < b.index:
                        half = math.hypot(a.high - a.mean, b.high - b.mean)
                        expected = slope * (b.index - a.index)
                        held["intervals within subjects, two surfaces", "planted"].append(
                            abs(b.mean - a.mean - expected) <= half
                        )
    return held


def followed_held():
    # Of numbers that scatter like this about each subject's own means the correlation is
    rho = SLOPE * SCATTER / math.hypot(SLOPE * SCATTER, math.hypot(NOISE, DRIFTING * math.sqrt(2.5)))
    held = defaultdict(list)
    for number in range(REPEATS):
        (found,) = study(followed, 1000 + number).descriptors
        held["correlation within subjects", "planted"].append(found.repeated.low <= rho <= found.repeated.high)
        for name, planted in ((SED, SLOPE), (DRIFT, DRIFTING), (CARRY_OVER, 0.0)):
            term = found.on_sed.term(name)
            held[f"mixed model on SED: {name}", "planted"].append(term.low <= planted <= term.high)
        differ = found.on_sed.spreads
        held["mixed model on SED: spread of levels", "planted"].append(differ.level.low <= LEVEL <= differ.level.high)
        held["mixed model on SED: noise", "planted"].append(differ.left.low <= NOISE <= differ.left.high)
    return held


@pytest.mark.slow
@pytest.mark.parametrize("held_in", [people_held, followed_held])
def test_intervals_of_everything_planted_hold_it_90_to_98_times_in_a_hundred(held_in):
    shares = {" ".join(what): float(np.mean(hits)) for what, hits in held_in().items()}
    assert all(0.90 <= share <= 0.98 for share in shares.values()), shares
