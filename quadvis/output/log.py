"""The log of a run: an MCAP file with one topic per block that survives `kill -9` and opens in other tools.

Messages are `ros2msg`/CDR, so PlotJuggler, Foxglove, rosbags, Rerun and `ros2 bag` read them without quadvis.
A block's outputs lie side by side in the engine's memory as little-endian 8-byte slots, which is what CDR
wants after its four header bytes: a row is that header and a slice of memory.

The file begins with the resolved diagram (attachment `diagram.yaml`) and the facts of the run (metadata
record `quadvis`), and ends with its outcome (record `summary`) and the indexes. A killed run lacks that end;
`log_reader` does without.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import QuadvisError, RunError, quoted, suggestion
from quadvis.files import LOG, open_output

SLOT = 8
SLOT_TYPES = {"float64": "<f8", "int64": "<i8", "bool": "<i8"}
CDR = b"\x00\x01\x00\x00"  # plain CDR, little endian
FLUSH = 0.05  # s between handing rows to the operating system
CHUNK = 1 << 16  # bytes after which that happens earlier
FORMAT = "1"
DIAGRAM, METADATA, SUMMARY = "diagram.yaml", "quadvis", "summary"

Buffer = bytes | bytearray | memoryview


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


class Recording:
    """Signals in memory: `recording["plant.position"]` is an array with a leading time axis."""

    def __init__(self, channels: Iterable[Channel] = ()) -> None:
        """Begin without rows."""
        self.channels: list[Channel] = []
        self._times: list[list[int]] = []
        self._rows: list[list[bytes]] = []
        self._arrays: dict[int, tuple[NDArray[np.float64], NDArray[np.int64]]] = {}
        self._signals: dict[str, tuple[int, int, Field]] = {}
        for channel in channels:
            self.add(channel)

    def add(self, channel: Channel) -> None:
        """Make room for the rows of one more block."""
        index, start = len(self.channels), 0
        self.channels.append(channel)
        self._times.append([])
        self._rows.append([])
        for field in channel.fields:
            self._signals[channel.signal(field)] = (index, start, field)
            start += field.size

    def append(self, channel: int, time: int, row: bytes) -> None:
        """Keep one row: the outputs of `channels[channel]` at `time` (ns) as in memory."""
        self._times[channel].append(time)
        self._rows[channel].append(row)

    @property
    def names(self) -> tuple[str, ...]:
        """All signals, block by block."""
        return tuple(self._signals)

    @property
    def units(self) -> dict[str, str]:
        """The unit of every signal."""
        return {name: field.unit for name, (_, _, field) in self._signals.items()}

    def times(self, name: str) -> NDArray[np.float64]:
        """Return the times (s) of a signal's N rows."""
        return self._decoded(self._find(name)[0])[0]

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return a signal of N rows, shape (N, *shape of the port): float64, int64 or bool."""
        channel, start, field = self._find(name)
        values = self._decoded(channel)[1][:, start : start + field.size].view(SLOT_TYPES[field.type])
        return (values != 0 if field.type == "bool" else values).reshape(-1, *field.shape)

    def _decoded(self, channel: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Return the times (s) and the slots of a channel, decoded once until rows are added."""
        count = len(self._rows[channel])
        if channel not in self._arrays or len(self._arrays[channel][0]) != count:
            slots = np.frombuffer(b"".join(self._rows[channel]), np.dtype("<i8"))
            times = np.array(self._times[channel], np.float64) / 1e9
            self._arrays[channel] = times, slots.reshape(count, self.channels[channel].size // SLOT)
        return self._arrays[channel]

    def _find(self, name: str) -> tuple[int, int, Field]:
        if name not in self._signals:
            some = f"there are {', '.join(self.names[:8])}, ..." if self._signals else "nothing was recorded"
            remedy = suggestion(name, self.names) or some
            raise QuadvisError(f"there is no signal {quoted(name)}; {remedy}")
        return self._signals[name]


class LogWriter:
    """Writes the rows of a run so that what is older than `FLUSH` outlives the process.

    Rows are handed on when a later row is due, so where rows are rare let an idle loop call `flush`. When the
    disk refuses, that call and every later one raises `RunError`; what is in the file stays readable.
    """

    def __init__(self, path: str | Path, channels: Sequence[Channel], metadata: Mapping[str, str]) -> None:
        """Begin a file, replacing what was there; `metadata["diagram"]` is the resolved diagram's text."""
        from mcap.writer import CompressionType, Writer

        definitions = [message_definition(channel) for channel in channels]
        self.path = Path(path)
        self._sizes = [len(CDR) + channel.size for channel in channels]
        self._failure = ""
        self._pending = 0
        with self._disk():
            self._file = open_output(self.path, LOG)
            # Chunks end where `flush` ends them, never inside `write`.
            self._writer: Any = Writer(self._file, chunk_size=1 << 62, compression=CompressionType.NONE)
            self._begin(dict(metadata))
            names = _message_names(channel.path for channel in channels)
            self._ids = list(map(self._register, channels, names, definitions))
            self.flush()

    def _begin(self, metadata: dict[str, str]) -> None:
        self._writer.start(profile="ros2", library=f"quadvis {metadata.get('quadvis', '')}".strip())
        self._writer.add_attachment(0, 0, DIAGRAM, "application/yaml", metadata.pop("diagram", "").encode())
        self._writer.add_metadata(METADATA, {"format": FORMAT, **metadata})

    def _register(self, channel: Channel, name: str, definition: str) -> int:
        schema = self._writer.register_schema(f"quadvis_msgs/msg/{name}", "ros2msg", definition.encode())
        fields = json.dumps([[field.name, field.type, field.shape, field.unit] for field in channel.fields])
        described = {"fields": fields, "rate": channel.rate}
        return int(self._writer.register_channel(channel.path, "cdr", schema, described))

    def write(self, channel: int, time: int, row: Buffer) -> None:
        """Write one row: the outputs of `channels[channel]` at `time` (ns of the run) as in memory."""
        data = CDR + row
        if len(data) != self._sizes[channel]:
            raise ValueError(f"a row of channel {channel} has {self._sizes[channel] - len(CDR)} bytes")
        if self._failure:
            raise RunError(self._failure)
        self._writer.add_message(self._ids[channel], time, data, time)
        self._pending += len(data)
        if self._pending >= CHUNK or monotonic() >= self._due:
            self.flush()

    def write_rows(self, channel: int, times: Sequence[int] | NDArray[np.int64], rows: Buffer) -> None:
        """Write rows that lie one after another in `rows`; `times` (ns) has one entry for each."""
        size = self._sizes[channel] - len(CDR)
        if len(rows) != size * len(times):
            raise ValueError(f"{len(times)} rows of channel {channel} have {size * len(times)} bytes")
        view = memoryview(rows)
        for i, time in enumerate(times.tolist() if isinstance(times, np.ndarray) else times):
            self.write(channel, time, view[i * size : (i + 1) * size])

    def flush(self) -> None:
        """Hand everything to the operating system, so that it survives the end of this process."""
        with self._disk():
            self._writer.flush()
        self._due = monotonic() + FLUSH
        self._pending = 0

    def close(self, summary: Mapping[str, str] | None = None) -> None:
        """End the file with the outcome of the run; a second call does nothing."""
        if self._file.closed and not self._failure:
            return
        with self._disk():
            self._writer.flush()
            self._writer.add_metadata(SUMMARY, dict(summary or {}))
            self._writer.finish()
            self._file.close()

    def __enter__(self) -> Self:
        """Return the writer itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file, unless the disk has refused it already; the summary names what stopped the run."""
        if not self._failure:
            self.close({"stopped": str(error) or type(error).__name__} if error else None)

    @contextmanager
    def _disk(self) -> Iterator[None]:
        """Turn a refusal of the disk into a sentence and give the file up: half a record may be its end."""
        if self._failure:
            raise RunError(self._failure)
        try:
            yield
        except OSError as error:
            self._failure = f"cannot write the log '{self.path}': {_reason(error)}"
            if hasattr(self, "_file"):
                with suppress(OSError):  # the same refusal, of what is still buffered
                    self._file.close()
            raise RunError(self._failure) from error


def message_definition(channel: Channel) -> str:
    """Return the `ros2msg` definition of a row: bools travel as int64, arrays flat in C order."""
    if not channel.size:
        raise ValueError(f"'{channel.path}' has no outputs to log")
    names = _unique((_field_name(field.name) for field in channel.fields), "_")
    lines = []
    for field, name in zip(channel.fields, names, strict=True):
        size = f"[{field.size}]" if field.shape else ""
        shape = f", {' x '.join(map(str, field.shape))} row by row" if len(field.shape) > 1 else ""
        note = "0 or 1" if field.type == "bool" else field.unit
        if field.size:
            kind = "float64" if field.type == "float64" else "int64"
            lines.append(f"{kind}{size} {name}  # {note}{shape}\n")
    return "".join(lines)


def _message_names(paths: Iterable[str]) -> list[str]:
    """Return names that ROS accepts for messages: "/vision/detector" becomes "VisionDetector"."""
    words = (re.findall("[A-Za-z0-9]+", path) for path in paths)
    names = ("".join(word[:1].upper() + word[1:] for word in found) for found in words)
    return _unique((name if name[:1].isalpha() else f"Block{name}" for name in names), "X")


def _field_name(name: str) -> str:
    """Return a name that ROS accepts for a field: lower case, single underscores, a letter first."""
    plain = re.sub("[^a-z0-9]+", "_", name.lower()).strip("_")
    return plain if plain[:1].isalpha() else f"f_{plain}".rstrip("_")


def _unique(names: Iterable[str], joint: str) -> list[str]:
    """Return the names, with a number on those that were there before."""
    found: list[str] = []
    for name in names:
        numbered = (f"{name}{joint}{i}" if i > 1 else name for i in range(1, len(found) + 2))
        found.append(next(candidate for candidate in numbered if candidate not in found))
    return found


def _reason(error: OSError) -> str:
    """Return why the system refused."""
    if isinstance(error, FileNotFoundError):
        return "there is no such file or folder"
    return (error.strerror or str(error)).lower()
