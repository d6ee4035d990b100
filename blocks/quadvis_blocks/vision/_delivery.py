"""The transport of frames: latency, jitter and losses; and the frame rate of a simulated camera."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from quadvis.block import Block, Param, ParameterError, Random, State, Work, fill_uniform, passed, reached

QUEUE = 16  # frames that can be on their way at once
SEQUENCE, STAMP, ARRIVAL = range(3)  # the first columns of a row; the rest is the content of the frame
CONTENT = 3

if TYPE_CHECKING:
    _Base = Block
else:  # the classes here alone are no blocks: they declare Work, but have no output method
    _Base = object


class Delivery(_Base):
    """A transport whose frames are late, may get lost, and may overtake each other.

    Frames are numbered from 1, lost frames included. A frame is delivered at the first tick at or after
    beginning + latency + extra; the extra time is drawn for each frame, uniformly from 0 to ``jitter``. The
    wire shows one frame, the one that arrived last. With a jitter longer than the time between two frames, an
    older frame can follow a newer one. Of the frames that arrive between two ticks, the last to arrive is
    shown; of frames that arrive together, the newest. With a latency of whole ticks any jitter costs a whole
    tick.

    Losses are a two-state Markov chain. A frame is lost with probability ``drop_rate`` / ``drop_burst`` after
    a frame that was not lost, and with probability 1 - (1 - ``drop_rate``) / ``drop_burst`` after a lost
    frame. The share of lost frames is ``drop_rate``. The mean length of a run of lost frames is
    ``drop_burst`` / (1 - ``drop_rate``); with a ``drop_burst`` of 1 the losses are independent. Frames
    captured in ``blackout`` are lost, too.

    The delivery has a random stream of its own, so it does not change the noise of the frames.

    Source of the chain: E. N. Gilbert, Capacity of a burst-noise channel, 1960.
    """

    latency = Param(0.0, unit="s", min=0.0, doc="time from the stamp to the delivery")
    jitter = Param(0.0, unit="s", min=0.0, doc="greatest extra time of a frame; uniform from 0")
    drop_rate = Param(0.0, min=0.0, max=1.0, tune=True, doc="share of the frames that get lost")
    drop_burst = Param(
        1.0, min=1.0, tune=True, doc="mean length of a run of lost frames, relative to independent losses"
    )
    blackout = Param(
        (0.0, 0.0),
        type="float64[2]",
        unit="s",
        tune=True,
        doc="beginning and length of an interval whose frames are all lost",
    )

    delivery = Random()
    chances = State("float64[2]")  # random numbers of the coming frame: for its loss, and for its extra time
    captured = State("int64")
    dropped = State("bool")  # whether the last frame was lost by chance
    pending = State(f"float64[{QUEUE},{CONTENT}]")  # rows on their way, oldest first; blocks widen all rows
    waiting = State("int64")  # number of rows on their way
    shown = State(f"float64[{CONTENT}]")  # the row on the wire; sequence 0 before the first
    taken = Work(f"float64[{CONTENT}]")  # the row of the frame captured at this tick; sequence 0 if none is
    wire = Work(f"float64[{CONTENT}]")  # the row on the wire now

    def check_queue(self, spacing: float) -> None:
        """Refuse a latency that the queue cannot hold; ``spacing`` is the time between frames (s)."""
        longest = QUEUE * spacing
        if passed(self.latency + self.jitter, longest):
            together = " and jitter together" if self.jitter else ""
            bound = f"at most {QUEUE} frames, {longest:g} s"
            problem = f"latency{together} must be {bound}, got {self.latency + self.jitter:g} s"
            raise ParameterError("latency", problem)


class DeliveringCamera(Delivery):
    """A camera with such a transport, in which the latency counts from the stamp of a frame.

    A frame is captured at every ``every``-th tick, from the first tick on. A faster rate of the block with an
    ``every`` above 1 resolves the jitter.
    """

    every = Param(1, type="int64", min=1, doc="ticks of the block from one frame to the next")

    ticks = State("int64")

    def check(self) -> None:
        """Refuse a latency that the queue cannot hold; ParameterError."""
        self.check_queue(self.every * self.period)


# Functions, since compiled methods can call functions only; each takes the block. ``captured`` says whether
# this tick has a frame, lost or not.


def draw(block: Any) -> None:
    """Draw the chances of the coming frame; for ``start``."""
    fill_uniform(block.delivery, block.chances)


def is_captured(camera: Any) -> bool:
    """Return whether this tick of a camera has a frame, lost or not."""
    return bool(camera.ticks % camera.every == 0)


def take(block: Any, captured: bool, time: float, begin: float) -> bool:
    """Begin the row of this tick's frame in ``taken``; return whether there is a frame that is not lost.

    ``begin`` is the instant from which the latency counts (s), that of the row.
    """
    if not captured or _is_lost(block, time):
        block.taken[SEQUENCE] = 0.0
        return False
    block.taken[SEQUENCE] = block.captured + 1
    block.taken[STAMP] = begin
    block.taken[ARRIVAL] = begin + block.latency + block.jitter * block.chances[1]
    return True


def deliver(block: Any, time: float) -> None:
    """Put the row on the wire at this time into ``wire``; for ``output``, after `take`."""
    block.wire[:] = block.shown
    last = (-math.inf, 0.0)
    for index in range(block.waiting):
        last = _show(block.wire, block.pending[index], time, last)
    _show(block.wire, block.taken, time, last)


def advance(block: Any, captured: bool, time: float) -> None:
    """Keep the rows on the wire and on their way; for ``update``."""
    block.shown[:] = block.wire
    left = 0
    for index in range(block.waiting):
        if not reached(time, block.pending[index, ARRIVAL]):
            block.pending[left] = block.pending[index]
            left += 1
    if block.taken[SEQUENCE] > 0 and not reached(time, block.taken[ARRIVAL]):
        block.pending[left] = block.taken
        left += 1
    block.waiting = left
    if captured:
        block.dropped = _is_dropped(block)
        block.captured += 1
        draw(block)


def _show(wire: Any, row: Any, time: float, last: tuple[float, float]) -> tuple[float, float]:
    """Put a row on the wire if it has arrived, after the last one; return arrival and number of the later."""
    arrival, sequence = float(row[ARRIVAL]), float(row[SEQUENCE])
    if sequence == 0 or not reached(time, arrival) or (arrival, sequence) < last:
        return last
    wire[:] = row
    return arrival, sequence


def _is_dropped(block: Any) -> bool:
    """Return whether the frame of this tick gets lost by chance."""
    rate, burst = block.drop_rate, block.drop_burst
    if block.captured > 0:
        rate = 1 - (1 - rate) / burst if block.dropped else rate / burst
    return bool(block.chances[0] < rate)


def _is_lost(block: Any, time: float) -> bool:
    begin, length = float(block.blackout[0]), float(block.blackout[1])
    blind = length > 0.0 and reached(time, begin) and not reached(time, begin + length)
    return blind or _is_dropped(block)
