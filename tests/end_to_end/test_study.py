"""A synthetic study from its seed to its page: made, computed once, faults named, the same wherever computed."""

import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import msgspec
import pytest

from daq_app.batch import pool as pooling
from daq_app.batch.pool import Shelf, compute_sent_visit, compute_visit, content_of, visits
from daq_app.cli.main import run
from daq_app.console import Console
from daq_app.simulation.synthetic import synthetic_study
from sessions import file_access
from sessions.prediction import PredictionOptions
from sessions.recording import RecordingError
from sessions.recording.head import software_versions
from sessions.statistics.visit import Visit, VisitOptions

DEFAULT = VisitOptions()
QUICK = VisitOptions(PredictionOptions(course="steady"))


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study") / "small"
    synthetic_study(folder, 1, Console(as_json=True), subjects=2)
    return folder


@pytest.fixture(scope="module")
def pool(study):
    """Return the numbers of the study, computed by two processes."""
    assert run(["study", str(study), "--workers", "2", "--json"]) == 3
    return json.loads((study / "pooled" / "study.json").read_bytes())


def rows(pool, subject):
    return {row["trial"]: row for v in pool["visits"] if v["subject"] == subject for row in v["rows"]}


def test_the_damaged_session_is_named_and_stops_nothing(pool):
    assert [name for name, _ in pool["failed"]] == ["S11"]
    assert [visit["session"] for visit in pool["visits"]] == ["S01", "S02"]


def test_the_predictions_of_a_study_are_those_that_its_sessions_sealed(study, tmp_path, capsys):
    session = shutil.copytree(study / "S01", tmp_path / "S01")
    assert run(["predict", str(session), "--seal", "--json"]) == 0
    sealed = json.loads(capsys.readouterr().out)["trials"]
    visit = msgspec.convert(compute_visit(session, DEFAULT), Visit)
    assert visit.sealed.endswith("the predictions shown are those.")
    assert [row.sed for row in visit.rows] == pytest.approx([row["sed"] for row in sealed], rel=1e-12)


@pytest.mark.usefixtures("in_this_process")
def test_a_command_that_mends_a_session_holds_from_the_current_folder(study, tmp_path, capsys, monkeypatch):
    session = shutil.copytree(study / "S01", tmp_path / "damaged" / "S01")
    (session / "session.sqlite").chmod(0o600)
    (session / "session.sqlite").write_bytes(b"torn")
    monkeypatch.chdir(tmp_path)
    assert run(["study", "damaged"]) == 3
    (copy,) = re.findall("'daq-app import (.*?)'", capsys.readouterr().err)
    assert Path(copy).is_file()


def test_a_session_that_nobody_may_read_is_named_and_left_out(study, tmp_path, capsys):
    folder = tmp_path / "closed"
    shutil.copytree(study / "S01", folder / "S01")
    (folder / "S02").mkdir()
    (folder / "S02").chmod(0)
    try:
        if os.access(folder / "S02", os.R_OK):
            pytest.skip("nothing is closed to this user")
        assert run(["study", str(folder), "--out", str(tmp_path / "out"), "--json"]) == 3
    finally:
        (folder / "S02").chmod(0o700)
    ((name, why),) = json.loads(capsys.readouterr().out)["study"]["failed"]
    assert (name, "permit reading" in why) == ("S02", True)


@pytest.mark.parametrize("content", ["[" * 100_000, "[]", "{"])
def test_a_damaged_ground_truth_is_named(study, tmp_path, capsys, content):
    folder = tmp_path / "damaged"
    shutil.copytree(study / "S01", folder / "S01")
    (folder / "planted.json").write_text(content)
    assert run(["study", str(folder)]) == 1
    assert "planted.json is damaged" in capsys.readouterr().err


def test_each_simulated_flaw_stands_beside_whether_it_was_detected(pool):
    assert [(flaw["session"], flaw["detected"]) for flaw in pool["flaws"]] == [("S02", True), ("S11", True)]
    assert all(flaw["found"] == flaw["detected"] for flaw in pool["flaws"])  # the former name, for one release
    assert all(effect["found"] == effect["estimate"] for effect in pool["effects"])


def test_readings_lost_in_one_stroke_withhold_its_numbers_and_no_others(pool):
    trials = rows(pool, "S02")
    assert trials[3]["flaws"] == ["lost_readings"]
    assert trials[3]["sed"] is None
    assert all(row["sed"] is not None for trial, row in trials.items() if trial != 3)


