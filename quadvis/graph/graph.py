"""A checked diagram: blocks with every name, shape and rate resolved, ready for the engine."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import Any, NamedTuple

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
SOLVERS = ("ode1", "ode2", "ode3", "ode4")  # of fixed step
VARIABLE = ("RK45", "Radau", "BDF", "LSODA")  # scipy's, which choose their steps
SINGLE, MULTI = TASKINGS = ("single", "multi")
DELAY = "delay"
ACTIVE, RESTART = "active", "restart"  # outputs of a condition: whether its blocks run, and begin again
FIXED = "fixed"  # its state: whether these outputs stay as they are

Index = tuple[Any, ...]  # integers, then slices, as numpy takes them


class Tolerances(NamedTuple):
    """How exact each step of a variable-step solver is: relative to a state, and in the state's unit."""

    rtol: float = 1e-6
    atol: float = 1e-9


USUAL = Tolerances()  # where none are written


class Task(NamedTuple):
    """Blocks that share a rate. The continuous task runs at every solver step. Times are exact (s)."""

    name: str
    period: Fraction
    offset: Fraction = Fraction(0)
    continuous: bool = False

    def __hash__(self) -> int:
        return hash(self.name)  # no two tasks share one, and fractions are slow to hash


@dataclass(frozen=True)
class Wire:
    """The source of an input: a port of a block, or elements of it; and its crossing between rates.

    ``late`` and ``latched`` are what `with_transitions` adds where each task runs by itself: the value of one
    of the producer's periods ago; a value that stands still until the reader is due again. ``earlier`` marks
    the wire from the sender of a link to its receiver, which uses only what was sent at earlier instants: it
    asks for no order of execution and for no transition.
    """

    block: str
    port: str
    index: Index = ()
    crossing: str | None = None
    late: bool = False
    latched: bool = False
    earlier: bool = False

    @property
    def source(self) -> str:
        """The wire's source as a diagram writes it, without the index."""
        return f"{self.block}.{self.port}"

    @property
    def delayed(self) -> bool:
        """True if the wire gives the producer's value of one of its periods ago."""
        return self.late or self.crossing == DELAY


class Constant(NamedTuple):
    """An input that a diagram sets to a value instead of wiring it."""

    value: Any


@dataclass
class Node:
    """One block of a checked diagram. ``sizes`` fixes its symbolic shapes.

    ``computer`` is the one that runs it, "" if the diagram has no computers. ``condition`` is the block with
    the outputs `ACTIVE` and `RESTART` that says at which ticks it runs, "" if at all of its task, of which
    that block is one, too; a block that is itself a condition runs at all of them. ``origin`` says of a
    block that the checks have added what it is; ``hidden`` ones are no business of logs and pictures.
    """

    path: str
    kind: str
    block: Block
    task: Task
    inputs: dict[str, Wire | Constant]
    sizes: Sizes = field(default_factory=dict)
    units: dict[str, tuple[Unit, ...]] = field(default_factory=dict)  # of the outputs, element by element
    stream: str = ""  # the name of its noise; its path if empty
    computer: str = ""
    condition: str = ""
    origin: str = ""
    hidden: bool = False

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
    first; the wires have transitions then). ``tolerances`` are for a solver of variable step.
    """

    name: str
    nodes: list[Node]
    solver: str = "ode4"
    step: Fraction | None = None
    tasking: str = SINGLE
    tolerances: Tolerances = USUAL

    def __post_init__(self) -> None:
        self._by_path = {node.path: node for node in self.nodes}

    def __getitem__(self, path: str) -> Node:
        return self._by_path[path]

    def __contains__(self, path: object) -> bool:
        return path in self._by_path

    @cached_property
    def conditions(self) -> Mapping[str, tuple[Node, ...]]:
        """The blocks of each condition, those of conditions in it included, by the path of the condition.

        A condition around which another one stands is itself one of the blocks of that one.
        """
        found: dict[str, list[Node]] = {node.condition: [] for node in self.nodes if node.condition}
        for node in self.nodes:
            for path in self.around(node.path):
                found[path].append(node)
        return {path: tuple(nodes) for path, nodes in found.items()}

    def around(self, path: str) -> Iterator[str]:
        """Yield the condition of a block, then those around this one."""
        while path := self[path].condition:
            yield path

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

    @cached_property
    def computers(self) -> tuple[str, ...]:
        """The computers that run it, in the order of execution; ("",) if the diagram has none."""
        return tuple(dict.fromkeys(node.computer for node in self.nodes))

    def part_of(self, computer: str) -> Graph:
        """Return the graph of what one computer runs, with the base tick of the whole.

        Of the wires of links, those from another computer lead out of it: their senders are there.
        """
        nodes = [node for node in self.nodes if node.computer == computer]
        return Graph(self.name, nodes, self.solver, self.tick, self.tasking, self.tolerances)

    def ticks(self, time: Fraction) -> int:
        """Return a time as a number of base ticks; ValueError if it is not a whole one."""
        count = time / self.tick
        if count.denominator != 1:
            raise ValueError(f"{time} s is not a whole number of ticks of {self.tick} s")
        return count.numerator


def rank(task: Task) -> tuple[bool, Fraction, Fraction, str]:
    """Return the place of a task among others: the continuous one first, then fastest first."""
    return not task.continuous, task.period, task.offset, task.name


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
    if not index and 0 not in shape:
        return 0, shape
    for part, length in zip(index, shape, strict=False):
        if isinstance(part, slice) and ((part.stop or 0) > length or not range(length)[part]):
            raise IndexError(f"{part.start}:{part.stop} of {length} elements")
    part = np.arange(math.prod(shape)).reshape(shape)[index]
    if int(part.flat[-1]) - int(part.flat[0]) + 1 != part.size:
        return None
    return int(part.flat[0]), part.shape
