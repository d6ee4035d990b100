"""Scopes in plain Python, sample by sample: slow, and written by the documented rules alone."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from quadvis.errors import QuadvisError
from quadvis.graph.graph import Task
from quadvis.output.recording import RecordedBlock, RecordedPort
from quadvis.scopes.board import ScopeBoard
from quadvis.scopes.package import Package
from quadvis.scopes.settings import ScopeSettings
from quadvis.scopes.source import ScopeSource

TICK = Fraction(1, 1000)
# Block: ports, period and offset in ticks.
BLOCKS = {
    "fast": ((RecordedPort("x"), RecordedPort("v", "float64", (2,), "m")), 1, 0),
    "mid": ((RecordedPort("n", "int64"),), 2, 1),
    "twin": ((RecordedPort("y", "float64", (), "V"),), 2, 1),
    "slow": ((RecordedPort("on", "bool"), RecordedPort("z")), 3, 0),
}


def source() -> ScopeSource:
    return ScopeSource(
        TICK,
        [
            (RecordedBlock(f"/{path}", ports), Task(f"every {period}", period * TICK, offset * TICK))
            for path, (ports, period, offset) in BLOCKS.items()
        ],
    )


class Command(NamedTuple):
    """What is done to a scope before a tick."""

    tick: int
    scope: int
    what: str  # start, stop, trigger


@dataclass
class World:
    """The rows of a run: by block, the values of each tick that ran. A row is a list of numbers."""

    rows: dict[str, dict[int, list[float]]]
    ticks: int

    def slots(self, block: str) -> tuple[np.ndarray, np.ndarray]:
        """Return the ticks (N,) and the rows (N, slots) as bits."""
        ports = BLOCKS[block][0]
        rows = np.zeros((len(self.rows[block]), sum(port.size for port in ports)), np.int64)
        for row, values in zip(rows, self.rows[block].values(), strict=True):
            start = 0
            for port in ports:
                part = np.array(values[start : start + port.size])
                row[start : start + port.size] = (
                    part.view(np.int64) if port.type == "float64" else part.astype(np.int64)
                )
                start += port.size
        return np.array(list(self.rows[block]), np.int64), rows


@dataclass
class ModelScope:
    """One scope, which keeps all its rows and decides at each of them."""

    number: int
    settings: ScopeSettings
    columns: list[tuple[str, int, str]]
    cause: tuple[str, int, str] | None
    grid: list[str]
    spacing: int
    state: str = "Interrupted"
    rows: list[tuple[int, list[float], float]] = field(default_factory=list)
    packages: list[tuple] = field(default_factory=list)
    ends: list[int] = field(default_factory=list)  # rows of the samples after the last ones
    begun: int = 0  # the first row since the start
    ready: int = 0
    forced: bool = False
    due: bool = False
    triggered: int = 0
    could: bool = False
    before: int | None = None  # the row of the last sample of a package that this one follows

    @property
    def shift(self) -> int:
        return 0 if self.settings.TriggerMode == "FreeRun" else self.settings.NumPrePostSamples

    def start(self) -> None:
        if self.state in ("waiting", "collecting"):
            return
        self.before = None
        self.begun = len(self.rows)
        self.arm(len(self.rows))
        if self.settings.TriggerMode == "FreeRun":
            self.state, self.triggered = "collecting", len(self.rows)

    def arm(self, row: int) -> None:
        self.state = "waiting"
        self.ready = row + max(0, -self.shift) * self.settings.Decimation
        self.forced = self.due = False

    def trigger(self) -> None:
        if self.state != "waiting":
            raise QuadvisError("no")
        self.forced = True

    def see(self, tick: int, values: list[float], level: float) -> list[int]:
        """Take a row; return the samples at which it triggers others."""
        row = len(self.rows)
        self.rows.append((tick, values, level))
        self.could = self.state == "waiting" and row >= self.ready
        if self.could and (self.forced or self.due or self.crosses(row)):
            return self.fire(row)
        found = self.after(row)
        if self.state == "collecting":
            found += self.sample(row)
        return found

    def caused(self, has_row: bool) -> list[int]:
        """Be triggered by another scope, now or at the next row; return what this triggers."""
        if has_row:
            if self.could:
                row = len(self.rows) - 1
                return self.fire(row, again=True)
        elif self.state == "waiting" and len(self.rows) >= self.ready:
            self.due = True
        return []

    def crosses(self, row: int) -> bool:
        if self.settings.TriggerMode != "Signal":
            return False
        if row == self.begun:
            return False
        level, old, new = self.settings.TriggerLevel, self.rows[row - 1][2], self.rows[row][2]
        up, down = old < level <= new, old > level >= new
        return {"Rising": up, "Falling": down, "Either": up or down}[self.settings.TriggerSlope]

    def fire(self, row: int, again: bool = False) -> list[int]:
        self.could = False
        found = [] if again else self.after(row)  # `see` has returned it already
        self.state, self.triggered = "collecting", row
        return found + self.sample(row)

    def after(self, row: int) -> list[int]:
        found = [-1 for end in self.ends if end == row]
        self.ends = [end for end in self.ends if end > row]
        return found

    def sample(self, row: int) -> list[int]:
        """Look at a row of a package."""
        step, count = self.settings.Decimation, self.settings.NumSamples
        number, rest = divmod(row - self.triggered, step)
        if rest or row < self.triggered:
            return []
        events = [number] if number <= count + self.shift - 1 else []
        last = self.triggered + (self.shift + count - 1) * step
        if row >= last:
            self.hand_on([last - back * step for back in range(count)][::-1])
            if last + step <= row:
                events.append(-1)
            else:
                self.ends.append(last + step)
            if not self.settings.restarts:
                self.state = "Finished"
            elif self.settings.TriggerMode == "FreeRun":
                self.triggered = last + step
                self.before = last
            else:
                self.arm(row + 1)
        return events

    def hand_on(self, rows: list[int]) -> None:
        first = rows[0] if self.before is None else self.before
        passed = range(self.rows[first][0], self.rows[rows[-1]][0] + 1, self.spacing)
        there = {tick for tick, _, _ in self.rows[first : rows[-1] + 1]}
        self.packages.append(
            (
                len(self.packages),
                [self.rows[row][0] for row in rows],
                [plain(self.rows[row][1]) for row in rows],
                None if self.settings.TriggerMode == "FreeRun" else -self.shift,
                sum(tick not in there for tick in passed),
            )
        )

    @property
    def status(self) -> str:
        if self.state == "waiting":
            return "Ready for being Triggered" if len(self.rows) >= self.ready else "Acquiring"
        return "Acquiring" if self.state == "collecting" else self.state


def model(world: World, settings: list[ScopeSettings], commands: list[Command]) -> list[ModelScope]:
    """Run scopes 1, 2, ... tick by tick."""
    there, scopes = source(), []
    for number, each in enumerate(settings, 1):
        plan = there.plan(each.Signals, each.TriggerSignal if each.TriggerMode == "Signal" else "")
        columns = [(trace.block, trace.slot, trace.type) for trace in plan.columns]
        fastest = min((BLOCKS[block][1], BLOCKS[block][2]) for block, _, _ in columns)
        grid = [block for block in {block for block, _, _ in columns} if BLOCKS[block][1:] == fastest]
        cause = columns.pop() if plan.trigger else None
        scopes.append(ModelScope(number, each, columns, cause, grid, fastest[0]))
    newest: dict[str, list[float]] = {}
    for tick in range(world.ticks + 1):
        for command in commands:
            if command.tick == tick:
                obey(scopes[command.scope - 1], command.what)
        if tick == world.ticks:
            break
        for block, rows in world.rows.items():
            if tick in rows:
                newest[block] = rows[tick]
        seen = [each for each in scopes if any(tick in world.rows[block] for block in each.grid)]
        queue = []
        for each in seen:
            if each.state in ("waiting", "collecting") or each.ends:
                values = [value(newest, *place) for place in each.columns]
                level = value(newest, *each.cause) if each.cause else math.nan
                queue += [(each.number, event) for event in each.see(tick, values, level)]
        while queue:
            number, event = queue.pop(0)
            for each in scopes:
                waits = each.settings.TriggerMode == "Scope" and each.settings.TriggerScope == number
                if waits and each.settings.TriggerSample == event:
                    queue += [(each.number, other) for other in each.caused(each in seen)]
    return scopes


def obey(scope: ModelScope, what: str) -> None:
    if what == "start":
        scope.start()
    elif what == "stop":
        scope.state, scope.ends, scope.could = "Interrupted", [], False
    elif scope.state == "waiting":
        scope.trigger()


def value(newest: dict[str, list[float]], block: str, slot: int, kind: str) -> float:
    if block not in newest:
        return math.nan
    found = newest[block][slot]
    return float(bool(found)) if kind == "bool" else float(found)


def board(
    world: World,
    settings: list[ScopeSettings],
    commands: list[Command],
    cuts: list[int] = (),
    ahead: int = 0,
) -> tuple[ScopeBoard, list[Package]]:
    """Run the same by a board: settled at each cut, with rows fed up to some ticks ahead of that."""
    packages: list[Package] = []
    made = ScopeBoard(source(), packages.append)
    for each in settings:
        made.add(each)
    rows = {block: world.slots(block) for block in world.rows}
    fed = 0
    stops = sorted({*cuts, *(command.tick for command in commands), world.ticks})
    for stop in stops:
        reach = min(world.ticks, stop + ahead)
        for block, (ticks, bits) in rows.items():
            part = (ticks >= fed) & (ticks < reach)
            made.feed(block, ticks[part], bits[part])
        fed = max(fed, reach)
        made.settle(stop)
        for command in commands:
            if command.tick == stop:
                act(made, command)
    return made, packages


def act(made: ScopeBoard, command: Command) -> None:
    if command.what == "trigger" and made[command.scope].status == "Finished":
        return
    try:
        getattr(made, command.what)(command.scope)
    except QuadvisError:
        if command.what != "trigger":
            raise


def facts(packages: list[Package], number: int) -> list[tuple]:
    """Return the packages of a scope as the model has them."""
    return [
        (each.sequence, each.ticks.tolist(), list(map(plain, each.samples.tolist())), each.trigger, each.lost)
        for each in packages
        if each.scope == number
    ]


def plain(values: list[float]) -> list[float | None]:
    """Return values that are equal if they are the same: None for NaN."""
    return [None if math.isnan(value) else value for value in values]
