"""Fingers that keep the published signs: counted right, kept as they come, and never asked twice."""

import json
import os
import re
import signal

import numpy as np
import pytest

from daq_app.batch import pool, sign_map
from daq_app.batch.sensitivity import TooFewAnswers, saltelli_points
from daq_app.child_process import process_pool
from daq_app.cli.main import run
from daq_app.cli.verbs import sensitivity
from sessions.report.prose import OTHER_FINGERS


def answer(sticky, slippery):
    return {"stickiness": [[[sticky]]] * 2, "slipperiness": [[[slippery]]] * 2}


def test_signs_are_kept_where_both_series_have_the_published_one_and_unknown_without_an_answer():
    signs = sign_map.same_signs(
        [answer(0.1, -0.2), answer(0.1, 0.2), answer(None, -0.2), "no mesh fits"], answer(0.9, -0.9)
    )
    assert signs[:2, 0].tolist() == [1.0, 0.0]
    assert np.isnan(signs[2:]).all()
    assert sign_map.share(signs[:, 0])[0] == 0.5
    assert sign_map.share(signs[2:, 0]) is None


def test_reports_say_how_many_fingers_the_usual_design_has():
    points = saltelli_points(sign_map.DESIGN, sensitivity.OF_FINGERS, 0)
    assert f"tries {len(points)} of them" in OTHER_FINGERS


def test_the_slope_of_a_number_that_alone_moves_it_has_an_index_of_one():
    # The change is linear in the place of the receptor and in nothing else.
    points = saltelli_points(sign_map.DESIGN, 128, 0)
    column = list(sign_map.DESIGN).index("place of the receptor along the skin [mm]")
    answers = [answer(float(point), 1.0) for point in points[:, column]]
    indices, count = sign_map.slope_indices(answers, "stickiness", 0, 0)
    assert count == len(points)
    assert indices[0].name == "place of the receptor along the skin [mm]"
    assert indices[0].total == pytest.approx(1.0, abs=0.05)
    assert all(abs(index.total) < 0.01 for index in indices[1:])


def test_a_block_with_a_finger_without_an_answer_is_left_out_whole():
    block = len(sign_map.DESIGN) + 2
    answers = [answer(float(n % 7), 1.0) for n in range(4 * block)]
    answers[3] = "no mesh fits"
    assert sign_map.slope_indices(answers, "stickiness", 0, 0)[1] == 3 * block
    assert sign_map.slope_indices(["no"] * 2 * block, "stickiness", 0, 0) == ((), 0)


def test_every_corner_of_the_design_is_a_finger_that_can_be():
    low, high = np.array(list(sign_map.DESIGN.values())).T
    bits = np.random.default_rng(0).integers(0, 2, (500, len(low)))
    sign_map.sample_fingers(np.where(bits, high, low), "small")
    sign_map.single_changes("finite")
    sign_map.map_trials("small")


def test_each_single_change_is_the_one_that_its_name_tells():
    base = sign_map.published_finger()
    for label, trial in sign_map.single_changes("small").items():
        numbers = [float(number) for number in re.findall(r"[\d.]+", label)]
        finger = trial.finger.finger
        if label.startswith("receptor"):
            assert trial.arcs == (numbers[0] if label.endswith("distal") else -numbers[0],)  # positive to the tip
        elif label.startswith("tip radius"):
            assert [finger.tip_radius] == numbers
        elif label.startswith("contact angle"):
            assert [finger.contact_angle] == numbers
        elif label.startswith("pressed by"):
            assert [trial.press.force] == numbers
    changes = sign_map.single_changes("small")
    materials = {name: trial.finger.materials for name, trial in changes.items()}
    assert pytest.approx(base.materials.fat.E / 2) == materials["fat half as stiff"].fat.E
    assert pytest.approx(3 * base.materials.epidermis.E) == materials["epidermis three times as stiff"].epidermis.E
    assert changes["pressed a quarter less deep"].press.depth == 1 - 1 / 4
    assert changes["finite strain"].finger.solve.kinematics == "finite"


