"""A session whose subject answers in a real browser: by touch, by key, and while the network is away."""

from pathlib import Path

import pytest
from browser import CHROMIUM
from PySide6.QtWidgets import QLabel
from tablet_browser import Browser

from daq_app.qt.start import open_window
from daq_app.qt.subject_side import TabletScreen
from daq_app.recorder.client import Recorder
from daq_app.recorder.messages import Stop
from daq_app.window.live_model_process import LiveModel
from daq_app.window.new_session import bench_of
from daq_app.window.state import NewSession
from sessions.recording import Recording
from sessions.run import steps
from tests.daq_app.qt.conftest import Driver, application  # noqa: F401  a fixture

pytestmark = [pytest.mark.qt, pytest.mark.skipif(CHROMIUM is None, reason="there is no browser here")]


@pytest.fixture
def desk(application, tmp_path, monkeypatch):  # noqa: F811  the fixture
    monkeypatch.setattr(LiveModel, "prepare", lambda _: None)
    window = open_window(application, Recorder.start, tablet=TabletScreen("127.0.0.1", 0))
    driver = Driver(application, window)
    window.show()
    page = window.page
    page.folder.setText(str(tmp_path / "recordings"))
    page.scores_only.setChecked(True)
    page.subject.setText("P01")
    browser = Browser(tmp_path / "browser", application.processEvents)
    yield driver, browser
    browser.close()
    if driver.session is not None and not driver.session.is_over:
        window.bridge.send(Stop())
        driver.until(lambda: driver.session.is_over, "the end")
    window.tablet.server.close()
    window.bridge.end()
    for widget in (window.subject, window):
        widget.hide()
        widget.deleteLater()


def answer_to(driver, number):
    driver.until(lambda: driver.session.trial_state(number).answer is not None, f"the answer to {number}")
    return driver.session.trial_state(number).answer


def ask(driver):
    """Bring the session in hand to its next question, doing each step once."""
    steps_done = []

    def is_asked():
        here, primary = (driver.session.phase, driver.session.trial), driver.view.course.primary
        if here[0] != "scoring" and primary is not None and primary.sends is not None and here not in steps_done:
            steps_done.append(here)
            driver.window.bridge.send(primary.sends)
        return here[0] == "scoring"

    driver.until(is_asked, "a question")


BOXES = """[...document.querySelectorAll('#title, #line, #ends span, #next')].map(item => {
  const range = document.createRange(), words = item.id == 'line' ? item : (range.selectNodeContents(item), range);
  const box = (item.id == 'next' ? item : words).getBoundingClientRect();
  return [box.x, box.y, box.width, box.height];
})"""  # of what the subject sees [px]


def meet(first, second):
    """Say whether two boxes lie over each other."""
    return all(first[k] < second[k] + second[k + 2] and second[k] < first[k] + first[k + 2] for k in (0, 1))


def shown_words(window):
    return " ".join(label.text() for label in window.notice.findChildren(QLabel))


def test_a_subject_answers_on_the_tablet_also_while_the_network_is_away(desk):
    driver, browser = desk
    window, server = driver.window, driver.window.tablet.server
    card = next(
        card
        for card in window.page.check(bench_of(window.bridge.state.bench), anew=True)
        if card.name == "Subject's screen"
    )
    assert not card.ready
    assert server.code in card.text
    browser.call("Page.navigate", url=server.url)
    browser.until("document.readyState == 'complete' && !!document.getElementById('code')")
    browser.click("code")
    browser.type(server.code)
    browser.key("Enter")
    browser.value("document.getElementById('entry').requestSubmit()")
    browser.until("!document.getElementById('ruler').hidden", "the line to be measured")
    browser.click("measured")
    browser.type("80")
    browser.value("document.getElementById('ruler').requestSubmit()")
    browser.until("document.getElementById('title').textContent == 'Welcome'")
    driver.until(lambda: "checked with a ruler" in window.tablet.status and "not" not in window.tablet.status)
    window.act("primary")
    driver.phase("idle")
    assert not window.subject.isVisible()

    ask(driver)  # by touch
    browser.until("!document.getElementById('line').parentElement.hidden", "the line")
    assert not browser.is_visible("next")
    assert browser.value("document.getElementById('line').getBoundingClientRect().width") == pytest.approx(
        100 * 100 * 96 / 25.4 / 80, abs=1
    )
    assert not window.subject.isVisible()
    browser.touch("line", 0.2, 0.4, 0.7)
    browser.until("!document.getElementById('next').hidden")
    own_width = browser.value("innerWidth")
    for size in ((1024, 700), (768, 1024), (512, 350)):  # the last is the first at a zoom of 200 %
        browser.call(
            "Emulation.setDeviceMetricsOverride", width=size[0], height=size[1], deviceScaleFactor=0, mobile=False
        )
        browser.until(f"innerWidth == {size[0]}")
        browser.value("draw()")
        boxes = browser.value(BOXES)
        assert len(boxes) == 5
        assert all(x >= 0 and x + wide <= size[0] and y >= 0 and y + high <= size[1] for x, y, wide, high in boxes)
        assert not any(meet(box, other) for at, box in enumerate(boxes) for other in boxes[at + 1 :])
    browser.call("Emulation.clearDeviceMetricsOverride")
    browser.until(f"innerWidth == {own_width}")  # else the click may miss a button that moves
    browser.click("next")
    assert answer_to(driver, 1) == "score 70"
    browser.until("pending.length == 0", "the acknowledgement")

    ask(driver)  # by key
    browser.until("asked() && document.activeElement.id == 'line'", "the line")
    browser.key("ArrowRight")
    browser.reload("asked() && document.activeElement.id == 'line'", "the line in the middle of the answer")
    assert browser.value("mark") == 50
    browser.key("PageUp")
    browser.key("Enter")
    assert answer_to(driver, 2) == "score 60"

    ask(driver)  # while the network is away
    browser.until("asked()", "the line")
    browser.value("connect = () => {}; socket.close()")
    driver.until(lambda: not server.connected)
    driver.until(lambda: "tablet does not answer" in shown_words(window))
    browser.touch("line", 0.3)
    browser.click("next")
    browser.until("document.body.innerText.includes('kept on this device')")
    assert driver.session.trial_state(3).answer is None
    browser.call("Page.reload")  # and it is back
    assert answer_to(driver, 3) == "score 30"
    browser.until("pending.length == 0", "the acknowledgement")

    folder = Path(driver.session.folder)
    window.bridge.send(steps.Abort("enough"))
    driver.until(lambda: driver.session.sealing == "sealed", "the end")
    answers = [event for event in Recording.open(folder).events if event.kind == "scored"]
    assert [event.data["score"] for event in answers] == [70.0, 60.0, 30.0]
    assert [event.data["input_device"] for event in answers] == ["touch", "keyboard", "touch"]
    for event in answers:  # the tablet's clock became the session's
        times = [time for time, _ in event.data["positions"]]
        assert times == sorted(times)
        assert 0.0 < event.time_ns * 1e-9 - times[-1] < 20.0
    settings = Recording.open(folder).provenance["settings"]
    assert settings["subject's screen"]["value"] == "web"
    window.bridge.send(NewSession())


