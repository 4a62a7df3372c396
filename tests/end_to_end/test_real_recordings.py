"""Recordings that nobody here made: each is kept whole, and says what its source allows and nothing more.

What came out of each, and why that is right, stands in docs/real-recordings.md.
"""

import csv
from pathlib import Path

import numpy as np
import pytest

from sessions.exchange.import_csv import ImportOptions, import_csv
from sessions.recording.reader import Recording
from sessions.strokes import analyse
from sessions.strokes.forces import friction_ratio
from sessions.strokes.stroke_measures import EVERYTHING
from sessions.toml_file import SettingsError

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
FILES = sorted(DATA.glob("*.csv"))
pytestmark = pytest.mark.skipif(not FILES, reason="the real recordings do not lie beside this repository")

FRICTION = ("mu_static", "mu_dynamic", "mu_max", "tau_max", "speed")
PUSHRIMS = ["pushrim_no_hand", "pushrim_propulsion", "pushrim_propulsion_2"]
WIPES = ["wipe_fender_a", "wipe_rim_a", "wipe_rim_b", "wipe_rim_c"]


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """Return a function that imports a file once and gives its recording and analysis."""
    folder = tmp_path_factory.mktemp("real")
    cache = {}

    def open_once(name, **options):
        key = (name, *options.items())
        if key not in cache:
            target = folder / f"{len(cache)}_{name}"
            import_csv(DATA / f"{name}.csv", target, ImportOptions(**options))
            recording = Recording.open(target)
            cache[key] = recording, analyse(recording)
        return cache[key]

    return open_once


def refusals(analysis):
    return {str(flaw.name) for flaw in analysis.flaws if flaw.grade == "refused"}


def columns(name):
    with (DATA / f"{name}.csv").open() as file:
        head, *rows = csv.reader(file)
    numbers = np.array(rows, float)
    return {heading: numbers[:, i] for i, heading in enumerate(head)}


def tool_path(name, begin, end):
    """Return how far the measured position of the tool moved between two instants [m]."""
    table = columns(name)
    inside = (table["t_s"] >= begin) & (table["t_s"] <= end)
    steps = np.diff(np.column_stack([table[axis][inside] for axis in ("x_m", "y_m", "z_m")]), axis=0)
    return float(np.linalg.norm(steps, axis=1).sum())


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_an_import_keeps_every_number_of_the_file_and_the_file(session, path):
    recording, _ = session(path.stem)
    table = columns(path.stem)
    block = recording.readings()
    axes = ["Fx_N", "Fy_N", "Fz_N", "Tx_Nm", "Ty_Nm", "Tz_Nm"]
    assert np.array_equal(block.raw, np.column_stack([table[axis] for axis in axes]))
    assert np.allclose(block.time, table["t_s"] - table["t_s"][0], rtol=0, atol=1e-12)
    assert (recording.folder / "original.csv").read_bytes() == path.read_bytes()
    assert recording.losses == ()


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_no_recording_gives_a_friction_that_its_source_does_not_support(session, path):
    """None of these has an unloaded stretch, a known height and a slide in one: nothing but nulls is honest."""
    _, analysis = session(path.stem)
    assert analysis.flaws
    assert all(getattr(stroke, number) is None for stroke in analysis.strokes for number in FRICTION)
    assert all(stroke.reasons for stroke in analysis.strokes)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_rate_no_recording_holds_is_refused(tmp_path, path):
    with pytest.raises(SettingsError, match="refused"):
        import_csv(path, tmp_path / "session", ImportOptions(rate=500.0))


# The bare finger


def test_the_finger_has_no_zero_so_it_has_strokes_without_numbers(session):
    _, analysis = session("finger_strokes_bare_index")
    assert "no_unloaded_stretch" in refusals(analysis)
    first, last = analysis.strokes[0], analysis.strokes[-1]
    assert first.onset is None
    assert last.lift is None
    assert all(
        getattr(stroke, number) is None for stroke in analysis.strokes for number in EVERYTHING if number != "readings"
    )


def test_the_fingers_times_are_uneven_and_nothing_was_filtered(session):
    _, analysis = session("finger_strokes_bare_index")
    assert analysis.filtered.startswith("not filtered")


@pytest.mark.parametrize(("begin", "end", "ratio"), [(3.7, 4.4, 0.72), (6.4, 7.05, 0.69), (7.8, 8.8, 0.70)])
def test_with_the_zero_its_source_states_the_fingers_ratio_is_the_published_one(session, begin, end, ratio):
    recording, _ = session("finger_strokes_bare_index", zeroed=True)
    block = recording.readings()
    inside = (block.time >= begin) & (block.time <= end)
    assert np.nanmean(friction_ratio(block.raw[inside], 0.3)) == pytest.approx(ratio, abs=0.05)


def test_with_that_zero_the_finger_is_cut_at_its_turns_and_the_published_windows_lie_in_three_strokes(session):
    _, analysis = session("finger_strokes_bare_index", zeroed=True)
    ends = [(stroke.onset or 0.0, stroke.lift or 99.0) for stroke in analysis.strokes]
    holding = [
        [at for at, (first, last) in enumerate(ends) if first <= begin and end <= last]
        for begin, end in [(3.7, 4.4), (6.4, 7.05), (7.8, 8.8)]
    ]
    assert holding == [[1], [4], [5]]
    assert all("turned_without_lift" in stroke.flaws for stroke in analysis.strokes)


