"""A target in this process, for the tests of gateway and page: a real run, advanced by the wall clock.

It answers the verbs in the words of `quadvis.target.kernel`. Its scopes sample at the base rate.
"""

from __future__ import annotations

import hashlib
import math
import threading
import time
from collections import defaultdict, deque
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from quadvis.api import Diagram
from quadvis.block import Frame
from quadvis.errors import QuadvisError, quoted
from quadvis.output.log_reader import read_log
from quadvis.realtime.times import (
    LATENESS,
    OVERRUNS,
    STEPS,
    TET,
    WORDS,
    TaskTimes,
    bin_of,
    clear,
    count,
)
from quadvis.run.live import LiveRun
from quadvis.run.tuned import find_value
from quadvis.target.parameters import Parameters

VALUES = 0.02  # s between two tellings of what is watched
PIECE = 200_000  # bytes of a log in one reply


DRAWN: dict[str, str] = {}  # what the diagrams of the tests look like, by their hashes


def drawn(diagram: Diagram) -> str:
    """Return the drawing of a diagram, which is drawn once for all tests."""
    if diagram.hash not in DRAWN:
        DRAWN[diagram.hash] = diagram.draw()
    return DRAWN[diagram.hash]


class StandIn:
    """A target with one application, ``level`` is that of the key."""

    def __init__(
        self, diagram: Diagram, folder: Path, level: int = 0, others: Mapping[str, Diagram] = {}
    ) -> None:
        self.name, self.level = "bench", level
        self.applications = {diagram.name: diagram, **others}
        self.folder = folder
        self.asked: list[str] = []
        self.silent = False  # says and streams nothing
        self.began = 0.0  # time.time() at the first tick
        self._takers: dict[str, list[Callable[..., None]]] = defaultdict(list)
        self._lock = threading.RLock()
        self._born = time.monotonic()
        self._flight: Flight | None = None
        self._number = 0
        self.scopes: dict[int, Scope] = {}
        self.watched: tuple[list[str], str] = [], ""
        self.profiled: list[list[Any]] | None = None
        self._load(diagram)
        self._closed = threading.Event()
        threading.Thread(target=self._tell_state, daemon=True).start()

    def _load(self, diagram: Diagram) -> None:
        self.diagram, self.parameters = diagram, Parameters(diagram)
        self.state, self.problem, self.verdicts = "stopped", "", None
        self.picture = ""  # another drawing than that of the diagram
        self.scopes.clear()
        self.watched = [], ""

    # the interface

    def request(self, verb: str, /, **arguments: Any) -> Any:
        while self.silent:
            time.sleep(0.02)
        self.asked.append(verb)
        arguments.pop("deadline", None)
        answer = getattr(self, f"do_{verb}", None)
        if answer is None:
            raise QuadvisError(f"there is no verb {quoted(verb)}")
        try:
            return answer(**arguments)
        except TypeError as error:
            raise QuadvisError(str(error)) from None

    def subscribe(self, topic: str, take: Callable[..., None]) -> Callable[[], None]:
        self._takers[topic].append(take)
        return lambda: self._takers[topic].remove(take)

    def publish(self, topic: str, header: Mapping[str, Any], array: Any = None) -> None:
        if not self.silent:
            for take in list(self._takers[topic]):
                take(header, array)

    def close(self) -> None:
        self._closed.set()
        if self._flight is not None:
            self._flight.end()

    def _tell_state(self) -> None:
        while not self._closed.wait(0.125):
            self.publish("state", self.do_status())

    # verbs

    def do_status(self) -> dict[str, Any]:
        flight, graph = self._flight, self.diagram.graph
        found = {
            "Target": self.name, "Application": self.diagram.name, "Status": self.state,
            "SessionTime": time.monotonic() - self._born, "Mode": "Real-Time Single-Tasking",
            "Variant": self.diagram.variant or "", "Hash": self.diagram.hash[:12],
            "ExecTime": flight.time if flight else 0.0, "StopTime": float(self.diagram.stop_time),
            "SampleTime": float(graph.tick), "Tasks": flight.tasks() if flight else [],
            "Problem": self.problem,
        }  # fmt: skip
        found["CPUOverload"] = "detected" if any(task["overruns"] for task in found["Tasks"]) else "none"
        if self.verdicts is not None:
            found["Passed"] = all(verdict.met for verdict in self.verdicts)
            found["Verdicts"] = [verdict.facts() for verdict in self.verdicts]
        return found

    def do_startprofiler(self) -> None:
        self.profiled = None

    def do_stopprofiler(self) -> None:
        """Say what a target does of the time of its blocks: here each call has taken as long."""
        nodes = [node for node in self.diagram.graph.nodes if "output" in node.block.interface.arguments]
        self.profiled = [[node.path, "output", node.task.name, 10, 2e-4, 1e-5, 3e-5] for node in nodes]

    def do_getprofilerdata(self) -> dict[str, Any]:
        blocks = [{"computer": "", "cost": 6e-7, "offset": 0, "calls": 0, "methods": self.profiled}]
        return {"on": False, "tick": 5e-3, "tasks": [], "blocks": blocks if self.profiled else []}

    def do_applications(self) -> list[dict[str, Any]]:
        return [
            {"name": name, "loaded": self.applications[name] is self.diagram}
            for name in sorted(self.applications)
        ]

    def do_load(self, application: str) -> None:
        if self.state != "stopped":
            raise QuadvisError(f"{self.diagram.name} runs: stop it first")
        if application not in self.applications:
            raise QuadvisError(f"there is no application {quoted(application)} on the target")
        self._load(self.applications[application])
        self._flight = None
        self.publish("event", {"event": "loaded", "application": application})

    def do_drawing(self) -> str:
        return self.picture or drawn(self.diagram)

    def do_signals(self, first: int = 0) -> list[dict[str, Any]]:
        found = []
        for node in self.diagram.graph.nodes:
            for name, port in node.block.interface.outputs.items():
                if port.signal.scalar == "frame":
                    continue
                signal = f"{node.path}.{name}"
                found.append({
                    "name": signal, "unit": str(node.unit(name)),
                    "also": [port for port, source in self.diagram.ports.items() if source == signal],
                    "shape": list(node.shape(name)),
                    "type": port.signal.scalar, "doc": port.doc, "task": node.task.name,
                    "period": float(node.task.period or 0), "computer": "", "block": node.kind,
                })  # fmt: skip
        return found

    def do_getsignal(self, names: list[str]) -> dict[str, Any]:
        with self._lock:
            run = self._flight.run if self._flight else None
            return {name: None if run is None else _plain(run[name]) for name in names}

    def do_watch(self, names: list[str]) -> dict[str, Any]:
        ports = {each["name"]: each for each in self.do_signals()}
        for name in names:
            if name not in ports:
                raise QuadvisError(f"there is no signal {quoted(name)}")
        self.watched = names, hashlib.sha256(f"{self.diagram.hash} {names}".encode()).hexdigest()[:12]
        return {
            "topic": "values/1", "set": self.watched[1],
            "sizes": [math.prod(ports[name]["shape"]) for name in names],
        }  # fmt: skip

    def tell_values(self) -> None:
        """Publish what is watched."""
        names, mark = self.watched
        if names and self._takers["values/1"]:
            numbers = [np.ravel(value) for value in self.do_getsignal(names).values()]
            self.publish("values/1", {"set": mark, "without": []}, np.concatenate(numbers).astype(float))

    def do_parameters(self, first: int = 0) -> list[dict[str, Any]]:
        return self.parameters.facts()

    def do_setparam(self, values: Mapping[str, Any]) -> dict[str, Any]:
        run = self._flight.run if self._flight and self.state == "running" else None
        if run is None:
            raise QuadvisError("nothing runs: start it first")
        found = [self.parameters.find(name) for name in values]
        old = [self.parameters.text(path, param) for path, param in found]
        with self._lock:
            before = len(run.changes)
            for name, value in values.items():
                run[name] = value
        while len(run.changes) < before + len(found) and self.state == "running":
            time.sleep(0.001)
        changes = run.changes[before:]
        self.parameters.took([change[1:] for change in changes])
        facts = [
            {"name": f"{path}.{param}", "old": text, "new": self.parameters.text(path, param)}
            for (path, param), text in zip(found, old, strict=True)
        ]
        tick = changes[-1].tick
        found = {"tick": tick, "time": tick * float(self.diagram.graph.tick), "changes": facts}
        self.publish("event", {"event": "tuned", "application": self.diagram.name, **found})
        return found

    def do_start(self) -> str:
        drawn(self.diagram)  # before the run, which shares the interpreter with it
        if self.state == "running":
            raise QuadvisError(f"{self.diagram.name} runs already")
        self._number += 1
        self.verdicts, self.problem = None, ""
        log = self.folder / f"{self.diagram.name}-{self._number}.mcap"
        self._flight = Flight(self, log)
        self.state = "running"
        self.publish("event", {"event": "started", "application": self.diagram.name})
        self.publish("state", self.do_status())
        return log.stem

    def do_stop(self) -> None:
        if self.state != "running" or self._flight is None:
            raise QuadvisError(f"{self.diagram.name} does not run")
        self._flight.end()

    def ended(self, flight: Flight, problem: str) -> None:
        self.state, self.problem = "stopped", problem
        self.verdicts = self.diagram.judge(read_log(flight.log)).verdicts
        self.publish("event", {"event": "stopped", "application": self.diagram.name, "problem": problem})
        self.publish("state", self.do_status())

    def do_logs(self) -> list[dict[str, Any]]:
        return [{"name": p.stem, "size": p.stat().st_size} for p in sorted(self.folder.glob("*.mcap"))]

    def do_getlog(self, name: str, offset: int = 0, count: int = PIECE) -> dict[str, Any]:
        path = self.folder / f"{name}.mcap"
        if path not in self.folder.glob("*.mcap"):
            raise QuadvisError(f"there is no log {quoted(name)}")
        with path.open("rb") as file:
            file.seek(offset)
            return {"data": file.read(count), "size": path.stat().st_size}

    def do_picture(self, signal: str) -> dict[str, Any]:
        import cv2

        with self._lock:
            if self._flight is None:
                raise QuadvisError("no picture has come")
            frame = self._flight.run[signal]
        if not isinstance(frame, Frame):
            raise QuadvisError(f"{quoted(signal)} is no signal with pictures")
        if not frame.pixels.size:
            raise QuadvisError("no picture has come")
        data = cv2.imencode(".jpg", frame.pixels, [cv2.IMWRITE_JPEG_QUALITY, 80])[1].tobytes()
        height, width = frame.pixels.shape[:2]
        facts = {"format": "jpeg", "width": width, "height": height, "sequence": frame.sequence}
        return facts | {"data": data}

    # scopes

    def do_addscope(self, id: int | None = None, type: str = "host") -> int:
        number = id or next(n for n in range(1, 100) if n not in self.scopes)
        self.scopes[number] = Scope(self, number)
        return number

    def do_remscope(self, ids: list[int]) -> None:
        for number in ids:
            self.scopes.pop(number, None)

    def do_setscope(self, id: int, values: Mapping[str, Any]) -> dict[str, Any]:
        return self._scope(id).set(values)

    def do_startscope(self, ids: list[int]) -> None:
        for number in ids:
            self._scope(number).start()

    def do_stopscope(self, ids: list[int]) -> None:
        for number in ids:
            self._scope(number).status = "Interrupted"

    def do_trigger(self, ids: list[int]) -> None:
        for number in ids:
            self._scope(number).forced = True

    def do_scopes(self) -> list[dict[str, Any]]:
        return [scope.facts() for scope in self.scopes.values()]

    def _scope(self, number: int) -> Scope:
        if number not in self.scopes:
            raise QuadvisError(f"there is no scope {number}")
        return self.scopes[number]

    def unit(self, name: str) -> str:
        path, _, port = name.partition("[")[0].rpartition(".")
        return str(self.diagram.graph[path].unit(port))


