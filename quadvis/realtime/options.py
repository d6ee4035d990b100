"""What a user can choose for a real-time run."""

from __future__ import annotations

import sys
from dataclasses import dataclass

from quadvis.diagram.times import read_duration
from quadvis.document import YamlScalar
from quadvis.errors import QuadvisError
from quadvis.errors.caller import as_given
from quadvis.graph.graph import SINGLE, Graph
from quadvis.realtime.schedule import NANOSECONDS, Schedule

AUTO = "auto"
HIGHEST = 99  # priority
BUSIEST = 0.9  # share of a period; near 0.95 Linux halts real-time programs for 50 ms in every second


@dataclass(frozen=True)
class RealTime:
    """How the loop of a real-time run is to be treated by the system; what it grants is another matter.

    ``cpu`` is the processor to stay on. ``priority`` is that of SCHED_FIFO, 1 to 99; 0 asks for no priority.
    ``poll`` is the time before each deadline in which the loop does not sleep, but looks at the clock: a
    time such as "60 us", or ``auto``: as long as the system needs to wake the loop, measured at the start, at
    most a tenth of the shortest period.
    """

    cpu: int | None = None
    priority: int = 80
    poll: str = AUTO

    def __post_init__(self) -> None:
        if not 0 <= self.priority <= HIGHEST:
            option = as_given("--priority", "priority")
            raise QuadvisError(f"{option} must be from 1 to {HIGHEST}, or 0 for none, not {self.priority}")
        if self.cpu is not None and self.cpu < 0:
            raise QuadvisError(f"{as_given('--cpu', 'cpu')} must be the number of a processor, 0 or more")
        self.polled()

    def polled(self) -> int | None:
        """Return the time to poll (ns); None if it is to be measured."""
        if self.poll == AUTO:
            return None
        time = read_duration(YamlScalar(self.poll, False, as_given("--poll", "poll"), 0, 0))
        return int(time * NANOSECONDS)

    def check(self, graph: Graph) -> None:
        """Refuse a graph that cannot run in real time, or not with these settings."""
        if sys.platform != "linux":
            raise QuadvisError("a real-time run needs Linux, for its clock and its priorities")
        if graph.tasking != SINGLE:
            problem = f"a real-time run has one loop, and 'tasking: {graph.tasking}' needs one for each rate"
            raise QuadvisError(f"{problem}; write 'tasking: {SINGLE}'")
        polled, period = self.polled() or 0, Schedule.of(graph).interval
        if polled > BUSIEST * period:
            problem = f"{as_given('--poll', 'poll')} {self.poll} is more than 90 % of the period"
            raise QuadvisError(
                f"{problem} of {period / 1e6:g} ms: Linux would halt the loop again and again; poll less"
            )
