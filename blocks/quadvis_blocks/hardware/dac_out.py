"""Voltages or currents by a D/A card or board, such as those of the sticks of a radio."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import In, Initial, Out, Param, ParameterError, Safe, State, unlike_sizes
from quadvis_blocks.hardware._cards.devices import CardOutput
from quadvis_blocks.hardware._cards.frames import MICRO, ChannelKind
from quadvis_blocks.hardware._cards.ports import CardChannel
from quadvis_blocks.hardware._cards.ranges import OUTPUT_RANGES, check_between


class DacOut(CardOutput):
    """Voltages or currents of a D/A card: a level for each channel, put out again and again.

    A command from ``lowest`` to ``highest`` is a level from ``at_lowest`` to ``at_highest``; what goes beyond
    stays at these ends. Without ``at_lowest`` and ``at_highest`` the command is the level itself. Levels are
    in V, or in A where the range is 4; ``ranges`` are the codes of xPC Target's block of the PCL-726: 0 is 0
    to 5 V, 1 is 0 to 10 V, 2 is -5 to 5 V, 3 is -10 to 10 V, 4 is 4 to 20 mA. ``initial`` is its initial
    vector; ``safe`` takes the place of its reset vector, since a card keeps what was put out last.

    The drivers are `comedi` and `nidaqmx`, neither of which was tried with a card, see
    `quadvis_blocks.hardware._cards`. A board at a serial line takes the frames of `_cards.frames`.
    """

    kind = ChannelKind.ANALOG

    ranges = Param(
        type="int64[n]", min=0, max=len(OUTPUT_RANGES) - 1, doc="range of each channel, by its code"
    )
    lowest = Param(type="float64[n]", unit="a", doc="command at one end, for each element")
    highest = Param(type="float64[n]", unit="a", doc="command at the other end, for each element")
    at_lowest = Param([], "float64[m]", unit="b", doc="level of lowest, for each element")
    at_highest = Param([], "float64[m]", unit="b", doc="level of highest, for each element")
    slew = Param(
        math.inf, unit="a/s", above=0.0, doc="fastest change of a command; the safe one comes at once"
    )
    initial = Initial("command", doc="command before the first one, for each element")
    safe = Safe("command", doc="command at every end of a run, for each element")
    command = In("float64[n]", unit="a", doc="the commands")
    sent = Out("float64[n]", unit="a", doc="the commands as they go out: limited, and in whole 1e-6 V or A")
    last = State("float64[n]", unit="a")  # the commands of the last step

    example = """
        level: {block: sources.constant, rate: fast, with: {value: {value: [2.5, -1], unit: V}}}
        card:
          block: hardware.dac_out
          rate: fast
          with:
            port: comedi:/dev/comedi0
            channels: [1, 2]
            ranges: [3, 3]
            lowest: {value: [-10, -10], unit: V}
            highest: {value: [10, 10], unit: V}
            initial: {value: [0, 0], unit: V}
            safe: {value: [0, 0], unit: V}
          in: {command: level.y}
    """

    def check(self) -> None:
        """Refuse wrong channels, ends, levels beyond the ranges, and commands beyond the ends."""
        super().check()
        if np.equal(self.lowest, self.highest).any():
            raise ParameterError("highest", "highest must be different from lowest, element by element")
        for name in ("at_lowest", "at_highest"):
            if len(getattr(self, name)) not in (0, len(self.channels)):
                raise ParameterError(
                    name, f"{name} must have {len(self.channels)} values, one for each channel"
                )
        if len(self.at_lowest) != len(self.at_highest):
            raise ParameterError("at_highest", "at_highest must be given if at_lowest is, and only then")
        if (unlike := unlike_sizes(self)) is not None:
            raise unlike
        ranges = [OUTPUT_RANGES[code] for code in self.ranges]
        bottom, top = np.array([found[:2] for found in ranges]).T
        words = ", ".join(map(str, dict.fromkeys(ranges)))
        names = ("at_lowest", "at_highest") if len(self.at_lowest) else ("lowest", "highest")
        for name, level in zip(names, self._ends(), strict=True):
            check_between(name, level, bottom, top, f"the ends of the ranges ({words})")
        for name in ("initial", "safe"):
            check_between(name, getattr(self, name), self.lowest, self.highest, "lowest and highest")

    def start(self) -> None:
        """Begin at the initial command."""
        self.last = self.initial

    def output(self, command: Any) -> Any:
        """Return what goes out."""
        one, other = self._ends()
        levels = self._micro(self._slewed(command)) / MICRO
        return self.lowest + (levels - one) / (other - one) * (self.highest - self.lowest)

    def update(self, command: Any) -> None:
        """Keep the commands."""
        self.last = self._slewed(command)

    def outgoing(self, command: Any) -> tuple[Any]:
        """Return the command that goes out at this step: as near to the given one as ``slew`` allows."""
        return (self._slewed(command),)

    def frame(self, command: Any) -> bytes:
        """Return the frame of the levels of a command."""
        return self.frame_of(self._micro(command))

    def card_channels(self) -> list[CardChannel]:
        """Return the channels with their ranges."""
        pairs = zip(self.channels, self.ranges, strict=True)
        return [CardChannel(int(number), OUTPUT_RANGES[code]) for number, code in pairs]

    def _ends(self) -> tuple[Any, Any]:
        """Return the levels of lowest and highest."""
        return (self.at_lowest, self.at_highest) if len(self.at_lowest) else (self.lowest, self.highest)

    def _slewed(self, command: Any) -> Any:
        most = self.slew * self.period
        lower, upper = np.minimum(self.lowest, self.highest), np.maximum(self.lowest, self.highest)
        return self.last + np.clip(np.clip(command, lower, upper) - self.last, -most, most)

    def _micro(self, command: Any) -> Any:
        """Return the levels (1e-6 V or A) of a command, as whole numbers between those of the ends."""
        if np.isnan(command).any():
            raise ValueError("a command is NaN")
        one, other = self._ends()
        shares = np.clip((command - self.lowest) / (self.highest - self.lowest), 0.0, 1.0)
        return np.rint(MICRO * (one + shares * (other - one)))
