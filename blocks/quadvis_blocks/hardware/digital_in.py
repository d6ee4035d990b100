"""Digital lines read by a card or board."""

from __future__ import annotations

from typing import Any

from quadvis.block import Out, Param
from quadvis_blocks.hardware._cards.devices import CardInput
from quadvis_blocks.hardware._cards.frames import ChannelKind


class DigitalIn(CardInput):
    """Digital lines that a card reads, the newest level of each channel at each step.

    A card is read by a process of its own, since the calls of its driver may block; one that is lost lets the
    age grow until it is back. Before the first reading, which the ``age`` shows, all lines are off.

    The drivers are `comedi` and `nidaqmx`, neither of which was tried with a card, see
    `quadvis_blocks.hardware._cards`. A board at a serial line sends the frames of `_cards.frames`.
    """

    kind = ChannelKind.DIGITAL

    inverted = Param(False, "bool", doc="on is the low level")
    on = Out("bool[n]", doc="whether each line is on")

    example = """
        lines: {block: hardware.digital_in, rate: fast, with: {port: comedi:/dev/comedi0, channels: [1, 2]}}
    """

    def message(self, values: Any) -> tuple[Any, ...] | None:
        """Return the lines; None if one is neither 0 nor 1."""
        if ((values != 0) & (values != 1)).any():
            return None
        return ((values == 1) != self.inverted,)
