"""Serial ports: their settings as another program reads them, their locks, and their refusals."""

from __future__ import annotations

import fcntl
import os
import subprocess
import sys
import termios
from collections.abc import Iterator
from pathlib import Path

import pytest

from quadvis.machine.serial_port import Line, PortError, close_port, open_port, read_waiting

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="ports are Linux's")

SBUS = Line(100_000, parity="even", stop_bits=2)


@pytest.fixture
def pty() -> Iterator[tuple[int, str]]:
    peer, port = os.openpty()
    yield peer, os.ttyname(port)
    os.close(peer)
    os.close(port)


def test_a_byte_takes_its_bits() -> None:
    assert SBUS.time(25) == pytest.approx(3e-3)
    assert Line(9600).time(960) == 1.0
    assert [str(SBUS), str(Line(9600, bits=7, parity="odd"))] == ["100000 baud 8E2", "9600 baud 7O1"]


def test_the_line_is_plain_and_does_not_hang_up(pty: tuple[int, str]) -> None:
    port = open_port(pty[1], SBUS)
    inward, outward, control, local = termios.tcgetattr(port)[:4]
    assert (outward, local) == (0, 0)
    assert not inward & (termios.ICRNL | termios.IXON | termios.ISTRIP | termios.INLCR)
    assert not control & termios.HUPCL
    assert control & termios.CSTOPB
    assert control & termios.CLOCAL
    assert control & termios.CSIZE == termios.CS8
    said = subprocess.run(["stty", "-F", pty[1], "speed"], capture_output=True, text=True, check=False).stdout
    assert said.strip() in ("100000", "0", "")  # an old stty knows only the usual rates
    assert os.get_inheritable(port) is False
    close_port(port)


def test_all_bytes_pass_both_ways_unchanged(pty: tuple[int, str]) -> None:
    port = open_port(pty[1], Line(115_200))
    data = bytes(range(256))
    os.write(pty[0], data)
    assert read_waiting(port) == data
    assert read_waiting(port) == b""
    os.write(port, data)
    assert os.read(pty[0], 1000) == data
    close_port(port)


def test_what_came_before_is_old(pty: tuple[int, str]) -> None:
    first = open_port(pty[1], SBUS)
    os.write(pty[0], b"old")
    close_port(first)
    port = open_port(pty[1], SBUS)
    assert read_waiting(port) == b""
    close_port(port)


def test_a_port_has_one_owner_and_is_free_after_it(pty: tuple[int, str]) -> None:
    port = open_port(pty[1], SBUS)
    with pytest.raises(PortError, match=r"port '/dev/pts/\d+' is in use by another program; end that one"):
        open_port(pty[1], Line(9600))
    assert termios.tcgetattr(port)[2] & termios.CSTOPB  # the settings are the owner's
    if os.getuid():
        with pytest.raises(OSError, match="busy"):
            os.open(pty[1], os.O_RDWR)
    close_port(port)
    close_port(open_port(pty[1], SBUS))


def test_the_settings_of_a_port_that_another_program_has_locked_stay(pty: tuple[int, str]) -> None:
    other = os.open(pty[1], os.O_RDWR | os.O_NOCTTY)
    fcntl.flock(other, fcntl.LOCK_EX)
    before = termios.tcgetattr(other)
    with pytest.raises(PortError, match="is in use by another program"):
        open_port(pty[1], SBUS)
    assert termios.tcgetattr(other) == before
    os.close(other)


def test_what_is_no_port_is_refused_in_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "text").write_text("no port")
    with pytest.raises(PortError, match="is no serial port; give the path of one"):
        open_port(str(tmp_path / "text"), SBUS)
    with pytest.raises(PortError, match="'/dev/none' is missing; plug the device in, or give the path of"):
        open_port("/dev/none", SBUS)
    assert (tmp_path / "text").read_text() == "no port"


def test_a_peer_that_is_gone_is_noticed() -> None:
    peer, mine = os.openpty()
    port = open_port(os.ttyname(mine), SBUS)
    os.close(peer)
    with pytest.raises(PortError, match="the port is gone"):
        read_waiting(port)
    close_port(port)
    os.close(mine)
