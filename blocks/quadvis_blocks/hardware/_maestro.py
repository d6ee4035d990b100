"""The serial commands of Pololu's Maestro servo controllers.

A command of the compact protocol is a byte from 0x80 on and data bytes of 7 bits; the Pololu protocol puts
0xAA and the number of the device before it, and takes the highest bit off the command. With the checksum, a
CRC-7 (polynomial 0x91, lowest bit first) of all bytes follows. See Pololu, "Maestro Servo Controller User's
Guide", sections 5.c to 5.e, https://www.pololu.com/docs/0J40.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

TARGET, SPEED, ACCELERATION, MULTIPLE, HOME = 0x84, 0x87, 0x89, 0x9F, 0xA2
POLOLU = 0xAA
POLYNOMIAL = 0x91
MOST = (1 << 14) - 1  # that two data bytes hold
QUARTER = 0.25  # us of a target
SPEED_UNIT = 25.0  # us/s: 0.25 us in 10 ms
ACCELERATION_UNIT = 312.5  # us/s^2: 0.25 us in 10 ms, in 80 ms

Wrap = Callable[[int, bytes], bytes]  # of a command and its data


def checksum(piece: bytes) -> int:
    """Return the CRC-7 of bytes."""
    crc = 0
    for byte in piece:
        crc ^= byte
        for _ in range(8):
            crc = (crc ^ POLYNOMIAL) >> 1 if crc & 1 else crc >> 1
    return crc


def wrapping(device: int | None, *, with_checksum: bool) -> Wrap:
    """Return what makes bytes of a command: of the Pololu protocol to a device, or of the compact one."""

    def wrap(command: int, data: bytes) -> bytes:
        head = bytes([command]) if device is None else bytes([POLOLU, device, command & 0x7F])
        whole = head + data
        return whole + bytes([checksum(whole)]) if with_checksum else whole

    return wrap


def two_bytes(value: int) -> bytes:
    """Return a value of 14 bits as data bytes."""
    return bytes([value & 0x7F, value >> 7])


def runs(channels: Sequence[int]) -> list[tuple[int, int]]:
    """Return the begin and the end of each run of channels that follow each other, in rising channels."""
    found: list[tuple[int, int]] = []
    for place, channel in enumerate(channels):
        if found and channel == channels[place - 1] + 1:
            found[-1] = (found[-1][0], place + 1)
        else:
            found.append((place, place + 1))
    return found
