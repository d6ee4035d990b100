"""Recorded signals in memory: rows of blocks, copied from the engine's memory, and signals by name."""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import QuadvisError, quoted, suggestion
from quadvis.graph.graph import Index, Node, Wire, selected
from quadvis.graph.names import read_name

SLOT = 8
TASK_TIMES = "_times"  # the folder of the times of tasks, which are no signals of the diagram
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
        """Return the times (s) of a signal's rows."""

    def rate(self, name: str) -> str:
        """Return the name of the rate of a signal's block; "" if it is not known."""

    def stamps(self, name: str) -> NDArray[np.int64]:
        """Return the stamps (ns) of its rows."""


class RecordedPort(NamedTuple):
    """One output port in a recording: its type ("float64", "int64" or "bool"), shape and unit."""

    name: str
    type: str = "float64"
    shape: tuple[int, ...] = ()
    unit: str = "1"

    @property
    def size(self) -> int:
        """The number of its slots: one for every element."""
        return math.prod(self.shape)

    def rows(self, slots: Slots, start: int) -> NDArray[Any]:
        """Return the port's rows (N, *shape) from its block's rows (N, slots); `start` is its first slot."""
        values = slots[:, start : start + self.size].view(SLOT_TYPES[self.type])
        return (values != 0 if self.type == "bool" else values).reshape(len(slots), *self.shape)


def ports(node: Node) -> tuple[RecordedPort, ...]:
    """Return the outputs of a node that a row holds: all but frames."""
    outputs = node.block.interface.outputs
    return tuple(
        RecordedPort(name, port.signal.scalar, node.shape(name), node.unit(name))
        for name, port in outputs.items()
        if port.signal.scalar != "frame"
    )


