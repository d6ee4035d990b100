"""Ports of datagrams: where they listen and send, what is read, and who is answered."""

from __future__ import annotations

import select
import socket
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.machine.datagrams import MOST, Address, Datagrams, OpenDatagrams
from quadvis.machine.ports import OpenPort, PortError


@contextmanager
def peer(port: str = "") -> Iterator[socket.socket]:
    """Yield a socket of this computer, which sends to a port if one is given."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as made:
        made.bind(("127.0.0.1", 0))
        made.settimeout(20)
        if address := Address.of(port):
            made.connect(("127.0.0.1", address.number))
        yield made


def port_of(made: socket.socket, host: str = "127.0.0.1") -> str:
    """Return the port that leads to a socket."""
    return f"udp:{host}:{made.getsockname()[1]}"


def free() -> str:
    """Return a port at which nobody listens, without a host."""
    with peer() as made:
        return port_of(made, "")


def read(port: OpenPort) -> list[bytes]:
    """Return what has come, once something has."""
    assert isinstance(port, OpenDatagrams)
    assert select.select([port.socket], [], [], 20)[0]
    return [*port.read_waiting().pieces]


def test_one_frame_is_one_datagram_and_none_waits() -> None:
    with peer() as heard, closing(Datagrams(sends=True).open(port_of(heard))) as port:
        assert [port.write(frame) for frame in (b"one", b"three")] == [3, 5]
        assert [heard.recv(100), heard.recv(100)] == [b"one", b"three"]
        assert port.unsent() == 0
        heard.sendto(b"back", port.socket.getsockname())
        assert read(port) == [b"back"]
        assert port.read_waiting().pieces == ()


def test_what_nobody_hears_is_sent_and_nothing_breaks() -> None:
    with closing(Datagrams(sends=True).open(free().replace("::", ":127.0.0.1:"))) as port:
        assert [port.write(b"frame") for _ in range(5)] == [5] * 5
        assert port.read_waiting().pieces == ()


def test_without_a_host_one_listens_on_this_computer_alone() -> None:
    place = free()
    with closing(Datagrams(sends=False).open(place)) as port, peer(place) as other:
        assert port.socket.getsockname()[0] == "127.0.0.1"
        other.send(b"hello")
        assert read(port) == [b"hello"]
        with pytest.raises(PortError, match=rf"^cannot listen at '{place}': address already in use"):
            Datagrams(sends=False).open(place)
    with closing(Datagrams(sends=False).open(place.replace("::", ":0.0.0.0:"))) as port:
        assert port.socket.getsockname()[0] == "0.0.0.0"


def test_a_sender_without_a_host_answers_the_first_who_speaks_and_nobody_else() -> None:
    place = free()
    with closing(Datagrams(sends=True).open(place)) as port, peer(place) as first, peer(place) as second:
        assert port.write(b"too early") == 9
        first.send(b"I am here")
        select.select([port.socket], [], [], 20)
        port.write(b"answer")
        second.send(b"so am I")
        port.write(b"again")
        assert [first.recv(100), first.recv(100)] == [b"answer", b"again"]
        second.setblocking(False)
        with pytest.raises((BlockingIOError, ConnectionRefusedError)):
            second.recv(100)
        first.send(b"more")
        assert read(port) == [b"I am here", b"more"]


@pytest.mark.skipif(sys.platform != "linux", reason="Linux counts what it drops")
def test_what_comes_before_something_that_was_lost_is_late() -> None:
    place = free()
    with closing(Datagrams(sends=False).open(place)) as port, peer(place) as flood:
        flood.send(b"one")
        assert (read(port), port.read_waiting().late) == ([b"one"], False)
        for _ in range(50):
            flood.send(bytes(60_000))
        assert port.read_waiting().late
        flood.send(b"next")
        assert read(port) == [b"next"]
        assert not port.read_waiting().late


def test_a_flood_is_read_in_parts() -> None:
    port = OpenDatagrams(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
    port.socket.close()

    class Endless:
        def recv(self, _: int) -> bytes:
            return b"x"

        def getsockopt(self, *_: int) -> bytes:
            return bytes(36)

    port.socket = Endless()  # type: ignore[assignment]
    found = port.read_waiting()
    assert (len(found.pieces), found.late) == (MOST, True)


@pytest.mark.parametrize(
    ("port", "host", "number"),
    [
        ("udp:192.168.0.5:14550", "192.168.0.5", 14550),
        ("udp::9000", "", 9000),
        ("udp:[::1]:65535", "::1", 65535),
        ("udp:craft.local:1", "craft.local", 1),
    ],
)
def test_an_address_is_read(port: str, host: str, number: int) -> None:
    assert Address.of(port) == (host, number)


@given(st.text(alphabet="udp:0123456789[]./-x%\n", max_size=20).map("udp:".__add__))
def test_any_text_is_an_address_or_none(text: str) -> None:
    address = Address.of(text)
    assert address is None or (0 < address.number < 65536 and "/" not in address.host)


@pytest.mark.parametrize("port", ["udp:", "udp:9000", "udp:here:", "udp::0", "udp::65536", "udp:a b:1", "/x"])
def test_what_is_no_address_is_refused(port: str) -> None:
    assert Address.of(port) is None
    with pytest.raises(PortError, match=r"is no address; write such as udp:192\.168\.0\.5:14550"):
        Datagrams(sends=True).open(port)


def test_a_computer_that_cannot_be_found_is_named() -> None:
    with pytest.raises(PortError, match=r"'udp:999\.999\.999\.999:1' cannot be found: "):
        Datagrams(sends=True).open("udp:999.999.999.999:1")


def test_places_are_claimed_by_what_happens_there() -> None:
    send, listen = Datagrams(sends=True).claims, Datagrams(sends=False).claims
    assert send("udp:127.0.0.1:9") != listen("udp:127.0.0.1:9")
    assert listen("udp::9") == listen("udp:127.0.0.1:9") == send("udp::9")
