"""What 'daq-app predict' prints beside the report's tables, in its units, from a prediction that is made up."""

from pathlib import Path
from types import SimpleNamespace

import pytest
from report_session import record

from daq_app.cli.main import run
from daq_app.cli.verbs import predict
from sessions.prediction import PredictionOptions


@pytest.fixture
def trials(monkeypatch):
    """Two trials, the second of a stroke without a plan; return them to be changed."""
    rows = [
        SimpleNamespace(
            trial=trial,
            stroke=stroke,
            sed=0.009,
            responses={"von_mises": (0.0125, 0.0005)},
            interval=SimpleNamespace(by_mu=0.004, by_tau_max=0.25),
        )
        for trial, stroke in ((7, 0), (None, 1))
    ]
    recording = SimpleNamespace(
        folder=Path("P01"), info=object(), simulated_sentence=None, plan=SimpleNamespace(blocks=["a"])
    )
    prediction = SimpleNamespace(trials=rows, finger=None, to_dict=dict, options=PredictionOptions(intervals=True))
    monkeypatch.setattr(predict, "stored_options", lambda *_: PredictionOptions())
    monkeypatch.setattr(predict, "open_visit", lambda *_: (recording, (), ()))
    monkeypatch.setattr(predict, "analyse_session", lambda *_, **__: SimpleNamespace(strokes=[0]))
    monkeypatch.setattr(predict, "predict_session", lambda *_: prediction)
    monkeypatch.setattr(predict, "other_signs", lambda _: ())
    monkeypatch.setattr("daq_app.cli.report_tables.table_texts", lambda *_: ())
    monkeypatch.setattr("sessions.report.numbers_alone", lambda *_: None)
    return rows


def printed(capsys):
    return [line.split() for line in capsys.readouterr().out.splitlines()]


def test_another_quantity_and_the_slopes_of_the_sed_are_printed_by_trial_or_else_by_stroke(trials, capsys):
    assert run(["predict", "P01", "--quantity", "von_mises", "--intervals"]) == 0
    rows = printed(capsys)
    assert {cell for row in rows for cell in row} >= {"[kPa]", "[Pa]"}
    for name in ("7", "2"):  # the number of a trial, and that of a stroke, from 1
        assert [name, "12.50", "4", "%"] in rows  # 0.0125 MPa, and 0.0005 of it
        assert [name, "40.0", "250"] in rows  # 0.004 MPa over 0.01, and 0.25 over a kilopascal, in pascal
    trials[0].interval = None
    assert run(["predict", "P01", "--intervals"]) == 0
    rows = printed(capsys)
    assert ["7", "–", "–"] in rows
    assert not any("12.50" in row for row in rows)


def test_a_trial_without_an_sed_is_a_flaw_and_a_session_without_one_says_why(trials, capsys):
    trials[1].sed = None
    assert run(["predict", "P01"]) == 3
    trials.clear()
    assert run(["predict", "P01"]) == 0
    assert "nothing to predict: no stroke was found" in capsys.readouterr().out


@pytest.mark.usefixtures("trials")
def test_a_recording_without_a_plan_needs_the_depth_of_the_press(monkeypatch, capsys):
    recording, *_ = predict.open_visit()
    monkeypatch.setattr(recording.plan, "blocks", [])
    assert run(["predict", "P01"]) == 2
    answer = capsys.readouterr()
    assert not answer.out
    assert "P01 has no plan" in answer.err
    assert "--indentation" in answer.err
    assert run(["predict", "P01", "--indentation", "2"]) == 0


@pytest.mark.parametrize(("verb", "opening"), [("analyse", ""), ("predict", "nothing to predict: ")])
def test_a_session_of_scores_alone_is_said_to_hold_no_forces(tmp_path, capsys, verb, opening):
    session, _ = record(tmp_path / "P01", forces=False, per_block=1)
    assert run([verb, str(session)]) == 0
    assert f"{opening}no forces were recorded" in capsys.readouterr().out.splitlines()
