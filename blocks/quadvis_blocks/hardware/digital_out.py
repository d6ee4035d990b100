"""Digital lines of a card or board, put out."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import In, Initial, Param, Safe
from quadvis_blocks.hardware._cards.devices import CardOutput
from quadvis_blocks.hardware._cards.frames import ChannelKind


class DigitalOut(CardOutput):
    """Digital lines of a card: on or off for each channel, put out again and again.

    The drivers are `comedi` and `nidaqmx`, neither of which was tried with a card, see
    `quadvis_blocks.hardware._cards`. A board at a serial line takes the frames of `_cards.frames`.
    """

    kind = ChannelKind.DIGITAL

    inverted = Param(False, "bool", doc="on is the low level")
    initial = Initial("command", doc="command before the first one, for each element")
    safe = Safe("command", doc="command at every end of a run, for each element")
    command = In("bool[n]", doc="whether each line is on")

    example = """
        lamp: {block: sources.pulse, rate: fast, with: {interval: 1 s, width: 0.5 s}}
        both: {block: signal.concatenate, rate: fast, in: {u: [lamp.y, 1]}}
        on: {block: logic.compare, rate: fast, with: {operator: ">"}, in: {a: both.y, b: [0.5, 0.5]}}
        lines:
          block: hardware.digital_out
          rate: fast
          with: {port: comedi:/dev/comedi0, channels: [1, 2], initial: [false, false], safe: [false, false]}
          in: {command: on.y}
    """

    def frame(self, command: Any) -> bytes:
        """Return the frame of the lines' levels."""
        return self.frame_of(np.asarray(command, bool) != self.inverted)
