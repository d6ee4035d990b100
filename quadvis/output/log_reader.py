"""Read the log of a run, even if it was cut short, damaged, or changed by other tools."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import QuadvisError, quoted
from quadvis.machine.inputs import read_input
from quadvis.output import mcap_records as mcap
from quadvis.output.log import CHANGES, DIAGRAM, FILES, HIDDEN, METADATA, SUMMARY, ports_of
from quadvis.output.mcap_messages import CDR
from quadvis.output.recording import SLOT_TYPES, TASK_TIMES, RecordedBlock, RecordedPort, Recording

MOST_SLOTS, MOST_AXES = 1 << 20, 32  # of one block, of one output
LONGEST_DIAGRAM = 1 << 24  # bytes
FIRST = 1 << 20  # bytes at the beginning of a file that contain the facts of a run
READ = "give a file written by 'quadvis run'"


class Log(Recording):
    """A recording read from a file.

    `diagram` is the resolved diagram's text, `metadata` the facts of the run, `summary` its outcome.
    `complete` is False if the run was killed, if the file is damaged, or if the diagram is not the one that
    ran; then `damage` says so in a sentence. `end` is the time (s) of the last row, None without rows.
    `hidden` are the rows that only a replay needs. `task_times` are the times of tasks in a real-time run,
    such as "_times/target/control.lateness": to be had by their names, but not listed among the signals.
    `changes` are the facts of parameters that were tuned, `files` the SHA-256 of the files that blocks read
    while they ran, by name.
    """

    def __init__(self, path: Path) -> None:
        """Begin an empty log; `read_log` fills it."""
        super().__init__()
        self.path = path
        self.diagram = ""
        self.metadata: dict[str, str] = {}
        self.summary: dict[str, str] = {}
        self.hidden, self.task_times = Recording(), Recording()
        self.changes: list[dict[str, str]] = []
        self.files: dict[str, str] = {}
        self.damage = ""
        self.end: float | None = None
        self._ids: dict[int, tuple[Recording, int]] = {}  # the recording of a channel, and the block in it
        self._early: dict[int, list[tuple[int, bytes]]] = {}  # rows whose block has not been described yet

    @property
    def complete(self) -> bool:
        """True if all rows and facts are present as they were written."""
        return not self.damage

    def _take(self, record: mcap.Record) -> None:
        """Keep a record of a log; ignore records that other tools have added."""
        if isinstance(record, mcap.MessageRecord):
            if record.channel in self._ids:
                self._row(record.channel, record.time, record.data)
            elif len(record.data) > len(CDR):
                self._early.setdefault(record.channel, []).append((record.time, record.data))
        elif isinstance(record, mcap.ChannelRecord):
            if "fields" in record.entries and record.number not in self._ids:
                block = _block(record.topic, record.entries)
                recording = self._recording(block)
                self._ids[record.number] = recording, len(recording.blocks)
                recording.add(block)
                for time, data in self._early.pop(record.number, []):
                    self._row(record.number, time, data)
        elif isinstance(record, mcap.AttachmentRecord):
            if record.name == DIAGRAM:
                self.diagram = record.data[:LONGEST_DIAGRAM].decode(errors="replace")
            elif record.name == FILES:
                self.files = _texts(record.data)
        elif not isinstance(record, mcap.MetadataRecord):
            return
        elif record.name == METADATA:
            self.metadata = record.entries
            self.ports = ports_of(record.entries)
        elif record.name == SUMMARY:
            self.summary = record.entries
        elif record.name == CHANGES:
            self.changes.append(record.entries)

    def _recording(self, block: RecordedBlock) -> Recording:
        """Return where the rows of a block belong."""
        if not block.hidden:
            return self
        return self.task_times if _is_time(block.path.strip("/")) else self.hidden

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return a signal of N rows, or the N times of a task: shape (N, *shape of the port)."""
        return self.task_times[name] if _is_time(name) else super().__getitem__(name)

    def stamps(self, name: str) -> NDArray[np.int64]:
        """Return the stamps (ns) of its N rows."""
        return self.task_times.stamps(name) if _is_time(name) else super().stamps(name)

    def port(self, name: str) -> RecordedPort:
        """Return its type, shape and unit."""
        return self.task_times.port(name) if _is_time(name) else super().port(name)

    def rate(self, name: str) -> str:
        """Return the name of its rate; "" if it is not known."""
        return self.task_times.rate(name) if _is_time(name) else super().rate(name)

    def __contains__(self, name: object) -> bool:
        return name in self.task_times if _is_time(str(name)) else super().__contains__(name)

    def _row(self, number: int, time: int, data: bytes) -> None:
        recording, index = self._ids[number]
        if len(data) == len(CDR) + recording.blocks[index].size:
            recording.append(index, time, data[len(CDR) :])
            self.end = max(time / 1e9, self.end or 0.0)

    def _judge(self, scan: mcap.RecordScan) -> None:
        """Describe the damage of the file, if any."""
        found = []
        if scan.damaged:
            found.append(f"is damaged in {scan.damaged} {'place' if scan.damaged == 1 else 'places'}")
        if not scan.ended:
            found.append("has a damaged index" if scan.whole else "is cut short")
        if found:
            until = "holds no row" if self.end is None else f"goes to {self.end:g} s"
            found.append(f"what is left of it {until}")
        digest = hashlib.sha256(self.diagram.encode(errors="replace")).hexdigest()
        if self.metadata.get("hash", digest) != digest:
            found.append("holds another diagram than the one that ran: its hash differs")
        if found:
            self.damage = f"the log '{self.path}' {'; '.join(found)}"


