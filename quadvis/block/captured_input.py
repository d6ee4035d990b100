"""A device that a process of its own reads, since the calls of its driver may block: a camera, for example.

The block says what is to be captured. A real-time run starts the process before its first step, waits for
the first record, and gives the block a `RecordSource`. A step then takes the newest record and never waits.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple, Protocol

from quadvis.block.declare import Out
from quadvis.block.device import Device
from quadvis.machine.capture import ENDED, OPENING, UNLIKE, CaptureRequest
from quadvis.machine.ports import PortError

LOST = (OPENING, UNLIKE, ENDED)  # the status of a device of which nothing that counts comes


class SourceRecord(NamedTuple):
    """A record: its stamp (s, run time), its number, its bytes."""

    stamp: float
    number: int
    payload: memoryview


class RecordSource(Protocol):
    """A capture that has begun, as the block sees it."""

    status: int
    refused: int
    text: str

    def newest(self, time: float, after: float) -> SourceRecord | None:
        """Return the newest record with ``after`` < stamp < ``time`` (s); None if there is none."""


class NoRecords:
    """What the block has outside real-time runs: nothing comes."""

    status, refused, text = OPENING, 0, ""

    def newest(self, time: float, after: float) -> SourceRecord | None:
        """Return None."""
        return None


class CapturedInput(Device):
    """A device that gives values: ``values`` makes them of a record that a process of its own has captured.

    Before the first record they are those of ``nothing``. A device that is lost lets the age grow, and is
    opened again when it is back; if it is not back at the end, or does not keep its settings, the run ends
    with an error.
    """

    not_replayable = "a process of its own reads a device"
    not_restorable = "a process of its own reads a device"

    fresh = Out("bool", doc="whether the newest record is new at this step")
    age = Out(unit="s", nan=True, doc="time since the stamp of the newest record; NaN before the first one")
    lost = Out("int64", doc="records that no step saw, since newer ones came with them")
    refused = Out("int64", doc="records that are not as they must be")
    status = Out(
        "int64",
        doc="0: records come; 1: the device is being opened, again after a loss; 2: the newest record was "
        "refused; 3: a setting no longer holds; 4: the process has ended",
    )

    source: RecordSource = NoRecords()  # what a real-time run gives to its own block

    def capture(self) -> CaptureRequest:
        """Return what is to be captured."""
        raise NotImplementedError

    def values(self, record: SourceRecord) -> tuple[Any, ...]:
        """Return the values of the block's own outputs, in their order."""
        raise NotImplementedError

    def nothing(self) -> tuple[Any, ...]:
        """Return these values before the first record."""
        raise NotImplementedError

    def open(self) -> None:
        """Begin without a record."""
        self._newest, self._stamp, self._number = self.nothing(), math.nan, 0
        self._fresh, self._lost, self._age = False, 0, math.nan

    def read(self, time: float) -> None:
        """Take the newest record, if there is a new one since the run began."""
        found = self.source.newest(time, 0.0 if math.isnan(self._stamp) else self._stamp)
        self._fresh = found is not None
        if found is not None:
            self._lost += max(0, found.number - self._number - 1) if self._number else 0
            self._newest, self._stamp, self._number = self.values(found), found.stamp, found.number
        self._age = time - self._stamp

    def output(self) -> Any:
        """Return the state of the device and the values of the newest record."""
        counts = self._lost, self.source.refused, self.source.status
        return self._fresh, self._age, *counts, *self._newest

    def close(self) -> None:
        """End; PortError if the device is not there at the end, or does not keep its settings."""
        source = self.source
        if not isinstance(source, NoRecords) and source.status in LOST:
            raise PortError(source.text or "the process that captures has ended")
