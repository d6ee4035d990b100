"""The target as its host sees it: xPC Target's object, its names and its rules."""

from __future__ import annotations

import hashlib
import math
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from quadvis.errors import QuadvisError, quoted
from quadvis.errors.caller import as_given
from quadvis.host.connection import HostConnection, connect
from quadvis.host.logs import TargetLogs
from quadvis.host.properties import PART_NAMES, PROPERTIES, known, number_of, seconds, shown
from quadvis.host.scope import HostScope
from quadvis.machine.columns import table
from quadvis.wire.limits import PIECE

# What a diagram can be given when it is loaded: as an option, and as an argument.
_OF_DIAGRAMS = (
    ("--variant", "variant"), ("--set", "settings"), ("--params", "params"), ("--stop-time", "stop_time"),
    ("--name", "name"), ("--computer", "computers"),
)  # fmt: skip

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from quadvis.diagram.diagram import Diagram
    from quadvis.diagram.settings import Files, Given
    from quadvis.host.profiler import ProfilerData
    from quadvis.output.log_reader import Log

LOADING = 120.0  # s that a target has to get an application ready
STOPPING = 20.0  # s that a run has to come to its end


class Target:
    """A machine that flies, or this one: ``Target("lab1")``, or ``Target()`` for the target of this machine.

    The properties of xPC Target are attributes: ``tg.Status``, ``tg.ExecTime`` (s), ``tg.AvgTET`` (s), and so
    on, see ``print(tg)``; each also has a name in Python's style, such as ``tg.exec_time``. ``StopTime``,
    ``SampleTime`` and ``MaxLogSamples`` can be set while the application is stopped. The last one bounds the
    log of a run to so many of the newest samples of the fastest task, and at most twice as many (``LogMode``
    is "Wrapped" then); infinite, the default, is all of them ("Normal"). ``ViewMode`` is "All", or the number
    of the one target scope that the target shows on its own terminal.

    Whoever changes something becomes the operator for that moment, or, inside ``with tg.operator():``, for as
    long as that lasts.

    Without a name, a target on this machine is started if none runs, and ends by itself when it is unused.
    QuadvisError says in a sentence why something is refused, or that the target does not answer.
    """

    _connection: HostConnection
    _logs: TargetLogs

    def __init__(self, name: str | None = None, *, connection: HostConnection | None = None) -> None:
        self.__dict__["_connection"] = made = connection or connect(name)
        self.__dict__["_logs"] = TargetLogs(made.name, made.request)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the connection; the target goes on."""
        self._logs.close()
        self._connection.close()

    @property
    def name(self) -> str:
        """The name of the target."""
        return self._connection.name

    @property
    def level(self) -> int:
        """What this host's key may do, from 0 (all) to 4 (see the status)."""
        return self._connection.level

    def request(self, verb: str, /, **arguments: Any) -> Any:
        """Return what the target answers to a verb, see `quadvis wire`; as the operator if needed.

        The argument ``deadline`` is how long it may take (s).
        """
        return self._connection.operate(verb, **arguments)

    def subscribe(self, topic: str, take: Callable[[Mapping[str, Any], Any], object]) -> Callable[[], None]:
        """Let ``take(header, array)`` be called with the data of a topic, in another thread.

        Return what ends that. A topic has one taker; another one takes its place.
        """
        self._connection.subscribe(topic, take)
        return lambda: self._connection.unsubscribe(topic)

    # properties

    def status(self) -> dict[str, Any]:
        """Return all properties at one moment."""
        found: dict[str, Any] = self.request("status")
        return found

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        if name in PART_NAMES:
            return self.getlog(PART_NAMES[name])
        meant = known(name)
        if meant == "Scopes":
            return [each["id"] for each in self.request("scopes")]
        found = self.status().get(meant)
        return math.inf if meant == "MaxLogSamples" and found is None else found

    def __setattr__(self, name: str, value: Any) -> None:
        meant = known(name)
        if meant in ("StopTime", "SampleTime"):
            self._connection.operate("settime", deadline=LOADING, **{meant: seconds(name, value)})
        elif meant == "ViewMode":
            number = None if str(value).lower() == "all" else int(number_of(name, value))
            self._connection.operate("setview", id=number)
        elif meant == "MaxLogSamples":
            self._connection.operate("setlog", deadline=LOADING, MaxLogSamples=number_of(name, value))
        else:
            raise AttributeError(
                f"'{name}' of a target cannot be set; StopTime, SampleTime, MaxLogSamples and ViewMode can"
            )

    def __repr__(self) -> str:
        return f"<Target {self.name}>"

    def __str__(self) -> str:
        found = self.status()
        rows = [(name, shown(name, found[name])) for name in PROPERTIES if name in found and name != "Tasks"]
        return "\n".join([f"Target: {self.name}", *(f"  {line}" for line in table(rows))])

    def operator(self) -> Any:
        """Return a context in which this host is the operator: nobody else changes what the target does.

        If this process ends or hangs inside, the target does what the diagram's `on_host_loss` says.
        """
        return self._connection.operator()

    # applications

    def load(
        self,
        what: str | Path | Diagram,
        *,
        variant: str | None = None,
        settings: Given = (),
        params: Files = (),
        stop_time: str | None = None,
        engine: str = "auto",
        name: str | None = None,
        computers: Sequence[str] = (),
    ) -> Target:
        """Load a diagram, or an application that the target keeps under a name, in place of the one there.

        ``computers`` are those of the diagram that this target is to be; none means all of them. QuadvisError
        if an application is to be another one than it is kept as.
        """
        application = str(what)
        if not isinstance(what, str | Path) and not hasattr(what, "graph"):
            raise QuadvisError(
                f"a target loads a path, a diagram, or an application's name, not {quoted(what)}"
            )
        if not isinstance(what, str) or what.endswith((".yaml", ".yml")):
            diagram = _loaded(what, variant, settings, params, stop_time)
            application = self._send(diagram, name, engine, computers)
        else:
            _check_kept(what, variant, settings, params, stop_time, name, computers)
        self._connection.operate("load", application=application, deadline=LOADING)
        return self

    def _send(self, diagram: Diagram, name: str | None, engine: str, computers: Sequence[str]) -> str:
        """Send a diagram with its files as far as they are missing there; return the bundle's SHA-256."""
        from quadvis.host.packing import pack

        bundle, paths = pack(diagram, name, engine, computers)
        data = bundle.data
        digest = hashlib.sha256(data).hexdigest()
        for missing in self.request("have", files=[*dict.fromkeys([*bundle.files.values(), digest])]):
            self._put(missing, data if missing == digest else paths[missing].read_bytes())
        return digest

    def _put(self, digest: str, data: bytes) -> None:
        for offset in range(0, max(1, len(data)), PIECE):
            piece = data[offset : offset + PIECE]
            self.request("put", file=digest, size=len(data), offset=offset, data=piece)

    @property
    def applications(self) -> list[str]:
        """The names of the applications that the target keeps."""
        return [each["name"] for each in self.request("applications")]

    def start(self) -> Target:
        """Start the application; QuadvisError if it runs already."""
        self._connection.operate("start", deadline=LOADING)
        return self

    def stop(self) -> Target:
        """Stop the application: safe values at the outputs, log closed. It stays loaded."""
        self._connection.operate("stop", deadline=STOPPING)
        return self

    def __pos__(self) -> Target:
        """Start the application, as ``+tg`` does in xPC Target."""
        return self.start()

    def __neg__(self) -> Target:
        """Stop the application, as ``-tg`` does in xPC Target."""
        return self.stop()

    def unload(self) -> None:
        """Remove the application that is loaded from the target's memory; the target keeps its files."""
        self._connection.operate("unload", deadline=LOADING)

    # parameters and signals

    def setparam(self, name: str | Mapping[str, Any], value: Any = None) -> int:
        """Give a parameter a value, such as "2.5 rad/s" or a number in SI units; return the tick.

        A map gives several parameters their values at one tick.
        """
        values = {name: value} if isinstance(name, str) else dict(name)
        return int(self.tune(values)["tick"])

    def tune(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Do as `setparam`; return the tick, its time (s), and what has changed: ``[{name, old, new}]``."""
        found: dict[str, Any] = self._connection.operate("setparam", values=_plain(values))
        return found

    def getparam(self, *names: str) -> Any:
        """Return the value of a parameter as a diagram writes it; of several, or of all tunable, by name."""
        found = self.request("getparam", names=list(names))
        return found[names[0]] if len(names) == 1 else found

    def getsignal(self, *names: str) -> Any:
        """Return the newest value of a signal (SI units); of several, or of all, by name."""
        found = self.request("getsignal", names=list(names))
        return found[names[0]] if len(names) == 1 else found

    def signals(self) -> list[dict[str, Any]]:
        """Return what there is to know of each signal."""
        return self._all("signals")

    def parameters(self) -> list[dict[str, Any]]:
        """Return what there is to know of each parameter."""
        return self._all("parameters")

    def _all(self, verb: str) -> list[dict[str, Any]]:
        found: list[dict[str, Any]] = []
        while True:
            more = self.request(verb, first=len(found), count=1000)
            found += more
            if len(more) < 1000:
                return found

    def saveparamset(self, name: str) -> None:
        """Let the target keep the present values of all that can be tuned under a name."""
        self._connection.operate("saveparamset", name=name)

    def loadparamset(self, name: str) -> int:
        """Give parameters the values of a set that the target keeps; return the tick."""
        return int(self._connection.operate("loadparamset", name=name)["tick"])

    def listparamsets(self) -> list[str]:
        """Return the names of the parameter sets of the application."""
        return list(self.request("listparamsets"))

    def getparamset(self, name: str) -> dict[str, Any]:
        """Return the values of a parameter set by name; "" is the set of the present values."""
        return dict(self.request("getparamset", name=name) if name else self.getparam())

    def deleteparamset(self, name: str) -> None:
        """Remove a parameter set from the target."""
        self._connection.operate("deleteparamset", name=name)

    def exportparamset(self, name: str, path: str | Path) -> Path:
        """Write a parameter set of the target to a file here, for `quadvis run --params`; return the path."""
        from quadvis.target.parameters import write_set

        about = f"the parameter set {name} of {self.Application} on {self.name}"
        write_set(Path(path), self.getparamset(name), about)
        return Path(path)

    def importparamset(self, path: str | Path, name: str | None = None) -> str:
        """Let the target keep the values of a parameter file as a set; return its name, that of the file."""
        from quadvis.target.parameters import read_set

        chosen = name or Path(path).stem
        self._connection.operate("putparamset", name=chosen, values=read_set(Path(path)))
        return chosen

    def setdefaultparamset(self, name: str, application: str = "") -> None:
        """Let the application that is loaded, or another one, have a set whenever it is loaded.

        "" is no set: then it has the values of its diagram.
        """
        self._connection.operate("setdefaultparamset", name=name or None, application=application or None)

    def compare(self, first: str, second: str = "") -> list[tuple[str, Any, Any]]:
        """Return the parameters that differ between two sets, with both values; "" is the present one."""
        one, two = self.getparamset(first), self.getparamset(second)
        return [
            (name, one.get(name), two.get(name))
            for name in sorted({*one, *two})
            if one.get(name) != two.get(name)
        ]

    # profiler

    def startProfiler(self) -> None:
        """Take the times of tasks' steps and of blocks' calls from now on, while the application flies on.

        If none runs, the next run is timed from its start on. Timing a call makes it longer, by what
        `getProfilerData` says; timing the steps costs nothing.
        """
        self._connection.operate("startprofiler")

    def stopProfiler(self) -> None:
        """Take no more times, so that timing costs none any more; what was found stays until the next run."""
        self._connection.operate("stopprofiler")

    def profile(self, duration: str | float = 2.0) -> ProfilerData:
        """Start the profiler for so long (s, or a text such as "2 s"), and return what it has found.

        It ends earlier if the run does. QuadvisError if no application runs.
        """
        from quadvis.host.profiler import profiled

        return profiled(self, duration)

    def getProfilerData(self) -> ProfilerData:
        """Return what was found in the newest run up to now, or until the profiler was stopped.

        ``print`` it for a report; its method `write` makes a trace for Perfetto.
        """
        from quadvis.host.profiler import profiler_data

        return profiler_data(self.request)

    start_profiler, stop_profiler, get_profiler_data = startProfiler, stopProfiler, getProfilerData

    # scopes

    def addscope(
        self,
        type: str = "host",
        number: int | None = None,
        *,
        signals: str | Sequence[str] = (),
        **settings: Any,
    ) -> HostScope:
        """Add a scope: ``host``, ``target`` or ``file``; return it. Settings are xPC's, see `HostScope`."""
        number = int(self._connection.operate("addscope", id=number, type=type))
        scope = HostScope(self._connection, number)
        try:
            scope.set(signals=signals, **settings)
        except QuadvisError:
            scope.remove()
            raise
        return scope

    def getscope(self, number: int) -> HostScope:
        """Return a scope of the target by its number."""
        return HostScope(self._connection, number)

    def remscope(self, *numbers: int) -> None:
        """Remove scopes; all of them if none is named."""
        chosen = list(numbers) or [each["id"] for each in self.request("scopes")]
        if chosen:
            self._connection.operate("remscope", ids=chosen)

    # results

    def logs(self) -> list[dict[str, Any]]:
        """Return the logs that the target keeps, the oldest first."""
        return self._logs.all()

    def fetchlog(self, name: str | None = None, path: str | Path | None = None) -> Path:
        """Copy a log of the target, the newest if none is named, to a path here; return the path."""
        if name is None:
            name = self._logs.newest_name()
        place = Path(path) if path is not None else Path(tempfile.mkdtemp(prefix="quadvis-")) / f"{name}.mcap"
        return self._logs.copy(name, place)

    def getlog(
        self, signal: str | None = None, first: int = 1, count: int | None = None, decimation: int = 1
    ) -> Log | NDArray[np.float64]:
        """Return the newest log, or samples of one of its signals as xPC's `getlog` gives them.

        ``TimeLog``, ``StateLog``, ``OutputLog`` and ``TETLog`` are parts of it, see
        `quadvis.host.logs.samples_of`; they are also attributes. The first sample has the number 1.
        """
        if signal is None:
            return self._logs.newest()[-1]
        return self._logs.samples(signal, first, count, decimation)


def _loaded(
    what: str | Path | Diagram, variant: str | None, settings: Given, params: Files, stop_time: str | None
) -> Diagram:
    if not isinstance(what, str | Path):
        return what
    from quadvis.diagram.load import load

    return load(what, variant=variant, settings=settings, params=params, stop_time=stop_time)


def _check_kept(application: str, *given: Any) -> None:
    """Refuse what an application that is kept has already."""
    for value, (option, argument) in zip(given, _OF_DIAGRAMS, strict=True):
        if value:
            named = as_given(option, argument)
            problem = f"the application {quoted(application)} is loaded as it is kept, without {named}"
            raise QuadvisError(f"{problem}; name the file of the diagram, or leave {named} out")


def _plain(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values as they can be sent: no numpy, and no maps, for which there are texts."""
    from quadvis.target.parameters import as_written

    return {
        name: value.tolist() if hasattr(value, "tolist") else as_written(value)
        for name, value in values.items()
    }
