"""Every number that the analysis was set by is stored with what came out."""

from dataclasses import asdict, fields, is_dataclass

from closed_form import SETTINGS, analyse, block, noisy, slide, times

from daq_app.batch.derived import settings_of
from sessions.strokes.settings import AnalysisSettings


def test_each_setting_has_a_name_of_its_own_among_all_groups():
    groups = [field.name for field in fields(AnalysisSettings) if is_dataclass(getattr(SETTINGS, field.name))]
    names = [name for group in groups for name in asdict(getattr(SETTINGS, group))]
    assert len(set(names)) == len(names)
    assert not set(names) & {field.name for field in fields(AnalysisSettings)}


def test_a_setting_is_stored_in_its_group_and_still_under_its_name_alone():
    settings = analyse(block(times(), noisy(slide(times())))).to_dict()["settings"]
    assert settings["filter"]["cut_off"] == settings["cut_off"] == 20.0
    assert settings["signal"]["wild_widest"] == 2
    assert settings["steady"]["steady_held"] == settings["steady_held"] == 0.95


def test_an_analysis_that_was_stored_without_groups_is_made_again_with_what_was_asked_for():
    old_settings = {"cut_off": 20.0, "steady_rule": "widened", "gain_error": 0.003, "bootstrap_seed": 7}
    old_settings["area"] = {"law": "hertz", "exponent": 2 / 3, "force": 1.0}
    settings = settings_of({"settings": old_settings})
    assert (settings.area.law, settings.gain_error, settings.bootstrap_seed) == ("hertz", 0.003, 7)
