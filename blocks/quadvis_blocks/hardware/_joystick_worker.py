"""The process that reads a joystick: it leaves the newest report, and opens it again after a loss."""

from __future__ import annotations

import math
import select
import struct
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from quadvis.errors import quoted
from quadvis.machine.capture import GOOD, OPENING, STATUS, CaptureRequest, Post
from quadvis.machine.ports import PortError
from quadvis_blocks.hardware._event_codes import EventCode
from quadvis_blocks.hardware._event_device import EventDevice, EventReport, Lacking
from quadvis_blocks.hardware._joysticks import SYSTEM, identity_of, node_of

WORK = "quadvis_blocks.hardware._joystick_worker:work"
AGAIN = 0.1  # s before a joystick that is lost is tried again
LOOK = 0.2  # s after which a silent joystick is waited for anew
LIMIT = 2.0  # s that a call may take
HELD = 0.5  # share of its range from which on a dead-man is held
NANOSECONDS = 10**9
TAIL = struct.Struct(
    "<3d"
)  # of a record: whether the dead-man is held, s since its press, s since its renewal


@dataclass(frozen=True)
class JoystickRequest:
    """A joystick by its lasting name, the codes of its elements, and that of its dead-man.

    ``identity`` is that of the device at the start, if it was there: no other one is taken in its place.
    """

    device: str
    codes: tuple[EventCode, ...]
    dead_man: EventCode
    identity: tuple[str, ...] = ()
    system: str = SYSTEM

    def capture(self) -> CaptureRequest:
        """Return what is to be captured."""
        return CaptureRequest(WORK, self, 8 * len(self.codes) + TAIL.size)


class JoystickReport(NamedTuple):
    """A report: the share of its range for each element (0 to 1), and how the dead-man is.

    ``pressed`` and ``renewed`` are the times (s) before the report at which it was pressed, and at which it
    last changed while it was held; infinite if never.
    """

    shares: tuple[float, ...]
    held: bool
    pressed: float
    renewed: float

    def pack(self) -> bytes:
        """Return the bytes of a record."""
        return struct.pack(f"<{len(self.shares)}d", *self.shares) + TAIL.pack(
            self.held, self.pressed, self.renewed
        )

    @staticmethod
    def unpack(piece: bytes | memoryview) -> JoystickReport:
        """Return what a record says."""
        count = (len(piece) - TAIL.size) // 8
        held, pressed, renewed = TAIL.unpack(piece[8 * count :])
        return JoystickReport(struct.unpack(f"<{count}d", piece[: 8 * count]), bool(held), pressed, renewed)


class DeadMan:
    """When the dead-man was pressed and renewed, from one report to the next (instants in ns)."""

    def __init__(self) -> None:
        self._last: float | None = None
        self._pressed = self._renewed = -math.inf
        self.held = False

    def take(self, share: float, instant: int) -> None:
        """Take its place after a report: what it is at first is no press, since nobody saw it released."""
        held = share > HELD
        if self._last is not None and held and share != self._last:
            self._renewed = instant
            self._pressed = self._pressed if self.held else instant
        self._last, self.held = share, held

    def since(self, instant: int) -> tuple[float, float]:
        """Return the times since it was pressed and renewed (s)."""
        return (instant - self._pressed) / NANOSECONDS, (instant - self._renewed) / NANOSECONDS


Opener = Callable[[str, tuple[EventCode, ...]], EventDevice]


class JoystickWorker:
    """One joystick, from its opening to its loss."""

    def __init__(self, post: Post, request: JoystickRequest, opener: Opener = EventDevice) -> None:
        self._post, self._request, self._opener = post, request, opener

    def serve(self) -> None:
        """Open the joystick and take its reports until it is gone; then return, to be called again."""
        self._post.calling(LIMIT)
        try:
            device = self._open()
        except PortError as error:
            self._post.say(OPENING, str(error), hopeless=isinstance(error, Lacking))
            return
        try:
            self._take(device)
        except PortError as error:
            self._post.say(OPENING, str(error))
        finally:
            device.close()

    def _open(self) -> EventDevice:
        request = self._request
        node = node_of(request.device, request.system)
        if request.identity and identity_of(node, request.system) != request.identity:
            raise PortError(f"another device is at {quoted(request.device)}; plug the first one in again")
        return self._opener(node, (*request.codes, request.dead_man))

    def _take(self, device: EventDevice) -> None:
        dead_man = DeadMan()
        if not device.stands_in:
            self._leave(device.state(time.monotonic_ns()), dead_man, device)
        while True:
            self._post.calling(LIMIT)
            if select.select([device.descriptor], [], [], LOOK)[0]:
                for report in device.read():
                    self._leave(report, dead_man, device)

    def _leave(self, report: EventReport, dead_man: DeadMan, device: EventDevice) -> None:
        """Leave the state after a report."""
        *shares, press = report.shares
        if device.known(self._request.dead_man):
            dead_man.take(press, report.instant)
        made = JoystickReport(tuple(shares), dead_man.held, *dead_man.since(report.instant))
        if report.dropped:
            self._post.refuse()
        self._post.put(report.instant, self._post.take(), [made.pack()])
        if self._post.words[STATUS] != GOOD:
            self._post.say(GOOD, f"{quoted(self._request.device)}, a joystick")


def work(post: Post, request: JoystickRequest) -> None:
    """Be the worker: the whole life of its process."""
    worker = JoystickWorker(post, request)
    while True:
        worker.serve()
        post.calling(AGAIN + LIMIT)
        time.sleep(AGAIN)
