"""A made-up report: the published friction, scores near the index, a finger with a field in closed form."""

import functools
import math

import numpy as np
from report_session import plan

from sessions.prediction import Fields, History, Skin
from sessions.prediction.stored import Alternative, SedInterval, variants
from sessions.report import experiments
from sessions.report.contents import (
    Course,
    Fact,
    Field,
    GroundTruth,
    PredictionFinding,
    Report,
    StrokeFinding,
    Trace,
)
from sessions.statistics.multiverse import PATHS
from sessions.statistics.scores import Score, ScoreTable
from sessions.statistics.visit import TrialRow, Visit

# The published Tables 1 and 2, and SEDs of the small-strain reference where it has them, else between its neighbours.
TABLES = {
    "stickiness": {
        0: (0.28, 0.008033, 20.0, 0.008566),
        20: (0.44, 0.015478, 22.0, 0.008720),
        50: (0.48, 0.019038, 21.0, 0.008811),
        80: (0.64, 0.049998, 17.5, 0.009500),
        100: (0.67, 0.05255, 15.0, 0.009553),
    },
    "slipperiness": {
        0: (0.62, 0.04707, 13.0, 0.0053575),
        20: (0.55, 0.042404, 33.0, 0.005300),
        55: (0.44, 0.03009, 39.0, 0.005250),
        75: (0.52, 0.0260, 38.0, 0.005290),
        100: (0.24, 0.00877, 39.0, 0.005185),
    },
}
DIRECTION = {"stickiness": 1, "slipperiness": -1}
DEPTH = {"stickiness": 2.0, "slipperiness": 1.5}


def tables(subjects=10):
    draw = np.random.default_rng(3)
    return [
        ScoreTable(
            f"visit-{p}",
            f"P{p:02}",
            True,
            tuple(
                Score(f"P{p:02}", d, i, float(np.clip(round(i + draw.normal(0, 6), 1), 0, 100)))
                for d, rows in TABLES.items()
                for i in rows
            ),
        )
        for p in range(1, subjects + 1)
    ]


def experiments_of(score_tables, **options):
    """Return the experiments of a visit that the scores are not of, to all surfaces in their order."""
    rows = tuple(
        TrialRow(
            trial=number,
            block=descriptor,
            descriptor=descriptor,
            index=index,
            code=f"K{number}",
            direction=DIRECTION[descriptor],
            repetition=1,
            place=0,
            before=None,
            outcome="presented",
            score=None,
            rule="maximum",
            **dict(zip(("mu", "tau_max", "speed", "sed"), TABLES[descriptor][index], strict=True)),
            paths=along(index, TABLES[descriptor][index][3]),
        )
        for number, (descriptor, index) in enumerate(((d, i) for d, rows in TABLES.items() for i in rows), 1)
    )
    visit = Visit("P99-forces", "P99", "p", "", True, True, rows, (), {})
    return experiments(plan("P99"), score_tables, visit, **options)


def along(index, sed):
    """Return a made-up SED along each path: one choice of the filter bends it."""
    small = [path for path in PATHS if path.kinematics == "small"]
    return tuple(sed * (1.001 if path.filter == "10 Hz" and index == 50 else 1.0) for path in small)


def trace(mu, speed, onset):
    t = np.arange(0, 2.4, 0.005)
    normal = 3.0 * np.clip(t / 0.15, 0, 1) * (1 + 0.15 * np.sin(2.2 * t)) * np.clip((2.4 - t) / 0.2, 0, 1)
    ratio = mu * np.clip(t / 0.5, 0, 1) * (1 + 0.02 * np.sin(17 * t + 9 * mu))
    touching = normal > 0.3
    v = speed * np.clip((t - 0.4) / 0.2, 0, 1) * (1 + 0.06 * np.sin(11 * t))
    return Trace(
        origin=onset,
        time=t,
        normal=normal,
        tangential=ratio * normal,
        mu=np.where(touching, ratio, np.nan),
        speed=np.where(touching, v, np.nan),
    )


