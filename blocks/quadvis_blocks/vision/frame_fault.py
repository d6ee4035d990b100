"""A camera that fails for a while, on purpose."""

from __future__ import annotations

import numpy as np

from quadvis.block import Block, Frame, In, Out, Param, Random, State, Work, uniform
from quadvis_blocks.vision._fault_timing import NO_FAULT, TIMING, comes, is_on, shows, stamped
from quadvis_vision.simulation.picture_faults import PICTURES

KINDS = (NO_FAULT, *TIMING, *PICTURES)


class FrameFault(Block, numeric=False):
    """Frames that pass unchanged, except during a fault of one kind: for ``duration`` from ``begin`` on.

    Put this block between a camera and the blocks behind it, to see how they react to the fault.

    ===================================================== =================================================
    kind                                                  effect
    ===================================================== =================================================
    ``drop``, ``bursts``, ``late``, ``swap``              frames do not come, or come at a wrong time
    ``freeze``, ``alternate``, ``stutter``, ``outdated``  an old picture comes under a new stamp and number
    ``..._stamp``, ``clock_restart``                      only the stamps change
    all others                                            only the pictures change
    ===================================================== =================================================

    The block counts one frame per tick, so it must run at the rate of the camera.
    """

    kind = Param(NO_FAULT, choices=KINDS, doc="kind of the fault")
    begin = Param(0.0, unit="s", doc="beginning of the fault (inclusive)")
    duration = Param(3.0, unit="s", min=0.0, doc="length of the fault")
    frame = In("frame", doc="the newest frame of a camera")
    faulty = Out("frame", doc="that frame, or what the fault makes of it")
    active = Out("bool", doc="whether the fault is active")
    chance = Random()
    drawn = State()  # random number for the picture of the coming tick
    ticks = State("int64")  # of the fault so far
    shown = State("frame")  # the frame on the output one tick ago
    shown_before = State("frame")  # the frame on the output two ticks ago
    one = State("frame")  # the frame that came one tick ago
    two = State("frame")
    three = State("frame")
    on = Work("bool")
    _given: Frame  # by output, for update of the same tick

    example = """
        pictures: {block: vision.image_folder, rate: slow, with: {folder: "quadvis:recordings/hand_held"}}
        fault:
          block: vision.frame_fault
          rate: slow
          with: {kind: freeze, begin: 0.3 s, duration: 0.4 s}
          in: {frame: pictures.frame}
    """

    def start(self) -> None:
        """Draw the random number of the first picture."""
        self.drawn = uniform(self.chance)

    def output(self, frame: Frame, time: float) -> tuple[Frame, bool]:
        """Return the frame, with the fault while that is active, and whether it is active."""
        self.on = is_on(time, self.begin, self.duration)
        kind = KINDS[self.kind]
        whole = kind == NO_FAULT or frame.sequence == 0 or not self.on
        self._given = frame if whole else self._broken(kind, frame)
        return self._given, self.on

    def update(self, frame: Frame) -> None:
        """Keep the frame that came and the frame that was shown."""
        self.shown, self.shown_before = self._given, self.shown
        self.one, self.two, self.three = frame, self.one, self.two
        self.ticks = self.ticks + 1 if self.on else 0
        self.drawn = uniform(self.chance)

    def _broken(self, kind: str, frame: Frame) -> Frame:
        shown: Frame = self.shown
        past = (frame, self.one, self.two, self.three)
        which = comes(kind, self.ticks)
        if which < 0 or past[which].sequence == 0:
            return shown
        frame, picture = past[which], shows(kind, self.ticks)
        before = self.shown_before if picture == -2 and self.shown_before.sequence else shown
        pixels = before.pixels if picture < 0 else past[which + picture].pixels
        if kind in PICTURES:
            chance = np.random.default_rng(int(self.drawn * 2**53))
            pixels = PICTURES[kind](frame.pixels, self.one.pixels, chance)
        stamp = stamped(kind, frame.stamp, self.ticks, self.period, self.begin, shown.stamp)
        return Frame(pixels, stamp, frame.sequence)
