"""What pymavlink makes and reads: packets that were not made by our code."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pymavlink.dialects.v20 import common

KEY = bytes(range(32))


class Wire:
    """Collects what a MAVLink object of pymavlink sends."""

    def __init__(self) -> None:
        self.packets: list[bytes] = []

    def write(self, data: bytes) -> None:
        self.packets.append(bytes(data))


def speaker(system: int = 1, component: int = 1, *, key: bytes | None = None, stamp: int = 0) -> Any:
    """Return a MAVLink object of pymavlink, which signs if it has a key; its wire is ``.file``."""
    made = common.MAVLink(Wire(), srcSystem=system, srcComponent=component)
    made.robust_parsing = True
    if key is not None:
        made.signing.secret_key = key
        made.signing.sign_outgoing = True
        made.signing.timestamp = stamp
    return made


def attitude(mav: Any, number: int) -> bytes:
    """Return the packet of an attitude whose values say its number."""
    mav.attitude_send(number, *angles(number), 0.1, 0.2, 0.3)
    packet: bytes = mav.file.packets.pop()
    return packet


def angles(number: int) -> tuple[float, float, float]:
    """Return roll, pitch and yaw (rad) of the attitude of a number."""
    return (number % 1000) / 400.0, -(number % 700) / 500.0, (number % 300) / 100.0


def read(data: bytes, **given: Any) -> Iterator[Any]:
    """Yield the messages that pymavlink finds in bytes, bad ones too."""
    return iter(speaker(**given).parse_buffer(data) or [])


def received(block: Any, frame: bytes) -> Any:
    """Return the one message that pymavlink reads in a frame of a device; AssertionError if it is not one."""
    sealer = block.sealer()
    sealer.seal(b"", 0)  # with the first heartbeat
    (found,) = read(sealer.seal(frame, 1))
    assert (found.get_srcSystem(), found.get_srcComponent()) == (block.own_system, block.own_component)
    return found
