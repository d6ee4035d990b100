"""The guardian as its supervisor has it: started, asked, lost, replaced."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
from dataclasses import dataclass
from typing import Any

import pytest

from quadvis.diagram.sections.on_host_loss import SAFE
from quadvis.errors import RunError
from quadvis.machine.ports import Card, OpenPort
from quadvis.machine.serial_port import Line
from quadvis.realtime.guard import LOST, Guard
from quadvis.realtime.guardian import Standing, outboxes, words_for
from quadvis.realtime.outlet import OutputPort
from tests.processes import wait_for
from tests.quadvis.realtime.ptys import Pty, ptys

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="ports are Linux's")

MS = 10**6


def started(*lines: Pty) -> tuple[Guard, Any, list[OutputPort]]:
    """Return a guardian that is started, its words, and its ports, which it has not opened yet."""
    context = multiprocessing.get_context("spawn")
    words = context.RawArray("q", words_for(len(lines)))
    ports = [
        OutputPort(f"out{number}", line.path, Line(10**6), 5_000_000, b"first", b"safe!")
        for number, line in enumerate(lines)
    ]
    guard = Guard(context, words, [], SAFE, Standing())
    guard.start()
    return guard, words, ports


def test_frames_come_from_its_own_process_until_it_is_closed() -> None:
    with ptys(1) as (line,):
        guard, words, ports = started(line)
        said: list[str] = []
        guard.open(ports, said.append)
        assert said[0].startswith("real time, guardian: ")
        line.wait_for(b"first")
        outboxes(words)[0].put(b"going")
        line.wait_for(b"going")
        assert guard.alarm() is None
        guard.make_safe()
        line.wait_for(b"safe!")
        assert (guard.close(), guard.process.exitcode) == ([], 0)
        assert line.read().endswith(3 * b"safe!")
        assert guard.close() == []


ENDS_EARLY = """
import sys
from types import SimpleNamespace
from tests.quadvis.realtime.test_guard import started
guard, _, ports = started(SimpleNamespace(path=sys.argv[1]))
guard.open(ports, print)
"""


@pytest.mark.slow
def test_a_supervisor_that_ends_without_closing_it_does_not_wait_for_ever() -> None:
    with ptys(1) as (line,):
        subprocess.run([sys.executable, "-c", ENDS_EARLY, line.path], check=True, timeout=60)
        assert b"first" in line.read() and line.read().endswith(3 * b"safe!")


@pytest.mark.slow
def test_a_guardian_that_is_lost_is_replaced_by_the_supervisor_port_by_port() -> None:
    with ptys(2) as (line, other):
        guard, _, ports = started(line, other)
        guard.open(ports, lambda _: None)
        other.wait_for(b"first")
        assert guard.process.pid is not None
        os.kill(guard.process.pid, signal.SIGKILL)
        guard.process.join()
        other.unplug()
        assert wait_for(guard.alarm) == LOST
        (unsafe,) = guard.close()
        assert unsafe.startswith("block 'out1': its safe values could not be sent: ")
        assert line.read().endswith(b"safe!")


@dataclass(frozen=True)
class Broken(Card):
    """The settings of a card whose driver fails in its own way."""

    def open(self, port: str) -> OpenPort:
        raise OSError(19, "no such device")


def lost(*ports: OutputPort) -> Guard:
    """Return a guardian of ports that has ended without a word."""
    context = multiprocessing.get_context("spawn")
    guard = Guard(context, context.RawArray("q", words_for(len(ports))), [], SAFE, Standing())
    guard._ports, guard._started, guard._lost = ports, True, True
    guard.process = Ended()  # type: ignore[assignment]
    return guard


class Ended:
    """A process that was killed."""

    exitcode = -9

    def join(self, timeout: float | None = None) -> None:
        return

    def kill(self) -> None:
        return


def test_in_its_place_a_device_that_starts_and_one_with_a_beginning_get_their_safe_frames() -> None:
    with ptys(2) as (one, two):
        slow = OutputPort("slow", one.path, Line(10**6, settle=0.05), MS, b"first", b"safe!")
        greeted = OutputPort("greeted", two.path, Line(10**6), MS, b"first", b"safe!", beginning=b"hello")
        assert lost(slow, greeted).close() == []
        assert (one.read(), two.read()) == (3 * b"safe!", b"hello" + 3 * b"safe!")


def test_in_its_place_a_device_that_is_held_has_safe_frames_for_its_time_and_is_released() -> None:
    with ptys(1) as (line,):
        port = OutputPort("held", line.path, Line(10**6), MS, b"first", b"safe!", ending=b"bye", held=20 * MS)
        assert lost(port).close() == []
        assert line.read().endswith(2 * b"safe!" + b"bye")


def test_in_its_place_a_driver_that_fails_in_its_own_way_keeps_no_other_port_from_its_safe_frames() -> None:
    with ptys(1) as (line,):
        broken = OutputPort("card", "card", Broken(), MS, b"first", b"safe!")
        whole = OutputPort("out", line.path, Line(10**6), MS, b"first", b"safe!")
        (unsafe,) = lost(broken, whole).close()
        why = "the driver has failed: OSError: [Errno 19] no such device"
        assert unsafe == f"block 'card': its safe values could not be sent: {why}"
        assert line.read() == 3 * b"safe!"


@pytest.mark.slow
def test_a_port_that_refuses_is_the_error_of_the_start() -> None:
    with ptys(1) as (line,):
        missing = Pty()
        missing.close()
        guard, _, ports = started(line, missing)
        with pytest.raises(RunError, match=r"block 'out1': port '/dev/pts/\d+' is missing"):
            guard.open(ports, lambda _: None)
        line.wait_for(b"safe!")
        assert guard.close() == []


@pytest.mark.slow
def test_a_guardian_that_has_no_ports_yet_ends_when_it_is_asked() -> None:
    with ptys(1) as (line,):
        guard, _, _ = started(line)
        guard.make_safe()
        assert (guard.close(), guard.process.exitcode, line.read()) == ([], 0, b"")
