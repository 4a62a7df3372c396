"""Every number that the analysis was set by is stored with what came out."""

from dataclasses import asdict, fields, is_dataclass

from made_strokes import SETTINGS, analysed, block, felt, stroke, times

from daq_app.batch.derived import settings_of
from sessions.strokes.settings import AnalysisSettings


def test_each_setting_has_a_name_of_its_own_among_all_groups():
    groups = [field.name for field in fields(AnalysisSettings) if is_dataclass(getattr(SETTINGS, field.name))]
    names = [name for group in groups for name in asdict(getattr(SETTINGS, group))]
    assert len(set(names)) == len(names)
    assert not set(names) & {field.name for field in fields(AnalysisSettings)}


def test_a_setting_is_stored_in_its_group_and_still_under_its_name_alone():
    stored = analysed(block(times(), felt(stroke(times())))).to_dict()["settings"]
    assert stored["filter"]["cut_off"] == stored["cut_off"] == 20.0
    assert stored["signal"]["wild_widest"] == 2
    assert stored["steady"]["steady_held"] == stored["steady_held"] == 0.95


def test_an_analysis_that_was_stored_without_groups_is_made_again_with_what_was_asked_for():
    before = {"cut_off": 20.0, "steady_rule": "widened", "gain_error": 0.003, "bootstrap_seed": 7}
    before["area"] = {"law": "hertz", "exponent": 2 / 3, "force": 1.0}
    again = settings_of({"settings": before})
    assert (again.area.law, again.gain_error, again.bootstrap_seed) == ("hertz", 0.003, 7)
