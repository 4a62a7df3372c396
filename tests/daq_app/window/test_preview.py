"""The preview holds every page that a session shows the subject, and no page that it does not."""

from dataclasses import replace

import pytest

from daq_app.window.new_session import Refusal, SessionForm
from daq_app.window.subject import mirror_view, preview, subject_view
from sessions.plan.plan import Visibility
from sessions.plan.protocols.protocol import protocol, protocol_names
from tests.daq_app.session_messages import PLAN, READY, after


@pytest.mark.parametrize("name", protocol_names())
def test_every_text_that_a_protocol_gives_the_subject_is_on_a_page(name):
    study = protocol(name)
    pages = preview(SessionForm(protocol=name))
    text = " ".join(f"{page.view.title} {page.view.text} {' '.join(page.view.ends)}" for page in pages)
    for block in study.blocks:
        assert block.instruction in text
        assert block.question in text
        assert all(end in text for end in block.scale_ends or ())
    assert {page.view.kind for page in pages} == {"read", study.scale.answer}


def test_pages_come_in_the_course_of_a_session_and_each_once():
    names = [page.name for page in preview(SessionForm())]
    assert names == [
        "before the session",
        "the surface is changed",
        "stickiness: stroke",
        "stickiness: answer",
        "the finger is still on",
        "slipperiness: stroke",
        "slipperiness: answer",
        "pause",
        "an answer was given",
        "end",
    ]


def test_rests_and_phases_before_are_pages_of_their_own():
    assert "rest" in [page.name for page in preview(SessionForm(protocol="paired-comparison"))]
    form = SessionForm(pre_evaluation=True, practice=True)
    names = [page.name for page in preview(form)]
    assert "stickiness, practice: stroke" in names
    assert "stickiness, pre-evaluation: stroke" in names


def test_pages_are_in_the_language_of_the_form():
    pages = preview(SessionForm(language="de"), lambda text: f"*{text}")
    german = protocol("sensotact-friction").in_language("de").blocks[0]
    assert all(page.view.language == "de" for page in pages)
    assert pages[0].view.title == "*Welcome"
    (stroke,) = (page.view for page in pages if page.name == "stickiness: stroke")
    assert german.instruction in stroke.text


def test_whatever_else_is_wrong_with_the_form_its_pages_are_shown():
    wrong = SessionForm(subject="Ada Lovelace", seed="many", height="high", folder="/dev/null", forces=True)
    assert preview(wrong) == preview(SessionForm())


def test_a_protocol_that_cannot_be_read_is_refused_in_a_sentence(tmp_path):
    (tmp_path / "wrong.toml").write_text("name = ")
    refusal = preview(replace(SessionForm(), protocol=str(tmp_path / "wrong.toml")))
    assert isinstance(refusal, Refusal)
    assert "wrong.toml" in refusal["protocol"]


def test_the_mirror_keeps_what_the_protocol_keeps_from_the_experimenter():
    subject = ("instruction", "trial count", "forces")
    for experimenter, has_count in ((("answer",), False), (("trial count", "forces"), True)):
        plan = replace(PLAN, shown=Visibility(subject, experimenter))
        session = replace(after(*READY).session, plan=plan)
        assert subject_view(session).force
        assert "Surface 1 of 10." in subject_view(session).text
        mirror = mirror_view(session)
        assert not mirror.force
        assert ("Surface 1 of 10." in mirror.text) is has_count
        assert mirror.title == subject_view(session).title
