"""Encoders counted by a card or board."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Out, Param
from quadvis_blocks.hardware._cards.devices import CardInput
from quadvis_blocks.hardware._cards.frames import ChannelKind


class EncoderIn(CardInput):
    """Positions or angles of encoders that a card counts; counts go on beyond the ends of a counter.

    A counter of ``bits`` bits wraps; its count goes on as long as it moves less than half its range from one
    reading to the next. A card is read by a process of its own, since the calls of its driver may block; one
    that is lost lets the age grow until it is back.

    The drivers are `comedi` and `nidaqmx`, neither of which was tried with a card, see
    `quadvis_blocks.hardware._cards`. A board at a serial line sends the frames of `_cards.frames`.
    """

    kind = ChannelKind.COUNTS

    bits = Param(24, "int64", min=2, max=32, doc="bits of a counter, after which it wraps")
    scale = Param(
        type="float64[n]", unit="a", doc="position of one count, for each element; negative: reversed"
    )
    first = Param(
        "zero",
        choices=("zero", "count"),
        doc="the position at the first reading: 0, or that of its count, which is absolute",
    )
    position = Out("float64[n]", unit="a", nan=True, doc="the positions; NaN before the first reading")
    count = Out("int64[n]", doc="the counts, which do not wrap")

    example = """
        shaft:
          block: hardware.encoder_in
          rate: fast
          with: {port: comedi:/dev/comedi0, channels: [1], scale: {value: [0.088], unit: deg}}
    """

    def open(self) -> None:
        """Open the port; nothing has been read."""
        super().open()
        self._count: Any = None
        self._raw: Any = None  # the counts as they were read last

    def message(self, values: Any) -> tuple[Any, ...] | None:
        """Return positions and counts."""
        half = 1 << (self.bits - 1)
        if self._count is None:
            signed = (values + half) % (2 * half) - half
            self._count = signed if self.first else np.zeros_like(values)
        else:
            self._count = self._count + (values - self._raw + half) % (2 * half) - half
        self._raw = values
        return self.scale * self._count, self._count
