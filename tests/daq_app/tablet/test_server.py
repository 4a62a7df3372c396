"""The tablet's server: one page, one device, one code, and nothing else for anybody."""

import json
import os
import subprocess
import sys
import time
import urllib.error
import urllib.request
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from socket import create_connection

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from daq_app.tablet import server as module
from daq_app.tablet.dialogue import AnswerGiven, Force, Hello
from daq_app.tablet.server import NoTabletServer, TabletServer

pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning")


@pytest.fixture
def server(monkeypatch):
    monkeypatch.setattr(module, "WRONG_CODE", 0.01)
    requests = []
    tablet_server = TabletServer("127.0.0.1", 0, lambda request, _at: requests.append(request), lambda: None)
    tablet_server.requests = requests
    yield tablet_server
    tablet_server.close()


def place(server):
    return server.url.replace("http", "ws") + "/socket"


@contextmanager
def socket(server, **hello):
    with connect(place(server), origin=server.url) as talk:
        talk.send(json.dumps({"type": "hello", **hello}))
        yield talk


def receive(talk):
    return json.loads(talk.recv(5.0))


def until(condition):
    end = time.monotonic() + 5.0
    while not condition() and time.monotonic() < end:
        time.sleep(0.01)


def status_of(url):
    try:
        with urllib.request.urlopen(url) as answer:
            return answer.status
    except urllib.error.HTTPError as error:
        return error.code


def test_nothing_but_the_page_is_reachable(server):
    with urllib.request.urlopen(server.url + "/") as answer:
        assert answer.headers["Content-Security-Policy"].startswith("default-src 'none'")
        page = answer.read().decode()
    assert server.code not in page
    for path in ("/page.html", "/../pyproject.toml", "/socket/", "/session.sqlite", "/?x=1", "/index.html"):
        assert status_of(server.url + path) == 404
    assert status_of(server.url + "/socket") in (400, 426)


def test_another_page_cannot_talk_in_the_name_of_the_browser(server):
    with pytest.raises(InvalidStatus), connect(place(server), origin="http://elsewhere.example"):
        pass


def test_a_tablet_that_falls_silent_is_gone_in_time_and_the_window_never_waits_for_it(monkeypatch):
    monkeypatch.setattr(module, "ALIVE", 0.5)
    server = TabletServer("127.0.0.1", 0, lambda *_: None, lambda: None)
    host, hello = server.url.removeprefix("http://"), json.dumps({"type": "hello", "code": server.code}).encode()
    head = (
        "GET /socket HTTP/1.1",
        f"Host: {host}",
        f"Origin: {server.url}",
        "Upgrade: websocket",
        "Connection: Upgrade",
    )
    key = ("Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==", "Sec-WebSocket-Version: 13", "", "")
    with create_connection(host.split(":")) as silent:  # it reads nothing, and answers no ping and no farewell
        silent.sendall("\r\n".join(head + key).encode() + bytes([0x81, 0x80 | len(hello), 0, 0, 0, 0]) + hello)
        until(lambda: server.connected)
        begin, waits = time.monotonic(), [0.0]
        while server.connected and time.monotonic() < begin + 5.0:
            before = time.monotonic()
            server.send(Force(0.5))
            waits.append(time.monotonic() - before)
            time.sleep(0.01)
        assert not server.connected
        assert max(waits) < 1.0
    server.close()


def test_one_device_is_let_in_by_the_code_and_comes_back_by_its_token(server):
    server.send(Force(0.5))
    with socket(server, code=server.code, pixels_per_mm=4.0) as first:
        welcome = receive(first)
        assert welcome["type"] == "welcome"
        assert receive(first) == {"type": "force", "part": 0.5}  # what came before it
        assert socket_refused(server, code=server.code)  # the code is used
    with socket(server, token=welcome["token"]) as again:
        assert receive(again)["type"] == "welcome"
        assert server.connected
        until(lambda: len(server.requests) == 2)  # the server sends the welcome before it calls the window
    assert [type(request) for request in server.requests] == [Hello, Hello]
    assert server.requests[0].pixels_per_mm == 4.0


@pytest.mark.qt
def test_a_tablet_that_is_gone_is_asked_to_come_back_and_a_used_code_is_not_shown():
    from daq_app.qt.subject_side import TabletScreen

    screen = TabletScreen("127.0.0.1", 0)
    server = screen.server
    try:
        assert server.code in screen.status
        with socket(server, code=server.code) as talk:
            receive(talk)
        until(lambda: not server.connected)
        assert server.code not in screen.status
        assert "on it again" in screen.status
        assert screen.picture() == b""
        server.renew()
        assert server.code in screen.status
    finally:
        server.close()


