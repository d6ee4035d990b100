"""A camera that fails for a while, on purpose."""

from __future__ import annotations

import numpy as np

from quadvis.block import Block, Frame, In, Out, Param, Random, State, Work, uniform
from quadvis_blocks.vision._fault_timing import NO_FAULT, TIMING, comes, is_on, shows, stamped
from quadvis_vision.simulation.picture_faults import PICTURES

KINDS = (NO_FAULT, *TIMING, *PICTURES)


class FrameFault(Block, numeric=False):
    """Frames as they come, and with a fault of one kind for ``duration`` from ``begin`` on.

    Put it between a camera and those who look, to see what they make of it. For ``drop``, ``bursts``,
    ``late`` and ``swap`` frames do not come, or not when they should; with ``freeze``, ``alternate``,
    ``stutter`` and ``outdated`` an old picture comes under a new stamp and number; the kinds in ``_stamp``
    and ``clock_restart`` change the stamps alone; all others change the picture and leave stamp and number
    as they are. It counts a frame a tick, so it runs at the rate of the camera.
    """

    kind = Param(NO_FAULT, choices=KINDS, doc="what goes wrong")
    begin = Param(0.0, unit="s", doc="begin of the fault (inclusive)")
    duration = Param(3.0, unit="s", min=0.0, doc="its length")
    frame = In("frame", doc="the newest frame of a camera")
    faulty = Out("frame", doc="what comes of it")
    active = Out("bool", doc="whether the fault is there")
    chance = Random()
    drawn = State()  # for the picture of the coming tick
    ticks = State("int64")  # of the fault so far
    shown = State("frame")  # at the tick before
    shown_before = State("frame")  # and the one before
    one = State("frame")  # that came a tick ago
    two = State("frame")
    three = State("frame")
    on = Work("bool")
    _given: Frame  # by output, for update of the same tick

    def start(self) -> None:
        """Draw what the first picture needs."""
        self.drawn = uniform(self.chance)

    def output(self, frame: Frame, time: float) -> tuple[Frame, bool]:
        """Return the frame or what is left of it, and whether there is a fault."""
        self.on = is_on(time, self.begin, self.duration)
        kind = KINDS[self.kind]
        whole = kind == NO_FAULT or frame.sequence == 0 or not self.on
        self._given = frame if whole else self._broken(kind, frame)
        return self._given, self.on

    def update(self, frame: Frame) -> None:
        """Keep what came and what was shown."""
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
