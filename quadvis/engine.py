"""The engine, Python tier: runs a plan tick by tick, deterministic to the bit.

The life of one tick, at time t = tick * base period:
delayed copies, outputs of the blocks that are due, observers (log), updates of the same blocks, continuous states to
t + base period. Blocks that are due together run in one dependency order, whatever their rates.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from itertools import chain
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import QuadvisError, RunError
from quadvis.graph import Graph
from quadvis.plan import TIME, Bound, Call, Plan, make_plan
from quadvis.solver import integrate

Observer = Callable[[int], None]  # takes the tick, after the outputs of a step


@dataclass(frozen=True)
class Snapshot:
    """The whole state of a run between two ticks."""

    tick: int
    memory: bytes
    frames: tuple[Any, ...]


@dataclass
class _Step:
    """What one combination of due tasks does at a tick."""

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
        self._observers: list[tuple[str, Observer]] = []
        self._step_size = float(self.period)
        self._tasks = [
            (task, int(task.period / self.period), int(task.offset / self.period)) for task in graph.tasks
        ]
        self._steps: dict[tuple[bool, ...], _Step] = {}
        self._opened: list[Bound] = []
        self._time = self.plan.memory.view(TIME)

    @property
    def time(self) -> float:
        """Time of the next tick (s)."""
        return float(self.tick * self.period)

    def __enter__(self) -> Self:
        for bound in self.plan.steps:
            self._opened.append(bound)
            self._guarded(bound, "open")
        for bound in self.plan.steps:
            if "start" in bound.node.block.interface.arguments:
                self._guarded(bound, "start")
        return self

    def __exit__(self, *_: object) -> None:
        errors = []
        for bound in reversed(self._opened):
            try:
                bound.self.close()
            except Exception as error:  # noqa: BLE001 - every block must be closed, whatever another one does
                errors.append(RunError(f"cannot close: {error}", block=bound.node.path, time=self.time))
        self._opened.clear()
        if errors:
            raise errors[0]

    def _guarded(self, bound: Bound, method: str) -> None:
        try:
            getattr(bound.self, method)()
        except QuadvisError:
            raise
        except Exception as error:
            raise self._failure(bound, error) from error

    def observe(self, task: str, observer: Observer) -> None:
        """Call ``observer(tick)`` at every tick of a task, when the outputs are there and before the updates."""
        self._observers.append((task, observer))
        self._steps.clear()

    def run(self, ticks: int) -> None:
        """Run that many ticks."""
        memory, end = self._time, self.tick + ticks
        tasks, continuous = self._tasks, self.plan.continuous.size > 0
        period, denominator = self.period.numerator, self.period.denominator
        while self.tick < end:
            tick = self.tick
            due = tuple([(tick - offset) % every == 0 and tick >= offset for _, every, offset in tasks])
            step = self._steps.get(due) or self._prepare(due)
            # An exact product, so that time has no drift; the quotient of integers is rounded once.
            memory[...] = tick * period / denominator
            for copy in step.delays:
                copy()
            self._perform(step, step.outputs, "output")
            if step.finite.size and math.isnan(self.plan.memory.floats.take(step.finite).dot(step.zeros)):
                raise self._not_finite(step)
            for observe in step.observers:
                observe(tick)
            self._perform(step, step.updates, "update")
            if continuous:
                self._integrate()
            self.tick = tick + 1

    def _perform(self, step: _Step, calls: list[Call], method: str) -> None:
        call = None
        try:
            for call in calls:  # noqa: B007 - the failing one is looked at below
                call()
        except QuadvisError:
            raise
        except Exception as error:
            bound = next(bound for bound in step.blocks if getattr(bound, method) is call)
            raise self._failure(bound, error) from error

    def _prepare(self, due: tuple[bool, ...]) -> _Step:
        tasks = [task for (task, _, _), flag in zip(self._tasks, due, strict=True) if flag]
        blocks = self.plan.due(tasks)
        finite = self.plan.finite(blocks)
        made = _Step(
            list(chain.from_iterable(self.plan.delays.get(task.name, []) for task in tasks)),
            [bound.output for bound in blocks if bound.output],
            [bound.update for bound in blocks if bound.update],
            finite,
            np.zeros(finite.size),
            [observe for name, observe in self._observers if name in {task.name for task in tasks}],
            blocks,
        )
        self._steps[due] = made
        return made

    def _integrate(self) -> None:
        floats, places = self.plan.memory.floats, self.plan.continuous
        time = float(self._time)
        minor, derivatives, slopes = self.plan.minor, self.plan.derivatives, self.plan.slopes
        first = True

        def rates(at: float, state: NDArray[np.float64]) -> NDArray[np.float64]:
            nonlocal first
            if not first:
                floats[places] = state
                self._time[...] = at
                for output in minor:
                    output()
            first = False
            for deriv in derivatives:
                deriv()
            return slopes.copy()

        try:
            after = integrate(self.graph.solver, rates, time, floats[places], self._step_size)
        except QuadvisError:
            raise
        except Exception as error:
            raise RunError(f"{type(error).__name__} in a solver step: {error}", time=time) from error
        floats[places] = after
        if not np.isfinite(after).all():
            raise self._not_finite_state(time)

    def _failure(self, bound: Bound, error: Exception) -> RunError:
        return RunError(f"{type(error).__name__}: {error}", block=bound.node.path, time=self.time)

    def _not_finite(self, step: _Step) -> RunError:
        """Name the first port, in execution order, that is not finite."""
        for bound in step.blocks:
            for port, slot in bound.outputs.items():
                if not bound.node.block.interface.outputs[port].nan and slot.scalar == "float64":
                    value = self.plan.memory.read(slot)
                    if not np.isfinite(value).all():
                        text = np.array2string(np.asarray(value), precision=4)
                        return RunError(f"the output became {text}", block=bound.node.path, port=port, time=self.time)
        raise AssertionError("a value that is not finite belongs to a port")

    def _not_finite_state(self, time: float) -> RunError:
        for bound in self.plan.steps:
            for state in bound.node.block.interface.continuous:
                if not np.isfinite(self.plan.memory.view(bound.field(state.name))).all():
                    return RunError(
                        f"state '{state.name}' left the finite numbers; a smaller solver step may help",
                        block=bound.node.path,
                        time=time,
                    )
        raise AssertionError("a state that is not finite belongs to a block")

    def snapshot(self) -> Snapshot:
        """Return the whole state between two ticks."""
        return Snapshot(self.tick, bytes(self.plan.memory.raw), tuple(self.plan.memory.frames))

    def restore(self, snapshot: Snapshot) -> None:
        """Go back to a snapshot of the same graph; the run from there repeats to the bit."""
        self.plan.memory.raw[:] = snapshot.memory
        self.plan.memory.frames[:] = snapshot.frames
        self.tick = snapshot.tick

    def read(self, path: str, port: str) -> Any:
        """Return what an output holds now."""
        return self.plan.memory.read(self.plan[path].outputs[port])
