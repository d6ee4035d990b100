"""Checksums of protocols: sums, xor, and cyclic redundancy checks (CRC) by their parameters.

The parameters of the CRCs are those of the catalogue of parametrised CRC algorithms, in Rocksoft's model:
https://reveng.sourceforge.io/crc-catalogue/. Their names here are the usual ones; where one name is in use
for several CRCs, as "CRC-CCITT", only the names that mean one are known.
"""

from __future__ import annotations

import binascii
import zlib
from collections.abc import Callable
from functools import cache
from typing import NamedTuple

NONE = "none"
BYTE = 8
TABLE = 256


class Crc(NamedTuple):
    """A CRC in Rocksoft's model: ``width`` (bits), ``polynomial``, register at first, reflection, final xor.

    ``reflected`` is that of bytes and of the result, which no CRC in use has apart.
    """

    width: int
    polynomial: int
    initial: int = 0
    reflected: bool = False
    final: int = 0


CRCS = {
    "crc8": Crc(8, 0x07),  # CRC-8/SMBUS
    "crc8_autosar": Crc(8, 0x2F, 0xFF, final=0xFF),
    "crc8_dvb_s2": Crc(8, 0xD5),
    "crc8_maxim": Crc(8, 0x31, reflected=True),
    "crc8_sae_j1850": Crc(8, 0x1D, 0xFF, final=0xFF),
    "crc16_arc": Crc(16, 0x8005, reflected=True),
    "crc16_ccitt_false": Crc(16, 0x1021, 0xFFFF),  # CRC-16/IBM-3740
    "crc16_kermit": Crc(16, 0x1021, reflected=True),
    "crc16_mcrf4xx": Crc(16, 0x1021, 0xFFFF, reflected=True),
    "crc16_modbus": Crc(16, 0x8005, 0xFFFF, reflected=True),
    "crc16_x25": Crc(16, 0x1021, 0xFFFF, reflected=True, final=0xFFFF),  # CRC-16/IBM-SDLC
    "crc16_xmodem": Crc(16, 0x1021),
    "crc32": Crc(32, 0x04C11DB7, 0xFFFFFFFF, reflected=True, final=0xFFFFFFFF),  # CRC-32/ISO-HDLC
    "crc32_mpeg2": Crc(32, 0x04C11DB7, 0xFFFFFFFF),
    "crc32c": Crc(32, 0x1EDC6F41, 0xFFFFFFFF, reflected=True, final=0xFFFFFFFF),  # CRC-32/ISCSI
}

Sum = Callable[[bytes], int]


class Algorithm(NamedTuple):
    """How a checksum is computed: that of a name in `SUMS`, or a ``crc`` of a whole number of bytes."""

    name: str
    crc: Crc | None = None

    @property
    def size(self) -> int:
        """The bytes of the checksum."""
        return self.crc.width // BYTE if self.crc is not None else SUMS[self.name][0]

    @property
    def compute(self) -> Sum:
        """The function that computes it."""
        return computing(self.crc) if self.crc is not None else SUMS[self.name][1]


def sum8(data: bytes) -> int:
    """Return the sum of the bytes, modulo 256."""
    return sum(data) & 0xFF


def negated_sum8(data: bytes) -> int:
    """Return what makes the sum of the bytes 0, modulo 256."""
    return -sum(data) & 0xFF


def xor(data: bytes) -> int:
    """Return the exclusive or of the bytes."""
    found = 0
    for byte in data:
        found ^= byte
    return found


def fletcher16(data: bytes) -> int:
    """Return the two sums of UBX and RFC 1145, modulo 256; the first one is the low byte."""
    one = two = 0
    for byte in data:
        one += byte
        two += one
    return one & 0xFF | (two & 0xFF) << BYTE


SUMS: dict[str, tuple[int, Sum]] = {
    "sum8": (1, sum8),
    "sum8_negated": (1, negated_sum8),
    "xor": (1, xor),
    "fletcher16": (2, fletcher16),
}
NAMES = (*SUMS, *CRCS)
# Names that are in use for several CRCs, with these.
AMBIGUOUS = {
    "crc16": ("crc16_ccitt_false", "crc16_xmodem", "crc16_modbus", "crc16_arc"),
    "crc16_ccitt": ("crc16_ccitt_false", "crc16_xmodem", "crc16_kermit", "crc16_mcrf4xx"),
    "ccitt": ("crc16_ccitt_false", "crc16_xmodem", "crc16_kermit", "crc16_mcrf4xx"),
    "modulo256": ("sum8", "sum8_negated"),
}


def algorithm(name: str) -> Algorithm:
    """Return the algorithm of a name in `NAMES`."""
    return Algorithm(name, CRCS.get(name))


@cache
def computing(crc: Crc) -> Sum:
    """Return the function that computes a CRC; the libraries of Python have two kinds, which are faster."""
    if crc == CRCS["crc32"]:
        return zlib.crc32
    if crc[:2] == CRCS["crc16_xmodem"][:2] and not crc.reflected:
        return lambda data: binascii.crc_hqx(data, crc.initial) ^ crc.final
    table = _reflected_table(crc) if crc.reflected else _plain_table(crc)
    if crc.reflected:
        initial = _mirrored(crc.initial, crc.width)

        def low_first(data: bytes) -> int:
            register = initial
            for byte in data:
                register = register >> BYTE ^ table[(register ^ byte) & 0xFF]
            return register ^ crc.final

        return low_first
    mask, shift = (1 << crc.width) - 1, crc.width - BYTE

    def high_first(data: bytes) -> int:
        register = crc.initial
        for byte in data:
            register = register << BYTE & mask ^ table[register >> shift ^ byte]
        return register ^ crc.final

    return high_first


def _plain_table(crc: Crc) -> list[int]:
    mask, top = (1 << crc.width) - 1, 1 << crc.width - 1
    found = []
    for byte in range(TABLE):
        register = byte << crc.width - BYTE
        for _ in range(BYTE):
            register = register << 1 & mask ^ (crc.polynomial if register & top else 0)
        found.append(register)
    return found


def _reflected_table(crc: Crc) -> list[int]:
    polynomial = _mirrored(crc.polynomial, crc.width)
    found = []
    for byte in range(TABLE):
        register = byte
        for _ in range(BYTE):
            register = register >> 1 ^ (polynomial if register & 1 else 0)
        found.append(register)
    return found


def _mirrored(value: int, width: int) -> int:
    """Return a number with its bits in the other order."""
    return int(f"{value:0{width}b}"[::-1], 2)
