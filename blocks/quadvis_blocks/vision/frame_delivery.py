"""The delivery of frames that come from anywhere: latency, jitter and losses."""

from __future__ import annotations

from quadvis.block import Block, Frame, In, Out, Param, State, Work
from quadvis_blocks.vision._delivery import QUEUE, SEQUENCE, Delivery, advance, deliver, draw, take


class FrameDelivery(Delivery, Block, numeric=False):
    """Frames from a video, a folder of pictures or any camera, that are late, get lost and overtake others.

    Put this block behind a source of frames whose delivery is perfect. The simulated cameras have the same
    delivery built in.

    A frame is new when its sequence number differs from that of the tick before. It is delivered at the first
    tick at or after its coming + latency + extra; the extra time is drawn for each frame, uniformly from 0 to
    ``jitter``. Stamp, sequence number and pixels stay those of the source, whatever its clock shows. The last
    frame stays on the output until another one arrives. With a jitter longer than the time between two
    frames, an older frame can follow a newer one. Of the frames that arrive between two ticks, the last to
    arrive is delivered; of frames that arrive together, the newest. At a rate faster than that of the frames
    the jitter has finer steps.

    Losses are a two-state Markov chain. A frame is lost with probability ``drop_rate`` / ``drop_burst`` after
    a frame that was not lost, and with probability 1 - (1 - ``drop_rate``) / ``drop_burst`` after a lost
    frame. The share of lost frames is ``drop_rate``. The mean length of a run of lost frames is
    ``drop_burst`` / (1 - ``drop_rate``). Frames that come in ``blackout`` are lost, too.

    Source of the chain: E. N. Gilbert, Capacity of a burst-noise channel, 1960.
    """

    frame = In("frame", doc="the newest frame of a source")
    delivered = Out("frame", doc="the frame that arrived last")

    latency = Param(0.0, unit="s", min=0.0, doc="time from the coming of a frame to its delivery")

    came = State("int64")  # sequence number of the input one tick ago
    carried = State(f"frame[{QUEUE}]")  # frames on their way, each in the place of its number by `_place`
    kept = State("frame")  # the frame on the output one tick ago
    new = Work("bool")  # whether a frame comes in at this tick
    _given: Frame  # by output, for update of the same tick

    example = """
        pictures: {block: vision.image_folder, rate: slow, with: {folder: "quadvis:recordings/hand_held"}}
        delivery: {block: vision.frame_delivery, rate: slow, in: {frame: pictures.frame}}
    """

    def check(self) -> None:
        """Refuse a latency that is too long for the period."""
        self.check_queue(self.period)

    def start(self) -> None:
        """Draw the chances of the first frame."""
        draw(self)

    def output(self, frame: Frame, time: float) -> Frame:
        """Return the frame that arrived last."""
        self.new = frame.sequence not in (0, self.came)
        take(self, self.new, time, time)
        deliver(self, time)
        number = self.wire[SEQUENCE]
        if number == self.shown[SEQUENCE]:
            self._given = self.kept
        elif number == self.taken[SEQUENCE]:
            self._given = frame
        else:
            self._given = self.carried[_place(number)]
        return self._given

    def update(self, frame: Frame, time: float) -> None:
        """Keep the frame that came and the frame that was delivered."""
        if self.taken[SEQUENCE]:
            self.carried[_place(self.taken[SEQUENCE])] = frame
        advance(self, self.new, time)
        self.kept, self.came = self._given, frame.sequence


def _place(number: float) -> int:
    """Return the place of a frame; no other frame on its way has it, as at most one comes in at each tick."""
    return int(number) % QUEUE
