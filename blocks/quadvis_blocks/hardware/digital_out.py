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

    def frame(self, command: Any) -> bytes:
        """Return the frame of the lines' levels."""
        return self.frame_of(np.asarray(command, bool) != self.inverted)
