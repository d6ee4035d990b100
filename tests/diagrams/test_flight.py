"""The hover on three computers: simulated with its links, and on the bench, a process for each computer."""

from __future__ import annotations

import pytest

import quadvis
from tests.diagrams.golden import DIAGRAMS, ON_DEVICES

FLIGHT = DIAGRAMS / "flight.yaml"
CALM = quadvis.RealTime(priority=0, poll="0 s")
PATIENT = ["overload={action: warn}"]
SHORT = "6 s"


def test_devices_need_real_time_and_no_other_variant_does() -> None:
    for name, variant in ON_DEVICES:
        with pytest.raises(quadvis.errors.QuadvisError, match="only a real-time run may do so"):
            quadvis.load(DIAGRAMS / name, variant=variant).run()


def test_desk_and_bench_differ_in_slots_and_links_alone() -> None:
    desk, bench = (quadvis.load(FLIGHT, variant=name).graph for name in ("sim", "hil"))
    slots = ("outputs", "receiver")
    for node in desk.nodes:
        if node.path in slots or node.origin:
            continue
        other = bench[node.path]
        assert (type(node.block), node.task, node.computer) == (type(other.block), other.task, other.computer)
        assert node.block.parameters == other.block.parameters
