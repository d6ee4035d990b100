"""Warming: some ticks of a loop before its start, without effects, so that its first ticks are not slow.

What runs for the first time is slow: a library makes its tables, memory gets its pages, code is loaded. So
an application runs each task a few times before it is ready. Blocks that may reach outside are left out, and
so is a block that fails on what it gets then. After that the state of the engine is what it was, to the bit.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from quadvis.block import OUTSIDE, OWN_MODULES, Block, Frame
from quadvis.engine.engine import Engine
from quadvis.engine.interpreter import Stop
from quadvis.engine.program import Program
from quadvis.links.endpoints import LinkReceiver
from quadvis.native.choice import Choice, executor

TIMES = 3  # that each task runs


@np.errstate(all="ignore")
def warm(engine: Engine, choice: Choice) -> None:
    """Run each task of an opened engine a few times, as chosen, and restore all states and frames."""
    before = engine.snapshot()
    left_out = {number for number, node in enumerate(engine.graph.nodes) if _stays_out(node.block)}
    try:
        while (stop := _run(engine, choice, left_out)) is not None:
            engine.restore(before)
            if not left_out.isdisjoint(stop.blocks) or len(stop.blocks) != 1:
                return
            left_out.update(stop.blocks)
    finally:
        engine.restore(before)


def _run(engine: Engine, choice: Choice, left_out: Iterable[int]) -> Stop | None:
    """Run the ticks without some blocks; return what stopped them."""
    _show_pictures(engine)
    machine = executor(engine.apart(engine.program.quiet(frozenset(left_out))), choice)
    for tick in _ticks(engine.program):
        machine.tick = tick
        if stop := machine.run(tick + 1):
            return stop
    return None


def _ticks(program: Program) -> list[int]:
    """Return the first ticks of each task."""
    return sorted({task.offset + number * task.every for task in program.tasks for number in range(TIMES)})


def _show_pictures(engine: Engine) -> None:
    """Let links that carry pictures show black ones of the size for which they have room."""
    for node in engine.graph.nodes:
        if isinstance(node.block, LinkReceiver):
            for name, port in node.block.interface.outputs.items():
                if port.signal.scalar == "frame":
                    black = np.zeros((*node.block.link.room, 3), np.uint8)
                    engine.write(node.path, name, Frame(black, 0.0, 1))


def _stays_out(block: Block) -> bool:
    """Return whether a block reaches outside, or may not be as it was before.

    A user's own block that opens something may do either without saying so.
    """
    interface, kind = block.interface, type(block)
    reaches = bool(block.not_replayable) or not interface.arguments.keys().isdisjoint(OUTSIDE)
    reaches |= kind.write_safe is not Block.write_safe or bool(interface.files_written)
    is_unknown = kind.__module__.startswith(OWN_MODULES) and kind.open is not Block.open
    return reaches or bool(block.not_restorable) or is_unknown
