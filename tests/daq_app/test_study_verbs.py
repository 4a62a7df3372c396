"""A blinded study from its making to its report, by the command line alone."""

import json
import shutil

import pytest
from examples import short_protocol

from daq_app.cli.main import run
from sessions.recording import Recording

pytestmark = pytest.mark.usefixtures("in_this_process")
TWO = short_protocol("two", "Two surfaces", [0], [0])


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """A blinded study of two subjects: both score, one strokes as well."""
    folder = tmp_path_factory.mktemp("studies") / "friction"
    protocol = folder.with_name("two.toml")
    protocol.write_text(TWO)
    assert run(["enrol", str(folder), "--protocol", str(protocol), "--blind", "--seed", "5"]) == 0
    own = ["--finger", "tip_radius=5.5", "contact_angle=40", "--depth", "stickiness=1.8"]
    assert run(["enrol", str(folder), "--subject", "P01", *own]) == 0
    assert run(["enrol", str(folder), "--subject", "P02"]) == 0
    visit = ["run", "--study", str(folder), "--headless"]
    for subject in ("P01", "P02"):
        alone = ["--subject", subject, "--scores-only", "--simulate-subject", "4"]
        assert run([*visit, *alone, "--out", str(folder / f"{subject}_scores")]) == 0
    with_forces = ["--subject", "P01", "--device", "sim:?seed=5&rate=100", "--simulate-subject", "4", "--pace", "20"]
    assert run([*visit, *with_forces, "--out", str(folder / "P01_forces")]) in (0, 3)  # 3: a busy machine lost readings
    return folder


def run_json(capsys, *words):
    """Exit code and JSON document of a command line."""
    capsys.readouterr()
    code = run([*map(str, words), "--json"])
    return code, json.loads(capsys.readouterr().out or "null")


