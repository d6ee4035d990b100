"""Several targets that fly one diagram together: each is one of its computers, or several."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, suppress
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import QuadvisError, quoted
from quadvis.host.offset import PINGS, Offset, measure
from quadvis.host.target import LOADING, Target
from quadvis.realtime.lines import check_cables, check_reach

if TYPE_CHECKING:
    from quadvis.diagram.diagram import Diagram
    from quadvis.output.log_reader import Log
    from quadvis.run.verdict import Outcome

LEAD = 0.5  # s from the order to start until the first tick
ALIGN = 1.0  # s between two looks at the clocks
LOOK = 0.2  # s between two looks at the status
FEW = 4  # pings of one look
RUNNING = ("running", "stopping")
LOST = "lost"

Found = TypeVar("Found")


class Several:
    """The targets that are the computers of a diagram, by the names of the computers.

    A target may be several computers. This process is their operator from ``with`` on. All begin at one
    instant. As long as they run, the clocks of the targets are compared with that of this host, and their
    ticks are kept at its pace; so times and ages mean the same everywhere, within the error of ``offsets``.

    A target of whose computers the diagram says ``on_loss: continue`` may be lost: the others fly on, and
    ``lost`` says why. Both are by the names of the targets' computers, joined. ``complaints`` are sentences
    about all that has failed and has not ended the flight.
    """

    def __init__(self, diagram: Diagram, targets: Mapping[str, Target]) -> None:
        missing = [name for name in diagram.graph.computers if name not in targets]
        unknown = [name for name in targets if name not in diagram.graph.computers]
        if missing or unknown:
            problem = f"has no target: {', '.join(missing)}" if missing else f"is none of it: {unknown[0]}"
            computers = ", ".join(filter(None, diagram.graph.computers)) or "none"
            raise QuadvisError(f"a computer of the diagram {problem}; its computers are {computers}")
        self.diagram = diagram
        self.computers: dict[str, tuple[str, ...]] = {}  # those of each target, by their names, joined
        self.targets: dict[str, Target] = {}
        for target in dict.fromkeys(targets.values()):
            names = tuple(name for name in diagram.graph.computers if targets[name] is target)
            self.computers[_joined(names)], self.targets[_joined(names)] = names, target
        for names in self.computers.values():
            check_reach(replace(diagram, here=names).links_here, names)
            check_cables(diagram.graph, names)
        self.offsets: dict[str, Offset] = {}
        self._pool = ThreadPoolExecutor(len(self.targets), "target")
        self._stack = ExitStack()
        self.lost: dict[str, str] = {}
        self.complaints: list[str] = []
        self._spare = {name for name, computers in self.computers.items() if _is_spare(diagram, computers)}
        self._ended = threading.Event()
        self._first: dict[str, Offset] = {}

    @property
    def those_left(self) -> list[Target]:
        """The targets that are not lost."""
        return [target for name, target in self.targets.items() if name not in self.lost]

    def __enter__(self) -> Self:
        with ExitStack() as stack:
            stack.callback(self._pool.shutdown)
            for target in self.targets.values():
                stack.enter_context(target.operator())
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        self._stack.__exit__(kind, error, trace)

    def load(self, engine: str = "auto") -> None:
        """Load the diagram everywhere, each target as its computers."""
        self._all(
            lambda name, target: target.load(self.diagram, engine=engine, computers=self.computers[name])
        )

    def start(self) -> None:
        """Let all begin at one instant, and keep their ticks at one pace from then on.

        If one cannot, the others are stopped, and QuadvisError says why.
        """
        self._first = self._all(lambda name, target: _offset(target, PINGS))
        self.offsets = dict(self._first)
        instant = time.monotonic_ns() + int(LEAD * 1e9)

        def begin(name: str, target: Target) -> QuadvisError | None:
            try:
                target.request("start", at=instant + self._first[name].offset, deadline=LOADING)
            except QuadvisError as error:
                return error
            return None

        if errors := [error for error in self._all(begin).values() if error is not None]:
            self._all(_tried(_stop))
            raise errors[0]
        threading.Thread(target=self._align, name="clocks", daemon=True).start()

    def stop(self) -> None:
        """Stop all that run."""
        self._ended.set()
        self._all(_stop)

    def wait(
        self,
        progress: Callable[[float, float], None] = lambda reached, spent: None,
        announce: Callable[[str], None] = lambda sentence: None,
    ) -> None:
        """Wait until all have ended; QuadvisError says why one that the others need has ended early.

        The others have been stopped then. ``announce`` gets a sentence about each that they do without.
        """
        began = time.monotonic()
        while True:
            found = self._all(_seen)
            losses = {name: f"{name}: {each['Problem']}" for name, each in found.items() if _is_lost(each)}
            if len(losses) == len(found) or not losses.keys() <= self._spare:
                self._ended.set()
                self._all(_tried(_stop))
                raise QuadvisError("; ".join([*self.lost.values(), *losses.values()]))
            for name, loss in losses.items():
                self.lost[name] = loss
                announce(loss)
                found.pop(name)
            if not any(each["Status"] in RUNNING for each in found.values()):
                self._ended.set()
                late = [f"{name}: {each['Problem']}" for name, each in found.items() if each["Problem"]]
                self.complaints = [*self.lost.values(), *late]
                return
            progress(min(each["ExecTime"] for each in found.values()), time.monotonic() - began)
            time.sleep(LOOK)

    def logs(self, folder: Path) -> dict[str, Path]:
        """Copy the newest log of each target to a folder; return the paths by computer.

        One that is lost may not be there any more to give its log.
        """

        def fetch(name: str, target: Target) -> Path:
            return target.fetchlog(path=folder / f"{name}.mcap")

        paths = self._all(fetch) | self._all(_tried(fetch), self.lost)
        found = {each: paths[name] for name, computers in self.computers.items() for each in computers}
        return {name: path for name, path in found.items() if path is not None}

    def judge(self, logs: Mapping[str, Path]) -> Outcome:
        """Return the verdicts on the whole flight, from the logs of all computers."""
        from quadvis.output.log_reader import read_log
        from quadvis.run.verdict import Judging

        read = {path: read_log(path) for path in dict.fromkeys(logs.values())}
        judging = Judging(self.diagram.summary, self.diagram.expectations)
        judging.read(Together(self.diagram, {name: read[path] for name, path in logs.items()}))
        return judging.outcome()

    def _align(self) -> None:
        """Keep the ticks of all targets at the pace of this host's clock, until the end."""

        def align(name: str, target: Target) -> Offset:
            found = _offset(target, FEW)
            target.request("align", shift=found.offset - self._first[name].offset)
            return found

        while not self._ended.wait(ALIGN):
            for name, found in self._all(_tried(align)).items():
                if found is not None:  # it has ended, or is lost: `wait` says so
                    self.offsets[name] = found

    def _all(
        self, call: Callable[[str, Target], Found], names: Iterable[str] | None = None
    ) -> dict[str, Found]:
        """Return what a call gives for each target that is not lost, or for those named, all at one time."""
        chosen = [name for name in self.targets if name not in self.lost] if names is None else names
        futures = {name: self._pool.submit(call, name, self.targets[name]) for name in chosen}
        return {name: future.result() for name, future in futures.items()}