class RecordedBlock(NamedTuple):
    """One recorded block: its path ("/vision/detector"), its ports in the order of memory, its rate.

    A ``hidden`` one is no signal of the diagram; it serves to replay the run, or has the times of a task.
    """

    path: str
    ports: tuple[RecordedPort, ...]
    rate: str = ""
    hidden: bool = False

    @property
    def size(self) -> int:
        """The bytes of a row."""
        return SLOT * sum(port.size for port in self.ports)

    def signal(self, port: RecordedPort) -> str:
        """Return a port's name among all signals, such as "vision/detector.centres"."""
        return f"{self.path.strip('/')}.{port.name}"

    def slots(self, rows: Buffer, count: int) -> Slots:
        """Return `count` rows that lie one after another as an array (N, slots)."""
        return np.frombuffer(rows, np.dtype("<i8")).reshape(count, self.size // SLOT)


class Rows:
    """The rows of one block, packed, with their stamps (ns)."""

    def __init__(self, block: RecordedBlock) -> None:
        self._block = block
        self._stamps = array("q")
        self._bytes = bytearray()
        self._whole: tuple[NDArray[np.int64], Slots] | None = None

    def append(self, stamp: int, row: Buffer) -> None:
        """Keep one more row."""
        self._stamps.append(stamp)
        self._bytes += row

    def extend(self, stamps: NDArray[np.int64], rows: Slots) -> None:
        """Keep N more rows (N, slots)."""
        self._stamps.frombytes(stamps.tobytes())
        self._bytes += rows.tobytes()

    def arrays(self) -> tuple[NDArray[np.int64], Slots]:
        """Return the stamps (N,) and the rows (N, slots) without a copy; further rows go to new arrays."""
        if self._whole is None or self._stamps:
            stamps = np.frombuffer(self._stamps, np.int64)
            slots = self._block.slots(self._bytes, len(stamps))
            if self._whole is not None:
                stamps = np.concatenate((self._whole[0], stamps))
                slots = np.concatenate((self._whole[1], slots))
            for whole in (stamps, slots):
                whole.flags.writeable = False
            # The arrays that were returned cannot grow: the next rows begin new ones.
            self._stamps, self._bytes, self._whole = array("q"), bytearray(), (stamps, slots)
        return self._whole


class Recording:
    """Signals in memory: `recording["plant.position"]` is an array with a leading time axis.

    A name may have an index, `"plant.position[0:2]"`, and may be a port of a part: `ports` names the source
    of each. So may a signal of a block be what another block shows of it.
    """

    def __init__(
        self, blocks: Iterable[RecordedBlock] = (), ports: Mapping[str, str] = MappingProxyType({})
    ) -> None:
        """Begin without rows."""
        self.blocks: list[RecordedBlock] = []
        self.ports = ports
        self._places: dict[str, int] = {}  # of the blocks, by path
        self._rows: list[Rows] = []
        self._signals: dict[str, tuple[int, int, RecordedPort]] = {}
        for block in blocks:
            self.add(block)

    def add(self, block: RecordedBlock) -> None:
        """Add a block whose rows will follow."""
        index, start = len(self.blocks), 0
        self._places.setdefault(block.path, index)
        self.blocks.append(block)
        self._rows.append(Rows(block))
        for port in block.ports:
            self._signals[block.signal(port)] = (index, start, port)
            start += port.size

    def append(self, block: int, time: int, row: Buffer) -> None:
        """Keep one row: the outputs of `blocks[block]` at `time` (ns) as in memory."""
        self._rows[block].append(time, row)

    def extend(self, block: int, times: NDArray[np.int64], rows: Slots) -> None:
        """Keep N rows (N, slots) of `blocks[block]` at `times` (ns)."""
        self._rows[block].extend(times, rows)

    @property
    def names(self) -> tuple[str, ...]:
        """All signals, block by block."""
        return tuple(self._signals)

    @property
    def units(self) -> dict[str, str]:
        """The unit of every signal."""
        return {name: port.unit for name, (_, _, port) in self._signals.items()}

    def stamps(self, name: str) -> NDArray[np.int64]:
        """Return the stamps (ns) of a signal's N rows: exact times, rounded down."""
        return self._arrays(self.find(name)[0])[0]

    def times(self, name: str) -> NDArray[np.float64]:
        """Return the times (s) of a signal's N rows."""
        return self.stamps(name) / 1e9

    def port(self, name: str) -> RecordedPort:
        """Return the type, shape and unit of a signal, or of the elements of it that an index names."""
        _, _, port, index = self.find(name)
        if not index:
            return port
        units = port.unit.split(" ")
        each = np.array(units if len(units) > 1 else units * port.size, object).reshape(port.shape)[index]
        chosen = [each] if isinstance(each, str) else each.ravel().tolist()
        unit = chosen[0] if len(set(chosen)) == 1 else " ".join(chosen)
        return port._replace(shape=np.shape(each), unit=unit)

    def rate(self, name: str) -> str:
        """Return the name of the rate of a signal's block; "" if it is not known."""
        return self.blocks[self.find(name)[0]].rate

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return a signal of N rows, shape (N, *shape of the port): float64, int64 or bool."""
        block, start, port, index = self.find(name)
        return port.rows(self._arrays(block)[1], start)[(slice(None), *index)]

    def __iter__(self) -> Iterator[str]:
        return iter(self._signals)

    def __len__(self) -> int:
        return len(self._signals)

    def __contains__(self, name: object) -> bool:
        try:
            self.find(str(name))
        except QuadvisError:
            return False
        return True

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {len(self)} signals>"

    def arrays(self, path: str) -> tuple[NDArray[np.int64], Slots]:
        """Return the stamps (ns) and the rows of a block by its path; none if the recording lacks it."""
        if path not in self._places:
            return np.zeros(0, np.int64), np.zeros((0, 0), np.int64)
        return self._arrays(self._places[path])

    def block(self, path: str) -> RecordedBlock | None:
        """Return a block by its path; None if the recording lacks it."""
        return self.blocks[self._places[path]] if path in self._places else None

    def _arrays(self, block: int) -> tuple[NDArray[np.int64], Slots]:
        """Return the stamps and the rows of a block."""
        return self._rows[block].arrays()

    def find(self, name: str) -> tuple[int, int, RecordedPort, Index]:
        """Return a signal's block (its number), first slot, port and index; QuadvisError if there is none."""
        if name in self._signals and name not in self.ports:
            return *self._signals[name], ()
        source, index = self._source(name)
        if source not in self._signals:
            plain = name.partition("[")[0]
            if plain in self.ports:
                raise QuadvisError(f"{quoted(plain)} is {quoted(source)}, which was not recorded")
            some = f"there are {', '.join(self.names[:8])}, ..." if self._signals else "nothing was recorded"
            remedy = suggestion(plain, [*self._signals, *self.ports]) or some
            raise QuadvisError(f"there is no signal {quoted(name)}; {remedy}")
        block, start, port = self._signals[source]
        try:
            selected(port.shape, index)
        except IndexError:
            shape = f"the shape {list(port.shape)}, count from 0" if port.shape else "one element only"
            raise QuadvisError(f"there is no {quoted(name)}: {quoted(source)} has {shape}") from None
        return block, start, port, index

    def frame(self, signals: Sequence[str] = (), *, rate: str = "", every: str | float = 0.0) -> Any:
        """Return signals as a pandas.DataFrame, see `quadvis.output.tables.signal_table`.

        Its index is the time (s), its columns are elements such as "craft.position[0]"; ``attrs["units"]``
        has their units.
        """
        from quadvis.output.frames import as_frame
        from quadvis.output.tables import signal_table

        return as_frame(signal_table(self, signals, rate=rate, every=every))

    def xarray(self, signals: Sequence[str] = ()) -> Any:
        """Return signals as an xarray.Dataset, each at its own times (s)."""
        from quadvis.output.frames import as_dataset

        return as_dataset(self, signals)

    def wire(self, name: str) -> Wire:
        """Return what a name means here, a port of a block with an index; QuadvisError if there is none."""
        block, _, port, index = self.find(name)
        return Wire(self.blocks[block].path.strip("/"), port.name, index)

    def _source(self, name: str) -> tuple[str, Index]:
        """Return the name of the block's port that a name means, and the index of its elements."""
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
