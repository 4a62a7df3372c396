"""What a translator fills in: whole, kept where it was done, and taken back by the program."""

import json
from xml.etree import ElementTree

import pytest

from daq_app.cli.main import run
from daq_app.window.subject import SubjectText
from daq_app.wording import translations
from sessions.plan.protocols.planning import VisitSetting, plan
from sessions.plan.protocols.protocol import FOLDER, protocol


def test_tables_filled_in_at_the_end_of_a_protocol_are_its_new_language(tmp_path, capsys):
    out, own = tmp_path / "nl.toml", tmp_path / "ours.toml"
    assert run(["translate", "sensotact-friction", "--language", "nl", "--out", str(out)]) == 0
    assert "tables yet to be translated: 3" in capsys.readouterr().err
    translated_tables = out.read_text().replace("Put your index finger", "Leg uw wijsvinger")
    own.write_text((FOLDER / "sensotact-friction.toml").read_text() + translated_tables)
    session_plan = plan(protocol(own), "S01", 1, setting=VisitSetting(language="nl"))
    assert session_plan.blocks[0].instruction.startswith("Leg uw wijsvinger")


def test_what_is_translated_stays(capsys):
    assert run(["translate", "sensotact-friction", "--language", "de"]) == 0
    output = capsys.readouterr()
    assert "gar nicht klebrig" in output.out
    assert "to be translated" not in output.out
    assert "every text is translated" in output.err


@pytest.mark.parametrize(("language", "untranslated"), [("de", 0), ("nl", len(SubjectText))])
def test_the_program_s_own_texts_come_as_xliff(tmp_path, language, untranslated):
    out = tmp_path / "texts.xlf"
    assert run(["translate", "--program", "--language", language, "--out", str(out)]) == 0
    result = ElementTree.parse(out)
    assert [unit.findtext("{*}source") for unit in result.iterfind(".//{*}trans-unit")] == list(SubjectText)
    assert len([t for t in result.iterfind(".//{*}target") if t.get("state") == "needs-translation"]) == untranslated


def test_the_windows_texts_come_as_a_file_that_keeps_what_was_translated(tmp_path, monkeypatch):
    monkeypatch.setattr("daq_app.wording._FOLDER", tmp_path)
    file, again = tmp_path / "experimenter_nl.xlf", tmp_path / "again.xlf"
    assert run(["translate", "--window", "--language", "nl", "--out", str(file)]) == 0
    before = file.read_text()
    for text in ("Redo {numbers}", "Press harder.", "Normal force", "Everything is set up. Press Space to begin."):
        assert before.count(f"<source>{text}</source>") == 1
    place = '<source>Press harder.</source>\n        <target state="needs-translation" />'
    assert place in before
    file.write_text(before.replace(place, "<source>Press harder.</source><target>Druk harder.</target>"))
    translations.cache_clear()
    assert run(["translate", "--window", "--language", "nl", "--out", str(again)]) == 0
    assert "<target>Druk harder.</target>" in again.read_text()


def test_nonsense_is_refused_in_a_sentence(tmp_path, capsys):
    existing = tmp_path / "there.toml"
    existing.write_text("kept")
    for wrong in (
        ["--language", "de"],
        ["sensotact-friction", "--program", "--language", "de"],
        ["--window", "--program", "--language", "de"],
        ["sensotact-friction", "--language", "Dutch"],
        ["sensotact-friction", "--language", "en"],
        ["nowhere", "--language", "de"],
    ):
        assert run(["translate", *wrong]) == 2
        assert capsys.readouterr().err.startswith("daq-app: ")
    assert run(["translate", "sensotact-friction", "--language", "nl", "--out", str(existing)]) == 1
    assert "is there already" in capsys.readouterr().err
    assert existing.read_text() == "kept"
    assert run(["translate", "--program", "--language", "nl", "--out", str(tmp_path / "none" / "nl.xlf")]) == 1
    assert "check its name" in capsys.readouterr().err


def test_a_script_that_names_no_file_gets_the_text_in_the_document(capsys):
    assert run(["translate", "--program", "--language", "nl", "--json"]) == 0
    output = json.loads(capsys.readouterr().out)
    assert output["out"] is None
    assert len(list(ElementTree.fromstring(output["text"]).iterfind(".//{*}trans-unit"))) == len(SubjectText)
