"""The compiled methods of this process: loaded from the cache, or compiled and kept there.

A block type is compiled once for all diagrams; its machine code is loaded once a process.
"""

from __future__ import annotations

import ctypes
import functools
import hashlib
import platform
import sys
from collections.abc import Iterable, Sequence
from importlib.util import find_spec
from itertools import chain
from pathlib import Path
from typing import Any

from quadvis.block import Block
from quadvis.engine.memory import SLOT, Memory
from quadvis.engine.program import Op, Program
from quadvis.engine.solver import TABLEAUS
from quadvis.native import cache
from quadvis.native.block_type import BlockType, MethodType
from quadvis.native.cache import MachineCode
from quadvis.native.choice import Announce
from quadvis.native.functions import NativeFunction
from quadvis.native.loop import POINTERS, loop
from quadvis.native.machine_code import Loaded, processor
from quadvis.native.routine import ROUTINE, Routine
from quadvis.native.tables import Function

LOOP = Routine(loop, POINTERS)
COMPILER = (
    "arrays",
    "block_type",
    "checked",
    "compiler",
    "functions",
    "foreign",
    "machine_code",
    "runtime",
    "source",
)  # of this room


class Library:
    """Compiled methods by block type."""

    def __init__(self) -> None:
        self._loaded = Loaded()
        self._functions: dict[BlockType | str, dict[str, Function]] = {}
        self.refusals: dict[BlockType, str] = {}

    def routine(self, routine: Routine) -> int:
        """Return the address of a compiled routine."""
        text = routine.text
        if text not in self._functions:
            key = _key(text)
            code = cache.load(key)
            if code is None or not self._add(text, code):
                self._compile_routine(routine, key)
        return self._functions[text][ROUTINE].address

    def _compile_routine(self, routine: Routine, key: str) -> None:
        from quadvis.native.compiler import compile_routine

        with cache.claim(key):
            code = cache.load(key)  # another process may have been at it
            if code is None or not self._add(routine.text, code):
                self._add(routine.text, _kept(key, compile_routine(routine, _prefix(key))))

    def loop(self) -> int:
        """Return the address of the compiled loop."""
        return self.routine(LOOP)

    def missing(self, kinds: Iterable[BlockType]) -> list[BlockType]:
        """Load block types that are kept; return those that must be compiled."""
        return [kind for kind in kinds if kind not in self._functions and not self._load(kind)]

    def _load(self, kind: BlockType) -> bool:
        code = cache.load(_key(kind.text))
        return code is not None and self._add(kind, code)

    def prepare(self, kinds: Iterable[BlockType], announce: Announce | None = None) -> None:
        """Load block types, and compile those that are not kept; last those that another process compiles."""
        missing = self.missing(kinds)
        places = {kind: f"{number} of {len(missing)} block types" for number, kind in enumerate(missing, 1)}
        claimed = [kind for kind in missing if not self._compile(kind, places[kind], announce, wait=False)]
        for kind in claimed:
            if announce:
                announce(f"waiting for another process, which compiles {kind.block.__name__}")
            self._compile(kind, places[kind], announce, wait=True)

    def _compile(self, kind: BlockType, place: str, announce: Announce | None, *, wait: bool) -> bool:
        """Compile a block type that is still not kept; return whether no other process has claimed it."""
        key = _key(kind.text)
        with cache.claim(key, wait=wait) as granted:
            if granted and not self._load(kind):
                from quadvis.native.compiler import compile_block

                if announce:
                    announce(f"compiling {kind.block.__name__}, {place}, once")
                self._add(kind, _kept(key, compile_block(kind, _prefix(key))))
        return granted

    def load_functions(self, functions: Sequence[NativeFunction]) -> bool:
        """Bind functions that are kept together; return whether they are."""
        code = cache.load(_key(repr([function.text for function in functions])))
        return code is not None and self._bind(functions, code)

    def compile_functions(self, functions: Sequence[NativeFunction]) -> None:
        """Compile functions together, keep and bind them."""
        from quadvis.native.compiler import compile_functions

        key = _key(repr([function.text for function in functions]))
        with cache.claim(key):
            if not self.load_functions(functions):  # another process may have been at it
                self._bind(functions, _kept(key, compile_functions(functions, _prefix(key))))

    def _bind(self, functions: Sequence[NativeFunction], code: MachineCode) -> bool:
        if not code.refusal:
            if code.names is None or code.names.keys() != {function.__name__ for function in functions}:
                return False
            try:
                self._loaded.add(code.content)
            except RuntimeError:
                return False
            for function in functions:
                function.bind(self._loaded.address(code.names[function.__name__]))
        return True

    def _add(self, kind: BlockType | str, code: MachineCode) -> bool:
        """Make code callable; return whether it is what it should be."""
        functions: dict[str, Function] = {}
        if code.refusal:
            assert isinstance(kind, BlockType)
            self.refusals[kind] = code.refusal
        elif code.names is not None:
            try:
                self._loaded.add(code.content)
            except RuntimeError:
                return False
            for method, name in code.names.items():
                functions[method] = Function(self._loaded.address(name), method in code.fallible)
        self._functions[kind] = functions
        return True

    def function(self, kind: BlockType, method: str) -> Function | None:
        """Return a method's machine code; None if it has none."""
        return self._functions[kind].get(method)

    def call(self, kind: BlockType, op: Op, memory: Memory, position: int) -> bool:
        """Call a compiled method on a record at a position in memory; return whether it did not fail."""
        function = self._functions[kind][op.method]
        base = memory.floats.ctypes.data
        positions = [position, *(slot.position for slot in (*op.sources, *op.targets))]
        places = (ctypes.c_int64 * len(positions))(*(base + SLOT * place for place in positions))
        run = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_void_p)(function.address)
        return not run(ctypes.addressof(places))


