"""Ports that are drivers of cards: ``comedi:/dev/comedi0``, ``comedi:/dev/comedi0:2``, ``nidaqmx:Dev1``."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from typing import NamedTuple, Protocol

from quadvis.block import Card, ChannelError, OpenPort, ParameterError, PortError
from quadvis.errors import quoted, sentence
from quadvis.machine.capture import CaptureRequest
from quadvis.machine.captured_card import CapturedCard
from quadvis_blocks.hardware._cards.frames import LONGEST, MICRO, ChannelKind, decode
from quadvis_blocks.hardware._cards.ranges import Range

DRIVERS = {  # the module of each, what a port is, and what to do if the module is missing
    "comedi": (
        "comedi",
        "comedi:/dev/comedi0",
        "install Debian's python3-comedilib, and make the environment with --system-site-packages",
    ),
    "nidaqmx": ("nidaqmx", "nidaqmx:Dev1", "install quadvis[daq]"),
}
READER = "quadvis_blocks.hardware._cards.reading:work"


class CardChannel(NamedTuple):
    """A channel of a card: its number, from 1, and the range of an analog one."""

    number: int
    range: Range | None = None


@dataclass(frozen=True)
class CardRequest:
    """Channels of one kind of a card, as plain data."""

    driver: str
    device: str
    kind: ChannelKind
    channels: tuple[CardChannel, ...]
    differential: bool = False

    @property
    def missing(self) -> str:
        """A sentence if the driver's module is missing, else ""."""
        module, _, remedy = DRIVERS[self.driver]
        problem = f"port '{self.driver}:{self.device}' needs the module {module}"
        return "" if find_spec(module) is not None else sentence(problem, remedy)

    def claims(self, sends: bool) -> Iterable[object]:
        """Return its channels, as keys."""
        device = os.path.realpath(self.device) if os.path.exists(self.device) else self.device
        return [(self.driver, device, self.kind, sends, channel.number) for channel in self.channels]


class OpenCard(Protocol):
    """The channels of a card, open; PortError in one sentence if a call fails."""

    def write(self, place: int, value: float) -> None:
        """Put out the value (V, A, or 0 or 1) of one channel, by its place in the request."""

    def read(self) -> list[float]:
        """Return the values (V, 0 or 1, counts) of all channels."""

    def close(self) -> None:
        """Release the card; this writes nothing."""


def request_of(
    port: str, parameter: str, kind: ChannelKind, channels: Sequence[CardChannel], differential: bool = False
) -> CardRequest | None:
    """Return what a port asks of a card; None if it is no driver's. ParameterError if it names no device."""
    driver, colon, device = port.partition(":")
    if driver not in DRIVERS or not colon:
        return None
    if not device:
        raise ParameterError(parameter, f"{parameter} must be such as {DRIVERS[driver][1]}, got '{port}'")
    return CardRequest(driver, device, kind, tuple(channels), differential)


def open_card(request: CardRequest, *, sends: bool) -> OpenCard:
    """Open the channels of a card, to send or to read; PortError in one sentence if that cannot be."""
    if request.missing:
        raise PortError(request.missing)
    driver = import_module(f"quadvis_blocks.hardware._cards.{request.driver}_card")
    opened: OpenCard = driver.open_card(request, sends)
    return opened


@dataclass(frozen=True)
class CardOutputs(Card):
    """Settings of a port that puts out frames of channels."""

    request: CardRequest

    def open(self, port: str) -> OpenPort:
        """Open the card; PortError in one sentence if that cannot be."""
        return OpenOutputs(open_card(self.request, sends=True), self.request)

    def missing(self, port: str) -> str:
        """Return a sentence if the driver's module is missing."""
        return self.request.missing

    def claims(self, port: str) -> Iterable[object]:
        """Return the channels."""
        return self.request.claims(sends=True)


class OpenOutputs(OpenPort):
    """Output channels of a card: a frame is put out channel by channel."""

    def __init__(self, card: OpenCard, request: CardRequest) -> None:
        self._card, self._request = card, request

    def write(self, piece: bytes) -> int:
        """Put out the values of a frame; ChannelError at its end if a channel has refused its own."""
        found = decode(piece[:-1])
        assert found is not None
        scale = MICRO if self._request.kind is ChannelKind.ANALOG else 1
        refused = []
        for place, channel in enumerate(self._request.channels):
            try:
                self._card.write(place, found.values[channel.number] / scale)
            except PortError as error:
                refused.append(str(error))
        if refused:
            raise ChannelError("; ".join(refused))
        return len(piece)

    def close(self) -> None:
        """Release the card."""
        self._card.close()


@dataclass(frozen=True)
class Reading:
    """What the process that reads a card is given: the channels, and the time between readings (ns)."""

    request: CardRequest
    interval: int


class CardInputs(CapturedCard):
    """Settings of a port that gives frames of channels, which a process of its own reads."""

    def __init__(self, request: CardRequest, interval: float) -> None:
        self.card = request
        super().__init__(CaptureRequest(READER, Reading(request, round(interval * 1e9)), LONGEST))

    def missing(self, port: str) -> str:
        """Return a sentence if the driver's module is missing."""
        return self.card.missing

    def claims(self, port: str) -> Iterable[object]:
        """Return the channels."""
        return self.card.claims(sends=False)


def described(request: CardRequest, channel: CardChannel) -> str:
    """Return words for a channel of a card, for messages."""
    return f"channel {channel.number} of {quoted(f'{request.driver}:{request.device}')}"
