"""A scope of a target as its host sees it: xPC's scope object."""

from __future__ import annotations

import queue
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import QuadvisError, sentence
from quadvis.scopes.package import Package

if TYPE_CHECKING:
    from quadvis.host.connection import HostConnection

FINISHED = "Finished"
POLL = 0.05  # s between two questions for the status
ROWS = 5_000  # samples in one message
WAITING = 1000  # packages that wait here until they are taken
NEWER = 20  # packages that may take the place of the one that is being fetched


def read_package(header: Mapping[str, Any], array: Any) -> Package:
    """Return a package from what the target says of it and its rows (N, 1 + k): a time (s) and k values."""
    rows = np.asarray(array, np.float64)
    ticks = np.rint(rows[:, 0] / header["tick"]).astype(np.int64)
    return Package(
        int(header["scope"]), int(header["sequence"]), ticks, rows[:, 0], rows[:, 1:],
        tuple(header["names"]), tuple(header["units"]), header["trigger"], int(header["lost"]),
    )  # fmt: skip


class HostScope:
    """A scope. Its properties are xPC's: ``sc.NumSamples``, ``sc.TriggerMode``, ``sc.Status``, and so on.

    ``sc.Data`` (N, k) and ``sc.Time`` (N,) in s are those of the newest whole package. Setting a property of
    a scope that acquires needs `stop` first, where xPC needs it.
    """

    _connection: HostConnection
    _number: int

    def __init__(self, connection: HostConnection, number: int) -> None:
        self.__dict__["_connection"], self.__dict__["_number"] = connection, number

    @property
    def number(self) -> int:
        """Its number, xPC's ScopeId."""
        return self._number

    def facts(self) -> dict[str, Any]:
        """Return all properties at one moment."""
        for each in self._connection.request("scopes"):
            if each["id"] == self._number:
                return dict(each)
        raise QuadvisError(f"there is no scope {self._number} on {self._connection.name}")

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        found = self.facts()
        if name in found:
            return found[name]
        raise AttributeError(f"a scope has no '{name}'; it has {', '.join(found)}")

    def __setattr__(self, name: str, value: Any) -> None:
        self.set(**{name: value})

    def set(self, **properties: Any) -> None:
        """Set several properties at once; all of them hold or none."""
        given = {name: value for name, value in properties.items() if name != "signals" or value}
        if signals := given.get("signals"):
            given["signals"] = [signals] if isinstance(signals, str) else list(signals)
        if given:
            self._connection.operate("setscope", id=self._number, values=given)

    def start(self) -> HostScope:
        """Let it acquire, or wait for its trigger."""
        self._connection.operate("startscope", ids=[self._number])
        return self

    def stop(self) -> HostScope:
        """Interrupt it."""
        self._connection.operate("stopscope", ids=[self._number])
        return self

    def trigger(self) -> HostScope:
        """Trigger it by software."""
        self._connection.operate("trigger", ids=[self._number])
        return self

    def remove(self) -> None:
        """Remove it from the target."""
        self._connection.operate("remscope", ids=[self._number])

    def wait(self, timeout: float = 10.0) -> HostScope:
        """Wait until it is finished; QuadvisError after a time (s)."""
        until = time.monotonic() + timeout
        while self.facts()["Status"] != FINISHED:
            if time.monotonic() > until:
                raise QuadvisError(f"scope {self._number} is not finished after {timeout:g} s")
            time.sleep(POLL)
        return self

    @property
    def package(self) -> Package:
        """The newest whole package; QuadvisError if there is none yet, or if newer ones come all the time."""
        pieces: list[NDArray[np.float64]] = []
        sequence, newer = None, 0
        while newer < NEWER:
            first = sum(map(len, pieces))
            found = self._connection.request("getscope", id=self._number, first=first, count=ROWS)
            if pieces and found["sequence"] != sequence:
                pieces, newer = [], newer + 1
                continue
            sequence = found["sequence"]
            rows = np.asarray(found["samples"], np.float64).reshape(-1, 1 + len(found["names"]))
            pieces.append(rows)
            if first + len(rows) >= found["count"] or not len(rows):
                return read_package(found, np.concatenate(pieces))
        problem = f"scope {self._number} has newer packages before one of them has come whole"
        raise QuadvisError(sentence(problem, "take them as they come, by 'packages'"))

    @property
    def Data(self) -> NDArray[np.float64]:
        """The values (N, k) of the newest whole package."""
        return self.package.samples

    @property
    def Time(self) -> NDArray[np.float64]:
        """Its times (N,) in s."""
        return self.package.times

    def packages(self, timeout: float = 10.0) -> Iterator[Package]:
        """Yield the packages as they come; ends after a time (s) without one.

        For who is slow the newest `WAITING` packages wait; their numbers, `Package.sequence`, show the gap.
        """
        found: queue.Queue[Package] = queue.Queue(WAITING)
        topic = f"scope/{self._number}"
        parts: list[Any] = []
        sequence: list[int] = []  # that of the package of which there are parts

        def take(header: Mapping[str, Any], array: Any) -> None:
            if header["part"] == 0 or sequence != [header["sequence"]]:
                parts.clear()
                sequence[:] = [header["sequence"]]
            parts.append(array)
            if header["part"] == header["parts"] - 1 and len(parts) == header["parts"]:
                if found.full():
                    with suppress(queue.Empty):
                        found.get_nowait()
                found.put_nowait(read_package(header, np.concatenate(parts)))

        self._connection.subscribe(topic, take)
        try:
            while True:
                try:
                    yield found.get(timeout=timeout)
                except queue.Empty:
                    return
        finally:
            self._connection.unsubscribe(topic)

    def __repr__(self) -> str:
        found = self.facts()
        return f"<Scope {self._number}: {found['Type']}, {found['Status']}, {', '.join(found['Signals'])}>"
