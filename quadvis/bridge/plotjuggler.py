"""Sends what a target flies as datagrams, such as PlotJuggler's plugin "UDP Server" takes them."""

from __future__ import annotations

import socket
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from quadvis.bridge.blocks import BlockSamples
from quadvis.bridge.datagrams import Encode, datagrams
from quadvis.errors import QuadvisError
from quadvis.output.recording import RecordedBlock
from quadvis.wire.address import WireAddress


class DatagramSender:
    """Sends all samples to one address; ``want`` is called with the blocks of each application.

    Whether anybody takes them is not known. QuadvisError if there is no way to the address.
    """

    def __init__(self, address: WireAddress, encode: Encode, say: Callable[[str], None]) -> None:
        self._encode, self._say = encode, say
        try:
            family, kind, _, _, place = socket.getaddrinfo(
                address.host, address.port, type=socket.SOCK_DGRAM
            )[0]
            self._socket = socket.socket(family, kind)
            self._socket.connect(place)
        except OSError as error:
            raise QuadvisError(f"no datagrams can go to {address} ({error.strerror or error})") from None
        self.want: Callable[[list[str]], None] = lambda paths: None
        self.sent = 0

    def show(self, application: str, blocks: Sequence[RecordedBlock], pictures: Sequence[str]) -> None:
        """Want the samples of all blocks."""
        self.want([block.path for block in blocks])
        self._say(
            f"{application}: the signals of {len(blocks)} blocks" if application else "nothing is loaded"
        )

    def take(self, samples: BlockSamples) -> None:
        """Send samples; what the system refuses, since nobody listens there, is left out."""
        for data in datagrams(samples, self._encode):
            try:
                self._socket.send(data)
                self.sent += 1
            except OSError:  # the answer to an earlier datagram: nobody listens
                continue

    def hear(self, event: Mapping[str, Any]) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()
