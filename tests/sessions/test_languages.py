"""Protocols in several languages: every text of each, refused where one is missing, recorded in the plan."""

import pytest

from sessions.plan.protocols.planning import VisitSetting, plan
from sessions.plan.protocols.protocol import FOLDER, Protocol, protocol, protocol_names
from sessions.plan.study import create_study, open_study
from sessions.toml_file import SettingsError, from_toml, toml_text

LANGUAGES = ("en", "de", "fr", "ja", "ar")
PAPER = "sensotact-friction"


@pytest.mark.parametrize("name", protocol_names())
def test_built_in_protocols_have_every_text_in_five_languages_and_the_plan_says_which_was_read(name):
    ours = protocol(name)
    assert ours.languages == LANGUAGES
    instructions = set()
    for language in LANGUAGES:
        session_plan = plan(ours, "S01", 3, setting=VisitSetting(language=language))
        assert session_plan.language == language
        assert [t.stimulus for t in session_plan.trials] == [t.stimulus for t in plan(ours, "S01", 3).trials]
        instructions |= {block.instruction for block in session_plan.blocks}
    english = {block.instruction for block in plan(ours, "S01", 3).blocks}
    assert len(instructions) == len(english) * len(LANGUAGES), "an instruction is the same in two languages"
    assert plan(ours, "S01", 3).language == "en"


def test_without_translations_a_protocol_has_its_own_language_alone_and_refuses_others(tmp_path):
    file = tmp_path / "own.toml"
    text = (FOLDER / f"{PAPER}.toml").read_text().split("# What subjects read")[0]
    file.write_text(text.replace("[order]", 'language = "de"\n\n[order]', 1))
    ours = protocol(file)
    assert ours.languages == ("de",)
    assert plan(ours, "S01", 1).language == "de"
    with pytest.raises(SettingsError, match="has its texts in de"):
        plan(ours, "S01", 1, setting=VisitSetting(language="fr"))


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        ('language = "de"', "the texts of slipperiness are missing"),
        ('language = "en"', "the protocol's own"),
        ('language = "German"', "code of a language"),
        ('language = "nl"', "the texts of slipperiness are missing"),
    ],
)
def test_a_translation_that_is_not_whole_is_refused_and_the_sentence_names_what_lacks(tmp_path, wrong, sentence):
    text = (FOLDER / f"{PAPER}.toml").read_text().split("# What subjects read")[0]
    texts = 'instruction = "x"\nscale_ends = ["a", "b"]\nquestion = "?"'
    table = f'\n[[translations]]\n{wrong}\nblock = "stickiness"\n{texts}\n'
    file = tmp_path / "own.toml"
    file.write_text(text + table)
    with pytest.raises(SettingsError, match=sentence):
        protocol(file)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (('block = "slipperiness"\n', 'block = "slimness"\n'), "must be one of stickiness"),
        (('scale_ends = ["gar nicht klebrig", "so klebrig wie möglich"]\n', ""), "name both ends"),
        (("Legen Sie Ihren", ""), None),
    ],
)
def test_a_text_too_many_or_too_few_in_a_block_is_refused(tmp_path, change, sentence):
    head, tail = (FOLDER / f"{PAPER}.toml").read_text().split("# What subjects read")
    file = tmp_path / "own.toml"
    file.write_text(f"{head}#{tail.replace(*change, 1)}")
    if sentence is None:
        assert protocol(file).languages == LANGUAGES
        return
    with pytest.raises(SettingsError, match=sentence):
        protocol(file)


def test_a_study_keeps_the_languages_of_its_protocol(tmp_path):
    create_study(tmp_path / "s", (FOLDER / f"{PAPER}.toml").read_text(), 4, blinded=False)
    assert open_study(tmp_path / "s").protocol == protocol(PAPER)


def test_what_is_written_of_a_protocol_is_read_as_the_same_in_every_language():
    assert from_toml(toml_text(protocol(PAPER)), Protocol, "here") == protocol(PAPER)