def read_log(path: str | Path) -> Log:
    """Read a log, even if it is cut or damaged (`Log.damage`); `QuadvisError` if the file is no log."""
    log = Log(Path(path))
    data = read_input(path, None, "the log")
    if not data:
        raise QuadvisError(f"'{path}' is empty; its run ended before anything was written")
    if len(data) >= len(mcap.MAGIC) and not data.startswith(mcap.MAGIC):
        raise QuadvisError(f"'{path}' is not a log; {READ}")
    scan = mcap.RecordScan(data)
    for record in scan.records():
        log._take(record)
    if not log.metadata:
        raise QuadvisError(f"'{path}' was not written by quadvis; {READ}")
    log._judge(scan)
    return log


def log_facts(path: str | Path) -> dict[str, str]:
    """Return the facts of a run from the beginning of its log; {} if it is no log, or has just begun."""
    try:
        with open(path, "rb") as file:
            data = file.read(FIRST)
    except OSError:
        return {}
    records = mcap.RecordScan(data).records() if data.startswith(mcap.MAGIC) else iter(())
    facts = (
        record for record in records if isinstance(record, mcap.MetadataRecord) and record.name == METADATA
    )
    return next((record.entries for record in facts), {})


def is_foreign(path: str | Path) -> bool:
    """Return whether an MCAP file begins as one of another program: with channels, and no fact of a run."""
    try:
        with open(path, "rb") as file:
            data = file.read(FIRST)
    except OSError:
        return False
    records = mcap.RecordScan(data).records() if data.startswith(mcap.MAGIC) else iter(())
    for record in records:
        if isinstance(record, mcap.AttachmentRecord | mcap.MetadataRecord) and record.name in (
            DIAGRAM,
            METADATA,
        ):
            return False
        if isinstance(record, mcap.ChannelRecord):
            return "fields" not in record.entries
    return False


def _is_time(name: str) -> bool:
    """Return whether a name is one of the times of tasks."""
    return name.startswith(f"{TASK_TIMES}/")


def _texts(data: bytes) -> dict[str, str]:
    """Return texts by name from JSON; {} if they are damaged."""
    try:
        found = json.loads(data)
    except (ValueError, RecursionError):
        return {}
    return {str(name): str(text) for name, text in found.items()} if isinstance(found, dict) else {}


def _block(path: str, described: Mapping[str, str]) -> RecordedBlock:
    """Return the block from its description in the log."""
    try:
        parts = json.loads(described["fields"])
        ports = tuple(
            RecordedPort(str(name), kind, tuple(shape), str(unit)) for name, kind, shape, unit in parts
        )
        "".join([path, *(text for port in ports for text in (port.name, port.unit))]).encode()
        sizes = [size for port in ports for size in port.shape]
        known = all(type(size) is int and 1 <= size <= MOST_SLOTS for size in sizes)
        flat = all(len(port.shape) <= MOST_AXES for port in ports)
        if known and flat and ports and all(port.type in SLOT_TYPES for port in ports):
            block = RecordedBlock(path, ports, described.get("rate", ""), HIDDEN in described)
            if sum(math.prod(port.shape) for port in ports) <= MOST_SLOTS:
                return block
    except (ValueError, TypeError, LookupError, RecursionError):
        pass
    raise QuadvisError(f"the log describes its topic {quoted(path)} in a way that this quadvis does not know")