def test_a_session_that_cannot_be_read_is_named_and_the_rest_of_its_study_is_done(study, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("sessions.report.pages.plates", lambda _: ())  # the words of the report alone
    friction = shutil.copytree(study, tmp_path / "friction")
    database = friction / "P02_scores" / "session.sqlite"
    database.chmod(0o600)
    database.write_bytes(b"torn")
    assert run(["unblind", str(friction), "--by", "E02"]) == 3
    assert run(["unblind", str(friction), "--by", "E02"]) == 1
    assert str(database) in capsys.readouterr().err  # nothing is left but this one
    page = tmp_path / "page.html"
    assert run(["report", str(friction), "--subject", "P01", "-o", str(page)]) == 3
    assert str(database) in capsys.readouterr().err
    assert str(database) in page.read_text()
    code, prediction = run_json(capsys, "predict", friction, "--subject", "P01", "--variants", "none")
    assert (code, {row["stimulus"]["index"] for row in prediction["trials"]}) == (3, {0})


def test_a_session_that_is_still_blinded_is_named_apart_from_those_that_cannot_be_read(study, tmp_path, capsys):
    code, document = run_json(capsys, "study", study, "--out", tmp_path / "out")
    assert code == 3
    assert document["study"]["failed"] == []
    assert document["study"]["blinded"] == ["P01_forces", "P01_scores", "P02_scores"]
    assert run(["study", str(study), "--out", str(tmp_path / "out")]) == 3
    text = capsys.readouterr().out
    assert "Session P01_scores is still blinded, and is not counted until 'daq-app unblind' opens the key." in text
    assert "No trial counts." in text
    assert "could not be read" not in text


@pytest.mark.parametrize(("subject", "descriptor"), [("P02", "sticky"), ("P77", "")])
def test_a_decision_that_leaves_out_nothing_is_a_flaw_and_the_descriptors_are_named(
    study, tmp_path, capsys, subject, descriptor
):
    folder = tmp_path / "friction"
    shutil.copytree(study / "P02_scores", folder / "P02_scores")
    assert run(["unblind", str(folder / "P02_scores"), "--by", "E02", "--study", str(study)]) == 0
    decision = '[[exclude]]\nsubject = "{}"\nwhy = "fell asleep"\nwho = "E02"\ndescriptor = "{}"\n'
    (folder / "exclusions.toml").write_text(decision.format("P02", "slipperiness"))
    capsys.readouterr()
    assert run(["study", str(folder)]) == 0
    (folder / "exclusions.toml").write_text(decision.format(subject, descriptor))
    assert run(["study", str(folder)]) == 3
    assert "no session read has such trials, only trials on slipperiness, stickiness;" in capsys.readouterr().out


def test_a_study_in_which_no_trial_counts_is_a_flaw(tmp_path, capsys):
    rows = "".join(f"{0.01 * k:.2f},0,0,-1,0,0,0\n" for k in range(500))
    (tmp_path / "plain.csv").write_text(f"t[s],Fx[N],Fy[N],Fz[N],Tx[Nmm],Ty[Nmm],Tz[Nmm]\n{rows}")
    assert run(["import", str(tmp_path / "plain.csv"), "--out", str(tmp_path / "study" / "plain")]) in (0, 3)
    assert run(["study", str(tmp_path / "study")]) == 3
    assert "No trial counts." in capsys.readouterr().out


def test_a_blinded_session_away_from_its_study_is_unblinded_with_the_study_that_is_named(study, tmp_path, capsys):
    away = shutil.copytree(study / "P01_scores", tmp_path / "away")
    assert run(["unblind", str(away), "--by", "E02"]) == 1
    assert "with --study" in capsys.readouterr().err
    friction = shutil.copytree(study, tmp_path / "friction")
    assert run(["unblind", str(away), "--by", "E02", "--study", str(friction)]) == 0


def test_a_study_whose_only_session_was_unblinded_alone_is_unblinded_without_a_flaw(study, tmp_path, capsys):
    friction = shutil.copytree(study, tmp_path / "friction")
    for name in ("P01_scores", "P02_scores"):
        shutil.rmtree(friction / name)
    assert run(["unblind", str(friction / "P01_forces"), "--by", "E02"]) == 0
    code, result = run_json(capsys, "unblind", friction, "--by", "E02")
    assert (code, result["sessions"], result["left_out"]) == (0, [], [])


def test_a_session_that_cannot_be_written_stays_blinded_and_the_others_are_opened(study, tmp_path, capsys):
    friction = shutil.copytree(study, tmp_path / "friction")
    (friction / "P01_forces" / "unblinding.json").mkdir()
    code, result = run_json(capsys, "unblind", friction, "--by", "E02")
    assert (code, result["sessions"]) == (3, ["P01_scores", "P02_scores"])
    assert "P01_forces" in "".join(result["left_out"])


def test_a_blinded_study_is_run_predicted_unblinded_and_reported(study, tmp_path, capsys):
    study = shutil.copytree(study, tmp_path / "friction")
    plan = Recording.open(study / "P01_forces").plan
    assert plan.blinded
    assert (plan.finger.tip_radius, plan.contact_angle, plan.blocks[0].indentation) == (5.5, 40.0, 1.8)
    assert plan.trials == Recording.open(study / "P01_scores").plan.trials

    code, blind = run_json(capsys, "predict", study, "--subject", "P01", "--beside", "none")
    assert code in (0, 3)
    assert {row["stimulus"]["index"] for row in blind["trials"]} == {None}
    assert blind["options"]["scene"]["finger"]["tip_radius"] == 5.5
    assert run(["report", str(study), "--subject", "P01"]) == 1
    assert "'daq-app unblind' opens the key" in capsys.readouterr().err

    code, result = run_json(capsys, "unblind", study, "--by", "E02")
    assert code == 0
    assert sorted(result["sessions"]) == ["P01_forces", "P01_scores", "P02_scores"]
    document = json.loads((study / "P01_forces" / "unblinding.json").read_text())
    assert (document["by"], document["unblinded_utc"]) == ("E02", result["utc"])
    assert {"analysis.json", "prediction.json"} <= set(document["made_before"])
    assert run_json(capsys, "verify", study / "P01_forces")[0] in (0, 3)
    assert run_json(capsys, "replay", study / "P01_scores", "--fast")[1]["differences"] == []

    code, clear = run_json(capsys, "predict", study, "--subject", "P01", "--beside", "none")
    assert sorted(row["stimulus"]["index"] for row in clear["trials"]) == [0, 0]
    assert [row["sed"] for row in clear["trials"]] == [row["sed"] for row in blind["trials"]]
    assert run(["unblind", str(study), "--by", "E02"]) == 1
    assert "was unblinded before" in capsys.readouterr().err


@pytest.mark.parametrize(
    "name", ["P01_scores/session.sqlite", "P01_scores/session.h5", "study.sqlite", "sealed-key.json", "../two.toml"]
)
def test_labels_are_never_written_over_anything_but_older_labels(study, tmp_path, capsys, name):
    friction = shutil.copytree(study, tmp_path / "friction")
    shutil.copy(study.with_name("two.toml"), tmp_path)
    before = (friction / name).read_bytes()
    assert run(["enrol", str(friction), "--subject", "P07", "--labels", str(friction / name)]) == 1
    assert "it is left alone: choose another file" in capsys.readouterr().err
    assert (friction / name).read_bytes() == before
    for _ in range(2):  # a list of labels is written over an older one
        _, document = run_json(capsys, "enrol", friction, "--labels", friction / "labels.txt")
    assert [row["subject"] for row in document["subjects"]] == ["P01", "P02"]
    assert (friction / "labels.txt").read_text().startswith("For whoever puts the labels on.")


def test_a_row_is_given_back_by_the_command_line(tmp_path, capsys):
    folder = tmp_path / "study"
    assert run(["enrol", str(folder), "--protocol", "paired-comparison"]) == 0
    assert run(["enrol", str(folder), "--subject", "P01"]) == 0
    assert run(["enrol", str(folder), "--subject", "P01", "--withdraw", "moved away"]) == 0
    _, document = run_json(capsys, "enrol", folder, "--subject", "P02")
    assert [(row["subject"], row["row"], row["withdrawn"]) for row in document["subjects"]] == [
        ("P01", 1, "moved away"),
        ("P02", 1, None),
    ]
    assert run(["run", "--study", str(folder), "--subject", "P01", "--scores-only"]) == 1
    assert "was withdrawn" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "code", "excerpt"),
    [
        (["run", "--scores-only", "--subject", "P01"], 2, "give either a PROTOCOL, or --study"),
        (
            ["run", "paired-comparison", "--scores-only", "--subject", "P01", "--finger", "length=3"],
            2,
            "tip_radius, width",
        ),
        (["run", "paired-comparison", "--scores-only", "--subject", "P01", "--depth", "taste=3"], 2, "no such block"),
        (["enrol", "nowhere", "--subject", "P01"], 1, "is no study"),
        (["enrol", "nowhere", "--subject", "P01", "--blind"], 2, "give --protocol"),
        (["unblind", "nowhere", "--by", "Jane Doe"], 2, "never a name"),
        (["unblind", "nowhere", "--by", "E01"], 1, "holds no recording"),
        (["study", "--depths", "1.5"], 2, "give --power too"),
    ],
)
def test_what_is_wrong_with_a_command_about_studies_is_said_in_a_sentence(words, code, excerpt, capsys):
    assert run(words) == code
    message = capsys.readouterr().err
    assert excerpt in message
    assert message.count("\n") == 1
