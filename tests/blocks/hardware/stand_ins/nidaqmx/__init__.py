"""Stands in for nidaqmx 1.7: the same calls, for a card 'Dev1' with two analog outputs.

Names and arguments are those of the package; that it does what NI-DAQmx does was not tried.
"""

from __future__ import annotations

from typing import Any

import card

from . import constants, errors

CHANNELS = {"ao": 2, "ai": 16, "port0/line": 8, "ctr": 2}


class _Channels:
    def __init__(self, task: Task) -> None:
        self._task = task

    def _add(self, kind: str, name: str, *settings: Any) -> None:
        place = name.removeprefix(f"Dev1/{kind}")
        if not name.startswith(f"Dev1/{kind}") or int(place) >= CHANNELS[kind]:
            raise errors.DaqError("Physical channel specified does not exist on this device.", -200170)
        self._task.channels.append((kind, int(place), settings))

    def add_ao_voltage_chan(
        self, physical_channel: str, name_to_assign_to_channel: str = "",
        min_val: float = -10.0, max_val: float = 10.0,
    ) -> None:  # fmt: skip
        """Add a voltage output."""
        self._add("ao", physical_channel, min_val, max_val)

    def add_ao_current_chan(
        self, physical_channel: str, name_to_assign_to_channel: str = "",
        min_val: float = 0.0, max_val: float = 0.02,
    ) -> None:  # fmt: skip
        """Add a current output."""
        self._add("ao", physical_channel, min_val, max_val)

    def add_ai_voltage_chan(
        self, physical_channel: str, name_to_assign_to_channel: str = "",
        terminal_config: Any = None, min_val: float = -5.0, max_val: float = 5.0,
    ) -> None:  # fmt: skip
        """Add a voltage input."""
        self._add("ai", physical_channel, terminal_config, min_val, max_val)

    def add_do_chan(self, lines: str) -> None:
        """Add an output line."""
        self._add("port0/line", lines)

    def add_di_chan(self, lines: str) -> None:
        """Add an input line."""
        self._add("port0/line", lines)

    def add_ci_ang_encoder_chan(
        self, counter: str, name_to_assign_to_channel: str = "", decoding_type: Any = None, units: Any = None
    ) -> None:
        """Add an encoder; a task has one."""
        if self._task.channels:
            raise errors.DaqError("Counter task has more than one channel.", -200147)
        self._add("ctr", counter, decoding_type, units)


class Task:
    """Some channels."""

    def __init__(self) -> None:
        self.channels: list[Any] = []
        self.started = False
        self.ao_channels = self.ai_channels = self.do_channels = self.di_channels = _Channels(self)
        self.ci_channels = self.ao_channels

    def start(self) -> None:
        """Start it."""
        self.started = True

    def write(self, data: Any, auto_start: bool = True, timeout: float = 10.0) -> int:
        """Put out the value of its one channel."""
        assert self.started
        ((kind, place, settings),) = self.channels
        if card.refuses(place):
            raise errors.DaqError("The device is not accessible.", -201003)
        if kind == "ao":
            if not settings[0] <= data <= settings[1]:
                raise errors.DaqError("Requested value is not supported for this property value.", -200077)
            card.wrote("analog_ni", place, data)
        else:
            assert type(data) is bool
            card.wrote("digital", place, data)
        return 1

    def read(self, timeout: float = 10.0) -> Any:
        """Return the value of its channel, or a list if it has several."""
        assert self.started
        found: list[Any] = []
        for kind, place, _ in self.channels:
            if card.refuses(place):
                raise errors.DaqError("The device is not accessible.", -201003)
            value = card.values.get((kind, place), 0.5 * place)
            found.append(bool(place % 2) if kind == "port0/line" else value)
        return found if len(found) > 1 else found[0]

    def close(self) -> None:
        """End it, which writes nothing."""
        self.started = False


__all__ = ["Task", "constants", "errors"]
