"""The tour of the solver names functions that are there, and are called in its order."""

import re
import sys
from pathlib import Path

from sessions.toml_file import load_toml
from solver import Scene, solve

PAGE = (Path(__file__).parents[1] / "docs" / "explanation" / "solver-tour.md").read_text(encoding="utf-8")
STOPS = re.findall(r"^\d+\. `([\w.]+)`", PAGE, re.MULTILINE)


def called(work):
    """Return the full names of functions in the order in which `work` first calls them."""
    names = {}

    def watch(frame, event, _):
        if event == "call":
            names.setdefault(f"{frame.f_globals.get('__name__')}.{frame.f_code.co_qualname}")

    before = sys.getprofile()
    sys.setprofile(watch)
    try:
        work()
    finally:
        sys.setprofile(before)
    return list(names)


def test_a_scene_passes_the_stops_of_the_tour_in_their_order(tmp_path):
    scene = tmp_path / "scene.toml"
    scene.write_text(re.search(r"```toml\n(.*?)```", PAGE, re.DOTALL).group(1))
    names = called(lambda: solve(load_toml(scene, Scene)))
    missing = [stop for stop in STOPS if stop not in names]
    assert missing == []
    assert sorted(STOPS, key=names.index) == STOPS


def test_the_tour_has_fifteen_stops_at_most():
    assert 10 <= len(STOPS) <= 15
