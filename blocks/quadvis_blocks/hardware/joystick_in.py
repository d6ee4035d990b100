"""A pilot's sticks and switches at a USB joystick, or at a transmitter that shows itself as one."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import CapturedInput, CaptureRequest, Out, Param, ParameterError, SourceRecord, passed
from quadvis.errors import quoted, sentence
from quadvis.machine.capture import GOOD
from quadvis.machine.ports import PortError
from quadvis_blocks.hardware._event_codes import EventCode, event_code, likely
from quadvis_blocks.hardware._joystick_worker import JoystickReport, JoystickRequest
from quadvis_blocks.hardware._joysticks import identity_of, lasting_name, missing, node_of
from quadvis_blocks.hardware._loss import ON_LOSS_DOC, ROLES_DOC, loss_doubts, loss_values

CHANGES = 1


class JoystickIn(CapturedInput):
    """Sticks and switches of a joystick, or of a transmitter at USB (Linux): the newest report at each step.

    A process of its own reads the device. A repeated value is no proof that a device lives (joystick_drivers
    #92: one drove a robot off a kerb). So commands are ``valid`` only while the pilot holds the dead-man and
    the newest report is no older than ``max_age``; a device that is gone is not valid in the next step. After
    each silence and loss the dead-man must be released and pressed again. Else each element is what
    ``on_loss`` or its role says.

    Linux hands on only what has changed, unless the driver adds something to each report. A device that is
    silent while nobody moves it cannot show that it lives: it may steer with ``reports: changes``, if the
    dead-man is pressed again, or as an axis moved, every ``renewal``.

    Only the same device is taken again after a loss: name it by its path in /dev/input/by-id or by-path, or
    as ``name:TITLE`` by the name that it gives itself. A number is taken only if there is one joystick, and
    of two that are alike each must be named by-path. A FIFO that carries struct input_event may take its
    place: its axes go from -32767 to 32767, its hats from -1 to 1.
    """

    port_example = "/dev/input/by-id/NAME-event-joystick"

    device = Param(
        type="port", doc="path such as /dev/input/by-id/NAME-event-joystick, name:TITLE, or number"
    )
    codes = Param(
        type="str",
        doc="axis or button of each element, in one word each, as <linux/input-event-codes.h> names them: "
        "ABS_Y ABS_X BTN_TR, or by number ABS_41, KEY_288",
    )
    lowest = Param(
        type="float64[n]", unit="a", doc="command at the low end of an axis, or of a released button"
    )
    highest = Param(type="float64[n]", unit="a", doc="command at the high end, or of a pressed button")
    roles = Param(type="str", doc=ROLES_DOC)
    on_loss = Param("", type="str", doc=ON_LOSS_DOC)
    dead_man = Param(type="str", doc="button, or axis beyond its middle, that the pilot holds to steer")
    max_age = Param(0.3, unit="s", above=0.0, max=0.3, doc="greatest age (inclusive) of a report that counts")
    reports = Param(
        "always",
        choices=("always", "changes"),
        doc="whether the device reports when nothing changes; if not, the dead-man must be renewed",
    )
    renewal = Param(
        2.0, unit="s", above=0.0, max=2.0, doc="how long (inclusive) a renewal lasts, reports: changes"
    )
    command = Out("float64[n]", unit="a", doc="the commands; those of a loss while they are not valid")
    valid = Out("bool", doc="whether these are the pilot's commands")
    held = Out("bool", doc="whether the dead-man is held, by the newest report")

    example = """
        sticks:
          block: hardware.joystick_in
          rate: fast
          with:
            device: /dev/input/by-id/usb-gamepad-event-joystick
            codes: ABS_Y ABS_X BTN_TR
            lowest: [1, -1, 0]
            highest: [-1, 1, 1]
            roles: throttle stick switch
            dead_man: BTN_TL
    """

    def check(self) -> None:
        """Refuse words that are no axis and no button, and ends that are none."""
        self._codes("codes", self.codes, len(self.lowest))
        self._codes("dead_man", self.dead_man, 1)
        if np.equal(self.lowest, self.highest).any():
            raise ParameterError("highest", "highest must be different from lowest, element by element")
        loss_values(self.roles, self.on_loss, self.lowest, self.highest)

    def doubts(self) -> list[ParameterError]:
        """Warn of a throttle that does not go to its minimum on a loss."""
        return loss_doubts(self.roles, self.on_loss, self.lowest, self.highest)

    def missing(self) -> str:
        """Return a sentence if the joystick is surely not there, else ""."""
        return missing(self.device)

    def capture(self) -> CaptureRequest:
        """Return what is to be captured."""
        device = lasting_name(self.device)
        codes = self._codes("codes", self.codes, len(self.lowest))
        (dead_man,) = self._codes("dead_man", self.dead_man, 1)
        try:
            identity = identity_of(node_of(device))
        except PortError:
            identity = ()
        return JoystickRequest(device, codes, dead_man, identity if any(identity) else ()).capture()

    def open(self) -> None:
        """Begin without a report."""
        super().open()
        self._loss = loss_values(self.roles, self.on_loss, self.lowest, self.highest)
        self._valid, self._dead, self._last = False, -math.inf, None

    def nothing(self) -> tuple[Any, ...]:
        """Return no report."""
        return (JoystickReport((), False, math.inf, math.inf),)

    def values(self, record: SourceRecord) -> tuple[Any, ...]:
        """Return the report."""
        return (JoystickReport.unpack(record.payload),)

    def read(self, time: float) -> None:
        """Take the newest report, and judge whether the pilot steers."""
        super().read(time)
        (report,) = self._newest
        if not self._alive(time, report):
            self._dead, self._valid = time, False
            return
        # Released and pressed again since the last silence: a press that began before it does not count.
        self._valid = report.held and self._stamp - report.pressed > self._dead
        if self._valid:
            shares = np.array(report.shares)
            self._last = self.lowest + shares * (self.highest - self.lowest)

    def output(self) -> Any:
        """Return the state of the device, the commands, and whether they are the pilot's."""
        (report,) = self._newest
        command = self._last if self._valid else self._loss.after(self._last)
        return *super().output()[:5], command, self._valid, report.held

    def _alive(self, time: float, report: JoystickReport) -> bool:
        """Return whether the device has shown that it lives."""
        if self.source.status != GOOD or math.isnan(self._stamp):
            return False
        if self.reports == CHANGES:
            return not passed(time - (self._stamp - report.renewed), self.renewal)
        return not passed(time - self._stamp, self.max_age)

    @staticmethod
    def _codes(name: str, text: str, count: int) -> tuple[EventCode, ...]:
        words = text.split()
        if len(words) != count:
            wanted = "1 word" if count == 1 else f"{count} words, one for each element"
            raise ParameterError(name, f"{name} must have {wanted}, got {len(words)}")
        found = []
        for word in words:
            code = event_code(word)
            if code is None:
                problem = f"{name} must name axes and buttons, got {quoted(word)}"
                raise ParameterError(name, sentence(problem, likely(word)))
            found.append(code)
        return tuple(found)
