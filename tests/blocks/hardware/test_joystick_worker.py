"""The process that reads a joystick, without a process of its own."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from quadvis.machine.capture import GOOD, HOPELESS, OPENING, STATUS, Post
from quadvis_blocks.hardware._event_codes import EventCode
from quadvis_blocks.hardware._event_device import EventDevice
from quadvis_blocks.hardware._joystick_worker import DeadMan, JoystickReport, JoystickRequest, JoystickWorker
from quadvis_blocks.hardware._joysticks import identity_of
from tests.blocks.hardware.events import Driver, Fifo, Folders, code, report
from tests.processes import wait_for

STICKS = (code("ABS_Y"), code("ABS_X"))


def post_for(request: JoystickRequest) -> Post:
    room = request.capture().room
    made = Post(np.zeros(Post.size(room), np.int64), room)
    made.words[STATUS] = OPENING
    return made


class Seen:
    """A worker in a thread, and what it leaves."""

    def __init__(self, request: JoystickRequest, **more: Any) -> None:
        self.post = post_for(request)
        self.worker = JoystickWorker(self.post, request, **more)

    def now(self) -> JoystickReport:
        found = self.post.newest()
        assert found is not None
        return JoystickReport.unpack(found.payload)

    def wait(self, **wanted: Any) -> JoystickReport:
        """Wait for a report with these values."""
        wait_for(
            lambda: (
                self.post.newest() is not None
                and all(getattr(self.now(), name) == value for name, value in wanted.items())
            )
        )
        return self.now()

    @contextmanager
    def serving(self) -> Iterator[None]:
        thread = threading.Thread(target=self.worker.serve, daemon=True)
        thread.start()
        yield
        thread.join(10.0)
        assert not thread.is_alive()


def test_reports_come_with_the_dead_man_and_a_loss_is_said(tmp_path: Path) -> None:
    fifo = Fifo(tmp_path / "stick")
    seen = Seen(JoystickRequest(fifo.path, STICKS, code("BTN_TL")))
    with seen.serving():
        fifo.plug()
        fifo.send(report(ABS_Y=32767, BTN_TL=1))
        first = seen.wait(shares=(1.0, 0.5))
        assert first.held and first.pressed == first.renewed == math.inf  # nobody saw it pressed
        assert seen.post.words[STATUS] == GOOD
        fifo.send(report(ABS_X=-32767, BTN_TL=0))
        assert not seen.wait(shares=(1.0, 0.0)).held
        fifo.send(report(BTN_TL=1))
        assert seen.wait(held=True).pressed == 0.0
        fifo.send(report(BTN_TL=1, ABS_X=32767))
        later = seen.wait(shares=(1.0, 1.0))
        assert later.held and 0.0 < later.pressed == later.renewed < 60.0
        fifo.unplug()
    assert seen.post.words[STATUS] == OPENING and "is gone" in seen.post.text


def test_a_device_shows_its_state_before_its_first_report(tmp_path: Path) -> None:
    fifo = Fifo(tmp_path / "stick")
    driver = Driver({"ABS_Y": (0, 0, 100), "ABS_X": (75, 0, 100)}, {"BTN_TL": 1})

    def opener(path: str, codes: tuple[EventCode, ...]) -> EventDevice:
        return EventDevice(path, codes, driver)

    seen = Seen(JoystickRequest(fifo.path, STICKS, code("BTN_TL")), opener=opener)
    with seen.serving():
        fifo.plug()
        first = seen.wait(shares=(0.0, 0.75))
        assert first.held and first.pressed == math.inf
        fifo.unplug()


def test_what_a_device_has_not_ends_the_waiting(tmp_path: Path) -> None:
    fifo = Fifo(tmp_path / "stick")
    driver = Driver({"ABS_X": (75, 0, 100)}, {"BTN_TL": 1})
    seen = Seen(
        JoystickRequest(fifo.path, STICKS, code("BTN_TL")),
        opener=lambda path, codes: EventDevice(path, codes, driver),
    )
    seen.worker.serve()
    assert seen.post.words[HOPELESS] and "has no axis ABS_Y" in seen.post.text
    absent = Seen(JoystickRequest(fifo.path + "x", STICKS, code("BTN_TL")))
    absent.worker.serve()
    assert not absent.post.words[HOPELESS] and "is missing; plug it in" in absent.post.text


def test_another_device_is_not_taken_in_the_place_of_one_that_is_lost(tmp_path: Path) -> None:
    folders = Folders(tmp_path)
    for number, name, link in (
        (0, "A", "by-id/usb-A-event-joystick"),
        (1, "B", "by-id/usb-B-event-joystick"),
    ):
        folders.add(number, name, links=(link,))
    path = f"{folders.system}/dev/input/by-id/usb-A-event-joystick"
    identity = identity_of(path, folders.system)
    seen = Seen(JoystickRequest(path, STICKS, code("BTN_TL"), identity, folders.system))
    # A is pulled out; B comes back under its number, and somebody links A's name to it.
    for number in (0, 1):
        folders.remove(number)
    folders.add(0, "B", links=("by-id/usb-B-event-joystick",))
    seen.worker.serve()
    assert "is missing" in seen.post.text and "usb-B" in seen.post.text
    Path(path).symlink_to(folders.node(0))
    seen.worker.serve()
    assert seen.post.text.startswith("another device is at")
    assert seen.post.newest() is None
    # A is back, as number 7.
    Path(path).unlink()
    folders.add(7, "A", links=("by-id/usb-A-event-joystick",))
    fifo = Fifo.__new__(Fifo)
    fifo.path = str(folders.node(7))
    with seen.serving():
        fifo.plug()
        fifo.send(report(ABS_Y=32767))
        seen.wait(shares=(1.0, 0.5))
        fifo.unplug()


def test_an_axis_can_be_a_dead_man_that_is_renewed_by_moving_it() -> None:
    dead_man = DeadMan()
    for instant, share in ((1, 0.0), (2, 0.4), (3, 0.8), (4, 0.8), (5, 0.9)):
        dead_man.take(share, instant * 10**9)
    assert dead_man.held and dead_man.since(6 * 10**9) == (3.0, 1.0)
    dead_man.take(0.2, 7 * 10**9)
    assert not dead_man.held and dead_man.since(8 * 10**9) == (5.0, 3.0)
    dead_man.take(0.6, 9 * 10**9)
    assert dead_man.since(9 * 10**9) == (0.0, 0.0)


@pytest.mark.parametrize("count", [1, 2, 8])
def test_a_report_is_what_was_packed(count: int) -> None:
    made = JoystickReport(tuple(np.linspace(0.0, 1.0, count).tolist()), True, 0.25, math.inf)
    assert JoystickReport.unpack(memoryview(made.pack())) == made
