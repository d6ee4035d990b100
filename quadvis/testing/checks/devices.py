"""Checks of devices: frames follow from commands alone, and no bytes from outside harm an input."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from typing import Any

import numpy as np

from quadvis.block import Counted, Input, Output
from quadvis.block.input import KEPT
from quadvis.block.output import checked_frame
from quadvis.testing.rig import STEPS, Subject, rigs, sources

PIECES = 64  # of random bytes
PIECE = 100  # bytes of each


def frames_follow_from_commands(subject: Subject) -> None:
    """Check that an output makes the same frame of the same command at any time, and so its safe frames."""
    if not issubclass(subject.block, Output):
        return
    names = subject.block.interface.arguments["write"]
    for rig in rigs(subject):
        made = subject.block.safe_frame, subject.block.initial_frame
        with rig.engine:
            fixed = [make(rig.block) for make in made]
            for step in range(STEPS):
                rig.feed(step)
                values = [rig.memory.read(slot) for slot in sources(rig.placed, names)]
                frames = [checked_frame(rig.block.frame(*values)) for _ in range(2)]
                assert frames[0] == frames[1], f"frame gives two frames of one command at step {step}"
                rig.engine.run(1)
                assert [make(rig.block) for make in made] == fixed, (
                    f"the safe or the initial frame is another one after step {step}: they are sent when no "
                    "block lives, so they must follow from the parameters alone"
                )


def outlives_hostile_bytes(subject: Subject) -> None:
    """Check that an input takes random bytes, and gives values as it has declared them, or none."""
    if not issubclass(subject.block, Input):
        return
    random = np.random.default_rng(zlib.crc32(subject.block.__name__.encode()))
    own = subject.block.message_outputs()
    for rig in rigs(subject):
        received = bytearray()
        with rig.engine:
            for _ in range(PIECES):
                received += random.bytes(PIECE)
                for message in rig.block.decode(received):
                    _fits(rig, own, message)
                del received[:-KEPT]


def _fits(rig: Any, names: Sequence[str], message: Any) -> None:
    if isinstance(message, Counted):
        return
    count = len(message) if isinstance(message, tuple) else 1
    assert isinstance(message, tuple) and count == len(names), (
        f"decode must yield a tuple of {', '.join(names)} for each message, or a Counted, not {message!r}"
    )
    for name, value in zip(names, message, strict=True):
        shape = rig.placed.outputs[name].shape
        assert np.shape(value) == shape, f"decode gives {name} of shape {np.shape(value)}, not {shape}"
