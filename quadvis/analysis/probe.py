"""An engine that returns, again and again, the effect of a small change of its memory."""

from __future__ import annotations

from collections.abc import Iterator, Sequence, Set
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadvis.analysis.cut import break_path
from quadvis.analysis.loops import full, hyperperiod, instants_of
from quadvis.diagram.sections.cuts import Cut
from quadvis.engine.engine import Engine
from quadvis.engine.layout import TIME, Placed
from quadvis.engine.memory import Slot
from quadvis.engine.taps import Observer
from quadvis.graph.graph import ACTIVE, FIXED, Graph, Wire

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]
Positions = NDArray[np.intp]  # of slots
STEP = 1e-5  # of a central difference, relative to values above 1; it gives errors near 1e-10


@dataclass(frozen=True)
class Channel:
    """One element of a cut signal at one tick of the hyperperiod: its slot to read and its slot to disturb.

    ``time`` (s) counts from the start of the hyperperiod. One that is ``read_only`` is never disturbed.
    """

    cut: str
    text: str
    read: int
    added: int
    tick: int
    time: float
    read_only: bool = False


def silence(engine: Engine) -> None:
    """Remove the noise: a random stream of zeros stays zero and gives 2e-5 sigma at every draw."""
    for node in engine.graph.nodes:
        for name in node.block.interface.streams:
            engine.write(node.path, name, 0)


def fix_conditions(engine: Engine) -> dict[str, bool]:
    """Let what is under a condition run, or stand still, as it does now; return which parts and blocks run.

    They have the path of their condition without the last name.
    """
    found: dict[str, bool] = {}
    for path in engine.graph.conditions:
        if FIXED in engine.graph[path].block.interface.states:
            engine.write(path, FIXED, True)
        part = path.rpartition("/")[0] or path
        found[part] = found.get(part, False) or engine.read(path, ACTIVE)
    return found


def standing_still(graph: Graph, engine: Engine) -> set[str]:
    """Return the blocks that do not run, since their conditions are false."""
    return {
        node.path
        for path, nodes in graph.conditions.items()
        if not engine.read(path, ACTIVE)
        for node in nodes
    }


