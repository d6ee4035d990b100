"""The log of a run: an MCAP file with one topic per block that survives `kill -9` and opens in other tools.

Messages are `ros2msg`/CDR, so PlotJuggler, Foxglove, rosbags, Rerun and `ros2 bag` read them without quadvis.
A block's outputs lie side by side in the engine's memory as little-endian 8-byte slots, which is what CDR
wants after its four header bytes: a row is that header and a slice of memory.

The file begins with the resolved diagram (attachment `diagram.yaml`), the SHA-256 of files that blocks read
while they run (attachment `files.json`, if there are any), and the facts of the run (metadata
record `quadvis`). It ends with the outcome (record `summary`) and the indexes. The log of a killed run lacks
this end; `log_reader` does not need it.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from time import monotonic
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import RunError, counted
from quadvis.machine.files import LOG, open_output
from quadvis.output.mcap_messages import ChannelRows, message_chunks, message_size
from quadvis.output.mcap_writer import McapWriter
from quadvis.output.recording import SLOT, Buffer, RecordedBlock, RecordedPort, Rows, Slots
from quadvis.output.sink import Sink

FLUSH = 0.05  # s after which rows are handed to the operating system
CHUNK = 1 << 17  # bytes after which they are handed on earlier
AROUND = message_size(0) + 16  # bytes that the format puts around a row and into its index
LARGEST = 1 << 20  # bytes of a chunk: readers hold several in memory
PATIENCE = 2.0  # s that a run waits for a slow disk in total, before rows are left out
FORMAT = "1"
DIAGRAM, FILES, METADATA, SUMMARY = "diagram.yaml", "files.json", "quadvis", "summary"
CHANGES = "changes"  # the name of the records of parameters that were tuned
PACKAGE = "quadvis_msgs/msg/"  # of the names of messages
HIDDEN = "hidden"  # key of a channel that is no signal of the diagram
PORTS = "ports"  # key of the facts of a run: the sources of the ports of parts, as JSON


class LogWriter:
    """Writes the rows of a run so that rows older than `FLUSH` survive the end of the process.

    Rows are handed on when a later row comes, so where rows are rare a loop should call `flush_late`. A run
    survives its log: when the disk refuses, or is too slow for longer than `PATIENCE`, rows are left out,
    `loss` says how many, and the file stays readable.

    Rows of several blocks may come in batches, of one block after another. A chunk ends before a batch that
    is later than all rows that wait, so that chunks follow each other in time.
    """

    def __init__(
        self,
        path: str | Path,
        blocks: Sequence[RecordedBlock],
        metadata: Mapping[str, str],
        synced: bool = False,
    ) -> None:
        """Begin a file in place of any older one; `metadata["diagram"]` is the text of the resolved diagram.

        `metadata["files"]`, if it is there, has the SHA-256 of files by name, as JSON.
        RunError if this beginning cannot be written. ``synced`` is that of `Sink`.
        """
        definitions = [message_definition(block) for block in blocks]
        self.path = Path(path)
        self._blocks = tuple(blocks)
        self._sizes = [block.size for block in blocks]
        self._closed = False
        self._patience = PATIENCE
        self._waiting: dict[int, Rows] = {}  # by block
        self._pending = 0  # bytes of the messages that wait
        self._latest = 0  # stamp (ns) of the latest row
        self._sink = Sink(open_output(self.path, LOG), synced)
        facts = dict(metadata)
        self._file = McapWriter(self._sink, "ros2", f"quadvis {facts.get('quadvis', '')}".strip())
        self._file.add_attachment(DIAGRAM, "application/yaml", facts.pop("diagram", "").encode())
        files = facts.pop("files", "")
        if files:
            self._file.add_attachment(FILES, "application/json", files.encode())
        self._file.add_metadata(METADATA, {"format": FORMAT, **facts})
        names = message_names(block.path for block in blocks)
        self._ids = list(map(self._describe, blocks, names, definitions))
        self._sink.hand_on()
        self._due = monotonic() + FLUSH
        self._sink.drain()
        if self._sink.failure:
            raise RunError(self._refusal)

    def _describe(self, block: RecordedBlock, name: str, definition: str) -> int:
        described = {**channel_facts(block), **({HIDDEN: "true"} if block.hidden else {})}
        return self._file.add_channel(block.path, PACKAGE + name, definition, described)

    def write(self, block: int, time: int, row: Buffer) -> None:
        """Write one row: the outputs of `blocks[block]` at `time` (ns of the run) as in memory."""
        self._check(block, len(row))
        if self._takes(1, time):
            self._rows(block).append(time, row)
            self._pending += self._sizes[block] + AROUND
            self._latest = time

    def write_rows(self, block: int, times: NDArray[np.int64], rows: Slots) -> None:
        """Write N rows (N, slots); `times` (ns) has one entry for each, in ascending order."""
        if len(times) != len(rows):
            raise ValueError(f"{len(times)} times for {len(rows)} rows of block {block}")
        self._check(block, SLOT * rows.shape[1])
        if len(rows) and self._takes(len(rows), int(times[0])):
            self._rows(block).extend(times, rows)
            self._pending += (self._sizes[block] + AROUND) * len(rows)
            self._latest = max(self._latest, int(times[-1]))

    def write_change(self, tick: int, path: str, name: str, value: Any) -> None:
        """Write that a parameter of a block took a value, as a diagram gives it, before a tick."""
        given = value.tolist() if isinstance(value, np.ndarray) else value
        entries = {"tick": str(tick), "block": path, "parameter": name, "value": json.dumps(given)}
        self._file.add_metadata(CHANGES, entries)
        self._sink.hand_on()

    def _check(self, block: int, size: int) -> None:
        if size != self._sizes[block]:
            raise ValueError(f"a row of block {block} has {self._sizes[block]} bytes, not {size}")

    def _takes(self, count: int, first: int) -> bool:
        """Return whether rows from a stamp (ns) on can be taken; end the chunk if this is due."""
        if self._sink.full and not self._has_room():
            self._sink.lose(count, first)
            return False
        if first >= self._latest and (self._pending >= CHUNK or monotonic() >= self._due):
            self.flush()
        return True

    def _has_room(self) -> bool:
        """Return whether more rows can be taken; wait for room as long as patience is left."""
        if not self._sink.failure and self._patience > 0:
            self._patience -= self._sink.wait_for_room(self._patience)
        return not self._sink.full

    def _rows(self, block: int) -> Rows:
        """Return where the rows of a block wait."""
        if block not in self._waiting:
            self._waiting[block] = Rows(self._blocks[block])
        return self._waiting[block]

    def flush(self) -> None:
        """Hand all rows on, so that they survive the end of this process from a moment later on."""
        if self._waiting:
            rows = [
                ChannelRows(self._ids[block], *self._waiting[block].arrays())
                for block in sorted(self._waiting)
            ]
            for chunk in message_chunks(rows, self._file.head, LARGEST):
                self._file.add_chunk(chunk)
                self._sink.hand_on(chunk.count, chunk.first)
            self._waiting.clear()
            self._pending = 0
        self._due = monotonic() + FLUSH

    def flush_late(self) -> None:
        """Hand all rows on if some may have waited for `FLUSH`."""
        if monotonic() >= self._due:
            self.flush()

    def close(self, summary: Mapping[str, str] | None = None) -> None:
        """End the file with the outcome of the run and a note of lost rows; a second call does nothing."""
        if self._closed:
            return
        self._closed = True
        self.flush()
        self._sink.drain()
        lost = {"lost": self.loss} if self.loss else {}
        self._file.add_metadata(SUMMARY, {**(summary or {}), **lost})
        self._file.end()
        self._sink.hand_on()
        self._sink.close()

    @property
    def size(self) -> int:
        """The bytes of the file once all rows are in it that have been taken so far, without its end."""
        return self._sink.tell() + self._pending

    @property
    def lost(self) -> int:
        """The number of rows that were left out so far."""
        return self._sink.lost

    @property
    def loss(self) -> str:
        """A sentence about the rows that the log lacks; "" if it is complete. It is known after `close`."""
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
        return f"it lacks {counted(count, 'row')}, the first of t = {first / 1e9:.9g} s"

    def __enter__(self) -> Self:
        """Return the writer itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file; its summary names the error that stopped the run, the error notes what is lost."""
        self.close({"stopped": str(error) or type(error).__name__} if error else None)
        if error and self.loss:
            error.add_note(self.loss)


def ports_of(metadata: Mapping[str, str]) -> dict[str, str]:
    """Return the sources of the ports of parts from the facts of a run; {} if they are damaged."""
    try:
        found = json.loads(metadata.get(PORTS, "{}"))
    except ValueError:
        return {}
    return {str(port): str(source) for port, source in found.items()} if isinstance(found, dict) else {}


def channel_facts(block: RecordedBlock) -> dict[str, str]:
    """Return what a channel says of its block: its ports as JSON, and its rate."""
    fields = json.dumps([[port.name, port.type, port.shape, port.unit] for port in block.ports])
    return {"fields": fields, "rate": block.rate}


def message_definition(block: RecordedBlock) -> str:
    """Return the `ros2msg` definition of a row: bools travel as int64, arrays flat in C order."""
    if not block.size:
        raise ValueError(f"'{block.path}' has no outputs to log")
    names = field_names(block.ports)
    lines = []
    for port, name in zip(block.ports, names, strict=True):
        size = f"[{port.size}]" if port.shape else ""
        shape = f", {' x '.join(map(str, port.shape))} row by row" if len(port.shape) > 1 else ""
        note = "0 or 1" if port.type == "bool" else port.unit
        if port.size:
            kind = "float64" if port.type == "float64" else "int64"
            lines.append(f"{kind}{size} {name}  # {note}{shape}\n")
    return "".join(lines)


def message_names(paths: Iterable[str]) -> list[str]:
    """Return names that ROS accepts for messages: "/vision/detector" becomes "VisionDetector"."""
    words = (re.findall("[A-Za-z0-9]+", path) for path in paths)
    names = ("".join(word[:1].upper() + word[1:] for word in found) for found in words)
    return unique((name if name[:1].isalpha() else f"Block{name}" for name in names), "X")


def field_names(ports: Iterable[RecordedPort]) -> list[str]:
    """Return the names of the fields of a message with these ports."""
    return unique((_field_name(port.name) for port in ports), "_")


def _field_name(name: str) -> str:
    """Return a name that ROS accepts for a field: lower case, single underscores, a letter first."""
    plain = re.sub("[^a-z0-9]+", "_", name.lower()).strip("_")
    return plain if plain[:1].isalpha() else f"f_{plain}".rstrip("_")


def unique(names: Iterable[str], joint: str) -> list[str]:
    """Return the names, with a number added to each repeated name."""
    found: list[str] = []
    for name in names:
        numbered = (f"{name}{joint}{i}" if i > 1 else name for i in range(1, len(found) + 2))
        found.append(next(candidate for candidate in numbered if candidate not in found))
    return found
