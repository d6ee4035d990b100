"""The choice between the two ways to run a program: the interpreter, which starts at once, and machine code.

The choice depends on the program, the number of ticks and the cache alone, never on a measured time, so that
the same command always does the same.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.util import find_spec
from typing import TYPE_CHECKING

from quadvis.block import Block
from quadvis.engine.clock import Unpaced
from quadvis.engine.engine import Engine
from quadvis.engine.interpreter import Executor, Interpreter
from quadvis.engine.program import COPY, Program
from quadvis.engine.solver import TABLEAUS
from quadvis.errors import QuadvisError, counted, quoted, suggestion

if TYPE_CHECKING:
    from quadvis.native.block_type import BlockType
    from quadvis.native.clock import MachineClock

AUTO, PYTHON, NATIVE = ENGINES = ("auto", "python", "native")
Announce = Callable[[str], None]

SHORT = "since the run is short"
# Times on an ordinary machine (s), as the first guess of all: only their ratios matter.
CALL = 0.7e-6  # what machine code saves of a block's call
STAGE = 5e-6  # and of a stage of the solver
START = 0.08  # to load LLVM
LOAD = 0.001  # to load a block type
COMPILER = 0.6  # to load numba
COMPILE = 1.3  # to compile a block type
LOOK = 0.6e-3  # what the machine code of a block's functions saves of its call
COMPILE_FUNCTIONS = 10.0  # to compile them


@dataclass(frozen=True)
class Choice:
    """How a program is run: ``python`` or ``native``, and why if that was not asked for.

    ``types`` are the types of the blocks that can be compiled, by the number of the block.
    """

    engine: str
    reason: str = ""
    types: Mapping[int, BlockType] = field(default_factory=dict, repr=False)

    def __str__(self) -> str:
        return f"{self.engine}, {self.reason}" if self.reason else self.engine


def choose(
    engine: Engine, ticks: int, wanted: str = AUTO, announce: Announce | None = None, *, paced: bool = False
) -> Choice:
    """Choose how to run so many ticks; QuadvisError if machine code is wanted and cannot be had.

    What has to be compiled for the choice is compiled, and announced. If none is wanted, a ``paced`` run,
    whose length the clock gives, takes machine code if some blocks have it and nothing has to be compiled.
    """
    if wanted not in ENGINES:
        some = suggestion(wanted, ENGINES) or f"choose one of {', '.join(ENGINES)}"
        raise QuadvisError(f"there is no engine {quoted(wanted)}; {some}")
    if wanted == PYTHON:
        return Choice(PYTHON)
    if find_spec("llvmlite") is None or find_spec("numba") is None:
        if wanted == NATIVE:
            raise QuadvisError("the engine 'native' needs the package numba; install it, or choose 'python'")
        return Choice(PYTHON, "since numba is not installed")
    program, blocks = engine.program, [node.block for node in engine.graph.nodes]
    seen = _seen(program, blocks, ticks)
    saved = seen + _saved(program, blocks, ticks)
    if wanted == AUTO and saved < START and not paced:
        return Choice(PYTHON, SHORT)
    from quadvis.native.functions import load, prepare
    from quadvis.native.library import block_types, library

    types = block_types(program, blocks)
    kinds = list(dict.fromkeys(types.values()))
    missing = library().missing(kinds)
    rooms = {block.functions: type(block).__name__ for block in blocks if block.functions}
    absent = [name for functions, name in rooms.items() if not load(functions)]
    if wanted == AUTO and seen < COMPILE_FUNCTIONS * len(absent):
        absent, saved = [], saved - seen  # they stay interpreted
    compiled = COMPILE * len(missing) + COMPILE_FUNCTIONS * len(absent)
    cost = START + LOAD * (len(kinds) + len(rooms)) + (COMPILER + compiled if compiled else 0.0)
    which = " and ".join(
        [
            *([counted(len(missing), "block type")] if missing else []),
            *(f"what {name} calls" for name in absent),
        ]
    )
    if wanted == AUTO and paced and (which or not (kinds or rooms)):
        lacking = f"{which} would have to be compiled, once; 'native' does it"
        return Choice(PYTHON, f"since {lacking if which else 'no block can be compiled'}")
    if wanted == AUTO and not paced and saved < cost:
        why = f"since compiling {which} would take about {cost:.0f} s, once; 'native' does it"
        return Choice(PYTHON, why if which else SHORT)
    if which and announce:
        announce(f"compiling {which}, once: about {cost:.0f} s")
    library().prepare(kinds, announce)
    for functions, name in rooms.items():
        if name in absent:
            prepare(functions)
    refused = {kind.block.__name__: library().refusals[kind] for kind in kinds if kind in library().refusals}
    names = ", ".join(f"{name} ({why})" for name, why in refused.items())
    if program.states and program.solver not in TABLEAUS:
        names = ", ".join(filter(None, (names, f"the solver {program.solver}, which is scipy's")))
    return Choice(NATIVE, f"but interpreted: {names}" if names else "", types)


def _saved(program: Program, blocks: Sequence[Block], ticks: int) -> float:
    """Return how many seconds machine code saves in a run, without the time to load it."""
    found = 0.0
    for task in program.tasks:
        calls = sum(
            op.method == COPY or blocks[op.block].numeric
            for ops in (task.delays, task.latches, *task.phases.values())
            for op in ops
        )
        found += CALL * calls * max(0, ticks - task.offset) / task.every
    if program.states and program.solver in TABLEAUS:
        stages = len(TABLEAUS[program.solver].nodes)
        calls = len(program.derivatives) + len(program.minor)
        found += ticks * stages * (STAGE + CALL * calls)
    return found


def _seen(program: Program, blocks: Sequence[Block], ticks: int) -> float:
    """Return how many seconds the machine code of blocks' functions saves in a run."""
    return sum(
        LOOK * bool(blocks[op.block].functions) * max(0, ticks - task.offset) / task.every
        for task in program.tasks
        for op in task.phases["output"]
    )


def use(engine: Engine, choice: Choice, clock: MachineClock | None = None) -> None:
    """Let an engine run as chosen, from now on; the compiled loop asks ``clock``, if given, for each tick."""
    if choice.engine != NATIVE:
        return
    engine.run_with(lambda interpreter: executor(interpreter, choice, clock))
    if clock is not None:
        engine.clock = Unpaced()


def executor(interpreter: Interpreter, choice: Choice, clock: MachineClock | None = None) -> Executor:
    """Return what runs a program as chosen, over the memory of its interpreter."""
    if choice.engine != NATIVE:
        return interpreter
    from quadvis.native.executor import NativeExecutor
    from quadvis.native.library import library

    compiled, types = library(), choice.types
    return NativeExecutor(
        interpreter,
        compiled.loop(),
        lambda op: compiled.function(types[op.block], op.method) if op.block in types else None,
        clock,
    )


def interpreted(engine: Engine, choice: Choice) -> set[str]:
    """Return the paths of the blocks that Python runs."""
    paths = {block.path for block in engine.program.blocks}
    if choice.engine != NATIVE:
        return paths
    from quadvis.native.library import library

    refused = library().refusals
    return paths - {
        engine.program.blocks[number].path for number, kind in choice.types.items() if kind not in refused
    }
