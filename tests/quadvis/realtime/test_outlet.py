"""One output port: which frame it gets when, and how it is lost."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import pytest

from quadvis.machine.ports import OpenPort, PortError
from quadvis.machine.serial_port import Line
from quadvis.realtime.outlet import STUCK, Outlet, OutputPort
from tests.quadvis.realtime.ptys import Pty, ptys

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="ports are Linux's")

MS = 10**6
BEGIN = 10**9
LINE = Line(100_000, parity="even", stop_bits=2, gap=3e-3)  # a frame of 5 bytes takes 0.6 ms, and a gap


class Rig:
    """An outlet every 10 ms, and the frames that a loop would give it."""

    def __init__(self, pty: Pty, **given: Any) -> None:
        self.pty = pty
        self.newest: list[bytes] = []
        given = {"settings": LINE, **given}
        port = OutputPort("out", pty.path, interval=10 * MS, initial=b"first", safe=b"safe!", **given)
        self.outlet = Outlet(port, lambda: self.newest.pop() if self.newest else None)

    def serve(self, instant: float, *, safe: bool = False) -> bytes:
        """Serve at an instant (ms), and return what has come to the peer."""
        before = len(self.pty.read())
        self.outlet.serve(BEGIN + int(instant * MS), safe=safe)
        return self.pty.read()[before:]


@pytest.fixture
def make() -> Iterator[Any]:
    with ptys(1) as (pty,):
        made = []

        def outlet(**given: Any) -> Rig:
            made.append(Rig(pty, **given))
            made[0].outlet.open()
            return made[0]

        yield outlet
        made[0].outlet.close()


@pytest.fixture
def rig(make: Any) -> Rig:
    made: Rig = make()
    return made


def test_the_initial_frame_comes_at_once_then_the_newest_is_repeated(rig: Rig) -> None:
    assert rig.serve(0) == b"first"
    assert [rig.serve(at) for at in (1, 9.9, 10.1, 19)] == [b"", b"", b"first", b""]
    rig.newest.append(b"one..")
    assert [rig.serve(at) for at in (20.1, 30.1)] == [b"one..", b"one.."]


def test_a_board_that_starts_anew_when_it_is_opened_hears_nothing_for_its_time_and_then_whole_frames(
    make: Any,
) -> None:
    rig = make(settings=LINE._replace(settle=2.0), beginning=b"hello")
    rig.newest.append(b"one..")
    assert [rig.serve(at) for at in (0, 10, 1000, 1999.9)] == [b""] * 4
    assert [rig.serve(at) for at in (2000, 2004)] == [b"hello", b"one.."]
    assert [rig.serve(at, safe=True) for at in (2014, 2024)] == [b"safe!", b"safe!"]


def test_safe_frames_wait_for_such_a_board_too(make: Any) -> None:
    rig = make(settings=LINE._replace(settle=2.0))
    assert rig.serve(0) == b""
    rig.outlet.hurry(BEGIN + MS)
    assert [rig.serve(at, safe=True) for at in (1, 1000, 2000)] == [b"", b"", b"safe!"]


def test_what_was_missed_is_left_out_and_the_grid_stays(rig: Rig) -> None:
    assert rig.serve(0) == b"first"
    assert [rig.serve(at) for at in (47, 49, 50)] == [b"first", b"", b"first"]


def test_the_safe_frame_comes_as_soon_as_the_line_is_free(rig: Rig) -> None:
    rig.newest.append(b"one..")
    assert rig.serve(0) == b"one.."
    rig.outlet.hurry(BEGIN + MS)
    assert [rig.serve(at, safe=True) for at in (1, 3.5, 3.7)] == [b"", b"", b"safe!"]
    assert [rig.outlet.has_its_farewell(frames) for frames in (1, 2)] == [True, False]
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


class Narrow(OpenPort):
    """A port that takes so many bytes at once as it has ``room`` for."""

    def __init__(self) -> None:
        self.taken: list[bytes] = []
        self.room = 100

    def write(self, piece: bytes) -> int:
        count = min(self.room, len(piece))
        self.taken += [piece[:count]] if count else []
        return count

    def close(self) -> None:
        return


def narrow(interval: int, frame: bytes | None = None) -> tuple[Outlet, Narrow]:
    """Return an outlet at such a port, open, for frames with an interval (ns)."""
    port = Narrow()
    outlet = Outlet(
        OutputPort("out", "port", LINE, interval, b"first", b"safe!"), lambda: frame, lambda: port
    )
    outlet.open()
    return outlet, port


def test_a_port_that_takes_nothing_once_is_not_lost_however_seldom_frames_are_due() -> None:
    interval = 2 * STUCK
    outlet, port = narrow(interval)
    for number, port.room in enumerate((100, 0, 100, 0)):
        outlet.serve(BEGIN + number * interval, safe=False)
    assert port.taken == 2 * [b"first"]
    with pytest.raises(PortError, match="the port takes no bytes"):
        outlet.serve(BEGIN + 4 * interval, safe=False)


def test_a_command_of_which_the_port_took_nothing_does_not_come_before_the_safe_frame() -> None:
    outlet, port = narrow(10 * MS, b"going")
    port.room = 0
    outlet.serve(BEGIN, safe=False)
    outlet.serve(BEGIN + 10 * MS, safe=True)
    assert (port.taken, outlet.safe_frames) == ([], 0)
    port.room = 100
    outlet.serve(BEGIN + 20 * MS, safe=True)
    assert (port.taken, outlet.safe_frames) == ([b"safe!"], 1)


def test_the_safe_frame_comes_right_behind_the_rest_of_a_command() -> None:
    interval = 1000 * MS
    outlet, port = narrow(interval, b"going")
    port.room = 2
    outlet.serve(BEGIN, safe=False)
    port.room = 100
    outlet.hurry(BEGIN + MS)
    outlet.serve(BEGIN + 5 * MS, safe=True)
    assert outlet.due < BEGIN + 15 * MS
    outlet.serve(outlet.due, safe=True)
    assert port.taken == [b"go", b"ing", b"safe!"]


def test_a_port_that_is_unplugged_is_lost(rig: Rig) -> None:
    rig.serve(0)
    rig.pty.unplug()
    with pytest.raises(PortError, match=r"/dev/pts/\d+: the port is gone"):
        rig.serve(10)


def test_a_beginning_and_an_ending_come_once(make: Any) -> None:
    rig = make(beginning=b"init", ending=b"bye")
    assert [rig.serve(at) for at in (0, 3, 3.5, 3.6)] == [b"init", b"", b"first", b""]
    assert rig.serve(13.6, safe=True) == b"safe!"
    rig.outlet.finish(BEGIN + 14 * MS)
    assert rig.pty.read() == b"initfirstsafe!bye"
    assert not rig.outlet.is_open


def test_after_the_time_for_which_it_is_held_a_device_is_released(make: Any) -> None:
    rig = make(ending=b"bye", held=25 * MS)
    assert [rig.serve(at, safe=True) for at in (0, 10, 20, 30, 40, 50)] == [b"safe!"] * 3 + [b"bye", b"", b""]
    assert rig.outlet.has_its_farewell(99)
    rig.outlet.finish(BEGIN + 60 * MS)
    assert rig.pty.read() == b"safe!" * 3 + b"bye"


def test_a_loop_that_goes_on_takes_a_device_back(make: Any) -> None:
    rig = make(ending=b"bye", held=15 * MS)
    assert [rig.serve(at, safe=True) for at in (0, 10, 20, 30)] == [b"safe!", b"safe!", b"bye", b""]
    assert not rig.serve(39)
    assert [rig.serve(40), rig.serve(50, safe=True), rig.serve(70, safe=True)] == [b"first", b"safe!", b"bye"]


@dataclass
class Numbered:
    """Puts a number before each frame, and the millisecond at which it is sent behind it."""

    added: int = 2
    count: int = 0
    fails: list[str] = field(default_factory=list)

    def seal(self, frame: bytes, now_ns: int) -> bytes:
        """Count."""
        if self.fails:
            raise ValueError(self.fails[0])
        self.count += 1
        return b"%d" % self.count + frame + b"%d" % ((now_ns - BEGIN) // MS % 10)


def test_each_frame_is_sealed_at_its_sending_the_safe_ones_too(make: Any) -> None:
    rig = make(sealer=Numbered())
    assert [rig.serve(0), rig.serve(12), rig.serve(25, safe=True)] == [b"1first0", b"2first2", b"3safe!5"]


def test_a_sealer_that_fails_loses_the_port(make: Any) -> None:
    rig = make(sealer=Numbered(fails=["no key"]))
    with pytest.raises(PortError, match=r"/dev/pts/\d+: a frame cannot be sealed: no key"):
        rig.serve(0)
