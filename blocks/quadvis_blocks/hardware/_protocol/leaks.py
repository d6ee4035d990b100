"""How many messages would give wrong values, if bytes were damaged: what a checksum is worth.

Each byte has one wrong bit with a probability of 1 %, as on a bad line. A message is wrong without being
found out if its damage leaves numbers, and the checksum fits. The estimate counts the least damage that does
so; `tests/blocks/hardware/test_leaks.py` compares it with damaged messages.
"""

from __future__ import annotations

from math import comb

from quadvis_blocks.hardware._protocol.description import BitField, ProtocolMessage, ValueField
from quadvis_blocks.hardware._protocol.forms import FORMAT, Binary, Printed

SHARE = 0.01  # of the bytes that are damaged
MILLION = 1e6
BITS = 8
# The share of digits that are digits again after a flip of bit 0, 1, 2 or 3; of a higher bit, none is.
DIGITS_AGAIN = (1.0, 0.8, 0.8, 0.4)
INTEGER_DIGITS = 3  # of a number of which the range is not known


def wrong_per_million(message: ProtocolMessage) -> float:
    """Return how many of a million messages would give wrong values, about."""
    return MILLION * _share_wrong(message)


def _share_wrong(message: ProtocolMessage) -> float:
    count = sum(_bytes_of(each) for each in message.fields if isinstance(each, ValueField | BitField))
    again = DIGITS_AGAIN if message.is_text else (1.0,) * BITS
    one = sum(again) / BITS  # the chance that a damaged byte passes for one of a number
    same = sum(each * each for each in again) / BITS**2  # that two do, damaged in the same bit
    intact = (1 - SHARE) ** _rest_of(message)
    pairs = intact * comb(count, 2) * SHARE**2 * (1 - SHARE) ** (count - 2) if count > 1 else 0.0
    check = message.check
    if check is None:
        return float(intact * ((1 - SHARE * (1 - one)) ** count - (1 - SHARE) ** count))
    if check.algorithm.name == "xor":
        return pairs * same
    if check.algorithm.name in ("sum8", "sum8_negated"):
        highest = 0.0 if message.is_text else 0.5 / BITS**2  # bit 7 up or down is the same
        return pairs * (same / 2 + highest)
    if check.algorithm.name == "fletcher16":
        return pairs * (0.0 if message.is_text else 0.5 / BITS**2)
    size = BITS * check.algorithm.size
    least = 2 if size <= BITS else 4  # wrong bits that such a CRC may not find
    damaged = comb(count, least) * SHARE**least * (1 - SHARE) ** (count - least) if count >= least else 0.0
    return float(damaged * one**least / 2**size)


def _rest_of(message: ProtocolMessage) -> int:
    """Return how many bytes a message has besides its numbers: each of them shows its damage."""
    inside = sum(each.size for each in message.fields if isinstance(each, ValueField | BitField))
    if not message.is_text:
        return message.size - inside
    between = sum(
        (each.value.count - 1) * len(each.between) for each in message.fields if isinstance(each, ValueField)
    )
    return message.size - inside + between


def _bytes_of(each: ValueField | BitField) -> int:
    """Return how many bytes the numbers of a field have, in text about."""
    if isinstance(each.form, Binary):
        return each.size
    assert isinstance(each, ValueField) and isinstance(each.form, Printed)
    if each.value.words:
        return 0
    match = FORMAT.fullmatch(each.form.format)
    assert match is not None
    decimals = 0 if each.form.is_whole else int(match["digits"] or 6)
    largest = max(
        (abs(bound) for bound in (each.value.lowest, each.value.highest) if bound is not None), default=0
    )
    digits = len(f"{largest / abs(each.value.factor):.0f}") if largest else INTEGER_DIGITS
    return each.value.count * (digits + decimals)
