"""The engine, Python tier: runs a plan tick by tick, deterministic to the bit.

The life of one tick, at time t = tick * base period: delayed copies, outputs of the blocks that are due,
observers (log), updates of the same blocks, continuous states to t + base period. Blocks that are due at one
tick run in one dependency order, whatever their rates. Between ticks a signal is what it was at its
block's last one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from itertools import chain
from math import isnan
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from quadvis.block import ParameterError
from quadvis.engine.graph import Graph
from quadvis.engine.plan import TIME, Bound, Call, Plan, make_plan
from quadvis.engine.solver import Solver, Vector
from quadvis.errors import QuadvisError, RunError, sentence
from quadvis.machine.failures import MEMORY, arithmetic, is_short_of_memory, surroundings

SHOWN = 4  # numbers in a message
SMALLER_STEP = "a smaller solver step may help"
Observer = Callable[[int], None]  # takes the tick, after the outputs of a step


@dataclass(frozen=True)
class Snapshot:
    """The whole state of a run between two ticks."""

    tick: int
    memory: bytes
    frames: tuple[Any, ...]


@dataclass(frozen=True)
class _Rhythm:
    """Something that happens every so many ticks from an offset on: a task, or the observation of one."""

    task: str
    every: int
    offset: int


@dataclass
class _Step:
    """What one combination of due rhythms does at a tick."""

    delays: list[Call]
    outputs: list[Call]
    updates: list[Call]
    finite: NDArray[np.intp]
    zeros: NDArray[np.float64]
    observers: list[Observer]
    blocks: list[Bound]


class Engine:
    """Runs one checked graph. Use as a context manager: blocks are opened on entry and always closed.

    A NaN where none belongs or an exception in a block raises RunError with block, port and time.
    """

    def __init__(self, graph: Graph, seed: int = 0) -> None:
        self.graph = graph
        self.plan: Plan = make_plan(graph, seed)
        self.tick = 0
        self.period: Fraction = graph.tick
        self._tasks = {
            task.name: _Rhythm(task.name, graph.ticks(task.period), graph.ticks(task.offset))
            for task in graph.tasks
        }
        self._observers: list[tuple[_Rhythm, Observer]] = []
        self._rhythms = list(self._tasks.values())
        self._steps: dict[tuple[bool, ...], _Step] = {}
        self._opened: list[Bound] = []
        self._solver = Solver(graph.solver, float(self.period))

    @property
    def time(self) -> float:
        """Time of the next tick (s)."""
        return float(self.tick * self.period)

    @np.errstate(all="ignore")  # as in a run
    def __enter__(self) -> Self:
        try:
            for bound in self.plan.steps:
                self._guarded(bound, "verify_files")
                self._guarded(bound, "check_period")
            for bound in self.plan.steps:
                self._opened.append(bound)
                self._guarded(bound, "open")
            for bound in self.plan.steps:
                if "start" in bound.node.block.interface.arguments:
                    self._guarded(bound, "start")
        except BaseException as error:
            self._close(error)
            raise
        return self

    def __exit__(self, _: object, error: BaseException | None, __: object) -> None:
        self._close(error)

    def _close(self, cause: BaseException | None) -> None:
        """Close every block that was opened; what goes wrong then must not hide what went wrong before."""
        worst = cause
        while self._opened:
            try:
                self._guarded(self._opened.pop(), "close")
            except BaseException as error:
                if worst is None:
                    worst = error
                else:
                    worst.add_note(str(error))
        if worst is not None and worst is not cause:
            raise worst

    def _guarded(self, bound: Bound, method: str) -> None:
        try:
            getattr(bound.self, method)()
        except Exception as error:
            raise self._failure(bound, error, method) from error

    def observe(self, task: str, observer: Observer, every: int = 1) -> None:
        """Call ``observer(tick)`` at a task's first and then every so many of its ticks.

        It is called when the outputs are there and before the updates. A restored run is observed at the same
        ticks as the first one.
        """
        own = self._tasks[task]
        rhythm = _Rhythm(task, own.every * every, own.offset)
        self._observers.append((rhythm, observer))
        if rhythm not in self._rhythms:
            self._rhythms.append(rhythm)
        self._steps.clear()

    @np.errstate(all="ignore")  # what is not finite is found here, and told with its block
    def run(self, ticks: int) -> None:
        """Run that many ticks."""
        end = self.tick + ticks
        floats = self.plan.memory.floats
        clock = self.plan.memory.raw.cast("d")  # one element costs a third of a numpy array's
        rhythms = [(rhythm.every, rhythm.offset) for rhythm in self._rhythms]
        period, denominator = self.period.as_integer_ratio()
        continuous = self.plan.continuous.size > 0
        while self.tick < end:
            tick = self.tick
            due = tuple([(tick - offset) % every == 0 and tick >= offset for every, offset in rhythms])
            step = self._steps.get(due) or self._prepare(due)
            # An exact product, so that time has no drift; the quotient of integers is rounded once.
            clock[TIME.position] = tick * period / denominator
            self._perform(step.delays)
            self._perform(step.outputs)
            if isnan(floats.take(step.finite).dot(step.zeros)):
                raise self._not_finite(step)
            for observe in step.observers:
                observe(tick)
            self._perform(step.updates)
            if continuous:
                self._integrate(clock[TIME.position])
            self.tick = tick + 1

    def _perform(self, calls: list[Call]) -> None:
        call = None
        try:
            for call in calls:
                call()
        except Exception as error:
            assert call is not None
            raise self._failure(self.plan.owner(call), error) from error

    def _prepare(self, due: tuple[bool, ...]) -> _Step:
        rhythms = [rhythm for rhythm, flag in zip(self._rhythms, due, strict=True) if flag]
        names = [name for name, rhythm in self._tasks.items() if rhythm in rhythms]
        blocks = [bound for bound in self.plan.steps if bound.node.task.name in names]
        finite = self.plan.finite(blocks)
        made = _Step(
            list(chain.from_iterable(self.plan.delays.get(name, []) for name in names)),
            [bound.output for bound in blocks if bound.output],
            [bound.update for bound in blocks if bound.update],
            finite,
            np.zeros(finite.size),
            [observe for rhythm, observe in self._observers if rhythm in rhythms],
            blocks,
        )
        self._steps[due] = made
        return made

    def _integrate(self, time: float) -> None:
        plan = self.plan
        raw, floats = plan.memory.raw, plan.memory.floats
        # Minor steps write over time and signals, but delays and readers want those of the tick.
        held = bytes(raw[plan.held])
        self._perform(plan.derivatives)
        state = self._solver.advance(self._rates, time, floats[plan.continuous], floats[plan.slopes])
        raw[plan.held] = held
        floats[plan.continuous] = state
        if not np.isfinite(state).all():
            raise self._not_finite_state()

    def _rates(self, time: float, state: Vector) -> Vector:
        """Return the derivative at a minor step."""
        plan = self.plan
        floats = plan.memory.floats
        floats[TIME.position] = time
        floats[plan.continuous] = state
        self._perform(plan.minor)
        self._perform(plan.derivatives)
        return floats[plan.slopes]

    def _failure(self, bound: Bound, error: Exception, method: str = "") -> QuadvisError:
        """Return an error that says in which block and when another one happened."""
        path = bound.node.path
        if isinstance(error, RunError) and error.block:
            return error
        if isinstance(error, ParameterError):
            return ParameterError(error.parameter, f"block '{path}': {error}")
        if method:
            return RunError(f"cannot {method}: {self._reason(error)}", block=path, time=self.time)
        if not arithmetic(error):
            return RunError(self._reason(error), block=path, time=self.time)
        outputs = list(bound.node.block.interface.outputs)
        reason = sentence(f"{arithmetic(error)}{self._inputs(bound)}", self._remedy(bound))
        return RunError(reason, block=path, port=outputs[0] if len(outputs) == 1 else "", time=self.time)

    @staticmethod
    def _reason(error: Exception) -> str:
        """Return what went wrong in a block."""
        if isinstance(error, QuadvisError):
            return str(error)
        if problem := arithmetic(error):
            return problem
        if is_short_of_memory(error):
            return MEMORY
        if isinstance(error, RecursionError):
            return surroundings(error)
        return f"{type(error).__name__}: {error}"

    def _inputs(self, bound: Bound) -> str:
        """Return the single numbers that a block reads now, a few of them."""
        slots = {port: slot for port, slot in bound.inputs.items() if slot.scalar != "frame"}
        found = [
            f"{port} = {self.plan.memory.read(slot):g}" for port, slot in slots.items() if not slot.shape
        ]
        return f" ({', '.join(found[:SHOWN])}{', ...' * (len(found) > SHOWN)})" if found else ""

    def _remedy(self, bound: Bound) -> str:
        """Return that a smaller step may help if the solver integrates a state that has its share in it."""
        waiting, seen = [bound], {bound.node.path}
        while waiting:
            step = waiting.pop()
            if step.node.block.interface.continuous:
                return SMALLER_STEP
            for _, wire in step.node.wires():
                if wire.block not in seen:
                    seen.add(wire.block)
                    waiting.append(self.plan[wire.block])
        return ""

    def _not_finite(self, step: _Step) -> RunError:
        """Name the first port, in execution order, that is not finite."""
        for bound in step.blocks:
            for port, slot in bound.outputs.items():
                if not bound.node.block.interface.outputs[port].nan and slot.scalar == "float64":
                    value = self.plan.memory.read(slot)
                    if not np.isfinite(value).all():
                        text = np.array2string(np.asarray(value), precision=4)
                        problem = sentence(f"the output became {text}", self._remedy(bound))
                        return RunError(problem, block=bound.node.path, port=port, time=self.time)
        raise AssertionError("a value that is not finite belongs to a port")

    def _not_finite_state(self) -> RunError:
        for bound in self.plan.steps:
            for state in bound.node.block.interface.continuous:
                if not np.isfinite(self.plan.memory.view(bound.field(state.name))).all():
                    problem = sentence(f"state '{state.name}' left the finite numbers", SMALLER_STEP)
                    return RunError(problem, block=bound.node.path, time=self.time)
        raise AssertionError("a state that is not finite belongs to a block")

    def snapshot(self) -> Snapshot:
        """Return the whole state between two ticks."""
        return Snapshot(self.tick, bytes(self.plan.memory.raw), tuple(self.plan.memory.frames))

    def restore(self, snapshot: Snapshot) -> None:
        """Go back to a snapshot of the same graph; the run from there repeats to the bit."""
        memory = self.plan.memory
        if (len(snapshot.memory), len(snapshot.frames)) != (len(memory.raw), len(memory.frames)):
            raise ValueError("the snapshot is of another graph")
        memory.raw[:] = snapshot.memory
        memory.frames[:] = snapshot.frames
        self.tick = snapshot.tick

    def read(self, path: str, port: str) -> Any:
        """Return what an output holds now."""
        return self.plan.memory.read(self.plan[path].outputs[port])
