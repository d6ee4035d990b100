"""The devices of a real-time run: their guardian, and what binds blocks to them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext
from typing import Any

from quadvis.block import CABLE, Block, Card, Device, Input, LineDevice, NewsDevice, Output
from quadvis.engine.engine import Engine
from quadvis.errors import RunError
from quadvis.graph.devices import devices
from quadvis.graph.graph import Graph
from quadvis.machine.serial_port import Line
from quadvis.native.choice import Announce
from quadvis.realtime.cables import Cable, Ends
from quadvis.realtime.guard import Guard
from quadvis.realtime.guardian import Alarm, Standing, outboxes, words_for
from quadvis.realtime.heartbeat import Patience
from quadvis.realtime.outlet import OutputPort
from quadvis.realtime.shared_ports import lent_port

Report = Callable[[str], None]


@dataclass(frozen=True)
class PortBindings:
    """What the devices of an application need, by path.

    These are the guardian's words with the number of each outbox, and what gives inputs at shared ports the
    descriptors of these.
    """

    words: Any = None
    boxes: Mapping[str, int] = field(default_factory=dict)
    lenders: Mapping[str, Connection] = field(default_factory=dict)

    def bind(self, engine: Engine, ports: Mapping[str, str], report: Report) -> None:
        """Bind the devices of an engine, before it opens them.

        ``ports`` are the paths of the ptys of those inputs that are at the end of a cable; ``report`` takes
        what a device has to say during the run.
        """
        boxes = outboxes(self.words) if self.boxes else []
        for path, device in devices(engine.graph):
            block = engine.bound(path)
            block.report = partial(_report, report, path)
            if path in self.boxes:
                block.deliver = boxes[self.boxes[path]].put
            if path in self.lenders:
                assert isinstance(device, LineDevice)
                block.lent = partial(lent_port, device.settings, self.lenders[path])
            if path in ports:
                block.actual_port = ports[path]


def _report(report: Report, path: str, sentence: str) -> None:
    report(f"block '{path}': {sentence}")


class Devices:
    """The ports of a graph, from `start` to `close`; a graph without devices has no process for them."""

    def __init__(self, context: SpawnContext, graph: Graph, on_host_loss: str, standing: Standing) -> None:
        self._context, self._on_host_loss, self._standing = context, on_host_loss, standing
        self._devices = list(devices(graph))
        self._outputs = {
            path: device for path, device in self._devices if isinstance(device, Output | NewsDevice)
        }
        self._inputs = {path: device for path, device in self._devices if isinstance(device, Input)}
        words = context.RawArray("q", words_for(len(self._outputs))) if self._outputs else None
        boxes = {path: number for number, path in enumerate(self._outputs)}
        self.ports: dict[str, str] = {}  # of inputs at the end of a cable, by path, from `open` on
        self._shared = _shared(self._outputs, self._inputs)
        pipes = {
            path: context.Pipe() for path, device in self._inputs.items() if device.port_given in self._shared
        }
        self._readers = {self._inputs[path].port_given: pipe[0] for path, pipe in pipes.items()}
        self.bindings = PortBindings(words, boxes, {path: pipe[1] for path, pipe in pipes.items()})
        lines = {device.port_given: device.settings for device in self._all() if _on_cable(device)}
        self.cables = [Cable(port, line) for port, line in lines.items() if isinstance(line, Line)]
        self._guard: Guard | None = None

    def start(self, patiences: Sequence[Patience]) -> int | None:
        """Start the guardian, and return its process; None if nothing needs one."""
        if not self._outputs:
            return None
        self._guard = Guard(
            self._context,
            self.bindings.words,
            patiences,
            self._on_host_loss,
            self._standing,
            self._readers,
        )
        self._guard.start()
        return self._guard.process.pid

    def open(self, ends: Mapping[str, Ends], announce: Announce) -> None:
        """Let all output ports have their initial frames; RunError if one refuses.

        ``ends`` are those of its `cables`.
        """
        for path, device in self._inputs.items():
            if _on_cable(device):
                self.ports[path] = ends[device.port_given].b
        if self._guard is not None:
            ports = [self._output_port(path, device, ends) for path, device in self._outputs.items()]
            self._guard.open(ports, announce)

    def missing(self) -> Iterator[str]:
        """Yield a sentence for each device whose port is surely not there."""
        for path, device in self._devices:
            if words := device.missing():
                yield str(RunError(words, block=path))

    def watch(self, process: int, vital: bool) -> None:
        """Let the guardian watch an application, whose end makes the outputs safe if it is vital."""
        if self._guard is not None:
            self._guard.watch(process, vital)

    @property
    def sources(self) -> list[Connection | int]:
        """What becomes ready when the guardian says something, or has ended."""
        return self._guard.sources if self._guard is not None else []

    def alarm(self) -> Alarm | None:
        """Return what is wrong, if a port is lost, a loop hangs, or the guardian itself is lost."""
        return self._guard.alarm() if self._guard is not None else None

    def make_safe(self) -> None:
        """Let all ports have safe frames from now on."""
        if self._guard is not None:
            self._guard.make_safe()

    def close(self) -> list[str]:
        """End everything; a sentence for each port that may be without its safe frames."""
        return self._guard.close() if self._guard is not None else []

    def _all(self) -> Iterator[LineDevice]:
        yield from self._outputs.values()
        yield from self._inputs.values()

    def _output_port(self, path: str, device: Output | NewsDevice, ends: Mapping[str, Ends]) -> OutputPort:
        port = ends[device.port_given].a if _on_cable(device) else device.port_given
        return OutputPort.of(device, path, port, shared=device.port_given in self._shared)


def guards_all(part: Graph) -> bool:
    """Return whether a graph has nothing that needs safe values besides output devices, if it has any."""
    writers = [
        node.block
        for node in part.nodes
        if "write" in node.block.interface.arguments or type(node.block).write_safe is not Block.write_safe
    ]
    return all(isinstance(block, Output) or block.harmless for block in writers)


def _shared(outputs: Mapping[str, LineDevice], inputs: Mapping[str, LineDevice]) -> set[str]:
    """Return the ports that several devices have together."""
    found, seen = set(), set()
    for path, device in {**outputs, **inputs}.items():
        port = device.port_given
        if port in seen or (path in outputs and path in inputs):
            found.add(port)
        seen |= set() if _on_cable(device) or isinstance(device.settings, Card) else {port}
    return found


def _on_cable(device: Device) -> bool:
    return device.port_given.startswith(CABLE)
