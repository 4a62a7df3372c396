"""Ports of this computer: datagrams, and one web page."""

import socket
import threading

import pytest

from drivers.deadline import Deadline
from drivers.links import MOST_BODY, HttpAnswer, UdpLink, http_get, resolve
from drivers.transducer import LinkLost, SetupError


@pytest.fixture
def serve():
    """Serve one connection with the given chunks of an answer, then close it, or leave it open and silent."""
    sockets, threads = [], []

    def start(*chunks, close=True):
        listener = socket.create_server(("127.0.0.1", 0))
        sockets.append(listener)

        def answer():
            try:
                connection, _ = listener.accept()
                sockets.append(connection)
                connection.recv(4096)
                for chunk in chunks:
                    connection.sendall(chunk)
                if close:
                    connection.shutdown(socket.SHUT_WR)
            except OSError:
                pass

        threads.append(threading.Thread(target=answer))
        threads[-1].start()
        return listener.getsockname()[1]

    yield start
    for thread in threads:
        thread.join(5)
    for opened_socket in sockets:
        opened_socket.close()


def get(port, patience=5.0):
    return http_get("127.0.0.1", port, "/netftapi2.xml", Deadline(patience))


@pytest.mark.parametrize(
    "chunks",
    [
        [b"HTTP/1.0 200 OK\r\n\r\n<netft/>"],
        [b"HTTP/1.1 200 OK\r\nContent-Length: 8\r\n\r\n<netft/>"],
        [b"HTTP/1.0 200 ", b"OK\r\ncontent-length:8\r", b"\n\r", b"\n<net", b"ft/>"],
    ],
)
def test_a_page_is_read_however_it_was_cut(serve, chunks):
    assert get(serve(*chunks)) == HttpAnswer(200, b"<netft/>")


def test_a_page_of_stated_length_needs_no_end_of_the_connection(serve):
    port = serve(b"HTTP/1.0 200 OK\r\nContent-Length: 2\r\n\r\nok", close=False)
    assert get(port) == HttpAnswer(200, b"ok")


def test_a_redirect_is_returned_and_not_followed(serve):
    port = serve(b"HTTP/1.0 302 Found\r\nLocation: http://192.0.2.1/\r\n\r\n")
    assert get(port).status == 302


@pytest.mark.parametrize(
    ("chunks", "reason"),
    [
        ([b"HTTP/1.0 200 OK\r\n\r\n", b"x" * (MOST_BODY + 1)], "more than"),
        ([b"HTTP/1.0 200 OK\r\nContent-Length: 99999999999999999999\r\n\r\n"], "more than"),
        ([b"HTTP/1.0 200 OK\r\nX: ", b"x" * 9000], "web page"),
        ([b"220 mail.example SMTP ready\r\n\r\n"], "web page"),
        ([b"HTTP/1.0 OK\r\n\r\n"], "web page"),
        ([b"\x00\xff"], "web page"),
        ([], "web page"),
        ([b"HTTP/1.0 200 OK\r\nContent-Length: 100\r\n\r\nhalf"], "4 of 100"),
    ],
)
def test_an_answer_that_is_no_page_is_refused_in_a_sentence(serve, chunks, reason):
    with pytest.raises(LinkLost, match=reason):
        get(serve(*chunks))


def test_a_page_of_the_greatest_length_is_read(serve):
    assert len(get(serve(b"HTTP/1.0 200 OK\r\n\r\n" + b"x" * MOST_BODY)).body) == MOST_BODY


def test_a_silent_server_is_given_up_at_the_deadline(serve):
    with pytest.raises(LinkLost, match="no answer within"):
        get(serve(b"HTTP/1.0 2", close=False), patience=0.1)


def test_a_port_nobody_serves_is_a_lost_link():
    with pytest.raises(LinkLost, match="connection refused"):
        get(1)


@pytest.fixture
def far_end():
    port = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    port.bind(("127.0.0.1", 0))
    port.settimeout(5)
    yield port
    port.close()


def test_datagrams_go_both_ways_one_by_one(far_end):
    link = UdpLink("127.0.0.1", far_end.getsockname()[1])
    link.send(b"start")
    request, client_address = far_end.recvfrom(100)
    for answer in (b"one", b"", b"three"):
        far_end.sendto(answer, client_address)
    assert request == b"start"
    assert [link.receive(5.0) for _ in range(3)] == [b"one", b"", b"three"]
    assert link.receive(0.0) is None
    assert link.receive(0.01) is None
    link.close()
    link.close()


def test_datagrams_of_strangers_are_not_seen(far_end):
    link = UdpLink("127.0.0.1", far_end.getsockname()[1])
    link.send(b"start")
    _, client_address = far_end.recvfrom(100)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        stranger.sendto(b"stranger", client_address)
    far_end.sendto(b"box", client_address)
    assert link.receive(5.0) == b"box"
    assert link.receive(0.0) is None
    link.close()


def test_a_refused_datagram_is_no_reason_to_give_up(far_end):
    port = far_end.getsockname()[1]
    link = UdpLink("127.0.0.1", port)
    far_end.close()
    for _ in range(3):
        link.send(b"start")
        assert link.receive(0.01) is None
    link.close()


def test_a_link_that_was_closed_is_lost(far_end):
    link = UdpLink("127.0.0.1", far_end.getsockname()[1])
    link.close()
    with pytest.raises(LinkLost):
        link.send(b"start")
    with pytest.raises(LinkLost):
        link.receive(0.0)


def test_an_unknown_host_is_refused():
    with pytest.raises(SetupError, match="cannot be found"):
        resolve("no.such.host.invalid", Deadline(5.0))
