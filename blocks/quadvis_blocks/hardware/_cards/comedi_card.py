"""Cards by comedi, Linux's driver of data acquisition cards: PCL-726, PCL-818HG and several hundred others.

The calls are those of comedilib as Debian's python3-comedilib 0.11 has them (its module is `comedi.comedi`;
before Debian 12 it was `comedi`). No comedi device was at hand: this was tried with that very module over a
library of C that stands in for libcomedi, and with a module of Python that speaks the same calls.

The driver pcl726 writes nothing when it is attached or detached: what was put out last stays on the wires.
Counters are read as they are; a counter that must be set up and armed is set up before the run.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from quadvis.block import PortError
from quadvis.errors import sentence
from quadvis_blocks.hardware._cards.frames import ChannelKind
from quadvis_blocks.hardware._cards.ports import CardChannel, CardRequest, described
from quadvis_blocks.hardware._cards.ranges import Range

SUBDEVICES = {  # by kind, and by whether it sends
    (ChannelKind.ANALOG, True): ("COMEDI_SUBD_AO",),
    (ChannelKind.ANALOG, False): ("COMEDI_SUBD_AI",),
    (ChannelKind.DIGITAL, True): ("COMEDI_SUBD_DO", "COMEDI_SUBD_DIO"),
    (ChannelKind.DIGITAL, False): ("COMEDI_SUBD_DI", "COMEDI_SUBD_DIO"),
    (ChannelKind.COUNTS, False): ("COMEDI_SUBD_COUNTER",),
}
CLOSE = 1e-6  # of a range that is another one


class ComediCard:
    """Channels of one subdevice of a comedi device."""

    def __init__(self, request: CardRequest, sends: bool) -> None:
        self._request = request
        found: Any = import_module("comedi")
        self._comedi = comedi = found if hasattr(found, "comedi_open") else import_module("comedi.comedi")
        path, _, number = request.device.partition(":")
        self._device = comedi.comedi_open(path)
        if not self._device:
            raise PortError(f"card '{path}' cannot be opened: {self._reason()}")
        try:
            self._subdevice = self._subdevice_of(number, sends)
            comedi.comedi_set_global_oor_behavior(comedi.COMEDI_OOR_NUMBER)  # an end of a range is no NaN
            self._reference = comedi.AREF_DIFF if request.differential else comedi.AREF_GROUND
            self._channels = [self._set_up(channel, sends) for channel in request.channels]
        except BaseException:
            self.close()
            raise

    def write(self, place: int, value: float) -> None:
        """Put out the value of one channel."""
        comedi, channel, (place_of_range, card_range, most) = self._comedi, *self._at(place)
        number = channel.number - 1
        if channel.range is None:
            done = comedi.comedi_dio_write(self._device, self._subdevice, number, int(value))
        else:
            level = value * (1e3 if channel.range.is_current else 1.0)
            level = min(max(level, card_range.min), card_range.max)
            count = int(comedi.comedi_from_phys(level, card_range, most))
            done = comedi.comedi_data_write(
                self._device, self._subdevice, number, place_of_range, self._reference, count
            )
        if done < 0:
            raise PortError(f"{described(self._request, channel)} cannot be written: {self._reason()}")

    def read(self) -> list[float]:
        """Return the values of all channels."""
        return [self._read(place) for place in range(len(self._channels))]

    def close(self) -> None:
        """Close the device."""
        self._comedi.comedi_close(self._device)

    def _at(self, place: int) -> tuple[CardChannel, tuple[int, Any, int]]:
        return self._request.channels[place], self._channels[place]

    def _read(self, place: int) -> float:
        comedi, channel, (place_of_range, card_range, most) = self._comedi, *self._at(place)
        number = channel.number - 1
        if self._request.kind is ChannelKind.DIGITAL:
            done, found = comedi.comedi_dio_read(self._device, self._subdevice, number)
        else:
            done, found = comedi.comedi_data_read(
                self._device, self._subdevice, number, place_of_range, self._reference
            )
        if done < 0:
            raise PortError(f"{described(self._request, channel)} cannot be read: {self._reason()}")
        if channel.range is None:
            return float(found)
        return float(comedi.comedi_to_phys(found, card_range, most))

    def _subdevice_of(self, number: str, sends: bool) -> int:
        """Return the subdevice that the port names, or the first that fits."""
        comedi, kinds = self._comedi, SUBDEVICES[self._request.kind, sends]
        if number:
            if not number.isdecimal():
                problem = f"'comedi:{self._request.device}' is no subdevice"
                raise PortError(sentence(problem, "write its number, as in comedi:/dev/comedi0:1"))
            return int(number)
        for kind in kinds:
            found: int = comedi.comedi_find_subdevice_by_type(self._device, getattr(comedi, kind), 0)
            if found >= 0:
                return found
        what = f"{self._request.kind.name.lower()} {'outputs' if sends else 'inputs'}"
        raise PortError(f"card '{self._request.device}' has no {what}")

    def _set_up(self, channel: CardChannel, sends: bool) -> tuple[int, Any, int]:
        """Return place and contents of a channel's range among those of the card, and the greatest count."""
        comedi, number = self._comedi, channel.number - 1
        there = comedi.comedi_get_n_channels(self._device, self._subdevice)
        if channel.number > there:
            raise PortError(f"{described(self._request, channel)} does not exist: it has {max(0, there)}")
        if self._request.kind is ChannelKind.DIGITAL:
            way = comedi.COMEDI_OUTPUT if sends else comedi.COMEDI_INPUT
            comedi.comedi_dio_config(
                self._device, self._subdevice, number, way
            )  # refused by lines of one way
        if channel.range is None:
            return 0, None, 1
        most = comedi.comedi_get_maxdata(self._device, self._subdevice, number)
        place, found = self._range(channel, channel.range)
        return place, found, most

    def _range(self, channel: CardChannel, wanted: Range) -> tuple[int, Any]:
        comedi, number = self._comedi, channel.number - 1
        there = []
        for place in range(comedi.comedi_get_n_ranges(self._device, self._subdevice, number)):
            found = comedi.comedi_get_range(self._device, self._subdevice, number, place)
            is_current = found.unit == comedi.UNIT_mA
            scale = 1e-3 if is_current else 1.0
            given = Range(found.min * scale, found.max * scale, is_current)
            if is_current == wanted.is_current and all(
                abs(one - other) < CLOSE for one, other in zip(given[:2], wanted[:2], strict=True)
            ):
                return place, found
            there.append(str(given))
        problem = f"{described(self._request, channel)} has no range {wanted}"
        raise PortError(sentence(problem, f"it has {', '.join(there) or 'none'}"))

    def _reason(self) -> str:
        return str(self._comedi.comedi_strerror(self._comedi.comedi_errno())).lower()


def open_card(request: CardRequest, sends: bool) -> ComediCard:
    """Open channels of a comedi device."""
    return ComediCard(request, sends)