class Probe:
    """Computes the effect of a hyperperiod on the memory; the run stands at its beginning, without noise.

    ``positions`` are the 8-byte slots that can hold the loop's state; ``names`` are their names in texts.
    ``blocks`` are what counts as the loop: all that lie on loops, or those of a transfer.
    """

    def __init__(
        self, engine: Engine, cuts: Sequence[Cut], at: float, blocks: Set[str] = frozenset()
    ) -> None:
        self.engine, self.graph = engine, engine.graph
        self.program, self.floats = engine.program, engine.memory.floats
        self.loop = blocks or {node.path for node in self.graph.nodes}
        self.tasks = {node.task for node in self.graph.nodes if node.path in self.loop}
        self.span = hyperperiod(self.graph, self.tasks)
        begin = max([full(self.graph, self.loop, at), *(task.offset for task in self.tasks)])
        engine.run(self.span * -(-begin // (self.span * self.graph.tick)))
        self.parts = fix_conditions(engine)
        self._still = standing_still(self.graph, engine)
        self.names = dict(self._named())
        self.positions: Positions = np.array(sorted(self.names), np.intp)
        self.continuous = self._continuous()
        self.signals: Positions = np.array(
            [place for block in self.program.blocks for place in self._signals(block)], np.intp
        )
        self.channels = [channel for cut in cuts for channel in self._channels(cut)]
        self._read = np.array([channel.read for channel in self.channels], np.intp)
        self._added = np.array([channel.added for channel in self.channels], np.intp)
        self._ticks = np.array([channel.tick for channel in self.channels], np.intp)
        self._moments = self._events()
        self.keep()

    @property
    def period(self) -> float:
        """The hyperperiod (s)."""
        return float(self.span * self.graph.tick)

    def keep(self) -> None:
        """Make the present memory the starting point of all later calls."""
        self._start = self.engine.snapshot()
        self.start: Vector = self.floats.copy()
        self.scale: Vector = np.maximum(1.0, np.abs(np.nan_to_num(self.start)))

    def move(self, places: Positions, deltas: Vector) -> None:
        """Change the memory at the starting point."""
        self.engine.restore(self._start)
        self.floats[places] += deltas
        self.keep()

    def after(
        self, places: Positions, deltas: Vector | float, added: Vector | None = None, count: int = 1
    ) -> tuple[Vector, Vector]:
        """Return the memory some hyperperiods after a change, and the values of the channels in the first.

        ``added`` holds the disturbances of the channels in the first hyperperiod.
        """
        engine, floats = self.engine, self.floats
        engine.restore(self._start)
        floats[places] += deltas
        found = np.empty(len(self.channels))
        for tick, length, mine in self._moments:
            if added is not None:
                self._disturb(added, tick)
            engine.run(length)
            found[mine] = floats[self._read[mine]]
        floats[self._added] = 0.0
        if count > 1:
            engine.run(self.span * (count - 1))
        return floats.copy(), found

    def slopes(self, places: Positions, deltas: Vector | float, added: Vector) -> tuple[Vector, Vector]:
        """Return the derivatives of the continuous states after a change, and the values of the channels."""
        self.engine.restore(self._start)
        self.floats[TIME.position] = self.engine.time
        self.floats[places] += deltas
        self._disturb(added, 0)
        for method in ("output", "deriv"):
            for block in self.program.blocks:
                call = self.engine.call(block.path, method)
                if call is not None:
                    call()
        rates = np.zeros(self.floats.size)
        rates[list(self.program.states)] = self.floats[list(self.program.slopes)]
        return rates, self.floats[self._read]

    def shaken(self) -> Vector:
        """Return the memory after a hyperperiod in which every signal of the loop is disturbed at random."""
        disturbances = self._shake()
        try:
            return self.after(self.positions[:0], 0.0)[0]
        finally:
            for disturbance in disturbances:
                self.engine.detach(disturbance)

    def _disturb(self, added: Vector, tick: int) -> None:
        """Add the disturbances to the channels of a tick, and to no others."""
        now = self._ticks == tick
        self.floats[self._added] = 0.0
        np.add.at(self.floats, self._added[now], added[now])  # two cuts may share a signal

    def _events(self) -> list[tuple[int, int, NDArray[np.intp]]]:
        """Return the ticks at which channels are read, the number of ticks to the next, and the channels."""
        ticks = sorted({0, *self._ticks.tolist()})
        following = [*ticks[1:], self.span]
        return [
            (tick, end - tick, np.flatnonzero(self._ticks == tick))
            for tick, end in zip(ticks, following, strict=True)
        ]

    def _channels(self, cut: Cut) -> Iterator[Channel]:
        for signal in cut.signals:
            task = self.graph[break_path(signal.block, signal.port)].task
            every, offset = self.graph.ticks(task.period), self.graph.ticks(task.offset)
            opened = self.program[break_path(signal.block, signal.port)]
            added = opened.inputs["added"].position
            outputs = self.program[signal.block].outputs if signal.block in self.graph else {}
            read = (outputs[signal.port] if signal.port in outputs else opened.outputs["y"]).position
            for element in signal.elements:
                for tick in range(offset % every, self.span, every):
                    time = float(tick * self.graph.tick)
                    places = read + element, added + element
                    yield Channel(cut.label, signal.text, *places, tick, time, cut.read_only)

    def _named(self) -> Iterator[tuple[int, str]]:
        """Yield the slots of real numbers of the blocks of the loop, with their names.

        Instants and ages follow the clock, so they do not belong to the state. Blocks that do not run have
        none.
        """
        instants = instants_of(self.graph)
        for node, block in zip(self.graph.nodes, self.program.blocks, strict=True):
            if node.path not in self.loop or node.path in self._still:
                continue
            interface, path = node.block.interface, node.path
            for port, slot in block.outputs.items():
                if slot.scalar == "float64" and (path, port) not in instants:
                    yield from _elements(slot, f"{path}.{port}")
            for name, state in interface.states.items():
                if state.signal.scalar == "float64":
                    yield from _elements(block.field(name), f"{path}.{name}")
            for port, wire in node.wires():
                if wire.delayed and block.inputs[port].scalar == "float64":
                    yield from _elements(self._late(wire, block.inputs[port]), f"{path}.{port}")

    def _late(self, wire: Wire, read: Slot) -> Slot:
        """Return the slot that keeps a delayed value from tick to tick; what is latched is a copy of it."""
        if not wire.latched:
            return read
        output = self.program[wire.block].outputs[wire.port]
        delays = self.program.task(self.program[wire.block].task).delays
        return next(op.targets[0] for op in delays if op.sources[0] == output)

    def _continuous(self) -> Positions:
        """Return the slots of the loop's continuous states."""
        return np.array(
            [
                position
                for block in self.program.blocks
                if block.path in self.loop and block.path not in self._still
                for state in block.slopes
                for position, _ in _elements(block.field(state), "")
            ],
            np.intp,
        )

    def _shake(self) -> list[Observer]:
        """Let every signal of the loop be disturbed at random from now on; return what does it.

        An update may take what its output computed as Work, so those outputs run again on what is disturbed.
        """
        found = []
        for task in dict.fromkeys(block.task for block in self.program.blocks):
            blocks = [block for block in self.program.blocks if block.task == task]
            places = np.array([place for block in blocks for place in self._signals(block)], np.intp)
            again = [self.engine.call(block.path, "output") for block in blocks if self._works(block)]
            random = np.random.default_rng(1)

            def disturb(_: int, places: Positions = places, again: Any = again, random: Any = random) -> None:
                size = STEP * np.maximum(1.0, np.abs(np.nan_to_num(self.floats[places])))
                self.floats[places] += size * random.uniform(0.5, 1.0, places.size)
                disturbed = self.floats[places]
                for output in again:
                    output()
                self.floats[places] = disturbed

            found.append(self.engine.observe(task, disturb))
        return found

    def _signals(self, block: Placed) -> list[int]:
        return [
            position
            for slot in block.outputs.values()
            if slot.scalar == "float64"
            for position, _ in _elements(slot, "")
            if position in self.names
        ]

    def _works(self, block: Placed) -> bool:
        """Return whether a block of the loop hands real numbers from its output to its update."""
        work = self.graph[block.path].block.interface.work
        return block.path in self.loop and any(each.signal.scalar == "float64" for each in work.values())


def _elements(slot: Slot, name: str) -> Iterator[tuple[int, str]]:
    for flat, index in enumerate(np.ndindex(*slot.shape)):
        yield slot.position + flat, f"{name}[{','.join(map(str, index))}]" if slot.shape else name