TEXTS = [
    ("1,000", "en", None),
    ("1.000", "en", 1),
    ("1,000", "de", 1),
    ("1.000", "de", None),
    ("0.125", "de", 0.125),
    ("\u0661\u0662\u066b\u0665", "ar", 12.5),
    ("1e3", "en", None),
    ("0x10", "en", None),
    ("1,000,000", "en", None),
]  # text, language of the page, and the number that it is


@pytest.mark.parametrize(
    ("protocol", "give", "expected"),
    [
        ("magnitude-estimation", lambda browser: (browser.click("number"), browser.type("12,5")), "number 12.5"),
        ("paired-comparison", lambda browser: browser.key("2"), "the second"),
    ],
)
def test_other_kinds_of_answer_are_given_on_the_tablet_too(desk, protocol, give, expected):
    driver, browser = desk
    window, server = driver.window, driver.window.tablet.server
    window.page.protocol.setCurrentText(protocol)
    assert not window.page.screen_fields.camera.pixmap().isNull()
    browser.call("Page.navigate", url=server.link)  # as a camera reads it
    browser.until("document.readyState == 'complete' && ruling")
    assert browser.value("location.href") == f"{server.url}/"
    browser.click("skip")
    driver.until(lambda: server.connected and window.page.screen_fields.camera.isHidden())
    driver.until(lambda: not window.tablet.problem)
    window.act("primary")
    driver.phase("idle")
    ask(driver)
    browser.until("asked()", "the question")
    assert not browser.is_visible("next")
    if protocol == "magnitude-estimation":
        for text, language, number in TEXTS:
            browser.value(f"page.view.language = '{language}', document.getElementById('number').value = '{text}'")
            assert browser.value("number()") == number, (text, language)
        browser.value("page.view.language = 'en', document.getElementById('number').value = '1,000', draw()")
        assert "Do you mean 1000 or 1.000?" in browser.value("document.body.innerText")
        browser.value("document.getElementById('number').value = '', draw()")
        browser.click("number")
        for key in "12x,5,7":  # a letter and a second mark are not taken, as in the window's own field
            browser.type(key)
        assert browser.value("document.getElementById('number').value") == "12,57"
        browser.value("document.getElementById('number').value = typed = '', draw()")
    give(browser)
    browser.until("!document.getElementById('next').hidden")
    browser.reload("!document.getElementById('next').hidden", "the answer begun before")
    browser.click("next")
    assert answer_to(driver, driver.session.trial) == expected
    browser.until("pending.length == 0", "the acknowledgement")


def test_a_palm_on_the_line_moves_no_mark(desk):
    driver, browser = desk
    browser.call("Page.navigate", url=driver.window.tablet.server.link)
    browser.until("document.readyState == 'complete' && ruling")
    browser.click("skip")
    driver.until(lambda: not driver.window.tablet.problem)
    driver.window.act("primary")
    driver.phase("idle")
    ask(driver)
    browser.until("asked()", "the question")
    points = [
        {"id": number, "x": x, "y": y} for number, (x, y) in enumerate(browser.middle("line", p) for p in (0.7, 0.1))
    ]
    for touching in (points[:1], points, points[:1], []):
        kind = "touchStart" if len(touching) else "touchEnd"
        browser.call("Input.dispatchTouchEvent", type=kind, touchPoints=touching)
    browser.click("next")
    assert answer_to(driver, 1) == "score 70"
