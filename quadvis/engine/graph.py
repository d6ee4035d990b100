"""A checked diagram: blocks with every name, shape and rate resolved, ready for the engine."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np

from quadvis.block import Block, Shape, Sizes
from quadvis.units import Unit

CROSSINGS = {
    "sample": "a faster producer is read at the consumer's ticks",
    "hold": "a slower producer's value is held between its ticks",
    "delay": "the producer's value of one of its periods ago, which breaks loops",
    "newest": "whatever the producer gave last, for rates that do not fit into each other",
}
CONTINUOUS = "continuous"  # the rate of blocks that the solver integrates; all other rates are sampled
SOLVERS = ("ode1", "ode2", "ode3", "ode4")
SINGLE, MULTI = TASKINGS = ("single", "multi")
DELAY = "delay"

Index = tuple[Any, ...]  # integers, then slices, as numpy takes them


@dataclass(frozen=True)
class Task:
    """Blocks that share a rate. The continuous task runs at every solver step. Times are exact (s)."""

    name: str
    period: Fraction
    offset: Fraction = Fraction(0)
    continuous: bool = False


@dataclass(frozen=True)
class Wire:
    """The source of an input: a port of a block, or elements of it; and its crossing between rates.

    ``late`` and ``latched`` are what `with_transitions` adds where each task runs by itself: the value of one
    of the producer's periods ago; a value that stands still until the reader is due again.
    """

    block: str
    port: str
    index: Index = ()
    crossing: str | None = None
    late: bool = False
    latched: bool = False

    @property
    def source(self) -> str:
        """The wire's source as a diagram writes it, without the index."""
        return f"{self.block}.{self.port}"

    @property
    def delayed(self) -> bool:
        """True if the wire gives the producer's value of one of its periods ago."""
        return self.late or self.crossing == DELAY


@dataclass(frozen=True)
class Constant:
    """An input that a diagram sets to a value instead of wiring it."""

    value: Any


@dataclass
class Node:
    """One block of a checked diagram. ``sizes`` fixes its symbolic shapes."""

    path: str
    kind: str
    block: Block
    task: Task
    inputs: dict[str, Wire | Constant]
    sizes: Sizes = field(default_factory=dict)
    units: dict[str, tuple[Unit, ...]] = field(default_factory=dict)  # of the outputs, element by element

    def shape(self, port: str) -> Shape:
        """Return the shape of an input, output or state."""
        interface = self.block.interface
        declared = interface.inputs.get(port) or interface.outputs.get(port) or interface.states[port]
        return declared.signal.resolve(self.sizes)

    def unit(self, port: str) -> str:
        """Return an output's unit as text: one for all elements, or one each."""
        names = [str(unit) for unit in self.units[port]]
        return names[0] if len(set(names)) == 1 else " ".join(names)

    def wires(self, ports: Iterable[str] | None = None) -> Iterator[tuple[str, Wire]]:
        """Yield the wired inputs, all of them or those named."""
        for port, source in self.inputs.items():
            if isinstance(source, Wire) and (ports is None or port in ports):
                yield port, source


@dataclass
class Graph:
    """All blocks, each after the blocks whose outputs its own need, and the exact time base.

    ``tasking`` is ``single`` (one order of execution a tick) or ``multi`` (each task by itself, the fastest
    first; the wires have transitions then).
    """

    name: str
    nodes: list[Node]
    solver: str = "ode4"
    step: Fraction | None = None
    tasking: str = SINGLE

    def __post_init__(self) -> None:
        self._by_path = {node.path: node for node in self.nodes}

    def __getitem__(self, path: str) -> Node:
        return self._by_path[path]

    @cached_property
    def tasks(self) -> list[Task]:
        """The tasks in use, fastest first (rate-monotonic), the continuous one before all."""
        return rate_monotonic(dict.fromkeys(node.task for node in self.nodes))

    @cached_property
    def tick(self) -> Fraction:
        """The base tick (s): the solver's step, or the largest that divides every period and offset."""
        if self.step is not None:
            return self.step
        times = [time for task in self.tasks for time in (task.period, task.offset) if time]
        return common_divisor(times) if times else Fraction(1)

    def ticks(self, time: Fraction) -> int:
        """Return a time as a number of base ticks; ValueError if it is not a whole one."""
        count = time / self.tick
        if count.denominator != 1:
            raise ValueError(f"{time} s is not a whole number of ticks of {self.tick} s")
        return count.numerator