def test_what_is_kept_is_not_computed_again_and_a_line_cut_short_is(tmp_path, monkeypatch):
    trials = list(sign_map.single_changes("small").values())[2:4]
    keep = tmp_path / "answers.jsonl"
    parts = []
    first = sign_map.answers_of(trials, parts.append, keep=keep, workers=1)
    assert parts[-1] == 1.0
    lines = keep.read_text().strip().splitlines()
    assert len(lines) == 2
    monkeypatch.setattr(sign_map, "by_processes", lambda *_: pytest.fail("all was kept"))
    assert sign_map.answers_of(trials, parts.append, keep=keep) == first
    monkeypatch.undo()
    keep.write_text("\n".join([lines[0], lines[1][:40]]))  # as a crash leaves it
    assert sign_map.answers_of(trials, parts.append, keep=keep, workers=1) == first


def test_a_file_that_holds_something_else_than_answers_is_left_as_it_is(tmp_path):
    for content in (b"\xff\xd8 a photograph", b"[" * 5000, b"title = 'a scene'\n"):
        (tmp_path / "other").write_bytes(content)
        assert run(["sensitivity", "--samples", "2", "--keep", str(tmp_path / "other")]) == 2
        assert (tmp_path / "other").read_bytes() == content


def test_answers_that_cannot_be_kept_where_somebody_says_are_reported_with_what_mends_it(tmp_path, capsys):
    assert run(["sensitivity", "--samples", "2", "--keep", str(tmp_path / "none" / "answers")]) == 1
    assert "cannot be used (No such file or directory); check its name" in capsys.readouterr().err


@pytest.mark.usefixtures("in_this_process")
def test_the_verb_prints_signs_map_shares_and_indices(tmp_path, capsys):
    keep = str(tmp_path / "keep.jsonl")
    assert run(["sensitivity", "--samples", "2", "--workers", "1", "--keep", keep, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["fingers"] == 28
    assert set(document["shares"]) == set(document["quantities"])
    assert run(["sensitivity", "--samples", "2", "--keep", keep, "--quantity", "shear_along_skin"]) == 0
    output = capsys.readouterr().out
    assert "receptor 0.25 mm distal" in output
    assert "no slide" in output  # at finite strain
    assert "+\N{MINUS SIGN}" in output
    assert not re.search(r"-\d", output)  # of the numbers too


def test_nonsense_is_refused_in_a_sentence(tmp_path, capsys):
    design = tmp_path / "design.toml"
    design.write_text("")
    for wrong in (["--design", str(design)], ["--workers", "0"], ["--samples", "3"], ["--keep", str(tmp_path)]):
        assert run(["sensitivity", *wrong]) == 2
        assert capsys.readouterr().err.count("\n") <= 1


@pytest.mark.slow
def test_a_dask_cluster_answers_as_this_computer_does():
    distributed = pytest.importorskip("distributed")
    trials = list(sign_map.single_changes("small").values())[:3]
    here = sign_map.answers_of(trials, lambda _: None, workers=1)
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster:
        remote = sign_map.answers_of(trials, lambda _: None, scheduler=cluster.scheduler_address)
    assert remote == here


def test_an_address_without_a_scheduler_is_a_sentence(monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(pool, "_ANSWERS", 0.5)
    with pytest.raises(pool.SchedulerError, match="no Dask scheduler answers"):
        sign_map.answers_of(
            list(sign_map.single_changes("small").values())[:1], lambda _: None, scheduler="tcp://127.0.0.1:9"
        )


def test_a_cluster_without_workers_is_given_up_in_a_sentence(monkeypatch):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(pool, "WITHOUT_WORKERS", 0.5)
    trials = list(sign_map.single_changes("small").values())[:1]
    with (
        distributed.LocalCluster(n_workers=0, dashboard_address=None) as cluster,
        pytest.raises(pool.SchedulerError, match="has had no worker"),
    ):
        sign_map.answers_of(trials, lambda _: None, scheduler=cluster.scheduler_address)


def _dies(_):
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.mark.skipif(os.name != "posix", reason="kills a process")
def test_a_process_that_dies_over_a_finger_ends_in_a_sentence(monkeypatch):
    monkeypatch.setattr(sign_map, "finger_answer", _dies)
    with pytest.raises(TooFewAnswers, match="died, perhaps from lack of memory"):
        sign_map.answers_of(list(sign_map.single_changes("small").values())[:1], lambda _: None, workers=1)


def test_windows_is_not_asked_for_more_processes_than_it_can_wait_for(monkeypatch):
    monkeypatch.setattr("sys.platform", "win32")
    process_pool(1024).shutdown()