def stroke(number, descriptor, index):
    mu, tau, speed, _ = TABLES[descriptor][index]
    onset = 10.0 * number
    sticky = descriptor == "stickiness"
    return StrokeFinding(
        number=number,
        trial=number,
        experiment=descriptor,
        index=index,
        code=f"K{number}",
        onset=onset,
        lift=onset + 2.4,
        steady=(onset + 0.8, onset + 2.0),
        direction=DIRECTION[descriptor],
        direction_from="centre of pressure",
        speed=None if number == 7 else speed * 1.02,
        speed_error=None if number == 7 else 0.4,
        mu_static=mu * 1.04 if sticky else None,
        mu_dynamic=mu * 1.004,
        mu_dynamic_sd=0.01,
        mu_dynamic_interval=(mu * 0.99, mu * 1.015),
        mu_max=mu * 1.03,
        tau_max=tau * 0.995,
        normal_force=3.1,
        tangential_force=3.1 * mu,
        peak_normal=3.4,
        peak_tangential=3.4 * mu,
        readings=240,
        zero="as recorded",
        zero_drift=0.0,
        flaws=("speed_not_measurable",) if number == 7 else (),
        reasons={
            **({} if sticky else {"mu_static": "no static peak stands out of the noise"}),
            **({"speed": "the centre of pressure moves in steps as large as the stroke"} if number == 7 else {}),
        },
        trace=trace(mu, speed, onset),
        bootstrap={}
        if number == 7
        else {
            "mu_static": (mu * 1.02, mu * 1.06),
            "mu_dynamic": (mu * 0.98, mu * 1.02),
            "mu_max": (mu * 1.0, mu * 1.06),
            "tau_max": (tau * 0.97, tau * 1.03),
            "speed": (speed * 1.0, speed * 1.05),
            "normal_force": (3.0, 3.2),
            "tangential_force": (3.0 * mu, 3.2 * mu),
            "heading": (1.1, 1.3),
            "onset": (onset - 0.005, onset),
            "break_away": (onset + 0.48, onset + 0.52),
            "slide_onset": (onset + 0.5, onset + 0.56),
        },
        break_away=onset + 0.5 if sticky else None,
        slide_onset=onset + 0.53,
        heading=1.2,
        direction_agrees=1.0,
    )


def prediction(number, descriptor, index):
    mu, tau, _, sed = TABLES[descriptor][index]
    t = np.linspace(0, 2.0, 81)
    press = np.clip(t, 0, 1) ** 1.9 * sed * 1.03
    course = press + np.clip(t - 1, 0, None) / (0.1 + np.clip(t - 1, 0, None)) * (sed - 1.03 * sed)
    return PredictionFinding(
        trial=number,
        stroke=number,
        block=descriptor,
        stimulus=None,
        experiment=descriptor,
        index=index,
        code=f"K{number}",
        mu=mu,
        mu_rule="maximum" if descriptor == "stickiness" else "mean over steady window",
        tau_max=tau,
        indentation=DEPTH[descriptor],
        direction=DIRECTION[descriptor],
        speed=None,
        sed=sed,
        error_estimate=0.001,
        responses={},
        normal_per_mm=0.2,
        normal_force=3.0,
        tangential_force=2.0,
        measured_normal=3.1,
        measured_tangential=3.1 * mu,
        matching_depth=1.93 if number != 10 else None,
        opposite_sed=sed * 0.7,
        wall_s=0.05,
        history=History(t, *[np.zeros_like(t)] * 2, course, *[course] * 5, course[:, None]),
        reasons={} if number != 10 else {"matching_depth": "at no depth up to 3 mm does the model press so hard"},
        interval=SedInterval(
            0.995 * sed, 1.005 * sed, "derivatives", normal_force=(2.9, 3.1), tangential_force=(1.9, 2.1)
        ),
        peak_rate=34.5,
        settled_rate=22.6,
        peak_rate_interval=(34.1, 34.9),
        settled_rate_interval=(22.3, 22.9),
        opposite_interval=SedInterval(0.69 * sed, 0.71 * sed, "sampling"),
        opposite_error=0.002,
        normal_force_error=0.002,
        tangential_force_error=0.002,
        matching_depth_error=0.002,
        matching_depth_interval=(1.88, 1.97),
        alternatives=tuple(
            Alternative(
                variant, tau, DEPTH[descriptor], *((sed, 0.001) if small else (None, None)), 3.0, 2.0, why, 0.01, band
            )
            for variant in variants("both")
            for small in [variant.kinematics == "small"]
            for why in ["" if small else "there is no settled sliding"]
            for ends in [((2.9, 3.1), (1.9, 2.1), (1.9, 2.1))]  # of N, T and depth
            for band in [SedInterval(0.99 * sed, 1.01 * sed, "derivatives", 0.1, 0.1, None, "", *ends)]
        ),
    )


