"""What a user can choose for a real-time run."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import TypeVar

from quadvis.diagram.sections.computers import AUTO, ComputerSpec
from quadvis.diagram.times import read_duration
from quadvis.document import YamlScalar
from quadvis.errors import QuadvisError
from quadvis.errors.caller import as_given
from quadvis.graph.graph import MULTI, SINGLE, VARIABLE, Graph, Task
from quadvis.realtime.schedule import NANOSECONDS, Schedule

PRIORITY = 80
HIGHEST = 99  # priority
T = TypeVar("T")
BUSIEST = 0.9  # share of a period; near 0.95 Linux halts real-time programs for 50 ms in every second


@dataclass(frozen=True)
class RealTime:
    """How the loop of a real-time run is to be treated by the system; what it grants is another matter.

    ``cpu`` is the processor to stay on. ``priority`` is that of SCHED_FIFO, 1 to 99, for the fastest task; 0
    asks for no priority. ``poll`` is the time before each deadline in which the loop does not sleep, but
    looks at the clock: a time such as "60 us", or ``auto``: as long as the system needs to wake the loop,
    measured at the start, at most a tenth of the shortest period. What is None is as the diagram says of the
    computer, or else any processor, a priority of 80, and ``auto``. ``profile`` asks for the time of every
    call of a block.
    """

    cpu: int | None = None
    priority: int | None = None
    poll: str | None = None
    profile: bool = False

    def __post_init__(self) -> None:
        if self.priority is not None and not 0 <= self.priority <= HIGHEST:
            option = as_given("--priority", "priority")
            raise QuadvisError(f"{option} must be from 1 to {HIGHEST}, or 0 for none, not {self.priority}")
        if self.cpu is not None and self.cpu < 0:
            raise QuadvisError(f"{as_given('--cpu', 'cpu')} must be the number of a processor, 0 or more")
        self.polled()

    def on(self, computer: ComputerSpec | None) -> RealTime:
        """Return what holds on a computer, with what its diagram says of it where this says nothing."""
        said = RealTime() if computer is None else RealTime(computer.cpu, computer.priority, computer.poll)
        return RealTime(
            _first(self.cpu, said.cpu),
            _first(self.priority, said.priority, PRIORITY),
            _first(self.poll, said.poll, AUTO),
            self.profile,
        )

    def polled(self) -> int | None:
        """Return the time to poll (ns); None if it is to be measured."""
        if self.poll in (None, AUTO):
            return None
        time = read_duration(YamlScalar(str(self.poll), False, as_given("--poll", "poll"), 0, 0))
        return int(time * NANOSECONDS)

    def check(self, graph: Graph) -> None:
        """Refuse a graph that cannot run in real time, or not with these settings."""
        if sys.platform != "linux":
            raise QuadvisError("a real-time run needs Linux, for its clock and its priorities")
        if graph.solver in VARIABLE and any(node.block.interface.continuous for node in graph.nodes):
            problem = f"the solver '{graph.solver}' takes as many steps as it needs, for which no clock waits"
            raise QuadvisError(f"{problem}; choose one of fixed step, ode1 to ode4, for a real-time run")
        if graph.tasking == MULTI:
            _check_frames(graph)
        polled, period = self.polled() or 0, Schedule.of(graph).interval
        if polled > BUSIEST * period:
            problem = f"{as_given('--poll', 'poll')} {self.poll} is more than 90 % of the period"
            raise QuadvisError(
                f"{problem} of {period / 1e6:g} ms: Linux would halt the loop again and again; poll less"
            )


def _first(*values: T | None) -> T | None:
    """Return the first value that is not None, if there is one."""
    return next((value for value in values if value is not None), None)


def _check_frames(graph: Graph) -> None:
    """Refuse frames that would have to be copied between threads."""

    def alone(task: Task) -> bool:
        return task != graph.tasks[0]

    for node in graph.nodes:
        for port, wire in node.wires():
            task = graph[wire.block].task
            is_frame = node.block.interface.inputs[port].signal.scalar == "frame"
            if is_frame and (task != node.task or wire.delayed) and (alone(task) or alone(node.task)):
                frames = f"'{node.path}.{port}' takes frames of '{wire.block}'"
                problem = f"{frames}, which cannot cross tasks in real time"
                raise QuadvisError(f"{problem}; give both blocks one rate, or write 'tasking: {SINGLE}'")