def test_friction_is_the_true_one_but_for_the_calibration(pool, study):
    strokes = json.loads((study / "planted.json").read_bytes())["strokes"]
    truth = {(stroke["subject"], stroke["trial"]): stroke["mu"] for stroke in strokes}
    for visit in pool["visits"]:
        for row in visit["rows"]:
            if row["mu"] is not None:  # the gains of axes have a standard deviation of 1 %
                assert row["mu"] == pytest.approx(truth[visit["subject"], row["trial"]], rel=0.05)
                for name in ("mu", "tau_max", "speed", "sed"):
                    assert row[f"{name}_low"] < row[name] < row[f"{name}_high"]
                assert row["sed_interval"] in ("by derivatives", "by sampling")


def test_what_was_computed_once_is_not_computed_again(pool, study, monkeypatch):
    def never(*_):
        raise AssertionError("a session was computed again")

    monkeypatch.setattr(pooling, "_in_pool", never)
    results, failures = visits(
        [study / "S01", study / "S02"], DEFAULT, Shelf(study / "pooled" / "results", DEFAULT), Console(as_json=True)
    )
    assert not failures
    assert {visit.session for visit in results} == {visit["session"] for visit in pool["visits"]}


@pytest.mark.parametrize("damage", [b"", b"{", b"[]", b'{"a": 1}', "digit"])
def test_what_was_kept_and_is_not_as_it_was_written_is_named_and_computed_anew(pool, study, tmp_path, damage, capsys):
    visit = next(visit for visit in pool["visits"] if visit["session"] == "S01")
    shelf = Shelf(tmp_path, DEFAULT)
    key = shelf.key(study / "S01")
    shelf.keep(key, visit)
    whole = shelf.file(key).read_bytes()
    shelf.file(key).write_bytes(whole.replace(b'"mu": 0.', b'"mu": 9.', 1) if damage == "digit" else damage)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pooling, "_in_pool", lambda *_: iter([("S01", visit)]))
        results, _ = visits([study / "S01"], DEFAULT, shelf, Console(as_json=True))
    assert results[0].rows[0].mu == visit["rows"][0]["mu"]
    assert f"{key}.json is damaged; the session is computed again" in capsys.readouterr().err
    assert shelf.file(key).read_bytes() == whole


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full, which is always full")
def test_a_full_disk_ends_a_study_in_a_sentence_and_leaves_no_part_of_a_file(tmp_path, monkeypatch):
    def full(_):
        return Path("/dev/full").open("wb")

    shelf = Shelf(tmp_path, DEFAULT)
    monkeypatch.setattr(file_access, "open_new", full)
    with pytest.raises(RecordingError, match=r"cannot be written \(No space left on device\): free space"):
        shelf.keep("key", {})
    assert list(tmp_path.iterdir()) == []
    assert shelf.load("key") is None


def test_another_recording_or_other_options_are_another_key(study):
    shelf = Shelf(study, DEFAULT)
    assert shelf.key(study / "S01") != shelf.key(study / "S02")
    as_printed = VisitOptions(PredictionOptions(tau_reading="as-printed"))
    assert shelf.key(study / "S01") != Shelf(study, as_printed).key(study / "S01")
    assert shelf.key(study / "S01") != Shelf(study, VisitOptions(paths="small")).key(study / "S01")


def test_a_session_whose_files_are_sent_gives_the_same_bits_as_one_on_the_disk(pool, study):
    remote = compute_sent_visit("S01", content_of(study / "S01"), DEFAULT)
    local = next(visit for visit in pool["visits"] if visit["session"] == "S01")  # from the disk, by another process
    assert json.loads(json.dumps(remote)) == local


def test_a_worker_that_dies_costs_its_own_session_alone(study, tmp_path, monkeypatch):
    def dying(_work, jobs, _workers):
        for name, arguments in jobs.items():
            if name == "S02":
                raise pooling.BrokenProcessPool
            yield name, compute_visit(*arguments)

    monkeypatch.setattr(pooling, "_in_pool", dying)
    results, failures = visits([study / "S02", study / "S01"], QUICK, Shelf(tmp_path, QUICK), Console(as_json=True))
    assert [visit.session for visit in results] == ["S01"]
    assert [name for name, _ in failures] == ["S02"]


