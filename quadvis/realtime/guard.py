"""The guardian as its supervisor has it: started before the applications, ended after all of them."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext
from multiprocessing.process import BaseProcess
from typing import Any

from quadvis.errors import RunError
from quadvis.machine.ports import PortError
from quadvis.machine.processes import launching
from quadvis.native.choice import Announce
from quadvis.realtime.guardian import (
    FAREWELL,
    LAST,
    Alarm,
    GuardianSetup,
    Guarding,
    Order,
    Standing,
    Watch,
    guard,
    looked,
    supervisor_lifeline,
)
from quadvis.realtime.heartbeat import Patience
from quadvis.realtime.lifeline import Lifeline
from quadvis.realtime.outlet import Outlet, OutputPort
from quadvis.realtime.schedule import NANOSECONDS
from quadvis.realtime.shared_ports import SharedPorts

START = 30.0  # s that the guardian has to open its ports
SILENT = 3.0  # s without a look at the loops, after which it counts as hanging
END = 3.0  # s that it has to send its last safe frames
LOST = Alarm("the guardian of the outputs has been lost")


class Guard:
    """Starts the guardian, tells it whom to watch and what to send, and hears its alarms.

    ``words`` (a RawArray of `words_for` words) hold the outboxes of `quadvis.realtime.guardian.outboxes`,
    in the order of the ports: whoever gives commands puts frames there. ``readers`` get the descriptors of
    shared ports, by path.
    """

    def __init__(
        self,
        context: SpawnContext,
        words: Any,
        patiences: Sequence[Patience],
        on_host_loss: str,
        standing: Standing,
        readers: Mapping[str, Connection] | None = None,
    ) -> None:
        self._ports: tuple[OutputPort, ...] = ()
        self._looked = looked(words)
        self._lifeline = Lifeline(supervisor_lifeline(words))
        self._link, self._theirs = context.Pipe()
        setup = GuardianSetup(
            (),
            words,
            tuple(patiences),
            self._theirs,
            os.getpid(),
            on_host_loss,
            standing,
            readers or {},
        )
        # A daemon is told to end if this process ends without `close`, such as for lack of memory. For any
        # other process Python would wait, and it for us.
        self.process: BaseProcess = context.Process(target=guard, args=(setup,), name="guardian", daemon=True)
        self._started = self._lost = False

    def start(self) -> None:
        """Start it: it waits for its ports; this thread is the one that calls `close`."""
        self._lifeline.make()
        with launching():
            self.process.start()
        self._started = True
        self._lifeline.hold()  # and it looks there once it has its ports
        self._theirs.close()

    def open(self, ports: Sequence[OutputPort], announce: Announce) -> None:
        """Wait until all ports have their initial frames; RunError if one refuses."""
        self._ports = tuple(ports)
        self._say(self._ports)
        until = time.monotonic() + START
        while time.monotonic() < until:
            if self._link.poll(START):
                said = self._receive()
                if isinstance(said, Guarding):
                    announce(f"real time, guardian: {said.grants}")
                    return
                raise RunError(said.reason, block=said.block)
        raise RunError(f"the guardian was not ready after {START:g} s")

    def watch(self, process: int, vital: bool = True) -> None:
        """Let it watch an application: when a vital one ends, safe frames are sent."""
        self._say(Watch(process, vital))

    def make_safe(self) -> None:
        """Let it send safe frames at once, and from now on."""
        self._say(Order.SAFE)

    @property
    def sources(self) -> list[Connection | int]:
        """What becomes ready when it says something, or has ended."""
        return [self.process.sentinel, self._link]

    def alarm(self) -> Alarm | None:
        """Return the alarm that it has raised, or that it has ended or hangs; None if all is well."""
        if not self._lost and self._link.poll():
            raised: Alarm = self._receive()
            return raised
        silent = (time.monotonic_ns() - self._looked[0]) / NANOSECONDS
        self._lost = self._lost or not self.process.is_alive() or silent > SILENT
        return LOST if self._lost else None

    def close(self) -> list[str]:
        """Let it send its last safe frames and end; a sentence for each block whose port may not have them.

        If it was lost, this process sends them in its place.
        """
        if not self._started:
            return []
        self._started = False
        try:
            if self._ends():
                return []
        finally:
            self._lifeline.release()
        return _in_its_place([port for port in self._ports if not port.news])

    def _ends(self) -> bool:
        """Let its process end, orderly if possible; return whether it was."""
        self._say(Order.CLOSE)
        parting = max([port.parting for port in self._ports], default=0) / NANOSECONDS
        self.process.join(0 if self._lost else END + parting)
        if self.process.exitcode == 0:
            return True
        self.process.kill()
        self.process.join()
        return False

    def _receive(self) -> Any:
        try:
            return self._link.recv()
        except (EOFError, OSError):
            self._lost = True
            return LOST

    def _say(self, what: Any) -> None:
        with suppress(OSError):
            self._link.send(what)


def _in_its_place(ports: Sequence[OutputPort]) -> list[str]:
    """Send the last safe frames in the guardian's place; return what went wrong, in sentences.

    No port waits for another one: a device may take its time to start, or to be released.
    """
    shared, wrong, waiting = SharedPorts(), [], []
    for port in ports:
        taken, open_port = shared.taken(port)
        outlet = Outlet(taken, lambda: None, open_port)
        try:
            outlet.open()
            waiting.append(outlet)
        except PortError as error:
            wrong.append(_unsafe(outlet, error))
    opened = list(waiting)
    until = time.monotonic_ns() + LAST + max([port.parting for port in ports], default=0)
    while waiting and (now := time.monotonic_ns()) < until:
        for outlet in list(waiting):
            try:
                outlet.serve(now, safe=True)
            except PortError as error:
                wrong.append(_unsafe(outlet, error))
                outlet.close()
            if outlet.has_its_farewell(FAREWELL):
                waiting.remove(outlet)
        due = min([outlet.due for outlet in waiting], default=now)
        time.sleep(min(max(0, due - time.monotonic_ns()), until - now) / NANOSECONDS)
    wrong += [_unsafe(outlet, "the time was too short") for outlet in waiting if not outlet.safe_frames]
    for outlet in opened:
        outlet.finish(time.monotonic_ns())
    return wrong


def _unsafe(outlet: Outlet, why: object) -> str:
    return f"block '{outlet.port.block}': its safe values could not be sent: {why}"
