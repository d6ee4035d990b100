"""Serial ports: their settings as another program reads them, their locks, and their refusals."""

from __future__ import annotations

import ctypes
import fcntl
import os
import subprocess
import sys
import termios
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from serial.tools import list_ports
from serial.tools.list_ports_common import ListPortInfo

from quadvis.machine.ports import PortError
from quadvis.machine.serial_port import (
    MOST,
    Line,
    close_port,
    has_low_latency,
    open_port,
    read_waiting,
)

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


def port_info(device: str, product: str | None = None) -> ListPortInfo:
    found = ListPortInfo(device)
    found.product = product
    return found


def test_the_refusal_of_a_missing_port_names_those_that_there_are(monkeypatch: pytest.MonkeyPatch) -> None:
    ports = [port_info(f"/dev/ttyS{number}") for number in range(9)]
    ports += [port_info("/dev/ttyUSB0", "FT232R USB UART"), port_info("/dev/ttyACM0", "Uno\x1b[2J")]
    monkeypatch.setattr(list_ports, "comports", lambda: ports)
    with pytest.raises(PortError) as refused:
        open_port("/dev/none", SBUS)
    assert str(refused.value) == (
        "port '/dev/none' is missing; plug the device in, or give the path of another port, such as "
        "'/dev/ttyACM0' (Uno\\x1b[2J), '/dev/ttyUSB0' (FT232R USB UART), '/dev/ttyS0', '/dev/ttyS1'"
    )


@pytest.mark.parametrize("error", [None, TypeError("unplugged meanwhile")])
def test_a_missing_port_is_refused_where_no_other_can_be_named(
    monkeypatch: pytest.MonkeyPatch, error: Exception | None
) -> None:
    def comports() -> list[ListPortInfo]:
        if error is not None:
            raise error
        return []

    monkeypatch.setattr(list_ports, "comports", comports)
    with pytest.raises(PortError, match=r"or give the path of another port$"):
        open_port("/dev/none", SBUS)


class SerialStruct(ctypes.Structure):
    """struct serial_struct of <linux/serial.h>."""

    _fields_ = (
        ("type", ctypes.c_int), ("line", ctypes.c_int), ("port", ctypes.c_uint), ("irq", ctypes.c_int),
        ("flags", ctypes.c_int), ("xmit_fifo_size", ctypes.c_int), ("custom_divisor", ctypes.c_int),
        ("baud_base", ctypes.c_int), ("close_delay", ctypes.c_ushort), ("io_type", ctypes.c_byte),
        ("reserved_char", ctypes.c_byte), ("hub6", ctypes.c_int), ("closing_wait", ctypes.c_ushort),
        ("closing_wait2", ctypes.c_ushort), ("iomem_base", ctypes.c_void_p),
        ("iomem_reg_shift", ctypes.c_ushort), ("port_high", ctypes.c_uint), ("iomap_base", ctypes.c_ulong),
    )  # fmt: skip


class Driver:
    """Stands for the driver of an adapter: what it answers to the requests that a pty refuses."""

    def __init__(self, takes: int) -> None:
        self.takes = takes  # the flags that it can set
        self.state = SerialStruct(line=3, flags=0x40, baud_base=24_000_000, port_high=7, iomap_base=2**40)
        self._ioctl = fcntl.ioctl

    def ioctl(self, descriptor: int, request: int, given: Any = 0) -> Any:
        if request == termios.TIOCGSERIAL:
            return bytes(self.state).ljust(len(given), b"\0")
        if request == termios.TIOCSSERIAL:
            wanted = SerialStruct.from_buffer_copy(given)
            self.state.flags |= wanted.flags & self.takes
            wanted.flags = self.state.flags
            assert bytes(wanted) == bytes(self.state)  # nothing else is touched
            return given
        return self._ioctl(descriptor, request, given)


@pytest.mark.parametrize(("takes", "flags"), [(0x2000, 0x2040), (0, 0x40)], ids=["knows", "ignores"])
def test_the_driver_is_asked_for_low_latency_and_says_whether_it_has_it(
    pty: tuple[int, str], monkeypatch: pytest.MonkeyPatch, takes: int, flags: int
) -> None:
    driver = Driver(takes)
    monkeypatch.setattr(fcntl, "ioctl", driver.ioctl)
    port = open_port(pty[1], SBUS)
    assert (has_low_latency(port), driver.state.flags) == (takes > 0, flags)
    close_port(port)


def test_a_pty_knows_no_low_latency(pty: tuple[int, str]) -> None:
    port = open_port(pty[1], SBUS)
    assert not has_low_latency(port)
    close_port(port)


def test_a_flood_is_read_piece_by_piece(pty: tuple[int, str], monkeypatch: pytest.MonkeyPatch) -> None:
    port, read = open_port(pty[1], SBUS), os.read
    with monkeypatch.context() as patched:
        patched.setattr(os, "read", lambda file, count: b"x" * 4095 if file == port else read(file, count))
        assert MOST <= len(read_waiting(port)) < MOST + 4095
    close_port(port)


def test_a_peer_that_is_gone_is_noticed() -> None:
    peer, mine = os.openpty()
    port = open_port(os.ttyname(mine), SBUS)
    os.close(peer)
    with pytest.raises(PortError, match="the port is gone"):
        read_waiting(port)
    close_port(port)
    os.close(mine)
