"""How often a study finds which quantity its scores follow: a table for three designs (`sessions.statistics.power`).

A rival is decided where its Akaike weight is at least 0.95. Prints a table for the documentation.
"""

import argparse
from collections.abc import Mapping, Sequence

import numpy as np

from sessions.prediction.surface_series import AREA, StudyDesign, simulated_strokes
from sessions.statistics.power import AssumedEffects, study_weights, twins
from solver.quantities import NAMES
from solver.scene.published import STICKINESS

TRUE_QUANTITIES = ("mu", "tau_max", "sed", "shear_along_skin", "stretch_along_skin", "pressure")
DECISIVE_WEIGHT = 0.95  # Akaike weight, as a posterior probability under equal priors
EFFECTS = AssumedEffects(25.0 * 12.0**0.5, noise=4.0, level_sd=3.0, slope_sd=0.0)  # 25 points per standard deviation
POOL = 60  # simulated people whose strokes are predicted once; each study samples from them
SPEEDS = (20.0, 16.0, 24.0, 18.0, 22.0, 15.0, 25.0, 19.0, 17.0, 23.0, 21.0, 16.5)  # [mm/s]
WIDE_FORCES = (2.0, 4.5, 3.0, 6.5, 2.5, 5.0, 3.5, 6.0, 2.2, 4.0, 5.5, 3.2)  # not in the order of friction [N]


PAPER = StudyDesign(
    tuple(surface.mu for surface in STICKINESS),
    tuple(1e-2 * surface.printed_bound * AREA / surface.mu for surface in STICKINESS),
    tuple(surface.speed for surface in STICKINESS),
)
WIDE = StudyDesign(tuple(np.linspace(0.2, 0.7, 12).round(3).tolist()), WIDE_FORCES, SPEEDS)
# Eight surfaces at three depths: depth and friction change the components of strain in different proportions.
CROSSED = StudyDesign(
    tuple(np.linspace(0.1, 0.7, 8).round(3).tolist()),
    tuple(np.repeat((1.6, 2.8, 4.2), 8).tolist()),
    SPEEDS * 2,
    (1.25, 1.75, 2.25),
)
STUDIES = (("10 × 5", 10, PAPER), ("20 × 12", 20, WIDE), ("24 × 8 × 3", 24, CROSSED))  # name, people, design


def row(study: str, quantity: str, alike: set[str], weights: Sequence[Mapping[str, float]]) -> str:
    """Return a row of the table: how often the true quantity, a twin or a wrong one is preferred or decided."""
    first = [max(weight, key=weight.__getitem__) for weight in weights]
    sure = [name for name, study_weight in zip(first, weights, strict=True) if study_weight[name] >= DECISIVE_WEIGHT]
    wrong = [name for name in first if name not in alike]
    most = f"`{max(sorted(set(wrong)), key=wrong.count)}`" if wrong else "–"
    counts = [
        first.count(quantity),
        sum(name in alike for name in first),
        sum(name in NAMES and (quantity not in NAMES or name not in alike) for name in first),
        sure.count(quantity),
        sum(name not in alike for name in sure),
    ]
    shares = " | ".join(f"{100 * count / len(weights):.1f} %" for count in counts)
    return f"| {study} | `{quantity}` | {len(alike) - 1} | {shares} | {most} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", nargs="?", type=int, default=200, help="studies of each quantity")
    parser.add_argument("seed", nargs="?", type=int, default=1)
    parser.add_argument("design", nargs="*", type=int, help="its number, from 0; without one, all")
    parser.add_argument("--own-share", type=float, default=1.0, help="of a stroke's difference, as in `study_weights`")
    options = parser.parse_args()
    header = "study | true | twins | preferred | it or a twin | a wrong one of the model | decided | decided wrongly"
    print(f"| {header} | wrong most often |")
    print("| --- " * (header.count("|") + 2) + "|")
    for number, (study, people, design) in enumerate(STUDIES):
        if options.design and number not in options.design:
            continue
        pool = simulated_strokes(design, POOL, np.random.default_rng([options.seed, number]))
        for quantity in TRUE_QUANTITIES:
            draw = np.random.default_rng([options.seed, number, TRUE_QUANTITIES.index(quantity)])
            repeats = range(options.count)
            arguments = pool, people, len(design.mu), quantity, EFFECTS, draw, options.own_share
            weights = [study_weights(*arguments) for _ in repeats]
            print(row(study, quantity, twins(pool, quantity), weights), flush=True)


if __name__ == "__main__":
    main()
