"""The command line estimates a simulated finger from a session of presses, and its file serves other verbs."""

import json

import numpy as np
import pytest
from finger_presses import law

from daq_app.cli.main import run
from daq_app.cli.verbs.fit_finger import SCENE_HEAD
from sessions.file_access import check_replaceable
from sessions.prediction import finger_in
from sessions.prediction.finger_fit import FingerFit, Interval, LayerFit
from sessions.prediction.press_model import LAYERS, Check, PressModel
from solver import Friction, Loading, Scene

STIFFNESSES = (0.25, 0.1, 0.025)  # [MPa]
RATE, DEEP, TOUCH = 200.0, 1.4, 3.2  # [Hz], [mm], displacement of the stage at the touch [mm]


def stage(time, begin):
    """Return depth [mm] of a press that goes down within 1 s, holds for 1 s and lifts within 0.3 s."""
    return DEEP * np.clip(np.minimum((time - begin) / 1.0, (begin + 2.3 - time) / 0.3), 0.0, 1.0) - 0.2


@pytest.fixture(scope="module")
def presses(tmp_path_factory):
    """Files of forces and of a stage, on one clock, of three presses of a simulated finger without friction."""
    folder = tmp_path_factory.mktemp("pressed")
    time = np.arange(round(14.0 * RATE)) / RATE
    depth = np.max([stage(time, begin) for begin in (1.5, 5.5, 9.5)], axis=0)
    rng = np.random.default_rng(8)
    force = np.zeros((len(time), 6))
    force[:, 2] = -law(STIFFNESSES)(depth)
    force += rng.standard_normal(force.shape) * 0.003
    header = "t_s,Fx_N,Fy_N,Fz_N,Tx_Nmm,Ty_Nmm,Tz_Nmm"
    np.savetxt(folder / "forces.csv", np.column_stack([time, force]), "%.6f", ",", header=header, comments="")
    log = np.column_stack([time, depth + TOUCH])[::2]
    np.savetxt(folder / "stage.csv", log, "%.6f", ",", header="time_s,displacement_mm", comments="")
    assert run(["import", str(folder / "forces.csv"), "--out", str(folder / "session"), "--json"]) == 0
    return folder


def test_the_scene_of_a_finger_is_never_written_over_one_that_somebody_wrote(presses, tmp_path, capsys):
    mine = tmp_path / "mine.toml"
    mine.write_text("[friction]\nmu = 0.3\n")
    words = ["fit-finger", str(presses / "session"), "--displacement", str(presses / "stage.csv"), "--scene", str(mine)]
    assert run(words) == 1
    assert "mine.toml holds something else, so it is left alone" in capsys.readouterr().err
    assert mine.read_text() == "[friction]\nmu = 0.3\n"


