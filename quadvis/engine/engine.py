"""The engine: the life of a run, from opened blocks over ticks to closed blocks; see quadvis/README.md."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Self

import numpy as np

from quadvis.block import Block
from quadvis.engine.clock import Clock, Unpaced
from quadvis.engine.interpreter import Call, Executor, Interpreter, Stop
from quadvis.engine.memory import Memory, Slot
from quadvis.engine.profile import Profile, ProfileReport, TimedMethod
from quadvis.engine.program import Program, make_program
from quadvis.engine.stability import Marks, StatePole, poles
from quadvis.engine.stops import cannot, explained
from quadvis.engine.taps import MachineCall, Observer, Tap
from quadvis.engine.tuning import Tuning
from quadvis.errors import QuadvisError
from quadvis.graph.graph import Constant, Graph
from quadvis.machine.garbage import uncollected


@dataclass(frozen=True)
class Snapshot:
    """The whole state of a run between two ticks."""

    tick: int
    memory: bytes
    frames: tuple[Any, ...]
    kept: tuple[Any, ...] = ()  # what blocks keep outside of memory, by the order of those that do


class Engine:
    """Runs one checked graph. Use as a context manager: blocks are opened on entry and always closed.

    A NaN where none belongs or an exception in a block raises RunError with block, port and time. The program
    and its memory are public: ``program`` says where everything lies, ``memory`` holds it.
    """

    @uncollected()
    def __init__(self, graph: Graph, seed: int = 0, clock: Clock | None = None, buffer: Any = None) -> None:
        self.graph = graph
        self.program: Program = make_program(graph, seed)
        self.period: Fraction = self.program.period
        self.clock = clock or Unpaced()
        self._interpreter = Interpreter(self.program, [node.block for node in graph.nodes], buffer)
        self._executor: Executor = self._interpreter
        self._selves = self._interpreter.selves
        self.memory: Memory = self._interpreter.memory
        self._marks = Marks(self._interpreter)
        self.tuning = Tuning(self.program, {node.path: node.block for node in graph.nodes}, self.memory)
        blocks = enumerate(self._selves)
        self._keepers = [number for number, block in blocks if type(block).keep is not Block.keep]
        self._opened: list[int] = []
        self._ready: list[int] = []  # those whose ``open`` succeeded: their outputs must end at safe values
        for node, block in zip(graph.nodes, self.program.blocks, strict=True):
            for port, source in node.inputs.items():
                if isinstance(source, Constant) and block.inputs[port].scalar == "frame":
                    self.memory.write(block.inputs[port], source.value)

    def end_before(self, ticks: int) -> None:
        """Let the blocks know that the run ends before a tick."""
        for block in self._selves:
            if not block.numeric:
                block.until = float((ticks - 1) * self.period)

    @property
    def tick(self) -> int:
        """The next tick."""
        return self._executor.tick

    @property
    def time(self) -> float:
        """Time of the next tick (s)."""
        return float(self.tick * self.period)

    @np.errstate(all="ignore")  # as in a run
    def __enter__(self) -> Self:
        numbers = range(len(self._selves))
        try:
            for number in numbers:
                self._guarded(number, "verify_files")
                if self._selves[number].period != self.graph.nodes[number].block.period:
                    self._guarded(number, "check")  # with a period that it did not know when it was made
            for number in numbers:
                self._opened.append(number)
                self._guarded(number, "open")
                self._ready.append(number)
            for number in numbers:
                if "start" in self._selves[number].interface.arguments:
                    self._guarded(number, "start")
        except BaseException as error:
            self._close(error)
            raise
        return self

    def __exit__(self, _: object, error: BaseException | None, __: object) -> None:
        self._close(error)

    def _close(self, cause: BaseException | None) -> None:
        """Write all safe values, then close every block that was opened, the last one first.

        What goes wrong then must not hide what went wrong before, nor keep another block from its end.
        """
        worst = cause
        ends = [(number, "write_safe") for number in reversed(self._ready)]
        ends += [(number, "close") for number in reversed(self._opened)]
        self._ready.clear()
        self._opened.clear()
        for number, method in ends:
            try:
                self._guarded(number, method)
            except BaseException as error:
                if worst is None:
                    worst = error
                else:
                    worst.add_note(str(error))
        if worst is not None and worst is not cause:
            raise worst

    def _guarded(self, number: int, method: str) -> None:
        try:
            given = (self.time,) if method == "write_safe" else ()
            getattr(self._selves[number], method)(*given)
        except Exception as error:
            path, block = self.program.blocks[number].path, self._selves[number]
            raise cannot(method, path, block, error, self.time) from error

    def run_with(self, make: Callable[[Interpreter], Executor]) -> None:
        """Run with another executor from the next tick on; it works over the interpreter's memory."""
        self._executor = make(self._interpreter)

    def apart(self, program: Program) -> Interpreter:
        """Return what runs another program over the same memory and blocks, beside the engine's own."""
        return self._interpreter.apart(program)

    def prepare(self) -> None:
        """Do now what would take time at the first tick."""
        self._executor.prepare()

    def attach(self, tap: Tap) -> None:
        """Have a block's rows taken from now on."""
        self._executor.attach(tap)

    def observe(
        self, task: str, call: Callable[[int], None], every: int = 1, machine: MachineCall | None = None
    ) -> Observer:
        """Call ``call(tick)`` at a task's first and then every so many of its ticks, until it is detached.

        It is called when the outputs are there and before the updates, as taps are. ``machine`` does the same
        as machine code.
        """
        observer = Observer(task, every, call, machine)
        self._executor.attach(observer)
        return observer

    def detach(self, observer: Tap | Observer) -> None:
        """Take no rows any more, or do no more what was done at the ticks of a task."""
        self._executor.detach(observer)

    @np.errstate(all="ignore")  # what is not finite is found here, and reported with its block
    def run(self, ticks: int) -> None:
        """Run that many ticks, without those that the clock leaves out."""
        end = self.tick + ticks
        if self.program.states and isinstance(self.clock, Unpaced):
            self._marks.note()
        while self.tick < end:
            due = self.clock.wait(self.tick, end)
            self._executor.tick = due.start
            self.tuning.apply(self.tick)
            stop = self._executor.run(due.stop)
            if stop is not None:
                raise self.explained(stop) from stop.error

    def explained(self, stop: Stop) -> QuadvisError:
        """Return the error that a stop of an executor means, to be raised."""
        return explained(stop, self.graph, self.program, self.memory, self._marks)

    def poles(self) -> list[StatePole]:
        """Return the poles of the continuous states between two ticks, the fastest first."""
        return poles(self._interpreter)

    def hold_safe(self) -> None:
        """Write the safe values of all blocks, and let no block write any more; everything else goes on."""
        for number in reversed(self._ready):
            self._guarded(number, "write_safe")
        self._executor.leave_writes()

    def measure(self, profile: Callable[[], Profile] | None = None) -> None:
        """Time every call of a block, from the first tick on; before another executor is chosen.

        With ``profile``, which gives one to each thread, calls are timed only as `time_calls` says.
        """
        self._interpreter.measure(profile or (lambda: Profile(len(self.program.blocks))))
        if profile is None:
            self.time_calls(1)

    def time_calls(self, measurement: int) -> None:
        """Time the calls of blocks from the next tick on if the number of the measurement is odd.

        With an even one they are timed no more. `measure` comes before it.
        """
        self._executor.time_calls(measurement)

    @property
    def timed_methods(self) -> list[list[TimedMethod]]:
        """The methods that each profile times, by their numbers, now that the engine is prepared."""
        blocks = self.program.blocks
        return [
            [TimedMethod(blocks[block].path, method, blocks[block].task) for block, method in profile.methods]
            for profile in self._interpreter.profiles
        ]

    def profile(self) -> ProfileReport:
        """Return the times of the calls since `measure`."""
        pairs = zip(self._interpreter.profiles, self.timed_methods, strict=True)
        return ProfileReport.of(pairs, 1) or ProfileReport((), (), Profile.cost())

    def snapshot(self) -> Snapshot:
        """Return the whole state between two ticks.

        A solver of variable step begins anew there, so that a restored run repeats to the bit.
        """
        self._interpreter.restart()
        kept = tuple([self._selves[number].keep() for number in self._keepers])
        return Snapshot(self.tick, self.memory.content(), tuple(self.memory.frames), kept)

    def restore(self, snapshot: Snapshot) -> None:
        """Go back to a snapshot of the same graph; the run from there repeats to the bit."""
        memory = self.memory
        if (len(snapshot.memory), len(snapshot.frames)) != (len(memory.raw), len(memory.frames)):
            raise ValueError("the snapshot is of another graph")
        memory.raw[:] = snapshot.memory
        memory.frames[:] = snapshot.frames
        self._interpreter.restart()
        self._executor.tick = snapshot.tick
        for number, kept in zip(self._keepers, snapshot.kept, strict=True):
            try:
                self._selves[number].put_back(kept)
            except Exception as error:
                path, block = self.program.blocks[number].path, self._selves[number]
                raise cannot("go back", path, block, error, self.time) from error

    def slot(self, path: str, name: str) -> Slot:
        """Return the slot of a block's output, parameter, state or input; KeyError if it does not exist."""
        block = self.program[path]
        for slots in (block.outputs, block.inputs):
            if name in slots:
                return slots[name]
        return block.field(name)

    def read(self, path: str, name: str) -> Any:
        """Return the present value of a block's output, parameter, state or input."""
        return self.memory.read(self.slot(path, name))

    def write(self, path: str, name: str, value: Any) -> None:
        """Store a value in a block's output, parameter, state or input; nothing checks it, see ``tuning``."""
        self.memory.write(self.slot(path, name), value)

    def call(self, path: str, method: str) -> Call | None:
        """Return a call of a block's method from slots to slots; None if the block has no such method."""
        op = self.program.op(path, method)
        return None if op is None else self._interpreter.call(op)

    def bound(self, path: str) -> Any:
        """Return a block as its methods see it, bound to memory."""
        return self._selves[self.program.number(path)]