def _tried(call: Callable[[str, Target], Found]) -> Callable[[str, Target], Found | None]:
    """Return a call that gives None where the other one fails."""

    def tried(name: str, target: Target) -> Found | None:
        with suppress(QuadvisError):
            return call(name, target)
        return None

    return tried


def _offset(target: Target, pings: int) -> Offset:
    return measure(lambda: int(target.request("clock")), pings)


def _stop(name: str, target: Target) -> None:
    if target.Status == "running":
        target.stop()


def _seen(name: str, target: Target) -> dict[str, Any]:
    """Return the status of a target; one that does not answer has a problem, and no times."""
    try:
        return target.status()
    except QuadvisError as error:
        return {"Status": LOST, "Problem": str(error)}


def _is_lost(status: Mapping[str, Any]) -> bool:
    """Whether a target has come to an end before the stop time."""
    if status["Status"] in RUNNING or not status["Problem"]:
        return False
    return bool(status["Status"] == LOST or status["ExecTime"] + status["SampleTime"] < status["StopTime"])


def _is_spare(diagram: Diagram, computers: Iterable[str]) -> bool:
    """Whether the diagram says that the others fly on without all of these."""
    specs = [diagram.computer(name) for name in computers]
    return all(spec is not None and spec.is_dispensable for spec in specs)


def _joined(names: Iterable[str]) -> str:
    return "+".join(names)


class Together:
    """The signals of several logs, each with the blocks of its computer; none of a computer without a log."""

    def __init__(self, diagram: Diagram, logs: Mapping[str, Log]) -> None:
        self._diagram, self._logs = diagram, logs

    def _log(self, name: str) -> Log | None:
        head = name.partition("[")[0]
        path = self._diagram.ports.get(head, head).rpartition(".")[0]
        if path not in self._diagram.graph:
            raise QuadvisError(f"there is no signal {quoted(name)}")
        return self._logs.get(self._diagram.graph[path].computer)

    @property
    def units(self) -> Mapping[str, str]:
        """The unit of every signal."""
        return {name: unit for log in self._logs.values() for name, unit in log.units.items()}

    def __getitem__(self, name: str) -> NDArray[Any]:
        log = self._log(name)
        return np.empty(0) if log is None else log[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.units)

    def times(self, name: str) -> NDArray[np.float64]:
        """Return the times (s) of a signal's rows."""
        log = self._log(name)
        return np.empty(0) if log is None else log.times(name)

    def rate(self, name: str) -> str:
        """Return the name of the rate of a signal's block."""
        log = self._log(name)
        return "" if log is None else log.rate(name)

    def stamps(self, name: str) -> NDArray[np.int64]:
        """Return the stamps (ns) of its rows."""
        log = self._log(name)
        return np.empty(0, np.int64) if log is None else log.stamps(name)


def read_places(texts: Iterable[str]) -> dict[str, str]:
    """Return the targets by computer from texts such as "vision_pc=lab1"."""
    found: dict[str, str] = {}
    for text in texts:
        computer, equals, target = (part.strip() for part in text.partition("="))
        if not (computer and equals and target):
            raise QuadvisError(f"{quoted(text)} names no target; write COMPUTER=TARGET")
        if computer in found:
            raise QuadvisError(f"the computer {quoted(computer)} is given twice; it is one target")
        found[computer] = target
    return found
