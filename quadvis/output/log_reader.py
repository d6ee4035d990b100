"""Reads the log of a run, also one that was cut short, damaged, or changed by others."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from pathlib import Path

from quadvis.errors import QuadvisError, quoted
from quadvis.machine.inputs import read_input
from quadvis.output import mcap_records as mcap
from quadvis.output.log import CDR, DIAGRAM, METADATA, SUMMARY, ports_of
from quadvis.output.recording import SLOT_TYPES, Channel, Field, Recording

MOST_SLOTS, MOST_AXES = 1 << 20, 32  # of one block, of one output
LONGEST_DIAGRAM = 1 << 24  # bytes
FIRST = 1 << 20  # bytes in which the facts of a run stand
READ = "give a file written by 'quadvis run'"


class Log(Recording):
    """A recording that was read from a file.

    `diagram` is the resolved diagram's text, `metadata` the facts of the run, `summary` its outcome.
    `complete` is False where the run was killed, the file is damaged, or the diagram is not the one that ran;
    then `damage` is a sentence about it. `end` is the time (s) of the last row, None without rows.
    """

    def __init__(self, path: Path) -> None:
        """Begin a log without anything in it; `read_log` fills it."""
        super().__init__()
        self.path = path
        self.diagram = ""
        self.metadata: dict[str, str] = {}
        self.summary: dict[str, str] = {}
        self.damage = ""
        self.end: float | None = None
        self._ids: dict[int, int] = {}
        self._early: dict[int, list[tuple[int, bytes]]] = {}  # rows that nothing describes so far

    @property
    def complete(self) -> bool:
        """True if all that was logged is here as it was written."""
        return not self.damage

    def _take(self, record: mcap.Record) -> None:
        """Keep what belongs to a log; what another tool has added is passed over."""
        if isinstance(record, mcap.Message):
            if record.channel in self._ids:
                self._row(record.channel, record.time, record.data)
            elif len(record.data) > len(CDR):
                self._early.setdefault(record.channel, []).append((record.time, record.data))
        elif isinstance(record, mcap.Channel):
            if "fields" in record.entries and record.number not in self._ids:
                self._ids[record.number] = len(self.channels)
                self.add(_channel(record.topic, record.entries))
                for time, data in self._early.pop(record.number, []):
                    self._row(record.number, time, data)
        elif isinstance(record, mcap.Attachment):
            if record.name == DIAGRAM:
                self.diagram = record.data[:LONGEST_DIAGRAM].decode(errors="replace")
        elif record.name == METADATA:
            self.metadata = record.entries
            self.ports = ports_of(record.entries)
        elif record.name == SUMMARY:
            self.summary = record.entries

    def _row(self, number: int, time: int, data: bytes) -> None:
        index = self._ids[number]
        if len(data) == len(CDR) + self.channels[index].size:
            self.append(index, time, data[len(CDR) :])
            self.end = max(time / 1e9, self.end or 0.0)

    def _judge(self, scan: mcap.Scan) -> None:
        """Say what is not as it was written."""
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
    """Read a log, also one that is cut or damaged (`Log.damage`); `QuadvisError` if the file is none."""
    log = Log(Path(path))
    data = read_input(path, None, "the log")
    if not data:
        raise QuadvisError(f"'{path}' is empty; its run ended before anything was written")
    if len(data) >= len(mcap.MAGIC) and not data.startswith(mcap.MAGIC):
        raise QuadvisError(f"'{path}' is not a log; {READ}")
    scan = mcap.Scan(data)
    for record in scan.records():
        log._take(record)
    if not log.metadata:
        raise QuadvisError(f"'{path}' was not written by quadvis; {READ}")
    log._judge(scan)
    return log


def log_facts(path: str | Path) -> dict[str, str]:
    """Return what the beginning of a log says of its run; nothing if it is no log, or has just begun."""
    try:
        with open(path, "rb") as file:
            data = file.read(FIRST)
    except OSError:
        return {}
    records = mcap.Scan(data).records() if data.startswith(mcap.MAGIC) else iter(())
    facts = (record for record in records if isinstance(record, mcap.Metadata) and record.name == METADATA)
    return next((record.entries for record in facts), {})


def _channel(path: str, described: Mapping[str, str]) -> Channel:
    """Return the channel that was described when the log was written."""
    try:
        parts = json.loads(described["fields"])
        fields = tuple(Field(str(name), kind, tuple(shape), str(unit)) for name, kind, shape, unit in parts)
        "".join([path, *(text for field in fields for text in (field.name, field.unit))]).encode()
        sizes = [size for field in fields for size in field.shape]
        known = all(type(size) is int and 1 <= size <= MOST_SLOTS for size in sizes)
        flat = all(len(field.shape) <= MOST_AXES for field in fields)
        if known and flat and fields and all(field.type in SLOT_TYPES for field in fields):
            channel = Channel(path, fields, described.get("rate", ""))
            if sum(math.prod(field.shape) for field in fields) <= MOST_SLOTS:
                return channel
    except (ValueError, TypeError, LookupError, RecursionError):
        pass
    raise QuadvisError(f"the log describes its topic {quoted(path)} in a way that this quadvis does not know")
