"""Live ends in the place of the twins: two engines and a carrier give the signals of the simulation."""

from __future__ import annotations

from contextlib import ExitStack
from typing import Any

import pytest

from quadvis.engine.engine import Engine
from quadvis.graph.graph import Task
from quadvis.links.endpoints import close_all, live, open_carriers
from quadvis.links.link import MEMORY, UDP, Link
from quadvis.links.udp import UdpSocket

from .networks import made_link, network, rows, task

FAST, SLOW, LATE = task("fast", "1/20"), task("slow", "1/10"), task("late", "1/10", "1/50")


def free_address() -> tuple[str, int]:
    socket = UdpSocket(("127.0.0.1", 0), listens=True)
    try:
        return socket.address
    finally:
        socket.close()


def resources(link: Link) -> tuple[Any, Any]:
    """Return what the two ends of a link need, as a supervisor would make it."""
    needs = link.needs
    if needs.via == MEMORY:
        words = memoryview(bytearray(8 * needs.words))
        return words, words
    address = free_address()
    return address, address


def in_step(link: Link, source: Task, reader: Task, ticks: int) -> list[tuple[float, ...]]:
    """Run both computers' parts by turns, in the order of real time; return the receiver's rows."""
    graph = network(link, source, reader)
    with ExitStack() as stack:
        near, far = resources(link)
        engines = []
        for computer, resource in (("near", near), ("far", far)):
            part = graph.part_of(computer)
            carriers = open_carriers(part, {link.name: resource})
            stack.callback(close_all, carriers.values())
            engines.append(Engine(live(part, carriers)))
        sending, reading = engines
        found: list[tuple[float, ...]] = []
        stack.enter_context(sending)

        def keep_up(tick: int) -> None:
            """Let the sender do all that it does up to the reader's tick, even a little more than in time."""
            while sending.tick * sending.period <= tick * reading.period:
                sending.run(1)

        keep_up(0)
        reading.observe(reader.name, lambda tick: keep_up(tick + 1))
        found = rows(reading, ticks, link.name)
    return found


@pytest.mark.parametrize(
    ("source", "reader"), [(SLOW, FAST), (FAST, SLOW), (FAST, FAST), (LATE, FAST)], ids=lambda each: each.name
)
@pytest.mark.parametrize("via", [MEMORY, UDP])
def test_two_processes_see_what_the_simulation_sees(via: str, source: Task, reader: Task) -> None:
    link = made_link(source, reader, via=via, baud=0)
    simulated = Engine(network(link, source, reader))
    count = 12
    live_rows = in_step(link, source, reader, count)
    twin_rows = {row[0]: row for row in rows(simulated, 200)}
    assert live_rows == [twin_rows[row[0]] for row in live_rows]
    assert any(row[1] for row in live_rows)
