"""The tilt of the face, decided on the command line: by two angles, or by what presses tell."""

import json
import shutil

import numpy as np
import pytest

from daq_app.cli.main import run

LEAN = 2.0  # of the face's normal to +x [degrees]


@pytest.fixture(scope="module")
def pressed(tmp_path_factory):
    """A session of three presses straight down on a face that leans."""
    folder = tmp_path_factory.mktemp("pressed")
    time = np.arange(2400) / 200.0
    normal = sum(
        2.0 * np.clip(np.minimum(time - begin, begin + 2.0 - time) / 0.1, 0.0, 1.0) for begin in (1.0, 5.0, 9.0)
    )
    force = np.random.default_rng(0).normal(0.0, 0.004, (len(time), 6))
    force[:, 0] -= normal * np.sin(np.radians(LEAN))
    force[:, 2] -= normal * np.cos(np.radians(LEAN))
    header = "t_s,Fx_N,Fy_N,Fz_N,Tx_Nmm,Ty_Nmm,Tz_Nmm"
    np.savetxt(folder / "forces.csv", np.column_stack([time, force]), "%.6f", ",", header=header, comments="")
    assert run(["import", str(folder / "forces.csv"), "--out", str(folder / "session"), "--json"]) == 0
    return folder / "session"


def decide(session, *words):
    return run(["decide", str(session), "--by", "E02", "--why", "a spirit level", "--json", "--tilt", *words])


@pytest.mark.parametrize(("words", "expected"), [((), (LEAN, 0.0)), (("1.5", "-0.25"), (1.5, -0.25))])
def test_the_tilt_is_levelled_by_the_angles_given_or_else_by_those_that_presses_tell(
    pressed, tmp_path, capsys, words, expected
):
    session = shutil.copytree(pressed, tmp_path / "session")
    capsys.readouterr()
    assert decide(session, *words) == 0
    assert json.loads(capsys.readouterr().out)["decision"]["new"] == pytest.approx(expected, abs=0.05)
    assert run(["analyse", str(session), "--json"]) in (0, 3)
    assert json.loads(capsys.readouterr().out)["settings"]["tilt"] == pytest.approx(expected, abs=0.05)


def test_one_angle_is_no_tilt(pressed, capsys):
    assert decide(pressed, "1.5") == 2
    assert "--tilt takes two angles" in capsys.readouterr().err
    assert not list(pressed.glob("decisions*"))
