"""Means of surfaces, where not every subject met every one."""

from collections import defaultdict
from collections.abc import Sequence

import numpy as np


def surface_means(points: Sequence[tuple[str, int, float]]) -> dict[int, float] | None:
    """Return the mean of each surface from `points` of subject, index and number, subjects' own repeats averaged first.

    A subject has a level of its own, and where some missed a surface the plain mean of the others would carry who they
    are: level of subject and effect of surface are fitted together by least squares (means adjusted for unbalanced
    blocks: Yates 1934, J. Am. Stat. Assoc. 29:51), and a surface's mean is that of all subjects. With every surface met
    by all it is the plain mean. None of nothing, and where subjects who met some surfaces met none of the others:
    nothing compares them.

    >>> means = surface_means([("a", 0, 1.0), ("a", 50, 2.0), ("b", 0, 11.0)])
    >>> {index: round(mean, 9) for index, mean in means.items()}
    {0: 6.0, 50: 7.0}
    """
    own: defaultdict[tuple[str, int], list[float]] = defaultdict(list)
    for subject, index, value in points:
        own[subject, index].append(value)
    if not own:
        return None
    subjects, indices = sorted({subject for subject, _ in own}), sorted({index for _, index in own})
    values = np.array([float(np.mean(all_of)) for all_of in own.values()])
    if len(own) == len(subjects) * len(indices):
        return {index: float(values[[one == index for _, one in own]].mean()) for index in indices}
    whose = np.array([[float(subject == one) for one in subjects] for subject, _ in own])
    which = np.array([[float(index == one) for one in indices] for _, index in own])
    design = np.hstack([whose, which])
    if np.linalg.matrix_rank(design) < len(subjects) + len(indices) - 1:
        return None
    fitted = np.linalg.lstsq(design, values, rcond=None)[0]
    level = float(fitted[: len(subjects)].mean())
    return {index: level + float(effect) for index, effect in zip(indices, fitted[len(subjects) :], strict=True)}
