"""The check that compiled methods of a numeric block give the same results as interpreted methods."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from quadvis.block import METHODS, Block
from quadvis.engine.layout import TIME, Placed
from quadvis.native.compiler import Compiled, Compiler
from quadvis.testing.rig import PERIOD, STEPS, Rig, Subject, Whole, rigs, sources, targets

# Compiled and interpreted results agree to the last bit where both methods use the functions of the C library
# and the same order of summation. numba promises neither on every machine, so the last few bits may differ.
TOLERANCE = 1e-12


def compiles(subject: Subject) -> None:
    """Check that every compiled method of a numeric block agrees with the interpreted method.

    Inputs and parameters are random, and some inputs are NaN. Both methods start from the same memory at
    every call, so that errors do not add up. Whole numbers agree exactly, floats to ``TOLERANCE``, absolute
    and relative.
    """
    if not subject.block.numeric:
        return
    known: dict[Any, dict[str, Compiled]] = {}
    for rig in rigs(subject, missing=True):
        placed = rig.placed
        shapes = tuple(slot.shape for slot in (*placed.inputs.values(), *placed.outputs.values()))
        compiled = known.get((placed.record, shapes)) or _compile(subject.block, placed)
        known[placed.record, shapes] = compiled
        with rig.engine:
            for step in range(STEPS):
                rig.feed(step)
                _agree(rig, compiled, step)


def _compile(block: type[Block], placed: Placed) -> dict[str, Compiled]:
    compiler = Compiler(block, placed.record)
    return {
        method: compiler.compile(method, sources(placed, names), list(targets(placed, method).values()))
        for method, names in block.interface.arguments.items()
    }


def _agree(rig: Rig, compiled: Mapping[str, Compiled], step: int) -> None:
    """Compare every method in both forms; then take an Euler step, to reach another state."""
    program, memory = rig.engine.program, rig.memory
    memory.write(TIME, float(step * PERIOD))
    for method in METHODS:
        call = getattr(rig.block, "start", None) if method == "start" else rig.call(method)
        if call is None or (method == "start" and step > 0):
            continue
        before = rig.whole()
        try:
            call()
        except (ArithmeticError, ValueError):
            # An error of the interpreted method stops a run, so there is no result to compare with.
            rig.put_back(before)
            continue
        interpreted = rig.whole()
        rig.put_back(before)
        compiled[method](memory, rig.placed.position)
        _same(rig, interpreted, f"{method} at step {step}")
    memory.floats[list(program.states)] += float(PERIOD) * memory.floats[list(program.slopes)]


def _same(rig: Rig, interpreted: Whole, where: str) -> None:
    placed, memory = rig.placed, rig.memory
    slots = {item.name: placed.field(item.name) for item in placed.record.fields}
    slots |= placed.outputs | {f"the derivative of {name}": slot for name, slot in placed.slopes.items()}
    compiled = {name: memory.read(slot) for name, slot in slots.items()}
    rig.put_back(interpreted)
    for name, slot in slots.items():
        wanted = memory.read(slot)
        tolerance = TOLERANCE if slot.scalar == "float64" else 0.0
        same = np.allclose(compiled[name], wanted, rtol=tolerance, atol=tolerance, equal_nan=True)
        assert same, f"{where}: {name} is {wanted} interpreted, {compiled[name]} compiled"