def test_ctrl_c_keeps_what_is_done_and_says_so(pool, study, tmp_path, monkeypatch, capsys):
    row = next(visit for visit in pool["visits"] if visit["session"] == "S01")

    def stop(*_):
        yield "S01", row
        raise KeyboardInterrupt

    monkeypatch.setattr(pooling, "_in_pool", stop)
    assert run(["study", str(study), "--out", str(tmp_path)]) == 130
    assert "1 of 3 sessions are computed and kept" in capsys.readouterr().err
    assert len(list((tmp_path / "results").iterdir())) == 1


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self").exists(), reason="no /proc to see processes in")
def test_killed_at_any_moment_it_leaves_no_process_behind_and_goes_on_where_it_was(study, tmp_path):
    command = [sys.executable, "-m", "daq_app", "study", str(study), "--out", str(tmp_path), "--workers", "1"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        results = tmp_path / "results"
        _until(lambda: any(results.glob("[!.]*.json")))  # not one that is half written
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
        process.send_signal(signal.SIGKILL)
    assert children
    _until(lambda: not any(_runs(child) for child in children))
    again = subprocess.run([*command, "--json"], capture_output=True, text=True, check=False)
    assert again.returncode == 3
    assert "computed before" in again.stderr


def _until(true):
    deadline = time.monotonic() + 900.0  # however busy the machine is: this only ends what hangs
    while not true():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def _runs(process):
    try:
        return Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_a_study_is_refused_in_a_sentence_where_there_is_none(tmp_path, capsys):
    assert run(["study", str(tmp_path)]) == 1
    assert "holds no session" in capsys.readouterr().err
    assert run(["study"]) == 2
    assert run(["study", str(tmp_path), "--synthetic", "1"]) == 2
    assert run(["study", str(tmp_path), "--scheduler", "foo"]) == 2
    assert "tcp://host:8786" in capsys.readouterr().err


@pytest.mark.slow
def test_a_dask_cluster_gives_the_same_bits_as_this_computer(study, tmp_path):
    import distributed

    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as workers:
        far, _ = visits(
            [study / "S01", study / "S02"],
            DEFAULT,
            Shelf(tmp_path, DEFAULT),
            Console(as_json=True),
            scheduler=workers.scheduler_address,
        )
    here = [msgspec.convert(compute_visit(study / name, DEFAULT), Visit) for name in ("S01", "S02")]
    assert sorted(far, key=lambda visit: visit.session) == here


@pytest.mark.slow
def test_a_cluster_without_workers_is_given_up_in_a_sentence(study, tmp_path, monkeypatch):
    import distributed

    monkeypatch.setattr(pooling, "WITHOUT_WORKERS", 0.5)
    arguments = ([study / "S01"], DEFAULT, Shelf(tmp_path, DEFAULT), Console(as_json=True))
    with (
        distributed.LocalCluster(n_workers=0, dashboard_address=None) as workers,
        pytest.raises(pooling.SchedulerError, match="no worker"),
    ):
        visits(*arguments, scheduler=workers.scheduler_address)


@pytest.mark.slow
@pytest.mark.parametrize("address", ["tcp://127.0.0.1:{silent}", "tcp://127.0.0.1:9", "http://127.0.0.1:{silent}"])
def test_an_address_where_no_scheduler_answers_is_reported_in_a_sentence(study, tmp_path, monkeypatch, capsys, address):
    monkeypatch.setattr(pooling, "_ANSWERS", 0.5)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        uri = address.format(silent=silent.getsockname()[1])
        assert run(["study", str(study), "--out", str(tmp_path), "--scheduler", uri, "--json"]) == 1
    output = capsys.readouterr().err.splitlines()[-1]
    assert uri in output
    assert "no Dask scheduler answers there" in output


@pytest.mark.slow
def test_a_scheduler_that_is_killed_ends_a_study_in_a_sentence(study, tmp_path, monkeypatch):
    monkeypatch.setattr(pooling, "_ANSWERS", 5.0)
    monkeypatch.setattr(pooling, "WITHOUT_WORKERS", 300.0)
    cluster_client = pooling.cluster_client

    @contextmanager
    def client_without_scheduler(address):
        with cluster_client(address) as client:
            scheduler.kill()
            scheduler.wait()
            yield client

    file = tmp_path / "scheduler.json"
    command = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0"]
    command += ["--no-dashboard", "--scheduler-file", str(file)]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as scheduler:
        try:
            _until(lambda: file.is_file() and file.read_text().endswith("}"))
            address = json.loads(file.read_text())["address"]
            monkeypatch.setattr(pooling, "cluster_client", client_without_scheduler)
            with pytest.raises(pooling.SchedulerError, match="the scheduler is gone"):
                visits([study / "S01"], DEFAULT, Shelf(tmp_path, DEFAULT), Console(as_json=True), scheduler=address)
        finally:
            scheduler.kill()


class Workers:
    """A client of a cluster whose workers answer with these versions, or with the exception they raise."""

    def __init__(self, **answers):
        self.answers = answers

    def run(self, _, workers, on_error):
        assert on_error == "return"
        return {name: self.answers[name] for name in workers}


def test_every_worker_is_asked_for_its_versions_before_it_computes():
    here = software_versions()
    older = here | {"numpy": "1.0"}
    client = Workers(one=here | {"blas": "that of another processor"}, two=here, old=older, gone=OSError("closed"))
    pooling.refuse_other_workers(client, ["one", "two", "gone"], "tcp://host:1")
    with pytest.raises(pooling.SchedulerError, match=r"the worker old computes with numpy 1\.0"):
        pooling.refuse_other_workers(client, ["one", "old"], "tcp://host:1")
    bare = Workers(bare=ModuleNotFoundError("No module named 'sessions'"))
    with pytest.raises(pooling.SchedulerError, match="the worker bare has no daq-app"):
        pooling.refuse_other_workers(bare, ["bare"], "tcp://host:1")


@pytest.mark.slow
def test_a_worker_of_another_version_that_joins_later_is_refused(study, tmp_path, monkeypatch):
    import distributed

    refuse = pooling.refuse_other_workers
    names = []

    def check_workers(client, workers, address):
        names.extend(workers)
        if len(names) > 1:
            refuse(Workers(**{workers[-1]: {"numpy": "1.0"}}), workers[-1:], address)
        refuse(client, workers, address)
        if len(names) == 1:
            cluster_of.scale(2)

    monkeypatch.setattr(pooling, "refuse_other_workers", check_workers)
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster_of:
        folders = [study / "S01", study / "S02"]
        call = (folders, DEFAULT, Shelf(tmp_path, DEFAULT), Console(as_json=True))
        with pytest.raises(pooling.SchedulerError, match=r"computes with .*numpy 1\.0"):
            visits(*call, scheduler=cluster_of.scheduler_address)
    assert len(names) == 2


def test_what_another_version_computed_is_refused_in_a_sentence_and_not_mixed_in():
    here = software_versions()
    pooling.refuse_unlike(here | {"blas": "that of another processor"}, "tcp://host:1", "a worker")
    with pytest.raises(pooling.SchedulerError, match=r"daq-app 0\.0\.9 \(here .*versions that are here"):
        pooling.refuse_unlike(here | {"daq-app": "0.0.9"}, "tcp://host:1", "a worker")


@pytest.mark.usefixtures("pool")
def test_a_cluster_is_not_asked_for_what_is_kept(study):
    shelf = Shelf(study / "pooled" / "results", DEFAULT)
    results, failures = visits([study / "S01"], DEFAULT, shelf, Console(as_json=True), scheduler="tcp://127.0.0.1:9")
    assert ([visit.session for visit in results], failures) == (["S01"], [])


@pytest.mark.slow
def test_the_whole_synthetic_study_names_every_fault(tmp_path):
    folder = tmp_path / "study"
    assert run(["study", "--synthetic", "3", "--out", str(folder), "--json"]) == 3
    pool = json.loads((folder / "pooled" / "study.json").read_bytes())
    assert rows(pool, "S02")[3]["flaws"] == ["lost_readings"]
    assert "frozen_sensor" in rows(pool, "S04")[6]["flaws"]
    assert "too_little_force" in rows(pool, "S05")[2]["flaws"]
    assert rows(pool, "S06")[8]["outcome"] == "not answered"
    assert not next(visit for visit in pool["visits"] if visit["subject"] == "S09")["complete"]
    assert [name for name, _ in pool["failed"]] == ["S11"]
    assert "S07" in Path(folder / "pooled" / "study.html").read_text()
    assert pool["friction"]["strokes"] >= 90
    assert len(pool["flaws"]) == 7
    assert all(flaw["detected"] for flaw in pool["flaws"]), pool["flaws"]


@pytest.mark.parametrize(
    ("name", "content"), [("exclusions.toml", "[[exclude]]\nsubject = 3\n"), ("planted.json", "[]")]
)
def test_what_is_wrong_beside_the_sessions_is_said_before_any_is_computed(tmp_path, monkeypatch, capsys, name, content):
    def never(*_, **__):
        raise AssertionError

    monkeypatch.setattr("daq_app.cli.verbs.study.visits", never)
    (tmp_path / "S01").mkdir()
    (tmp_path / "S01" / "session.sqlite").touch()
    (tmp_path / name).write_text(content)
    assert run(["study", str(tmp_path)]) in (1, 2)
    assert name in capsys.readouterr().err
