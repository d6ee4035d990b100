"""The warm ticks before a run: they run what is inside, leave out what is outside, and leave no trace."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from quadvis.api import load_text
from quadvis.block import NO_FRAME, Block, Frame, In, Out, State
from quadvis.engine.engine import Engine
from quadvis.graph.graph import Constant, Graph, Node, Task, Wire
from quadvis.native.choice import choose, use
from quadvis.realtime.warm import TIMES, warm
from tests.quadvis.realtime.test_crew import TEXT as CREW
from tests.quadvis.realtime.test_real_time_replay import TEXT as FLIGHT
from tests.quadvis.realtime.test_streams import Kept
from tests.stages import mostly_slow

FAST, SLOW = Task("fast", Fraction(1, 10)), Task("slow", Fraction(1, 2), Fraction(1, 5))
engines = pytest.mark.parametrize("engine", mostly_slow(["python", "native"]))


class Noted(Block, numeric=False):
    """Counts in a state, and notes the calls of its methods where no engine sees it."""

    u = In(default=0.0)
    y = Out()
    count = State()
    calls: list[tuple[str, float]]

    def output(self, u):
        self.calls.append(("output", u))
        return self.count

    def update(self, time):
        self.calls.append(("update", time))
        self.count += 1.0


class Writer(Noted):
    """Reaches outside."""

    harmless = "a test"

    def write(self, u):
        self.calls.append(("write", u))


class Reader(Noted):
    """Reaches outside."""

    def read(self):
        self.calls.append(("read", 0.0))


class Picky(Noted):
    """Cannot run before its input has come."""

    def output(self, u):
        self.calls.append(("output", u))
        return 1.0 / u


class Forgetful(Noted):
    """Counts where it must not."""

    def open(self):
        self.hidden = 0.0

    def output(self, u):
        self.hidden += 1.0
        return self.hidden


class Album(Noted):
    """Keeps a picture."""

    kept = State("frame[2]")

    def update(self, u):
        self.kept[1] = Frame(np.full((2, 2, 3), int(u), np.uint8), u, 1)


def made(kind: type[Noted], task: Task = FAST, **inputs: Wire) -> Node:
    block = kind()
    kind.calls = []
    return Node(kind.__name__, "test", block, task, {"u": Constant(0.0)} | inputs)


def warmed(*nodes: Node) -> Engine:
    engine = Engine(Graph("test", list(nodes)))
    with engine:
        before = engine.snapshot()
        warm(engine, choose(engine, 10, "python"))
        assert engine.snapshot() == before
    return engine


def test_each_task_runs_some_ticks_at_their_times() -> None:
    class Slower(Noted):
        """Another one."""

    warmed(made(Noted), made(Slower, SLOW, u=Wire("Noted", "y", (), "sample")))
    updates = [time for method, time in Noted.calls if method == "update"]
    assert updates == pytest.approx([0.0, 0.1, 0.2, 0.7, 1.2])
    assert [value for method, value in Slower.calls if method == "update"] == pytest.approx([0.2, 0.7, 1.2])
    assert [value for method, value in Slower.calls if method == "output"] == [2.0, 3.0, 4.0]
    assert TIMES == 3


@pytest.mark.parametrize("kind", [Writer, Reader])
def test_what_reaches_outside_is_not_run_and_others_are(kind: type[Noted]) -> None:
    warmed(made(kind), made(Noted, u=Wire(kind.__name__, "y", ())))
    assert kind.calls == []
    assert len(Noted.calls) == 2 * TIMES


def test_a_block_that_fails_on_what_it_gets_is_left_out() -> None:
    warmed(made(Picky), made(Noted, u=Wire("Picky", "y", ())))
    assert Picky.calls == [("output", 0.0)]
    assert len(Noted.calls) == 2 * TIMES


def test_frames_are_restored() -> None:
    engine = warmed(made(Album))
    assert list(engine.bound("Album").kept) == [NO_FRAME, NO_FRAME]


def test_an_own_block_that_opens_something_is_not_run(monkeypatch: pytest.MonkeyPatch) -> None:
    for module, expected in (("quadvis_own_blocks.hidden", 1.0), ("quadvis_blocks.hidden", 4.0)):
        monkeypatch.setattr(Forgetful, "__module__", module)
        engine = Engine(Graph("test", [made(Forgetful)]))
        with engine:
            warm(engine, choose(engine, 10, "python"))
            engine.run(1)
            assert engine.read("Forgetful", "y") == expected


@engines
def test_a_warmed_run_has_the_signals_of_one_that_is_not(engine: str) -> None:
    """With noise, continuous states, delays, and tasks that run each by itself."""
    for text in (
        CREW,
        FLIGHT.replace("own.counter", "sources.sine").replace("noise.y, counter.y", "noise.y, 0 m"),
    ):
        found = []
        for warms in (False, True):
            diagram = load_text(text)
            run = Engine(diagram.graph, diagram.seed)
            taps = [Kept(block.path) for block in run.program.blocks]
            choice = choose(run, 10**9, engine)
            with run:
                run.measure()
                if warms:
                    warm(run, choice)
                use(run, choice)
                for tap in taps:
                    run.attach(tap)
                run.run(300)
            calls = {(timed.block, timed.method): timed.calls for timed in run.profile().methods}
            found.append(([tap.rows for tap in taps], calls))
        assert found[0] == found[1]