@functools.cache
def library() -> Library:
    """Return the library of this process."""
    return Library()


def block_types(program: Program, blocks: Sequence[Block]) -> dict[int, BlockType]:
    """Return the types of those blocks of a program that can be compiled, by the number of the block."""
    calls: dict[int, list[Op]] = {}
    phases = [phase for task in program.tasks for phase in task.phases.values()]
    between = [program.derivatives]
    if program.states and program.solver in TABLEAUS:
        between += [program.crossings, program.events]
    for op in chain.from_iterable((*phases, *between)):
        calls.setdefault(op.block, []).append(op)
    known: dict[tuple[Any, ...], BlockType] = {}
    found = {}
    for number, ops in calls.items():
        if blocks[number].numeric:
            key = (type(blocks[number]), program.blocks[number].record, tuple(map(MethodType.of, ops)))
            found[number] = known.get(key) or known.setdefault(key, BlockType.of(*key))
    return found


def _kept(key: str, code: MachineCode) -> MachineCode:
    if not code.passing:
        cache.keep(key, code)
    return code


def _prefix(key: str) -> str:
    """Return the beginning of the names of functions; no two object files have the same."""
    return f"quadvis_{key[:24]}"


def _key(text: str) -> str:
    return hashlib.sha256(f"{surroundings()}\n{text}".encode()).hexdigest()


@functools.cache
def surroundings() -> str:
    """Return all that machine code depends on beside the blocks: software, processor, and the compiler."""
    room = hashlib.sha256()
    for name in COMPILER:
        room.update((Path(__file__).parent / f"{name}.py").read_bytes())
    versions = [f"{name} {_version(name)}" for name in ("numba", "llvmlite", "numpy")]
    return repr((sys.version, platform.machine(), platform.system(), versions, processor(), room.hexdigest()))


def _version(name: str) -> str:
    """Return the version of a package, which may not be installed; as a rule the name of a folder has it."""
    spec = find_spec(name)
    if spec is None or spec.origin is None:
        return ""
    found = sorted(path.name for path in Path(spec.origin).parents[1].glob(f"{name}-*-info"))
    if found:
        return ", ".join(found)
    from importlib.metadata import PackageNotFoundError, version  # takes longer than all of LLVM

    try:
        return version(name)
    except PackageNotFoundError:
        return ""
