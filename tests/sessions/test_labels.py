"""Labels of a picture lie free of each other."""

from hypothesis import given
from hypothesis import strategies as st

from sessions.report.figures.style import spread


@given(
    st.lists(st.floats(-50, 150), max_size=12),
    st.floats(0.1, 8),
)
def test_labels_keep_their_distance_their_order_and_their_place_where_there_is_room(wishes, gap):
    places = spread(wishes, gap, 0.0, 100.0)
    by_wish = [place for _, place in sorted(zip(wishes, places, strict=True), key=lambda pair: pair[0])]
    assert all(b - a >= gap * (1 - 1e-9) for a, b in zip(sorted(places), sorted(places)[1:], strict=False))
    assert by_wish == sorted(by_wish) or len(set(wishes)) < len(wishes)
    if len(wishes) * gap < 100:
        assert all(-1e-6 <= place <= 100 + 1e-6 for place in places)