def test_a_tab_whose_place_another_takes_is_told_so_and_need_not_take_it_back(server):
    with socket(server, code=server.code) as first:
        token = receive(first)["token"]
        with socket(server, token=token) as second:
            assert receive(second)["type"] == "welcome"
            with pytest.raises(ConnectionClosed) as closed:
                first.recv(5.0)
            assert closed.value.rcvd.code == 4000  # of the page's own: RFC 6455, 7.4.2
    with socket(server, token=token) as third:
        receive(third)
        server.renew()
        with pytest.raises(ConnectionClosed) as closed:
            third.recv(5.0)
        assert closed.value.rcvd.code != 4000


def test_an_hour_on_the_line_is_taken_as_one_answer(server):
    with socket(server, code=server.code) as talk:
        receive(talk)
        acts = [[1.7e12 + 1000.0 / 60.0 * at, "drag", 100.0 / 3.0 + at * 1e-6, "touch"] for at in range(60 * 3600)]
        talk.send(json.dumps({"type": "given", "key": "a", "acts": acts, "sent": 1.8e12}))
        until(lambda: isinstance(server.requests[-1], AnswerGiven))
    assert len(server.requests[-1].acts) == 60 * 3600


def socket_refused(server, **hello):
    with socket(server, **hello) as talk:
        return receive(talk)["type"] == "refused"


def test_a_code_that_is_guessed_at_becomes_another(server):
    code = server.code
    wrong = f"{(int(code) + 1) % 10**6:06d}"
    for _ in range(module.TRIES):
        assert server.code == code
        assert socket_refused(server, code=wrong)
    assert server.code != code
    assert not server.connected


def test_many_who_guess_at_once_wait_for_each_other(server, monkeypatch):
    sleepers, most, pause = [], [], time.sleep

    def sleep_counted(seconds):
        sleepers.append(1)
        most.append(len(sleepers))
        pause(seconds)
        sleepers.pop()

    monkeypatch.setattr(module.time, "sleep", sleep_counted)
    with ThreadPoolExecutor(8) as pool:
        refusals = list(pool.map(lambda code: socket_refused(server, code=code), ["1", "", "٤", "x" * 200] * 2))
    assert all(refusals)
    assert max(most) == 1


def test_an_error_of_ours_ends_one_conversation_and_no_other(server):
    server._on_message = None  # no function
    with socket(server, code=server.code) as talk:
        token = receive(talk)["token"]
        with pytest.raises(ConnectionClosed):
            talk.recv(5.0)
    server._on_message = lambda *_: None
    with socket(server, token=token) as talk:
        assert receive(talk)["type"] == "welcome"


def test_a_new_code_lets_go_of_the_device_that_was_there(server):
    with socket(server, code=server.code) as first:
        token = receive(first)["token"]
        server.renew()
        with pytest.raises(ConnectionClosed):
            first.recv(5.0)
    with socket(server, token=token) as again:  # nobody has typed anything
        assert receive(again) == {"type": "refused", "sentence": "Another code is now valid."}
    with socket(server, code=server.code) as second:
        assert receive(second)["type"] == "welcome"


@pytest.mark.parametrize(
    "text", ["", "{}", "[]", '{"type": "given"}', '{"type": "stop"}', "\x00", '{"type": "given", "key": 1}', "9" * 999]
)
def test_nonsense_ends_the_conversation_and_nothing_else(server, text):
    with socket(server, code=server.code) as talk:
        token = receive(talk)["token"]
        talk.send(text)
        with pytest.raises(ConnectionClosed):
            talk.recv(5.0)
    with socket(server, token=token) as talk:
        assert receive(talk)["type"] == "welcome"
        talk.send(json.dumps({"type": "given", "key": "a", "acts": [[1.0, "press", 5.0, "pen"]], "sent": 2.0}))
        until(lambda: isinstance(server.requests[-1], AnswerGiven))
    assert isinstance(server.requests[-1], AnswerGiven)


@pytest.mark.parametrize(
    ("address", "words"),
    [("8.8.8.8", "private"), ("0.0.0.0", "private"), ("lab", "IPv4"), ("10.255.255.254", "address of this machine")],
)
def test_an_address_that_is_not_the_labs_own_is_refused_with_a_sentence(address, words):
    with pytest.raises(NoTabletServer, match=words):
        TabletServer(address, 0, lambda *_: None, lambda: None)


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["window", "--subject-screen", "tv"], 2, "invalid choice"),
        (["window", ".", "--subject-screen", "web"], 2, "leave out SESSION or --subject-screen"),
        (["--subject-address", "192.168.1.20"], 2, "give --subject-screen web too"),
        (["--subject-screen", "web", "--subject-address", "8.8.8.8"], 1, "not an address of a private network"),
    ],
)
def test_what_the_command_line_asks_for_in_vain_is_one_sentence(arguments, code, words):
    command, screen = [sys.executable, "-m", "daq_app", *arguments], {**os.environ, "QT_QPA_PLATFORM": "offscreen"}
    process = subprocess.run(command, env=screen, capture_output=True, text=True, check=False)
    assert process.returncode == code
    assert words in process.stderr
    assert process.stderr.count("\n") == 1
