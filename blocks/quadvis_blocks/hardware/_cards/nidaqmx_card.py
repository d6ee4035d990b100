"""Cards of National Instruments by NI-DAQmx, with the package nidaqmx.

No such card and no NI-DAQmx were at hand: this was tried with a module that stands in for nidaqmx 1.7 and
speaks the same calls, whose names and arguments were compared with those of the package. Channel 1 is the
input ``ai0``, the output ``ao0``, line 0 of ``port0``, or the counter ``ctr0``.
"""

from __future__ import annotations

from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any

from quadvis.block import PortError
from quadvis_blocks.hardware._cards.frames import ChannelKind
from quadvis_blocks.hardware._cards.ports import CardChannel, CardRequest, described

if TYPE_CHECKING:
    from collections.abc import Iterator

TIMEOUT = 0.2  # s that a call may take


class NidaqmxOutputs:
    """Output channels, each a task of its own: one that fails keeps no other from its value."""

    def __init__(self, request: CardRequest) -> None:
        import nidaqmx
        import nidaqmx.errors

        self._request, self._nidaqmx = request, nidaqmx
        self._tasks: list[Any] = []
        try:
            for channel in request.channels:
                with named(nidaqmx, described(request, channel)):
                    self._tasks.append(nidaqmx.Task())
                    self._add(self._tasks[-1], channel)
                    self._tasks[-1].start()
        except BaseException:
            self.close()
            raise

    def write(self, place: int, value: float) -> None:
        """Put out the value of one channel."""
        channel = self._request.channels[place]
        given: Any = bool(value)
        if channel.range is not None:
            given = min(max(value, channel.range.lowest), channel.range.highest)
        with named(self._nidaqmx, f"{described(self._request, channel)} cannot be written"):
            self._tasks[place].write(given, timeout=TIMEOUT)

    def read(self) -> list[float]:
        """Return nothing: these are outputs."""
        return []

    def close(self) -> None:
        """End the tasks."""
        for task in self._tasks:
            with suppress(self._nidaqmx.errors.Error):
                task.close()

    def _add(self, task: Any, channel: CardChannel) -> None:
        number, device = channel.number - 1, self._request.device
        if channel.range is None:
            task.do_channels.add_do_chan(f"{device}/port0/line{number}")
            return
        channels = task.ao_channels
        add = channels.add_ao_current_chan if channel.range.is_current else channels.add_ao_voltage_chan
        add(f"{device}/ao{number}", min_val=channel.range.lowest, max_val=channel.range.highest)


class NidaqmxInputs:
    """Input channels: one task for all, or one for each counter, as NI-DAQmx wants it."""

    def __init__(self, request: CardRequest) -> None:
        import nidaqmx
        import nidaqmx.constants
        import nidaqmx.errors

        self._request, self._nidaqmx = request, nidaqmx
        self._tasks: list[Any] = []
        groups = (
            [[each] for each in request.channels]
            if request.kind is ChannelKind.COUNTS
            else [request.channels]
        )
        try:
            for group in groups:
                with named(nidaqmx, described(request, group[0])):
                    self._tasks.append(nidaqmx.Task())
                    for channel in group:
                        self._add(self._tasks[-1], channel)
                    self._tasks[-1].start()
        except BaseException:
            self.close()
            raise

    def write(self, place: int, value: float) -> None:
        """Refuse: these are inputs."""
        raise PortError("an input cannot be written")

    def read(self) -> list[float]:
        """Return the values of all channels."""
        found: list[float] = []
        with named(self._nidaqmx, f"card 'nidaqmx:{self._request.device}' cannot be read"):
            for task in self._tasks:
                values = task.read(timeout=TIMEOUT)
                found += map(float, values if isinstance(values, list) else [values])
        return found

    def close(self) -> None:
        """End the tasks."""
        for task in self._tasks:
            with suppress(self._nidaqmx.errors.Error):
                task.close()

    def _add(self, task: Any, channel: CardChannel) -> None:
        number, device, constants = channel.number - 1, self._request.device, self._nidaqmx.constants
        if self._request.kind is ChannelKind.COUNTS:
            task.ci_channels.add_ci_ang_encoder_chan(
                f"{device}/ctr{number}",
                decoding_type=constants.EncoderType.X_4,
                units=constants.AngleUnits.TICKS,
            )
        elif channel.range is None:
            task.di_channels.add_di_chan(f"{device}/port0/line{number}")
        else:
            terminals = constants.TerminalConfiguration
            task.ai_channels.add_ai_voltage_chan(
                f"{device}/ai{number}",
                terminal_config=terminals.DIFF if self._request.differential else terminals.RSE,
                min_val=channel.range.lowest,
                max_val=channel.range.highest,
            )


@contextmanager
def named(nidaqmx: Any, what: str) -> Iterator[None]:
    """Let an error of NI-DAQmx be one of a port, in one sentence."""
    try:
        yield
    except nidaqmx.errors.Error as error:
        raise PortError(f"{what}: {str(error).splitlines()[0]}") from error


def open_card(request: CardRequest, sends: bool) -> NidaqmxOutputs | NidaqmxInputs:
    """Open channels of a card."""
    return NidaqmxOutputs(request) if sends else NidaqmxInputs(request)
