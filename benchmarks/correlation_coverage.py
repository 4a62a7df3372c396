"""How often intervals of the correlation within subjects hold the true value: a table for five kinds of people.

People meet the same five surfaces, and nothing here comes from the model or the simulators. The true value is that of
very many such people. Prints a table for the documentation.
"""

import argparse
from collections.abc import Callable

import numpy as np

from drivers.arrays import Array
from sessions.statistics.within_subjects import repeated_correlation

SURFACES = np.linspace(-1.5, 1.5, 5)  # usual friction of a surface
PEOPLE = (5, 8, 12, 20)  # of a study
POPULATION = 400_000  # people of whom the true value is
Answers = tuple[Array, Array]  # predictions and scores (people, surfaces)
Kind = Callable[[Array, np.random.Generator], Answers]  # from the friction of each stroke (people, surfaces)


def alike(friction: Array, draw: np.random.Generator) -> Answers:
    """Scores follow predictions, with one noise for all."""
    return friction, friction + draw.standard_normal(friction.shape)


def own_slopes(friction: Array, draw: np.random.Generator) -> Answers:
    """Slopes of people differ: their standard deviation is that of the mean slope."""
    slope = 1.0 + draw.standard_normal((len(friction), 1))
    return friction, slope * friction + draw.standard_normal(friction.shape)


def no_relation(friction: Array, draw: np.random.Generator) -> Answers:
    """Slopes of people differ about 0."""
    slope = draw.standard_normal((len(friction), 1))
    return friction, slope * friction + draw.standard_normal(friction.shape)


def own_ranges(friction: Array, draw: np.random.Generator) -> Answers:
    """People use parts of the scale that differ in width, with a standard deviation of 0.5 of its logarithm."""
    width = np.exp(0.5 * draw.standard_normal((len(friction), 1)))
    return friction, width * (friction + draw.standard_normal(friction.shape))


def bent(friction: Array, draw: np.random.Generator) -> Answers:
    """Predictions bend: the few people of much friction have most of their variation."""
    moist = friction + 0.7 * draw.standard_normal((len(friction), 1))
    return np.exp(moist), friction + 0.5 * draw.standard_normal(friction.shape)


KINDS: tuple[Kind, ...] = (alike, own_slopes, no_relation, own_ranges, bent)


def study(kind: Kind, people: int, draw: np.random.Generator) -> Answers:
    """Return predictions and scores of people of one kind on all surfaces."""
    return kind(SURFACES + 0.3 * draw.standard_normal((people, len(SURFACES))), draw)


def shares(kind: Kind, people: int, true_r: float, studies: int, draw: np.random.Generator) -> tuple[float, ...]:
    """Return how often the interval holds the true r, how often that is below, and how often Fisher's z holds it."""
    names = [str(person) for person in range(people) for _ in SURFACES]
    ends: list[tuple[float, float, float, float]] = []
    for _ in range(studies):
        x, y = (values.ravel().tolist() for values in study(kind, people, draw))
        repeated = repeated_correlation(names, x, y)
        assert repeated is not None
        assert repeated.people is not None
        ends.append((*repeated.people, repeated.low, repeated.high))
    low, high, fisher_low, fisher_high = np.transpose(ends)
    coverage, by_fisher = ((low <= true_r) & (true_r <= high)), (fisher_low <= true_r) & (true_r <= fisher_high)
    return float(np.mean(coverage)), float(np.mean(true_r < low)), float(np.mean(by_fisher))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", nargs="?", type=int, default=2000, help="studies of each kind and number of people")
    parser.add_argument("seed", nargs="?", type=int, default=20261129)
    options = parser.parse_args()
    heads = [f"{people} people" for people in PEOPLE]
    print(f"| kind | {' | '.join(heads)} | Fisher's z, {heads[-1]} |")
    print("| --- " * (len(heads) + 2) + "|")
    for number, kind in enumerate(KINDS):
        draw = np.random.default_rng([options.seed, number])
        x, y = (values - values.mean(axis=1, keepdims=True) for values in study(kind, POPULATION, draw))
        true_r = float((x * y).sum() / np.sqrt((x * x).sum() * (y * y).sum()))
        rows = [shares(kind, people, true_r, options.count, draw) for people in PEOPLE]
        cells = [f"{100 * coverage:.1f} % ({100 * below:.1f} %)" for coverage, below, _ in rows]
        print(f"| {kind.__name__.replace('_', ' ')} | {' | '.join(cells)} | {100 * rows[-1][-1]:.1f} % |", flush=True)


if __name__ == "__main__":
    main()
