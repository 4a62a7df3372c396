"""The step of all unknowns that follows from the skin's, called as one loop since each call takes as long as its work.

The arguments are those of the loops it is made of.
"""

from solver._kernels.compiling import Array, Narrow, Wide, compiled
from solver._kernels.elements import advance
from solver._kernels.fronts import unfold


@compiled
def move(
    u: Array,
    pressure: Array,
    step: Array,
    scale: float,
    u_new: Array,
    pressure_new: Array,
    start: Narrow,
    inner: Narrow,
    border: Narrow,
    border_at: Narrow,
    numbers: Narrow,
    factor_at: Wide,
    factors: Array,
    near: Array,
    carried: Array,
    every: Array,
    nodes: Narrow,
    unknown: Narrow,
    lame: Array,
    fold: Array,
    dilate: Array,
    volume: Array,
) -> float:
    """Take `scale` times the skin's `step` (2 k,), and the body's with it; return the largest move of the full step.

    Filled: `u_new`, `pressure_new`, and `every` (n,), the step of all unknowns.
    """
    unfold(carried, step, start, inner, border, border_at, numbers, factor_at, factors, near, every)
    return advance(u, pressure, every, scale, nodes, unknown, lame, fold, dilate, volume, u_new, pressure_new)
