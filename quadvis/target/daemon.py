"""`quadvis target`: the process that stays, from its sockets' opening to the safe end of the last run."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Future, wait
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from quadvis.errors import QuadvisError
from quadvis.target.display import TargetDisplay
from quadvis.target.kernel import Kernel
from quadvis.target.notify import ALIVE, READY, STOPPING, Notifier
from quadvis.target.store import Store

if TYPE_CHECKING:
    from quadvis.wire.who import Who

STATE = 0.2  # s between two statuses on the stream
LOOK = 0.1  # s between two looks at the clock
SHOWN = 0.2  # s between two pictures on the terminal


def serve(
    name: str,
    *,
    listen: str | None = None,
    folder: str | Path | None = None,
    startup: str | None = None,
    idle: float | None = None,
    say: Callable[[str], None],
    screen: TextIO | None = None,
) -> None:
    """Be a target until the process is told to end; then the last run has ended, with safe outputs.

    ``listen`` is an address for hosts with keys. ``startup`` names an application that is started at once.
    With ``idle`` it ends when no application is loaded and nobody has asked for anything for so long (s).
    ``say`` takes sentences; on ``screen``, if it is a terminal, target scopes are shown.
    QuadvisError if another process is this target, or an address is taken.
    """
    daemon = Daemon(name, Path(folder) if folder else state_folder(name), say, screen)
    with daemon:
        daemon.open(listen)
        if startup:
            daemon.start(startup)
        daemon.run(idle)


def state_folder(name: str) -> Path:
    """Return where a target keeps its applications, sets and logs, if nothing else is said."""
    if given := os.environ.get("STATE_DIRECTORY"):  # of a systemd unit
        return Path(given.split(":")[0])
    base = os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state"
    return Path(base) / "quadvis" / name


def _service_path(name: str) -> str | None:
    """Return where a target listens for this machine's user if systemd has started it."""
    from quadvis.wire.address import service_path

    given = os.environ.get("RUNTIME_DIRECTORY")
    return str(service_path(name, given.split(":")[0])) if given else None


class Daemon:
    """A target as a process: its kernel, its sockets, its files."""

    def __init__(
        self, name: str, folder: Path, say: Callable[[str], None], screen: TextIO | None = None
    ) -> None:
        from quadvis.wire.audit import Audit
        from quadvis.wire.hosts import AuthorizedHosts
        from quadvis.wire.keys import own_key, own_names
        from quadvis.wire.server import Server

        self._display = TargetDisplay(screen, say) if screen is not None and screen.isatty() else None
        self._say = say = self._display.say if self._display is not None else say
        self._stack = ExitStack()
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        self._stack.enter_context(_alone(folder, name))
        self._asked = time.monotonic()
        pair = own_key(name) if name in own_names() else None
        self._server = Server(
            name, self._handle, hosts=AuthorizedHosts(), pair=pair, audit=Audit(folder / "audit.jsonl"),
            on_lost=lambda who: self.kernel.lose_host(), say=say,
        )  # fmt: skip
        self.kernel = Kernel(name, Store(folder), self._server.publish, self._server.wants)
        self._notifier = Notifier()
        self._alive = 0.0  # when it is to be said next that this process lives

    def __enter__(self) -> Daemon:
        return self

    def __exit__(self, *_: object) -> None:
        self._notifier.say(STOPPING)
        if self._display is not None:
            self._display.close()
        with self._stack:
            self._server.close()
            self.kernel.close()

    def open(self, listen: str | None) -> None:
        """Open the sockets: for this machine's user, and for hosts with keys if there is an address."""
        path = self._server.listen_here(_service_path(self.kernel.name))
        self._say(f"target {self.kernel.name}: this machine's user, at {path}")
        if listen:
            from quadvis.wire.address import read_address

            address = read_address(listen)
            port = self._server.listen(address.host, address.port)
            self._say(f"target {self.kernel.name}: hosts with keys, at {address.host}:{port}")
        self._server.start()
        self._notifier.say(READY)

    def start(self, application: str) -> None:
        """Load and start an application; meanwhile systemd hears that this process lives."""
        self._wait(self.kernel.load(application))
        self._wait(self.kernel.start(None))

    def _wait(self, work: Future[Any]) -> None:
        while not wait([work], LOOK).done:
            self._live()
        work.result()

    def _live(self) -> None:
        """Say that this process lives, when it is time to."""
        if self._notifier.period is not None and time.monotonic() >= self._alive:
            self._alive = time.monotonic() + self._notifier.period
            self._notifier.say(ALIVE)

    def run(self, idle: float | None) -> None:
        """Serve until SIGTERM, SIGHUP or Ctrl-C."""
        due = shown = 0.0
        while True:
            time.sleep(LOOK)
            now = time.monotonic()
            if now >= due and self._server.wants("state"):
                due = now + STATE
                self._server.publish("state", self.kernel.status() | self._operator(), None)
            if self._display is not None and now >= shown:
                shown = now + SHOWN
                self._display.show(self._head(), self.kernel.shown(), self.kernel.view)
            self._live()
            if not self._server.serves:
                self._asked = now  # nobody could ask
            if idle is not None and self.kernel.is_idle and now - self._asked > idle:
                return

    def _head(self) -> str:
        """Return the line about the target above its scopes."""
        application = self.kernel.application
        if application is None:
            return self.kernel.name
        return f"{self.kernel.name}: {application.name} is {application.state}, {application.time:.1f} s"

    def _operator(self) -> dict[str, Any]:
        operator = self._server.lease.operator
        return {"Operator": operator.name if operator else None}

    def _handle(self, verb: str, arguments: Mapping[str, Any], who: Who) -> Any:
        self._asked = time.monotonic()
        found = self.kernel.call(verb, arguments)
        return found | self._operator() if verb == "status" else found


class _alone:
    """Hold a lock on the folder of a target; QuadvisError if another process has it."""

    def __init__(self, folder: Path, name: str) -> None:
        self._path, self._name = folder / ".lock", name

    def __enter__(self) -> None:
        import fcntl

        self._file = self._path.open("w")
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            self._file.close()
            raise QuadvisError(f"the target {self._name} runs already, with the same folder") from None

    def __exit__(self, *_: object) -> None:
        with suppress(OSError):
            self._file.close()
