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
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from time import monotonic
from types import TracebackType
from typing import Any, Self, cast

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import RunError
from quadvis.machine.files import LOG, open_output
from quadvis.output.recording import Buffer, Channel
from quadvis.output.sink import Sink

CDR = b"\x00\x01\x00\x00"  # plain CDR, little endian
FLUSH = 0.05  # s between handing rows to the operating system
CHUNK = 1 << 16  # bytes after which that happens earlier
AROUND = 47  # bytes that the format puts around a row and into its index
PATIENCE = 2.0  # s that a run waits for a slow disk in all, before rows are left out
FORMAT = "1"
DIAGRAM, METADATA, SUMMARY = "diagram.yaml", "quadvis", "summary"
PORTS = "ports"  # of the facts of a run: what the ports of parts are, as JSON


class LogWriter:
    """Writes the rows of a run so that what is older than `FLUSH` outlives the process.

    Rows are handed on when a later row is due, so where rows are rare let an idle loop call `flush`. A run
    outlives its log: when the disk refuses, or is too slow for longer than `PATIENCE`, rows are left out,
    `loss` says how many, and what is in the file stays readable.
    """

    def __init__(self, path: str | Path, channels: Sequence[Channel], metadata: Mapping[str, str]) -> None:
        """Begin a file, replacing what was there; `metadata["diagram"]` is the resolved diagram's text.

        RunError if not even this can be written.
        """
        from mcap.writer import CompressionType, Writer

        definitions = [message_definition(channel) for channel in channels]
        self.path = Path(path)
        self._sizes = [len(CDR) + channel.size for channel in channels]
        self._closed = False
        self._patience = PATIENCE
        self._pending = self._rows = self._first = 0
        self._sink = Sink(open_output(self.path, LOG))
        # Chunks end where `flush` ends them, never inside `write`.
        self._writer: Any = Writer(
            cast(Any, self._sink), chunk_size=1 << 62, compression=CompressionType.NONE
        )
        setattr(self._writer, "_Writer__chunk_indices", _ChunkIndexes())  # noqa: B010, a private name
        self._begin(dict(metadata))
        names = _message_names(channel.path for channel in channels)
        self._ids = list(map(self._register, channels, names, definitions))
        self.flush()
        self._sink.drain()
        if self._sink.failure:
            raise RunError(self._refusal)

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
        if self._sink.full and not self._has_room():
            self._sink.lose(1, time)
            return
        self._writer.add_message(self._ids[channel], time, data, time)
        self._first = time if not self._rows else self._first
        self._rows += 1
        self._pending += len(data) + AROUND
        if self._pending >= CHUNK or monotonic() >= self._due:
            self.flush()

    def _has_room(self) -> bool:
        """Return whether one more row can be taken; wait for that as long as there is patience left."""
        if not self._sink.failure and self._patience > 0:
            self._patience -= self._sink.wait_for_room(self._patience)
        return not self._sink.full

    def write_rows(self, channel: int, times: Sequence[int] | NDArray[np.int64], rows: Buffer) -> None:
        """Write rows that lie one after another in `rows`; `times` (ns) has one entry for each."""
        size = self._sizes[channel] - len(CDR)
        if len(rows) != size * len(times):
            raise ValueError(f"{len(times)} rows of channel {channel} have {size * len(times)} bytes")
        view = memoryview(rows)
        for i, time in enumerate(times.tolist() if isinstance(times, np.ndarray) else times):
            self.write(channel, time, view[i * size : (i + 1) * size])

    def flush(self) -> None:
        """Hand everything on, so that it survives the end of this process a moment later."""
        self._writer.flush()
        self._sink.hand_on(self._rows, self._first)
        self._due = monotonic() + FLUSH
        self._pending = self._rows = 0

    def close(self, summary: Mapping[str, str] | None = None) -> None:
        """End the file with the outcome of the run, and with what it lacks; a second call does nothing."""
        if self._closed:
            return
        self._closed = True
        self.flush()
        self._sink.drain()
        lost = {"lost": self.loss} if self.loss else {}
        self._writer.add_metadata(SUMMARY, {**(summary or {}), **lost})
        self._writer.finish()
        self._sink.hand_on()
        self._sink.close()

    @property
    def loss(self) -> str:
        """What is not in the log, and why, as a sentence; empty if all is. It is known after `close`."""
        sink = self._sink
        if sink.failure:
            return f"{self._refusal}; {self._missing}"
        return f"the disk is too slow for the log '{self.path}'; {self._missing}" if sink.lost else ""

    @property
    def _refusal(self) -> str:
        return f"cannot write the log '{self.path}': {self._sink.failure}"

    @property
    def _missing(self) -> str:
        count, first = self._sink.lost, self._sink.lost_from
        if first is None:
            return "it lacks its end"
        return f"it lacks {count} row{'s' * (count != 1)}, the first of t = {first / 1e9:.9g} s"

    def __enter__(self) -> Self:
        """Return the writer itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file; the summary names what stopped the run, and that says what the file lacks."""
        self.close({"stopped": str(error) or type(error).__name__} if error else None)
        if error and self.loss:
            error.add_note(self.loss)


class _ChunkIndexes:
    """The indexes of chunks for the end of a file, packed: there are twenty for every second of a run."""

    def __init__(self) -> None:
        self._packed = bytearray()

    def append(self, index: Any) -> None:
        """Keep one more index, as it will be written."""
        from mcap.data_stream import RecordBuilder

        builder: Any = RecordBuilder()
        index.write(builder)
        self._packed += builder.end()

    def __iter__(self) -> Iterator[_ChunkIndexes]:
        if self._packed:
            yield self

    def write(self, builder: Any) -> None:
        """Write all of them."""
        builder.write(bytes(self._packed))


def ports_of(metadata: Mapping[str, str]) -> dict[str, str]:
    """Return what the ports of the diagram's parts are, by the facts of a run; none if they are damaged."""
    try:
        found = json.loads(metadata.get(PORTS, "{}"))
    except ValueError:
        return {}
    return {str(port): str(source) for port, source in found.items()} if isinstance(found, dict) else {}


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
