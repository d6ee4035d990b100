"""The application that a target has loaded: its runs one after another, its signals, its parameters."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from quadvis.diagram.diagram import Diagram
from quadvis.errors import QuadvisError, quoted, sentence
from quadvis.machine.files import SVG, write_output
from quadvis.realtime.helm import ENDED
from quadvis.run.result import Result
from quadvis.run.tuned import new_values
from quadvis.target.background import in_thread
from quadvis.target.bundle import ApplicationBundle
from quadvis.target.newest import NewestValues
from quadvis.target.parameters import Parameters, as_written, read_set
from quadvis.target.profiler import Profiler
from quadvis.target.scopes import ApplicationScopes
from quadvis.target.session import Session
from quadvis.target.store import Store
from quadvis.target.watches import Watches
from quadvis.wire.desk import Done

if TYPE_CHECKING:
    from quadvis.target.kernel import Publish

AUTOSAVE = "autosave"  # the parameter set with what was tuned at the end of the last run
STOPPED, LOADING, READY, RUNNING, STOPPING = "stopped", "loading", "ready", "running", "stopping"


class Application:
    """One application. Its state is ``loading`` until its processes are ready, and then ``ready``.

    A run goes from there to ``running`` and to ``stopped``; the next `start` begins anew. The values that
    were tuned stay. ``problem`` says why the last run came to an early end, ``result`` is its result.
    """

    def __init__(
        self,
        bundle: ApplicationBundle,
        diagram: Diagram,
        store: Store,
        publish: Publish,
        wants: Callable[[str], bool],
    ) -> None:
        self.bundle, self.diagram = bundle, diagram
        self.parameters = Parameters(diagram)
        self.newest = NewestValues(diagram)
        self.scopes = ApplicationScopes(
            diagram, store.scope_folder(bundle.name), publish, lambda: self._began
        )
        self.watches = Watches(self.newest, publish, wants)
        self.profiler = Profiler()
        self.result: Result | None = None
        self.problem = ""
        self.said: list[str] = []  # since the last start
        self._store, self._publish = store, publish
        self._session: Session | None = None
        self._stop_time: float | None = None
        self.log_samples = math.inf  # of the fastest task, which the log of a run has at least
        self._drawing: Future[Any] | None = None

    def take_default(self) -> None:
        """Give parameters the values of the default set, if there is one; QuadvisError if it does not fit."""
        chosen = self.default_set
        if not chosen:
            return
        try:
            self.tune(read_set(self._store.known_set(self.name, chosen))).result()
        except QuadvisError as error:
            problem = f"{self.name} cannot have its default parameter set {quoted(chosen)}: {error}"
            raise QuadvisError(sentence(problem, "name another one, or none")) from None

    @property
    def default_set(self) -> str:
        """The name of the parameter set that it has when it is loaded; "" for none."""
        return self._store.default_set(self.name)

    @property
    def name(self) -> str:
        """Its name."""
        return self.bundle.name

    @property
    def session(self) -> Session | None:
        """The run that is going on or was the last one."""
        return self._session

    @property
    def waiting_log(self) -> Path | None:
        """The log of a run that has not begun; None if there is none."""
        session = self._session
        return session.log if session is not None and self.state in (LOADING, READY) else None

    @property
    def stop_time(self) -> float:
        """The stop time of the next run, or of the one that goes on (s)."""
        return float(self.diagram.stop_time if self._stop_time is None else self._stop_time)

    @property
    def time(self) -> float:
        """The time of the last tick of its run (s)."""
        return self._session.helm.time if self._session is not None else 0.0

    @property
    def running(self) -> bool:
        """True while the loops run."""
        return self.state in (RUNNING, STOPPING)

    @property
    def state(self) -> str:
        """Return the word for what it does."""
        session = self._session
        if session is None or not session.running:
            return STOPPED
        if session.stopped or session.helm.state == ENDED:
            return STOPPING
        if session.helm.is_begun:  # of which the supervisor may not have heard yet
            return RUNNING
        return READY if session.helm.state == READY else LOADING

    # from loaded to stopped

    @property
    def _began(self) -> int | None:
        """The instant of tick 0 of its run (ns since 1970)."""
        return self._session.helm.began if self._session is not None else None

    def prepare(self) -> Future[Any]:
        """Start the processes; the Future is done when they are ready to run."""
        assert self._session is None or not self._session.running
        self.newest.clear()
        self.scopes.begin()
        self.problem, self.result, self.said = "", None, []
        self._session = Session(
            self.diagram, self.bundle.engine, self._store.next_log(self.name), self.log_samples,
            self.profiler, [*self.newest.taps, *self.scopes.taps], self._stop_time, self._say,
            self._settle, self._ended,
        )  # fmt: skip
        if self.parameters.tuned:
            self._session.helm.tune(self.parameters.tuned)
        return self._session.ready

    def start(self, at: int | None = None) -> Future[Any]:
        """Start a run, at an instant (ns) if one is given; QuadvisError if one is going on."""
        if self.running:
            raise QuadvisError(f"{self.name} runs already")
        ready = self._session.ready if self.state in (LOADING, READY) else self.prepare()  # type: ignore[union-attr]
        session = self._session
        assert session is not None
        begun: Future[Any] = Future()

        def begin(done: Future[Any]) -> None:
            problem = done.exception()
            if problem is not None:
                begun.set_exception(problem)
            else:
                session.helm.begin(at)
                self._event("started")
                begun.set_result(session.log.stem)

        ready.add_done_callback(begin)
        return begun

    def stop(self) -> Future[Any]:
        """Stop the run; the Future is done when the outputs have their safe values and the log is closed."""
        session = self._session
        if session is None or self.state not in (RUNNING, STOPPING):
            raise QuadvisError(f"{self.name} does not run")
        session.helm.stop()
        return session.over

    def align(self, shift: int) -> None:
        """Move the ticks of the run by so much since its start (ns), slowly."""
        if self._session is not None:
            self._session.helm.align(shift)

    def make_safe(self) -> None:
        """Give all outputs their safe values at once, and stop the run."""
        if self._session is not None and self._session.running:
            self._session.helm.stop(safe_first=True)

    def close(self) -> None:
        """End all that goes on."""
        session = self._session
        if session is not None and session.running:
            session.helm.stop()
            session.join()

    def refuse_times(self) -> None:
        """Raise QuadvisError while a run is going on."""
        if self.running:
            raise QuadvisError("times cannot change in a run: stop it first")

    def set_times(self, stop_time: float | None, sample_time: float | None) -> None:
        """Give the next run another stop time or another sample time (s); `inf` is a run without end."""
        from quadvis.target.rescale import lasting, rescaled

        changed = self.diagram if sample_time is None else rescaled(self.diagram, sample_time)
        if stop_time is not None:
            fitting = lasting(changed, stop_time) if math.isfinite(stop_time) else None
            self._stop_time, changed = (stop_time, changed) if fitting is None else (None, fitting)
        self.close()
        self.diagram = changed
        self.prepare().result()

    def set_log(self, samples: float) -> None:
        """Let the log of the next run have so many samples of the fastest task, at least; `inf` for all."""
        if self.running:
            raise QuadvisError("the log cannot change in a run: stop it first")
        self.log_samples = samples
        self._prepare_again()

    def _prepare_again(self) -> None:
        """Begin anew if what waits for its start was begun in another way."""
        if self.state in (LOADING, READY):
            self.close()
            self.prepare().result()

    def _say(self, sentence: str) -> None:
        self.said.append(sentence)
        self._event("said", text=sentence)

    def _settle(self, tick: int) -> None:
        """Hand on what is known of all ticks before one."""
        self.scopes.settle(tick)
        self.watches.tell()

    def _ended(self) -> None:
        session = self._session
        assert session is not None
        self.problem, self.result = session.problem, session.result
        if self.parameters.tuned:
            try:
                self.parameters.save(self._store.set_path(self.name, AUTOSAVE))
            except (QuadvisError, OSError) as error:  # such as a disk that the log has filled
                self._say(f"the values that were tuned are not kept: {error}")
        self.scopes.end()
        self._event("stopped", problem=self.problem)

    def _event(self, what: str, **more: Any) -> None:
        self._publish("event", {"event": what, "application": self.name, **more}, None)

    # looking and tuning

    def values(self, names: Sequence[str]) -> dict[str, Any]:
        """Return the newest values of signals by name; of all if none is named. None is one not there yet."""
        return {name: self.newest.value(name) for name in names or self.newest.names}

    def tune(self, values: Mapping[str, Any]) -> Future[Any]:
        """Give parameters values, all at one tick.

        The Future has the tick, its time, and what has changed: ``[{name, old, new}]``.
        """
        group = new_values(self.diagram, {name: as_written(value) for name, value in values.items()})
        before = {(each.path, each.name): self.parameters.text(each.path, each.name) for each in group}
        told: Future[Any] = Future()

        def took(tick: int) -> None:
            self.parameters.took(group)
            facts = [
                {"name": f"{path}.{name}", "old": old, "new": self.parameters.text(path, name)}
                for (path, name), old in before.items()
            ]
            time = float(tick * self.diagram.graph.tick)
            self._event("tuned", tick=tick, time=time, changes=facts)
            found = {"tick": tick, "time": time, "changes": facts}
            old, new = ({each["name"]: each[which] for each in facts} for which in ("old", "new"))
            told.set_result(Done(found, tick, old, new))

        session = self._session
        if session is None or not self.running:
            self.parameters.check(group)
            if session is not None and session.running:
                session.helm.tune(group)
            took(0)  # the next run begins with them
            return told

        def done(future: Future[int]) -> None:
            problem = future.exception()
            if problem is not None:
                told.set_exception(problem)
            else:
                took(future.result())

        session.helm.tune(group).add_done_callback(done)
        return told

    @property
    def pictures(self) -> list[str]:
        """The names of the signals that are pictures."""
        from quadvis.target.picture import picture_names

        return picture_names(self.diagram)

    def picture(self, signal: str) -> Future[Any]:
        """Return the newest picture of a signal as JPEG; QuadvisError if nothing runs."""
        session = self._session
        if session is None or not self.running:
            raise QuadvisError(f"{self.name} does not run, so there are no pictures")
        from quadvis.target.picture import encoded

        return in_thread(partial(encoded, self.diagram, session.helm, signal))

    def drawing(self) -> Future[Any]:
        """Return the picture of the diagram as SVG; it is drawn once, and kept."""
        if self._drawing is None:
            place = self._store.drawing(self.diagram.hash)
            self._drawing = in_thread(partial(_drawn, self.diagram, place))
        return self._drawing


def _drawn(diagram: Diagram, place: Path) -> str:
    """Return the drawing of a diagram, from its place if it has been drawn before."""
    from quadvis.diagram.picture import draw_diagram

    if not place.exists():
        write_output(place, SVG, draw_diagram(diagram))
    return place.read_text()
