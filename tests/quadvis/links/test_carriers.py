"""Carriers: bytes through ptys and datagrams, without waiting, and ports that are nobody else's."""

from __future__ import annotations

import fcntl
import os
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest

from quadvis.errors import QuadvisError
from quadvis.links.carriers import WAITING, FrameCarrier, open_receiver, open_sender
from quadvis.links.frame import encode
from quadvis.links.link import MEMORY, UDP
from quadvis.links.serial_line import SerialLine
from quadvis.links.udp import UdpSocket

from .networks import made_link, task

LINK = made_link(task("slow", "1/10"), task("fast", "1/20"))
PAYLOAD = LINK.message.pack((3, 1.5, True, (1.0, -1.0), (True, False, True)))
PATIENCE = 30.0  # s, for a machine that has other things to do


@pytest.fixture
def ends() -> Iterator[tuple[int, int, str]]:
    """A pty: its master, its slave, and the path of the slave."""
    master, slave = os.openpty()
    os.set_blocking(master, False)
    yield master, slave, os.ttyname(slave)
    for descriptor in (master, slave):
        os.close(descriptor)


def until(read: Any) -> Any:
    """Return the first result that is not empty."""
    begin = time.monotonic()
    while time.monotonic() < begin + PATIENCE:
        found = read()
        if found:
            return found
        time.sleep(0.001)
    raise AssertionError("nothing came")


def test_a_serial_sender_and_receiver_meet_on_a_line(ends: tuple[int, int, str]) -> None:
    master, _, path = ends
    sender = open_sender(LINK, path)
    sender.send(100, PAYLOAD)
    sender.send(200, PAYLOAD)
    data = b""
    while len(data) < 2 * LINK.bytes:
        data += until(lambda: os.read(master, 4096) if _ready(master) else b"")
    sender.close()
    receiver = open_receiver(LINK, path)
    assert receiver.receive(1000) is None
    os.write(master, data)
    assert until(lambda: receiver.receive(200)) == (100, PAYLOAD)
    assert receiver.receive(200) is None  # the later one waits until its time is past
    assert receiver.receive(201) == (200, PAYLOAD)
    os.write(master, data[5:])
    assert receiver.receive(10**9) is None
    until(lambda: (receiver.receive(10**9), receiver.refused)[1])
    assert (receiver.lost, receiver.refused) == (0, 1)
    # What is left of an earlier run, far ahead of this one, holds nothing up.
    os.write(master, encode(LINK.message, 9999, 10**15, PAYLOAD))
    until(lambda: (receiver.receive(10**9), receiver.lost)[1])
    os.write(master, encode(LINK.message, 0, 300, PAYLOAD))
    assert until(lambda: receiver.receive(10**9)) == (300, PAYLOAD)
    receiver.close()


def test_of_a_sender_whose_clock_is_far_ahead_the_newest_frames_are_kept_and_no_others() -> None:
    class Frames:
        """A line on which one frame comes after the other, all of them at once."""

        def read(self) -> Iterator[bytes]:
            yield b"".join(encode(LINK.message, k, 10**15 + k, PAYLOAD) for k in range(WAITING + 10))

    carrier = FrameCarrier(LINK, Frames())  # type: ignore[arg-type]
    assert carrier.receive(0) is None
    assert len(carrier._waiting) == WAITING
    assert carrier._waiting[-1].stamp == 10**15 + WAITING + 9


def _ready(descriptor: int) -> bool:
    import select

    return bool(select.select([descriptor], [], [], 0)[0])


def test_all_bytes_pass_a_line_unchanged(ends: tuple[int, int, str]) -> None:
    master, _, path = ends
    line, every = SerialLine(path, 115200), bytes(range(256)) * 4
    assert line.write(every)
    found = b""
    while len(found) < len(every):
        found += until(lambda: os.read(master, 4096) if _ready(master) else b"")
    assert found == every
    os.write(master, every)
    found = b""
    while len(found) < len(every):
        found += until(lambda: b"".join(line.read()))
    assert found == every
    line.close()


