"""What the outputs of radio control have in common: commands as pulses, their limits and their speed."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np

from quadvis.block import In, Out, Output, Param, ParameterError, State
from quadvis_blocks.hardware._counts import CHANNELS, GRAIN, LONGEST, LOW, MIDDLE, MOST, SHORTEST, count_of


class PulseOutput(Output):
    """Commands as pulses in microseconds: ``lowest`` is the shortest one, ``highest`` the longest one.

    A subclass says ``shortest`` and ``longest`` (us), ``grain`` (us, of a pulse on the wire), ``most``, the
    last channel, and makes its frame of ``pulses``.
    """

    grain: ClassVar[float]
    most: ClassVar[int]
    shortest: Any
    longest: Any
    initial: Any
    safe: Any

    channels = Param(type="int64[n]", min=1, doc="channel of each element, from 1")
    lowest = Param(type="float64[n]", unit="a", doc="command of the shortest pulse, for each element")
    highest = Param(type="float64[n]", unit="a", doc="command of the longest pulse, for each element")
    slew = Param(
        math.inf, unit="us/s", above=0.0, doc="fastest change of a pulse; the safe frame comes at once"
    )
    command = In("float64[n]", unit="a", doc="the commands")
    sent = Out(
        "float64[n]", unit="a", doc="the commands as they are on the wire: limited, and in whole steps of it"
    )
    widths = State("float64[n]", unit="us")  # the pulses of the last step

    def check(self) -> None:
        """Refuse wrong channels and pulses, and initial and safe commands beyond the ends."""
        check_channels(self.channels, self.lowest, self.highest, self.most)
        if (np.asarray(self.longest) <= self.shortest).any():
            raise ParameterError("longest", "longest must be above shortest")
        check_ends(self, "initial", "safe")

    def start(self) -> None:
        """Begin at the pulses of the initial command."""
        self.widths = self._widths(self.initial)

    def output(self, command: Any) -> Any:
        """Return what is sent."""
        return self._command(self.pulses(self.outgoing(command)[0]))

    def update(self, command: Any) -> None:
        """Keep the pulses."""
        self.widths = self._slewed(command)

    def outgoing(self, command: Any) -> tuple[Any]:
        """Return the command that goes out at this step: as near to the given one as ``slew`` allows."""
        return (self._command(self._slewed(command)),)

    def pulses(self, command: Any) -> Any:
        """Return the pulses (us) of a command, in whole grains."""
        return MIDDLE + self.grain * np.rint((self._widths(command) - MIDDLE) / self.grain)

    def _slewed(self, command: Any) -> Any:
        most = self.slew * self.period
        return self.widths + np.clip(self._widths(command) - self.widths, -most, most)

    def _widths(self, command: Any) -> Any:
        return self.shortest + shares(command, self.lowest, self.highest) * (self.longest - self.shortest)

    def _command(self, widths: Any) -> Any:
        span = self.longest - self.shortest
        return self.lowest + (widths - self.shortest) / span * (self.highest - self.lowest)


class CountOutput(PulseOutput):
    """Commands in 16 channels of 11 bits."""

    grain, most = GRAIN, CHANNELS

    shortest = Param(SHORTEST, unit="us", min=880.0, doc="pulse of lowest; 987.5 us is 172 on the wire")
    longest = Param(LONGEST, unit="us", max=2159.375, doc="pulse of highest; 2011.875 us is 1811 on the wire")
    others = Param(LOW, "int64", min=0, max=MOST, doc="what all other channels are on the wire")

    def counts(self, command: Any) -> list[int]:
        """Return the 16 counts of a command."""
        counts = [self.others] * CHANNELS
        for channel, count in zip(self.channels, count_of(self.pulses(command)), strict=True):
            counts[channel - 1] = int(count)
        return counts


def check_channels(channels: Any, lowest: Any, highest: Any, most: int) -> None:
    """Refuse channels that are named twice or are not there, and ranges without a length."""
    if (channels > most).any():
        raise ParameterError("channels", f"channels must be at most {most}, got {channels.max()}")
    if len(np.unique(channels)) < len(channels):
        raise ParameterError("channels", "channels must be different from each other")
    if np.equal(lowest, highest).any():
        raise ParameterError("highest", "highest must be different from lowest, element by element")


def check_ends(block: Any, *names: str) -> None:
    """Refuse commands of a block beyond its ``lowest`` and ``highest``, which may be the other way round."""
    lower, upper = np.minimum(block.lowest, block.highest), np.maximum(block.lowest, block.highest)
    for name in names:
        value = getattr(block, name)
        if ((value < lower) | (value > upper)).any():
            raise ParameterError(name, f"{name} must lie between lowest and highest, element by element")


def shares(command: Any, lowest: Any, highest: Any) -> Any:
    """Return where commands lie between their ends, from 0 to 1; ValueError for NaN."""
    if np.isnan(command).any():
        raise ValueError("a command is NaN")
    return np.clip((command - lowest) / (highest - lowest), 0.0, 1.0)