@pytest.mark.slow
def test_the_interval_holds_a_simulated_finger_and_its_scene_is_taken_by_solve_and_predict(presses, tmp_path, capsys):
    out = tmp_path / "own.toml"
    words = ["fit-finger", str(presses / "session"), "--displacement", str(presses / "stage.csv"), "--mu", "0"]
    capsys.readouterr()
    assert run([*words, "--relaxation", "--scene", str(out), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert len(document["presses"]) == 3
    for layer, true in zip(document["layers"], STIFFNESSES, strict=True):
        assert layer["stiffness"]["low"] < true < layer["stiffness"]["high"]
    for touch in document["touch"]:
        assert touch == pytest.approx(TOUCH, abs=0.05)
    assert document["check"]["deviation"] < 0.02
    assert document["relaxation"]["part"]["low"] < 0.02  # the simulated finger does not relax
    scene, _ = finger_in(out)
    depth = np.array([0.4, 0.8, 1.1])
    own = law([scene.materials.of(name).E for name in ("epidermis", "dermis", "fat")], depths=depth)
    np.testing.assert_allclose(own(depth), law(STIFFNESSES)(depth), rtol=0.05)
    check_replaceable(out, SCENE_HEAD)  # the next fit may replace it
    assert run(["solve", str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["normal_force"] > 0.0


@pytest.fixture
def quick(monkeypatch):
    """No model is solved: what is tested fails before."""

    def refuse(*_: object, **__: object) -> PressModel:
        raise AssertionError("solved")

    monkeypatch.setattr("daq_app.cli.verbs.fit_finger.press_model", refuse)


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize(
    ("content", "words", "code", "sentence"),
    [
        ("time_s,x\n0,1\n1,2\n", [], 1, "displacement_mm"),
        ("time_s,displacement_mm\n0,1\n0,2\n", [], 1, "line 3: time_s does not grow"),
        ("time_s;displacement_mm\n0,0;1,0\n0,1;1,5\n", [], 1, "is no number; save the file with decimal points"),
        ("time_s,displacement_mm\n0,1\n1,much\n", [], 1, "line 3"),
        ("time_s,displacement_mm\n0,1\n1,2\n", [], 1, "does not follow it"),
        ("sequence,displacement_mm\n0,1\n1,2\n", ["--shift", "2"], 2, "--shift"),
        ("time_s,displacement_mm\n0,1\n1,2\n", ["--prior", "0.5"], 2, "--prior 0.5"),
    ],
)
def test_a_log_or_option_that_cannot_be_used_is_one_sentence(presses, tmp_path, capsys, content, words, code, sentence):
    log = tmp_path / "log.csv"
    log.write_text(content)
    capsys.readouterr()
    assert run(["fit-finger", str(presses / "session"), "--displacement", str(log), *words]) == code
    output = capsys.readouterr().err
    assert sentence in output
    assert output.count("\n") == 1 or "left out" in output


@pytest.mark.usefixtures("quick")
def test_a_stage_that_moves_the_other_way_is_named(presses, tmp_path, capsys):
    rows = np.loadtxt(presses / "stage.csv", delimiter=",", skiprows=1)
    rows[:, 1] *= -1.0
    np.savetxt(tmp_path / "back.csv", rows, "%.6f", ",", header="time_s,displacement_mm", comments="")
    words = ["fit-finger", str(presses / "session"), "--displacement", str(tmp_path / "back.csv")]
    assert run(words) == 1
    assert "positive into the finger" in capsys.readouterr().err


def test_a_visit_without_forces_holds_no_press_that_can_be_fitted(presses, tmp_path, capsys):
    words = ["fit-finger", str(tmp_path / "nowhere"), "--displacement", str(presses / "stage.csv")]
    assert run(words) == 1
    assert "nowhere" in capsys.readouterr().err


@pytest.fixture
def stub_fit(monkeypatch):
    """A fit of these numbers, whatever was pressed; return what it was given."""
    calls = {}
    layers = tuple(
        LayerFit(name, Interval(E, 0.8 * E, 1.2 * E), Interval(E, None, 2.0 * E), Interval(E, 0.5 * E, None), 0.5, "")
        for name, E in zip(LAYERS, STIFFNESSES, strict=True)
    )
    scene = Scene(friction=Friction(0.0), loading=Loading(1.0))
    outcome = FingerFit(scene, layers, Interval(0.75, 0.5, 1.0), (TOUCH,) * 3, 0.004, 0, 123, 1.25, np.zeros((2, 3)))

    def model(_, prior, deep, mu, __):
        calls.update(prior=prior, deep=deep, mu=mu)

    def fit(_, presses, gain_error, seed):
        calls.update(presses=presses, gain_error=gain_error, seed=seed)
        return outcome

    verb = "daq_app.cli.verbs.fit_finger"
    monkeypatch.setattr(f"{verb}.press_model", model)
    monkeypatch.setattr(f"{verb}.fit", fit)
    monkeypatch.setattr(f"{verb}.check", lambda *_: Check(calls.get("deviation", 0.004), np.array([0.1, 0.3, 0.55])))
    return calls


def test_a_fit_is_printed_in_kilopascal_with_its_intervals_and_a_solver_that_differs_is_a_flaw(
    presses, capsys, stub_fit
):
    words = ["fit-finger", str(presses / "session"), "--displacement", str(presses / "stage.csv")]
    capsys.readouterr()
    assert run([*words, "--prior", "3", "--mu", "0.4", "--seed", "5"]) == 0
    lines = capsys.readouterr().out.splitlines()
    rows = [line.split(maxsplit=1) for line in lines if line.startswith(LAYERS)]
    assert {name: " ".join(cells.split()) for name, cells in rows} == {
        "epidermis": "250 200 to 300 open to 500 125 to open 10 %",
        "dermis": "100 80.0 to 120 open to 200 50.0 to open 30 %",
        "fat": "25.0 20.0 to 30.0 open to 50.0 12.5 to open 55 %",
    }
    text = "\n".join(lines)
    assert (
        "0.750 of the published finger's, 95 % interval 0.500 to 1.00, from 123 points of 3 presses up to 1.25 mm"
        in text
    )
    assert "agree with those fitted: by 0.4 % at most" in text
    assert (stub_fit["prior"], stub_fit["mu"], stub_fit["seed"]) == (pytest.approx(np.log(3.0)), 0.4, 5)
    stub_fit["deviation"] = 0.03
    assert run(words) == 3
    assert "DIFFER from those fitted: by 3 % at most" in capsys.readouterr().out


@pytest.mark.parametrize(("clock", "unit"), [("time_s", 1.0), ("received_ns", 1e9)])
def test_a_log_whose_clock_is_late_is_shifted_onto_that_of_the_forces(presses, tmp_path, capsys, stub_fit, clock, unit):
    words = ["fit-finger", str(presses / "session"), "--displacement"]
    assert run([*words, str(presses / "stage.csv")]) == 0
    expected = stub_fit["presses"]
    assert len(expected) == 3
    rows = np.loadtxt(presses / "stage.csv", delimiter=",", skiprows=1)
    rows[:, 0] = (rows[:, 0] + 1.5) * unit
    np.savetxt(tmp_path / "late.csv", rows, "%.6f", ",", header=f"{clock},displacement_mm", comments="")
    assert run([*words, str(tmp_path / "late.csv"), "--shift", "-1.5"]) == 0
    for press, same in zip(stub_fit["presses"], expected, strict=True):
        np.testing.assert_allclose(press.force, same.force, atol=1e-9)
    capsys.readouterr()
