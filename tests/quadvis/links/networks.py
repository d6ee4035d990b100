"""A small network for tests: a source on one computer, a reader on another, a link between them."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from quadvis.block import NO_FRAME, Block, Frame, In, Out, State
from quadvis.engine.engine import Engine
from quadvis.graph.graph import SINGLE, Graph, Node, Task, Wire
from quadvis.graph.order import execution_order
from quadvis.links.insertion import insert, signal_names
from quadvis.links.link import MEMORY, SERIAL, Link
from quadvis.links.message import Message, MessageSignal
from quadvis.units import Unit

ONE = Unit()


class Counter(Block):
    """Counts its ticks, in every kind of signal."""

    count = Out("int64")
    half = Out()
    odd = Out("bool")
    pair = Out("float64[2]", nan=True)
    flags = Out("bool[3]")
    ticks = State("int64")

    def output(self):
        n = self.ticks
        flags = np.zeros(3, np.bool_)
        flags[n % 3] = True
        return n, n / 2, n % 2 == 1, np.array([1.0 * n, -1.0 * n]), flags

    def update(self):
        self.ticks += 1


class Sum(Block):
    """Adds up what it reads, so that each row depends on all that came."""

    count = In("int64")
    half = In()
    odd = In("bool")
    pair = In("float64[2]")
    flags = In("bool[3]")
    y = Out()
    total = State()

    def output(self, count, half, odd, pair, flags):
        return self.total + count + half + (100.0 if odd else 0.0) + pair[1] * 1e-3 + flags[1] * 7.0

    def update(self, half):
        self.total = self.total + half


class Film(Block, numeric=False):
    """Gives a picture at each tick, of which every pixel is its number."""

    frame = Out("frame")
    ticks = State("int64")

    def output(self):
        pixels = np.full((4, 6, 3), self.ticks % 256, np.uint8)
        return Frame(pixels, self.ticks / 10, self.ticks + 1)

    def update(self):
        self.ticks += 1


class Look(Block, numeric=False):
    """Says what it sees: the number, the stamp, a pixel, 0 before the first picture."""

    frame = In("frame")
    seen = Out("float64[3]", nan=True)

    def output(self, frame):
        pixel = float(frame.pixels[-1, -1, -1]) if frame.pixels.size else 0.0
        return np.array([frame.sequence, frame.stamp, pixel])


def film(source: Task, reader: Task) -> Graph:
    """Return a graph in which pictures travel over a link."""
    signals = (MessageSignal("frame", "source", "frame", "frame", (), (ONE,), False, NO_FRAME),)
    link = Link(
        "line",
        "near",
        "far",
        MEMORY,
        source.name,
        source.period,
        reader.period,
        Message(signals),
        room=(4, 6),
    )
    nodes = {
        "source": Node("source", "test", Film(), source, {}, units={"frame": (ONE,)}, computer="near"),
        "reader": Node("reader", "test", Look(), reader, {"frame": Wire("source", "frame")}, computer="far"),
    }
    insert(nodes, link, [("reader", "frame")])
    return Graph("test", execution_order(list(nodes.values()))[0])


INITIAL = {"count": 0, "half": 0.0, "odd": False, "pair": np.array([0.25, 0.5]), "flags": np.zeros(3, bool)}
SHAPES = {"count": (), "half": (), "odd": (), "pair": (2,), "flags": (3,)}
UNITS = {name: (ONE,) * max(1, int(np.prod(shape))) for name, shape in SHAPES.items()}


def message(block: Block, path: str = "source") -> Message:
    """Return the message of all outputs of a block."""
    outputs = block.interface.outputs
    names = signal_names([(path, port) for port in outputs])
    return Message(
        tuple(
            MessageSignal(
                name, path, port, outputs[port].signal.scalar, SHAPES[port], UNITS[port], outputs[port].nan,
                INITIAL[port],
            )
            for name, port in zip(names, outputs, strict=True)
        )
    )  # fmt: skip


def made_link(source: Task, reader: Task, **more: Any) -> Link:
    """Return a link of the counter; a serial line unless ``more`` says otherwise."""
    given = {"via": SERIAL, "baud": 9600} | more
    return Link(
        "line", "near", "far", given.pop("via"), source.name, source.period, reader.period,
        message(Counter()), **given,
    )  # fmt: skip


def network(link: Link, source: Task, reader: Task, tasking: str = SINGLE) -> Graph:
    """Return a graph of a counter, a link and a sum."""
    nodes = {
        "source": Node("source", "test", Counter(), source, {}, units=UNITS, computer="near"),
        "reader": Node(
            "reader", "test", Sum(), reader, {port: Wire("source", port) for port in INITIAL}, computer="far"
        ),
    }
    insert(nodes, link, [("reader", port) for port in INITIAL])
    order, loops = execution_order(list(nodes.values()))
    assert not loops
    return Graph("test", order, tasking=tasking)


def task(name: str, period: str, offset: str = "0") -> Task:
    return Task(name, Fraction(period), Fraction(offset))


PORTS = (*INITIAL, "age", "lost", "refused")


def rows(engine: Engine, ticks: int, path: str = "line") -> list[tuple[float, ...]]:
    """Run, and return the time and the numbers of a link's receiver at each of its ticks."""
    found: list[tuple[float, ...]] = []

    def note(tick: int) -> None:
        values = [np.ravel(engine.read(path, port)) for port in PORTS]
        found.append((float(tick * engine.period), *np.concatenate(values).astype(float).tolist()))

    engine.observe(engine.graph[path].task.name, note)
    with engine:
        engine.run(ticks)
    return found
