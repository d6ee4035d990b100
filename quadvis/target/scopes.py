"""The scopes of a loaded application: rows come from the session's thread, verbs from that of the wire."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadvis.diagram.diagram import Diagram
from quadvis.engine.taps import Tap
from quadvis.errors import QuadvisError
from quadvis.scopes.board import ScopeBoard
from quadvis.scopes.package import Package
from quadvis.scopes.properties import TARGET
from quadvis.scopes.settings import ScopeSettings
from quadvis.scopes.source import ScopeSource
from quadvis.scopes.tap import ScopeTap

PART = 30_000  # numbers in one message of a stream

Publish = Callable[[str, Mapping[str, Any], Any], None]


class ShownScope(NamedTuple):
    """A target scope with its newest package, for whoever shows it."""

    number: int
    status: str
    settings: ScopeSettings
    package: Package | None


class ApplicationScopes:
    """The scopes of an application. They stay when it is stopped and started again.

    ``settle`` is called by the session; the other methods by the thread of the wire. ``began()`` is the
    instant of tick 0 of the run (ns since 1970).
    """

    def __init__(
        self, diagram: Diagram, folder: Path, publish: Publish, began: Callable[[], int | None] = lambda: None
    ) -> None:
        self._publish, self._began = publish, began
        self._lock = threading.Lock()
        self._packages: dict[int, Package] = {}  # the newest of each scope
        self._tick = float(diagram.graph.tick)
        source = ScopeSource.of(diagram.graph, diagram.ports)
        self._board = ScopeBoard(source, self._take, folder)

    # by the session

    @property
    def taps(self) -> list[Tap]:
        """What takes the rows of all blocks."""
        return [ScopeTap(tap.block, self._feed) for tap in self._board.taps()]

    def begin(self) -> None:
        """Get ready for a run that begins at tick 0; scopes that acquire go on with it."""
        with self._lock:
            self._board.begin()

    def settle(self, tick: int) -> None:
        """Use all rows before a tick; none of them will come any more."""
        with self._lock:
            self._board.settle(tick)

    def end(self) -> None:
        """Interrupt all scopes, and close their files."""
        with self._lock:
            self._board.end()

    def _feed(self, block: str, ticks: NDArray[np.int64], rows: NDArray[np.int64]) -> None:
        with self._lock:
            self._board.feed(block, ticks, rows)

    def _take(self, package: Package) -> None:
        """Keep a package, and hand it to those who listen, in pieces."""
        self._packages[package.scope] = package
        array = np.column_stack((package.times, package.samples))
        rows = max(1, PART // array.shape[1])
        parts, began = -(-len(array) // rows), self._began()
        for part in range(parts):
            header = self._header(package) | {"began": began, "part": part, "parts": parts}
            self._publish(f"scope/{package.scope}", header, array[part * rows : (part + 1) * rows])

    # by the verbs

    def add(self, number: int | None, kind: str) -> int:
        """Add a scope; return its number."""
        with self._lock:
            return self._board.add(ScopeSettings(Type=kind), number)

    def remove(self, numbers: Sequence[int]) -> None:
        """Remove scopes; all of them must be there."""
        with self._lock:
            self._there(numbers)
            for number in numbers:
                self._board.remove(number)
                self._packages.pop(number, None)

    def set(self, number: int, values: Mapping[str, Any]) -> dict[str, Any]:
        """Set properties of a scope; return all of them."""
        with self._lock:
            self._board.set(number, values)
            return self._facts(number)

    def start(self, numbers: Sequence[int]) -> None:
        """Let scopes acquire."""
        with self._lock:
            self._there(numbers)
            for number in numbers:
                self._board.start(number)

    def stop(self, numbers: Sequence[int]) -> None:
        """Interrupt scopes."""
        with self._lock:
            self._there(numbers)
            for number in numbers:
                self._board.stop(number)

    def trigger(self, numbers: Sequence[int]) -> None:
        """Trigger scopes by software."""
        with self._lock:
            self._there(numbers)
            for number in numbers:
                self._board.trigger(number)

    def shown(self) -> list[ShownScope]:
        """Return all target scopes."""
        with self._lock:
            scopes = [(number, self._board[number]) for number in self._board]
            return [
                ShownScope(number, scope.status, scope.settings, self._packages.get(number))
                for number, scope in scopes
                if scope.settings.Type == TARGET
            ]

    def facts(self) -> list[dict[str, Any]]:
        """Return the properties of all scopes."""
        with self._lock:
            return [self._facts(number) for number in self._board]

    def samples(self, number: int, first: int, count: int) -> dict[str, Any]:
        """Return samples of the newest package: rows of a time (s) and the values of the traces."""
        with self._lock:
            self._there([number])
            package = self._packages.get(number)
        if package is None:
            raise QuadvisError(f"scope {number} has no samples yet")
        part = slice(first, first + count)
        rows = np.column_stack((package.times[part], package.samples[part]))
        return self._header(package) | {"count": len(package), "samples": rows.ravel().tolist()}

    def _there(self, numbers: Sequence[int]) -> None:
        for number in numbers:
            self._board[number]

    def _facts(self, number: int) -> dict[str, Any]:
        scope = self._board[number]
        found: dict[str, Any] = {"id": number, "Status": scope.status}
        found |= {field.name: getattr(scope.settings, field.name) for field in fields(scope.settings)}
        file = self._board.file(number)
        if file is not None:
            found |= {"Files": [path.name for path in file.paths], "Lost": file.lost, "Loss": file.loss}
        return found

    def _header(self, package: Package) -> dict[str, Any]:
        """Return what is to be said of a package beside its samples; ``tick`` is the base tick (s)."""
        return {
            "scope": package.scope, "sequence": package.sequence, "tick": self._tick,
            "names": list(package.names), "units": list(package.units), "trigger": package.trigger,
            "lost": package.lost,
        }  # fmt: skip