def test_a_full_line_takes_no_half_frames_and_nobody_waits(ends: tuple[int, int, str]) -> None:
    master, _, path = ends
    line, frame = SerialLine(path, 115200), b"x" * 999 + b"\0"
    taken = [line.write(frame) for _ in range(1000)]
    assert taken[0] and not taken[-1]
    found = b""
    while len(found) < 1000 * sum(taken):
        found += until(lambda: os.read(master, 65536) if _ready(master) else b"")
        line.write(b"")
    assert found == frame * sum(taken)
    line.close()


def test_a_line_belongs_to_one(ends: tuple[int, int, str]) -> None:
    path = ends[2]
    line = SerialLine(path, 115200)
    with pytest.raises(QuadvisError, match="is in use by another program"):
        SerialLine(path, 115200)
    line.close()
    SerialLine(path, 115200).close()


def test_a_line_that_another_program_has_locked_is_left_alone(ends: tuple[int, int, str]) -> None:
    _, slave, path = ends
    fcntl.flock(slave, fcntl.LOCK_EX)
    with pytest.raises(QuadvisError, match="is in use by another program"):
        SerialLine(path, 115200)
    fcntl.flock(slave, fcntl.LOCK_UN)


def test_a_port_that_does_not_exist_is_refused_in_a_sentence() -> None:
    with pytest.raises(QuadvisError, match="port '/dev/none' is missing"):
        SerialLine("/dev/none", 115200)


def test_a_pty_knows_no_low_latency_and_the_receiver_says_so(ends: tuple[int, int, str]) -> None:
    receiver = open_receiver(replace(LINK, ports=("", ends[2])), ends[2])
    assert len(receiver.notes) == 1 and "low latency" in receiver.notes[0]
    receiver.close()
    receiver = open_receiver(LINK, ends[2])
    assert receiver.notes == ()  # of a cable nobody expects it
    receiver.close()


def test_a_line_that_is_gone_gives_nothing_and_takes_nothing() -> None:
    master, slave = os.openpty()
    path = os.ttyname(slave)
    line = SerialLine(path, 115200)
    os.close(master)
    assert list(line.read()) == []
    with pytest.raises(QuadvisError, match=f"{path}: the port is gone"):
        line.write(b"frame")
    line.close()
    os.close(slave)


def test_datagrams_pass_from_one_end_to_the_other() -> None:
    link = made_link(task("slow", "1/10"), task("fast", "1/20"), via=UDP, baud=0)
    socket = UdpSocket(("127.0.0.1", 0), listens=True)
    address = socket.address
    socket.close()
    sender = open_sender(link, address)
    sender.send(1, PAYLOAD)  # nobody listens yet
    receiver = open_receiver(link, address)
    assert receiver.receive(10**9) is None
    for stamp in (2, 3):
        sender.send(stamp, PAYLOAD)
    assert until(lambda: receiver.receive(3)) == (2, PAYLOAD)
    assert until(lambda: receiver.receive(4)) == (3, PAYLOAD)
    assert receiver.lost == 1
    for end in (sender, receiver):
        end.close()


def test_an_address_that_is_in_use_or_unknown_is_refused_in_a_sentence() -> None:
    socket = UdpSocket(("127.0.0.1", 0), listens=True)
    with pytest.raises(QuadvisError, match=r"cannot listen at '127\.0\.0\.1:"):
        UdpSocket(socket.address, listens=True)
    socket.close()
    with pytest.raises(QuadvisError, match=r"cannot listen at '192\.0\.2\.1:5005'"):
        UdpSocket(("192.0.2.1", 5005), listens=True)


def test_memory_gives_what_is_newest() -> None:
    link = made_link(task("slow", "1/10"), task("fast", "1/20"), via=MEMORY, baud=0)
    words = memoryview(bytearray(8 * link.words))
    sender, receiver = open_sender(link, words), open_receiver(link, words)
    assert receiver.receive(100) is None
    for stamp in (1, 2, 3):
        sender.send(stamp, PAYLOAD)
    assert receiver.receive(3) == (2, PAYLOAD)
    assert receiver.receive(3) is None
    assert receiver.receive(4) == (3, PAYLOAD)
    assert (receiver.lost, receiver.refused) == (0, 0)