class Scope:
    """A scope in xPC's words. A package is one acquisition; one that runs free follows the last at once."""

    def __init__(self, target: StandIn, number: int) -> None:
        self.target, self.number, self.status = target, number, "Interrupted"
        self.properties = {
            "Signals": [], "NumSamples": 20, "Decimation": 1, "NumPrePostSamples": 0,
            "TriggerMode": "FreeRun", "TriggerSignal": "", "TriggerLevel": 0.0, "TriggerSlope": "Either",
            "AutoRestart": False,
        }  # fmt: skip
        self.forced, self.sequence = False, 0

    def set(self, values: Mapping[str, Any]) -> dict[str, Any]:
        for name in values:
            if name not in self.properties:
                raise QuadvisError(f"a scope has no property {quoted(name)}")
        self.properties |= values
        return self.facts()

    def facts(self) -> dict[str, Any]:
        return {"id": self.number, "Status": self.status, **self.properties}

    def start(self) -> None:
        flight = self.target._flight
        self.places = [flight.place(name) for name in self.properties["Signals"]] if flight else []
        self.names, self.units = (
            list(self.properties["Signals"]),
            [self.target.unit(n) for n in self.properties["Signals"]],
        )
        trigger = self.properties["TriggerSignal"]
        self.trigger = flight.place(trigger) if flight and trigger else None
        before = max(0, -self.properties["NumPrePostSamples"])
        self.before: deque[list[float]] = deque(maxlen=before)
        self.rows: list[list[float]] = []
        self.last = float("nan")
        self.acquiring = False
        self.status = "Acquiring" if flight else "Interrupted"

    def take(self, tick: int, time: float, read: Callable[..., float]) -> None:
        if self.status != "Acquiring" or tick % self.properties["Decimation"]:
            return
        row = [time, *(read(*place) for place in self.places)]
        if not self.acquiring and len(self.before) == self.before.maxlen and self._triggers(read):
            self.acquiring, self.rows = True, list(self.before)
            self.at = len(self.before)
        if not self.acquiring:
            self.before.append(row)
            return
        self.rows.append(row)
        if len(self.rows) >= self.properties["NumSamples"]:
            self.sequence += 1
            free = self.properties["TriggerMode"] == "FreeRun"
            header = {
                "scope": self.number, "sequence": self.sequence, "names": self.names, "units": self.units,
                "trigger": None if free else self.at, "lost": 0, "part": 0, "parts": 1,
                "tick": float(self.target.diagram.graph.tick),
            }  # fmt: skip
            self.target.publish(f"scope/{self.number}", header, np.array(self.rows))
            self.acquiring, self.rows = False, []
            if not free and not self.properties["AutoRestart"]:
                self.status = "Finished"

    def _triggers(self, read: Callable[..., float]) -> bool:
        mode = self.properties["TriggerMode"]
        if mode == "FreeRun" or self.forced:
            self.forced = False
            return True
        if mode != "Signal" or self.trigger is None:
            return False
        level, now, last = self.properties["TriggerLevel"], read(*self.trigger), self.last
        self.last = now
        rises, falls = last < level <= now, last > level >= now
        return {"Rising": rises, "Falling": falls}.get(self.properties["TriggerSlope"], rises or falls)


