"""Eyes whose frames fail in one way after the other: a chain of `vision.frame_fault` behind the camera."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from tests.faults.bench import DIAGRAMS

FIRST, LENGTH, REST = 2.5, 0.8, 1.7  # s: before the first fault, of each fault, and until the next one


class FaultySpell(NamedTuple):
    """A fault of frames, from ``begin`` to ``end`` (s); at ``until`` the next one begins."""

    kind: str
    begin: float
    end: float
    until: float


def spells(kinds: Sequence[str]) -> list[FaultySpell]:
    """Return when each kind of fault is on."""
    begins = [round(FIRST + place * (LENGTH + REST), 3) for place in range(len(kinds))]
    return [
        FaultySpell(kind, begin, round(begin + LENGTH, 3), round(begin + LENGTH + REST, 3))
        for kind, begin in zip(kinds, begins, strict=True)
    ]


def eyes(kinds: Sequence[str]) -> str:
    """Return the part: a camera, and for each kind of fault a block that lets frames pass otherwise."""
    lines = [
        "quadvis: 1",
        "name: failing eyes",
        "params: {ceiling: 4.5 m, side: 1 m}",
        f"ports: {{in: [position, attitude], out: {{frame: fault{len(kinds)}.faulty}}}}",
        "blocks:",
        "  fault0:",
        "    block: vision.frame_fault",
        "    in: {frame: camera.frame}",
        "  camera:",
        "    block: vision.rendered_camera",
        f"    with: {{calibration: {DIAGRAMS}/calib/camera.yaml, ceiling: $ceiling, side: $side,",
        "           latency: 100 ms}",
        "    in: {position: in.position, attitude: in.attitude}",
    ]
    for place, spell in enumerate(spells(kinds)):
        settings = f"{{kind: {spell.kind}, begin: {spell.begin} s, duration: {LENGTH} s}}"
        lines += [
            f"  fault{place + 1}:",
            "    block: vision.frame_fault",
            f"    with: {settings}",
            f"    in: {{frame: fault{place}.faulty}}",
        ]
    return "\n".join(lines) + "\n"


# The eyes, as a block of a diagram on `flight.yaml`.
FAILING = """
  eyes:
    part: failing_eyes.yaml
    at: world
    rate: camera
    with: {ceiling: $ceiling, side: $side}
    in: {position: {from: craft.position, across: sample}, attitude: {from: craft.attitude, across: sample}}
"""
