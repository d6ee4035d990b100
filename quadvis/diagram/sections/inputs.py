"""What an entry under `in` says: the source of one input of a block or a part."""

from __future__ import annotations

from typing import NamedTuple

from quadvis.diagram.computed import is_computed
from quadvis.diagram.parameters import QUANTITY_KEYS
from quadvis.diagram.reference import Reference, read_reference
from quadvis.diagram.sections.block_schema import WIRE_KEYS
from quadvis.document import YamlList, YamlMap, YamlNode, YamlScalar
from quadvis.errors import UNKNOWN, Faults, Place, Unknown
from quadvis.graph.graph import CROSSINGS
from quadvis.units import plain_text


class InputSpec(NamedTuple):
    """The source of an input: a signal or a constant, and how it crosses between rates and computers.

    For an input of any number, a list of signals is a tuple of their sources.
    """

    place: Place
    source: Reference | YamlNode | Unknown | tuple[InputSpec, ...]
    across: str | Unknown | None = None
    across_place: Place | None = None
    over: YamlNode | None = None
    initial: YamlNode | None = None

    @property
    def entries(self) -> tuple[InputSpec, ...]:
        """What an input of any number takes: each entry of a list, or the one source that is written."""
        if isinstance(self.source, YamlList):
            return tuple(InputSpec(node.place, node) for node in self.source.items())
        return self.source if isinstance(self.source, tuple) else (self,)

    @property
    def constants(self) -> tuple[YamlNode, ...]:
        """The values in it, which may name parameters."""
        if isinstance(self.source, tuple):
            return tuple(value for entry in self.source for value in entry.constants)
        own = (self.source,) if isinstance(self.source, YamlNode) else ()
        return own if self.initial is None else (*own, self.initial)


def read_input(node: YamlNode, faults: Faults) -> InputSpec:
    """Read ``block.port``, ``{from: block.port, across: hold}``, ``1 m`` or ``{value: ..., unit: ...}``.

    A list with a signal in it is one for an input of any number; a list of constants may be an array.
    """
    if isinstance(node, YamlList) and any(_names_signal(item) for item in node):
        return InputSpec(node.place, tuple(read_input(item, faults) for item in node))
    is_value = isinstance(node, YamlMap) and any(key in node for key in QUANTITY_KEYS)
    if isinstance(node, YamlMap) and is_value and "from" in node:
        faults.add(node.place, "a signal and a value are given at once", "keep 'from' or 'value'")
        return InputSpec(node.place, UNKNOWN)
    if isinstance(node, YamlMap) and not is_value:
        node = node.fields(WIRE_KEYS[:1], WIRE_KEYS[1:], faults)
        source = read_reference(node["from"], faults) if "from" in node else UNKNOWN
        across = node.get("across")
        if across is not None:
            crossing: str | Unknown | None = faults.read(across.choice, CROSSINGS)
        else:
            crossing = UNKNOWN if not {*node} <= {*WIRE_KEYS} else None  # under a key that is wrong
        place = across.place if across is not None else None
        return InputSpec(node.place, source, crossing, place, node.get("over"), node.get("initial"))
    if isinstance(node, YamlScalar) and is_reference(node.value):
        return InputSpec(node.place, read_reference(node, faults))
    return InputSpec(node.place, node)


def _names_signal(node: YamlNode) -> bool:
    """Say whether an entry of a list is meant as a signal."""
    if isinstance(node, YamlMap):
        return not any(key in node for key in QUANTITY_KEYS)
    return isinstance(node, YamlScalar) and is_reference(node.value)


def is_reference(text: str) -> bool:
    """Say whether an input's text is meant as a signal: no number, truth value, ``$name`` or arithmetic."""
    is_name = (text[:1].isalpha() or text[:1] == "_") and text not in ("true", "false")
    if not is_name or not ("$" in text or "(" in text or text.startswith("pi")):
        return is_name
    return not is_computed(text) and plain_text(text) == text
