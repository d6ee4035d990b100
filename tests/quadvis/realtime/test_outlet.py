"""One output port: which frame it gets when, and how it is lost."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator

import pytest

from quadvis.machine.serial_port import Line, PortError
from quadvis.realtime.outlet import STUCK, Outlet, OutputPort
from tests.quadvis.realtime.ptys import Pty, ptys

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="ports are Linux's")

MS = 10**6
BEGIN = 10**9
LINE = Line(100_000, parity="even", stop_bits=2, gap=3e-3)  # a frame of 5 bytes takes 0.6 ms, and a gap


class Rig:
    """An outlet every 10 ms, and the frames that a loop would give it."""

    def __init__(self, pty: Pty) -> None:
        self.pty = pty
        self.newest: list[bytes] = []
        port = OutputPort("out", pty.path, LINE, 10 * MS, b"first", b"safe!")
        self.outlet = Outlet(port, lambda: self.newest.pop() if self.newest else None)

    def serve(self, instant: float, *, safe: bool = False) -> bytes:
        """Serve at an instant (ms), and return what has come to the peer."""
        before = len(self.pty.read())
        self.outlet.serve(BEGIN + int(instant * MS), safe=safe)
        return self.pty.read()[before:]


@pytest.fixture
def rig() -> Iterator[Rig]:
    with ptys(1) as (pty,):
        made = Rig(pty)
        made.outlet.open()
        yield made
        made.outlet.close()


def test_the_initial_frame_comes_at_once_then_the_newest_is_repeated(rig: Rig) -> None:
    assert rig.serve(0) == b"first"
    assert [rig.serve(at) for at in (1, 9.9, 10.1, 19)] == [b"", b"", b"first", b""]
    rig.newest.append(b"one..")
    assert [rig.serve(at) for at in (20.1, 30.1)] == [b"one..", b"one.."]


def test_what_was_missed_is_left_out_and_the_grid_stays(rig: Rig) -> None:
    assert rig.serve(0) == b"first"
    assert [rig.serve(at) for at in (47, 49, 50)] == [b"first", b"", b"first"]


def test_the_safe_frame_comes_as_soon_as_the_line_is_free(rig: Rig) -> None:
    rig.newest.append(b"one..")
    assert rig.serve(0) == b"one.."
    rig.outlet.hurry(BEGIN + MS)
    assert [rig.serve(at, safe=True) for at in (1, 3.5, 3.7)] == [b"", b"", b"safe!"]
    assert rig.outlet.safe_frames == 1
    rig.newest.append(b"two..")
    assert [rig.serve(at, safe=True) for at in (10, 13.7)] == [b"", b"safe!"]


def test_a_port_that_takes_a_part_gets_the_rest_before_another_frame(rig: Rig) -> None:
    taken = []

    def stingy(_: int, piece: bytes) -> int:
        taken.append(piece)
        return 2

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "write", stingy)
        for at in (0, 10, 20):
            rig.serve(at)
    assert taken == [b"first", b"rst", b"t"]
    assert rig.serve(30) == b"first"


def test_a_port_that_takes_nothing_for_a_second_is_lost(rig: Rig) -> None:
    def full(*_: object) -> int:
        raise BlockingIOError

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "write", full)
        rig.serve(0)
        rig.serve(STUCK / MS)
        with pytest.raises(PortError, match=r"/dev/pts/\d+: the port takes no bytes"):
            rig.serve(STUCK / MS + 10)


def test_a_port_that_is_unplugged_is_lost(rig: Rig) -> None:
    rig.serve(0)
    rig.pty.unplug()
    with pytest.raises(PortError, match=r"/dev/pts/\d+: the port is gone"):
        rig.serve(10)
