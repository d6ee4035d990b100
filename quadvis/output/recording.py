"""Recorded signals in memory: rows of blocks as they lie in the engine's memory, and signals by name."""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from quadvis.engine.graph import Index, selected
from quadvis.engine.names import read_name
from quadvis.errors import QuadvisError, quoted, suggestion

SLOT = 8
SLOT_TYPES = {"float64": "<f8", "int64": "<i8", "bool": "<i8"}

Buffer = bytes | bytearray | memoryview
Slots = NDArray[np.int64]


class Recorded(Protocol):
    """Recorded signals by name, of a run or of a log: arrays with a leading time axis."""

    @property
    def units(self) -> Mapping[str, str]:
        """The unit of every signal."""

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return the rows of a signal."""

    def times(self, name: str) -> NDArray[np.float64]:
        """Return the times (s) of its rows."""

    def rate(self, name: str) -> str:
        """Return the name of the rate at which its block works; "" if that is not known."""

    def stamps(self, name: str) -> NDArray[np.int64]:
        """Return the stamps (ns) of its rows."""


@dataclass(frozen=True)
class Field:
    """One output port in a log: its type ("float64", "int64" or "bool"), shape and unit."""

    name: str
    type: str = "float64"
    shape: tuple[int, ...] = ()
    unit: str = "1"

    @property
    def size(self) -> int:
        """How many slots it takes: one for every element."""
        return math.prod(self.shape)

    def rows(self, slots: Slots, start: int) -> NDArray[Any]:
        """Return its rows, (N, *shape), out of those of its block, (N, slots), where it begins at a slot."""
        values = slots[:, start : start + self.size].view(SLOT_TYPES[self.type])
        return (values != 0 if self.type == "bool" else values).reshape(len(slots), *self.shape)


@dataclass(frozen=True)
class Channel:
    """One logged block: its path ("/vision/detector"), outputs in the order of memory, and rate."""

    path: str
    fields: tuple[Field, ...]
    rate: str = ""

    @property
    def size(self) -> int:
        """Bytes in a row."""
        return SLOT * sum(field.size for field in self.fields)

    def signal(self, field: Field) -> str:
        """Return a field's name among all signals, such as "vision/detector.centres"."""
        return f"{self.path.strip('/')}.{field.name}"

    def slots(self, rows: Buffer, count: int) -> Slots:
        """Return so many rows that lie one after another as (N, slots)."""
        return np.frombuffer(rows, np.dtype("<i8")).reshape(count, self.size // SLOT)


class Rows:
    """The rows of one block, packed, with their stamps (ns)."""

    def __init__(self, channel: Channel) -> None:
        self._channel = channel
        self._stamps = array("q")
        self._bytes = bytearray()
        self._whole: tuple[NDArray[np.int64], Slots] | None = None

    def append(self, stamp: int, row: Buffer) -> None:
        """Keep one more row."""
        self._stamps.append(stamp)
        self._bytes += row

    def arrays(self) -> tuple[NDArray[np.int64], Slots]:
        """Return the stamps (N,) and the rows (N, slots); nothing is copied until rows come after that."""
        if self._whole is None or self._stamps:
            stamps = np.frombuffer(self._stamps, np.int64)
            slots = self._channel.slots(self._bytes, len(stamps))
            if self._whole is not None:
                stamps = np.concatenate((self._whole[0], stamps))
                slots = np.concatenate((self._whole[1], slots))
            for whole in (stamps, slots):
                whole.flags.writeable = False
            # What is handed out can grow no more: the next rows begin anew.
            self._stamps, self._bytes, self._whole = array("q"), bytearray(), (stamps, slots)
        return self._whole


class Recording:
    """Signals in memory: `recording["plant.position"]` is an array with a leading time axis.

    A name may have an index, `"plant.position[0:2]"`, and may be a port of a part: `ports` says what is
    behind those.
    """

    def __init__(
        self, channels: Iterable[Channel] = (), ports: Mapping[str, str] = MappingProxyType({})
    ) -> None:
        """Begin without rows."""
        self.channels: list[Channel] = []
        self.ports = ports
        self._rows: list[Rows] = []
        self._signals: dict[str, tuple[int, int, Field]] = {}
        for channel in channels:
            self.add(channel)

    def add(self, channel: Channel) -> None:
        """Make room for the rows of one more block."""
        index, start = len(self.channels), 0
        self.channels.append(channel)
        self._rows.append(Rows(channel))
        for field in channel.fields:
            self._signals[channel.signal(field)] = (index, start, field)
            start += field.size

    def append(self, channel: int, time: int, row: Buffer) -> None:
        """Keep one row: the outputs of `channels[channel]` at `time` (ns) as in memory."""
        self._rows[channel].append(time, row)

    @property
    def names(self) -> tuple[str, ...]:
        """All signals, block by block."""
        return tuple(self._signals)

    @property
    def units(self) -> dict[str, str]:
        """The unit of every signal."""
        return {name: field.unit for name, (_, _, field) in self._signals.items()}

    def stamps(self, name: str) -> NDArray[np.int64]:
        """Return the stamps (ns) of a signal's N rows: exact times, rounded down."""
        return self._arrays(self._find(name)[0])[0]

    def times(self, name: str) -> NDArray[np.float64]:
        """Return the times (s) of a signal's N rows."""
        return self.stamps(name) / 1e9

    def rate(self, name: str) -> str:
        """Return the name of the rate at which a signal's block works; "" if that is not known."""
        return self.channels[self._find(name)[0]].rate

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return a signal of N rows, shape (N, *shape of the port): float64, int64 or bool."""
        channel, start, field, index = self._find(name)
        return field.rows(self._arrays(channel)[1], start)[(slice(None), *index)]

    def __iter__(self) -> Iterator[str]:
        return iter(self._signals)

    def __len__(self) -> int:
        return len(self._signals)

    def __contains__(self, name: object) -> bool:
        try:
            self._find(str(name))
        except QuadvisError:
            return False
        return True

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {len(self)} signals>"

    def arrays(self, path: str) -> tuple[NDArray[np.int64], Slots]:
        """Return the stamps (ns) and the rows of a block by its channel's path; none if it has none."""
        for index, channel in enumerate(self.channels):
            if channel.path == path:
                return self._arrays(index)
        return np.zeros(0, np.int64), np.zeros((0, 0), np.int64)

    def _arrays(self, channel: int) -> tuple[NDArray[np.int64], Slots]:
        """Return the stamps and the rows of a block."""
        return self._rows[channel].arrays()

    def _find(self, name: str) -> tuple[int, int, Field, Index]:
        """Return the block, first slot, port and index that a name means; QuadvisError if it means none."""
        if name in self._signals:
            return *self._signals[name], ()
        source, index = self._source(name)
        if source not in self._signals:
            plain = name.partition("[")[0]
            if plain in self.ports:
                raise QuadvisError(f"{quoted(plain)} is {quoted(source)}, which was not recorded")
            some = f"there are {', '.join(self.names[:8])}, ..." if self._signals else "nothing was recorded"
            remedy = suggestion(plain, [*self._signals, *self.ports]) or some
            raise QuadvisError(f"there is no signal {quoted(name)}; {remedy}")
        channel, start, field = self._signals[source]
        try:
            selected(field.shape, index)
        except IndexError:
            shape = f"the shape {list(field.shape)}, count from 0" if field.shape else "one element only"
            raise QuadvisError(f"there is no {quoted(name)}: {quoted(source)} has {shape}") from None
        return channel, start, field, index

    def _source(self, name: str) -> tuple[str, Index]:
        """Return the block's port that a name means, and which part of it."""
        named = read_name(name)
        if named is None:
            return name, ()
        behind = read_name(self.ports.get(named.source, ""))
        if behind is None:
            return named.source, named.index
        if behind.index and named.index:
            problem = f"{quoted(named.source)} is {quoted(self.ports[named.source])} already"
            raise QuadvisError(f"{problem}, it cannot take a second index")
        return behind.source, behind.index or named.index
