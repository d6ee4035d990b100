"""Voltages measured by an A/D card or board."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Out, Param, ParameterError, unlike_sizes
from quadvis_blocks.hardware._cards.devices import CardInput
from quadvis_blocks.hardware._cards.frames import MICRO, ChannelKind
from quadvis_blocks.hardware._cards.ports import CardChannel
from quadvis_blocks.hardware._cards.ranges import input_range

MARGIN = 0.05  # of a range, beyond its ends; what is farther out was not measured in it


class AdcIn(CardInput):
    """Voltages that an A/D card measures, the newest of each channel at each step.

    ``ranges`` are the codes of xPC Target's block of the PCL-818HG: 10 is 0 to 10 V, -10 is -10 to 10 V, and
    -0.625 is -0.625 to 0.625 V. A card is read by a process of its own, since the calls of its driver may
    block; one that is lost lets the age grow until it is back. Voltages beyond their range by more than 5 %
    are refused.

    The drivers are `comedi` and `nidaqmx`, neither of which was tried with a card, see
    `quadvis_blocks.hardware._cards`. A board at a serial line sends the frames of `_cards.frames`.
    """

    kind = ChannelKind.ANALOG

    ranges = Param(
        type="float64[n]", unit="V", doc="highest voltage of each channel; negative: of both signs"
    )
    mux = Param(
        "single_ended",
        choices=("single_ended", "differential"),
        doc="whether a channel is one wire against ground, or the difference of two",
    )
    voltage = Out("float64[n]", unit="V", nan=True, doc="the voltages; NaN before the first reading")

    example = """
        card:
          block: hardware.adc_in
          rate: fast
          with: {port: comedi:/dev/comedi0, channels: [1, 2], ranges: {value: [10, -10], unit: V}}
    """

    def check(self) -> None:
        """Refuse wrong channels and ranges without a width."""
        super().check()
        if (unlike := unlike_sizes(self)) is not None:
            raise unlike
        if not self.ranges.all():
            raise ParameterError("ranges", "ranges must be different from 0 V, element by element")

    def card_channels(self) -> list[CardChannel]:
        """Return the channels with their ranges."""
        pairs = zip(self.channels, self.ranges, strict=True)
        return [CardChannel(int(number), input_range(float(code))) for number, code in pairs]

    def is_differential(self) -> bool:
        """Return whether each channel is the difference of two wires."""
        return bool(self.mux)

    def message(self, values: Any) -> tuple[Any, ...] | None:
        """Return the voltages; None if one of them cannot be."""
        voltage = values / MICRO
        width = np.abs(self.ranges)
        beyond = (voltage > (1 + MARGIN) * width) | (voltage < np.minimum(self.ranges, 0.0) - MARGIN * width)
        return None if beyond.any() else (voltage,)
