"""`computers`: who runs the blocks of a diagram; without it everything is one computer."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from quadvis.diagram.entries import named_entries
from quadvis.diagram.sections.forms import QUANTITY, TEXT, Schema, closed, map_of, ref
from quadvis.diagram.sections.overload import OVERLOAD, OverloadLimits, written
from quadvis.diagram.sections.section import Checked, FileSection
from quadvis.diagram.times import read_duration
from quadvis.document import YamlMap, YamlNode
from quadvis.errors import UNKNOWN, Faults, Place, Unknown, known

COMPUTER_KEYS = ("cpu", "priority", "poll", "overload", "on_loss")
MOST = {"cpu": 4095, "priority": 99}
AUTO = "auto"
STOP, CONTINUE = LOSSES = ("stop", "continue")


class ComputerSpec(NamedTuple):
    """One computer, and how its loop is to be treated in a real-time run; None: as the command line says.

    ``cpu``, ``priority`` and ``poll`` are as the options of the same names. ``overload`` has the limits of
    its tasks; None: those of the diagram. ``on_loss`` says what its loss means for the others: they stop
    with safe values, or continue without it.
    """

    place: Place
    cpu: int | None = None
    priority: int | None = None
    poll: str | None = None
    overload: OverloadLimits | None = None
    on_loss: str | None = None

    @property
    def is_dispensable(self) -> bool:
        """True if the other computers fly on without it."""
        return self.on_loss == CONTINUE


Computers = dict[str, ComputerSpec | Unknown]


class ComputersSection(FileSection[Computers]):
    """The computers of a diagram, by name."""

    key = "computers"
    words = (
        "who runs the blocks: `name: {cpu, priority, poll, overload, on_loss}`, each of which may be left "
        "out; every block then says `at: name`, see below"
    )

    def read(self, node: YamlNode | None, faults: Faults) -> Computers:
        """Return the computers in the order of the file."""
        found: Computers = {}
        for name, value in named_entries(node, "computer", faults):
            with faults.about(f"computer '{name}'"):
                fields = faults.collect(value.fields, (), COMPUTER_KEYS, faults)
                found[name] = UNKNOWN if fields is None else _computer(fields, value.place, faults)
        return found

    def schema(self) -> Schema:
        """Return the schema: computers by name."""
        return map_of(ref("computer"), "who runs the blocks")

    def definitions(self, blocks: object) -> dict[str, Schema]:
        """Return the form of one computer."""
        count: Schema = {"type": "integer", "minimum": 0}
        return {"computer": closed(COMPUTER_KEYS, {
            "cpu": {**count, "maximum": MOST["cpu"], "description": "the processor to stay on"},
            "priority": {**count, "maximum": MOST["priority"], "description": "of SCHED_FIFO; 0 for none"},
            "poll": {"anyOf": [TEXT, QUANTITY], "description": "how long to look at the clock, or 'auto'"},
            "overload": OVERLOAD.schema(),
            "on_loss": {"enum": list(LOSSES), "description": "what its loss means for the others"},
        })}  # fmt: skip

    def resolved(self, diagram: Checked) -> Any:
        """Return the computers with what is said of them."""
        return {name: dict(_written(spec)) for name, spec in _known(diagram.values[self])} or None


def _computer(fields: YamlMap, place: Place, faults: Faults) -> ComputerSpec:
    counts: dict[str, Any] = {}
    for key, most in MOST.items():
        count = faults.collect(fields[key].integer) if key in fields else None
        if count is not None and not 0 <= count <= most:
            faults.add(fields[key].place, f"'{key}' must be from 0 to {most}", "write one such as 1")
        elif count is not None:
            counts[key] = count
    poll = faults.collect(_poll, fields["poll"]) if "poll" in fields else None
    overload = OVERLOAD.read(fields["overload"], faults) if "overload" in fields else None
    on_loss = faults.collect(fields["on_loss"].choice, LOSSES) if "on_loss" in fields else None
    return ComputerSpec(place, **counts, poll=poll, overload=overload, on_loss=on_loss)


def _poll(node: YamlNode) -> str:
    if node.text() != AUTO:
        read_duration(node)
    return node.text()


def _written(spec: ComputerSpec) -> Mapping[str, Any]:
    plain = {key: getattr(spec, key) for key in COMPUTER_KEYS if getattr(spec, key) is not None}
    if spec.overload is not None:
        plain["overload"] = written(spec.overload)
    return plain


def _known(computers: Computers) -> list[tuple[str, ComputerSpec]]:
    return [(name, spec) for name, spec in computers.items() if known(spec)]


COMPUTERS = ComputersSection()
