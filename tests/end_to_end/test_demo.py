"""The main job, as `make demo` runs it: bytes on a wire to a report."""

import json

import pytest

from daq_app.cli.main import run


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    out = tmp_path_factory.mktemp("demo") / "study"
    assert run(["demo", "--seed", "5", "--out", str(out), "--json"]) == 0
    return out


def test_ten_subjects_score_and_one_of_them_strokes(demo):
    assert sorted(path.name for path in demo.iterdir() if path.is_dir()) == sorted(
        [*(f"S{n:02d}-scores" for n in range(1, 11)), "S03-forces", "pictures"]
    )


def test_estimates_match_the_ground_truth_and_the_papers_finding_comes_out(demo):
    rows = json.loads((demo / "S03-forces" / "prediction.json").read_text())["trials"]
    friction = {"stickiness": {0: 0.28, 20: 0.44, 50: 0.48, 80: 0.64, 100: 0.67}}  # the paper's Tables 1 and 2
    friction["slipperiness"] = {0: 0.62, 20: 0.55, 55: 0.44, 75: 0.52, 100: 0.24}
    sed = {"stickiness": {}, "slipperiness": {}}
    for row in rows:
        descriptor, index = row["stimulus"]["descriptor"], row["stimulus"]["index"]
        assert row["mu"] == pytest.approx(friction[descriptor][index], rel=0.02)
        sed[descriptor][index] = row["sed"]
    sticky, slippery = sed["stickiness"], sed["slipperiness"]
    assert sticky[0] < sticky[20] < sticky[50] < sticky[80] < sticky[100]
    assert slippery[0] > slippery[20] > slippery[75] > slippery[55] > slippery[100]


@pytest.mark.slow
def test_the_session_verifies(demo):
    assert run(["verify", str(demo / "S03-forces")]) == 0


def test_everything_says_simulated(demo):
    assert "SIMULATED" in (demo / "report.html").read_text()
    pictures = list((demo / "pictures").glob("*.svg"))
    assert len(pictures) >= 7
    assert all("SIMULATED" in picture.read_text() for picture in pictures)


def test_a_second_demo_into_the_same_folder_is_refused(demo, capsys):
    assert run(["demo", "--out", str(demo)]) == 1
    assert "not empty" in capsys.readouterr().err
