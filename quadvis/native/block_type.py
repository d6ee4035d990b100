"""Block types: what is compiled together.

A block type is a class, the layout of its record, and for each method the kinds and shapes of what it takes
and returns. Places in memory are not compiled in, so its machine code serves every block of the type in every
diagram.
"""

from __future__ import annotations

import types
from collections.abc import Sequence
from dataclasses import dataclass, field

from quadvis.block import Block, Shape
from quadvis.block.interface import CROSSING
from quadvis.engine.memory import Record, Slot
from quadvis.engine.program import Op
from quadvis.native.source import fingerprint

Kind = tuple[str, Shape]  # scalar and shape
COUNTED: tuple[Kind, ...] = (("int64", ()), ("float64", ()))  # how many values there must be; the first one


@dataclass(frozen=True)
class MethodType:
    """A method by name, and the kinds of what it takes and returns.

    What ``crossing`` returns goes, value by value, to neighbours outside of memory.
    """

    name: str
    arguments: tuple[Kind, ...]
    results: tuple[Kind, ...]

    @staticmethod
    def of(op: Op) -> MethodType:
        """Return the type of a call."""
        results = COUNTED if op.method == CROSSING else _kinds(op.targets)
        return MethodType(op.method, _kinds(op.sources), results)


@dataclass(frozen=True)
class BlockType:
    """A block's class, record and methods, which are compiled together, and a hash of their source.

    Classes that differ in their ports alone, such as those for each number of inputs, are one type if the
    rest is equal.
    """

    block: type[Block] = field(compare=False)
    record: Record
    methods: tuple[MethodType, ...]
    source: str

    @staticmethod
    def of(block: type[Block], record: Record, methods: tuple[MethodType, ...]) -> BlockType:
        """Return a block type as its source is now."""
        functions = [getattr(block, method.name) for method in methods]
        return BlockType(block, record, methods, fingerprint(*functions))

    @property
    def text(self) -> str:
        """All that decides over the machine code beside the software and the processor."""
        return repr((self.source, self.record, self.methods))

    def function(self, method: str) -> types.FunctionType:
        """Return a method as a plain function."""
        found: types.FunctionType = getattr(self.block, method)
        return found


def _kinds(slots: Sequence[Slot]) -> tuple[Kind, ...]:
    return tuple((slot.scalar, slot.shape) for slot in slots)
