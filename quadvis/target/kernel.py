"""The kernel: one application loaded, started, stopped, looked at and tuned, by the verbs of the wire."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

from quadvis.diagram.sections.on_host_loss import CONTINUE, SAFE
from quadvis.errors import QuadvisError
from quadvis.run.tuned import new_values
from quadvis.target.admission import admit
from quadvis.target.application import Application
from quadvis.target.bundle import DIGEST, ApplicationBundle
from quadvis.target.parameters import as_written, read_set
from quadvis.target.scopes import ShownScope
from quadvis.target.status import status
from quadvis.target.store import Store

ALL = "All"  # the ViewMode that shows all target scopes

Publish = Callable[[str, Mapping[str, Any], Any], None]  # takes a topic, a header, an array or None


class Kernel:
    """What a target does.

    ``publish`` takes what its streams carry, ``wants(topic)`` says whether anybody listens.

    The verbs are methods. Each returns plain data, or a Future of it where this takes long. They are called
    from one thread. QuadvisError says in a sentence why one is refused.
    """

    def __init__(self, name: str, store: Store, publish: Publish, wants: Callable[[str], bool]) -> None:
        self.name, self.store = name, store
        self._publish, self._wants = publish, wants
        self._born = time.monotonic()
        self._application: Application | None = None
        self.view: int | None = None  # the target scope that is shown alone
        # What takes long is done here, one after the other; the verbs are answered meanwhile.
        self._worker = ThreadPoolExecutor(1, "target")

    def call(self, verb: str, arguments: Mapping[str, Any]) -> Any:
        """Do what a verb of the wire says."""
        return getattr(self, verb)(**arguments)

    def close(self) -> None:
        """End a run, with its outputs at their safe values."""
        application = self._application
        if application is not None:
            application.close()
        self._worker.shutdown()
        if self._application is not None:
            self._application.close()
        self.store.close()

    def lose_host(self) -> None:
        """Do what the application wants when its operator is lost."""
        application = self._application
        if application is None or not application.running:
            return
        wish = application.diagram.on_host_loss
        self._event("the operator is lost", wish=wish)
        if wish == SAFE:
            application.make_safe()
        elif wish != CONTINUE:
            application.stop()

    # applications

    def applications(self) -> list[dict[str, Any]]:
        """Return the applications that are kept."""
        found = []
        for name in self.store.applications:
            bundle = self.store.bundle(name)
            loaded = self._application is not None and self._application.name == name
            found.append({"name": name, "variant": bundle.variant, "hash": bundle.hash, "loaded": loaded})
        return found

    def have(self, files: Sequence[str]) -> list[str]:
        """Return those SHA-256 of files that are missing here."""
        return self.store.missing(files)

    def put(self, file: str, size: int, offset: int, data: bytes) -> int:
        """Take a piece of a file."""
        return self.store.put(file, size, offset, data)

    def load(self, application: str) -> Future[Any]:
        """Load an application in the place of the one that is loaded; it is ready to start then.

        It is named by its name, or by the SHA-256 of its bundle, which is kept under its name then.
        """
        self._refuse_running()
        return self._worker.submit(self._load, application)

    def _load(self, application: str) -> dict[str, Any]:
        self._refuse_running()
        bundle = self._bundle(application)
        diagram = admit(bundle, self.store.place(bundle))
        self._unload()
        made = Application(bundle, diagram, self.store, self._publish, self._wants)
        made.take_default()
        self._application = made
        self._event("loaded", application=bundle.name)
        made.prepare().result()
        return {"name": bundle.name, "variant": bundle.variant, "hash": bundle.hash}

    def _refuse_running(self) -> None:
        if self._application is not None and self._application.running:
            raise QuadvisError(f"{self._application.name} runs: stop it first")

    def _bundle(self, application: str) -> ApplicationBundle:
        """Return an application by its name, or keep the one whose bundle has a SHA-256."""
        if not DIGEST.fullmatch(application):
            return self.store.bundle(application)
        bundle = ApplicationBundle.parse(self.store.contents(application))
        if self._application is not None and self._application.name == bundle.name:
            self._unload()
        self.store.add(bundle)
        return bundle

    def unload(self) -> Future[Any]:
        """End the run, if there is one, and forget the application that is loaded."""
        return self._worker.submit(self._unload)

    def _unload(self) -> None:
        if self._application is not None:
            self._application.close()
            self._application = None
            self._event("unloaded")

    def start(self, at: int | None) -> Future[Any]:
        """Start the application, at an instant of this machine's monotonic clock (ns) if one is given."""
        return self._loaded.start(at)

    def clock(self) -> int:
        """Return this machine's monotonic clock (ns)."""
        return time.monotonic_ns()

    def align(self, shift: int) -> None:
        """Move the ticks of the run by so much since its start (ns), slowly."""
        self._loaded.align(shift)

    def stop(self) -> Future[Any]:
        """Stop the application: safe values, log closed. It stays loaded."""
        return self._loaded.stop()

    def settime(self, StopTime: float | None, SampleTime: float | None) -> Future[Any]:
        """Give the next run another stop time, or another sample time (s)."""
        application = self._loaded
        application.refuse_times()
        return self._worker.submit(application.set_times, StopTime, SampleTime)

    def setlog(self, MaxLogSamples: float) -> Future[Any]:
        """Bound the log of the next run."""
        return self._worker.submit(self._loaded.set_log, MaxLogSamples)

    def startprofiler(self) -> None:
        """Take the times of tasks and blocks from now on."""
        self._loaded.profiler.start()

    def stopprofiler(self) -> None:
        """Take no more times; what was found stays."""
        self._loaded.profiler.stop()

    def getprofilerdata(self, task: int | None, computer: int | None, first: int, count: int) -> Any:
        """Return what the profiler has found: all but single steps and calls, or some of these."""
        profiler = self._loaded.profiler
        if task is not None:
            return profiler.steps(task, first, count)
        if computer is not None:
            return profiler.calls(computer, first, count)
        return profiler.facts(float(self._loaded.diagram.graph.tick))

    def status(self) -> dict[str, Any]:
        """Return the state of the target, in xPC's words."""
        found = status(self.name, self._application, time.monotonic() - self._born)
        return found | {"ViewMode": self.view or ALL}

    @property
    def application(self) -> Application | None:
        """The application that is loaded."""
        return self._application

    @property
    def is_idle(self) -> bool:
        """True if nothing is loaded."""
        return self._application is None

    @property
    def _loaded(self) -> Application:
        if self._application is None:
            raise QuadvisError("no application is loaded: load one first")
        return self._application

    # signals and parameters

    def signals(self, first: int, count: int) -> list[dict[str, Any]]:
        """Return what there is to know of each signal."""
        return self._loaded.newest.facts()[first : first + count]

    def getsignal(self, names: Sequence[str]) -> dict[str, Any]:
        """Return the newest values of signals; all of them if none is named."""
        return self._loaded.values(names)

    def watch(self, names: Sequence[str]) -> dict[str, Any]:
        """Return the topic on which the newest numbers of signals are published from now on."""
        return self._loaded.watches.add(names)

    def parameters(self, first: int, count: int) -> list[dict[str, Any]]:
        """Return what there is to know of each parameter."""
        return self._loaded.parameters.facts()[first : first + count]

    def getparam(self, names: Sequence[str]) -> dict[str, Any]:
        """Return values of parameters as a diagram writes them; of all that can be tuned if none is named."""
        parameters = self._loaded.parameters
        if not names:
            return {each["name"]: each["value"] for each in parameters.facts() if each["tunable"]}
        return {name: parameters.text(*parameters.find(name)) for name in names}

    def setparam(self, values: Mapping[str, Any]) -> Future[Any]:
        """Give parameters values, all at one tick."""
        return self._loaded.tune(values)

    def saveparamset(self, name: str) -> str:
        """Keep the present values of all that can be tuned under a name."""
        application = self._loaded
        application.parameters.save(self.store.set_path(application.name, name))
        return name

    def putparamset(self, name: str, values: Mapping[str, Any]) -> str:
        """Keep values of parameters under a name, if they may be tuned so; nothing changes."""
        application = self._loaded
        given = {each: as_written(value) for each, value in values.items()}
        application.parameters.check(new_values(application.diagram, given))
        application.parameters.keep(self.store.set_path(application.name, name), values)
        return name

    def loadparamset(self, name: str) -> Future[Any]:
        """Give parameters the values of a set, all at one tick."""
        return self._loaded.tune(self.getparamset(name))

    def listparamsets(self) -> list[str]:
        """Return the names of the parameter sets of the application."""
        return self.store.sets(self._loaded.name)

    def getparamset(self, name: str) -> dict[str, Any]:
        """Return the values of a parameter set by name."""
        return read_set(self.store.known_set(self._loaded.name, name))

    def deleteparamset(self, name: str) -> None:
        """Remove a parameter set."""
        self.store.drop_set(self._loaded.name, name)

    def setdefaultparamset(self, name: str | None, application: str | None) -> None:
        """Let an application have a parameter set whenever it is loaded; None for none."""
        self.store.keep_default(application or self._loaded.name, name or "")

    # scopes

    def addscope(self, id: int | None, type: str) -> int:
        """Add a scope; return its number."""
        return self._loaded.scopes.add(id, type)

    def remscope(self, ids: Sequence[int]) -> None:
        """Remove scopes."""
        self._loaded.scopes.remove(ids)

    def setscope(self, id: int, values: Mapping[str, Any]) -> dict[str, Any]:
        """Set properties of a scope."""
        return self._loaded.scopes.set(id, values)

    def startscope(self, ids: Sequence[int]) -> None:
        """Let scopes acquire."""
        self._loaded.scopes.start(ids)

    def stopscope(self, ids: Sequence[int]) -> None:
        """Interrupt scopes."""
        self._loaded.scopes.stop(ids)

    def trigger(self, ids: Sequence[int]) -> None:
        """Trigger scopes by software."""
        self._loaded.scopes.trigger(ids)

    def scopes(self) -> list[dict[str, Any]]:
        """Return all scopes with their properties; none if nothing is loaded."""
        return self._application.scopes.facts() if self._application is not None else []

    def setview(self, id: int | None) -> None:
        """Show one target scope alone on the target's own terminal; None for all of them."""
        self.view = id

    def shown(self) -> list[ShownScope]:
        """Return the target scopes."""
        application = self._application
        return application.scopes.shown() if application is not None else []

    def getscope(self, id: int, first: int, count: int) -> dict[str, Any]:
        """Return samples of the newest package of a scope."""
        return self._loaded.scopes.samples(id, first, count)

    # results

    def logs(self) -> list[dict[str, Any]]:
        """Return the logs that are kept, the oldest first."""
        waiting = self._application.waiting_log if self._application is not None else None
        found = [(path, path.stat()) for path in self.store.logs() if path != waiting]
        return [{"name": path.stem, "size": at.st_size, "changed": at.st_mtime} for path, at in found]

    def getlog(self, name: str, offset: int, count: int) -> dict[str, Any]:
        """Return a piece of a log."""
        path = self.store.known_log(name)
        with path.open("rb") as file:
            file.seek(offset)
            return {"data": file.read(count), "size": path.stat().st_size}

    def picture(self, signal: str) -> Future[Any]:
        """Return the newest picture of a signal as JPEG."""
        return self._loaded.picture(signal)

    def pictures(self) -> list[str]:
        """Return the names of the signals that are pictures."""
        return self._loaded.pictures

    def drawing(self) -> Future[Any]:
        """Return the picture of the diagram as SVG."""
        return self._loaded.drawing()

    def _event(self, what: str, **more: Any) -> None:
        self._publish("event", {"event": what, **more}, None)
