"""That the methods of a numeric block do the same compiled as interpreted."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from quadvis.block import METHODS
from quadvis.engine.layout import TIME
from quadvis.engine.program import Op
from quadvis.native.block_type import BlockType, MethodType
from quadvis.native.library import library
from quadvis.testing.rig import PERIOD, STEPS, Rig, Subject, Whole, rigs, sources, targets

START = "start"


def compiles(subject: Subject) -> None:
    """Check that every method of a numeric block, compiled, agrees with the interpreted one.

    Over random inputs, some of them NaN, and random parameters; both start from the same memory at every
    call, so that a difference is found where it arises. They agree to the bit; one NaN is as good as another.
    Where the interpreted method raises an exception, the compiled one fails, too.
    """
    if not subject.block.numeric:
        return
    for rig in rigs(subject, missing=True):
        if not rig.block.numeric:  # as its parameters are
            continue
        calls = _compiled(rig)
        with rig.engine:
            for step in range(STEPS):
                rig.feed(step)
                _agree(rig, calls, step)


def _compiled(rig: Rig) -> dict[str, tuple[BlockType, Op]]:
    """Return a call of each of the block's methods, with the type in which it is compiled.

    A type of its own has ``start``, which a run calls interpreted: the other one is that of diagrams.
    """
    placed = rig.placed
    arguments = rig.block.interface.arguments
    ops = {
        method: Op(0, method, tuple(sources(placed, names)), tuple(targets(placed, method).values()))
        for method, names in arguments.items()
    }
    block = type(rig.engine.graph.nodes[0].block)
    calls: dict[str, tuple[BlockType, Op]] = {}
    for together in ([op for op in ops.values() if (op.method == START) is alone] for alone in (True, False)):
        if together:
            kind = BlockType.of(block, placed.record, tuple(map(MethodType.of, together)))
            library().prepare([kind])
            assert kind not in library().refusals, f"it cannot be compiled: {library().refusals[kind]}"
            calls |= {op.method: (kind, op) for op in together}
    return calls


def _agree(rig: Rig, calls: Mapping[str, tuple[BlockType, Op]], step: int) -> None:
    """Call every method both ways; then take an Euler step, to reach another state."""
    program, memory = rig.engine.program, rig.memory
    memory.write(TIME, float(step * PERIOD))
    for method in METHODS:
        call = getattr(rig.block, START, None) if method == START else rig.call(method)
        if call is None or (method == START and step > 0):
            continue
        before = rig.whole()
        failed = False
        try:
            call()
        except (ArithmeticError, ValueError, IndexError):
            failed = True
        interpreted = rig.whole()
        rig.put_back(before)
        kind, op = calls[method]
        passed = library().call(kind, op, memory, rig.placed.position)
        if failed:
            # What is an error when interpreted stops a run: there is no result to agree with.
            assert not passed, f"{method} at step {step}: interpreted, it raises an exception; compiled, none"
            rig.put_back(before)
        elif passed:
            _same(rig, interpreted, f"{method} at step {step}")
        else:
            rig.put_back(interpreted)  # the interpreter has the last word on what a compiled method refuses
    memory.floats[list(program.states)] += float(PERIOD) * memory.floats[list(program.slopes)]


def _same(rig: Rig, interpreted: Whole, where: str) -> None:
    placed, memory = rig.placed, rig.memory
    slots = {item.name: placed.field(item.name) for item in placed.record.fields}
    slots |= placed.outputs | {f"the derivative of {name}": slot for name, slot in placed.slopes.items()}
    compiled = {name: memory.read(slot) for name, slot in slots.items()}
    rig.put_back(interpreted)
    for name, slot in slots.items():
        wanted = memory.read(slot)
        assert _has_bits(compiled[name], wanted), (
            f"{where}: {name} is {wanted!r} interpreted, {compiled[name]!r} compiled"
        )


def _has_bits(found: Any, wanted: Any) -> bool:
    """Return whether all elements are equal, zeros with their signs; one NaN is as good as another."""
    a, b = np.asarray(found), np.asarray(wanted)
    if a.dtype.kind != "f":
        return bool(np.array_equal(a, b))
    return bool(
        np.array_equal(a, b, equal_nan=True) and (np.isnan(a) | (np.signbit(a) == np.signbit(b))).all()
    )
