"""Labels of a picture lie free of each other and of what is drawn."""

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from report_example import example

from sessions.report.figures.relation import _free_place
from sessions.report.figures.style import spread


@given(
    st.lists(st.floats(-50, 150), max_size=12),
    st.floats(0.1, 8),
)
def test_labels_keep_their_distance_their_order_and_their_place_where_there_is_room(wanted, gap):
    placed = spread(wanted, gap, 0.0, 100.0)
    by_wish = [place for _, place in sorted(zip(wanted, placed, strict=True), key=lambda pair: pair[0])]
    assert all(b - a >= gap * (1 - 1e-9) for a, b in zip(sorted(placed), sorted(placed)[1:], strict=False))
    assert by_wish == sorted(by_wish) or len(set(wanted)) < len(wanted)
    if len(wanted) * gap < 100:
        assert all(-1e-6 <= place <= 100 + 1e-6 for place in placed)


def test_the_words_on_the_line_of_figure_1_lie_free_of_dots():
    made = example().experiments[0]
    draw, found = np.random.default_rng(5), 0
    for _ in range(40):
        spread_of = draw.uniform(0.0, 25.0)
        answers = tuple(
            replace(a, scores=tuple(np.clip(np.array(made.indices) + draw.normal(0, spread_of, 5), 0, 100).tolist()))
            for a in made.answers
        )
        place = _free_place(replace(made, answers=answers, scores=()))
        if place is None:
            continue
        found += 1
        # The words, 60 by 9 pixels in a picture of some 2.2 pixels a point, turned by 45 degrees.
        start, side = place[0], 1 if place[1] else -1
        for answer in answers:
            for index, score in zip(made.indices, answer.scores, strict=True):
                x, y = index - 3.0 - start, score - start
                along, across = (x + y) / np.sqrt(2.0), side * (y - x) / np.sqrt(2.0)
                assert not (-1.0 < along < 28.0 and 1.0 < across < 7.0)
    assert found > 10
