"""When a part or a block runs: the keys `when`, `triggered`, `reset` and `initial` under `blocks`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from quadvis.diagram.entries import with_clean_names
from quadvis.diagram.parameters import QUANTITY_KEYS
from quadvis.diagram.sections.block_schema import CONDITION_KEYS, EDGES, WHEN_KEYS, WIRE_KEYS
from quadvis.diagram.sections.inputs import InputSpec, read_input
from quadvis.document import YamlMap, YamlNode, YamlScalar
from quadvis.errors import UNKNOWN, Faults, Place, Unknown, known

__all__ = ["CONDITION_KEYS", "EdgeSpec", "PartCondition", "read_condition"]

HELD, RESET = KEPT = ("held", "reset")


class EdgeSpec(NamedTuple):
    """A signal and which of its edges count."""

    signal: InputSpec
    edge: str


@dataclass(frozen=True)
class PartCondition:
    """When a part or a block runs. ``place`` is that of the first of the keys, ``places`` are those of all.

    ``initial`` are the values of outputs before it has run, by the names of its ports.
    """

    place: Place
    places: Mapping[str, Place]
    when: InputSpec | None
    states: str | Unknown
    outputs: str | Unknown
    triggered: EdgeSpec | None
    reset: EdgeSpec | None
    initial: Mapping[str, InputSpec]

    @property
    def pauses(self) -> bool:
        """Whether there are ticks at which it does not run."""
        return self.when is not None or self.triggered is not None

    @property
    def sets_back(self) -> bool:
        """Whether it may set states back."""
        return self.reset is not None or self.states == RESET

    @property
    def signals(self) -> Iterator[InputSpec]:
        """The signals on which it depends, and the initial values."""
        yield from (self.when,) if self.when is not None else ()
        yield from (each.signal for each in (self.triggered, self.reset) if each is not None)
        yield from self.initial.values()


def read_condition(fields: YamlMap, faults: Faults) -> PartCondition | Unknown:
    """Return what an entry says of when it runs; `UNKNOWN` if a signal is not readable."""
    places = {key: fields[key].place for key in CONDITION_KEYS if key in fields}
    when, states, outputs = _read_when(fields["when"], faults) if "when" in fields else (None, HELD, HELD)
    triggered, reset = (_read_edge(fields.get(key), faults) for key in ("triggered", "reset"))
    initial = _read_initial(fields.get("initial"), faults)
    if not known(triggered) or not known(reset) or not known(initial):
        return UNKNOWN
    made = PartCondition(
        next(iter(places.values())), places, when, states, outputs, triggered, reset, initial
    )
    if initial and not made.pauses:
        problem = "'initial' is for what does not always run"
        faults.add(places["initial"], problem, "add 'when' or 'triggered', or leave it out")
    return made


def _read_when(node: YamlNode, faults: Faults) -> tuple[InputSpec | None, str | Unknown, str | Unknown]:
    """Read a signal, or ``{from: signal, states: reset, outputs: reset}``."""
    if not isinstance(node, YamlMap) or any(key in node for key in QUANTITY_KEYS):
        return read_input(node, faults), HELD, HELD
    fields = node.fields(("from",), (*WHEN_KEYS, *WIRE_KEYS[1:]), faults)
    kept = [faults.read(fields[key].choice, KEPT) if key in fields else HELD for key in WHEN_KEYS]
    return read_input(_without(fields, WHEN_KEYS), faults), kept[0], kept[1]


def _read_edge(node: YamlNode | None, faults: Faults) -> EdgeSpec | Unknown | None:
    """Read ``rising signal``, a signal, or ``{from: signal, edge: rising}``."""
    if node is None:
        return None
    if isinstance(node, YamlMap):
        fields = node.fields(("from",), ("edge", *WIRE_KEYS[1:]), faults)
        edge = faults.read(fields["edge"].choice, EDGES) if "edge" in fields else EDGES[0]
        return EdgeSpec(read_input(_without(fields, ("edge",)), faults), edge) if known(edge) else UNKNOWN
    text = faults.collect(node.text)
    if text is None:
        return UNKNOWN
    word, blank, rest = text.partition(" ")
    if not blank:
        return EdgeSpec(read_input(node, faults), EDGES[0])
    assert isinstance(node, YamlScalar)
    edge = faults.read(_scalar(node, word).choice, EDGES)
    return EdgeSpec(read_input(_scalar(node, rest.strip()), faults), edge) if known(edge) else UNKNOWN


def _read_initial(node: YamlNode | None, faults: Faults) -> dict[str, InputSpec] | Unknown:
    """Read the values of outputs, by name."""
    if node is None:
        return {}
    named = faults.collect(with_clean_names, node, faults)
    if named is None:
        return UNKNOWN
    found = {port: read_input(value, faults) for port, value in named.values.items()}
    for port, given in found.items():
        if known(given.source) and not isinstance(given.source, YamlNode):
            problem = f"the initial value of '{port}' is a signal"
            faults.add(given.place, problem, "write a constant, such as '2 m' or 'true'")
            found[port] = given._replace(source=UNKNOWN)
    return found


def _scalar(node: YamlScalar, text: str) -> YamlScalar:
    return YamlScalar(text, node.plain, node.file, node.line, node.column, node.key)


def _without(fields: YamlMap, keys: tuple[str, ...]) -> YamlMap:
    """Return a map without some keys."""
    kept = [name for name in fields.values if name not in keys]
    return YamlMap(
        {name: fields.keys[name] for name in kept}, {name: fields.values[name] for name in kept},
        fields.file, fields.line, fields.column, fields.key,
    )  # fmt: skip