def test_the_two_of_them_that_show_a_slide_give_the_published_ratio_and_no_speed(session):
    _, analysis = session("finger_strokes_bare_index", zeroed=True)
    second, third = (stroke for stroke in analysis.strokes if stroke.mu_dynamic is not None)
    assert (second.mu_dynamic, third.mu_dynamic) == pytest.approx((0.69, 0.70), abs=0.05)
    assert (second.normal_force, third.normal_force) == pytest.approx((2.8, 1.6), abs=0.1)
    assert second.steady == pytest.approx((6.4, 7.05), abs=0.1)
    assert third.steady == pytest.approx((7.8, 8.8), abs=0.15)
    assert second.reasons["speed"] == third.reasons["speed"] == "speed_not_measurable"


# The wipes


def test_the_fender_is_wiped_four_times(session):
    _, analysis = session("wipe_fender_a")
    assert len(analysis.strokes) == 4
    for stroke in analysis.strokes:
        assert tool_path("wipe_fender_a", stroke.onset, stroke.lift or 25.0) > 0.3


@pytest.mark.parametrize("name", ["wipe_rim_a", "wipe_rim_b", "wipe_rim_c"])
def test_the_rim_is_wiped_once(session, name):
    _, analysis = session(name)
    (stroke,) = analysis.strokes
    assert tool_path(name, stroke.onset, stroke.lift) > 1.0


@pytest.mark.parametrize("name", WIPES)
def test_a_wipe_whose_zero_swings_with_the_arm_has_no_friction(session, name):
    _, analysis = session(name)
    assert {"drift", "no_steady_sliding"} & refusals(analysis)


@pytest.mark.parametrize("name", WIPES)
def test_lifted_and_pressed_are_told_apart_as_the_force_itself_shows(session, name):
    """Pressed: above a fifth of the recording's greatest normal force, and above 2 N (the source's own measure)."""
    _, analysis = session(name)
    table = columns(name)
    hard = -table["Fz_N"] > 0.5 * (-table["Fz_N"]).max()
    time = table["t_s"][hard]
    inside = np.zeros(len(time), bool)
    for stroke in analysis.strokes:
        inside |= (time >= stroke.onset) & (time <= (stroke.lift or np.inf))
    assert inside.all()


# Faults


def test_a_sensor_frozen_at_first_is_named_and_only_what_is_live_is_used(session):
    _, analysis = session("fault_frozen_wipe_rim")
    assert "frozen_sensor" in {str(flaw.name) for flaw in analysis.flaws}
    (stroke,) = analysis.strokes
    assert stroke.onset is None
    assert stroke.lift == pytest.approx(14.3, abs=0.3)


def test_a_sensor_frozen_nearly_always_is_refused(session):
    _, analysis = session("fault_frozen_wipe_rim_late")
    assert analysis.strokes == ()
    assert refusals(analysis) == {"frozen_sensor"}


# The grip and the wheel


def test_the_giver_lets_go_twice_and_was_holding_when_the_recording_began(session):
    _, analysis = session("grip_giver_release")
    first, second = analysis.strokes
    assert first.onset is None
    assert "begins_in_contact" in first.flaws
    assert "zero_after_contact" in first.flaws
    assert first.lift == pytest.approx(0.83, abs=0.05)
    assert second.onset == pytest.approx(1.83, abs=0.05)
    assert second.lift == pytest.approx(3.56, abs=0.05)


@pytest.mark.parametrize("name", PUSHRIMS)
def test_a_wheel_has_no_normal_axis_and_no_strokes(session, name):
    _, analysis = session(name)
    assert analysis.strokes == ()
    assert refusals(analysis) == {"normal_axis_implausible"}


def test_with_the_axis_of_its_pushes_stated_the_wheel_shows_each_push(session):
    """By eye twelve pushes stand out of the second recording's Fy from 9.7 to 26 s; a last swing goes the other way."""
    _, analysis = session("pushrim_propulsion_2", normal="-y")
    assert len(analysis.strokes) == 12
    assert analysis.strokes[0].onset == pytest.approx(9.7, abs=0.1)
    assert analysis.strokes[-1].lift == pytest.approx(26.0, abs=0.2)
    assert all(getattr(stroke, number) is None for stroke in analysis.strokes for number in FRICTION)


@pytest.mark.parametrize("normal", ["+x", "-x", "+y", "-y", "+z", "-z"])
def test_a_wheel_without_a_hand_shows_no_friction_whatever_the_normal_is_said_to_be(session, normal):
    _, analysis = session("pushrim_no_hand", normal=normal)
    for stroke in analysis.strokes:
        assert all(getattr(stroke, number) is None for number in FRICTION)
        assert stroke.onset is stroke.lift is None or "no_unloaded_stretch" not in stroke.flaws
    assert refusals(analysis)
