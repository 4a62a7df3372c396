"""'daq-app solve' at the command line: what it prints, for scripts and for people, and how it is stopped."""

import re
from contextlib import contextmanager

import pytest
from examples import SCENE
from json_answer import answer

from daq_app.cli.main import run
from solver import Friction, Loading, Scene
from solver.accuracy import adaptivity


def test_solve_prints_what_the_contract_names(tmp_path, capsys):
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE)
    assert run(["solve", str(scene), "--json"]) == 0
    document = answer(capsys)
    names = "sed_ending sed_point normal_force tangential_force contact_width error_estimate dofs newton_iterations"
    assert {*names.split(), "wall_s", "setup_s", "row", "model", "audits"} <= set(document)
    assert document["tangential_force"] > 0
    assert document["normal_force"] > 0
    depth = Scene(friction=Friction(0.24), loading=Loading(1.5)).receptor.depth
    assert run(["solve", str(scene), "--row", str(depth), "--json"]) == 0
    row = answer(capsys)["row_at"]  # at the depth of the receptor's own row
    assert row["depth"] == depth
    assert row["arc"] == document["row"]["arc"]
    assert row["sed"] == pytest.approx(document["row"]["sed"], rel=1e-9)


def test_solve_tells_people_the_error_of_each_force_and_what_was_left_out(tmp_path, capsys):
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE)
    assert run(["solve", str(scene)]) == 0
    output = capsys.readouterr().out
    for quantity in ("normal force", "tangential force", "SED at the ending"):
        assert next(line for line in output.splitlines() if line.startswith(quantity)).endswith(" %")
    assert {"bone compliance", "viscosity", "the third dimension"} <= {s[:19].strip() for s in output.splitlines()}
    assert run(["solve", str(scene), "--json"]) == 0
    document = answer(capsys)
    cells = [re.split(r"\s{2,}", line.strip()) for line in output.splitlines()]
    numbers = {row[0]: (float(row[1]), row[2]) for row in cells if len(row) > 2 and re.fullmatch(r"[\d.]+", row[1])}
    for label, name, factor, unit in (
        ("SED at the point", "sed_point", 1e3, "kPa"),
        ("normal force", "normal_force", 1.0, "N/mm"),
        ("contact width", "contact_width", 1.0, "mm"),
        ("indentation", "indentation", 1.0, "mm"),
    ):
        assert numbers[label] == (pytest.approx(factor * document[name], rel=0.005), unit)


def test_solve_tells_people_stresses_in_kilopascal_at_the_ending_along_the_row_and_over_the_course(tmp_path, capsys):
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE + '[solve]\ncourse = "history"\n')
    assert run(["solve", str(scene), "--row", "1.9", "--json"]) == 0
    document = answer(capsys)
    assert run(["solve", str(scene), "--row", "1.9"]) == 0
    output = capsys.readouterr().out
    assert "MPa" not in output
    sed, error = 1e3 * document["sed_ending"], 1e3 * document["sed_ending"] * document["error_estimate"]
    assert 0.001 < error < 0.0099  # two digits of it are four decimals
    lines = [line for line in output.splitlines() if line.startswith("SED ")]
    assert sum(f" {sed:.4f} ± {error:.4f} " in line for line in lines) == 3  # at the ending, and twice over the course


def test_a_tolerance_that_no_mesh_meets_gives_the_best_answer_its_interval_a_warning_and_exit_code_3(
    tmp_path, capsys, monkeypatch
):
    monkeypatch.setattr(adaptivity, "MAX_UNKNOWNS", 2000)
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE + "[solve]\ntolerance = 0.0001\n")
    assert run(["solve", str(scene), "--json"]) == 3
    document = answer(capsys)
    assert document["error_estimate"] > 1e-4
    sed, corrected = document["sed_ending"], document["sed_ending_corrected"]
    wide, narrow = document["error_estimate"] * sed, document["corrected_error"] * corrected
    assert abs(sed - corrected) + narrow == pytest.approx(wide, rel=1e-9)  # one interval lies within the other
    assert len(document["row"]["error"]) == len(document["row"]["sed"])
    assert any("above the tolerance" in warning for warning in document["warnings"])


def test_solve_stopped_by_the_user_gives_the_answer_that_was_there_already(tmp_path, capsys, monkeypatch):
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE + '[solve]\nevidence = "measured"\n')

    @contextmanager
    def impatient(*_):
        calls = iter(range(1))  # the solve itself; its evidence is not waited for

        def interrupt(_):
            if next(calls, None) is None:
                raise KeyboardInterrupt
            return True

        yield interrupt

    monkeypatch.setattr("daq_app.console.Console.working", impatient)
    assert run(["solve", str(scene), "--json"]) == 130
    document = answer(capsys)
    assert document["sed_ending"] > 0.0
    assert document["evidence_s"] is None
    assert any("Stopped" in warning for warning in document["warnings"])


def test_a_number_that_is_nothing_but_round_off_is_printed_as_such(tmp_path, capsys):
    scene = tmp_path / "scene.toml"
    scene.write_text(
        "[friction]\nmu = 0.5\n[loading]\nnormal_force = 0.1\ntangential_force = 0.03\n[materials.fat]\nE = 0.034\n"
        'nu = 0.48\nprony = [{ g = 0.2, tau = 0.07 }]\n[solve]\ncourse = "history"\n'
    )
    assert run(["solve", str(scene)]) == 0
    output = capsys.readouterr().out
    assert "0.00000000" not in output  # no drag at the end of the press


def test_solve_with_a_history_prints_its_course(tmp_path, capsys):
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE + '[solve]\ncourse = "history"\n')
    assert run(["solve", str(scene), "--json"]) == 0
    document = answer(capsys)
    assert len(document["time"]) == len(document["bone_x"]) == len(document["bone_y"]) > 10
    assert document["bone_y"][-1] == pytest.approx(-1.5)
    assert document["bone_x"][-1] < 0
    ends = document["instants"]
    assert list(ends) == ["press", "break_away", "slide"]
    assert ends["slide"]["sed_ending"]["value"] == document["history"]["sed_ending"][-1]
    assert 0.0 < ends["press"]["sed_ending"]["error"] < 0.02 * ends["press"]["sed_ending"]["value"]
    assert document["rates"]["sed"]["errors"]["press"] == pytest.approx(ends["press"]["sed"]["error"])  # within 1 s
