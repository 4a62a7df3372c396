"""The deformed skin: how far it is squeezed, its creases, and whether it crosses itself."""

from itertools import combinations, pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solver.body.skin import KINK_STRETCH, SkinCompression, crosses_itself

ELEMENTS = 5
BEFORE = np.stack([np.cumsum([0.0, *np.geomspace(0.1, 0.3, 2 * ELEMENTS)]), np.zeros(2 * ELEMENTS + 1)], axis=1)
BEFORE[1::2] = (BEFORE[:-2:2] + BEFORE[2::2]) / 2.0  # middles of elements
LOOSE, OPEN = np.ones(ELEMENTS, bool), np.zeros(2 * ELEMENTS + 1, bool)


def bent_at_a_joint(squeeze, angle):
    """Return the skin squeezed evenly, and bent by `angle` where the second element meets the third."""
    along, joint = BEFORE[:, 0], BEFORE[4, 0]
    beyond = np.maximum(along - joint, 0.0)
    x = np.minimum(along, joint) + beyond * np.cos(angle)
    return squeeze * np.stack([x, beyond * np.sin(angle)], axis=1)


def test_skin_that_is_squeezed_evenly_has_one_stretch_and_no_crease():
    least, _, lowest, kink = SkinCompression.of(BEFORE, -0.3 * BEFORE, LOOSE, OPEN)
    assert (least, lowest, kink) == pytest.approx((0.7, 0.7, 0.0), abs=1e-12)


def test_stretch_at_the_ends_of_elements_is_exact_where_it_varies_linearly():
    after = BEFORE.copy()
    after[:, 0] -= 0.2 * BEFORE[:, 0] ** 2  # stretch 1 - 0.4 x
    skin = SkinCompression.of(BEFORE, after - BEFORE, LOOSE, OPEN)
    assert skin.least_stretch == pytest.approx(1.0 - 0.4 * BEFORE[-1, 0], rel=1e-12)
    assert skin.element == ELEMENTS - 1
    assert skin.least_chord == pytest.approx(1.0 - 0.2 * (BEFORE[-1, 0] + BEFORE[-2, 0]), rel=1e-12)  # of its last half


def test_a_crease_is_the_jump_of_the_tangent():
    squeeze, angle = 0.6, 1.1
    skin = SkinCompression.of(BEFORE, bent_at_a_joint(squeeze, angle) - BEFORE, LOOSE, OPEN)
    assert skin.kink == pytest.approx(2.0 * squeeze * np.sin(angle / 2.0), rel=1e-12)


@pytest.mark.parametrize("reason", ["touching", "stretched", "held"])
def test_a_jump_of_the_tangent_is_no_crease_where_skin_is(reason):
    touching, loose = OPEN.copy(), LOOSE.copy()
    touching[4], loose[2] = reason == "touching", reason != "held"
    after = bent_at_a_joint(1.1 * KINK_STRETCH if reason == "stretched" else 0.6, 1.1)
    assert SkinCompression.of(BEFORE, after - BEFORE, loose, touching).kink == pytest.approx(0.0, abs=1e-12)


def test_held_skin_is_not_squeezed():
    after = BEFORE.copy()
    after[6, 0] = BEFORE[5, 0] + 0.01
    loose_skin, held = (
        SkinCompression.of(BEFORE, after - BEFORE, loose, OPEN) for loose in (LOOSE, np.arange(ELEMENTS) < 2)
    )
    assert loose_skin.element == 2
    assert loose_skin.least_chord < 0.2
    assert held.least_chord == pytest.approx(1.0)
    assert SkinCompression.of(BEFORE, after - BEFORE, ~LOOSE, OPEN).least_chord == np.inf


def side(a, b, c):
    """Return +1, 0 or -1: on which side of a line through a and b the point c lies, in integers."""
    cross = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    return (cross > 0) - (cross < 0)


@given(st.lists(st.tuples(st.integers(-9, 9), st.integers(-9, 9)), min_size=4, max_size=9))
def test_skin_crosses_itself_where_two_pieces_pass_through_each_other(points):
    pieces = list(pairwise(points))
    crossing = any(
        side(*one, other[0]) * side(*one, other[1]) < 0 and side(*other, one[0]) * side(*other, one[1]) < 0
        for (i, one), (j, other) in combinations(enumerate(pieces), 2)
        if j > i + 1
    )
    assert crosses_itself(np.array(points, float)) == crossing


@given(
    st.floats(0.0, np.pi), st.lists(st.floats(0.01, 1.0), min_size=4, max_size=40), st.floats(-20.0, 20.0),
    st.floats(0.0, 1e-15),
)  # fmt: skip
def test_a_straight_line_does_not_cross_itself_whatever_its_rounding(angle, pieces, offset, noise):
    arc = np.concatenate([[0.0], np.cumsum(pieces)])
    line = offset + np.stack([arc * np.cos(angle), arc * np.sin(angle)], axis=1)
    assert not crosses_itself(line + noise * np.random.default_rng(len(pieces)).normal(size=line.shape))
