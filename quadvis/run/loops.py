"""How the ticks of a run go on: all at once in a simulation, or each at its time."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple, Protocol

from quadvis.engine.engine import Engine
from quadvis.engine.profile import ProfileReport
from quadvis.engine.taps import Tap
from quadvis.engine.tuning import Change
from quadvis.errors.caller import as_given
from quadvis.graph.devices import refuse_devices
from quadvis.graph.graph import Graph, Node
from quadvis.links.endpoints import live_parts
from quadvis.native.choice import Announce, Choice, choose, use
from quadvis.output.kept import RowJudge
from quadvis.realtime.note_taker import NoteTaker
from quadvis.run.row_tap import PacedTap, RowTap

if TYPE_CHECKING:
    from quadvis.diagram.diagram import Diagram
    from quadvis.realtime.flight import Flight
    from quadvis.realtime.helm import Helm
    from quadvis.realtime.options import RealTime

SIMULATED, REAL_TIME = "simulated", "real time"  # the clock of a run, as its log says
SLICE = 0.1  # s of wall time between two calls of the progress; Ctrl-C and rows for the log wait no longer

Progress = Callable[[float, float], None]  # simulated time reached, wall time spent (s)


class Taken(NamedTuple):
    """A block whose rows are taken, by what and for which judge."""

    node: Node
    judge: RowJudge
    tap: RowTap


class Takers(NamedTuple):
    """Who takes what comes from a loop.

    ``notes`` takes what the loops of computers note, ``changed`` the parameters that were tuned, ``tend`` the
    progress.
    """

    taken: Sequence[Taken]
    taps: Sequence[Tap]
    notes: NoteTaker
    changed: Callable[[Change], None]
    tend: Progress


class RunLoop(Protocol):
    """The ticks of a run, ready to begin.

    ``clock`` is ``SIMULATED`` or ``REAL_TIME``. ``graphs`` are those that run side by side. ``computers`` are
    those that may leave ticks out, with their graphs, and ``measured`` says whether their tasks are timed.
    ``early`` says why it ends before the stop time; "" if it does not.
    """

    @property
    def clock(self) -> str:
        """Return it."""

    @property
    def graphs(self) -> Sequence[Graph]:
        """Return them."""

    @property
    def computers(self) -> Mapping[str, Graph]:
        """Return them."""

    @property
    def measured(self) -> bool:
        """Return it."""

    @property
    def early(self) -> str:
        """Return it."""

    def run(self, takers: Takers, stack: ExitStack) -> tuple[Choice, Flight | None]:
        """Run to the end; what is opened is closed with the stack."""


class Simulated:
    """All ticks at once."""

    clock, early, measured = SIMULATED, "", False
    computers: Mapping[str, Graph] = MappingProxyType({})

    def __init__(
        self, diagram: Diagram, engine: str, announce: Announce | None, profile: bool = False
    ) -> None:
        self.profiles: Mapping[str, ProfileReport] = {}  # by computer, after a run for which they were asked
        self._profiled = profile
        self.graphs: Sequence[Graph] = [diagram.graph]
        refuse_devices(diagram.graph, as_given("add --real-time", "give real_time=RealTime()"))
        self._engine = Engine(diagram.graph, diagram.seed)
        if profile:
            self._engine.measure()
        self._ticks = diagram.ticks
        self._engine.end_before(self._ticks)
        self._choice = choose(self._engine, self._ticks, engine, announce)
        use(self._engine, self._choice)

    def run(self, takers: Takers, stack: ExitStack) -> tuple[Choice, None]:
        """Run to the end."""
        engine = self._engine
        for tap in (*(each.tap for each in takers.taken), *takers.taps):
            engine.attach(tap)
        stack.enter_context(engine)  # to be closed when the log is
        advance([engine], self._ticks, takers.tend)
        if self._profiled:
            self.profiles = {"": engine.profile()}
        return self._choice, None


class Paced:
    """Each tick at its time, each computer in a process of its own; QuadvisError if that cannot be."""

    clock, early, measured = REAL_TIME, "", True

    def __init__(
        self,
        diagram: Diagram,
        engine: str,
        announce: Announce | None,
        wishes: RealTime,
        helm: Helm | None = None,
    ) -> None:
        from quadvis.realtime.lines import check_cables, check_reach

        parts = {name: part for name, part in live_parts(diagram.graph).items() if name in diagram.computers}
        check_reach(diagram.links_here, diagram.computers)
        check_cables(diagram.graph, diagram.computers)
        for computer, part in parts.items():
            wishes.on(diagram.computer(computer)).check(part)
        self._diagram, self._engine, self._announce, self._wishes = diagram, engine, announce, wishes
        self._helm = helm
        self.profiles: Mapping[str, ProfileReport] = {}  # by computer, after a run for which they were asked
        self.computers: Mapping[str, Graph] = parts
        self.graphs: Sequence[Graph] = [*parts.values()]

    def run(self, takers: Takers, stack: ExitStack) -> tuple[Choice, Flight]:
        """Run to the end."""
        from quadvis.realtime.supervisor import supervise  # what it needs is Unix's, and takes a while

        taps = paced_taps(takers.taken, self._diagram)
        flight = supervise(
            self._diagram, self._wishes, self._engine, [*taps, *takers.taps], takers.notes, takers.tend,
            self._announce, self._helm, takers.changed,
        )  # fmt: skip
        self.early = flight.early
        ticks = {share.computer: share.ticks for share in flight.shares}
        for tap in taps:
            tap.end(ticks[self._diagram.graph[tap.block].computer])
        self.profiles = {share.computer: share.blocks.report for share in flight.shares if share.blocks}
        return flight.engine, flight


def paced_taps(taken: Sequence[Taken], diagram: Diagram) -> list[PacedTap]:
    """Return taps for a run that may leave out ticks."""
    return [PacedTap(each.tap, each.node, diagram.graph, each.judge) for each in taken]


def advance(engines: Sequence[Engine], ticks: int, tend: Progress) -> None:
    """Run in slices, each of all engines in turn; they have one base tick.

    Between slices hand rows on, show the progress and notice an interruption.
    """
    began = time.perf_counter()
    reached, count = 0, 1
    while reached < ticks:
        start = time.perf_counter()
        reached = min(reached + count, ticks)
        for engine in engines:
            engine.run(reached - engine.tick)
        spent = time.perf_counter() - start
        count = max(1, min(2 * count, int(count * SLICE / max(spent, 1e-6))))
        tend(engines[0].time, time.perf_counter() - began)
