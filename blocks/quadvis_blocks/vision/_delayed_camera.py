"""The transport of a simulated camera's frames: frame rate, latency, jitter and losses."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadvis.block import Block, Param, ParameterError, Random, State, fill_uniform, passed, reached

QUEUE = 16  # frames that can be on their way at once
SEQUENCE, STAMP, ARRIVAL = range(3)  # the first columns of a row; the rest is the content of the frame
CONTENT = 3

Row = NDArray[np.float64]


class DeliveringCamera(Block, numeric=False):
    """A camera whose frames are late, may get lost, and may overtake each other.

    A frame is captured at every ``every``-th tick, from the first tick on. Frames are numbered from 1, lost
    frames included. A frame is delivered at the first tick at or after stamp + latency + extra; the extra
    time is drawn for each frame, uniformly from 0 to ``jitter``. The wire shows one frame, the one that
    arrived last. With a jitter longer than the time between two frames, an older frame can follow a newer
    one; its sequence number and stamp are then smaller. Of the frames that arrive between two ticks, the last
    to arrive is shown; of frames that arrive together, the newest. With a latency of whole ticks any jitter
    costs a whole tick; a faster rate of the block with an ``every`` above 1 resolves the jitter.

    Losses are a two-state Markov chain. A frame is lost with probability ``drop_rate`` / ``drop_burst`` after
    a frame that was not lost, and with probability 1 - (1 - ``drop_rate``) / ``drop_burst`` after a lost
    frame. The share of lost frames is ``drop_rate``. The mean length of a run of lost frames is
    ``drop_burst`` / (1 - ``drop_rate``); with a ``drop_burst`` of 1 the losses are independent. Frames
    captured in ``blackout`` are lost, too.

    The delivery has a random stream of its own, so it does not change the noise of the frames.

    Source of the chain: E. N. Gilbert, Capacity of a burst-noise channel, 1960.
    """

    every = Param(1, type="int64", min=1, doc="ticks of the block from one frame to the next")
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
    ticks = State("int64")
    captured = State("int64")
    dropped = State("bool")  # whether the last frame was lost by chance
    pending = State(f"float64[{QUEUE},{CONTENT}]")  # rows on their way, oldest first; cameras widen it
    waiting = State("int64")  # number of rows on their way
    shown = State(f"float64[{CONTENT}]")  # the row on the wire; sequence 0 before the first
    _arrivals: tuple[Row, list[Row]]  # the rows on the wire and on their way, from output to update

    def check(self) -> None:
        """Refuse a latency that the queue cannot hold; ParameterError."""
        longest = QUEUE * self.every * self.period
        if passed(self.latency + self.jitter, longest):
            together = " and jitter together" if self.jitter else ""
            bound = f"at most {QUEUE} frames, {longest:g} s"
            problem = f"latency{together} must be {bound}, got {self.latency + self.jitter:g} s"
            raise ParameterError("latency", problem)

    def start(self) -> None:
        """Draw the chances of the first frame."""
        self._draw()

    def _draw(self) -> None:
        fill_uniform(self.delivery, self.chances)

    def _is_captured(self) -> bool:
        """Return whether this tick has a frame, lost or not."""
        return bool(self.ticks % self.every == 0)

    def _is_dropped(self) -> bool:
        """Return whether the frame of this tick gets lost by chance."""
        rate, burst = self.drop_rate, self.drop_burst
        if self.captured == 0:
            return bool(self.chances[0] < rate)
        return bool(self.chances[0] < (1 - (1 - rate) / burst if self.dropped else rate / burst))

    def _is_lost(self, time: float) -> bool:
        if self._is_dropped():
            return True
        begin, length = self.blackout.tolist()
        return bool(length > 0.0 and reached(time, begin) and not reached(time, begin + length))

    def _arrival(self, stamp: float) -> float:
        """Return when the frame of this tick arrives."""
        return float(stamp + self.latency + self.jitter * self.chances[1])

    def _row(self, stamp: float, content: Any) -> Row:
        """Return the frame of this tick as a row of the queue."""
        row = np.empty(CONTENT + len(content))
        row[SEQUENCE], row[STAMP], row[ARRIVAL] = self.captured + 1, stamp, self._arrival(stamp)
        row[CONTENT:] = content
        return row

    def _arrived(self, fresh: Row | None, time: float) -> tuple[Row, list[Row]]:
        """Return the row on the wire at this time, and the rows that are still on their way.

        ``fresh`` is the row of the frame that is captured now; None if there is none or if it is lost.
        """
        queue = [*self.pending[: self.waiting].copy()] + ([] if fresh is None else [fresh])
        shown, newest, rest = None, (0.0, 0.0), []
        for row in queue:
            sequence, _, arrival = row[:CONTENT].tolist()
            if not reached(time, arrival):
                rest.append(row)
            elif shown is None or (arrival, sequence) > newest:
                shown, newest = row, (arrival, sequence)
        return self.shown.copy() if shown is None else shown, rest

    def _deliver(self, fresh: Row | None, time: float) -> Row:
        """Return the row on the wire at this time, and keep all rows for `_advance`; for ``output``."""
        self._arrivals = self._arrived(fresh, time)
        return self._arrivals[0]

    def _advance(self) -> None:
        """Keep the rows on the wire and on their way, and go to the next tick; for ``update``."""
        shown, rest = self._arrivals
        self.shown[:] = shown
        for place, row in enumerate(rest):
            self.pending[place] = row
        self.waiting = len(rest)
        if self._is_captured():
            self.dropped = self._is_dropped()
            self.captured += 1
            self._draw()
        self.ticks += 1