def rate_monotonic(tasks: Iterable[Task]) -> list[Task]:
    """Return tasks fastest first, the continuous one before all."""
    return sorted(tasks, key=rank)


def common_divisor(times: Sequence[Fraction]) -> Fraction:
    """Return the largest time that divides each of ``times``."""
    denominator = math.lcm(*(time.denominator for time in times))
    return Fraction(math.gcd(*(int(time * denominator) for time in times)), denominator)


def selected(shape: Shape, index: Index) -> tuple[int, Shape] | None:
    """Return the first element and the shape of ``signal[index]``; None if it does not lie in one piece.

    IndexError if the index goes beyond the shape or takes nothing: unlike numpy's, a slice is not cut short.
    """
    for part, length in zip(index, shape, strict=False):
        if isinstance(part, slice) and ((part.stop or 0) > length or not range(length)[part]):
            raise IndexError(f"{part.start}:{part.stop} of {length} elements")
    part = np.arange(math.prod(shape)).reshape(shape)[index]
    if int(part.flat[-1]) - int(part.flat[0]) + 1 != part.size:
        return None
    return int(part.flat[0]), part.shape


def execution_order(nodes: Sequence[Node]) -> tuple[list[Node], list[list[tuple[str, str]]]]:
    """Return the nodes in an order that respects direct feedthrough, and the algebraic loops that forbid one.

    A loop is a list of (block, input) pairs, each input driven by the next block in the list. Blocks keep the
    diagram's order wherever the wires allow it.
    """
    by_path = {node.path: node for node in nodes}
    done: set[str] = set()
    order: list[Node] = []
    loops: list[list[tuple[str, str]]] = []
    # Each entry: a block, the input through which the search reached it, what it still needs.
    trail: list[tuple[str, str, Iterator[tuple[str, str]]]] = []
    active: dict[str, int] = {}

    def enter(path: str, port: str) -> None:
        active[path] = len(trail)
        trail.append((path, port, _needs(by_path[path])))

    for root in nodes:
        if root.path not in done:
            enter(root.path, "")
        while trail:
            path, _, needs = trail[-1]
            port, source = next(needs, ("", ""))
            if not port:
                trail.pop()
                del active[path]
                done.add(path)
                order.append(by_path[path])
            elif source in active:
                loop = trail[active[source] :]
                inputs = [entered for _, entered, _ in loop[1:]] + [port]
                loops.append([(entry[0], name) for entry, name in zip(loop, inputs, strict=True)])
            elif source in by_path and source not in done:
                enter(source, port)
    return order, loops


def _needs(node: Node) -> Iterator[tuple[str, str]]:
    """Yield what must be computed before this block: its feedthrough inputs and where they come from."""
    for port, wire in node.wires(node.block.interface.feedthrough):
        if not wire.delayed:
            yield port, wire.block


def rank(task: Task) -> tuple[bool, Fraction, Fraction, str]:
    """Return the place of a task among others: the continuous one first, then fastest first."""
    return not task.continuous, task.period, task.offset, task.name


def with_transitions(nodes: Iterable[Node]) -> None:
    """Make wires between tasks deterministic where each task runs by itself and faster ones interrupt it.

    As Simulink's rate transitions do: from a slower task a faster one reads what the slower gave one of the
    slower's periods ago, swapped when the slower is due again, since its present value may not be ready.
    From a faster task a slower one reads what the faster gave when the slower became due; the value is
    latched, since the faster runs on meanwhile. So is a late value, unless the reader is always through
    before it changes.
    """
    nodes = list(nodes)
    tasks = {node.path: node.task for node in nodes}
    for node in nodes:
        for port, wire in list(node.wires()):
            producer, reader = tasks.get(wire.block, node.task), node.task
            if producer != reader:
                late = not wire.delayed and rank(producer) > rank(reader)
                through = (late or wire.delayed) and _falls_on(producer, reader)
                node.inputs[port] = replace(wire, late=late, latched=not through)


def _falls_on(task: Task, other: Task) -> bool:
    """Return whether every tick of a task is one of another, from the later offset on."""
    return task.period % other.period == 0 and (task.offset - other.offset) % other.period == 0
