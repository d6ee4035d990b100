"""Reads the log of a run, also one that was killed while it was written."""

from __future__ import annotations

import json
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from quadvis.errors import QuadvisError
from quadvis.files import reason
from quadvis.output.log import CDR, DIAGRAM, METADATA, SLOT_TYPES, SUMMARY, Channel, Field, Recording

if TYPE_CHECKING:
    from mcap.records import McapRecord


class Log(Recording):
    """A recording that was read from a file.

    `diagram` is the resolved diagram's text, `metadata` the facts of the run, `summary` its outcome;
    `complete` is False where the run was killed or the file is damaged.
    """

    def __init__(self, path: Path) -> None:
        """Begin a log without anything in it; `read_log` fills it."""
        super().__init__()
        self.path = path
        self.diagram = ""
        self.metadata: dict[str, str] = {}
        self.summary: dict[str, str] = {}
        self.complete = False
        self._ids: dict[int, int] = {}

    def _take(self, record: McapRecord) -> None:
        """Keep what belongs to a log; what another tool has added is passed over."""
        from mcap import records

        if isinstance(record, records.Message):
            index = self._ids.get(record.channel_id)
            if index is not None and len(record.data) == len(CDR) + self.channels[index].size:
                self.append(index, record.log_time, record.data[len(CDR) :])
        elif isinstance(record, records.Channel):
            if "fields" in record.metadata and record.id not in self._ids:
                self._ids[record.id] = len(self.channels)
                self.add(_channel(record.topic, record.metadata))
        elif isinstance(record, records.Attachment) and record.name == DIAGRAM:
            self.diagram = record.data.decode(errors="replace")
        elif isinstance(record, records.Metadata) and record.name == METADATA:
            self.metadata = record.metadata
        elif isinstance(record, records.Metadata) and record.name == SUMMARY:
            self.summary = record.metadata


def read_log(path: str | Path) -> Log:
    """Read a log, also one whose run was killed; raise `QuadvisError` if the file is none."""
    from mcap.exceptions import InvalidMagic
    from mcap.stream_reader import StreamReader

    log = Log(Path(path))
    try:
        data = log.path.read_bytes()
    except OSError as error:
        raise QuadvisError(f"cannot read the log '{path}': {reason(error)}") from error
    if not data:
        raise QuadvisError(f"'{path}' is empty; its run ended before anything was written")
    try:
        for record in StreamReader(BytesIO(data), validate_crcs=True).records:
            log._take(record)
        log.complete = True
    except QuadvisError:
        raise
    except Exception as error:
        # A run that was killed, or damage, which the reader meets with whatever Python raises.
        if isinstance(error, InvalidMagic) and not log.metadata:
            raise QuadvisError(f"'{path}' is not a log; give a file written by 'quadvis run'") from error
    if not log.metadata:
        raise QuadvisError(f"'{path}' was not written by quadvis; give a file written by 'quadvis run'")
    return log


def _channel(path: str, metadata: Mapping[str, str]) -> Channel:
    """Return the channel that was described when the log was written."""
    try:
        parts = json.loads(metadata["fields"])
        fields = tuple(Field(str(name), kind, tuple(shape), str(unit)) for name, kind, shape, unit in parts)
        sizes = [size for field in fields for size in field.shape]
        if all(field.type in SLOT_TYPES for field in fields) and all(0 <= size < 1 << 24 for size in sizes):
            return Channel(path, fields, metadata.get("rate", ""))
    except (ValueError, TypeError, LookupError):
        pass
    raise QuadvisError(f"the log describes its topic '{path}' in a way that this quadvis does not know")
