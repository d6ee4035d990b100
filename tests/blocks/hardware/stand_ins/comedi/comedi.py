"""Stands in for the module of Debian's python3-comedilib: the same calls, for a card like the PCL-726.

Subdevice 0 is 6 analog outputs, 1 is 16 analog inputs, 2 and 3 are digital inputs and outputs, 4 is counters.
test_comedi_calls.py compares what these calls return with that module, where it is installed.
"""

from __future__ import annotations

import errno
import os
from typing import Any

import card

COMEDI_SUBD_AI, COMEDI_SUBD_AO, COMEDI_SUBD_DI, COMEDI_SUBD_DO, COMEDI_SUBD_DIO = range(1, 6)
COMEDI_SUBD_COUNTER = 6
COMEDI_INPUT, COMEDI_OUTPUT = 0, 1
AREF_GROUND, AREF_COMMON, AREF_DIFF, AREF_OTHER = range(4)
UNIT_volt, UNIT_mA, UNIT_none = range(3)
COMEDI_OOR_NUMBER, COMEDI_OOR_NAN = range(2)

KINDS = [COMEDI_SUBD_AO, COMEDI_SUBD_AI, COMEDI_SUBD_DI, COMEDI_SUBD_DO, COMEDI_SUBD_COUNTER]
CHANNELS = [6, 16, 16, 16, 3]
_state = {"errno": 0, "oor": COMEDI_OOR_NAN}


class comedi_range:  # the library's name
    """A range."""

    def __init__(self, least: float = 0.0, most: float = 0.0, unit: int = UNIT_volt) -> None:
        self.min, self.max, self.unit = float(least), float(most), unit


OUTPUTS = [
    comedi_range(0, 5),
    comedi_range(0, 10),
    comedi_range(-5, 5),
    comedi_range(-10, 10),
    comedi_range(4, 20, UNIT_mA),
]
INPUTS = [comedi_range(-5, 5), comedi_range(-0.5, 0.5), comedi_range(0, 10), comedi_range(-10, 10)]


def _ranges(subdevice: int) -> list[comedi_range]:
    return {0: OUTPUTS, 1: INPUTS}.get(subdevice, [])


def _failed(number: int) -> int:
    _state["errno"] = number
    return -1


def comedi_open(path: str) -> Any:
    """Return a device; None if there is none."""
    if not os.path.exists(path):
        _failed(errno.ENOENT)
        return None
    card.opened.append(path)
    return object()


def comedi_close(_: Any) -> int:
    """Close it, which writes nothing."""
    return 0


def comedi_errno() -> int:
    """Return the number of the last error."""
    return _state["errno"]


def comedi_strerror(number: int) -> str:
    """Return its words."""
    return os.strerror(number)


def comedi_set_global_oor_behavior(behaviour: int) -> int:
    """Say what the ends of a range are."""
    before, _state["oor"] = _state["oor"], behaviour
    return before


def comedi_find_subdevice_by_type(_: Any, kind: int, start: int) -> int:
    """Return the first subdevice of a kind; -1 if there is none."""
    return KINDS.index(kind, start) if kind in KINDS[start:] else -1


def comedi_get_n_channels(_: Any, subdevice: int) -> int:
    """Return the number of channels."""
    return CHANNELS[subdevice]


def comedi_get_maxdata(_: Any, subdevice: int, channel: int) -> int:
    """Return the greatest count."""
    return 4095


def comedi_get_n_ranges(_: Any, subdevice: int, channel: int) -> int:
    """Return the number of ranges."""
    return len(_ranges(subdevice))


def comedi_get_range(_: Any, subdevice: int, channel: int, place: int) -> comedi_range | None:
    """Return a range."""
    there = _ranges(subdevice)
    return there[place] if place < len(there) else None


def comedi_from_phys(value: float, given: comedi_range, most: int) -> int:
    """Return the count of a level."""
    return min(max(round((value - given.min) / (given.max - given.min) * most), 0), most)


def comedi_to_phys(count: int, given: comedi_range, most: int) -> float:
    """Return the level of a count."""
    if count in (0, most) and _state["oor"] == COMEDI_OOR_NAN:
        return float("nan")
    return given.min + count / most * (given.max - given.min)


def comedi_data_write(_: Any, subdevice: int, channel: int, place: int, reference: int, count: int) -> int:
    """Put out a count; the record has its level."""
    if type(count) is not int or type(channel) is not int:
        raise TypeError("in method 'comedi_data_write', argument 6 of type 'lsampl_t'")
    if card.refuses(channel):
        return _failed(errno.EIO)
    given = OUTPUTS[place]
    card.wrote("analog", channel, given.min + count / 4095 * (given.max - given.min))
    return 1


def comedi_data_read(_: Any, subdevice: int, channel: int, place: int, reference: int) -> list[int]:
    """Return what was done, and a count."""
    if card.refuses(channel):
        return [_failed(errno.EIO), 0]
    card.asked.append((subdevice, channel, place, reference))
    return [1, int(card.values.get((f"subdevice {subdevice}", channel), 100 * channel))]


def comedi_dio_config(_: Any, subdevice: int, channel: int, way: int) -> int:
    """Refuse: these lines have one way."""
    return _failed(errno.EINVAL)


def comedi_dio_write(_: Any, subdevice: int, channel: int, bit: int) -> int:
    """Put out a bit."""
    if card.refuses(channel):
        return _failed(errno.EIO)
    card.wrote("digital", channel, bit)
    return 1


def comedi_dio_read(_: Any, subdevice: int, channel: int) -> list[int]:
    """Return what was done, and a bit."""
    return [_failed(errno.EIO), 0] if card.refuses(channel) else [1, channel % 2]