class Flight:
    """One run in a thread, each tick at its time."""

    def __init__(self, target: StandIn, log: Path) -> None:
        self.target, self.log, self.time = target, log, 0.0
        self.run = LiveRun(target.diagram, log=log)
        for path, name, value in target.parameters.tuned:
            self.run[f"{path}.{name}"] = value
        self._times = {task.name: np.zeros(WORDS, np.int64) for task in target.diagram.graph.tasks}
        for words in self._times.values():
            clear(words)
        self._ended = threading.Event()
        self._opened = threading.Event()
        self._thread = threading.Thread(target=self._fly, daemon=True)
        self._thread.start()
        self._opened.wait(10)

    def place(self, name: str) -> tuple[str, str, Any]:
        return find_value(self.run.diagram, name)

    def _read(self, path: str, port: str, index: Any) -> float:
        value = self.run._engine.read(path, port)
        return float(value[index] if index else value)

    def end(self) -> None:
        self._ended.set()
        self._thread.join(10)

    def _fly(self) -> None:
        diagram, target = self.target.diagram, self.target
        tick, tasks = float(diagram.graph.tick), list(diagram.graph.tasks)
        every = {task.name: max(1, round(float(task.period or 0) / tick)) for task in tasks}
        problem = ""
        with self.run as run:
            self._opened.set()
            began = told = time.monotonic()
            target.began = time.time()
            try:
                for number in range(diagram.ticks):
                    due = began + number * tick
                    if self._ended.wait(max(0.0, due - time.monotonic())):
                        break
                    late = time.monotonic() - due
                    with target._lock:
                        begin = time.monotonic()
                        run.advance()
                        taken = time.monotonic() - begin
                        self.time = number * tick
                        for scope in list(target.scopes.values()):
                            scope.take(number, self.time, self._read)
                        if begin - told >= VALUES:
                            told = begin
                            target.tell_values()
                    for task in tasks:
                        if number % every[task.name] == 0:
                            self._count(self._times[task.name], late, taken, late > every[task.name] * tick)
            except QuadvisError as error:
                problem = str(error)
        target.ended(self, problem)

    @staticmethod
    def _count(words: Any, late: float, taken: float, missed: bool) -> None:
        words[STEPS] += 1
        words[OVERRUNS] += missed
        for at, seconds in ((LATENESS, late), (TET, taken)):
            nanoseconds = max(0, round(seconds * 1e9))
            count(words, at, nanoseconds, bin_of(nanoseconds))

    def tasks(self) -> list[dict[str, Any]]:
        periods = {
            task.name: float(task.period or self.target.diagram.graph.tick)
            for task in self.target.diagram.graph.tasks
        }
        found = []
        for name, shared in self._times.items():
            words = shared.copy()  # the run goes on
            facts = TaskTimes.read(name, periods[name], words).facts()
            found.append({"computer": "", "task": name, **facts})
        return found


def _plain(value: Any) -> Any:
    return value.tolist() if hasattr(value, "tolist") else value
