"""The scopes of a target: rows come in, packages go out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from quadvis.engine.taps import Tap
from quadvis.errors import QuadvisError, counted
from quadvis.scopes import linked
from quadvis.scopes.file import ScopeFile
from quadvis.scopes.package import Package
from quadvis.scopes.properties import FILE, HOST, SCOPE, SIGNAL, TARGET
from quadvis.scopes.rows import BlockRows, Sampler, Ticks
from quadvis.scopes.scope import SignalScope, Take
from quadvis.scopes.settings import ScopeSettings
from quadvis.scopes.source import ScopePlan, ScopeSource
from quadvis.scopes.tap import ScopeTap

MOST = {HOST: 10, TARGET: 10, FILE: 8}  # scopes of a type, as in xPC Target
HIGHEST = 9999  # number of a scope


class ScopeBoard:
    """Holds scopes by their numbers, gives them rows, and hands their packages to ``take``.

    Rows of blocks come by ``feed``, in any pieces, and are used once ``settle`` says that all rows before a
    tick have come. Commands and settings have their effect from the first tick on that is not settled. So
    the packages depend on the rows and on the ticks of commands, and on nothing else. ``take`` is called in
    ``settle``, with packages of host and target scopes; those of file scopes go to files in ``folder``, with
    ``facts`` of the run for logs. A board is used by one thread at a time.
    """

    def __init__(
        self,
        source: ScopeSource,
        take: Take,
        folder: Path | None = None,
        facts: Mapping[str, str] = MappingProxyType({}),
    ) -> None:
        self.source = source
        self.settled = 0  # the first tick that is not settled
        self._take, self._folder, self._facts = take, folder, facts
        self._rows = {path: BlockRows() for path in source.blocks}
        self._scopes: dict[int, SignalScope] = {}
        self._samplers: dict[int, Sampler] = {}
        self._files: dict[int, ScopeFile] = {}

    def __getitem__(self, number: int) -> SignalScope:
        """Return a scope; QuadvisError if there is none with this number."""
        if number not in self._scopes:
            there = ", ".join(map(str, self._scopes)) or "none"
            raise QuadvisError(f"there is no scope {number}; there are: {there}")
        return self._scopes[number]

    def __iter__(self) -> Iterator[int]:
        return iter(self._scopes)

    def __len__(self) -> int:
        return len(self._scopes)

    def file(self, number: int) -> ScopeFile | None:
        """Return the files of a file scope since it was started last; None if it never was."""
        return self._files.get(self[number].number)

    def add(self, settings: ScopeSettings, number: int | None = None) -> int:
        """Add a scope, which is not started; return its number: the one given, or the lowest that is free."""
        there = Counter(scope.settings.Type for scope in self._scopes.values())
        most = MOST[settings.Type]
        if there[settings.Type] >= most:
            raise QuadvisError(
                f"there are {counted(most, f'{settings.Type} scope')} already; remove one first"
            )
        if number is None:
            number = next(each for each in range(1, HIGHEST + 1) if each not in self._scopes)
        if number in self._scopes:
            raise QuadvisError(f"there is a scope {number} already; choose another number, or remove it")
        if isinstance(number, bool) or not 1 <= number <= HIGHEST:
            raise QuadvisError(f"the number of a scope is from 1 to {HIGHEST}, not {number}")
        self._put(number, settings)
        return number

    def remove(self, number: int) -> None:
        """Stop a scope and forget it."""
        self.stop(number)
        del self._scopes[number], self._samplers[number]
        self._files.pop(number, None)
        linked.link(self._scopes)

    def set(self, number: int, changes: Mapping[str, Any]) -> None:
        """Change properties of a scope; QuadvisError if this is wrong, or not possible while it runs."""
        scope = self[number]
        settings = scope.settings.changed(changes, scope.running, f"scope {number}")
        if scope.running:
            scope.settings = settings
        else:
            self._put(number, settings)

    def start(self, number: int) -> None:
        """Start a scope: with the next row it acquires, or waits for its trigger. A running one goes on."""
        scope = self[number]
        settings = scope.settings
        if scope.running:
            return
        settings.check_start(f"scope {number}", len(scope.plan.traces))
        if settings.TriggerMode == SCOPE and settings.TriggerScope not in self._scopes:
            raise QuadvisError(f"scope {number} waits for scope {settings.TriggerScope}, which is not there")
        if settings.TriggerMode == SCOPE and settings.TriggerScope == number:
            raise QuadvisError(f"scope {number} waits for itself; give another TriggerScope")
        if settings.Type == FILE:
            if self._folder is None:
                raise QuadvisError(f"scope {number} has no folder for its files; use a host scope")
            self._close_file(number)
            self._files[number] = ScopeFile(scope, self._folder, self._facts)
        scope.start()

    def stop(self, number: int) -> None:
        """Stop a scope; it is Interrupted then."""
        self[number].stop()
        self._close_file(number)

    def trigger(self, number: int) -> None:
        """Trigger a scope that waits for it, whatever it waits for besides."""
        self[number].trigger()

    def taps(self) -> list[Tap]:
        """Return a tap for each block, which gives its rows to this board."""
        return [ScopeTap(path, self.feed) for path in self._rows]

    def feed(self, block: str, ticks: Ticks, rows: Ticks) -> None:
        """Take rows (N, slots) of a block at N ticks, which are the board's own from now on.

        ValueError if they are in no ascending order or come after their ticks have been settled.
        """
        self._rows[block].feed(ticks, rows, self.settled)

    def settle(self, tick: int) -> None:
        """Use all rows before a tick: none of them is missing any more, but those that do not exist."""
        if tick <= self.settled:
            return
        self.settled = tick
        found = {path: rows.settle(tick) for path, rows in self._rows.items()}
        settled = {path: rows for path, rows in found.items() if rows is not None}
        active = [scope for scope in self._scopes.values() if scope.active]
        for scope in active:
            scope.open(*self._samplers[scope.number].take(settled))
        linked.run(active)
        for number, file in self._files.items():
            if file.full and self._scopes[number].running:
                self._scopes[number].finish()
            if not self._scopes[number].running:
                file.close()

    def begin(self) -> None:
        """Forget all rows, for a run that begins at tick 0; running scopes begin anew."""
        running = [number for number, scope in self._scopes.items() if scope.running]
        self.end()
        self.settled = 0
        self._rows = {path: BlockRows() for path in self.source.blocks}
        for number in running:
            self.start(number)

    def end(self) -> None:
        """Stop all scopes and close their files."""
        for number in self._scopes:
            self.stop(number)

    def _put(self, number: int, settings: ScopeSettings) -> None:
        """Give a scope that does not run its settings."""
        plan = self._plan(settings)
        scope = SignalScope(number, settings, plan, self.source.tick, self._receive)
        old = self._scopes.get(number)
        if old is not None:
            scope.follow(old)
        self._scopes[number], self._samplers[number] = scope, Sampler(plan)
        linked.link(self._scopes)

    def _plan(self, settings: ScopeSettings) -> ScopePlan:
        trigger = settings.TriggerSignal if settings.TriggerMode == SIGNAL else ""
        return self.source.plan(settings.Signals, trigger)

    def _receive(self, package: Package) -> None:
        file = self._files.get(package.scope)
        if file is None:
            self._take(package)
        else:
            file.write(package)

    def _close_file(self, number: int) -> None:
        if number in self._files:
            self._files[number].close()
