"""Live ends in the place of the twins: two engines and a carrier give the signals of the simulation."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from quadvis.engine.engine import Engine
from quadvis.errors import QuadvisError, RunError
from quadvis.graph.graph import Graph, Task
from quadvis.links.carriers import open_sender
from quadvis.links.endpoints import close_all, links_of, live, open_carriers
from quadvis.links.link import MEMORY, UDP, Link
from quadvis.links.udp import UdpSocket
from quadvis.machine.mailbox import Mailbox

from .networks import PORTS, film, made_link, network, task

Read = Callable[[Engine], Any]
FAST, SLOW, LATE = task("fast", "1/20"), task("slow", "1/10"), task("late", "1/10", "1/50")


def free_address() -> tuple[str, int]:
    socket = UdpSocket(("127.0.0.1", 0), listens=True)
    try:
        return socket.address
    finally:
        socket.close()


def resources(link: Link) -> tuple[Any, Any]:
    """Return what the two ends of a link need, as a supervisor would make it."""
    if link.via == MEMORY:
        words = memoryview(bytearray(8 * link.words))
        return words, words
    address = free_address()
    return address, address


def in_step(graph: Graph, source: Task, reader: Task, ticks: int, read: Read) -> list[Any]:
    """Run both computers' parts by turns; return what ``read`` finds at each of the reader's ticks.

    The sender is always ahead by one tick of the reader, so that messages come too early, not too late.
    """
    link = links_of(graph)[0]
    with ExitStack() as stack:
        engines = []
        for computer, resource in zip(("near", "far"), resources(link), strict=True):
            part = graph.part_of(computer)
            carriers = open_carriers(part, {link.name: resource})
            stack.callback(close_all, carriers.values())
            engines.append(stack.enter_context(Engine(live(part, carriers))))
        sending, reading = engines
        found: list[Any] = []
        reading.observe(reader.name, lambda tick: found.append(read(reading)))
        while len(found) < ticks:
            ahead = (reading.tick + 1) * reading.period + max(source.period, reader.period)
            while sending.tick * sending.period <= ahead:
                sending.run(1)
            reading.run(1)
    return found


def in_one(graph: Graph, reader: Task, count: int, read: Read) -> list[Any]:
    """Return the same of the simulation."""
    engine = Engine(graph)
    found: list[Any] = []
    engine.observe(reader.name, lambda tick: found.append(read(engine)))
    with engine:
        while len(found) < count:
            engine.run(1)
    return found


def all_ports(engine: Engine) -> list[Any]:
    return [np.asarray(engine.read("line", port)).tolist() for port in PORTS]


def seen(engine: Engine) -> list[Any]:
    return [repr(number) for number in engine.read("reader", "seen").tolist()]


@pytest.mark.parametrize(
    ("source", "reader"), [(SLOW, FAST), (FAST, SLOW), (FAST, FAST), (LATE, FAST)], ids=lambda each: each.name
)
@pytest.mark.parametrize("via", [MEMORY, UDP])
def test_two_processes_see_what_the_simulation_sees(via: str, source: Task, reader: Task) -> None:
    graph = network(made_link(source, reader, via=via, baud=0), source, reader)
    found = in_step(graph, source, reader, 12, all_ports)
    assert found == in_one(graph, reader, 12, all_ports)
    assert found[-1][0] > 0


@pytest.mark.parametrize(("source", "reader"), [(SLOW, FAST), (FAST, SLOW)], ids=lambda each: each.name)
def test_pictures_travel_in_memory(source: Task, reader: Task) -> None:
    graph = film(source, reader)
    found = in_step(graph, source, reader, 12, seen)
    assert found == in_one(graph, reader, 12, seen)
    assert found[0] == ["0.0", "nan", "0.0"] and float(found[-1][0]) > 4


def test_a_picture_that_is_too_large_stops_the_sender_in_a_sentence() -> None:
    graph = film(SLOW, FAST)
    link = replace(links_of(graph)[0], room=(4, 5))
    part = graph.part_of("near")
    carriers = {"line": open_carriers(part, {"line": bytearray(8 * links_of(graph)[0].words)})["line"]}
    small = {"line": open_sender(link, bytearray(8 * link.words))}
    with Engine(live(part, carriers)) as engine:
        engine.run(1)
    with (
        pytest.raises(RunError, match="has room for pictures of 4 x 5 px"),
        Engine(live(part, small)) as engine,
    ):
        engine.run(1)


def test_none_stays_open_if_one_end_cannot_be_opened() -> None:
    graph = network(made_link(SLOW, FAST), SLOW, FAST)
    with pytest.raises(QuadvisError, match=r"^link 'line', sender: port '/dev/none' is missing"):
        open_carriers(graph.part_of("near"), {"line": "/dev/none"})


def test_a_link_says_what_both_ends_want() -> None:
    memory = made_link(FAST, SLOW, via=MEMORY, baud=0)
    assert memory.words == Mailbox.size(36, 6) and (memory.source, memory.target) == ("near", "far")
    serial = made_link(FAST, SLOW, ports=("/dev/a", "/dev/b"))
    assert (serial.words, serial.baud, serial.ports) == (0, 9600, ("/dev/a", "/dev/b"))
    udp = made_link(FAST, SLOW, via=UDP, baud=0, address="192.0.2.1:5005")
    assert (udp.via, udp.address) == (UDP, "192.0.2.1:5005")
