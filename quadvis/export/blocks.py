"""The methods of blocks in C: block type by block type, from what numba makes of their Python."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

from quadvis.block import Block
from quadvis.engine.program import COPY, Op, Program
from quadvis.errors import QuadvisError
from quadvis.export.apart import written_apart
from quadvis.export.c_functions import SENTENCE, translated
from quadvis.export.c_types import Unexportable
from quadvis.export.selection import INPUT
from quadvis.native import cache
from quadvis.native.block_type import BlockType, MethodType
from quadvis.native.cache import MachineCode
from quadvis.native.library import surroundings
from quadvis.native.machine_code import Compiled, target_machine
from quadvis.native.runtime import RUNTIME

ROOM = Path(__file__).parent
PRELUDE = ROOM / "c" / "prelude.h"
TRANSLATOR = ("apart", "assembly_text", "blocks", "c_functions", "c_operations", "c_types")  # of this room
START = "start"
Announce = Callable[[str], None]


VECTOR = re.compile(r"<\d+ x ")  # in LLVM's text


class VectorFound(Exception):
    """The code has vectors, which C does not have."""


class BlockCode(NamedTuple):
    """The C of all blocks, and the functions of it by the number of the block and the method.

    Each takes first where it may leave the address of a sentence, as `why` in the text reads it. It returns 0
    unless it failed.
    """

    text: str
    names: Mapping[tuple[int, str], str]


def block_code(program: Program, blocks: Sequence[Block], announce: Announce | None = None) -> BlockCode:
    """Return the methods of a program's blocks in C; QuadvisError names the block that has none."""
    texts: dict[str, str] = {}
    names: dict[tuple[int, str], str] = {}
    for number, kinds in _kinds(program, blocks):
        for kind in kinds:
            prefix = f"{kind.block.__name__}_{hashlib.sha256(kind.text.encode()).hexdigest()[:12]}"
            if prefix not in texts:
                texts[prefix] = _translated(kind, prefix, program.blocks[number].path, announce)
            names |= {(number, method.name): f"{prefix}_{method.name}" for method in kind.methods}
    parts = [PRELUDE.read_text(encoding="utf-8"), *texts.values(), *_sentences("\n".join(texts.values()))]
    return BlockCode("\n".join(parts), names)


def _sentences(text: str) -> list[str]:
    """Return the C that tells a sentence of the blocks from another address that numba has left."""
    names = ", ".join([*SENTENCE.findall(text), "0"])
    return [
        f"static const char *const sentences[] = {{{names}}};",
        "static const char *why(const char *p) {",
        "    for (int k = 0; sentences[k]; k++)",
        "        if (sentences[k] == p) return p;",
        "    return 0;",
        "}",
    ]


def _kinds(program: Program, blocks: Sequence[Block]) -> Iterator[tuple[int, list[BlockType]]]:
    """Yield the types of each block: that of its calls, and one of its ``start``. Inputs are only copied."""
    calls: dict[int, list[Op]] = {number: [] for number in range(len(blocks))}
    phases = [phase for task in program.tasks for phase in task.phases.values()]
    between = (program.derivatives, program.crossings, program.events) if program.states else ()
    for op in chain.from_iterable((*phases, *between)):
        if op.method != COPY and program.blocks[op.block].kind != INPUT:
            calls[op.block].append(op)
    for number, ops in calls.items():
        record, block = program.blocks[number].record, type(blocks[number])
        found = [tuple(map(MethodType.of, ops))] if ops else []
        if START in block.interface.arguments:
            found.append((MethodType(START, (), ()),))
        yield number, [BlockType.of(block, record, methods) for methods in found]


def _translated(kind: BlockType, prefix: str, path: str, announce: Announce | None) -> str:
    """Return the C of a block type, which is kept; its functions and constants have the prefix."""
    facts = (surroundings(), [(ROOM / f"{name}.py").read_bytes() for name in TRANSLATOR], prefix, kind.text)
    key = hashlib.sha256(repr(facts).encode()).hexdigest()
    kept = cache.load(key)
    if kept is None:
        if announce:
            announce(f"writing {kind.block.__name__} in C, once")
        kept = MachineCode(_written_anywhere(kind, prefix, path).encode())
        cache.keep(key, kept)
    return kept.content.decode()


def _written_anywhere(kind: BlockType, prefix: str, path: str) -> str:
    """Write a block type in C; QuadvisError, with the block's path, if that cannot be.

    What this process has compiled with vectors, such as a sum, numba takes over as it is. Then a process that
    has compiled nothing yet writes it.
    """
    try:
        return written(kind, prefix, path)
    except VectorFound:
        return written_apart(kind, prefix, path)


def written(kind: BlockType, prefix: str, path: str) -> str:
    """Write a block type in C, in this process; VectorFound if numba brings code with vectors."""
    import numba

    from quadvis.native.compiler import compiled_methods

    try:
        with _without_vectors():
            compiled = dict(compiled_methods(kind))
        entries = [f"{prefix}_{name}" for name in compiled]
        text = _linked(compiled, prefix)
        if VECTOR.search(text):
            raise VectorFound
        return translated(text, entries, prefix)
    except (Unexportable, NotImplementedError, numba.core.errors.NumbaError) as error:
        cause = next((line.strip() for line in str(error).splitlines() if line.strip()), type(error).__name__)
        raise QuadvisError(
            f"block '{path}' ({kind.block.__name__}) cannot be written in C: {cause}"
        ) from error


def _linked(compiled: Mapping[str, Compiled], prefix: str) -> str:
    """Return LLVM's text of methods with all that they call, for any processor."""
    import llvmlite.binding as llvm

    machine = target_machine()
    modules = [llvm.parse_assembly(function.text) for function in compiled.values()]
    whole = modules[0]
    for module in modules[1:]:
        whole.link_in(module)
    calls = "\n".join(_entry(f"{prefix}_{name}", function) for name, function in compiled.items())
    for text in (calls, RUNTIME):
        part = llvm.parse_assembly(text)
        part.triple, part.data_layout = whole.triple, whole.data_layout
        whole.link_in(part)
    for value in (*whole.functions, *whole.global_variables):
        if not value.is_declaration and not value.name.startswith(f"{prefix}_"):
            value.linkage = "internal"
    options = llvm.create_pipeline_tuning_options(speed_level=2)
    options.loop_vectorization = options.slp_vectorization = False
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(whole, builder)
    return str(whole)


def _entry(name: str, function: Compiled) -> str:
    """Return LLVM's text of a function of pointers that returns numba's status.

    The first one is where numba leaves the address of its exception.
    """
    pointers = [f"ptr %p{number}" for number in range(function.pointers)]
    taken, types = ", ".join(("ptr %error", *pointers)), ", ".join(["ptr"] * (2 + len(pointers)))
    return (
        f'declare i32 @"{function.name}"({types})\n'
        f"define i32 @{name}({taken}) {{\n  %result = alloca i64\n"
        f'  %status = call i32 @"{function.name}"(ptr %result, {taken})\n  ret i32 %status\n}}\n'
    )


@contextmanager
def _without_vectors() -> Iterator[None]:
    """Have numba make no vectors, which C does not have."""
    from numba.core import config as settings

    config: Any = settings
    before = config.LOOP_VECTORIZE, config.SLP_VECTORIZE
    config.LOOP_VECTORIZE = config.SLP_VECTORIZE = 0
    try:
        yield
    finally:
        config.LOOP_VECTORIZE, config.SLP_VECTORIZE = before