def finger_field(descriptor, index):
    """Return a half-disc and shaft at 45 degrees, flattened at the surface, with a smooth made-up SED."""
    angles, radii = np.linspace(-math.pi / 2, math.pi / 2, 61), np.linspace(1.5, 5.0, 22)
    a, r = (grid.ravel() for grid in np.meshgrid(angles, radii, indexing="ij"))
    local = np.column_stack([r * np.cos(a), r * np.sin(a)])
    world = _placed(local)
    n = len(radii)
    quads = [(i * n + j, i * n + j + 1, (i + 1) * n + j + 1, (i + 1) * n + j) for i in range(60) for j in range(n - 1)]
    triangles = [t for q in quads for t in ((q[0], q[1], q[2]), (q[0], q[2], q[3]))]
    sed = 0.012 * np.exp(-(((world[:, 0]) / 2.5) ** 2) - ((world[:, 1] - 1.0) / 1.6) ** 2)
    arc = np.linspace(-math.pi / 2, math.pi / 2, 91)
    outlines = {
        name: _placed(radius * np.column_stack([np.cos(arc), np.sin(arc)]))
        for name, radius in (("skin", 5.0), ("epidermis", 4.25), ("dermis", 3.0), ("bone", 1.5))
    }
    around = -math.pi / 4 + np.array([-0.16, 0.16, 0.16, -0.16])
    patch = _placed(np.array([3.0, 3.0, 3.2, 3.2])[:, None] * np.column_stack([np.cos(around), np.sin(around)]))
    x = np.linspace(-4.2, 4.2, 85)
    inside = np.abs(x) < 3.4
    pressure = np.where(inside, 0.06 * np.sqrt(np.clip(1 - (x / 3.4) ** 2, 0, 1)), 0.0)
    traction = -DIRECTION[descriptor] * np.minimum(0.6 * pressure, 0.02)
    capped = 0.6 * pressure > 0.02
    state = ["open" if not i else "cap" if c else "slip" for i, c in zip(inside, capped, strict=True)]
    return Field(
        experiment=descriptor,
        index=index,
        finger=Fields(world, np.array(triangles), {"sed": sed}, outlines, patch),
        skin=Skin(x, np.zeros_like(x), pressure, traction, tuple(state)),
    )


def _placed(local):
    c = math.cos(math.pi / 4)
    world = np.column_stack([c * local[:, 0] + c * local[:, 1], -c * local[:, 0] + c * local[:, 1]])
    world[:, 1] += 5.0 - 2.0
    world[:, 1] = np.maximum(world[:, 1], 0.0)
    return world


def example(**changes):
    return Report(**{**_contents(), **changes})


@functools.cache
def _contents():
    """What is in it: made once, for correlations of every subject take a second."""
    numbered = [(d, i) for d, rows in TABLES.items() for i in rows]
    strokes = tuple(stroke(k, *surface) for k, surface in enumerate(numbered, 1))
    t = np.arange(0, 110, 0.05)
    force = sum(np.where((t > 10 * k) & (t < 10 * k + 2.4), 3.0, 0.0) for k in range(1, 11))
    return {
        "title": "sensotact-friction, subject P01",
        "session": "P01-forces",
        "head": "SIMULATED: the transducer and the subject of this recording are simulated",
        "sealed": "Predictions were not sealed before the scores were given.",
        "people": (Fact("subjects who scored", "10"),),
        "apparatus": (Fact("height of the face", "0 mm", "default, set by nobody"),),
        "excluded": ("Take 1 of trial 3 was discarded by the experimenter: slipped off.",),
        "remarks": ("Trial 7 has no score: the subject did not answer.",),
        "flaws": (Fact("speed_not_measurable", "The centre of pressure moves in steps.", "trial 7"),),
        "experiments": experiments_of(tables()),
        "course": Course(t, force, 0.5 * force),
        "strokes": strokes,
        "predictions": tuple(prediction(k, *surface) for k, surface in enumerate(numbered, 1)),
        "fields": (finger_field("stickiness", 100), finger_field("slipperiness", 100)),
        "ground_truth": tuple(
            GroundTruth(k, TABLES[d][i][0], TABLES[d][i][1], TABLES[d][i][2], DIRECTION[d])
            for k, (d, i) in enumerate(numbered, 1)
        ),
        "modelled": (Fact("plane strain", "unit thickness"),),
        "left_out": (Fact("viscosity", "no constants are known"),),
        "reproduction": (Fact("seed", "7"),),
        "commands": ("daq-app analyse P01-forces", "daq-app report P01-forces -o report.html"),
        "width": 15.0,
        "interval_kind": "95 % percentile interval of made-up repeats",
        "afferent": (Fact("static gain", "20 imp/s", "assumed"),),
    }


def short():
    """A report with the first of each of its parts, whose pictures are soon drawn."""
    names = ("experiments", "strokes", "predictions", "fields", "ground_truth")
    return example(**{name: _contents()[name][:1] for name in names})


def bare(**changes):
    """A report without pictures, which is quick to write."""
    lists = ("experiments", "strokes", "predictions", "fields", "ground_truth", "flaws", "excluded", "reproduction")
    empty = dict.fromkeys(lists, ())
    return example(**{**empty, "course": None, **changes})
