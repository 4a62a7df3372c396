import json
import os
import signal
import subprocess
import sys
import time
from contextlib import suppress

import pytest

from daq_app.cli.main import run
from sessions.recording import Recording, RecordingError

FRICTION = {3: 0.15, 70: 0.6}  # friction of two surfaces on the simulated bench, by index
OWN = f"""
name = "own"
title = "Cloths"
contact_angle = 45.0
label_seed = 1

[[blocks]]
name = "slip"
descriptor = "slipperiness"
scale_ends = ["not at all", "very"]
direction = "proximal to distal"
indentation = 2.0
instruction = "Stroke once, then score."
indices = {list(FRICTION)}
planted_friction = {list(FRICTION.values())}
repetitions = 4
"""


@pytest.mark.skipif(os.name != "posix", reason="kill -9 needs POSIX")
def test_a_killed_run_is_resumed_at_the_same_trial_on_the_same_bench_only_and_ends_whole(tmp_path, capsys):
    folder = tmp_path / "P07"
    own = tmp_path / "own.toml"
    own.write_text(OWN)
    words = ["run", str(own), "--device", "sim:?seed=7&rate=100", "--subject", "P07", "--headless", "--seed", "3"]
    people = ["--simulate-subject", "7", "--pace", "20"]
    process = subprocess.Popen(
        [sys.executable, "-m", "daq_app", *words, *people, "--out", str(folder)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    has_take = False
    while not has_take and process.poll() is None:
        time.sleep(0.05)
        with suppress(RecordingError):  # not begun yet
            has_take = any(event.kind == "take_kept" for event in Recording.open(folder).events)
    process.send_signal(signal.SIGKILL)
    process.wait()
    while (before := Recording.open(folder)).end is None:  # the recorder waits for the lift
        time.sleep(0.05)
    assert before.end["cause"] == "client"
    resume = ["resume", str(folder)]
    assert run([*resume, "--pace", "10"]) == 2
    assert run([*resume, "--device", "sim:?seed=7&rate=200"]) == 1
    assert "readings a second" in capsys.readouterr().err
    assert run([*resume, "--json"]) == 0  # bench, people and pace are those it began with
    assert json.loads(capsys.readouterr().out)["end"]["complete"]
    after = Recording.open(folder)
    assert after.plan == before.plan
    assert after.events[: len(before.events)] == before.events
    assert all(record.outcome == "scored" for record in after.trials)
    assert run(["verify", str(folder)]) in (0, 3)
    assert run(resume) == 1
    assert "is sealed" in capsys.readouterr().err
    assert run(["analyse", str(folder), "--json"]) in (0, 3)
    analysis = json.loads(capsys.readouterr().out)
    strokes = analysis["strokes"]
    assert {stroke["trial"] for stroke in strokes if stroke["trial"]} == {trial.number for trial in after.plan.trials}
    friction = {trial.number: FRICTION[trial.stimulus.index] for trial in after.plan.trials}
    for row in analysis["friction"]:  # of the strokes before the end and after it
        assert row["mu"] == pytest.approx(friction[row["trial"]], rel=0.1)
